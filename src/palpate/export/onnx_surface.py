"""The distance to a touched surface in an ONNX graph: cubic splines on a grid, as `distance_kernels` has them.

The table of a curved surface is in tiles of four nodes along each side, equal ones once: most are far from what is felt
and get one of two numbers. Whole multiples of a power of two are kept as whole numbers of 32 bits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from palpate.export.lattice_tiles import SIDE, cut_tiles
from palpate.export.onnx_graph import Graph, Value
from palpate.export.surface_tiles import felt_coefficients
from palpate.network.packing import whole_multiples
from palpate.surrogates.baselines.graph_form import Distance
from palpate.surrogates.surface import TouchedSurface

__all__ = ["distance_to"]

# first nodes (N, 1), one array for each axis, to coefficients (N, 4^axes)
Lookup = Callable[[Sequence[Value]], Value]
FAR = 1e6  # cells beyond the box, after which nothing changes


def distance_to(graph: Graph, surface: TouchedSurface) -> Distance:
    """Return what adds the distance to a surface to a graph, at any places."""
    frame, coefficients, profile = surface.compiled()
    h = float(frame[3])
    if profile.size:
        return lambda place: _flat(graph, (place - frame[:3]) / h, frame, coefficients[:, :, 0], profile)
    find = _tile_lookup(graph, felt_coefficients(surface))

    def distance(place: Value) -> tuple[Value, Value, Value]:
        d = _spline(graph, (place - frame[:3]) / h, coefficients.shape, find)
        gradient = graph.join(d[1, 0, 0], d[0, 1, 0], d[0, 0, 1]) / h
        xy, xz, yz = d[1, 1, 0], d[1, 0, 1], d[0, 1, 1]
        rows = (d[2, 0, 0], xy, xz, xy, d[0, 2, 0], yz, xz, yz, d[0, 0, 2])
        return d[0, 0, 0], gradient, graph.join(*rows).rows_as(3, 3) / (h * h)

    return distance


def _weights(graph: Graph, u: Value, nodes: int) -> tuple[Value, list[list[Value]]]:
    """Return the first node of four (N, 1) int, and their weights with both derivatives by u, each (N, 1)."""
    inside = graph.minimum(graph.maximum(u, 1.0), nodes - 2.0)
    node = graph.minimum(graph.op("Floor", inside), float(nodes - 3))
    t = inside - node
    s = 1.0 - t
    b = [
        s * s * s / 6.0,
        2.0 / 3.0 - t * t * (1.0 - t / 2.0),
        2.0 / 3.0 - s * s * (1.0 - s / 2.0),
        t * t * t / 6.0,
    ]
    p = [-s * s / 2.0, -t * (2.0 - 1.5 * t), s * (2.0 - 1.5 * s), t * t / 2.0]
    q = [s, 1.0 - 3.0 * s, 1.0 - 3.0 * t, t]
    over = u - inside
    out = (over > 0.0) | (over < 0.0)
    over = graph.minimum(graph.maximum(over, -FAR), FAR)
    b = [value + over * slope for value, slope in zip(b, p, strict=True)]
    q = [graph.where(out, 0.0, bend) for bend in q]
    return graph.whole(node) - graph.integers([1]), [b, p, q]


def _dense_lookup(graph: Graph, table: np.ndarray) -> Lookup:
    """Return what finds the coefficients from some nodes on in a table."""
    steps = [int(np.prod(table.shape[i + 1 :])) for i in range(table.ndim)]

    def find(first: Sequence[Value]) -> Value:
        return graph.op("Gather", table.ravel(), _around(graph, first, steps), axis=0)

    return find


def _tile_lookup(graph: Graph, table: np.ndarray) -> Lookup:
    """Return what finds the coefficients from some nodes on in a table's tiles, of which equal ones are kept once."""
    multiples = whole_multiples(table)
    numbers = table if multiples is None else multiples[0]
    kept, places = np.unique(cut_tiles(numbers).reshape(-1, SIDE**3), axis=0, return_inverse=True)
    places = places.ravel().astype(np.int32)
    counts = [-(-n // SIDE) for n in table.shape]
    side, one = graph.integers([SIDE]), graph.integers(range(4))

    def find(first: Sequence[Value]) -> Value:
        tile = node = graph.integers([0])
        for axis, (start, count) in enumerate(zip(first, counts, strict=True)):
            shape = [4 if i == axis else 1 for i in range(3)]
            along = start + one  # (N, 4)
            which = graph.op("Div", along, side)
            within = (along - which * side).rows_as(*shape)
            tile = tile * graph.integers([count]) + which.rows_as(*shape)
            node = node * side + within
        begin = graph.whole(graph.op("Gather", graph.table(places), tile, axis=0))
        node = (begin * graph.integers([SIDE**3]) + node).rows_as(SIDE**3)
        if multiples is None:
            return graph.op("Gather", kept.ravel(), node, axis=0)
        return graph.real(graph.op("Gather", graph.table(kept.ravel()), node, axis=0)) * 2.0 ** multiples[1]

    return find


def _around(graph: Graph, first: Sequence[Value], steps: Sequence[int]) -> Value:
    """Return the places (N, 4^axes) of four nodes along each axis."""
    corner = graph.integers([0])
    for node, step in zip(first, steps, strict=True):
        corner = corner + node * graph.integers([step])
    offsets = np.arange(4) * steps[0]
    for step in steps[1:]:
        offsets = (offsets[:, None] + np.arange(4) * step).ravel()
    return corner + graph.integers(offsets.tolist())


def _spline(graph: Graph, cells: Value, shape: Sequence[int], find: Lookup) -> dict[tuple[int, ...], Value]:
    """Return a spline on a table of two or three axes, and its derivatives up to the second, each (N, 1).

    The keys say how often it is differentiated along each axis. Products are summed up in the order of the compiled
    kernels, so that differences of curvatures, which the depths beyond training need, are the same.
    """
    axes = len(shape)
    parts = [_weights(graph, cells.columns(i, i + 1), shape[i]) for i in range(axes)]
    nodes = find([node for node, _ in parts])  # (N, 4^axes)
    known: dict[tuple[int, ...], Value] = {(): nodes}
    left = 4**axes
    for axis in reversed(range(axes)):  # from the last axis on, four numbers become one
        left //= 4
        wider: dict[tuple[int, ...], Value] = {}
        for orders, values in known.items():
            four = values.rows_as(left, 4)
            each = [graph.op("Gather", four, graph.integers([k]), axis=2).rows_as(left) for k in range(4)]
            for order in range(3 - sum(orders)):
                total: Any = None
                for weight, value in zip(parts[axis][1][order], each, strict=True):
                    total = weight * value if total is None else total + weight * value
                wider[order, *orders] = total
        known = wider
    return known


def _flat(
    graph: Graph, cells: Value, frame: np.ndarray, outline: np.ndarray, profile: np.ndarray
) -> tuple[Value, Value, Value]:
    """Return the same of a flat surface: d(a, z), a the distance from its outline in its plane."""
    h, axes = float(frame[3]), frame[4:13].reshape(3, 3)
    turned = cells @ axes.T  # (N, 3): along the plane's axes, in cells
    a = _spline(graph, turned.columns(0, 2), outline.shape, _dense_lookup(graph, outline))
    height = turned.columns(2, 3) - frame[14] / h
    places = graph.join((a[0, 0] - frame[13]) / h, height)
    d = _spline(graph, places, profile.shape, _dense_lookup(graph, profile))
    ax, ay, axx, ayy, axy = a[1, 0] / h, a[0, 1] / h, a[2, 0] / h, a[0, 2] / h, a[1, 1] / h
    da, dz, daa, dzz, daz = d[1, 0], d[0, 1], d[2, 0], d[0, 2], d[1, 1]
    gradient = graph.join(da * ax, da * ay, dz) @ axes / h
    xx, yy, xy = daa * ax * ax + da * axx, daa * ay * ay + da * ayy, daa * ax * ay + da * axy
    xz, yz = daz * ax, daz * ay
    bend = graph.join(xx, xy, xz, xy, yy, yz, xz, yz, dzz).rows_as(3, 3)
    hessian = graph.constant(axes.T) @ bend @ axes / (h * h)
    return d[0, 0], gradient, hessian
