"""Two rigid jaws that close on a body: U₀ = U₀(s₁) + U₀(s₂), the contact law at the mean depth of each jaw's balls.

The inputs are the centre c between the jaws and their opening w. The jaws' places are c ± w/2 e, e the axis, so of a
jaw's depth with ∂s/∂p the derivatives by w are ±½ e·∂s/∂p. Each depth is that of `PosedBaseline`, of balls whose
orientation stays. The stated coordinate is the depth of the deeper jaw.

Deeper than trained, ℓ is followed no farther than the ranges of centre and opening reach.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from palpate.errors import UsageError
from palpate.kernels import for_rows, part
from palpate.surrogates.baselines.baseline import Baseline, register_baseline
from palpate.surrogates.baselines.contact_baseline import ContactBaseline
from palpate.surrogates.baselines.posed_baseline import (
    ROWS,
    TURN,
    PosedBaseline,
    depth_into,
    depths_into,
)
from palpate.surrogates.contact_law import law_at
from palpate.surrogates.energy_kernels import (
    GRADIENT,
    HESSIAN,
    MORE,
    OTHER,
    OUTWARD,
    ROOT,
    VECTORS,
    Compiled,
)
from palpate.surrogates.surface import TouchedSurface
from palpate.tools import Gripper
from palpate.units import Range

__all__ = ["PinchBaseline", "require_one_tool"]

_TWICE, _FACTOR, _LENGTH = range(3)  # places in the numbers of a contact


@register_baseline
@dataclass(frozen=True, eq=False)
class PinchBaseline(PosedBaseline):
    """The contact law of two jaws, whose opening is the fourth input.

    Attributes
    ----------
    law : ContactLaw
        U₀ of one jaw by its depth.
    touched : TouchedSurface
        The surface at rest that both jaws meet.
    probe_radius : float
        Length in m by which ways are measured: the jaws' size.
    radius_at : int, optional
        None: no size of a jaw is an input.
    resolved : float, optional
        Depth (m) below which solves count less, as for a sphere.
    tool : str
        The gripper's description as JSON, from which `Gripper.of` makes it.
    order : float
        As that of a `PosedBaseline`.
    """

    name: ClassVar[str] = "pinch"
    forces: ClassVar[int] = 1

    @cached_property
    def posed_tool(self) -> Gripper:  # type: ignore[override]  # a gripper stands where a tool does
        """The gripper."""
        return Gripper.of(json.loads(self.tool))

    @property
    def surface(self) -> None:  # type: ignore[override]  # the other contacts always have one
        """None: the centre, which a hand moves, lies within the body, and touches no surface itself."""
        return

    @property
    def surfaces(self) -> tuple[TouchedSurface, ...]:
        """The surface that both jaws meet."""
        return (self.touched,)

    @property
    def inner(self) -> float:
        """Infinite: the centre lies inside the body, and the body never lets go."""
        return math.inf

    def fault(self, inputs: tuple[Range, ...]) -> str:
        """Return what does not fit the network's inputs; "" if all does."""
        return "" if len(inputs) == 4 else f"two jaws have 4 inputs, its network {len(inputs)}"

    def compiled(self) -> Compiled:
        """Return the kernels and their arguments."""
        return Compiled(None, self._arguments(), enter=_enter_pinch)

    def _arguments(self) -> tuple[Any, ...]:
        scratch = np.zeros((ROWS, 3, 3))
        scratch[TURN] = np.eye(3)  # balls are in the body's axes
        return (
            self._numbers(),
            self.touched.compiled(),
            *self.posed_tool.balls,
            self.posed_tool.along,
            scratch,
        )

    def c_source(self) -> str:
        """Return the kernels in C99, those of a posed tool before them."""
        own = Path(__file__).with_suffix(".c").read_text("utf-8")
        return f"{super().c_source()}\n{own}"

    def coordinate(self, X: np.ndarray) -> np.ndarray:
        """Return the depth s (N,) of the deeper jaw in the surface at rest, m; not positive without contact."""
        return np.asarray(np.maximum(*(depth for depth, _, _ in self.jaw_depths(X))))

    def jaw_depths(self, X: np.ndarray) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Return for each jaw s (N,) in m, −∂s/∂p (N, 3) and −∂²s/∂p² (N, 3, 3) by its place, at inputs X (N, 4)."""
        numbers, surface, *balls, _, scratch = self._arguments()
        depths = []
        for places, own in zip(self.posed_tool.places(X), balls, strict=True):
            s, slope, bend = np.empty(len(X)), np.empty((len(X), 3)), np.empty((len(X), 3, 3))
            for_rows(depths_into, len(X))(
                np.ascontiguousarray(places), s, slope, bend, numbers, surface, own, np.eye(3), scratch
            )
            depths.append((s, slope, bend))
        return depths

    def logarithm(
        self, X: np.ndarray, inputs: tuple[Range, ...]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return ln U₀ (N,), its gradient (N, 4) and Hessian (N, 4, 4) at X (N, 4) in contact."""
        del inputs
        value, first, second = np.zeros(len(X)), np.zeros((len(X), 4)), np.zeros((len(X), 4, 4))
        for side, (s, slope, bend) in zip((0.5, -0.5), self.jaw_depths(X), strict=True):
            to_place = np.vstack([np.eye(3), side * self.posed_tool.along])  # of changes of the inputs
            log, by, twice = self.law.log(np.where(s > 0, s, 1.0))
            U = np.where(s > 0, np.exp(log), 0.0)
            # of U₀ itself: U' = U λ', U'' = U (λ'' + λ'²)
            up, bent = U * by, U * (twice + by**2)
            up, bent = (np.where(s > 0, term, 0.0) for term in (up, bent))
            value += U
            first -= (up[:, None] * slope) @ to_place.T
            by_place = bent[:, None, None] * slope[:, :, None] * slope[:, None] - up[:, None, None] * bend
            second += to_place @ by_place @ to_place.T
        g = first / value[:, None]
        return np.log(value), g, second / value[:, None, None] - g[:, :, None] * g[:, None]

    def groups(self, X: np.ndarray) -> np.ndarray:
        """Return the number (N,) of each solve's series: openings along one line through the body."""
        across = [i for i in range(3) if not self.posed_tool.along[i]]
        places = np.round(X[:, across] / (1e-3 * self.probe_radius))
        return np.asarray(np.unique(places, axis=0, return_inverse=True)[1].ravel())

    def finest(self, inputs: tuple[Range, ...]) -> np.ndarray:
        """Return the shortest ways (4,) in m over which pinches change: those of a contact, of the opening alike."""
        ways = ContactBaseline.finest(self, inputs)
        ways[3] = 2 * ways[0]
        return ways


def require_one_tool(baseline: Baseline, what: str) -> None:
    """Refuse a body under two jaws.

    Parameters
    ----------
    baseline : Baseline
        Of the body.
    what : str
        Verb and object of what it can't do, in words, such as "have friction".

    Raises
    ------
    UsageError
        For two jaws.
    """
    if not isinstance(baseline, PinchBaseline):
        return
    raise UsageError(
        f"A body under a {baseline.posed_tool} can't {what} yet.",
        why="Its place is the middle between two jaws, and no point of one tool.",
        fix="Ask it in Python or by `palpate ask`, feel it by `palpate view`, or take it as C, library or FMU.",
    )


@part
def _enter_pinch(position, parameters, moved, base, small, numbers, args):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Fill the sum of both jaws' laws and its derivatives by the centre; whether one touches."""
    own, surface, first, last, along, scratch = args
    n, D, place = small[MORE, 1], small[OTHER], small[MORE, 0]
    b, B = small[VECTORS, GRADIENT], small[HESSIAN]
    total, deepest = 0.0, -math.inf
    b[:] = 0.0
    B[:] = 0.0
    for jaw in range(2):
        half = 0.5 * parameters[0] if jaw == 0 else -0.5 * parameters[0]
        for i in range(3):
            place[i] = position[i] + half * along[i]
        s = depth_into(place, n, D, own, surface, first if jaw == 0 else last, scratch)
        if s > deepest:
            deepest = s
            for i in range(3):
                small[VECTORS, OUTWARD, i] = n[i]
        if s <= 0.0:
            continue
        value, slope, curvature = law_at(s, own[_TWICE], own[_FACTOR], own[_LENGTH])
        total += value
        for i in range(3):
            b[i] -= slope * n[i]
            for j in range(3):
                B[i, j] += curvature * n[i] * n[j] - slope * D[i, j]
    base[1] = deepest
    if deepest <= 0.0:
        return False
    base[0], base[2], base[3] = total, 0.0, math.sqrt(2.0 * total)
    for i in range(3):
        small[ROOT, 0, i] = b[i] / base[3]
    return True
