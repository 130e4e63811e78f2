"""One held pad: energy, force and stiffness by its displacement, in one pass and without allocation.

With v = S d, a = S v, ℓ the network's and the polynomial's sum, κ = exp ℓ and g = ∇ℓ, all derivatives by d,

    U = ½ κ v·v       F = −κ (a + ½ v·v g)       ∂F/∂d = −κ [S² + a gᵀ + g aᵀ + ½ v·v (g gᵀ + ∇²ℓ)]

so that nothing is divided and d = 0 gives U = 0, F = 0 and ∂F/∂d = −κ S². ℓ and S are taken at saturated inputs
outside the trained ranges (see `palpate.surrogates.continuation`).
"""

from __future__ import annotations

import math

from numba import njit

from palpate.network.network_kernels import second_order_into
from palpate.surrogates.grasp.rest import root_at
from palpate.surrogates.grasp.stiffening import stiffening_into
from palpate.surrogates.touch_kernels import boxed, gathered, near, through_box

__all__ = ["grasp_into", "grasps_into"]

_jit = njit(cache=True, nogil=True, error_model="numpy")

_SLACK = 1e-9  # of a range: round-off at its edge is still inside
_ROOT, _LOG, _, _, _VECTORS, _MORE = range(6)  # places in `small`
_LAST = 2  # row of small[MORE]
_SCALED = 4  # line in which the scaled inputs are


@_jit
def _assemble(answer, d, kappa, small) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """U, |d|, F and ∂F/∂d; symmetric to the last bit."""
    S, L, g = small[_ROOT], small[_LOG], small[_VECTORS, 1]
    v, a = small[_VECTORS, 0], small[_VECTORS, 2]
    twice = 0.0
    for i in range(3):
        v[i] = S[i, 0] * d[0] + S[i, 1] * d[1] + S[i, 2] * d[2]
        twice += v[i] * v[i]
    for i in range(3):
        a[i] = S[i, 0] * v[0] + S[i, 1] * v[1] + S[i, 2] * v[2]
    value = 0.5 * kappa * twice
    answer[0] = value
    answer[1] = math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    for i in range(3):
        answer[2 + i] = 0.0 - (kappa * a[i] + value * g[i])
        for j in range(i, 3):
            square = S[i, 0] * S[0, j] + S[i, 1] * S[1, j] + S[i, 2] * S[2, j]
            k = -kappa * (square + (a[i] * g[j] + g[i] * a[j])) - value * (g[i] * g[j] + L[i, j])
            answer[5 + 3 * i + j] = k
            answer[5 + 3 * j + i] = k


@_jit
def _inside(lines, limits, points, radius, scales, small) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Whether the input (line 0) is in its ranges and near a training input; line 1 is lost."""
    for i in range(lines.shape[1]):
        slack = _SLACK * (limits[1, i] - limits[0, i])
        if lines[0, i] < limits[0, i] - slack or lines[0, i] > limits[1, i] + slack:
            return False
        lines[1, i] = (lines[0, i] - scales[0, i]) / scales[1, i]
    return bool(near(lines[1], points, radius, small[_MORE, _LAST]))


@_jit
def grasp_into(d, y, answer, lines, small, radius, limits, points, laws, grams, net) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Fill `answer` at a displacement d (3,) and further inputs y; whether that is inside the trained region.

    Where an input is not finite the whole answer is not-a-number.
    """
    answer[:] = 0.0
    if not gathered(d, y, lines):
        answer[:] = math.nan
        return False
    for i in range(lines.shape[1]):
        lines[1, i] = lines[0, i]
    boxed(lines, limits)
    xi, scales = lines[_SCALED], net[3]
    for i in range(lines.shape[1]):
        xi[i] = (lines[1, i] - scales[0, i]) / scales[1, i]
    root_at(xi[3:], small[_ROOT], *laws[0])
    g = small[_VECTORS, 1]
    log_kappa = second_order_into(lines[1], g, small[_LOG], grams, *net)
    log_kappa += stiffening_into(xi, g, small[_LOG], scales, *laws[1])
    through_box(g, small[_LOG], lines)
    _assemble(answer, lines[0], math.exp(log_kappa), small)
    return _inside(lines, limits, points, radius, scales, small)


@_jit
def grasps_into(X, answers, inside, lines, small, radius, limits, points, laws, grams, net) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """`grasp_into` for each row of X (N, n), into answers (N, 14) and inside (N,)."""
    for i in range(X.shape[0]):
        inside[i] = grasp_into(
            X[i, :3], X[i, 3:], answers[i], lines, small, radius, limits, points, laws, grams, net
        )
