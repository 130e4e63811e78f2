"""A rigid tool of any shape, in any pose, that presses any surface: U₀ = U₀(s), s the mean depth of its balls.

The tool's front is a set of balls (`palpate.tools.front_balls`) of radius r at R b_i from the place p, with shares w_i.
Each lies s_i = r − d(p + R b_i) deep in the surface at rest, d its signed distance. What the law takes is their mean of
order m over those that touch,

    s = (Σ w_i s_i^m)^(1/m),        ∂s/∂p = −s^(1−m) Σ w_i s_i^(m−1) ∇d_i,

which goes over smoothly from a tool that lies flat to one that stands on its edge, and begins where the first ball
touches. Of one ball it is the ball's depth. Derivatives by angles are differences of these.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np

from palpate.errors import UsageError
from palpate.kernels import for_rows, kernel, part
from palpate.surrogates.baselines.baseline import register_baseline
from palpate.surrogates.baselines.contact_baseline import (
    STEP,
    fill_law,
    leave_saturated,
)
from palpate.surrogates.baselines.graph_form import BaselineForm, Graph, Touch, Value
from palpate.surrogates.baselines.tool_baseline import ToolBaseline
from palpate.surrogates.energy_kernels import (
    BEND,
    MORE,
    OTHER,
    OUTWARD,
    SURFACE,
    VECTORS,
    Compiled,
)
from palpate.surrogates.surface import distance_into
from palpate.units import Range

__all__ = ["ROWS", "TURN", "PosedBaseline", "depth_into", "depths_into"]

ANGLE_STEP = 1e-4  # rad, of the differences by angles
_ORDER, _SCALE = 5, 6  # places in the numbers, after those of a contact and its step


@register_baseline
@dataclass(frozen=True, eq=False)
class PosedBaseline(ToolBaseline):
    """The contact law of a rigid tool at the mean depth of the balls of its front.

    Attributes
    ----------
    law : ContactLaw
        U₀ by the mean depth s.
    touched : TouchedSurface
        The surface at rest.
    probe_radius : float
        Length in m by which ways are measured: the tool's size.
    radius_at : int, optional
        None: no size of a tool is an input.
    resolved : float, optional
        Depth (m) below which solves count less, as for a sphere.
    tool : str
        The tool's description as JSON, from which `PosedTool.of` makes it.
    order : float
        m, at least 2; the larger, the more the deepest ball counts.
    """

    name: ClassVar[str] = "posed"

    order: float = 8.0

    @cached_property
    def balls(self) -> np.ndarray:
        """Centres in the tool's frame from its place, radius, both in m, and share (b, 5) of each ball of its front."""
        return self.posed_tool.balls

    @property
    def inner(self) -> float:
        """Depth in m of a ball of the tool's size at which its own balls are as deep as the distance goes."""
        return float(self.touched.inner - (self.probe_radius - self.balls[0, 3]))

    def surface_shift(self, normal: np.ndarray) -> np.ndarray:
        """Return zero (3,): the surface is the body's own."""
        return np.zeros(3)

    def fault(self, inputs: tuple[Range, ...]) -> str:
        """Return what does not fit the network's inputs; "" if all does."""
        wanted = 3 + len(self.posed_tool.angles)
        return "" if len(inputs) == wanted else f"its tool has {wanted} inputs, its network {len(inputs)}"

    def compiled(self) -> Compiled:
        """Return the kernels and their arguments."""
        return Compiled(None, self._arguments(), enter=_enter_posed, leave=_leave_posed)

    def _arguments(self) -> tuple[np.ndarray, tuple[np.ndarray, ...], np.ndarray, np.ndarray, np.ndarray]:
        own = self.posed_tool
        turn = np.eye(3) if own.turn is None else np.ascontiguousarray(own.turn)
        return self._numbers(), self.touched.compiled(), self.balls, turn, np.zeros((ROWS, 3, 3))

    def _numbers(self) -> np.ndarray:
        """Return the law's three numbers, the tool's size and a step in m, the mean's order, and its scale in m."""
        step, scale = STEP * self.probe_radius, self.posed_tool.shape.size
        return np.array([*self.law.numbers(), self.probe_radius, step, self.order, scale])

    @property
    def c_name(self) -> str:
        """Its own, not a ball's."""
        return self.name

    def c_source(self) -> str:
        """Return the kernels in C99, those of a contact before them."""
        own = Path(__file__).with_suffix(".c").read_text("utf-8")
        return f"{super().c_source()}\n{own}"

    def graph_form(self, graph: Graph, place: Value, touch: Touch | None, xi: Value) -> BaselineForm:
        """Refuse: the mean over its balls has no form as a graph.

        Raises
        ------
        UsageError
            Always.
        """
        raise UsageError(
            f"A body under {self.probe_words} has no ONNX form.",
            why="Its baseline is that of a tool that turns or of a curved surface.",
            fix="Ask it in Python, or learn a tool of one orientation on a plane surface.",
        )

    def coordinate(self, X: np.ndarray) -> np.ndarray:
        """Return the mean depth s (N,) of the tool in the surface at rest, m; not positive without contact."""
        return self.law_depth(X)[0]

    def law_depth(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return s (N,) in m, −∂s/∂p (N, 3) and −∂²s/∂p² (N, 3, 3) at inputs X (N, n)."""
        X = np.ascontiguousarray(X, dtype=np.float64)
        s, slope, bend = np.empty(len(X)), np.empty((len(X), 3)), np.empty((len(X), 3, 3))
        for_rows(depths_into, len(X))(X, s, slope, bend, *self._arguments())
        return s, slope, bend

    def logarithm(
        self, X: np.ndarray, inputs: tuple[Range, ...]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return ln U₀ (N,), its gradient (N, n) and Hessian (N, n, n) at X (N, n) in contact; not by angles twice."""
        value, gradient, hessian = super().logarithm(X, inputs)
        for angle in range(3, X.shape[1]):
            step = np.zeros(X.shape[1])
            step[angle] = ANGLE_STEP
            up, down = (super(PosedBaseline, self).logarithm(X + way, inputs)[:2] for way in (step, -step))
            gradient[:, angle] = (up[0] - down[0]) / (2 * ANGLE_STEP)
            mixed = (up[1] - down[1])[:, :3] / (2 * ANGLE_STEP)
            hessian[:, :3, angle] = hessian[:, angle, :3] = mixed
        return value, gradient, hessian


ROWS = 4  # matrices of scratch: a rotation, its factor, a ball's bend, and vectors
TURN, _FACTOR, _BALL_BEND, _LINES = range(ROWS)


@part
def _turn_into(angles, own, scratch) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Put R = exp [w]× R₀ into scratch, w the angles, its last component 0 where there are two."""
    w, R, K = scratch[_LINES, 0], scratch[TURN], scratch[_FACTOR]
    square = 0.0
    for i in range(3):
        w[i] = angles[i] if i < angles.size else 0.0
        square += w[i] * w[i]
    angle = math.sqrt(square)
    first = math.sin(angle) / angle if angle > 1e-8 else 1.0
    half = 0.5 * angle
    second = 0.5 * (math.sin(half) / half) ** 2 if half > 1e-8 else 0.5
    for i in range(3):
        for j in range(3):
            K[i, j] = second * w[i] * w[j]
        K[i, i] += 1.0 - second * square
    K[0, 1] -= first * w[2]
    K[0, 2] += first * w[1]
    K[1, 0] += first * w[2]
    K[1, 2] -= first * w[0]
    K[2, 0] -= first * w[1]
    K[2, 1] += first * w[0]
    for i in range(3):
        for j in range(3):
            R[i, j] = K[i, 0] * own[0, j] + K[i, 1] * own[1, j] + K[i, 2] * own[2, j]


@part
def depth_into(place, slope, bend, numbers, surface, balls, scratch):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Mean depth s at a place (3,) in the orientation in scratch, −∂s/∂p and −∂²s/∂p²; the least gap where all miss."""
    R, D, at, n = scratch[TURN], scratch[_BALL_BEND], scratch[_LINES, 1], scratch[_LINES, 2]
    order, scale = numbers[_ORDER], numbers[_SCALE]
    total, nearest = 0.0, -math.inf
    slope[:] = 0.0
    bend[:] = 0.0
    for k in range(balls.shape[0]):
        for i in range(3):
            at[i] = place[i] + R[i, 0] * balls[k, 0] + R[i, 1] * balls[k, 1] + R[i, 2] * balls[k, 2]
        s = balls[k, 3] - distance_into(at, n, D, *surface)
        nearest = max(nearest, s)
        if s <= 0.0:
            continue
        share = s / scale
        second = balls[k, 4] * share ** (order - 2.0)
        first = second * share
        total += first * share
        for i in range(3):
            slope[i] += first * n[i]
            for j in range(3):
                bend[i, j] += first * D[i, j] - (order - 1.0) / scale * second * n[i] * n[j]
    if total <= 0.0:
        return nearest
    mean = total ** (1.0 / order)
    factor = mean ** (1.0 - order)
    for i in range(3):
        slope[i] *= factor
    for i in range(3):
        for j in range(3):
            bend[i, j] = factor * bend[i, j] + (order - 1.0) / (mean * scale) * slope[i] * slope[j]
    return scale * mean


@kernel
def depths_into(X, depths, slopes, bends, numbers, surface, balls, turn, scratch) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Mean depths and derivatives at rows X (N, 3 + k)."""
    for row in range(X.shape[0]):
        _turn_into(X[row, 3:], turn, scratch)
        depths[row] = depth_into(X[row, :3], slopes[row], bends[row], numbers, surface, balls, scratch)


@part
def _enter_posed(position, parameters, moved, base, small, numbers, args):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Fill the law's energy and derivatives; move the place at which ℓ is asked to the saturated depth."""
    own, surface, balls, turn, scratch = args
    _turn_into(parameters, turn, scratch)
    s = depth_into(position, small[VECTORS, OUTWARD], small[SURFACE], own, surface, balls, scratch)
    return fill_law(s, moved, base, small, numbers, own)


@part
def _leave_posed(position, base, small, numbers, args) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Take ∇ℓ and ∇²ℓ to those by the place, as a contact does."""
    own, surface, balls, _, scratch = args
    if base[1] <= numbers[1]:
        return
    g = small[VECTORS, 1]
    size = math.sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2])
    small[BEND, :, :] = 0.0
    if size > 0.0:
        place, unused, other, step = small[MORE, 0], small[MORE, 1], small[OTHER], own[4]
        for many, weight in ((1.0, 8.0), (-1.0, -8.0), (2.0, -1.0), (-2.0, 1.0)):
            for i in range(3):
                place[i] = position[i] + many * step * g[i] / size
            depth_into(place, unused, other, own, surface, balls, scratch)
            for i in range(3):
                for j in range(3):
                    small[BEND, i, j] += weight * size / (12.0 * step) * other[i, j]
    leave_saturated(base, small, numbers)
