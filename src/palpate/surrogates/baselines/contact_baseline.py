"""A rigid sphere that presses a surface: U₀ = U₀(s), s = R − d(c) the depth of the probe in the surface at rest.

c is the probe's centre, d the signed distance to the touched surface, U₀(s) a contact law (`contact_law`). With
∇s = −∇d,

    ∇U₀ = −U₀' ∇d        ∇²U₀ = U₀'' ∇d ∇dᵀ − U₀' ∇²d

Deeper than trained, ℓ is asked at the saturated depth above c, c̃ = c + (s − σ(s)) ∇d (see `continuation`). Where p is
the probe's radius, s grows with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from palpate.kernels import part
from palpate.surrogates.baselines.baseline import Baseline, register_baseline
from palpate.surrogates.baselines.graph_form import BaselineForm, Graph, Touch, Value, outer
from palpate.surrogates.contact_law import ContactLaw, law_at
from palpate.surrogates.continuation import saturated
from palpate.surrogates.energy_kernels import (
    BEND,
    GRADIENT,
    HESSIAN,
    LOG,
    MORE,
    OTHER,
    OUTWARD,
    ROOT,
    SURFACE,
    VECTORS,
    Compiled,
)
from palpate.surrogates.surface import TouchedSurface, distance_into
from palpate.units import Range

__all__ = ["ContactBaseline", "depth_series", "fill_law", "leave_contact", "leave_saturated"]


# step over the probe's radius, of the difference that finds the third derivative of the distance
STEP = 1e-3
_FINEST = 1.0 / 40.0  # shortest way over which touches change, over the probe's radius
_SAME_PLACE = 0.02  # distance over the probe's radius within which two contact points are one
_FACTORS = (1.0, 0.3, 3.0, 0.1, 10.0)  # candidates of the crossing length, over the guessed one
_TWICE, _FACTOR, _LENGTH, _RADIUS, _RADIUS_INPUT, _STEP_AT = range(6)  # places in the numbers of a contact


@register_baseline
@dataclass(frozen=True, eq=False)
class ContactBaseline(Baseline):
    """The contact law of a rigid sphere on a touched surface.

    Attributes
    ----------
    law : ContactLaw
        U₀ by the depth s.
    touched : TouchedSurface
        The surface at rest.
    probe_radius : float
        Radius R of the probe, m; not used where an input is it.
    radius_at : int, optional
        The input, 3 or later, that is the probe's radius.
    resolved : float, optional
        Depth (m) at which a contact is as wide as an element of the solves' mesh; an eighth of the radius by default,
        for elements of half the radius. Solves less deep count less: the mesh shows through them.
    """

    name: ClassVar[str] = "contact"

    law: ContactLaw
    touched: TouchedSurface
    probe_radius: float = math.nan
    radius_at: int | None = None
    resolved: float | None = None

    def __str__(self) -> str:
        probe = (
            f"of radius {1e3 * self.probe_radius:g} mm"
            if self.radius_at is None
            else "whose radius is an input"
        )
        return f"sphere {probe}; {self.law}"

    @property
    def surface(self) -> TouchedSurface:
        """The touched surface at rest."""
        return self.touched

    def with_surface(self, surface: TouchedSurface) -> ContactBaseline:
        """Return the same contact on another surface."""
        return replace(self, touched=surface)

    @property
    def radius(self) -> float:
        """Radius of the probe, m; not-a-number where an input is it."""
        return self.probe_radius if self.radius_at is None else math.nan

    @property
    def radius_input(self) -> int | None:
        """The input that is the probe's radius; None where none is."""
        return self.radius_at

    @property
    def inner(self) -> float:
        """Depth of the probe's centre inside the touched surface at which the body lets go, m."""
        return float(self.touched.inner)

    def fault(self, inputs: tuple[Range, ...]) -> str:
        """Return what does not fit the network's inputs; "" if all does."""
        n, own, reach = len(inputs), self.radius_at, self.touched.reach
        if n < 3:
            return f"a probe's centre has three coordinates, its network {n} inputs"
        if own is not None and not 3 <= own < n:
            return f"input {own} can't be the radius of {n} inputs, the first three being the position"
        low = self.probe_radius if own is None else inputs[own].low
        high = self.probe_radius if own is None else inputs[own].high
        if not (math.isfinite(low) and low > 0):
            return f"its probe has a radius of {low} m"
        if high > reach * (1.0 + 1e-9):
            return f"its probe of {high:g} m is in touch before its surface's distance begins, at {reach:g} m"
        return ""

    def _usual_radius(self, inputs: tuple[Range, ...]) -> float:
        own = self.radius_at
        return self.probe_radius if own is None else (inputs[own].low + inputs[own].high) / 2.0

    def compiled(self) -> Compiled:
        """Return the kernels and their arguments."""
        own = -1 if self.radius_at is None else self.radius_at - 3
        usual = self.probe_radius if math.isfinite(self.probe_radius) else self.touched.reach
        numbers = np.array([*self.law.numbers(), self.probe_radius, own, STEP * usual])
        return Compiled(None, (numbers, self.touched.compiled()), enter=_enter, leave=leave_contact)

    def graph_form(self, graph: Graph, place: Value, touch: Touch | None, xi: Value) -> BaselineForm:
        """Return the contact law at the depth s; see `palpate.surrogates.contact_law`."""
        assert touch is not None  # it has a surface
        return self._law_form(graph, graph.where(touch.contact, touch.depth, 1.0), touch.normal, touch.bend)

    def _law_form(self, graph: Graph, s: Value, normal: Value, bend: Value) -> BaselineForm:
        """Return the contact law at a depth s of slope −`normal` and Hessian −`bend`."""
        twice, factor, length = self.law.numbers()
        p = 0.5 * twice
        g: Any = factor
        g = graph.sqrt(s) * g if twice == 5.0 else s * g if twice == 6.0 else s * 0.0 + g
        ratio: Any = 0.0
        if math.isfinite(length):
            ratio = s / (length + s)
            g = g / graph.sqrt(1.0 + s / length)
        value, slope = g * s * s, g * s * (p - 0.5 * ratio)
        second = g * (p * (p - 1.0) - p * ratio + 0.75 * ratio * ratio)
        hessian = second.spread(2) * outer(normal, normal) - slope.spread(2) * bend
        gradient, root = -slope * normal, graph.sqrt(2.0 * value)
        return BaselineForm(value, gradient, hessian, root, gradient / root)

    def c_source(self) -> str:
        """Return the kernels in C99."""
        return Path(__file__).with_suffix(".c").read_text("utf-8")

    def coordinate(self, X: np.ndarray) -> np.ndarray:
        """Return the depth s (N,) of the rigid probe in the surface at rest, m."""
        return np.asarray(self._radii(X) - self.touched.at(np.ascontiguousarray(X[:, :3]))[0])

    def law_depth(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the depth (N,) in m that the law takes, and its gradient and Hessian with the other sign."""
        distance, normal, bend = self.touched.at(np.ascontiguousarray(X[:, :3]))
        return self._radii(X) - distance, normal, bend

    def raised(self, height: float, surface: TouchedSurface) -> ContactBaseline:
        """Return the same contact on a surface that is higher by `height` (m) along its normal."""
        del height
        return replace(self, touched=surface)

    def _radii(self, X: np.ndarray) -> np.ndarray:
        return np.full(len(X), self.probe_radius) if self.radius_at is None else X[:, self.radius_at]

    def logarithm(
        self, X: np.ndarray, inputs: tuple[Range, ...]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return ln U₀ (N,), its gradient (N, n) and its Hessian (N, n, n) by all inputs, at X (N, n) in contact."""
        n = len(inputs)
        depth, normal, bend = self.law_depth(X)
        value, first, second = self.law.log(depth)
        gradient, hessian = np.zeros((len(X), n)), np.full((len(X), n, n), np.nan)
        gradient[:, :3] = -first[:, None] * normal
        if self.radius_at is not None:  # the sphere grows into the body
            gradient[:, self.radius_at] = first
        hessian[:, :3, :3] = (
            second[:, None, None] * normal[:, :, None] * normal[:, None] - first[:, None, None] * bend
        )
        return value, gradient, hessian

    def row_weights(self, X: np.ndarray) -> np.ndarray:
        """Return how much each solve (N,) counts: less where the contact is smaller than an element."""
        resolved = self.probe_radius / 8.0 if self.resolved is None else self.resolved
        return np.asarray(1.0 / (1.0 + (resolved / self.coordinate(X)) ** 3))

    def groups(self, X: np.ndarray) -> np.ndarray:
        """Return the number (N,) of each solve's depth series: depths over one place, with the same further inputs."""
        return depth_series(X, self.touched, self.probe_radius)

    def finest(self, inputs: tuple[Range, ...]) -> np.ndarray:
        """Return the shortest ways (n,) over which touches change, in the inputs' units.

        The contact smooths over its own width √(2Rs), 2 mm of a probe of 10 mm at 0.2 mm; an eighth of that is allowed.
        """
        ways = np.zeros(len(inputs))
        ways[:3] = _FINEST * self._usual_radius(inputs)
        return ways

    def candidates(self) -> list[Baseline]:
        """Return the laws among which learning chooses: pad on body, crossing at several depths, and pure powers."""
        length = self.law.length if math.isfinite(self.law.length) else self.probe_radius / 10.0
        laws = [ContactLaw("series", f * length) for f in _FACTORS]
        laws += [ContactLaw("hertz"), ContactLaw("pad"), ContactLaw("square")]
        return [replace(self, law=law) for law in laws]


def depth_series(X: np.ndarray, surface: TouchedSurface, radius: float) -> np.ndarray:
    """Return the number (N,) of each solve's depth series: solves over one place, with the same further inputs.

    Parameters
    ----------
    X : (N, n)
        Centre of the probe (m), then further inputs.
    surface : TouchedSurface
        At rest.
    radius : float
        Of the probe, m.
    """
    C = np.ascontiguousarray(X[:, :3])
    distance, normal, _ = surface.at(C)
    places = np.round((C - distance[:, None] * normal) / (_SAME_PLACE * radius))
    return np.asarray(np.unique(np.hstack([places, X[:, 3:]]), axis=0, return_inverse=True)[1].ravel())


@part
def _enter(position, parameters, moved, base, small, numbers, args):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Fill the law's energy and derivatives; move the place at which ℓ is asked to the saturated depth."""
    own, surface = args
    which = int(own[_RADIUS_INPUT])
    radius = own[_RADIUS] if which < 0 else parameters[which]
    s = radius - distance_into(position, small[VECTORS, OUTWARD], small[SURFACE], *surface)
    return fill_law(s, moved, base, small, numbers, own)


@part
def fill_law(s, moved, base, small, numbers, own) -> bool:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Fill the law's energy and derivatives at a depth s, −∇s and −∇²s of which are in `small`; whether it touches.

    The place at which ℓ is asked moves to the saturated depth.
    """
    d, D, b, B = small[VECTORS, OUTWARD], small[SURFACE], small[VECTORS, GRADIENT], small[HESSIAN]
    base[1] = s
    if s <= 0.0:
        return False
    value, slope, curvature = law_at(s, own[_TWICE], own[_FACTOR], own[_LENGTH])
    base[0], base[2], base[3] = value, 0.0, math.sqrt(2.0 * value)
    for i in range(3):
        b[i] = -slope * d[i]
        small[ROOT, 0, i] = b[i] / base[3]
        for j in range(3):
            B[i, j] = curvature * d[i] * d[j] - slope * D[i, j]
    depth = saturated(s, numbers[1], numbers[2])[0]
    for i in range(3):
        moved[i] += (s - depth) * d[i]
    return True


@part
def _bend_into(x, g, small, step, surface) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Derivative of ∇²d along g into small[BEND], by differences of fourth order; symmetric as ∇²d is."""
    size = math.sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2])
    small[BEND, :, :] = 0.0
    if size == 0.0:
        return
    place, unused, other = small[MORE, 0], small[MORE, 1], small[OTHER]
    for many, weight in ((1.0, 8.0), (-1.0, -8.0), (2.0, -1.0), (-2.0, 1.0)):
        for i in range(3):
            place[i] = x[i] + many * step * g[i] / size
        distance_into(place, unused, other, *surface)
        for i in range(3):
            for j in range(3):
                small[BEND, i, j] += weight * size / (12.0 * step) * other[i, j]


@part
def leave_contact(position, base, small, numbers, args) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Take ∇ℓ and ∇²ℓ from the saturated depth to the place; see `leave_saturated`."""
    own, surface = args
    if base[1] > numbers[1]:
        _bend_into(position, small[VECTORS, 1], small, own[_STEP_AT], surface)
        leave_saturated(base, small, numbers)


@part
def leave_saturated(base, small, numbers) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    """Take ∇ℓ and ∇²ℓ by c̃ = c + m ∇d, m = s − σ(s), to those by c.

    J = I + m ∇²d − (1 − σ') ∇d ∇dᵀ takes g to J g and ∇²ℓ to J ∇²ℓ J, and with h = ∇²d g there remains
    −(1 − σ')(∇d hᵀ + h ∇dᵀ + (∇d·g) ∇²d) − σ'' (∇d·g) ∇d ∇dᵀ + m ∂∇²d/∂g, whose last part is in small[BEND].
    """
    s = base[1]
    depth, slope, curvature = saturated(s, numbers[1], numbers[2])
    excess = s - depth
    D, H, bend, J = small[SURFACE], small[LOG], small[BEND], small[OTHER]
    d, g, new, h = small[VECTORS, OUTWARD], small[VECTORS, 1], small[MORE, 0], small[MORE, 1]
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
