"""Value, slope and curvature of a network's only output in one pass, by its first q inputs.

What `evaluate` does in three calls, each of which finds every unit anew. The curvature of unit k,
4 g'' u uᵀ + 2 g' AᵀA with u = Aᵀ(A ξ − b), needs AᵀA, which never changes: `gram` keeps it along the units.
After their own arguments the kernels take what `Network.compiled` makes.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from palpate.errors import UsageError
from palpate.network.combine import combine
from palpate.network.evaluate import _places, _regress, _slopes
from palpate.network.network import Network
from palpate.network.radial_kernels import D1, D2, HEAD, P, T

__all__ = ["gram", "regressors_into", "second_order_into"]

_jit = njit(cache=True, nogil=True, error_model="numpy")


def gram(network: Network, q: int) -> np.ndarray:
    """Entries i ≤ j of A_kᵀA_k for the first q inputs, row by row, (q (q + 1)/2, h).

    Raises
    ------
    UsageError
        If the network has several outputs or a basis, or fewer than q inputs.
    """
    if len(network.outputs) != 1 or network.basis is not None or not 1 <= q <= len(network.inputs):
        raise UsageError(
            f"Curvature by {q} inputs is not to be had from {network}.",
            why="It is of one output, without modes, and by inputs that exist.",
            fix="Pick one output: network.select([0]).",
        )
    A = network.factors[:, :, :q]
    i, j = np.triu_indices(q)
    return np.ascontiguousarray(np.einsum("kri,krj->kij", A, A)[:, i, j].T)


@_jit
def _pulled(line, q, work, layout, scales, units) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """u = Aᵀ(A ξ − b) of all units, one line after `line` for each of the first q inputs."""
    first, h = 1 + scales.shape[1], units.shape[1]
    for i in range(q):
        for k in range(h):
            work[line + 1 + i, first + k] = 0.0
    for e in range(layout.shape[0] - 1):
        column = layout[1 + e, 1]
        if column < q:
            row, target = HEAD + layout[1 + e, 0], line + 1 + column
            for k in range(h):
                work[target, first + k] += units[e, k] * work[row, k]


@_jit
def second_order_into(x, g, H, grams, work, steps, layout, scales, units, rows, modes, constants) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """f at x (n,); ∂f/∂x into g (q,) and ∂²f/∂x² into H (q, q), by the first q inputs."""
    q, n, h = g.size, x.size, units.shape[1]
    line, _ = _places(work, layout, scales, units)
    _regress(x, line, work, steps, layout, scales, units, constants, 1)
    combine(work[line], rows, g[:1])
    value = g[0]
    _pulled(line, q, work, layout, scales, units)
    first = 1 + n
    for k in range(h):
        work[P, k] = 2.0 * rows[1 + n + k, 0] * work[D1, k]
        work[T, k] = 4.0 * rows[1 + n + k, 0] * work[D2, k]
    pair = 0
    for i in range(q):
        total = rows[1 + i, 0]
        for k in range(h):
            total += work[P, k] * work[line + 1 + i, first + k]
        g[i] = total / scales[1, i]
        for j in range(i, q):
            total = 0.0
            for k in range(h):
                total += work[P, k] * grams[pair, k]
                total += work[T, k] * work[line + 1 + i, first + k] * work[line + 1 + j, first + k]
            H[i, j] = total / (scales[1, i] * scales[1, j])
            H[j, i] = H[i, j]
            pair += 1
    return float(value)


@_jit
def regressors_into(x, work, steps, layout, scales, units, rows, modes, constants) -> int:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """[1, ξ, φ] at x (n,) into one line of work, its n derivatives by x into the next; the line's number."""
    line, _ = _places(work, layout, scales, units)
    _regress(x, line, work, steps, layout, scales, units, constants, 1)
    _slopes(line, work, layout, scales, units)
    return int(line)
