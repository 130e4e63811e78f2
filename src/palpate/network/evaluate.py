"""Compiled evaluation of a radial-basis-function network: nothing is allocated per call.

    f(x) = modes · (T·[1, ξ] + Σ_k w_k g(‖A_k ξ − b_k‖²))

Every form of unit is one factor A_k (r, n) whose structural zeros are left out: only the e entries of the common
pattern are kept, each as one row over all units, so that loops run along the units and a diagonal or rank-1
factor costs n products, not n². Sums over units and entries are taken in order, one after the other, and never
fused: a unit of zero weight changes no bit, a batch gives what single points give, and since the exponential is
this project's own, a network answers with the same bits on every machine.

After their own arguments all kernels take what `Network.compiled` makes:

    work     rows of scratch: those of `radial_kernels`, then [1, ξ, φ] and its n derivatives by x, then
             [1, latent outputs] and its n derivatives
    steps    the same memory as integers
    layout   (1 + e, 2): the radial function's place in `RADIAL_FUNCTIONS`; row and column of A's entries, row by row
    scales   (2, n): centre and half width of each input, always in double precision
    units    (e + r, h): entries of the factors, then shifts
    rows     (1 + n + h, k): constant, slopes and weights of the k latent outputs
    modes    (1 + k, m): offset and output modes; (0, 0) where the latent outputs are the outputs
    constants  of `radial_kernels.constants`
"""

from __future__ import annotations

from numba import njit

from palpate.network.combine import combine, combine_lines
from palpate.network.radial_kernels import D1, D2, HEAD, Q, radial_into

__all__ = ["hessian_into", "jacobian_into", "value_and_jacobian_into", "value_into", "values_into"]

# fastmath stays off: the runtime must agree with Network.predict to the last bits on every machine
_jit = njit(cache=True, nogil=True, error_model="numpy")


@_jit
def _regress(x, line, work, steps, layout, scales, units, constants, order) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Fill a line of work with [1, ξ, φ]; A ξ − b and the radial function's derivatives stay in work."""
    n, h, count = x.size, units.shape[1], layout.shape[0] - 1
    work[line, 0] = 1.0
    for i in range(n):
        work[line, 1 + i] = (x[i] - scales[0, i]) / scales[1, i]
    for k in range(h):
        work[Q, k] = 0.0
    e = 0
    for a in range(units.shape[0] - count):
        row = HEAD + a
        for k in range(h):
            work[row, k] = -units[count + a, k]
        while e < count and layout[1 + e, 0] == a:
            t = work[line, 1 + layout[1 + e, 1]]
            for k in range(h):
                work[row, k] += units[e, k] * t
            e += 1
        for k in range(h):
            work[Q, k] += work[row, k] * work[row, k]
    radial_into(layout[0, 0], work, steps, work[line, 1 + n : 1 + n + h], constants, order)


@_jit
def _slopes(line, work, layout, scales, units) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Fill the n lines after `line` with the derivatives of [1, ξ, φ] by x; needs `_regress` with order 1."""
    n, h = scales.shape[1], units.shape[1]
    for i in range(n):
        for k in range(1 + n + h):
            work[line + 1 + i, k] = 0.0
    for e in range(layout.shape[0] - 1):
        row, target = HEAD + layout[1 + e, 0], line + 1 + layout[1 + e, 1]
        for k in range(h):
            work[target, 1 + n + k] += units[e, k] * work[row, k]
    for i in range(n):
        target = line + 1 + i
        work[target, 1 + i] = 1.0 / scales[1, i]
        turn = work[target, 1 + i]  # in the precision of the work
        turn += turn  # dq/dξ = 2 Aᵀ (A ξ − b)
        for k in range(h):
            work[target, 1 + n + k] *= turn * work[D1, k]


@_jit
def _output(y, line, latent, first, work, rows, modes) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Outputs (first = 1) or one derivative of them (first = 0) from one line."""
    if modes.shape[0] == 0:
        combine(work[line], rows, y)
        return
    combine(work[line], rows, work[latent, 1 : 1 + rows.shape[1]])
    work[latent, 0] = first
    combine(work[latent], modes, y)


@_jit
def _gradients(J, line, latent, work, rows, modes) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """All n derivatives J (n, m) from the lines after `line`."""
    n = J.shape[0]
    if modes.shape[0] == 0:
        combine_lines(work[line + 1 : line + 1 + n], rows, J)
        return
    for i in range(n):
        _output(J[i], line + 1 + i, latent + 1 + i, 0, work, rows, modes)


@_jit
def _places(work, layout, scales, units) -> tuple[int, int]:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Where in work the lines and the latent outputs begin."""
    line = HEAD + units.shape[0] - (layout.shape[0] - 1)
    return line, line + 1 + scales.shape[1]


@_jit
def value_into(x, y, work, steps, layout, scales, units, rows, modes, constants) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Evaluate one point x (n,) into y (m,); False, and nothing done, where x has another size than n."""
    if x.size != scales.shape[1]:
        return False
    line, latent = _places(work, layout, scales, units)
    _regress(x, line, work, steps, layout, scales, units, constants, 0)
    _output(y, line, latent, 1, work, rows, modes)
    return True


@_jit
def values_into(X, Y, work, steps, layout, scales, units, rows, modes, constants) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Evaluate N points X (N, n) into Y (N, m), each exactly as `value_into` does."""
    for i in range(X.shape[0]):
        if not value_into(X[i], Y[i], work, steps, layout, scales, units, rows, modes, constants):
            return False
    return True


@_jit
def jacobian_into(x, J, work, steps, layout, scales, units, rows, modes, constants) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """∂f/∂x at x (n,) into J (n, m): one row for each input."""
    if x.size != scales.shape[1]:
        return False
    line, latent = _places(work, layout, scales, units)
    _regress(x, line, work, steps, layout, scales, units, constants, 1)
    _slopes(line, work, layout, scales, units)
    _gradients(J, line, latent, work, rows, modes)
    return True


@_jit
def value_and_jacobian_into(x, y, J, work, steps, layout, scales, units, rows, modes, constants) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """f into y (m,) and ∂f/∂x into J (n, m) at x (n,); the same bits as from `value_into` and `jacobian_into`."""
    if x.size != scales.shape[1]:
        return False
    line, latent = _places(work, layout, scales, units)
    _regress(x, line, work, steps, layout, scales, units, constants, 1)
    _output(y, line, latent, 1, work, rows, modes)
    _slopes(line, work, layout, scales, units)
    _gradients(J, line, latent, work, rows, modes)
    return True


@_jit
def _curvature(k, slopes, H, work, layout, units) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Second derivatives of φ_k by ξ, times 1, added to H: 4 g'' (Aᵀv)(Aᵀv)ᵀ + 2 g' AᵀA with v = A ξ − b."""
    n, count = slopes.size, layout.shape[0] - 1
    slopes[:] = 0.0
    for e in range(count):
        slopes[layout[1 + e, 1]] += units[e, k] * work[HEAD + layout[1 + e, 0], k]
    for i in range(n):
        for j in range(n):
            H[i, j] += 4.0 * work[D2, k] * slopes[i] * slopes[j]
    for e in range(count):
        for f in range(count):
            if layout[1 + e, 0] == layout[1 + f, 0]:
                H[layout[1 + e, 1], layout[1 + f, 1]] += 2.0 * work[D1, k] * units[e, k] * units[f, k]


@_jit
def hessian_into(x, H, one, slopes, work, steps, layout, scales, units, rows, modes, constants) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """∂²f/∂x² of the only output into H (n, n); one (n, n) and slopes (n,) are scratch."""
    if x.size != scales.shape[1]:
        return False
    n = x.size
    line, _ = _places(work, layout, scales, units)
    _regress(x, line, work, steps, layout, scales, units, constants, 1)
    H[:] = 0.0
    for k in range(units.shape[1]):
        weight = rows[1 + n + k, 0]
        if modes.shape[0] > 0:
            weight *= modes[1, 0]
            for j in range(1, rows.shape[1]):
                weight += rows[1 + n + k, j] * modes[1 + j, 0]
        one[:] = 0.0
        _curvature(k, slopes, one, work, layout, units)
        for i in range(n):
            for j in range(n):
                H[i, j] += weight * one[i, j]
    for i in range(n):
        for j in range(n):
            H[i, j] /= scales[1, i] * scales[1, j]
    return True
