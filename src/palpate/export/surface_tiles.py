"""A touched surface's tables in tiles: what repeats is kept once, what is straight as four numbers.

A flat surface is straight or the same over most of its tables, a curved one is needed only near its surface. So each
table is cut into tiles of four nodes along each side. Where nothing is felt, in the air beyond `reach` and farther
inside than the body lets go of a probe, a tile becomes a constant: contact, force and stiffness hear nothing of it, and
only the depth in the air, farther away than `reach`, is that level's.

The tiles of a curved surface whose coefficients are whole multiples of a power of two are kept as digits, see
`palpate.export.lattice_tiles`. In others a tile whose numbers lie on a plane (to 5e-17 m) is a constant and three
slopes, and tiles that are equal to within the same are one.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.export.lattice_tiles import SIDE, cut_tiles, lattice_table
from palpate.export.weights_block import Table
from palpate.network.packing import whole_multiples
from palpate.surrogates import TouchedSurface

__all__ = ["felt_coefficients", "surface_tables"]

_SAME = 5e-17  # m: round-off of distances of some centimetres
_BESIDE = 5.0  # cells beyond which a node of a flat surface has no influence
_WORTH = 0.8  # share of the dense table above which tiles are not worth it
_RIM = 3  # nodes along which a spline is continued straight beyond its box


def surface_tables(surface: TouchedSurface) -> tuple[Table, Table, Table]:
    """Return frame, coefficients and profile as the evaluator core takes them."""
    h = surface.spacing
    frame, profile = Table.of(surface.frame), Table.of(surface.profile)
    if surface.profile.size:
        outer, inner = surface.reach + _BESIDE * h, -surface.inner - _BESIDE * h
        # what is far outside the outline is far from the surface at any height
        outline = np.minimum(surface.coefficients, outer)
        return frame, _tiled(outline), _tiled(np.clip(surface.profile, inner, outer)[:, :, None])
    coefficients = felt_coefficients(surface)
    multiples = whole_multiples(coefficients)
    table = None
    if multiples is not None:
        whole, exponent = multiples
        table = lattice_table(whole, exponent, int(whole[0, 0, 0]), int(whole.min()))
    return frame, _tiled(coefficients) if table is None else table, profile


def felt_coefficients(surface: TouchedSurface) -> np.ndarray:
    """Return a curved surface's coefficients, with one of two numbers in each tile that nothing felt depends on.

    These are that of the outermost nodes, which is the first of the table, and the least of all.

    The spline's value in a cell is a mean of the cell's 64 coefficients with weights that are not negative. So it is
    in the air where all of them are `reach` or more, and the body lets go where all are below −`inner`: such cells are
    not felt. A node counts if a felt cell has it. All others may have any number that leaves their cells what they
    are. A tile of which no node counts belongs to one cell, and so to one side. A cell inside beside a felt one counts
    as felt, too, since the stiffness beyond the deepest trained place differentiates the Hessian over a part of a cell.

    Beyond the box the spline goes on straight. So the outermost nodes, where the distance has levelled off in the air,
    all get one number, and the spline goes on with it. Where they are not in the air, nothing is changed.
    """
    C, reach, inner = surface.coefficients, surface.reach, surface.inner
    least, most = _over_cells(C, np.minimum), _over_cells(C, np.maximum)
    beside = _over_cells(np.pad(most, 1, mode="edge"), np.maximum, 3)
    felt = (least < reach) & (beside >= -inner)
    counts = np.zeros(C.shape, dtype=bool)
    counts[tuple(slice(n) for n in felt.shape)] = felt
    for axis in range(3):
        ahead = np.moveaxis(counts, axis, 0)
        before = ahead.copy()
        for step in range(1, SIDE):
            ahead[step:] |= before[:-step]
    rim = np.ones(C.shape, dtype=bool)
    rim[(slice(_RIM, -_RIM),) * 3] = False
    if (counts & rim).any() or C[rim].min() < reach:
        return C
    tiles, outer = cut_tiles(C), C[rim].max()
    idle = ~cut_tiles(counts).any(axis=(1, 2, 3))
    inside = tiles[:, 0, 0, 0] < reach
    tiles[idle & inside], tiles[idle & ~inside] = C.min(), outer
    out = _join_tiles(tiles, C.shape)
    out[rim] = outer
    return out


def _over_cells(C: np.ndarray, of: Any, nodes: int = SIDE) -> np.ndarray:
    """Return the least or largest of so many nodes along each axis, at the first of them."""
    for axis in range(3):
        line = np.moveaxis(C, axis, 0)
        count = len(line) - nodes + 1
        out = line[:count].copy()
        for step in range(1, nodes):
            of(out, line[step : step + count], out=out)
        C = np.moveaxis(out, 0, axis)
    return C


def _join_tiles(tiles: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    a, b, c = (-(-n // SIDE) for n in shape)
    joined = tiles.reshape(a, b, c, SIDE, SIDE, SIDE).transpose(0, 3, 1, 4, 2, 5)
    whole = joined.reshape(SIDE * a, SIDE * b, SIDE * c)[tuple(slice(n) for n in shape)]
    return np.ascontiguousarray(whole)


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
