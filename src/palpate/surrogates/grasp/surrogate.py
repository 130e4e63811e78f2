"""A body held by a glued pad as one energy, learnt: nothing at rest, and its force a gradient for every place.

    U(p, d) = ½ ‖S(y) d‖² exp(P(d, y) + ℓ(d, y)),      F = −∂U/∂d at fixed y

d is the displacement of the pad (m), y its place p on the surface and any further inputs of a family of bodies, S a
symmetric root of the stiffness at rest (`rest`), P a polynomial (`stiffening`), ℓ a network of one output. F is the
force on the hand.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError
from palpate.network import Network, TrainedRegion
from palpate.network.network_kernels import gram
from palpate.surrogates.continuation import Continuation
from palpate.surrogates.grasp.evaluator import GraspEvaluator
from palpate.surrogates.grasp.kernels import grasps_into
from palpate.surrogates.grasp.rest import RestStiffness
from palpate.surrogates.grasp.stiffening import Stiffening
from palpate.surrogates.learnt_energy import LearntEnergy, history_in_words
from palpate.surrogates.touch_kernels import SMALL
from palpate.units import bounds

__all__ = ["GraspSurrogate"]

_SHARE = 0.1  # of a range: how far a polynomial may be followed beyond it


@dataclass(frozen=True, eq=False)
class GraspSurrogate(LearntEnergy):
    """Energy, force and stiffness of a held body as a value: `save` and `load` give it back bit for bit.

    Attributes
    ----------
    network : Network
        ℓ of (d_x, d_y, d_z, y…), one output; its inputs' ranges are the trained ones.
    rest : RestStiffness
        S of the inputs after the displacement.
    stiffening : Stiffening, optional
        P of all scaled inputs; zero unless given.
    region : TrainedRegion, optional
        Of the scaled training inputs; without it the ranges alone are the trained region.
    continuation : Continuation, optional
        How far ℓ, P and S are followed beyond their training; a tenth of each range unless given.
    root : (1 + n + h, z), optional
        Root of the covariance of ℓ's tail and weights, in the network's scaled output: what `deviation` needs.
    meta : mapping
        JSON-able. `__str__` tells of ``solves``, ``samples`` and ``force_error`` where they are there.

    Raises
    ------
    UsageError
        If the parts do not fit together.
    """

    WORDS = "grasp surrogate"

    network: Network
    rest: RestStiffness
    stiffening: Stiffening | None = None
    region: TrainedRegion | None = None
    continuation: Continuation | None = None
    root: np.ndarray | None = None
    meta: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        enough = len(self.network.inputs) >= 3
        if enough and self.network.basis is not None:
            object.__setattr__(self, "network", self.network.select([0]))
        if self.continuation is None and enough:
            object.__setattr__(self, "continuation", Continuation.of(self.network.inputs, share=_SHARE))
        if self.stiffening is None:
            object.__setattr__(self, "stiffening", Stiffening.none(len(self.network.inputs)))
        own_arrays(self, "root")
        if fault := self._fault():
            raise UsageError(
                f"A grasp surrogate can't be made: {fault}.",
                why="Its network, stiffness at rest, region and posterior must speak of the same inputs.",
                fix="Make them of one set of samples, the displacement's three components first.",
            )

    def _fault(self) -> str:
        """What does not fit; "" if all does."""
        n, m = len(self.network.inputs), len(self.network.outputs)
        if n < 3 or m != 1:
            return f"its network has {n} inputs and {m} outputs, not 3 or more and one"
        if self.rest.count != n - 3:
            return f"its stiffness at rest depends on {self.rest.count} inputs, its network on {n - 3}"
        stiffening, region, going = self.stiffening, self.region, self.continuation
        for what, count in (
            ("polynomial", n if stiffening is None else stiffening.exponents.shape[1]),
            ("region", n if region is None else region.points.shape[1]),
            ("continuation", n if going is None else len(going.widths)),
        ):
            if count != n:
                return f"its {what} has {count} inputs, its network {n}"
        rows, root = 1 + n + self.network.units, self.root
        if root is not None and not (root.ndim == 2 and len(root) == rows and np.isfinite(root).all()):
            return f"its posterior has shape {root.shape}, not {rows} finite rows"
        return ""

    def __repr__(self) -> str:
        return str(self)

    def __str__(self) -> str:
        names = ", ".join(str(r) for r in self.inputs)
        units = (
            f"{self.network.units} {self.network.form} units" if self.network.units else "an affine factor"
        )
        even = ("the same everywhere", "linear in place", "quadratic in place")[self.rest.degree]
        assert self.stiffening is not None
        law = f"stiffness at rest {even}, polynomial of degree {self.stiffening.degree}"
        return f"GraspSurrogate: {names}; {law}; {units}{history_in_words(self.meta)}"

    @cached_property
    def _fixed(self) -> tuple[Any, ...]:
        """What never changes of the kernels' arguments: radius, limits, points, grams."""
        going, region = self.continuation, self.region
        assert going is not None
        low, high = bounds(self.inputs)
        radius = math.inf if region is None else region.radius
        points = np.zeros((0, len(self.inputs))) if region is None else region.points
        limits = np.array([low, high, going.widths])
        return radius, limits, points, gram(self.network, 3)

    def compiled(self) -> tuple[Any, ...]:
        """What `grasp_into` takes after its answer, with scratch for one thread."""
        scratch = (np.zeros((5, len(self.inputs))), np.zeros((SMALL, 3, 3)))
        assert self.stiffening is not None
        laws = self.rest.compiled(), self.stiffening.compiled()
        *fixed, grams = self._fixed
        return (*scratch, *fixed, laws, grams, self.network.compiled())

    def _fill(self, X: np.ndarray, answers: np.ndarray, inside: np.ndarray) -> None:
        grasps_into(X, answers, inside, *self.compiled())

    def evaluator(self) -> GraspEvaluator:
        """The allocation-free evaluator of the 1 kHz path."""
        somewhere = [r.low for r in self.inputs]
        return GraspEvaluator(self.compiled(), self._compiled_posterior(), somewhere)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the surrogate to one file.

        Raises
        ------
        UsageError
            If the file can't be written.
        """
        from palpate.surrogates.grasp.file import save_grasp

        return save_grasp(path, self)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> GraspSurrogate:
        """Read a surrogate back.

        Raises
        ------
        FileFormatError
            If the file is missing, corrupt, foreign or from a later version.
        """
        from palpate.surrogates.grasp.file import load_grasp

        return load_grasp(path)
