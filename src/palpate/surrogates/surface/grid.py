"""The smooth field: a cubic spline through exactly measured distances.

A coefficient is made of a node's own value and its near neighbours', C = (1 − δ²/6 + δ⁴/36) f along each axis, δ² the
second difference. That is the spline through the values up to terms of sixth order (de Boor 1978, "A practical guide
to splines", on quasi-interpolants), but local: an edge is not heard of three cells away, and a linear distance is
reproduced exactly.

Where d has a kink within a few cells (close to an edge; inside, where two parts of the surface are equally far) that
would ring. There the coefficients are the values themselves (Schoenberg's operator, variation diminishing): the kink
is rounded over about two cells and nothing overshoots. Between `SHARP` and `SMOOTH`, |δ² f|/h at the nodes around, one
goes over into the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.surrogates.surface.exact import BRIDGED, TURN, Exact

__all__ = ["Grid", "sampled"]

SMOOTH, SHARP = 0.4, 0.8  # change of slope from cell to cell
CLEAR = 4  # cells beyond the reach, within which the spline hears of what comes after
LEVEL = 2  # cells by which the distance rises from there to its level
COARSE = 4  # every so many nodes the distance is measured where it is large
OUTERMOST = 5  # cells at the rim, where nothing changes any more
PAD = 2  # nodes beyond the spline's own that its coefficients need
AROUND = 3  # nodes to each side that lend a coefficient their values


@dataclass(frozen=True, eq=False)
class Grid:
    """A sampled field.

    Attributes
    ----------
    frame : (4,) array
        Position of the first node and spacing, in m.
    coefficients : (i, j, k) array
        In m.
    faithful : (i, j, k) bool array
        Coefficients around which the spline follows the measured distance, neither rounded nor levelled off.
    """

    frame: np.ndarray
    coefficients: np.ndarray
    faithful: np.ndarray


def shape_of(exact: Exact, margin: float, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """First node (3,) and number of nodes (3,) of a grid with a margin in m around a surface and to behind it."""
    corners = exact.pieces.corners
    behind = corners - (exact.behind + TURN * exact.radius) * exact.pieces.normals
    low, high = _box(corners, margin)
    lower, upper = _box(behind, OUTERMOST * spacing)
    low, high = np.minimum(low, lower), np.maximum(high, upper)
    cells = np.ceil((high - low) / spacing).astype(np.int64)
    return (low + high) / 2 - cells * spacing / 2, cells + 1


def _box(corners: np.ndarray, margin: float) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner (3,) of a box with a margin in m around points (T, 3, 3)."""
    return corners.min(axis=(0, 1)) - margin, corners.max(axis=(0, 1)) + margin


def margin_of(reach: float, inner: float, spacing: float, shoulder: float) -> float:
    """How far the grid goes beyond the surface, in m: all around, the distance has levelled off by then.

    Beyond the border it is 1.5 shoulders less than from the border itself.
    """
    return max(reach + 1.5 * shoulder + (CLEAR + 2 * LEVEL) * spacing, inner) + OUTERMOST * spacing


def sampled(exact: Exact, reach: float, inner: float, spacing: float) -> Grid:
    """The field of a surface out to a reach and in to an inner reach, both in m."""
    margin = margin_of(reach, inner, spacing, exact.shoulder)
    first, nodes = shape_of(exact, margin, spacing)
    first, nodes = first - PAD * spacing, nodes + 2 * PAD
    f, true = _measured(exact, first, nodes, spacing, margin)
    last = reach + CLEAR * spacing
    beyond = f > last
    f = _levelled(f, last, LEVEL * spacing)
    kink = _kink(f) / spacing
    t = np.clip((SHARP - kink) / (SHARP - SMOOTH), 0.0, 1.0)
    share = t * t * (3 - 2 * t)
    own = (slice(PAD, -PAD),) * 3
    values, through = f[own], _through(f)[own]
    coefficients = values + share[own] * (through - values)
    faithful = ~_any_around(~true | beyond | (share < 1), AROUND)[own]
    return Grid(np.append(first + PAD * spacing, spacing), _straight(coefficients), faithful)


def _measured(
    exact: Exact, first: np.ndarray, nodes: np.ndarray, spacing: float, far: float
) -> tuple[np.ndarray, np.ndarray]:
    """Distances (i, j, k) in m at the nodes, and whether they are distances, not bridged.

    Farther than `far` (m) they are interpolated between every fourth node.
    """
    f = _coarse(exact, first, nodes, spacing)
    true = np.ones(f.shape, dtype=bool)
    for i in range(nodes[0]):
        near = np.argwhere(np.abs(f[i]) < far + COARSE * spacing)
        place = first + spacing * np.column_stack([np.full(len(near), i), near])
        d, kinds = exact.at(place)
        f[i][tuple(near.T)], true[i][tuple(near.T)] = d, kinds != BRIDGED
    return f, true


def _coarse(exact: Exact, first: np.ndarray, nodes: np.ndarray, spacing: float) -> np.ndarray:
    """Distances (i, j, k) in m at every fourth node, interpolated between them."""
    count = -(-(nodes - 1) // COARSE) + 1
    places = np.stack(np.meshgrid(*(np.arange(n) for n in count), indexing="ij"), axis=-1).reshape(-1, 3)
    f = exact.at(first + COARSE * spacing * places)[0].reshape(count)
    for axis in range(3):
        cell, step = np.divmod(np.arange(nodes[axis]), COARSE)
        share = np.expand_dims(step / COARSE, tuple(a for a in range(3) if a != axis))
        after = np.minimum(cell + 1, count[axis] - 1)
        f = (1 - share) * f.take(cell, axis) + share * f.take(after, axis)
    return f


def _levelled(d: np.ndarray, reach: float, rise: float) -> np.ndarray:
    """Distances that level off at reach + rise, with two continuous derivatives in d."""
    t = np.clip((d - reach) / (2 * rise), 0.0, 1.0)
    return np.where(d > reach, reach + rise * t * (2 - t * t * (2 - t)), d)


def _second(f: np.ndarray, axis: int) -> np.ndarray:
    """δ² f along an axis; zero at both ends, as if f went on straight."""
    out, f = np.zeros_like(f), np.moveaxis(f, axis, 0)
    np.moveaxis(out, axis, 0)[1:-1] = f[2:] - 2 * f[1:-1] + f[:-2]
    return out


def _through(f: np.ndarray) -> np.ndarray:
    """Coefficients of the spline that goes (nearly) through f."""
    for axis in range(3):
        second = _second(f, axis)
        f = f - second / 6 + _second(second, axis) / 36
    return f


def _kink(f: np.ndarray) -> np.ndarray:
    """The largest |δ² f| along any axis at a node or within the reach of its coefficient."""
    largest = np.abs(_second(f, 0))
    for axis in (1, 2):
        np.maximum(largest, np.abs(_second(f, axis)), out=largest)
    return _largest_around(largest, PAD)


def _largest_around(f: np.ndarray, steps: int) -> np.ndarray:
    """The largest value within some steps along each axis."""
    for axis in range(3):
        for _ in range(steps):
            g = f.copy()
            to, by = np.moveaxis(g, axis, 0), np.moveaxis(f, axis, 0)
            np.maximum(to[1:], by[:-1], out=to[1:])
            np.maximum(to[:-1], by[1:], out=to[:-1])
            f = g
    return f


def _any_around(f: np.ndarray, steps: int) -> np.ndarray:
    return _largest_around(f.astype(np.uint8), steps).astype(bool)


def _straight(C: np.ndarray) -> np.ndarray:
    """Coefficients whose outermost three lie on a line along each axis."""
    for axis in range(3):
        line = np.moveaxis(C, axis, 0)
        line[0], line[-1] = 2 * line[1] - line[2], 2 * line[-2] - line[-3]
    return np.ascontiguousarray(C)
