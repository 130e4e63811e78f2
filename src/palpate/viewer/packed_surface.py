"""A surface with its fields in few bytes, for a page that is one file.

Everything is whole numbers, and each number is stored as what it differs from a guess:

- **Triangles** are put in an order in which nearly each one stands across an edge of an earlier one, its *gate*. So a
  triangle is which gate, and its third corner, counted back from the newest point; points are numbered as they appear.
- **Values at points** (coordinates, rest and modes of fields) are guessed by the parallelogram rule of Touma and
  Gotsman (1998, Triangle mesh compression): a new point across the edge a–b from the point d has a + b − d.
- Differences become numbers without sign (0, −1, 1, −2 … as 0, 1, 2, 3 …), whose bytes of equal weight stand together.

Small differences repeat, so gzip packs them well. Coordinates are multiples of a step that the caller chooses, fields
those of the scales with which the modes went out. `client/src/packed.ts` reads all this.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.dataset.carried_surface import CarriedSurface
from palpate.viewer.messages import Modes, Surface

__all__ = ["PackedSurface", "rounded_points"]

_DIRECTIONS = 1e-3  # step of a normal's components
_WEIGHTS = 2**-11  # step of a barycentric coordinate: a hundredth of a millimetre on a side of 20


@dataclass
class _Lists:
    """Lists of whole numbers as bytes, and how many numbers and bytes a number each has."""

    sizes: list[tuple[int, int]] = field(default_factory=list)
    parts: list[bytes] = field(default_factory=list)

    def add(self, numbers: np.ndarray) -> None:
        """Append a list of whole numbers."""
        flat = np.asarray(numbers, dtype=np.int64).ravel()
        plain = ((flat << 1) ^ (flat >> 63)).astype("<u4")
        most = int(plain.max(initial=0))
        width = max(1, (most.bit_length() + 7) // 8)
        self.sizes.append((len(plain), width))
        self.parts.append(plain.view(np.uint8).reshape(-1, 4).T[:width].tobytes())

    @property
    def data(self) -> bytes:
        """All lists, one after the other."""
        return b"".join(self.parts)


@dataclass(frozen=True, eq=False)
class _Order:
    """Triangles and points in the order of the file."""

    points: np.ndarray  # (n,), the point of before that stands at each place
    places: np.ndarray  # (n,), place of each point of before
    triangles: np.ndarray  # (t,), the triangle of before that stands at each place
    gates: np.ndarray  # (t,), how many triangles back the gate is, times three, plus the edge; 0 for none
    thirds: np.ndarray  # (t,), the third corner, counted back from the newest point
    starts: np.ndarray  # (3 s,), corners of the triangles without a gate, counted so
    parents: np.ndarray  # (n, 3), a, b and d of each point; −1 where none are known
    corners: np.ndarray  # (t, 3), points of each triangle, as they come out of the file


def _order_of(triangles: np.ndarray, count: int) -> _Order:
    """Return the order of triangles (t, 3) of so many points: depth first, since near gates have small numbers."""
    across = {}
    for t, (a, b, c) in enumerate(triangles.tolist()):
        across[a, b], across[b, c], across[c, a] = (t, c), (t, a), (t, b)
    places, parents = [-1] * count, np.full((count, 3), -1)
    order: list[int] = []
    gates: list[int] = []
    thirds: list[int] = []
    starts: list[int] = []
    points: list[int] = []
    corners: list[tuple[int, int, int]] = []
    seen = [False] * len(triangles)

    def code(corner: int) -> int:
        if places[corner] < 0:
            places[corner] = len(points)
            points.append(corner)
            return 0
        return len(points) - places[corner]

    for first in range(len(triangles)):
        if seen[first]:
            continue
        a, b, c = triangles[first].tolist()
        starts += [code(a), code(b), code(c)]
        gates.append(0)
        thirds.append(0)
        seen[first] = True
        order.append(first)
        corners.append((places[a], places[b], places[c]))
        # triangle's place, edge of it, the edge's ends and the corner beside them
        stack = [(len(order) - 1, e, *ends) for e, ends in enumerate(((a, b, c), (b, c, a), (c, a, b)))]
        while stack:
            place, edge, a, b, d = stack.pop()
            t, c = across.get((b, a), (-1, -1))
            if t < 0 or seen[t]:
                continue
            seen[t] = True
            if places[c] < 0:
                parents[len(points)] = places[a], places[b], places[d]
            gates.append(3 * (len(order) - place) + edge)
            thirds.append(code(c))
            order.append(t)
            corners.append((places[b], places[a], places[c]))
            stack += [(len(order) - 1, e, *ends) for e, ends in enumerate(((b, a, c), (a, c, b), (c, b, a)))]
    lists = (points, places, order, gates, thirds, starts)
    one, two, three, four, five, six = (np.array(numbers, dtype=np.int64) for numbers in lists)
    return _Order(one, two, three, four, five, six, parents, np.array(corners, dtype=np.int64))


def _differences(values: np.ndarray, parents: np.ndarray) -> np.ndarray:
    """Return what whole numbers (n, …) at points differ from their guesses, or else from those of the point before."""
    guess = np.zeros_like(values)
    guess[1:] = values[:-1]
    known = parents[:, 0] >= 0
    a, b, d = parents[known].T
    guess[known] = values[a] + values[b] - values[d]
    return np.asarray(values - guess)


def rounded_points(points: np.ndarray, step: float) -> np.ndarray:
    """Return points (n, 3) at multiples of a step, both in m."""
    return np.asarray(step * np.rint(points / step))


@dataclass(frozen=True, eq=False)
class PackedSurface:
    """A surface as bytes, and the order of its points there; `facts` say, for JSON, what the numbers mean."""

    facts: dict[str, Any]
    data: bytes
    triangles: np.ndarray  # (t, 3), in the order of before
    _order: _Order

    @classmethod
    def of(cls, surface: Surface, step: float) -> PackedSurface:
        """Return a surface whose coordinates are multiples of a step, m."""
        points = np.asarray(surface.rest, dtype=np.float64).reshape(-1, 3)
        triangles = np.asarray(surface.triangles, dtype=np.int64).reshape(-1, 3)
        order, lists = _order_of(triangles, len(points)), _Lists()
        for numbers in (order.gates, order.thirds, order.starts):
            lists.add(numbers)
        lists.add(np.asarray(surface.touchable, dtype=np.int64)[order.triangles])
        lists.add(_differences(np.rint(points / step).astype(np.int64)[order.points], order.parents).T)
        lists.add(_deltas(order.places[np.asarray(surface.creases, dtype=np.int64)].reshape(-1, 2).T))
        yielding = order.places[np.asarray(surface.yielding, dtype=np.int64)]
        sorting = np.argsort(yielding)
        lists.add(_deltas(yielding[sorting][None]))
        normals = np.asarray(surface.normals, dtype=np.float64).reshape(-1, 3)[sorting]
        lists.add(_deltas(np.rint(normals / _DIRECTIONS).astype(np.int64).T))
        facts = {"points": len(points), "step": step, "direction": _DIRECTIONS, "lists": lists.sizes}
        return cls(facts, lists.data, triangles, order)

    def field(self, modes: Modes, scales: np.ndarray) -> tuple[dict[str, Any], bytes]:
        """Return what the numbers of a field mean, and the numbers, from its modes at the surface's points.

        `scales` (1 + k,) are what 1 stands for in the rest and in each mode.
        """
        lists, order = _Lists(), self._order
        rows = np.vstack([np.ravel(modes.rest), np.reshape(modes.modes, (-1, np.size(modes.rest)))])
        rows = rows.reshape(len(rows), len(order.points), -1)
        for row, scale in zip(rows, np.where(scales > 0, scales, 1.0), strict=True):
            lists.add(_differences(np.rint(row / scale).astype(np.int64)[order.points], order.parents).T)
        lists.add(_deltas(np.sort(order.places[np.asarray(modes.touched, dtype=np.int64)])[None]))
        facts = {"reach": modes.reach, "rows": modes.rows, "scales": scales.tolist(), "lists": lists.sizes}
        return facts, lists.data

    def binding(
        self, carried: CarriedSurface, carrier: PackedSurface, nodes: np.ndarray
    ) -> tuple[dict[str, Any], bytes]:
        """Return what the numbers of a binding mean, and the numbers.

        This surface is `carried`, whose vertex `nodes` (n,) each point stands for, and `carrier` the field's. Each
        point is bound to four triangles of that by the one in their middle, whose corners halve the sides.
        """
        lists, own, other = _Lists(), nodes[self._order.points], carrier._order
        place = np.argsort(other.triangles)
        middles = place.reshape(-1, 4)[:, 3]  # of each four, in the order of the file
        lists.add(_deltas(middles[carried.cells[own]][None]))
        # the corners of a triangle may begin elsewhere in the file
        first = other.places[np.asarray(carrier.triangles)[3::4][carried.cells[own], 0]]
        turn = np.argmax(other.corners[middles[carried.cells[own]]] == first[:, None], axis=1)
        weights = np.rint(carried.weights[own] / _WEIGHTS).astype(np.int64)
        columns = (np.arange(2) - turn[:, None]) % 3
        lists.add(_deltas(np.take_along_axis(weights, columns, axis=1).T))
        return {"weight": _WEIGHTS, "lists": lists.sizes}, lists.data


def _deltas(rows: np.ndarray) -> np.ndarray:
    """Return what each number of rows (r, m) differs from the one before it in its row."""
    return np.diff(rows, axis=1, prepend=0)
