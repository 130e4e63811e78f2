"""Compiled evaluation of a radial-basis-function network: nothing is allocated per call.

    f(x) = modes · (T·[1, ξ] + Σ_k w_k g(‖A_k ξ − b_k‖²))

Every form of unit is one factor A_k (r, n) whose structural zeros are left out: only the e entries of the common
pattern are kept, each as one row over all units, so that loops run along the units and a diagonal or rank-1
factor costs n products, not n². Sums over units and entries are taken in order, one after the other, and never
fused: a unit of zero weight changes no bit, a batch gives what single points give, and since the exponential is
this project's own, a network answers with the same bits on every machine.

After their own arguments all kernels take the parts that `Network.compiled` returns:

    work     rows of scratch: those of `radial`, then [1, ξ, φ] and its n derivatives by x, then
             [1, latent outputs] and its n derivatives
    steps    the same memory as integers
    layout   (1 + e, 2): the radial function's place in `RADIAL_FUNCTIONS`; row and column of A's entries, row by row
    scales   (3, n): centre, half width and bend of each input, always in double precision
    units    (e + r, h): entries of the factors, then shifts
    rows     (1 + n + h, k): constant, slopes and weights of the k latent outputs
    modes    (1 + k, m): offset and output modes; (0, 0) where the latent outputs are the outputs
    constants  of `radial.constants`

`second_order_into` gives value, slope and curvature of the only output in one pass, where separate calls would find
every unit anew. The curvature of unit k, 4 g'' u uᵀ + 2 g' AᵀA with u = Aᵀ(A ξ − b), needs AᵀA, which never changes:
`gram` keeps it along the units.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from palpate.errors import UsageError
from palpate.kernels import kernel, part
from palpate.network.radial import D1, D2, HEAD, RADIAL_FUNCTIONS, P, Q, T, constants, radial_into

if TYPE_CHECKING:
    from palpate.network.network import Network

__all__ = [
    "PRECISIONS",
    "Precision",
    "combine",
    "combine_lines",
    "gram",
    "hessian_into",
    "jacobian_into",
    "packed",
    "pattern",
    "point_into",
    "regressor_rows_into",
    "regressors_into",
    "second_order_into",
    "value_and_jacobian_into",
    "value_into",
    "values_into",
    "workspace",
]

Precision = Literal["double", "single"]
PRECISIONS: tuple[Precision, ...] = get_args(Precision)
_TYPES: dict[str, tuple[type[np.floating], type[np.signedinteger]]] = {
    "double": (np.float64, np.int64),
    "single": (np.float32, np.int32),
}


def pattern(factors: np.ndarray) -> np.ndarray:
    """Row and column (e, 2) of every entry of the factors (h, r, n) that is not zero in all units, row by row."""
    return np.argwhere((factors != 0).any(axis=0))


def packed(network: Network, precision: Precision) -> tuple[np.ndarray, ...]:
    """Return a network's numbers as kernels read them: (layout, scales, units, rows, modes, constants).

    The inputs are scaled in double precision in either case: where a range is narrow beside its distance from zero,
    single precision could not tell its points apart.
    """
    if precision not in PRECISIONS:
        raise UsageError(
            f"There is no precision {precision!r}.", fix=f"Choose one of {', '.join(PRECISIONS)}."
        )
    s, entries = network.scaling, pattern(network.factors)
    layout = np.vstack([[[RADIAL_FUNCTIONS.index(network.radial), 0]], entries])
    units = np.vstack([network.factors[:, entries[:, 0], entries[:, 1]].T, network.shifts.T])
    rows, modes = np.vstack([network.tail.T, network.weights.T]), np.zeros((0, 0))
    if network.basis is None:
        rows = rows * s.output_scale
        rows[0] += s.output_centre
    else:
        modes = np.vstack([s.output_centre, network.basis.T * s.output_scale])
    kind = _TYPES[precision][0]
    return (
        np.ascontiguousarray(layout, dtype=np.int64),
        np.ascontiguousarray([s.input_centre, s.input_half, s.input_bend], dtype=np.float64),
        *(np.ascontiguousarray(a, dtype=kind) for a in (units, rows, modes)),
        constants(kind),
    )


def workspace(parts: tuple[np.ndarray, ...]) -> tuple[np.ndarray, np.ndarray]:
    """(work, steps) for what `packed` made: for one thread at a time."""
    layout, scales, units, rows = parts[:4]
    r, n = units.shape[0] - (layout.shape[0] - 1), scales.shape[1]
    width = max(rows.shape[0], 1 + rows.shape[1])
    work: np.ndarray[Any, Any] = np.zeros((HEAD + r + 2 * (1 + n), width), units.dtype)
    return work, work.view(_TYPES["double" if units.dtype == np.float64 else "single"][1])


_SMALL = 8  # number of outputs: fewer are summed in registers, more along the rows


@part
def combine(z, rows, y) -> None:
    """y (m,) = Σ_k z[k] rows[k], rows (K, m), with z at least K long: term after term for each output.

    The order of the sum never depends on the sizes, so a term of zero changes no bit of it wherever it stands.
    """
    if rows.shape[1] < _SMALL:
        _few(z, rows, y)
    else:
        _many(z, rows, y)


@part
def combine_lines(Z, rows, Y) -> None:
    """`combine` for each line of Z (n, ≥ K) into Y (n, m)."""
    for i in range(Z.shape[0]):
        combine(Z[i], rows, Y[i])


@part
def _few(z, rows, y) -> None:
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


@part
def _many(z, rows, y) -> None:
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


# fastmath stays off: the runtime must agree with Network.predict to the last bits on every machine


@part
def _denominator(far, i, scales) -> float:
    """h + b (x − c) of input i at the offset x − c, as `Scaling.scale_inputs` has it."""
    h, b = scales[1, i], scales[2, i]
    if b == 0.0:
        return float(h)
    return float(max(h + b * far, h / (2.0 * (1.0 + abs(b)))))


@part
def _scale_input(x, i, scales) -> float:
    """ξ of input i at x."""
    far = x - scales[0, i]
    return float(far / _denominator(far, i, scales))


@part
def _scaled_slope(x, i, scales) -> tuple[float, float]:
    """∂ξ/∂x and ∂²ξ/∂x² of input i at x."""
    h, b, far = scales[1, i], scales[2, i], x - scales[0, i]
    d = _denominator(far, i, scales)
    if b == 0.0 or d > h + b * far:  # affine, everywhere or far outside of the range
        return 1.0 / d, 0.0
    return h / (d * d), -2.0 * b * h / (d * d * d)


@part
def _regress(x, line, work, steps, layout, scales, units, constants, order) -> None:
    """Fill a line of work with [1, ξ, φ]; A ξ − b and the radial function's derivatives stay in work."""
    n, h, count = x.size, units.shape[1], layout.shape[0] - 1
    work[line, 0] = 1.0
    for i in range(n):
        work[line, 1 + i] = _scale_input(x[i], i, scales)
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


@part
def _slopes(x, line, work, layout, scales, units) -> None:
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
        work[target, 1 + i] = _scaled_slope(x[i], i, scales)[0]
        turn = work[target, 1 + i]  # in the precision of the work
        turn += turn  # dq/dξ = 2 Aᵀ (A ξ − b)
        for k in range(h):
            work[target, 1 + n + k] *= turn * work[D1, k]


@part
def _output(y, line, latent, first, work, rows, modes) -> None:
    """Outputs (first = 1) or one derivative of them (first = 0) from one line."""
    if modes.shape[0] == 0:
        combine(work[line], rows, y)
        return
    combine(work[line], rows, work[latent, 1 : 1 + rows.shape[1]])
    work[latent, 0] = first
    combine(work[latent], modes, y)


@part
def _gradients(J, line, latent, work, rows, modes) -> None:
    """All n derivatives J (n, m) from the lines after `line`."""
    n = J.shape[0]
    if modes.shape[0] == 0:
        combine_lines(work[line + 1 : line + 1 + n], rows, J)
        return
    for i in range(n):
        _output(J[i], line + 1 + i, latent + 1 + i, 0, work, rows, modes)


@part
def _places(work, layout, scales, units) -> tuple[int, int]:
    """Rows of work at which the lines and the latent outputs begin."""
    line = HEAD + units.shape[0] - (layout.shape[0] - 1)
    return line, line + 1 + scales.shape[1]


@part
def point_into(x, y, work, steps, layout, scales, units, rows, modes, constants) -> bool:
    """Do what `value_into` does, inside of another kernel."""
    if x.size != scales.shape[1]:
        return False
    line, latent = _places(work, layout, scales, units)
    _regress(x, line, work, steps, layout, scales, units, constants, 0)
    _output(y, line, latent, 1, work, rows, modes)
    return True


@kernel
def value_into(x, y, work, steps, layout, scales, units, rows, modes, constants) -> bool:
    """Evaluate one point x (n,) into y (m,); False, and nothing done, where x has another size than n."""
    return point_into(x, y, work, steps, layout, scales, units, rows, modes, constants)  # type: ignore[no-any-return]


@kernel
def values_into(X, Y, work, steps, layout, scales, units, rows, modes, constants) -> bool:
    """Evaluate N points X (N, n) into Y (N, m), each exactly as `value_into` does."""
    for i in range(X.shape[0]):
        if not point_into(X[i], Y[i], work, steps, layout, scales, units, rows, modes, constants):
            return False
    return True


@kernel
def jacobian_into(x, J, work, steps, layout, scales, units, rows, modes, constants) -> bool:
    """∂f/∂x at x (n,) into J (n, m): one row for each input."""
    if x.size != scales.shape[1]:
        return False
    line, latent = _places(work, layout, scales, units)
    _regress(x, line, work, steps, layout, scales, units, constants, 1)
    _slopes(x, line, work, layout, scales, units)
    _gradients(J, line, latent, work, rows, modes)
    return True


@kernel
def value_and_jacobian_into(x, y, J, work, steps, layout, scales, units, rows, modes, constants) -> bool:
    """f into y (m,) and ∂f/∂x into J (n, m) at x (n,); the same bits as from `value_into` and `jacobian_into`."""
    if x.size != scales.shape[1]:
        return False
    line, latent = _places(work, layout, scales, units)
    _regress(x, line, work, steps, layout, scales, units, constants, 1)
    _output(y, line, latent, 1, work, rows, modes)
    _slopes(x, line, work, layout, scales, units)
    _gradients(J, line, latent, work, rows, modes)
    return True


@part
def _curvature(k, slopes, H, work, layout, units) -> None:
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


@kernel
def hessian_into(x, H, one, slopes, work, steps, layout, scales, units, rows, modes, constants) -> bool:
    """∂²f/∂x² of the only output into H (n, n); one (n, n) and slopes (n,) are scratch."""
    if x.size != scales.shape[1]:
        return False
    n = x.size
    line, latent = _places(work, layout, scales, units)
    _regress(x, line, work, steps, layout, scales, units, constants, 1)
    _slopes(x, line, work, layout, scales, units)
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
        step, bent = _scaled_slope(x[i], i, scales)
        for j in range(n):
            H[i, j] *= step * _scaled_slope(x[j], j, scales)[0]
        if bent != 0.0:  # ∂f/∂ξ ∂²ξ/∂x², the slope being known by x
            _output(slopes[:1], line + 1 + i, latent + 1 + i, 0, work, rows, modes)
            H[i, i] += slopes[0] / step * bent
    return True


def gram(network: Network, q: int) -> np.ndarray:
    """Return the entries i ≤ j of A_kᵀA_k for the first q inputs, row by row, (q (q + 1)/2, h).

    Networks of several outputs, with a basis, or of fewer than q inputs are refused.
    """
    bent = network.scaling.is_bent
    if bent or len(network.outputs) != 1 or network.basis is not None or not 1 <= q <= len(network.inputs):
        raise UsageError(
            f"Curvature by {q} inputs is not to be had from {network}.",
            why="It is of one output, without modes or bent scales, and by inputs that exist.",
            fix="Pick one output: network.select([0]).",
        )
    A = network.factors[:, :, :q]
    i, j = np.triu_indices(q)
    return np.ascontiguousarray(np.einsum("kri,krj->kij", A, A)[:, i, j].T)


@part
def _pulled(line, q, work, layout, scales, units) -> None:
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


@part
def second_order_into(x, g, H, grams, work, steps, layout, scales, units, rows, modes, constants) -> float:
    """f at x (n,); ∂f/∂x into g (q,) and ∂²f/∂x² into H (q, q), by the first q inputs."""
    q, n, h = g.size, x.size, units.shape[1]
    line, _ = _places(work, layout, scales, units)
    _regress(x, line, work, steps, layout, scales, units, constants, 1)
    _few(work[line], rows, g[:1])  # as `combine` does for one output
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


@kernel
def regressor_rows_into(X, F, work, steps, layout, scales, units, constants) -> None:
    """[1, ξ, φ] at N points X (N, n) into F (N, 1 + n + h), each as `value_into` has them."""
    line, _ = _places(work, layout, scales, units)
    for i in range(X.shape[0]):
        _regress(X[i], line, work, steps, layout, scales, units, constants, 0)
        for k in range(F.shape[1]):
            F[i, k] = work[line, k]


@part
def regressors_into(x, work, steps, layout, scales, units, rows, modes, constants) -> int:
    """[1, ξ, φ] at x (n,) into one line of work, its n derivatives by x into the next; the line's number."""
    line, _ = _places(work, layout, scales, units)
    _regress(x, line, work, steps, layout, scales, units, constants, 1)
    _slopes(x, line, work, layout, scales, units)
    return int(line)
