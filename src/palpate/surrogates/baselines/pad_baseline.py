"""A patch or node that a hand holds and displaces by d: U₀ = ½ ‖S(y) u‖², u = D d, and ℓ = P + the network.

S is a symmetric root of the stiffness at rest (`rest_stiffness`), y the place of the pad and any further inputs, D the
directions in which the hand can move it: three for a glued pad, one for a node that a single load bends. P is a
polynomial of all scaled inputs (`stiffening`). With v = S u,

    ∇U₀ = Dᵀ S v        ∇²U₀ = Dᵀ S² D        s₀ = v along one direction, ‖v‖ along several

so that nothing is divided: u = 0 gives no energy, no force, and the stiffness κ S².
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from palpate.checks import own_arrays
from palpate.kernels import part
from palpate.surrogates.baselines.baseline import Baseline, register_baseline
from palpate.surrogates.baselines.constant_baseline import require_axes
from palpate.surrogates.baselines.graph_form import BaselineForm, Graph, Touch, Value
from palpate.surrogates.baselines.rest_stiffness import RestStiffness, entries, monomials, root_at
from palpate.surrogates.baselines.stiffening import Stiffening, stiffening_into
from palpate.surrogates.energy_kernels import GRADIENT, HESSIAN, OTHER, ROOT, SURFACE, VECTORS, Compiled
from palpate.surrogates.memories import Amplitude
from palpate.units import Range, bounds

__all__ = ["PadBaseline"]

_EVEN = ("the same everywhere", "linear in place", "quadratic in place")


@register_baseline
@dataclass(frozen=True, eq=False)
class PadBaseline(Baseline):
    """The stiffness at rest of what a hand holds, and the polynomial by which it stiffens.

    Attributes
    ----------
    rest : RestStiffness
        S of the inputs after the felt ones, (k, k).
    stiffening : Stiffening
        P of all scaled inputs.
    axes : (k, 3)
        Unit directions D of the felt coordinates; x, y and z by default.
    """

    name: ClassVar[str] = "pad"
    holds: ClassVar[bool] = True
    share: ClassVar[float] = 0.1  # of a range: how far a polynomial may be followed beyond it
    further_share: ClassVar[float] = 0.1
    ridge: ClassVar[float] = 1e-4  # few solves do not decide on large weights in five dimensions

    rest: RestStiffness
    stiffening: Stiffening
    axes: np.ndarray = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        own_arrays(self, "axes")
        require_axes(self.axes)

    def __str__(self) -> str:
        return f"stiffness at rest {_EVEN[self.rest.degree]}, polynomial of degree {self.stiffening.degree}"

    @property
    def directions(self) -> np.ndarray:
        """Unit directions D (k, 3) of the felt coordinates."""
        return self.axes

    @property
    def amplitude(self) -> Amplitude:
        """Signed along one direction; of several, √(2 U)."""
        return "signed" if len(self.axes) == 1 else "positive"

    def fault(self, inputs: tuple[Range, ...]) -> str:
        """Return what does not fit the network's inputs; "" if all does."""
        n, k = len(inputs), len(self.axes)
        if n < k:
            return f"its network has {n} inputs, fewer than the {k} that are felt"
        if self.rest.size != k:
            return f"its stiffness at rest is of {self.rest.size} directions, {k} are felt"
        if self.rest.count != n - k:
            return f"its stiffness at rest depends on {self.rest.count} inputs, its network on {n - k}"
        if self.stiffening.exponents.shape[1] != n:
            return f"its polynomial has {self.stiffening.exponents.shape[1]} inputs, its network {n}"
        return ""

    def compiled(self) -> Compiled:
        """Return the kernels and their arguments, with scratch for one thread."""
        args = (self.axes, *self.rest.compiled(), *self.stiffening.compiled())
        return Compiled(None, args, enter=_enter, rest=_rest, log=_log)

    def graph_form(self, graph: Graph, place: Value, touch: Touch | None, xi: Value) -> BaselineForm:
        """Return ½ ‖S u‖² and its derivatives, with S at the scaled inputs after the felt ones."""
        D = self.axes
        k = len(D)
        coefficients, pairs = self.rest.compiled()
        terms = []
        one = xi.columns(0, 1) * 0.0 + 1.0
        for first, second in pairs.tolist():
            term = one
            for at in (first, second):
                if at >= 0:
                    term = term * xi.columns(k + at, k + at + 1)
            terms.append(term)
        upper = (terms[0] if len(terms) == 1 else graph.join(*terms)) @ coefficients
        i, j = np.triu_indices(k)
        spread = np.zeros((len(i), k * k))  # from the entries i ≤ j to the whole matrix
        spread[np.arange(len(i)), i * k + j] = 1.0
        spread[np.arange(len(i)), j * k + i] = 1.0
        S = (upper @ spread).rows_as(k, k)
        u = (place @ D.T).spread(2)
        v = S @ u
        gradient = (S @ v).rows_as(k) @ D
        hessian = graph.constant(D.T) @ (S @ S) @ D
        twice = (v * v).sum(1).rows_as(1)
        if k == 1:
            return BaselineForm(0.5 * twice, gradient, hessian, v.rows_as(1), S.rows_as(1) @ D)
        root = graph.sqrt(twice)
        by = graph.where(root > 0.0, gradient / graph.where(root > 0.0, root, 1.0), 0.0)
        return BaselineForm(0.5 * twice, gradient, hessian, root, by)

    def graph_exponent(self, graph: Graph, xi: Value, half: np.ndarray) -> tuple[Value, Value, Value] | None:
        """Return the polynomial P of all scaled inputs, which is part of ℓ, with its slopes by the felt ones."""
        coefficients, exponents = self.stiffening.coefficients, self.stiffening.exponents
        if not len(coefficients):
            return None
        n, highest, k = exponents.shape[1], int(exponents.max()), len(self.axes)
        columns = [xi.columns(i, i + 1) for i in range(n)]
        powers = [[columns[i] * 0.0 + 1.0] for i in range(n)]
        for i in range(n):
            for _ in range(highest):
                powers[i].append(powers[i][-1] * columns[i])

        def total(*by: int) -> Value:
            """Return the polynomial, differentiated by some of the scaled inputs."""
            value: Value = columns[0] * 0.0
            for c, row in zip(coefficients.tolist(), exponents.tolist(), strict=True):
                left, factor = list(row), float(c)
                for i in by:
                    factor *= left[i]
                    left[i] -= 1
                if factor == 0.0:
                    continue
                term: Any = factor
                for i, power in enumerate(left):
                    if power > 0:
                        term = powers[i][power] * term
                value = value + term
            return value

        gradient = graph.join(*[total(i) * (1.0 / half[i]) for i in range(k)])
        entries = [total(i, j) * (1.0 / (half[i] * half[j])) for i in range(k) for j in range(k)]
        hessian = graph.join(*entries).rows_as(k, k)
        return total(), gradient, hessian

    def c_source(self) -> str:
        """Return the kernels in C99."""
        return Path(__file__).with_suffix(".c").read_text("utf-8")

    def coordinate(self, X: np.ndarray) -> np.ndarray:
        """Return how far (N,) the pad is displaced, m."""
        return np.asarray(np.linalg.norm(X[:, : len(self.axes)], axis=1))

    def logarithm(
        self, X: np.ndarray, inputs: tuple[Range, ...]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return ln U₀ + P (N,), its gradient (N, n) and its Hessian (N, n, n) by all inputs, at X (N, n).

        A pad at rest, u = 0, has neither: −∞, and not-a-number.
        """
        low, high = bounds(inputs)
        half, Z = (high - low) / 2, (2.0 * X - low - high) / (high - low)
        value, first, second = self._scaled_logarithm(X, Z, half)
        P, slope, bend = self.stiffening.at(Z)
        first, second = first + slope, second + bend
        return value + P, first / half, second / (half[:, None] * half)

    def stiffness_at_rest(self, X: np.ndarray, inputs: tuple[Range, ...]) -> np.ndarray:
        """Return S² exp P (N, k, k) of pads at rest at X (N, n), N/m."""
        low, high = bounds(inputs)
        Z = (2.0 * X - low - high) / (high - low)
        S = self.rest.root(Z[:, len(self.axes) :])
        return np.asarray(S @ S * np.exp(self.stiffening.at(Z)[0])[:, None, None])

    def _scaled_logarithm(
        self, X: np.ndarray, Z: np.ndarray, half: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return ln U₀ (N,), and its gradient (N, n) and Hessian (N, n, n) by scaled inputs."""
        (N, n), k = X.shape, len(self.axes)
        u, where = X[:, :k], entries(k)
        value, slope, bend = monomials(Z[:, k:], self.rest.degree)
        C = self.rest.coefficients
        S = (value @ C)[:, where]
        by_place = np.einsum("nmk,me->nek", slope, C)[:, where]
        twice = np.einsum("nmkl,me->nekl", bend, C)[:, where]
        v = np.einsum("nij,nj->ni", S, u)
        J, B = np.zeros((N, k, n)), np.zeros((N, k, n, n))
        J[:, :, :k] = S * half[:k]
        J[:, :, k:] = np.einsum("nijk,nj->nik", by_place, u)
        B[:, :, :k, k:] = by_place * half[:k, None]
        B[:, :, k:, :k] = B[:, :, :k, k:].transpose(0, 1, 3, 2)
        B[:, :, k:, k:] = np.einsum("nijkl,nj->nikl", twice, u)
        U0 = (v**2).sum(axis=1) / 2
        with np.errstate(divide="ignore", invalid="ignore"):
            first = np.einsum("nai,na->ni", J, v) / U0[:, None]
            second = (np.einsum("nai,naj->nij", J, J) + np.einsum("na,naij->nij", v, B)) / U0[:, None, None]
            return np.log(U0), first, second - first[:, :, None] * first[:, None]


@part
def _enter(position, parameters, moved, base, small, numbers, args) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Measure the displacement; a hand that holds is always in contact."""
    base[1] = math.sqrt(position[0] ** 2 + position[1] ** 2 + position[2] ** 2)
    return True


@part
def _rest(position, xi, base, small, args) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001, PLR0912
    """Fill ½ ‖S u‖² and its derivatives, with S at the scaled inputs."""
    axes, coefficients, pairs = args[0], args[1], args[2]
    k = axes.shape[0]
    S, T, b, B, root = small[SURFACE], small[OTHER], small[VECTORS, GRADIENT], small[HESSIAN], small[ROOT]
    u, v, a = root[1], root[2], T[0]
    root_at(xi[k:], S, k, coefficients, pairs)
    for i in range(k):
        u[i] = axes[i, 0] * position[0] + axes[i, 1] * position[1] + axes[i, 2] * position[2]
    twice = 0.0
    for i in range(k):
        total = 0.0
        for j in range(k):
            total += S[i, j] * u[j]
        v[i] = total
        twice += total * total
    for i in range(k):
        total = 0.0
        for j in range(k):
            total += S[i, j] * v[j]
        a[i] = total
    base[0], base[2] = 0.5 * twice, 0.0
    base[3] = v[0] if k == 1 else math.sqrt(twice)
    for i in range(3):
        total = 0.0
        for c in range(k):
            total += axes[c, i] * a[c]
        b[i] = total
        for j in range(i, 3):
            total = 0.0
            for c in range(k):
                for d in range(k):
                    square = 0.0
                    for e in range(k):
                        square += S[c, e] * S[e, d]
                    total += axes[c, i] * square * axes[d, j]
            B[i, j] = total
            B[j, i] = total
    for i in range(3):
        if k == 1:
            root[0, i] = S[0, 0] * axes[0, i]
        else:
            root[0, i] = b[i] / base[3] if base[3] > 0.0 else 0.0


@part
def _log(xi, g, H, scales, args) -> float:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Add the polynomial P."""
    return stiffening_into(xi, g, H, scales, args[3], args[4], args[5])  # type: ignore[no-any-return]
