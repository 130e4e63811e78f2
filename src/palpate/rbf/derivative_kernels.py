"""Slopes and curvatures of units and their derivatives by A and b, summed over images: see `regressors`.

What a refinement spends its time on. The chain rule to a unit's own numbers is linear, so it comes once, after the sum.
Of derivatives f[c, N, a, …] at the image c of sample N those at the sample are Σ_c turns[c, a, i] f[c, N, a, …].
"""

from __future__ import annotations

import numpy as np

from palpate.kernels import kernel

__all__ = ["curvatures_by_factors", "slopes_by_factors"]

Derivatives = tuple[np.ndarray, np.ndarray, np.ndarray]
Pattern = tuple[np.ndarray, np.ndarray]
_NO_PATTERN = (np.zeros(0, np.int64), np.zeros(0, np.int64))


def slopes_by_factors(
    points: np.ndarray,
    turns: np.ndarray,
    v: np.ndarray,
    g: tuple[np.ndarray, np.ndarray],
    A: np.ndarray,
    pattern: Pattern | None,
) -> Derivatives:
    """Return ∂φ_k/∂x_i (N, n, h), and its derivatives by A's entries (N, n, h, e) and by b (N, n, h, r).

    `points` (c, N, n) are the images of the samples, and `turns` (c, n, n) the G of each; v (c, N, h, r) is A_k x − b_k
    with the units' factors A (h, r, n), and g holds g' and g'', (c, N, h) each. The pattern gives rows and columns (e,)
    of A's entries; without it the derivatives by A and b are left out.
    """
    found = _blank(v, points.shape[2], pattern)
    _slopes_into(points, turns, v, g, A, pattern or _NO_PATTERN, found)
    return found


def curvatures_by_factors(
    points: np.ndarray,
    turns: np.ndarray,
    v: np.ndarray,
    g: tuple[np.ndarray, np.ndarray, np.ndarray],
    A: np.ndarray,
    pattern: Pattern | None,
    pairs: tuple[np.ndarray, np.ndarray],
) -> Derivatives:
    """∂²φ_k/∂x_i∂x_j (N, q, h), i ≤ j, and its derivatives by A's entries (N, q, h, e) and by b (N, q, h, r).

    As `slopes_by_factors`, with g', g'' and g‴, turns (c, q, q) of the q pairs, and the pairs' indices i and j.
    """
    found = _blank(v, len(pairs[0]), pattern)
    _curvatures_into(points, turns, v, g, A, pattern or _NO_PATTERN, pairs, found)
    return found


def _blank(v: np.ndarray, count: int, pattern: Pattern | None) -> Derivatives:
    """Zeros for so many derivatives by the inputs, of no size for what is left out; complex where v is."""
    (_, N, h, r), e = v.shape, 0 if pattern is None else len(pattern[0])
    shapes = ((N, count, h), (N, count, h, e), (N, count, h, r if pattern else 0))
    first, second, third = (np.zeros(shape, v.dtype) for shape in shapes)
    return first, second, third


@kernel(allocates=True)
def _slopes_into(points, turns, v, g, A, pattern, found) -> None:
    (g1, g2), (rows, columns), (slopes, by_entry, by_shift) = g, pattern, found
    c, N, n = points.shape
    h, r, _ = A.shape
    by_v = np.empty(r, v.dtype)
    for m in range(c):
        for s in range(N):
            for k in range(h):
                two, four = 2.0 * g1[m, s, k], 4.0 * g2[m, s, k]
                for a in range(n):
                    u = 0.0 * v[m, s, k, 0]
                    for d in range(r):
                        u += A[k, d, a] * v[m, s, k, d]
                    for d in range(r):
                        by_v[d] = four * u * v[m, s, k, d] + two * A[k, d, a]
                    for i in range(n):
                        t = turns[m, a, i]
                        if t == 0.0:
                            continue
                        slopes[s, i, k] += t * two * u
                        for d in range(by_shift.shape[3]):
                            by_shift[s, i, k, d] -= t * by_v[d]
                        for e in range(rows.size):
                            one = by_v[rows[e]] * points[m, s, columns[e]]
                            if columns[e] == a:
                                one += two * v[m, s, k, rows[e]]
                            by_entry[s, i, k, e] += t * one


@kernel(allocates=True)
def _curvatures_into(points, turns, v, g, A, pattern, pairs, found) -> None:  # noqa: PLR0912
    (g1, g2, g3), (rows, columns), (first, second) = g, pattern, pairs
    bends, by_entry, by_shift = found
    c, N, n = points.shape
    h, r, _ = A.shape
    u, by_v, by_A = np.empty(n, v.dtype), np.empty(r, v.dtype), np.empty(rows.size, v.dtype)
    for m in range(c):
        for s in range(N):
            for k in range(h):
                two, four, eight = 2.0 * g1[m, s, k], 4.0 * g2[m, s, k], 8.0 * g3[m, s, k]
                for a in range(n):
                    u[a] = 0.0
                    for d in range(r):
                        u[a] += A[k, d, a] * v[m, s, k, d]
                for p in range(first.size):
                    a, b = first[p], second[p]
                    B = 0.0
                    for d in range(r):
                        B += A[k, d, a] * A[k, d, b]
                    through = eight * u[a] * u[b] + four * B
                    for d in range(r):
                        across = A[k, d, a] * u[b] + u[a] * A[k, d, b]
                        by_v[d] = through * v[m, s, k, d] + four * across
                    for e in range(rows.size):
                        d = rows[e]
                        by_A[e] = by_v[d] * points[m, s, columns[e]]
                        if columns[e] == a:
                            by_A[e] += four * v[m, s, k, d] * u[b] + two * A[k, d, b]
                        if columns[e] == b:
                            by_A[e] += four * v[m, s, k, d] * u[a] + two * A[k, d, a]
                    for i in range(first.size):
                        t = turns[m, p, i]
                        if t == 0.0:
                            continue
                        bends[s, i, k] += t * (four * u[a] * u[b] + two * B)
                        for d in range(by_shift.shape[3]):
                            by_shift[s, i, k, d] -= t * by_v[d]
                        for e in range(rows.size):
                            by_entry[s, i, k, e] += t * by_A[e]
