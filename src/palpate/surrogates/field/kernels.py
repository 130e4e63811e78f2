"""A field at one touch, compiled; nothing is allocated.

    y = rest + f(s) [Σ_k b_k(x̃) φ_k + dimple]            x = (c, further inputs)

with the coefficients b a network's, taken at x̃ as the energy is (see `palpate.surrogates.continuation`). Two steps:
the coefficients, within microseconds, and then the field on all nodes, in one pass over the modes.

What the kernels take:

    z         (1 + k,) answer of the first step: 1, then f b_k; in the precision of the modes
    place     (FRAME,) answer of the first step: s, f, then foot (3) and normal (3)
    lines     (2, n) scratch: x and x̃;  small (2, 3, 3) scratch: ∇²d, then ∇d as a row;  b (k,) scratch
    numbers   R, the input that R is or −1, s* and its w, then (p, s*, a) of the rise
    limits    (3, n): low and high ends and w of every input
    table     (parts, r, q), profile (parts, r) scratch, reach, touched nodes (T,) and their points (T, 3)
"""

from __future__ import annotations

import math

from numba import njit

from palpate.network.combine import combine
from palpate.network.evaluate import value_into
from palpate.surrogates.continuation import saturated
from palpate.surrogates.field.rise import rise_at
from palpate.surrogates.surface import distance_into

__all__ = ["FRAME", "coefficients_into", "field_into"]

_jit = njit(cache=True, nogil=True, error_model="numpy")
FRAME = 8


@_jit
def _taken(lines, limits) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Every input of line 1 saturates beyond its range."""
    for i in range(lines.shape[1]):
        t, low, high, width = lines[1, i], limits[0, i], limits[1, i], limits[2, i]
        if t < low:
            lines[1, i] = -saturated(-t, -low, width)[0]
        elif t > high:
            lines[1, i] = saturated(t, high, width)[0]


@_jit
def coefficients_into(c, p, z, place, b, lines, small, numbers, limits, surface, net) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Coefficients into z and the probe's frame into place; whether there is contact.

    Not-a-number where an input is not finite.
    """
    z[:] = 0.0
    z[0] = 1.0
    place[:] = 0.0
    for i in range(lines.shape[1]):
        lines[0, i] = c[i] if i < 3 else p[i - 3]
        if not math.isfinite(lines[0, i]):
            z[:] = math.nan
            return False
    g = small[1, 0]
    own = int(numbers[1])
    radius = numbers[0] if own < 0 else lines[0, own]
    d = distance_into(c, g, small[0], *surface)
    s = radius - d
    place[0] = s
    if s <= 0.0:
        return False
    f = rise_at(s, numbers[4], numbers[5], numbers[6])
    place[1] = f
    for i in range(lines.shape[1]):
        lines[1, i] = lines[0, i]
    deep = saturated(s, numbers[2], numbers[3])[0]
    for i in range(3):
        lines[1, i] += (s - deep) * g[i]
        place[2 + i] = c[i] - d * g[i]
        place[5 + i] = g[i]
    _taken(lines, limits)
    value_into(lines[1], b, *net)
    for k in range(b.size):
        z[1 + k] = f * b[k]
    return True


@_jit
def _profile(s, f, deepest, table, profile) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """The table's splines in ρ at one depth, times f."""
    q = table.shape[2]
    t = min(s / deepest * (q - 3), q - 3.0)
    j = min(int(t), q - 4)
    u = t - j
    v = 1.0 - u
    w0, w1 = f * v * v * v / 6.0, f * (3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0
    w2, w3 = f * (3.0 * v * v * v - 6.0 * v * v + 4.0) / 6.0, f * u * u * u / 6.0
    for a in range(table.shape[0]):
        for i in range(table.shape[1]):
            row = table[a, i]
            profile[a, i] = w0 * row[j] + w1 * row[j + 1] + w2 * row[j + 2] + w3 * row[j + 3]


@_jit
def _spline(u, first, row) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    v = 1.0 - u
    total = v * v * v * row[first] + (3.0 * u * u * u - 6.0 * u * u + 4.0) * row[first + 1]
    total += (3.0 * v * v * v - 6.0 * v * v + 4.0) * row[first + 2] + u * u * u * row[first + 3]
    return float(total / 6.0)


@_jit
def _add_dimple(y, place, profile, reach, nodes, points) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Add the travelling part to y (nodes · components,)."""
    parts, r = profile.shape
    per, square = (r - 3) / reach, reach * reach
    ox, oy, oz, nx, ny, nz = place[2], place[3], place[4], place[5], place[6], place[7]
    for i in range(nodes.size):
        x, e, h = points[i, 0] - ox, points[i, 1] - oy, points[i, 2] - oz
        q = x * x + e * e + h * h
        if q >= square:
            continue
        t = math.sqrt(q) * per
        first = min(int(t), r - 4)
        u, k = t - first, nodes[i]
        along = _spline(u, first, profile[0])
        if parts == 1:
            y[k] += along
            continue
        across = _spline(u, first, profile[1]) / reach
        along -= across * (x * nx + e * ny + h * nz)
        y[3 * k] += along * nx + across * x
        y[3 * k + 1] += along * ny + across * e
        y[3 * k + 2] += along * nz + across * h


@_jit
def field_into(y, z, place, numbers, rows, table, profile, reach, nodes, points) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """The field y (nodes · components,) from what `coefficients_into` has found; rows (1 + k, …): rest, modes."""
    if place[1] == 0.0 and z[0] == 1.0:
        for k in range(y.size):
            y[k] = rows[0, k]
        return
    combine(z, rows, y)
    if nodes.size and place[1] > 0.0:
        _profile(place[0], place[1], numbers[5], table, profile)
        _add_dimple(y, place, profile, reach, nodes, points)
