"""A field at one touch, compiled; nothing is allocated.

    y = rest + f(s) [Σ_k b_k(x̃) φ_k + local mode]            x = (c, further inputs)

with the coefficients b a network's, taken at x̃ as the energy is (see `palpate.surrogates.continuation`). Two steps:
the coefficients, within microseconds, and then the local mode's profile and the field on all nodes, in one pass over
the modes. What moves with the probe is also known at any places of the touched surface, of many touches at once.

What the kernels take:

    z         (1 + k,) answer of the first step: 1, then f b_k; in the precision of the modes
    place     (FRAME + p,) answer of the first step: s, f, contact point (3), normal (3), then the further inputs
    profile   (r, 4, components): the local mode is Σ_i B_i(ρ/L) Σ_h ξ_h/L profile[i, h] per component, ξ_h/L = 1
              and the coordinates of ξ/L = (X − contact point)/L
    lines     (2, n) scratch: x and x̃;  small (2, 3, 3) scratch: ∇²d, then ∇d as a row;  b (k,) scratch
    numbers   R, the input that R is or −1, s* and its w, then (p, s*, a) of the amplitude
    limits    (3, n): low and high ends and w of every input
    table     (parts, r, q), the local mode's own
    varied    (q · m, r · 4 · components) of `Variation`, with its powers, axes and scales; (0, …) without one
    chebyshev (v, degree + 1) and weights (4 + m + 4 m,) scratch
    reach     L, then touched nodes (T,) and their points (T, 3)
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import uint64

from palpate.kernels import kernel, part
from palpate.network.network_kernels import combine, point_into
from palpate.surrogates.continuation import saturated
from palpate.surrogates.fields.depth_amplitude import amplitude_at
from palpate.surrogates.fields.local_mode import OFFSETS, LocalMode
from palpate.surrogates.surface import distance_into

__all__ = [
    "FRAME",
    "coefficients_into",
    "field_into",
    "moving_into",
    "moving_values",
    "posed_coefficients_into",
    "profile_arguments",
    "profile_into",
]

FRAME = 8  # numbers of a place before the further inputs
SIXTH = 1.0 / 6.0


@part
def _taken(lines, limits) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Every input of line 1 saturates beyond its range."""
    for i in range(lines.shape[1]):
        t, low, high, width = lines[1, i], limits[0, i], limits[1, i], limits[2, i]
        if t < low:
            lines[1, i] = -saturated(-t, -low, width)[0]
        elif t > high:
            lines[1, i] = saturated(t, high, width)[0]


@part
def _begun(c, p, z, place, lines) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Put the inputs into the first line; whether all are finite."""
    z[:] = 0.0
    z[0] = 1.0
    place[:] = 0.0
    for i in range(lines.shape[1]):
        lines[0, i] = c[i] if i < 3 else p[i - 3]
        if not math.isfinite(lines[0, i]):
            z[:] = math.nan
            return False
    return True


@part
def _coefficients(z, place, b, lines, numbers, limits, net) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Coefficients of a touch whose depth, place and normal are in its frame."""
    s = place[0]
    f = amplitude_at(s, numbers[4], numbers[5], numbers[6])
    place[1] = f
    for i in range(lines.shape[1]):
        lines[1, i] = lines[0, i]
    deep = saturated(s, numbers[2], numbers[3])[0]
    for i in range(3):
        lines[1, i] += (s - deep) * place[5 + i]
    _taken(lines, limits)
    for i in range(3, lines.shape[1]):
        place[FRAME - 3 + i] = lines[1, i]
    point_into(lines[1], b, *net)
    for k in range(b.size):
        z[1 + k] = f * b[k]


@kernel
def coefficients_into(c, p, z, place, b, lines, small, numbers, limits, surface, net) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Coefficients into z and the probe's frame into place; whether there is contact.

    Not-a-number where an input is not finite.
    """
    if not _begun(c, p, z, place, lines):
        return False
    g = small[1, 0]
    own = int(numbers[1])
    radius = numbers[0] if own < 0 else lines[0, own]
    d = distance_into(c, g, small[0], *surface)
    s = radius - d
    place[0] = s
    if s <= 0.0:
        return False
    for i in range(3):
        place[2 + i] = c[i] - d * g[i]
        place[5 + i] = g[i]
    _coefficients(z, place, b, lines, numbers, limits, net)
    return True


@kernel
def posed_coefficients_into(c, p, s, contact_point, normal, z, place, b, lines, numbers, limits, net) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Coefficients and frame as above, of a touch whose depth s (m), place (3,) in m and normal (3,) are known."""
    if not _begun(c, p, z, place, lines):
        return False
    place[0] = s
    if s <= 0.0:
        return False
    for i in range(3):
        place[2 + i] = contact_point[i]
        place[5 + i] = normal[i]
    _coefficients(z, place, b, lines, numbers, limits, net)
    return True


@part
def _splines(u, weights) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """The four uniform cubic B-splines at u in [0, 1] of a cell into weights (4,)."""
    v = 1.0 - u
    weights[0], weights[1] = v * v * v / 6.0, (3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0
    weights[2], weights[3] = (3.0 * v * v * v - 6.0 * v * v + 4.0) / 6.0, u * u * u / 6.0


@part
def _products(place, powers, axes, scales, chebyshev, values) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Polynomials of the place and the further inputs into the first of values."""
    a = axes.shape[0]
    for v in range(scales.shape[1]):
        t = place[FRAME - a + v] if v >= a else 0.0
        if v < a:
            for i in range(3):
                t += axes[v, i] * place[2 + i]
        t = min(max((t - scales[0, v]) / scales[1, v], -1.0), 1.0)
        chebyshev[v, 0], chebyshev[v, 1] = 1.0, t
        for k in range(2, chebyshev.shape[1]):
            chebyshev[v, k] = 2.0 * t * chebyshev[v, k - 1] - chebyshev[v, k - 2]
    for m in range(powers.shape[0]):
        value = 1.0
        for v in range(powers.shape[1]):
            value *= chebyshev[v, powers[m, v]]
        values[m] = value


@kernel
def profile_into(profile, place, deepest, table, varied, powers, axes, scales, chebyshev, weights) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """The local mode at one touch, f included: splines in ρ times 1 and the offset's coordinates over L; see above."""
    four, share, f = weights[:4], min(place[0] / deepest, 1.0), place[1]
    r, many, components = profile.shape
    flat = profile.reshape(r * many * components)
    flat[:] = 0.0
    if f == 0.0:
        return
    if varied.shape[0]:
        m = powers.shape[0]
        q = varied.shape[0] // m
        in_place, both = weights[4 : 4 + m], weights[4 + m :]
        j = min(int(share * (q - 3)), q - 4)
        _splines(share * (q - 3) - j, four)
        _products(place, powers, axes, scales, chebyshev, in_place)
        for k in range(4):
            for i in range(m):
                both[k * m + i] = f * four[k] * in_place[i]
        combine(both, varied[j * m : (j + 4) * m], flat)
    q = table.shape[2]
    j = min(int(share * (q - 3)), q - 4)
    _splines(share * (q - 3) - j, four)
    for i in range(r):
        along, across = 0.0, 0.0
        for k in range(4):
            along += f * four[k] * table[0, i, j + k]
            if components > 1:
                across += f * four[k] * table[1, i, j + k]
        if components == 1:
            profile[i, 0, 0] += along
            continue
        for c in range(3):
            profile[i, 0, c] += along * place[5 + c]
            profile[i, 1 + c, c] += across
            for e in range(3):
                profile[i, 1 + e, c] -= across * place[5 + e] * place[5 + c]


# a product and a sum rounded once: faster, and no less exact
@kernel(fastmath={"contract"})
def moving_into(y, place, profile, line, reach, nodes, points) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Add the moving part to y (nodes · components,); line (4 · components,) is scratch."""
    r, components = profile.shape[0], profile.shape[2]
    wide = line.size
    flat = profile.reshape(r, wide)
    ox, oy, oz, per = place[2], place[3], place[4], 1.0 / reach
    for i in range(nodes.size):
        x, e, h = (points[i, 0] - ox) * per, (points[i, 1] - oy) * per, (points[i, 2] - oz) * per
        q = x * x + e * e + h * h
        if q >= 1.0:
            continue
        t = math.sqrt(q) * (r - 3)
        first = uint64(min(int(t), r - 4))  # unsigned: no index counts from the end
        u = t - first
        v = 1.0 - u
        b0, b3 = v * v * v * SIXTH, u * u * u * SIXTH
        b1, b2 = (0.5 * u - 1.0) * u * u + 4.0 * SIXTH, (0.5 * v - 1.0) * v * v + 4.0 * SIXTH
        for k in range(wide):
            two = b0 * flat[first, k] + b1 * flat[first + uint64(1), k]
            line[k] = two + b2 * flat[first + uint64(2), k] + b3 * flat[first + uint64(3), k]
        at = components * nodes[i]
        for c in range(components):
            moved = line[c] + x * line[components + c]
            y[at + c] += moved + e * line[2 * components + c] + h * line[3 * components + c]


@kernel
def field_into(y, z, place, rows, profile, line, reach, nodes, points) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """The field y (nodes · components,) from coefficients, place and profile; rows (1 + k, …): rest, modes."""
    if place[1] == 0.0 and z[0] == 1.0:
        for k in range(y.size):
            y[k] = rows[0, k]
        return
    combine(z, rows, y)
    if nodes.size and place[1] > 0.0:
        moving_into(y, place, profile, line, reach, nodes, points)


def profile_arguments(local_mode: LocalMode | None, deepest: float) -> tuple[Any, ...]:
    """(s*, table, varied, powers, axes, scales, chebyshev, weights): what `profile_into` takes last."""
    table = np.zeros((1, 4, 4)) if local_mode is None else local_mode.table
    own = None if local_mode is None else local_mode.variation
    if own is None:
        none = (np.zeros((0, 0)), np.zeros((0, 0), np.int64), np.zeros((0, 3)), np.zeros((2, 0)))
        return deepest, table, *none, np.zeros((0, 2)), np.zeros(4)
    q, m = own.table.shape[:2]
    degrees = np.zeros((own.powers.shape[1], max(int(own.powers.max(initial=0)), 1) + 1))
    arguments = (own.table.reshape(q * m, -1), own.powers, own.axes, own.scales)
    return deepest, table, *arguments, degrees, np.zeros(4 + 5 * m)


def moving_values(
    local_mode: LocalMode, deepest: float, touches: np.ndarray, points: np.ndarray
) -> np.ndarray:
    """Return the local mode (N, P, components), f included, as if all points were on the touched surface.

    `deepest` is s* of the amplitude, m. A touch is a row of (N, 8 + p): depth s (m), f, contact point (m), normal,
    further inputs. The points (P, 3) are places at rest, m.
    """
    components = 1 if len(local_mode.table) == 1 else 3
    arguments = profile_arguments(local_mode, deepest)
    profile = np.zeros((local_mode.table.shape[1], OFFSETS, components))
    out, line = np.zeros((len(touches), len(points), components)), np.zeros(OFFSETS * components)
    points, every = np.ascontiguousarray(points), np.arange(len(points))
    for touch, values in zip(np.ascontiguousarray(touches), out, strict=True):
        profile_into(profile, touch, *arguments)
        moving_into(values.reshape(-1), touch, profile, line, local_mode.reach, every, points)
    return out
