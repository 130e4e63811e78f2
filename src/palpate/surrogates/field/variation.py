"""How a dimple differs from place to place: products of splines and polynomials, small beside the dimple itself.

Near an edge, over a thin part or beside something stiff the same probe makes another dimple. With the foot o, the
offset ξ = X − o, ρ = |ξ| and q = (o in one or more directions, further inputs), scaled to [−1, 1],

    v(X; c, p) = Σ_h ξ_h/L Σ_i B_i(ρ/L) Σ_j B_j(s/s*) Σ_m P_m(q) T[j, m, i, h]        ξ_h/L = 1, ξ_x/L, ξ_y/L, ξ_z/L

per component, on the dimple's nodes. P_m are products of Chebyshev polynomials of bounded total degree; beyond [−1, 1]
they keep the value at the border.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError

__all__ = ["OFFSETS", "Variation", "polynomials"]

OFFSETS = 4  # 1 and three coordinates of the offset


@dataclass(frozen=True, eq=False)
class Variation:
    """What is added to a dimple's table, as it depends on the place and further inputs.

    Attributes
    ----------
    table : (q, m, r, 4, components)
        Coefficients of the splines in s (q), polynomials (m), splines in ρ (r) and offsets.
    powers : (m, v) int
        Degree of each polynomial in each of the v variables.
    axes : (a, 3)
        Directions in which the foot is told.
    scales : (2, v)
        Centre and half of the range of the foot along the axes (m) and of the further inputs.

    Raises
    ------
    UsageError
        If the parts do not fit.
    """

    table: np.ndarray
    powers: np.ndarray
    axes: np.ndarray
    scales: np.ndarray

    def __post_init__(self) -> None:
        own_arrays(self, "table", "axes", "scales")
        own_arrays(self, "powers", dtype=np.int64)
        if not self._fits():
            raise UsageError(
                f"A table of shape {self.table.shape} is not how a dimple varies.",
                why="Its splines, polynomials, axes and scales must fit, and be finite.",
                fix="Let `palpate.learning.fields` fit it.",
            )

    def _fits(self) -> bool:
        table, powers, axes, scales = self.table, self.powers, self.axes, self.scales
        if table.ndim != 5 or powers.ndim != 2 or axes.ndim != 2 or scales.shape != (2, powers.shape[1]):
            return False
        shapes = table.shape[1] == len(powers) and table.shape[3] == OFFSETS and axes.shape[1] == 3
        sizes = min(table.shape[0], table.shape[2]) >= 4 and table.shape[4] in (1, 3)
        known = np.isfinite(table).all() and np.isfinite(axes).all() and np.isfinite(scales).all()
        signs = (scales[1] > 0).all() and (powers >= 0).all() and len(axes) <= powers.shape[1]
        return bool(shapes and sizes and known and signs)

    def variables(self, feet: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """Scaled variables (N, v) of feet (N, 3) in m and further inputs (N, p)."""
        told = np.hstack([feet @ self.axes.T, parameters])
        return np.asarray(np.clip((told - self.scales[0]) / self.scales[1], -1.0, 1.0))


def polynomials(variables: np.ndarray, powers: np.ndarray) -> np.ndarray:
    """Products (N, m) of Chebyshev polynomials of degrees (m, v) at variables (N, v) in [−1, 1]."""
    angles = np.arccos(variables)
    return np.asarray(np.cos(angles[:, None] * powers).prod(axis=2))
