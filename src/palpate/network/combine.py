"""Sums of rows, y = z · rows, compiled: term after term for each output, whatever way the loops run.

The order of the sum never depends on the sizes, so a term of zero changes no bit of it wherever it stands.
"""

from __future__ import annotations

from numba import njit

__all__ = ["combine", "combine_lines"]

_jit = njit(cache=True, nogil=True, error_model="numpy")
_SMALL = 8  # outputs: fewer are summed in registers, more along the rows


@_jit
def combine(z, rows, y) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """y (m,) = Σ_k z[k] rows[k], rows (K, m), with z at least K long."""
    if rows.shape[1] < _SMALL:
        _few(z, rows, y)
    else:
        _many(z, rows, y)


@_jit
def combine_lines(Z, rows, Y) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """`combine` for each line of Z (n, ≥ K) into Y (n, m)."""
    for i in range(Z.shape[0]):
        combine(Z[i], rows, Y[i])


@_jit
def _few(z, rows, y) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Up to four running sums at a time, in registers."""
    count, m = rows.shape
    j = 0
    while j + 3 <= m:
        a, b, c = z[0] * rows[0, j], z[0] * rows[0, j + 1], z[0] * rows[0, j + 2]
        for k in range(1, count):
            a += z[k] * rows[k, j]
            b += z[k] * rows[k, j + 1]
            c += z[k] * rows[k, j + 2]
        y[j], y[j + 1], y[j + 2] = a, b, c
        j += 3
    while j < m:
        a = z[0] * rows[0, j]
        for k in range(1, count):
            a += z[k] * rows[k, j]
        y[j] = a
        j += 1


@_jit
def _many(z, rows, y) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Eight rows pass at a time, so that y is loaded and stored less often."""
    count, m = rows.shape
    for j in range(m):
        y[j] = z[0] * rows[0, j]
    k = 1
    while k + 8 <= count:
        a, b, c, d = z[k], z[k + 1], z[k + 2], z[k + 3]
        e, f, g, h = z[k + 4], z[k + 5], z[k + 6], z[k + 7]
        for j in range(m):
            t = y[j] + a * rows[k, j]
            t = t + b * rows[k + 1, j]
            t = t + c * rows[k + 2, j]
            t = t + d * rows[k + 3, j]
            t = t + e * rows[k + 4, j]
            t = t + f * rows[k + 5, j]
            t = t + g * rows[k + 6, j]
            y[j] = t + h * rows[k + 7, j]
        k += 8
    while k < count:
        a = z[k]
        for j in range(m):
            y[j] += a * rows[k, j]
        k += 1
