"""Energy, force and stiffness of a learnt body in one pass, compiled; nothing is allocated.

    U(x) = U₀(x) κ − offset,   κ = exp ℓ(x̃),   F = −∂U/∂x = −κ (∇U₀ + U₀ ∇ℓ)
    ∂F/∂x = −κ [∇²U₀ + ∇U₀ ∇ℓᵀ + ∇ℓ ∇U₀ᵀ + U₀ (∇ℓ ∇ℓᵀ + ∇²ℓ)]

x is the place (3,) that a hand moves, U₀ the baseline, ℓ the network. The network's first k inputs are the felt
coordinates u = D x, D the baseline's directions (k, 3); its further inputs are parameters. Outside the trained ranges
ℓ is taken at the saturated x̃ (see `continuation`).

A baseline comes in as kernels of its own (see `palpate.surrogates.baselines`). `entry_of` puts them into the two
functions below, compiled once for each kind of baseline and kept in Numba's cache between processes.

What the kernels take:

    answer    (19,): U, s, F, ∂F/∂x row by row, U₀ κ, q, ∇q; s the baseline's own coordinate, q the signed amplitude
    lines     (5, n) scratch: x, x̃ and its slopes and curvatures by x, each input by its own range; x̃ scaled
    small     (SMALL, 3, 3) scratch: matrices, then vectors row by row, see the places below
    felt      (4, k) scratch: ∇ℓ by u, then rows of ∇²ℓ
    base      (4,): U₀, s, offset, s₀ the signed root of 2 U₀
    numbers   radius of the trained region, s* of the deepest training, w of its saturation
    limits    (3, n): low and high ends and w of every input
    points    (S, n) of the trained region, scaled; (0, n) without one
    axes      D (k, 3)
    grams     of `palpate.network.network_kernels`
    net       the network's arrays
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from pathlib import Path
from types import FunctionType
from typing import Any, NamedTuple

from palpate.kernels import kernel, part
from palpate.network.network_kernels import combine_lines, regressors_into, second_order_into
from palpate.surrogates.continuation import saturated

__all__ = [
    "AMPLITUDE",
    "ANSWER",
    "BEND",
    "FORCE",
    "GRADIENT",
    "HESSIAN",
    "LOG",
    "MORE",
    "OTHER",
    "OUTWARD",
    "PLAIN",
    "ROOT",
    "SLOPE",
    "SMALL",
    "STIFFNESS",
    "SURFACE",
    "VECTORS",
    "Compiled",
    "Entry",
    "covariances_into",
    "entry_of",
    "trust_at",
    "trusts_into",
]


ANSWER, FORCE, STIFFNESS = 19, slice(2, 5), slice(5, 14)  # numbers of an answer, and places in it
PLAIN, AMPLITUDE, SLOPE = 14, 15, slice(16, 19)
_REGION, _DEEPEST, _DEPTH_WIDTH = range(3)  # places in `numbers`
_SLACK = 1e-9  # share of a range: a place that round-off puts so far beyond its edge is still inside
# places in `small`: ∇²U₀, ∇²ℓ, and two matrices and ∇²d for a baseline; then vectors as rows
HESSIAN, LOG, BEND, OTHER, SURFACE, VECTORS, MORE, ROOT = range(8)
SMALL = 8  # matrices in `small`
# rows of small[VECTORS]: ∇U₀, ∇ℓ, and the outer normal of a touched surface
GRADIENT, _SLOPE, OUTWARD = range(3)
_LAST = 2  # row of small[MORE]: the trained point last near; the others are a baseline's scratch
# first row of small[ROOT]: ∇s₀, s₀ the signed root of 2 U₀


class Compiled(NamedTuple):
    """The kernels of a baseline, and what they take.

    Attributes
    ----------
    kernel : compiled function
        ``kernel(position, parameters, gradient, hessian, args) -> (U0, s)``: fill ∇U₀ (3,) and ∇²U₀ (3, 3), symmetric,
        by the place (3,) in m, and return U₀ in J and the baseline's own coordinate in m. There is no contact where
        s ≤ 0. A baseline that needs more than that gives `enter` instead.
    args : tuple
        Arrays, numbers and tuples of them, passed to every kernel as they are.
    enter : compiled function, optional
        ``enter(position, parameters, moved, base, small, numbers, args) -> bool``: whether there is contact; may move
        the place ``moved`` (3,) at which ℓ is asked.
    rest : compiled function, optional
        ``rest(position, xi, base, small, args)``: the baseline where it depends on scaled, saturated inputs ξ.
    log : compiled function, optional
        ``log(xi, g, H, scales, args) -> float``: a further part of ℓ in closed form; its slopes and curvatures by the
        unscaled felt inputs are added to g (k,) and H (k, k).
    leave : compiled function, optional
        ``leave(position, base, small, numbers, args)``: take ∇ℓ and ∇²ℓ through the move that `enter` made.
    """

    kernel: Callable[..., Any] | None
    args: tuple[Any, ...]
    enter: Callable[..., Any] | None = None
    rest: Callable[..., Any] | None = None
    log: Callable[..., Any] | None = None
    leave: Callable[..., Any] | None = None


class Entry(NamedTuple):
    """The compiled functions of one kind of baseline: for one place, and for rows of places."""

    one: Callable[..., bool]
    rows: Callable[..., None]


@part
def _box(lines, limits) -> None:
    """Saturate every input of line 1 beyond its range; slopes and curvatures into lines 2 and 3."""
    for i in range(lines.shape[1]):
        t, low, high, width = lines[1, i], limits[0, i], limits[1, i], limits[2, i]
        if t < low:
            value, slope, curvature = saturated(-t, -low, width)
            lines[1, i], lines[2, i], lines[3, i] = -value, slope, -curvature
        else:
            lines[1, i], lines[2, i], lines[3, i] = saturated(t, high, width)


@part
def _through_box(felt, lines) -> None:
    """Take ∇ℓ and ∇²ℓ by x̃ to those by what came before the saturation of the ranges."""
    k = felt.shape[1]
    for i in range(k):
        for j in range(k):
            felt[1 + i, j] *= lines[2, i] * lines[2, j]
        felt[1 + i, i] += lines[3, i] * felt[0, i]
    for i in range(k):
        felt[0, i] *= lines[2, i]


@part
def _to_space(felt, axes, small) -> None:
    """Take ∇ℓ and ∇²ℓ by felt coordinates u = D x to those by the place x."""
    k = axes.shape[0]
    g, H = small[VECTORS, _SLOPE], small[LOG]
    if k == 3:  # felt along x, y and z
        for i in range(3):
            g[i] = felt[0, i]
            for j in range(3):
                H[i, j] = felt[1 + i, j]
        return
    for i in range(3):
        total = 0.0
        for a in range(k):
            total += axes[a, i] * felt[0, a]
        g[i] = total
        for j in range(3):
            total = 0.0
            for a in range(k):
                for b in range(k):
                    total += axes[a, i] * felt[1 + a, b] * axes[b, j]
            H[i, j] = total


@part
def _assemble(answer, kappa, base, small) -> None:
    """Fill U, F, ∂F/∂x and q from the baseline's and the factor's derivatives; symmetric to the last bit."""
    B, H, b, g = small[HESSIAN], small[LOG], small[VECTORS, GRADIENT], small[VECTORS, _SLOPE]
    value = kappa * base[0]
    answer[0], answer[1], answer[PLAIN] = value - base[2], base[1], value
    root = math.sqrt(kappa)
    answer[AMPLITUDE] = base[3] * root
    for i in range(3):
        answer[2 + i] = 0.0 - (kappa * b[i] + value * g[i])
        for j in range(i, 3):
            k = -kappa * (B[i, j] + (b[i] * g[j] + g[i] * b[j])) - value * (g[i] * g[j] + H[i, j])
            answer[5 + 3 * i + j] = k
            answer[5 + 3 * j + i] = k
        answer[AMPLITUDE + 1 + i] = root * (small[ROOT, 0, i] + 0.5 * base[3] * g[i])


@part
def _near(x, points, radius, last) -> bool:
    """Return True where a trained point is within the radius; the search begins where it last ended."""
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


@part
def _inside(lines, limits, s, numbers, points, scales, small) -> bool:
    """Return True where x (line 0) is in its ranges, as deep as trained, and near a training input; line 1 is lost."""
    if s > numbers[_DEEPEST] * (1.0 + _SLACK):
        return False
    for i in range(lines.shape[1]):
        slack = _SLACK * (limits[1, i] - limits[0, i])
        if lines[0, i] < limits[0, i] - slack or lines[0, i] > limits[1, i] + slack:
            return False
        lines[1, i] = (lines[0, i] - scales[0, i]) / scales[1, i]
    return bool(_near(lines[1], points, numbers[_REGION], small[MORE, _LAST]))


@part
def _gather(position, parameters, axes, lines) -> bool:
    """Put the network's inputs into line 0; whether all that came is finite."""
    k = axes.shape[0]
    finite = math.isfinite(position[0]) and math.isfinite(position[1]) and math.isfinite(position[2])
    _feel(position, axes, lines[0])
    for i in range(parameters.size):
        lines[0, k + i] = parameters[i]
        finite = finite and math.isfinite(parameters[i])
    return finite


@part
def _feel(position, axes, line) -> None:
    """Put the felt coordinates u = D x at the beginning of a line."""
    if axes.shape[0] == 3:
        for i in range(3):
            line[i] = position[i]
        return
    for a in range(axes.shape[0]):
        line[a] = axes[a, 0] * position[0] + axes[a, 1] * position[1] + axes[a, 2] * position[2]


@part
def _no_rest(position, xi, base, small, args) -> None:
    pass


@part
def _no_log(xi, g, H, scales, args) -> float:
    return 0.0


@part
def _no_leave(position, base, small, numbers, args) -> None:
    pass


def _plain_enter(position, parameters, moved, base, small, numbers, args):
    """Ask a baseline that is one kernel."""
    value, s = baseline_kernel(position, parameters, small[VECTORS, GRADIENT], small[HESSIAN], args)
    base[0], base[1], base[2], base[3] = value, s, 0.0, math.sqrt(2.0 * max(value, 0.0))
    for i in range(3):
        small[ROOT, 0, i] = small[VECTORS, GRADIENT, i] / base[3] if base[3] > 0.0 else 0.0
    return s > 0.0


def _one(
    position,
    parameters,
    answer,
    lines,
    small,
    felt,
    base,
    moved,
    numbers,
    limits,
    points,
    axes,
    grams,
    args,
    net,
):
    """Fill `answer` at a place (3,) and parameters (p,); whether that is inside the trained region.

    Without contact the answer is exact wherever it is, and counts as inside. Where an input is not finite, or so large
    that numbers overflow, the whole answer is not-a-number.
    """
    answer[:] = 0.0
    if not _gather(position, parameters, axes, lines):
        answer[:] = math.nan
        return False
    for i in range(3):
        moved[i] = position[i]
    if not baseline_enter(position, parameters, moved, base, small, numbers, args):
        answer[1] = base[1]
        return True
    for i in range(lines.shape[1]):
        lines[1, i] = lines[0, i]
    _feel(moved, axes, lines[1])
    _box(lines, limits)
    xi, scales = lines[4], net[3]
    for i in range(lines.shape[1]):
        xi[i] = (lines[1, i] - scales[0, i]) / scales[1, i]
    baseline_rest(position, xi, base, small, args)
    g, H = felt[0], felt[1:]
    log_kappa = second_order_into(lines[1], g, H, grams, *net)
    log_kappa += baseline_log(xi, g, H, scales, args)
    _through_box(felt, lines)
    _to_space(felt, axes, small)
    baseline_leave(position, base, small, numbers, args)
    _assemble(answer, math.exp(log_kappa), base, small)
    for i in range(answer.size):
        if not math.isfinite(answer[i]):
            answer[:] = math.nan
            return False
    return _inside(lines, limits, base[1], numbers, points, scales, small)


def _rows(
    X, answers, inside, lines, small, felt, base, moved, numbers, limits, points, axes, grams, args, net
):
    """Fill answers (N, 19) and inside (N,) for each row of X (N, 3 + p): a place, then parameters."""
    for i in range(X.shape[0]):
        x, p = X[i, :3], X[i, 3:]
        inside[i] = answer_one(
            x, p, answers[i], lines, small, felt, base, moved, numbers, limits, points, axes, grams, args, net
        )


_entries: dict[tuple[Any, ...], Entry] = {}


def entry_of(compiled: Compiled) -> Entry:
    """Return the compiled functions for the kernels of a baseline, made on first use.

    Numba finds them in its cache by their names, which tell the baseline's kernels; these stand in their globals. So
    the names hold a checksum of the kernels' sources: a changed kernel must not answer as it did before.
    """
    hooks = (compiled.kernel, *compiled[2:])
    if hooks not in _entries:
        first = compiled.enter or compiled.kernel
        assert first is not None
        name = f"{first.__module__}.{first.__name__}_{_checksum(hooks)}".replace(".", "_")
        enter = compiled.enter or part(_bound(_plain_enter, name, {"baseline_kernel": compiled.kernel}))
        kernels = {
            "baseline_enter": enter,
            "baseline_rest": compiled.rest or _no_rest,
            "baseline_log": compiled.log or _no_log,
            "baseline_leave": compiled.leave or _no_leave,
        }
        one = kernel(_bound(_one, name, kernels))
        _entries[hooks] = Entry(one, kernel(_bound(_rows, name, {"answer_one": one})))
    return _entries[hooks]


def _checksum(hooks: tuple[Any, ...]) -> str:
    """Return a checksum of the files that hold kernels, or of their code where it stands in no file."""
    total = 0
    for code in (getattr(hook, "py_func", hook).__code__ for hook in hooks if hook is not None):
        path = Path(code.co_filename)
        total = zlib.crc32(path.read_bytes() if path.is_file() else code.co_code, total)
    return f"{total:08x}"


def _bound(template: Callable[..., Any], name: str, hooks: dict[str, Any]) -> Callable[..., Any]:
    """Return a template with its hooks as globals, under a name of its own."""
    own = f"{template.__name__}_{name}"
    function = FunctionType(template.__code__, template.__globals__ | hooks, own)
    function.__qualname__, function.__module__ = own, template.__module__
    return function


@part
def _move(answer, x, root, columns, axes, net) -> None:
    """Put F a − U b of each of the root's columns into columns[1:4] (3, z).

    The posterior of the linear weights w of ℓ = offset + scale · r·w, r = [1, ξ, φ], is kept as a root of their
    covariance, C = root rootᵀ. A column of it moves ℓ by a and its gradient by b, and with them the force by F a − U b.
    """
    k = axes.shape[0]
    line = regressors_into(x, *net)
    combine_lines(net[0][line : line + 1 + k], root, columns[: 1 + k])
    value = answer[PLAIN]
    if k == 3:
        for i in range(3):
            for z in range(root.shape[1]):
                columns[1 + i, z] = answer[2 + i] * columns[0, z] - value * columns[1 + i, z]
        return
    for z in range(root.shape[1]):
        u0, u1 = columns[1, z], columns[2, z] if k > 1 else 0.0
        for i in range(3):
            along = axes[0, i] * u0 + (axes[1, i] * u1 if k > 1 else 0.0)
            columns[1 + i, z] = answer[2 + i] * columns[0, z] - value * along


@kernel
def trust_at(answer, x, root, columns, axes, net) -> float:
    """Relative deviation of the force in `answer` at inputs x (n,): √(Σ ‖F a − U b‖²)/‖F‖, zero without a force.

    First order in the weights. The regressors are taken at the input itself and not where a continuation holds it:
    outside the trained region the tail, and with it the figure, goes on growing. columns (4, z) is scratch.
    """
    size = math.sqrt(answer[2] * answer[2] + answer[3] * answer[3] + answer[4] * answer[4])
    if size == 0.0:
        return 0.0
    if root.shape[0] == 0:
        return math.nan
    _move(answer, x, root, columns, axes, net)
    total = 0.0
    for i in range(1, 4):
        for k in range(root.shape[1]):
            total += columns[i, k] * columns[i, k]
    return math.sqrt(total) / size


@kernel
def trusts_into(X, answers, out, root, columns, axes, net) -> None:
    """`trust_at` for each row of inputs X (N, n) into out (N,)."""
    for i in range(X.shape[0]):
        out[i] = trust_at(answers[i], X[i], root, columns, axes, net)


@kernel
def covariances_into(X, answers, out, root, columns, axes, net) -> None:
    """Covariance Σ (F a − U b)(F a − U b)ᵀ of the force for each row of inputs X (N, n) into out (N, 3, 3), N²."""
    for row in range(X.shape[0]):
        _move(answers[row], X[row], root, columns, axes, net)
        for i in range(3):
            for j in range(i, 3):
                total = 0.0
                for k in range(root.shape[1]):
                    total += columns[1 + i, k] * columns[1 + j, k]
                out[row, i, j] = total
                out[row, j, i] = total
