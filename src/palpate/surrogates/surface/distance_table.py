"""The smooth field: cubic splines through exactly measured distances.

A coefficient is made of a node's own value and its near neighbours', C = (1 − δ²/6 + δ⁴/36) f along each axis, δ² the
second difference. That is the spline through the values up to terms of sixth order (de Boor 1978, "A practical guide
to splines", on quasi-interpolants), but local: an edge is not heard of three cells away, and a linear distance is
reproduced exactly.

Where d has a kink within a few cells (close to an edge; inside, where two parts of the surface are equally far) that
would ring. There the coefficients are the values themselves (Schoenberg's operator, variation diminishing): the kink
is rounded over about two cells and nothing overshoots. Between `SHARP` and `SMOOTH`, |δ² f|/h at the nodes around, one
goes over into the other.

A curved surface has one spline of three variables. A flat one has two of two variables, hundreds of times smaller: the
distance a from its outline in its plane, and the distance d(a, z) at a height z over the plane.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.surrogates.surface.distance_kernels import distances_into
from palpate.surrogates.surface.measured_distance import BEHIND, ROLLED, TURN, MeasuredDistance

__all__ = ["CLEAR", "DistanceTable", "tabulate", "through_nodes"]

# change of slope from cell to cell, below which the field is smooth, above which it is sharp
SMOOTH, SHARP = 0.4, 0.8
CLEAR = 4  # cells beyond the reach, within which the spline hears of what comes after
LEVEL = 2  # cells by which the distance rises from there to its level
COARSE = 4  # nodes from one measured distance to the next, where distances do not count
OUTERMOST = 5  # cells at the rim, where nothing changes any more
PAD = 2  # nodes beyond the spline's own that its coefficients need
AROUND = 3  # nodes to each side that lend a coefficient their values
CELLS = 10  # cells in the radius of the smallest probe, where there are edges to go round
SOME = 8  # cells in that radius, where the border has a shoulder
FEW = 6  # cells in that radius, where there are neither edges nor a shoulder
TRUE = 1e-3  # error over that radius, down to which the spacing is refined where there is room
MOST = 2_000_000  # nodes of the grid, at most: 16 MB
CHECKS = 20_000  # places at which the error is measured
COARSEST = 3  # cells in the radius, below which nothing is known of edges
TRIALS = 3  # refinements of the spacing, at most
# Error of a refined table over the one before, at most: a spacing of 0.7 halves the error of a smooth field. Where it
# doesn't, the error is that of kinks, as between the triangles of a scan, and a finer table only takes more room.
GAIN = 0.8
PLANE = 1e-9  # share of its size by which a flat surface may lie off its plane


@dataclass(frozen=True, eq=False)
class DistanceTable:
    """A sampled field, as `palpate.surrogates.surface.distance_kernels` takes it."""

    frame: np.ndarray  # numbers of the grid
    coefficients: np.ndarray  # spline coefficients on the grid
    profile: np.ndarray  # profile of a flat surface
    error: float  # largest deviation from the measured distance at check points, m


def tabulate(measured: MeasuredDistance, reach: float, inner: float, spacing: float | None) -> DistanceTable:
    """Return the field out to a reach and in to an inner reach (m), by a spacing (m) or the coarsest that is true.

    A spacing too coarse for the probe is refused, and so is a grid that would be too large.
    """
    ends = measured.patches.kinds.any()
    flat = _is_flat(measured)
    cells = (CELLS if flat or not measured.shoulder else SOME) if ends else FEW
    finest = _finest(measured, reach, inner, flat)
    h = max(measured.radius / cells, finest) if spacing is None else spacing
    _refuse_spacing(measured, h, finest, _nodes(measured, reach, inner, h, flat))
    if flat:
        return _flat_table(measured, reach, h)
    table = _curved_table(measured, reach, inner, h)
    for _ in range(TRIALS):
        finer = max(0.7 * h, finest)
        if spacing is not None or table.error <= TRUE * measured.radius or finer > 0.9 * h:
            break
        refined = _curved_table(measured, reach, inner, finer)
        if refined.error > GAIN * table.error:
            break
        table, h = refined, finer
    return table


def _finest(measured: MeasuredDistance, reach: float, inner: float, flat: bool) -> float:
    """Return the smallest spacing in m for which the grid is small enough."""
    h = measured.radius / 100
    while _nodes(measured, reach, inner, h, flat) > MOST:
        h *= 1.02
    return h


def _nodes(measured: MeasuredDistance, reach: float, inner: float, spacing: float, flat: bool) -> int:
    sides = np.array(_box(measured, reach, inner, spacing)[1].astype(object))
    # the largest table of a flat surface is of two of its sides, whichever way it lies
    return int(np.prod(np.sort(sides)[1:]) if flat else np.prod(sides))


def _refuse_spacing(measured: MeasuredDistance, spacing: float, finest: float, nodes: int) -> None:
    if spacing > measured.radius / COARSEST:
        raise UsageError(
            f"A grid of {1e3 * spacing:.3g} mm can't tell how a probe of {1e3 * measured.radius:.3g} mm touches.",
            why=f"It needs {COARSEST} cells to its radius; left open, the spacing is as fine as there is room for.",
            fix="Choose a finer spacing, a smaller part of the surface or a larger probe.",
        )
    if nodes > MOST:
        raise UsageError(
            f"A grid of {1e3 * spacing:.3g} mm would have {nodes:,} nodes; at most {MOST:,} are made.",
            fix=f"Choose a spacing of {1e3 * finest:.2g} mm or more, or none.",
        )


def _level(reach: float, spacing: float) -> float:
    """Return the distance in m from which on d has levelled off."""
    return reach + (CLEAR + 2 * LEVEL) * spacing


def _levelled(d: np.ndarray, reach: float, spacing: float) -> np.ndarray:
    """Distances that level off some cells beyond a reach, with two continuous derivatives in d."""
    last, rise = reach + CLEAR * spacing, LEVEL * spacing
    t = np.clip((d - last) / (2 * rise), 0.0, 1.0)
    return np.where(d > last, last + rise * t * (2 - t * t * (2 - t)), d)


def _spline(f: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a spline's coefficients and their share of the exact ones, of values with `PAD` more nodes all around."""
    kink = _kink(f) / spacing
    t = np.clip((SHARP - kink) / (SHARP - SMOOTH), 0.0, 1.0)
    share = t * t * (3 - 2 * t)
    own = (slice(PAD, -PAD),) * f.ndim
    values, through = f[own], _through(f)[own]
    return _straight(values + share[own] * (through - values)), share


def through_nodes(f: np.ndarray, spacing: float) -> np.ndarray:
    """Return coefficients of the spline through values f on a lattice, rounded at kinks; f is 0 at the rim."""
    return _spline(np.pad(f, PAD), spacing)[0]


def _second(f: np.ndarray, axis: int) -> np.ndarray:
    """δ² f along an axis; zero at both ends, as if f went on straight."""
    out, f = np.zeros_like(f), np.moveaxis(f, axis, 0)
    np.moveaxis(out, axis, 0)[1:-1] = f[2:] - 2 * f[1:-1] + f[:-2]
    return out


def _through(f: np.ndarray) -> np.ndarray:
    """Coefficients of the spline that goes (nearly) through f."""
    for axis in range(f.ndim):
        second = _second(f, axis)
        f = f - second / 6 + _second(second, axis) / 36
    return f


def _kink(f: np.ndarray) -> np.ndarray:
    """The largest |δ² f| along any axis at a node or within the reach of its coefficient."""
    largest = np.abs(_second(f, 0))
    for axis in range(1, f.ndim):
        np.maximum(largest, np.abs(_second(f, axis)), out=largest)
    return _largest_around(largest, PAD)


def _largest_around(f: np.ndarray, steps: int) -> np.ndarray:
    """The largest value within some steps along each axis."""
    for axis in range(f.ndim):
        for _ in range(steps):
            g = f.copy()
            ahead, behind = np.moveaxis(g, axis, 0), np.moveaxis(f, axis, 0)
            np.maximum(ahead[1:], behind[:-1], out=ahead[1:])
            np.maximum(ahead[:-1], behind[1:], out=ahead[:-1])
            f = g
    return f


def _straight(C: np.ndarray) -> np.ndarray:
    """Coefficients whose outermost three lie on a line along each axis."""
    for axis in range(C.ndim):
        line = np.moveaxis(C, axis, 0)
        line[0], line[-1] = 2 * line[1] - line[2], 2 * line[-2] - line[-3]
    return np.ascontiguousarray(C)


# a curved surface


def _curved_table(measured: MeasuredDistance, reach: float, inner: float, spacing: float) -> DistanceTable:
    first, nodes = _box(measured, reach, inner, spacing)
    f, true = _measured(measured, first - PAD * spacing, nodes + 2 * PAD, reach, inner, spacing)
    beyond = f > reach + CLEAR * spacing
    coefficients, share = _spline(_levelled(f, reach, spacing), spacing)
    faithful = ~_largest_around(~true | beyond | (share < 1), AROUND)[(slice(PAD, -PAD),) * 3]
    frame = np.append(first, spacing)
    near = faithful & (-inner < coefficients) & (reach > coefficients)
    return DistanceTable(frame, coefficients, np.zeros((0, 0)), _error(measured, frame, coefficients, near))


def _box(
    measured: MeasuredDistance, reach: float, inner: float, spacing: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the first node (3,) and the number of nodes (3,) of a grid at whose rim the distance has levelled off.

    Beyond a border with a shoulder it is 1.5 shoulders less than from the border itself.
    """
    (low, high), (lowest, highest) = measured.extent, measured.extent_behind
    shoulder = measured.shoulder if len(measured.patches.border) else 0.0
    margin = max(_level(reach, spacing) + 1.5 * shoulder, inner)
    low = np.minimum(low - margin, lowest) - OUTERMOST * spacing
    high = np.maximum(high + margin, highest) + OUTERMOST * spacing
    cells = np.ceil((high - low) / spacing).astype(np.int64)
    return (low + high) / 2 - cells * spacing / 2, cells + 1


def _measured(
    measured: MeasuredDistance,
    first: np.ndarray,
    nodes: np.ndarray,
    reach: float,
    inner: float,
    spacing: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return distances (i, j, k) in m at the nodes, and whether they are distances, neither bridged nor rolled off.

    Some cells farther out than the reach, farther in than `inner` and behind the body they are interpolated between
    every fourth node.
    """
    f, behind = _coarse(measured, first, nodes, spacing)
    clear = (CLEAR + 1) * spacing
    near = (-inner - clear < f) & (f < reach + clear) & ~behind
    true = np.zeros(f.shape, dtype=bool)
    for i in range(nodes[0]):
        rows = np.argwhere(near[i])
        place = first + spacing * np.column_stack([np.full(len(rows), i), rows])
        d, kinds = measured.at(place)
        f[i][tuple(rows.T)], true[i][tuple(rows.T)] = d, kinds < ROLLED
    return f, true


def _coarse(
    measured: MeasuredDistance, first: np.ndarray, nodes: np.ndarray, spacing: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return distances (i, j, k) in m interpolated between every fourth node, and what is behind the body."""
    count = -(-(nodes - 1) // COARSE) + 1
    places = np.stack(np.meshgrid(*(np.arange(n) for n in count), indexing="ij"), axis=-1).reshape(-1, 3)
    d, kinds = measured.at(first + COARSE * spacing * places)
    f, behind = d.reshape(count), kinds.reshape(count) == BEHIND
    for axis in range(3):
        cell, step = np.divmod(np.arange(nodes[axis]), COARSE)
        share = np.expand_dims(step / COARSE, tuple(a for a in range(3) if a != axis))
        after = np.minimum(cell + 1, count[axis] - 1)
        f = (1 - share) * f.take(cell, axis) + share * f.take(after, axis)
        behind = behind.take(cell, axis) & behind.take(after, axis)
    return f, behind


def _error(
    measured: MeasuredDistance, frame: np.ndarray, coefficients: np.ndarray, near: np.ndarray
) -> float:
    """Return the largest deviation in m from the measured distance within cells; the spacing if there are none."""
    cells = np.argwhere(near[1:-2, 1:-2, 1:-2]) + 1
    if not len(cells):
        return float(frame[3])
    random = np.random.default_rng(0)
    chosen = cells[np.sort(random.choice(len(cells), min(CHECKS, len(cells)), replace=False))]
    places = frame[:3] + frame[3] * (chosen + random.random(chosen.shape))
    d, g, H = np.empty(len(places)), np.empty((len(places), 3)), np.empty((len(places), 3, 3))
    distances_into(places, d, g, H, frame, coefficients, np.zeros((0, 0)))
    return float(np.abs(d - measured.at(places)[0]).max())


# a flat surface


def _is_flat(measured: MeasuredDistance) -> bool:
    patches = measured.patches
    points = patches.corners.reshape(-1, 3)
    normal = patches.normals[0, 0]
    off = np.abs((points - points[0]) @ normal).max()
    alike = np.abs(patches.normals - normal).max() < PLANE
    return bool(alike and off < PLANE * np.ptp(points, axis=0).max())


def _flat_table(measured: MeasuredDistance, reach: float, spacing: float) -> DistanceTable:
    points = measured.patches.corners.reshape(-1, 3)
    axes = _axes(measured.patches.normals[0, 0])
    flat = points @ axes.T
    shoulder, radius = measured.shoulder, measured.radius
    # a does not count farther out than where all has levelled off, nor farther in than where d no longer hears of it
    out, within = reach + 1.5 * shoulder + 2 * LEVEL * spacing, 0.0 if shoulder else radius
    rim = OUTERMOST * spacing
    margin = _level(out, spacing) + rim
    low, high = flat[:, :2].min(axis=0) - margin, flat[:, :2].max(axis=0) + margin
    first, nodes = _nodes_between(low, high, spacing)
    places = np.stack(np.meshgrid(*_padded(first, nodes, spacing), indexing="ij"), axis=-1)
    origin = np.append(first, flat[:, 2].mean())
    spots = np.concatenate([places, np.full((*places.shape[:2], 1), origin[2])], axis=2).reshape(-1, 3)
    a = measured.outline(np.ascontiguousarray(spots @ axes)).reshape(places.shape[:2])
    a = -_levelled(-_levelled(a, out, spacing), within, spacing)
    outline, _ = _spline(a, spacing)

    deep = measured.behind + TURN * radius + rim
    low = np.array([-_level(within, spacing) - rim, -deep])
    first, nodes = _nodes_between(low, np.array([margin, _level(reach, spacing) + rim]), spacing)
    grid = np.meshgrid(*_padded(first, nodes, spacing), indexing="ij")
    d = measured.profile(*(np.ascontiguousarray(axis.ravel()) for axis in grid))[0].reshape(grid[0].shape)
    profile, _ = _spline(_levelled(d, reach, spacing), spacing)
    frame = np.concatenate([origin @ axes, [spacing], axes.ravel(), first])
    return DistanceTable(frame, np.ascontiguousarray(outline[:, :, None]), profile, 0.0)


def _axes(normal: np.ndarray) -> np.ndarray:
    """Return the rotation (3, 3) whose last row is a unit normal, the smallest that turns z or −z into it."""
    sign = 1.0 if normal[2] >= 0 else -1.0
    x, y, z = normal * [1.0, 1.0, sign]
    first = np.array([1.0 - x * x / (1.0 + z), -x * y / (1.0 + z), -x * sign])
    second = np.array([-x * y / (1.0 + z), 1.0 - y * y / (1.0 + z), -y * sign])
    return np.stack([first, sign * second, normal])


def _nodes_between(low: np.ndarray, high: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the first node and the number of nodes of a grid over a box."""
    cells = np.ceil((high - low) / spacing).astype(np.int64)
    return (low + high) / 2 - cells * spacing / 2, cells + 1


def _padded(first: np.ndarray, nodes: np.ndarray, spacing: float) -> list[np.ndarray]:
    """Return the nodes along each axis, with `PAD` more at both ends."""
    both = zip(first, nodes, strict=True)
    return [start + spacing * np.arange(-PAD, count + PAD) for start, count in both]
