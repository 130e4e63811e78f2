"""The energy of a learnt body: force and stiffness from one function, and whether and how far they may be trusted.

    U(x, p) = U₀(x, p) exp ℓ(D x, p) − offset        F = −∂U/∂x

U₀ is the baseline (`palpate.surrogates.baselines`), ℓ a network of one output, x the place that a hand moves, D x the
coordinates that the body feels and p further inputs. The force is a gradient everywhere.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError
from palpate.format import count
from palpate.kernels import for_rows
from palpate.network import Network, TrainedRegion
from palpate.network.network_kernels import gram
from palpate.processes import available_cores
from palpate.surrogates.arguments import rows_of
from palpate.surrogates.baselines import Baseline
from palpate.surrogates.continuation import Continuation
from palpate.surrogates.energy_evaluator import EnergyEvaluator
from palpate.surrogates.energy_kernels import (
    ANSWER,
    FORCE,
    SMALL,
    STIFFNESS,
    covariances_into,
    entry_of,
    trusts_into,
)
from palpate.units import Range, bounds

__all__ = ["LearntEnergy"]

_SAMPLES = 4096  # places drawn in the trained ranges, to find what is largest there
_PART = 2000  # answers that are worth a thread: about 10 ms


@dataclass(frozen=True, eq=False)
class LearntEnergy:
    """An energy, its force and its stiffness, as a value.

    Attributes
    ----------
    network : Network
        ℓ of the felt coordinates (m), one, two or three, then of further inputs; one output. Its inputs' ranges are
        the trained ones.
    baseline : Baseline
        U₀, and the directions of the felt coordinates.
    region : TrainedRegion, optional
        Of the scaled training inputs; without it the ranges alone are the trained region.
    continuation : Continuation, optional
        How far ℓ is followed beyond its training; by default the baseline's share of the network's ranges.
    root : (1 + n + h, z), optional
        Root of the covariance of ℓ's tail and weights, in the network's scaled output: what `deviation` needs.

    Raises
    ------
    UsageError
        If the parts do not fit together.
    """

    network: Network
    baseline: Baseline
    region: TrainedRegion | None = None
    continuation: Continuation | None = None
    root: np.ndarray | None = None

    def __post_init__(self) -> None:
        inputs = self.network.inputs
        if self.network.basis is not None:
            object.__setattr__(self, "network", self.network.select([0]))
        if self.continuation is None:
            felt = len(self.baseline.directions)
            going = Continuation.of(inputs, share=self.baseline.share, felt=felt)
            object.__setattr__(self, "continuation", going)
        own_arrays(self, "root")
        if fault := self._fault():
            raise UsageError(
                f"A learnt energy can't be made: {fault}.",
                why="Its network, baseline, region and posterior must speak of the same inputs.",
                fix="Make them of one set of solves, the felt coordinates first.",
            )

    def _fault(self) -> str:
        """Return what does not fit; "" if all does."""
        n, m = len(self.network.inputs), len(self.network.outputs)
        if m != 1 or self.network.scaling.is_bent:
            return (
                f"its network has {m} outputs, not one"
                if m != 1
                else "its network's inputs are on bent scales"
            )
        if fault := self.baseline.fault(self.network.inputs):
            return fault
        if self.region is not None and self.region.points.shape[1] != n:
            return f"its region has {self.region.points.shape[1]} inputs, its network {n}"
        if self.continuation is not None and self.continuation.widths.shape != (n,):
            return f"its continuation has {self.continuation.widths.size} widths for {n} inputs"
        rows, root = 1 + n + self.network.units, self.root
        if root is not None and not (root.ndim == 2 and len(root) == rows and np.isfinite(root).all()):
            return f"its posterior has shape {root.shape}, not {rows} finite rows"
        return ""

    def __repr__(self) -> str:
        return str(self)

    def __str__(self) -> str:
        units = (
            f"{count(self.network.units, f'{self.network.form} unit')}"
            if self.network.units
            else "an affine factor"
        )
        return f"{self.baseline}; {units}"

    @property
    def inputs(self) -> tuple[Range, ...]:
        """Names and trained ranges of all inputs: the felt coordinates (m), then the further ones."""
        return self.network.inputs

    @property
    def parameters(self) -> tuple[Range, ...]:
        """The inputs after the felt coordinates."""
        return self.network.inputs[len(self.baseline.directions) :]

    @property
    def going(self) -> Continuation:
        """The continuation, which is always there once the value is made."""
        assert self.continuation is not None
        return self.continuation

    def trained_rows(self) -> np.ndarray:
        """Return inputs (N, n) within the trained ranges: their middle, random ones, and those learnt from."""
        low, high = bounds(self.inputs)
        X = np.random.default_rng(0).uniform(low, high, (_SAMPLES, len(low)))
        X[0] = (low + high) / 2.0
        if self.region is None:
            return X
        scaling = self.network.scaling
        return np.vstack([X, scaling.unscale_inputs(self.region.points)])

    @cached_property
    def _constants(self) -> tuple[Any, ...]:
        """Numbers, limits, points, directions and grams, which never change."""
        region, going = self.region, self.going
        low, high = bounds(self.inputs)
        numbers = np.array([math.inf if region is None else region.radius, going.deepest, going.depth_width])
        points = np.zeros((0, len(self.inputs))) if region is None else region.points
        # as a region's own are: another kind of array would be compiled for anew
        points.flags.writeable = False
        axes = np.ascontiguousarray(self.baseline.directions, dtype=np.float64)
        return numbers, np.array([low, high, going.widths]), points, axes, gram(self.network, len(axes))

    def compiled(self) -> tuple[Any, ...]:
        """Return what the kernels take after their answer, with scratch for one thread."""
        n, k = len(self.inputs), len(self.baseline.directions)
        scratch = np.zeros((5, n)), np.zeros((SMALL, 3, 3)), np.zeros((1 + k, k)), np.zeros(4), np.zeros(3)
        return (*scratch, *self._constants, self.baseline.compiled().args, self.network.compiled())

    def _fill(self, X: np.ndarray, answers: np.ndarray, inside: np.ndarray) -> None:
        """Fill answers (N, 19) and inside (N,) of places and parameters X (N, 3 + p)."""
        entry = entry_of(self.baseline.compiled())
        for_rows(entry.rows, len(X), entry.one)(X, answers, inside, *self.compiled())

    def _answers(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return checked inputs (N, n), answers (N, 19) and inside (N,)."""
        X = rows_of(X, self.inputs, "learnt body")
        places = self._places(X)
        answers, inside = np.empty((len(X), ANSWER)), np.empty(len(X), dtype=np.bool_)
        parts = max(1, min(available_cores(), len(X) // _PART))
        if parts == 1:
            self._fill(places, answers, inside)
        else:
            ends = np.linspace(0, len(X), parts + 1).astype(int)
            some = [slice(a, b) for a, b in itertools.pairwise(ends)]
            with ThreadPoolExecutor(parts) as threads:  # the kernels need no lock of the interpreter
                list(threads.map(lambda rows: self._fill(places[rows], answers[rows], inside[rows]), some))
        if not np.isfinite(answers[:, 0]).all():
            row = int(np.flatnonzero(~np.isfinite(answers[:, 0]))[0])
            raise UsageError(
                f"Row {row} of {len(X)} inputs is too large to be answered: {X[row]}.",
                why="The force there is larger than any number.",
                fix="Ask within the trained ranges, or near them.",
            )
        return X, answers, inside

    def _places(self, X: np.ndarray) -> np.ndarray:
        """Return places in space and parameters (N, 3 + p) of inputs (N, k + p)."""
        D = self.baseline.directions
        k = len(D)
        return X if k == 3 else np.ascontiguousarray(np.hstack([X[:, :k] @ D, X[:, k:]]))

    def energy(self, X: np.ndarray) -> np.ndarray:
        """Return U (N,) at inputs X (N, n), J: the work of the hand on its way there.

        Raises
        ------
        UsageError
            If X has another number of columns, or holds what is no finite number; so do all that take X.
        """
        return self._answers(X)[1][:, 0].copy()

    def force(self, X: np.ndarray) -> np.ndarray:
        """Return F = −∂U/∂x (N, 3), the force on the hand, N."""
        return self._answers(X)[1][:, FORCE].copy()

    def stiffness(self, X: np.ndarray) -> np.ndarray:
        """Return ∂F/∂x (N, 3, 3), symmetric, N/m; a body that resists has negative eigenvalues."""
        return self._answers(X)[1][:, STIFFNESS].reshape(-1, 3, 3).copy()

    def response(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return energy (N,), force (N, 3) and stiffness (N, 3, 3) together, in the time of one of them."""
        _, answers, _ = self._answers(X)
        return answers[:, 0].copy(), answers[:, FORCE].copy(), answers[:, STIFFNESS].reshape(-1, 3, 3).copy()

    def depth(self, X: np.ndarray) -> np.ndarray:
        """Return the baseline's own coordinate s (N,), m: a probe's depth, negative without contact, or a pad's way."""
        return self._answers(X)[1][:, 1].copy()

    def inside(self, X: np.ndarray) -> np.ndarray:
        """Return whether the answers (N,) are of the trained region: in all ranges, and near a training input.

        Without contact a touch's answer, zero, is exact, and counts as inside.
        """
        return self._answers(X)[2]

    def deviation(self, X: np.ndarray) -> np.ndarray:
        """Return the standard deviation (N,) of the force relative to its size; zero where there is none.

        Raises
        ------
        UsageError
            If there is no posterior.
        """
        return self._by_posterior(X, trusts_into, ())

    def force_covariance(self, X: np.ndarray) -> np.ndarray:
        """Return the covariance (N, 3, 3) of the force, N²: how far it may be off in which direction.

        First order in the weights; its trace is (deviation · ‖F‖)². Zero where there is no force.

        Raises
        ------
        UsageError
            If there is no posterior.
        """
        return self._by_posterior(X, covariances_into, (3, 3))

    def _by_posterior(self, X: np.ndarray, kernel: Callable[..., None], shape: tuple[int, ...]) -> np.ndarray:
        """Return what a kernel of trust finds for each row, (N, *shape)."""
        if self.root is None:
            raise UsageError(
                "This surrogate does not know its deviation.",
                why="It has no posterior of its weights.",
                fix="Learn it with one, or give `root`.",
            )
        X, answers, _ = self._answers(X)
        root, net = self._compiled_posterior()
        out, columns = np.empty((len(X), *shape)), np.zeros((4, root.shape[1]))
        for_rows(kernel, len(X))(X, answers, out, root, columns, self._constants[3], net)
        return out

    def _compiled_posterior(self) -> tuple[np.ndarray, tuple[Any, ...]]:
        """Return the root and the network that the kernels of trust take, with scratch for one thread."""
        root, network = self.posterior
        return root, network.compiled()

    @cached_property
    def posterior(self) -> tuple[np.ndarray, Network]:
        """The posterior's root (1 + n + k, z) in units of ℓ, (0, 0) without one, and the network of its k units.

        Of a mean of networks only the first one's units have a covariance.
        """
        if self.root is None:
            return np.zeros((0, 0)), self.network
        tail = 1 + len(self.inputs)
        units = np.flatnonzero(self.root[tail:].any(axis=1))
        count = 1 + int(units.max()) if units.size else 0
        some = replace(
            self.network,
            factors=self.network.factors[:count],
            shifts=self.network.shifts[:count],
            weights=self.network.weights[:, :count],
        )
        return self.root[: tail + count] * self.network.scaling.output_scale[0], some

    def evaluator(self, *, few: bool = False) -> EnergyEvaluator:
        """Return the allocation-free evaluator of the 1 kHz path.

        One for a `few` places does not wait for a compiler: it interprets the kernels that are not compiled.
        """
        somewhere = self._places(np.array([[r.low for r in self.inputs]]))[0]
        one = entry_of(self.baseline.compiled()).one
        one = for_rows(one, 1) if few else one
        return EnergyEvaluator(one, self.compiled(), self._compiled_posterior(), somewhere)
