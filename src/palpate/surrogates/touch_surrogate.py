"""A touched body as one energy, learnt: exactly zero without contact, and its force a gradient everywhere.

    U(c, p) = U₀(s(c)) exp ℓ(c, p),      s = R − d(c),      F = −∂U/∂c

c is the centre of the rigid probe (m), d the signed distance to the touched surface at rest, U₀ a contact law
(`laws`), ℓ a network of one output, p any further inputs of a family of bodies. F is the force on the probe.
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
from palpate.surrogates.laws import ContactLaw
from palpate.surrogates.learnt_energy import LearntEnergy, history_in_words
from palpate.surrogates.surface import TouchedSurface
from palpate.surrogates.surrogate_evaluator import SurrogateEvaluator
from palpate.surrogates.touch_kernels import SMALL, touches_into
from palpate.units import bounds

__all__ = ["TouchSurrogate"]

_STEP = 1e-3  # of the radius: the difference that finds the third derivative of the distance


@dataclass(frozen=True, eq=False)
class TouchSurrogate(LearntEnergy):
    """Energy, force and stiffness of a touch as a value: `save` and `load` give it back bit for bit.

    Attributes
    ----------
    network : Network
        ℓ = ln(U/U₀) of (c_x, c_y, c_z, …), one output; its inputs' ranges are the trained ones.
    law : ContactLaw
    surface : TouchedSurface
    radius : float
        R of the probe, m; not used where `radius_input` says which input it is.
    radius_input : int, optional
        The input, 3 or later, that is the probe's radius.
    region : TrainedRegion, optional
        Of the scaled training inputs; without it the ranges alone are the trained region.
    continuation : Continuation, optional
        How far ℓ is followed beyond its training; of the network's ranges unless given.
    root : (1 + n + h, z), optional
        Root of the covariance of ℓ's tail and weights, in the network's scaled output: what `deviation` needs.
    meta : mapping
        JSON-able. `__str__` tells of ``solves``, ``samples`` and ``force_error`` (a mapping with ``median`` and
        ``p95``, relative) where they are there.

    Raises
    ------
    UsageError
        If the parts do not fit together.
    """

    WORDS = "touch surrogate"

    network: Network
    law: ContactLaw
    surface: TouchedSurface
    radius: float = math.nan
    radius_input: int | None = None
    region: TrainedRegion | None = None
    continuation: Continuation | None = None
    root: np.ndarray | None = None
    meta: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if len(self.network.inputs) >= 3 and self.network.basis is not None:
            object.__setattr__(self, "network", self.network.select([0]))
        if self.continuation is None and len(self.network.inputs) >= 3:
            object.__setattr__(self, "continuation", Continuation.of(self.network.inputs))
        own_arrays(self, "root")
        if fault := self._fault():
            raise UsageError(
                f"A touch surrogate can't be made: {fault}.",
                why="Its network, radius, region and posterior must speak of the same inputs.",
                fix="Make them of one set of samples, the centre's three coordinates first.",
            )

    def _fault(self) -> str:
        """What does not fit; "" if all does."""
        n = len(self.network.inputs)
        if n < 3 or len(self.network.outputs) != 1:
            return (
                f"its network has {n} inputs and {len(self.network.outputs)} outputs, not 3 or more and one"
            )
        if fault := self._fault_of_radius():
            return fault
        if self.region is not None and self.region.points.shape[1] != n:
            return f"its region has {self.region.points.shape[1]} inputs, its network {n}"
        if self.continuation is not None and self.continuation.widths.shape != (n,):
            return f"its continuation has {self.continuation.widths.size} widths for {n} inputs"
        rows, root = 1 + n + self.network.units, self.root
        if root is not None and not (root.ndim == 2 and len(root) == rows and np.isfinite(root).all()):
            return f"its posterior has shape {root.shape}, not {rows} finite rows"
        return ""

    def _fault_of_radius(self) -> str:
        n, own, reach = len(self.network.inputs), self.radius_input, self.surface.reach
        if own is not None and not 3 <= own < n:
            return f"input {own} can't be the radius of {n} inputs, the first three being the position"
        low = self.radius if own is None else self.network.inputs[own].low
        high = self.radius if own is None else self.network.inputs[own].high
        if not (math.isfinite(low) and low > 0):
            return f"its probe has a radius of {low} m"
        if high > reach * (1.0 + 1e-9):
            return f"its probe of {high:g} m is in touch before its surface's distance begins, at {reach:g} m"
        return ""

    def __repr__(self) -> str:
        return str(self)

    def __str__(self) -> str:
        return f"TouchSurrogate: {', '.join(str(r) for r in self.inputs)}; {self.made_of}"

    @property
    def made_of(self) -> str:
        """Probe, contact law, units and what it learnt from, in words."""
        probe = (
            f"of radius {1e3 * self.radius:g} mm"
            if self.radius_input is None
            else f"whose radius is {self.inputs[self.radius_input].name!r}"
        )
        units = (
            f"{self.network.units} {self.network.form} units" if self.network.units else "an affine factor"
        )
        return f"sphere {probe}; {self.law}; {units}{history_in_words(self.meta)}"

    @cached_property
    def _fixed(self) -> tuple[Any, ...]:
        """What never changes of the kernels' arguments: numbers, limits, points, grams."""
        going, region = self.continuation, self.region
        assert going is not None
        low, high = bounds(self.inputs)
        own = -1 if self.radius_input is None else self.radius_input
        radius = self.radius if own < 0 else self.inputs[own].low
        numbers = np.array(
            [
                *self.law.numbers(),
                radius,
                own,
                going.deepest,
                going.depth_width,
                math.inf if region is None else region.radius,
                _STEP * radius,
            ]
        )
        points = np.zeros((0, len(self.inputs))) if region is None else region.points
        return numbers, np.array([low, high, going.widths]), points, gram(self.network, 3)

    def compiled(self) -> tuple[Any, ...]:
        """What `touch_into` takes after its answer, with scratch for one thread."""
        scratch = (np.zeros((4, len(self.inputs))), np.zeros((SMALL, 3, 3)))
        return (*scratch, *self._fixed, self.surface.compiled(), self.network.compiled())

    def _fill(self, X: np.ndarray, answers: np.ndarray, inside: np.ndarray) -> None:
        touches_into(X, answers, inside, *self.compiled())

    def depth(self, X: np.ndarray) -> np.ndarray:
        """s (N,) of the rigid probe into the surface at rest, m; negative without contact."""
        return self._answers(X)[1][:, 1].copy()

    def evaluator(self) -> SurrogateEvaluator:
        """The allocation-free evaluator of the 1 kHz path."""
        somewhere = [r.low for r in self.inputs]
        return SurrogateEvaluator(self.compiled(), self._compiled_posterior(), somewhere)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the surrogate to one file.

        Raises
        ------
        UsageError
            If the file can't be written.
        """
        from palpate.surrogates.touch_file import save_surrogate

        return save_surrogate(path, self)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> TouchSurrogate:
        """Read a surrogate back.

        Raises
        ------
        FileFormatError
            If the file is missing, corrupt, foreign or from a later version.
        """
        from palpate.surrogates.touch_file import load_surrogate

        return load_surrogate(path)
