"""The part of a field that moves with the probe, and its variation from place to place.

Modes are fixed in the body, and a shape that moves needs one for nearly every place where it may be. So what is the
same everywhere in the probe's own frame is taken out before, as the **local mode**:

    contact point   o = c − d ∇d, the touched place at rest, with the normal n = ∇d
    node X          ρ = |X − o|,  t = (X − o) less its part along n
    vector          f(s) [g₀(ρ, s) n + g₁(ρ, s) t/L]        scalar   f(s) g₀(ρ, s)

on the nodes of the touched surface with ρ < L, else zero. g is a product of uniform cubic B-splines (de Boor 1978) in
ρ and s; in a field's the last three in ρ are zero, so that it ends at L with two continuous derivatives.

Near an edge, over a thin part or beside something stiff the same probe makes another shape. That **variation** is small
beside the local mode itself: with the offset ξ = X − o and q = (o in one or more directions, further inputs), scaled to
[−1, 1], it is

    v(X; c, p) = Σ_h ξ_h/L Σ_i B_i(ρ/L) Σ_j B_j(s/s*) Σ_m P_m(q) T[j, m, i, h]        ξ_h/L = 1, ξ_x/L, ξ_y/L, ξ_z/L

per component. P_m are products of Chebyshev polynomials of bounded total degree; beyond [−1, 1] they keep the value at
the border.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError
from palpate.surrogates.surface import TouchedSurface

__all__ = ["OFFSETS", "LocalMode", "Variation", "design", "polynomials", "products", "splines"]

OFFSETS = 4  # 1 and three coordinates of the offset


@dataclass(frozen=True, eq=False)
class Variation:
    """The part that is added to a local mode's table, as it depends on the place and further inputs.

    Attributes
    ----------
    table : (q, m, r, 4, components)
        Coefficients of the splines in s (q), polynomials (m), splines in ρ (r) and offsets.
    powers : (m, v) int
        Degree of each polynomial in each of the v variables.
    axes : (a, 3)
        Directions along which the contact point is measured.
    scales : (2, v)
        Centre and half of the range of the contact point along the axes (m) and of the further inputs.

    Raises
    ------
    UsageError
        If the parts do not fit.
    """

    table: np.ndarray
    powers: Annotated[np.ndarray, np.int64]
    axes: np.ndarray
    scales: np.ndarray

    def __post_init__(self) -> None:
        own_arrays(self, "table", "axes", "scales")
        own_arrays(self, "powers", dtype=np.int64)
        if not self._fits():
            raise UsageError(
                f"A table of shape {self.table.shape} is not how a local mode varies.",
                why="Its splines, polynomials, axes and scales must fit, and be finite.",
                fix="Let `palpate.learning.fields` fit it.",
            )

    def _fits(self) -> bool:
        table, powers, axes, scales = self.table, self.powers, self.axes, self.scales
        if table.ndim != 5 or powers.ndim != 2 or axes.ndim != 2 or scales.shape != (2, powers.shape[1]):
            return False
        shapes = table.shape[1] == len(powers) and table.shape[3] == OFFSETS and axes.shape[1] == 3
        sizes = min(table.shape[0], table.shape[2]) >= 4 and table.shape[4] in (1, 3)
        finite = np.isfinite(table).all() and np.isfinite(axes).all() and np.isfinite(scales).all()
        signs = (scales[1] > 0).all() and (powers >= 0).all() and len(axes) <= powers.shape[1]
        return bool(shapes and sizes and finite and signs)

    def variables(self, feet: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """Scaled variables (N, v) of feet (N, 3) in m and further inputs (N, p)."""
        variables = np.hstack([feet @ self.axes.T, parameters])
        return np.asarray(np.clip((variables - self.scales[0]) / self.scales[1], -1.0, 1.0))


def polynomials(variables: np.ndarray, powers: np.ndarray) -> np.ndarray:
    """Products (N, m) of Chebyshev polynomials of degrees (m, v) at variables (N, v) in [−1, 1]."""
    angles = np.arccos(variables)
    return np.asarray(np.cos(angles[:, None] * powers).prod(axis=2))


def splines(t: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """First index (N,) and the four values (N, 4) of the uniform cubic B-splines at t in [0, count − 3]."""
    t = np.clip(t, 0.0, count - 3.0)
    first = np.minimum(t.astype(np.int64), count - 4)
    u = t - first
    v = 1.0 - u
    four = [v**3, 3 * u**3 - 6 * u**2 + 4, 3 * v**3 - 6 * v**2 + 4, u**3]
    return first, np.stack(four, axis=-1) / 6.0


def design(t: np.ndarray, count: int) -> np.ndarray:
    """All `count` uniform cubic B-splines (N, count) at t (N,) in [0, count − 3]."""
    first, four = splines(t, count)
    out = np.zeros((len(first), count))
    np.put_along_axis(out, first[:, None] + np.arange(4), four, axis=1)
    return out


def products(offsets: np.ndarray, depths: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Products of the splines (N, r, q) at ρ/L in [0, 1) and s/s* in [0, 1], both (N,), for a shape (r, q)."""
    r, q = shape
    return np.asarray(design(offsets * (r - 3), r)[:, :, None] * design(depths * (q - 3), q)[:, None])


@dataclass(frozen=True, eq=False)
class LocalMode:
    """A moving part of a field.

    Attributes
    ----------
    table : (parts, r, q)
        Coefficients of the splines in ρ (r) and s (q), for g₀ and, of vectors, g₁.
    reach : float
        L, m.
    within : float
        Nodes as near as this (m) to the touched surface at rest belong to it.
    variation : Variation, optional
        How it differs from place to place.

    Raises
    ------
    UsageError
        If the table or a length is none, or the variation is of another kind of field or other splines in ρ.
    """

    table: np.ndarray
    reach: float
    within: float
    variation: Variation | None = None

    def __post_init__(self) -> None:
        own_arrays(self, "table")
        table = self.table
        fits = table.ndim == 3 and table.shape[0] in (1, 2) and min(table.shape[1:]) >= 4
        sized = 0 < self.reach < np.inf and 0 < self.within < np.inf
        if not (fits and sized and np.isfinite(table).all()):
            raise UsageError(
                f"A table of shape {table.shape} to {self.reach} m, within {self.within} m, is no local mode.",
                why="It holds finite coefficients of four splines or more each way.",
                fix="Let `palpate.learning.fields` fit it.",
            )
        own, parts = self.variation, {1: 1, 3: 2}
        if own is not None and (
            own.table.shape[2] != table.shape[1] or parts[own.table.shape[4]] != len(table)
        ):
            raise UsageError(
                f"A variation of shape {own.table.shape} is of another local mode than a table of shape {table.shape}.",
                why="Both have the same splines in ρ and the same components.",
                fix="Let `palpate.learning.fields` fit both.",
            )

    def touches(self, surface: TouchedSurface, points: np.ndarray) -> np.ndarray:
        """Which nodes (nodes, 3) move with it, (nodes,) bool."""
        return np.asarray(np.abs(surface.at(np.ascontiguousarray(points))[0]) < self.within)
