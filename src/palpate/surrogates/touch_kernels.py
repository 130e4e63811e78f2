"""Energy, force and stiffness of a touch in one pass, compiled; nothing is allocated.

    U(x) = U₀(s) κ,   κ = exp ℓ(x̃(x)),   s = R − d(c)              x = (c, further inputs)
    F    = −∂U/∂c  = κ (U₀' ∇d − U₀ ∇ℓ)
    ∂F/∂c          = κ [U₀' ∇²d − U₀'' ∇d ∇dᵀ + U₀' (∇d ∇ℓᵀ + ∇ℓ ∇dᵀ) − U₀ (∇ℓ ∇ℓᵀ + ∇²ℓ)]

with ∇s = −∇d, ∇ℓ and ∇²ℓ by c through x̃ (see `continuation`). Products of U₀ and its logarithm's derivatives are
closed forms (see `laws`), so nothing overflows as s → 0; at s ≤ 0 all are exactly zero.

What the kernels take:

    answer    (14,): U, s, F, ∂F/∂c row by row
    lines     (4, n) scratch: x, x̃ and its slopes and curvatures by x, each input by its own range
    small     (SMALL, 3, 3) scratch: four matrices, then vectors row by row; the last is the trained point last near
    numbers   see the places below
    limits    (3, n): low and high ends and w of every input
    points    (S, n) of the trained region, scaled; (0, n) without one
    grams     of `second_order`
    surface, net   tuples: of the touched surface and of the network
"""

from __future__ import annotations

import math

from numba import njit

from palpate.network.network_kernels import second_order_into
from palpate.surrogates.continuation import saturated
from palpate.surrogates.laws import law_at
from palpate.surrogates.surface import distance_into

__all__ = [
    "ANSWER",
    "FORCE",
    "SMALL",
    "STIFFNESS",
    "VECTORS",
    "boxed",
    "gathered",
    "near",
    "through_box",
    "touch_into",
    "touches_into",
]

_jit = njit(cache=True, nogil=True, error_model="numpy")

ANSWER, FORCE, STIFFNESS = 14, slice(2, 5), slice(5, 14)
# places in `numbers`: 2p, f and a of the law; R; the input that R is, or −1; s* and its w; radius of the region; step
_TWICE, _FACTOR, _LENGTH, _RADIUS, _RADIUS_INPUT, _DEEPEST, _DEPTH_WIDTH, _REGION, _STEP = range(9)
_SLACK = 1e-9  # of a range: round-off at its edge is still inside
# places in `small`: ∇²d, ∇²ℓ and two more of their like; then ∇d, ∇ℓ and others as rows
_SURFACE, _LOG, _BEND, _OTHER, VECTORS, _MORE = range(6)
_LAST = 2  # row of small[MORE]
SMALL = 6


@_jit
def boxed(lines, limits) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Every input of line 1 saturates beyond its range; slopes and curvatures into lines 2 and 3."""
    for i in range(lines.shape[1]):
        t, low, high, width = lines[1, i], limits[0, i], limits[1, i], limits[2, i]
        if t < low:
            value, slope, curvature = saturated(-t, -low, width)
            lines[1, i], lines[2, i], lines[3, i] = -value, slope, -curvature
        else:
            lines[1, i], lines[2, i], lines[3, i] = saturated(t, high, width)


@_jit
def through_box(g, H, lines) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """∇ℓ and ∇²ℓ by what came before the saturation of the ranges."""
    for i in range(3):
        for j in range(3):
            H[i, j] *= lines[2, i] * lines[2, j]
        H[i, i] += lines[3, i] * g[i]
    for i in range(3):
        g[i] *= lines[2, i]


@_jit
def _bend(x, g, small, step, surface) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Derivative of ∇²d along g into small[BEND], by differences of fourth order; symmetric as ∇²d is."""
    size = math.sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2])
    small[_BEND, :, :] = 0.0
    if size == 0.0:
        return
    moved, unused, other = small[VECTORS, 2], small[_MORE, 0], small[_OTHER]
    for many, weight in ((1.0, 8.0), (-1.0, -8.0), (2.0, -1.0), (-2.0, 1.0)):
        for i in range(3):
            moved[i] = x[i] + many * step * g[i] / size
        distance_into(moved, unused, other, *surface)
        for i in range(3):
            for j in range(3):
                small[_BEND, i, j] += weight * size / (12.0 * step) * other[i, j]


@_jit
def _through_depth(x, excess, slope, curvature, small, step, surface) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """∇ℓ and ∇²ℓ by c, from those by c̃ = c + m ∇d, m = s − σ(s).

    J = I + m ∇²d − (1 − σ') ∇d ∇dᵀ takes g to J g and ∇²ℓ to J ∇²ℓ J, and with h = ∇²d g there remains
    −(1 − σ')(∇d hᵀ + h ∇dᵀ + (∇d·g) ∇²d) − σ'' (∇d·g) ∇d ∇dᵀ + m ∂∇²d/∂g.
    """
    D, H, bend, J = small[_SURFACE], small[_LOG], small[_BEND], small[_OTHER]
    d, g, new, h = small[VECTORS, 0], small[VECTORS, 1], small[_MORE, 0], small[_MORE, 1]
    _bend(x, g, small, step, surface)
    along, rest = d[0] * g[0] + d[1] * g[1] + d[2] * g[2], 1.0 - slope
    for i in range(3):
        h[i] = D[i, 0] * g[0] + D[i, 1] * g[1] + D[i, 2] * g[2]
        for j in range(3):
            J[i, j] = excess * D[i, j] - rest * d[i] * d[j]
        J[i, i] += 1.0
    for i in range(3):
        new[i] = J[i, 0] * g[0] + J[i, 1] * g[1] + J[i, 2] * g[2]
        for j in range(3):
            total = excess * bend[i, j] - (rest * D[i, j] + curvature * d[i] * d[j]) * along
            total -= rest * (d[i] * h[j] + h[i] * d[j])
            for a in range(3):
                for b in range(3):
                    total += J[i, a] * H[a, b] * J[j, b]
            bend[i, j] = total
    for i in range(3):
        g[i] = new[i]
        for j in range(3):
            H[i, j] = bend[i, j]


@_jit
def _assemble(answer, kappa, law, small) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """U, F and ∂F/∂c from the law's and the factor's derivatives; symmetric to the last bit."""
    D, H, d, g = small[_SURFACE], small[_LOG], small[VECTORS, 0], small[VECTORS, 1]
    value, slope, curvature = kappa * law[0], kappa * law[1], kappa * law[2]
    answer[0] = value
    for i in range(3):
        answer[2 + i] = slope * d[i] - value * g[i]
        for j in range(i, 3):
            k = slope * (D[i, j] + (d[i] * g[j] + g[i] * d[j])) - curvature * d[i] * d[j]
            k -= value * (g[i] * g[j] + H[i, j])
            answer[5 + 3 * i + j] = k
            answer[5 + 3 * j + i] = k


@_jit
def near(x, points, radius, last) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Whether a trained point is within the radius; hands move little: the search begins where it last ended."""
    S = points.shape[0]
    bound, start = radius * radius * (1.0 + _SLACK), int(last[0])
    for k in range(S):
        i = start + k if start + k < S else start + k - S
        q = 0.0
        for j in range(x.size):
            q += (x[j] - points[i, j]) ** 2
        if q <= bound:
            last[0] = i
            return True
    return bool(S == 0)


@_jit
def _inside(lines, limits, s, numbers, points, scales, small) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Whether x (line 0) is in its ranges, no deeper than trained, and near a training input; line 1 is lost."""
    if s > numbers[_DEEPEST] * (1.0 + _SLACK):
        return False
    for i in range(lines.shape[1]):
        slack = _SLACK * (limits[1, i] - limits[0, i])
        if lines[0, i] < limits[0, i] - slack or lines[0, i] > limits[1, i] + slack:
            return False
        lines[1, i] = (lines[0, i] - scales[0, i]) / scales[1, i]
    return bool(near(lines[1], points, numbers[_REGION], small[_MORE, _LAST]))


@_jit
def gathered(position, parameters, lines) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """x into line 0; whether all of it is finite."""
    for i in range(3):
        lines[0, i] = position[i]
    for i in range(parameters.size):
        lines[0, 3 + i] = parameters[i]
    finite = True
    for i in range(lines.shape[1]):
        finite = finite and math.isfinite(lines[0, i])
    return finite


@_jit
def touch_into(c, p, answer, lines, small, numbers, limits, points, grams, surface, net) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Fill `answer` at a centre c (3,) and further inputs p (…,); whether that is inside the trained region.

    Without contact the answer is exact wherever it is, and counts as inside. Where an input is not finite the
    whole answer is not-a-number.
    """
    answer[:] = 0.0
    if not gathered(c, p, lines):
        answer[:] = math.nan
        return False
    d, g = small[VECTORS, 0], small[VECTORS, 1]
    own = int(numbers[_RADIUS_INPUT])
    radius = numbers[_RADIUS] if own < 0 else lines[0, own]
    s = radius - distance_into(c, d, small[_SURFACE], *surface)
    answer[1] = s
    if s <= 0.0:
        return True
    depth, slope, curvature = saturated(s, numbers[_DEEPEST], numbers[_DEPTH_WIDTH])
    for i in range(lines.shape[1]):
        lines[1, i] = lines[0, i]
    for i in range(3):
        lines[1, i] += (s - depth) * d[i]
    boxed(lines, limits)
    log_kappa = second_order_into(lines[1], g, small[_LOG], grams, *net)
    through_box(g, small[_LOG], lines)
    if s > depth:
        _through_depth(c, s - depth, slope, curvature, small, numbers[_STEP], surface)
    law = law_at(s, numbers[_TWICE], numbers[_FACTOR], numbers[_LENGTH])
    _assemble(answer, math.exp(log_kappa), law, small)
    return _inside(lines, limits, s, numbers, points, net[3], small)


@_jit
def touches_into(X, answers, inside, lines, small, numbers, limits, points, grams, surface, net) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """`touch_into` for each row of X (N, n), into answers (N, 14) and inside (N,)."""
    for i in range(X.shape[0]):
        inside[i] = touch_into(
            X[i, :3], X[i, 3:], answers[i], lines, small, numbers, limits, points, grams, surface, net
        )
