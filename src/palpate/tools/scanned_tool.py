"""A tool of any shape, as a smooth signed distance over a lattice.

The distance is a tricubic B-spline, so it has two continuous derivatives. Its coefficients are kept as sums of products
of splines of one coordinate each (Tucker 1966),

    d(x, y, z) = Σ_ijk C_ijk u_i(x) v_j(y) w_k(z)

of which ten along each axis hold a smooth shape to a micrometre: so a file of it is small, and finite elements take it
as any other formula. Deep inside, where no body gets, it levels off and has no kink. Beyond the lattice it goes on by
the distance to that.
"""

from __future__ import annotations

import base64
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.format import millimetres
from palpate.tools.tool_shape import Tool, length, parts, positive, where_positive

__all__ = ["ScannedTool"]

_DEGREE = 3
_WIDTHS = 1000  # places along half the width of a cut
_ALLOWED = 2e-3  # of the spacing: by how much products of splines may miss the lattice


def _spline_coefficients(values: np.ndarray) -> np.ndarray:
    """Return coefficients (n + 2, …) of the cubic B-spline through values (n, …) at 0, 1, …, straight at its ends."""
    n = len(values)
    rows = np.zeros((n + 2, n + 2))
    for i in range(n):
        rows[i + 1, i : i + 3] = 1 / 6, 4 / 6, 1 / 6
    rows[0, :3] = rows[-1, -3:] = 1.0, -2.0, 1.0
    ends = np.zeros((1, *values.shape[1:]))
    return np.asarray(np.linalg.solve(rows, np.concatenate([ends, values, ends])))


@dataclass(frozen=True)
class ScannedTool(Tool):
    """A tool that was read from a file of its surface, by `palpate.read_tool`.

    Attributes
    ----------
    name : str
        What it is called, such as the file's name.
    corner : tuple of three floats
        Lower corner of the lattice in m, in the tool's frame.
    spacing : float
        Distance of the lattice's nodes in m.
    nodes : tuple of three ints
        How many nodes the lattice has along each axis.
    ranks : tuple of three ints
        How many splines are multiplied along each axis.
    numbers : str
        Their coefficients in m and the core C, as base64 of 64-bit numbers.
    hull : str
        Corners (n, 3) in m of the tool's convex hull, likewise.
    sizes : tuple of three floats
        In m: from the tool's centre to its foremost point; the radius of a ball around it that is all within the tool;
        and the depth below the surface to which the distance is one, beyond which no pad is pressed.

    Raises
    ------
    UsageError
        If the numbers do not fit the sizes.
    """

    name: str
    corner: tuple[float, float, float]
    spacing: float
    nodes: tuple[int, int, int]
    ranks: tuple[int, int, int]
    numbers: str
    hull: str
    sizes: tuple[float, float, float]

    def __post_init__(self) -> None:
        for field in ("corner", "nodes", "ranks", "sizes"):  # a file has lists
            object.__setattr__(self, field, tuple(getattr(self, field)))
        wanted = sum((n + 2) * r for n, r in zip(self.nodes, self.ranks, strict=True)) + math.prod(self.ranks)
        if len(_unpacked(self.numbers)) != wanted or len(_unpacked(self.hull)) % 3:
            raise UsageError(
                f"The lattice of the tool {self.name!r} is damaged.",
                why=f"It has {len(_unpacked(self.numbers))} numbers, and its sizes ask for {wanted}.",
                fix="Read the tool anew, by pp.read_tool(file, unit=…).",
            )

    def __str__(self) -> str:
        low, high = self._points.min(axis=0), self._points.max(axis=0)
        sizes = " × ".join(millimetres(float(value)) for value in high - low)
        return f"tool {self.name!r} of {sizes}"

    @classmethod
    def of_lattice(
        cls,
        name: str,
        corner: np.ndarray,
        spacing: float,
        values: np.ndarray,
        hull: np.ndarray,
        sizes: tuple[float, float, float],
    ) -> ScannedTool:
        """Return the tool of distances (nx, ny, nz) in m at a lattice's nodes; for the others see the attributes.

        The ranks are the least that leave two thousandths of the spacing where the distance is one.
        """
        sides = [
            np.linalg.svd(np.moveaxis(values, k, 0).reshape(n, -1), full_matrices=False)[0]
            for k, n in enumerate(values.shape)
        ]
        near, allowed = np.abs(values) <= sizes[2], _ALLOWED * spacing
        for rank in range(1, max(values.shape) + 1):
            factors = [side[:, :rank] for side in sides]
            core = np.einsum("xyz,xi,yj,zk->ijk", values, *factors, optimize=True)
            off = np.abs(np.einsum("ijk,xi,yj,zk->xyz", core, *factors, optimize=True) - values)[near]
            if off.max() <= allowed:
                break
        core = _without_small(core, factors, allowed)
        splines = [_spline_coefficients(factor) for factor in factors]
        numbers = np.concatenate([part.ravel() for part in (*splines, core)])
        ranks = tuple(factor.shape[1] for factor in factors)
        place = (float(corner[0]), float(corner[1]), float(corner[2]))
        return cls(name, place, spacing, values.shape, ranks, _packed(numbers), _packed(hull), sizes)

    @cached_property
    def _parts(self) -> tuple[list[np.ndarray], np.ndarray]:
        """The splines' coefficients (n + 2, r) of each axis, and the core C (r, r, r)."""
        numbers = _unpacked(self.numbers)
        ends = np.cumsum([(n + 2) * r for n, r in zip(self.nodes, self.ranks, strict=True)])
        pieces = np.split(numbers, ends)
        splines = [piece.reshape(-1, r) for piece, r in zip(pieces, self.ranks, strict=False)]
        return splines, pieces[3].reshape(self.ranks)

    @cached_property
    def _points(self) -> np.ndarray:
        return _unpacked(self.hull).reshape(-1, 3)

    def distance(self, point: Any) -> Any:
        """Return the signed distance in m of points (..., 3) in m, or of a coefficient function (3,)."""
        within, beyond = [], []
        for x, low, n in zip(parts(point), self.corner, self.nodes, strict=True):
            high = low + (n - 1) * self.spacing
            over = positive(x - high) - positive(low - x)
            within.append((x - over - low) / self.spacing)
            beyond.append(over)
        numpy = isinstance(point, np.ndarray)
        inner = self._at(within) if numpy else self._formula(within)
        outside = sum(over * over for over in beyond)
        return where_positive(outside, inner + length(*beyond), inner)

    def _at(self, places: list[np.ndarray]) -> np.ndarray:
        """Return the spline at places in units of the lattice, one array for each axis."""
        splines, total = self._parts
        values = [_spline(own, place) for own, place in zip(splines, places, strict=True)]
        return np.asarray(np.einsum("ijk,...i,...j,...k->...", total, *values, optimize=True))

    def _formula(self, places: list[Any]) -> Any:
        """Return the same as a coefficient function of NGSolve."""
        import ngsolve

        splines, core = self._parts
        u, v, w = (
            [
                ngsolve.BSpline(_DEGREE + 1, _knots(len(own)), own[:, i].tolist())(place)
                for i in range(own.shape[1])
            ]
            for own, place in zip(splines, places, strict=True)
        )
        total: Any = 0.0
        for i in range(len(u)):
            rows: Any = 0.0
            for j in np.flatnonzero(core[i].any(axis=1)):
                row = sum(float(core[i, j, k]) * w[k] for k in np.flatnonzero(core[i, j]))
                rows = rows + v[j] * row
            total = total + u[i] * rows
        return total

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the reach (N,) in m along unit directions (N, 3)."""
        return np.asarray((direction @ self._points.T).max(axis=1))

    @property
    def front(self) -> float:
        """Distance in m from the centre to the foremost point."""
        return self.sizes[0]

    @property
    def inscribed_radius(self) -> float:
        """Radius in m of a ball around the centre that is all within the tool."""
        return self.sizes[1]

    @property
    def least_radius(self) -> float:
        """Depth in m below the surface to which the distance is one."""
        return self.sizes[2]

    @property
    def size(self) -> float:
        """The inscribed radius in m."""
        return self.sizes[1]

    def half_widths(self, depth: float) -> tuple[float, float]:
        """Return half the width in m along x and along y of the cut at a depth in m above the foremost point."""
        z = -self.front + min(max(depth, 0.0), 2 * self.front)
        return self._half_width(0, z), self._half_width(1, z)

    def _half_width(self, axis: int, z: float) -> float:
        """Return half the width in m along an axis at a height in m, to both sides of the tool's own."""
        reach = np.linspace(0.0, 1.05 * float(np.abs(self._points[:, axis]).max()), _WIDTHS)
        ends = []
        for sign in (-1.0, 1.0):
            line = np.zeros((_WIDTHS, 3))
            line[:, axis], line[:, 2] = sign * reach, z
            d = self.distance(line)
            last = int(np.flatnonzero(d <= 0).max(initial=0))
            after = min(last + 1, _WIDTHS - 1)
            share = d[last] / (d[last] - d[after]) if d[after] > d[last] else 0.0
            ends.append(reach[last] + share * (reach[after] - reach[last]) if d[last] <= 0 else 0.0)
        return float(sum(ends) / 2)


def _without_small(core: np.ndarray, factors: list[np.ndarray], allowed: float) -> np.ndarray:
    """Return a core without the products that together change no distance by more than is allowed, in m."""
    most = np.einsum("i,j,k->ijk", *(np.abs(factor).max(axis=0) for factor in factors))
    share = (np.abs(core) * most).ravel()
    order = np.argsort(share, kind="stable")
    small = order[np.cumsum(share[order]) <= allowed]
    core = core.copy()
    core.ravel()[small] = 0.0
    return core


def _spline(coefficients: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return cubic B-splines (..., r) of coefficients (n + 2, r) at places in units of their nodes."""
    first = np.clip(np.floor(place).astype(int), 0, len(coefficients) - 4)
    t = place - first
    weights = ((1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3)
    return np.asarray(
        sum(weight[..., None] / 6 * coefficients[first + k] for k, weight in enumerate(weights))
    )


def _knots(count: int) -> list[float]:
    """Return the knots of a cubic spline of so many coefficients, of which the second is that of the node 0."""
    return [float(k - _DEGREE) for k in range(count + _DEGREE + 1)]


def _packed(numbers: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(numbers, dtype="<f8").tobytes()).decode()


def _unpacked(text: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), dtype="<f8").astype(float)
