"""The distance to a touched surface in an ONNX graph: cubic splines on a grid, as `distance_kernels` has them."""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.export.onnx_graph import Graph, Value
from palpate.surrogates.surface import TouchedSurface

__all__ = ["distance"]

FAR = 1e6  # cells beyond the box, after which nothing changes


def distance(graph: Graph, surface: TouchedSurface, place: Value) -> tuple[Value, Value, Value]:
    """Return the signed distance (N, 1), its gradient (N, 3) and its Hessian (N, 3, 3) at places (N, 3)."""
    frame, coefficients, profile = surface.compiled()
    h = float(frame[3])
    cells = (place - frame[:3]) / h
    if profile.size:
        return _flat(graph, cells, frame, coefficients[:, :, 0], profile)
    d = _spline(graph, cells, coefficients)
    gradient = graph.join(d[1, 0, 0], d[0, 1, 0], d[0, 0, 1]) / h
    xy, xz, yz = d[1, 1, 0], d[1, 0, 1], d[0, 1, 1]
    rows = (d[2, 0, 0], xy, xz, xy, d[0, 2, 0], yz, xz, yz, d[0, 0, 2])
    return d[0, 0, 0], gradient, graph.join(*rows).reshape(-1, 3, 3) / (h * h)


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


def _spline(graph: Graph, cells: Value, table: np.ndarray) -> dict[tuple[int, ...], Value]:
    """Return a spline on a table of two or three axes, and its derivatives up to the second, each (N, 1).

    The keys say how often it is differentiated along each axis. Products are summed up in the order of the compiled
    kernels, so that differences of curvatures, which the depths beyond training need, are the same.
    """
    axes = table.ndim
    strides = [int(np.prod(table.shape[i + 1 :])) for i in range(axes)]
    parts = [_weights(graph, cells.columns(i, i + 1), table.shape[i]) for i in range(axes)]
    corner: Any = None
    for (node, _), stride in zip(parts, strides, strict=True):
        step = node * graph.integers([stride])
        corner = step if corner is None else corner + step
    offsets = np.arange(4) * strides[0]
    for stride in strides[1:]:
        offsets = (offsets[:, None] + np.arange(4) * stride).ravel()
    nodes = graph.op(
        "Gather", table.ravel(), corner + graph.integers(offsets.tolist()), axis=0
    )  # (N, 4^axes)
    known: dict[tuple[int, ...], Value] = {(): nodes}
    left = 4**axes
    for axis in reversed(range(axes)):  # from the last axis on, four numbers become one
        left //= 4
        wider: dict[tuple[int, ...], Value] = {}
        for orders, values in known.items():
            four = values.reshape(-1, left, 4)
            each = [graph.op("Gather", four, graph.integers([k]), axis=2).reshape(-1, left) for k in range(4)]
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
    a = _spline(graph, turned.columns(0, 2), outline)
    height = turned.columns(2, 3) - frame[14] / h
    d = _spline(graph, graph.join((a[0, 0] - frame[13]) / h, height), profile)
    ax, ay, axx, ayy, axy = a[1, 0] / h, a[0, 1] / h, a[2, 0] / h, a[0, 2] / h, a[1, 1] / h
    da, dz, daa, dzz, daz = d[1, 0], d[0, 1], d[2, 0], d[0, 2], d[1, 1]
    gradient = graph.join(da * ax, da * ay, dz) @ axes / h
    xx, yy, xy = daa * ax * ax + da * axx, daa * ay * ay + da * ayy, daa * ax * ay + da * axy
    xz, yz = daz * ax, daz * ay
    bend = graph.join(xx, xy, xz, xy, yy, yz, xz, yz, dzz).reshape(-1, 3, 3)
    hessian = graph.constant(axes.T) @ bend @ axes / (h * h)
    return d[0, 0], gradient, hessian
