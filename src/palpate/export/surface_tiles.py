"""A touched surface's tables in tiles: what repeats is kept once, what is straight as four numbers.

A flat surface is straight or the same over most of its tables, a curved one is needed only near its surface. So each
table is cut into tiles of four nodes along each side. A tile whose numbers lie on a plane (to 5e-17 m) is a constant
and three slopes; tiles that are equal to within the same are one. Before that, distances are held at a level farther
outside than any probe feels, and farther inside than the body lets go: contact, force and stiffness hear nothing of
it, and only the depth in the air, farther away than `reach`, is that level's.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np

from palpate.export.weights_block import Table
from palpate.surrogates import TouchedSurface

__all__ = ["surface_tables"]

SIDE = 4  # nodes of a tile
_SAME = 5e-17  # m: round-off of distances of some centimetres
_BESIDE = 5.0  # cells beyond which a node is not heard
_WORTH = 0.8  # share of the dense table above which tiles are not worth it


def surface_tables(surface: TouchedSurface) -> tuple[Table, Table, Table]:
    """Return frame, coefficients and profile as the evaluator core takes them."""
    h = surface.spacing
    outer, inner = surface.reach + _BESIDE * h, -surface.inner - _BESIDE * h
    if surface.profile.size:
        # what is far outside the outline is far from the surface at any height
        outline = np.minimum(surface.coefficients, outer)
        return (
            Table.of(surface.frame),
            _tiled(outline),
            _tiled(np.clip(surface.profile, inner, outer)[:, :, None]),
        )
    return (
        Table.of(surface.frame),
        _tiled(np.clip(surface.coefficients, inner, outer)),
        Table.of(surface.profile),
    )


@dataclass
class _Pool:
    """Numbers of tiles, each kind of tile once."""

    numbers: list[np.ndarray] = field(default_factory=list)
    size: int = 0
    known: dict[bytes, list[tuple[int, np.ndarray]]] = field(default_factory=dict)

    def place(self, numbers: np.ndarray) -> int:
        """Return where these numbers begin, entered unless equal ones are there."""
        key = np.round(numbers / 1e-12).tobytes()
        for place, other in self.known.setdefault(key, []):
            if other.shape == numbers.shape and np.abs(other - numbers).max() <= _SAME:
                return place
        self.known[key].append((self.size, numbers))
        self.numbers.append(numbers)
        self.size += numbers.size
        return self.size - numbers.size


def _tiled(table: np.ndarray) -> Table:
    """Return a table (i, j, k) in tiles; dense where they save little."""
    deep = SIDE if table.shape[2] > 1 else 1
    sides = (SIDE, SIDE, deep)
    filled = np.pad(table, [(0, -n % s) for n, s in zip(table.shape, sides, strict=True)], mode="edge")
    offsets = np.stack(np.meshgrid(*map(np.arange, sides), indexing="ij"), axis=-1).reshape(-1, 3)
    design = np.hstack([np.ones((len(offsets), 1)), offsets])
    solve = np.linalg.pinv(design)
    pool, places = _Pool(), []
    for corner in itertools.product(*(range(0, n, s) for n, s in zip(filled.shape, sides, strict=True))):
        tile = filled[tuple(slice(c, c + s) for c, s in zip(corner, sides, strict=True))].ravel()
        plane = solve @ tile
        if tile.max() == tile.min():
            plane = np.array([tile[0], 0.0, 0.0, 0.0])
        if np.abs(design @ plane - tile).max() <= _SAME:
            places.append(-1 - pool.place(plane))
        else:
            places.append(pool.place(tile))
    if pool.size > _WORTH * table.size:
        return Table.of(table)
    return Table(np.concatenate(pool.numbers), table.shape, np.array(places, dtype=np.int32))
