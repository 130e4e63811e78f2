"""How far a touch surrogate's force may be off, relative to itself: one small matrix product.

The posterior of the linear weights w of ℓ = offset + scale · r·w, r = [1, ξ, φ], is kept as a root of their
covariance, C = root rootᵀ (c, z). A column of it moves ℓ by a = scale · r·column and its gradient by b, and the force
F = κ (U₀' ∇d − U₀ ∇ℓ) by F a − U b, so that

    E‖δF‖²/‖F‖² = Σ over columns of ‖F a − U b‖² / ‖F‖²,   E δF δFᵀ = Σ (F a − U b)(F a − U b)ᵀ

(first order in the weights). F and U are what the surrogate answers; r is taken at the input itself and not where a
continuation holds it: outside the trained region the tail, and with it the figure, goes on growing.
"""

from __future__ import annotations

import math

from numba import njit

from palpate.network.network_kernels import combine_lines, regressors_into

__all__ = ["covariances_into", "trust_at", "trusts_into"]

_jit = njit(cache=True, nogil=True, error_model="numpy")


@_jit
def _moved(answer, x, root, columns, net) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """F a − U b of each of the root's columns into columns[1:] (3, z)."""
    line = regressors_into(x, *net)
    combine_lines(net[0][line : line + 4], root, columns)
    for i in range(3):
        for k in range(root.shape[1]):
            columns[1 + i, k] = answer[2 + i] * columns[0, k] - answer[0] * columns[1 + i, k]


@_jit
def trust_at(answer, x, root, columns, net) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Relative deviation of the force in `answer` at x (n,): zero without contact; columns (4, z) is scratch."""
    size = math.sqrt(answer[2] * answer[2] + answer[3] * answer[3] + answer[4] * answer[4])
    if size == 0.0:
        return 0.0
    if root.shape[0] == 0:
        return math.nan
    _moved(answer, x, root, columns, net)
    total = 0.0
    for i in range(1, 4):
        for k in range(root.shape[1]):
            total += columns[i, k] * columns[i, k]
    return math.sqrt(total) / size


@_jit
def trusts_into(X, answers, out, root, columns, net) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """`trust_at` for each row of X (N, n) into out (N,)."""
    for i in range(X.shape[0]):
        out[i] = trust_at(answers[i], X[i], root, columns, net)


@_jit
def covariances_into(X, answers, out, root, columns, net) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Covariance of the force for each row of X (N, n) into out (N, 3, 3), N²: zero without contact."""
    for row in range(X.shape[0]):
        _moved(answers[row], X[row], root, columns, net)
        for i in range(3):
            for j in range(i, 3):
                total = 0.0
                for k in range(root.shape[1]):
                    total += columns[1 + i, k] * columns[1 + j, k]
                out[row, i, j] = total
                out[row, j, i] = total
