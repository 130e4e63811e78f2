"""A learnt body as an ONNX graph: energy, force, stiffness, trust, from the same formulas as the compiled kernels.

    U = U₀ κ − offset        F = −κ (∇U₀ + U₀ ∇ℓ)        ∂F/∂x = −κ [∇²U₀ + ∇U₀ ∇ℓᵀ + ∇ℓ ∇U₀ᵀ + U₀ (∇ℓ ∇ℓᵀ + ∇²ℓ)]

The derivatives are part of the graph, in closed form, for any number of rows at a time. Below, N is that number, a
scalar is (N, 1), a vector (N, 3), a matrix (N, 3, 3), and k the number of felt coordinates. For the same in compiled
form see `palpate.surrogates.energy_kernels`; beyond the trained ranges see `palpate.surrogates.continuation`.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.export.onnx_graph import Graph, Value
from palpate.export.onnx_network import Slopes, network_slopes, regressors
from palpate.export.onnx_surface import Distance, distance_to
from palpate.surrogates.baselines import (
    ConstantBaseline,
    ContactBaseline,
    OverlapBaseline,
    PadBaseline,
    require_ball,
)
from palpate.surrogates.baselines.overlap_baseline import LARGEST, SMALLEST
from palpate.surrogates.energy import LearntEnergy

__all__ = ["BODY_OUTPUTS", "BaselineForm", "Touch", "add_body", "onnx_form"]

SLACK = 1e-9  # share of a range: round-off at its edge is still inside, as in the compiled kernels
STEP = 1e-3  # step over the probe's radius, of the difference for the third derivative of the distance
BODY_OUTPUTS = ("energy", "force", "stiffness", "amplitude", "slope", "depth", "inside", "deviation")


@dataclass(frozen=True)
class BaselineForm:
    """A baseline at a place: its energy with derivatives, and the signed root."""

    energy: Value  # U₀ (N, 1)
    gradient: Value  # ∇U₀ (N, 3)
    hessian: Value  # ∇²U₀ (N, 3, 3)
    root: Value  # signed root of 2 U₀ (N, 1)
    by: Value  # its slope (N, 3)


@dataclass(frozen=True)
class Touch:
    """A probe at a surface: its depth, and how far that is beyond training."""

    distance: Distance  # to the surface, of any places
    depth: Value  # s (N, 1)
    contact: Value  # bool (N, 1)
    normal: Value  # ∇d (N, 3)
    bend: Value  # ∇²d (N, 3, 3)
    excess: Value  # s − σ(s)
    slope: Value  # σ'
    curvature: Value  # σ''


def add_body(graph: Graph, energy: LearntEnergy, *, apart: bool = False) -> None:
    """Add the input ``x`` (N, n), and the outputs `BODY_OUTPUTS` of an energy, to a graph.

    ``deviation`` is left out where the body has no posterior. Where one output is no number, all are not; kept `apart`,
    each speaks for itself, so that it can be computed without the others.
    """
    baseline, net = energy.baseline, energy.network
    require_ball(baseline, "be exported")
    n, D = len(energy.inputs), energy.baseline.directions
    k = len(D)
    given = graph.input("x", n)
    finite = _finite(graph, given)
    X = graph.where(finite, given, np.zeros((1, n)))
    place = X.columns(0, k) if k == 3 else X.columns(0, k) @ D

    graph.stage = "surface"
    touch = _touch(graph, energy, X, place) if baseline.surface is not None else None
    asked = place if touch is None else place + touch.excess * touch.normal
    graph.stage = "ranges"
    felt = asked if k == 3 else asked @ D.T
    line = felt if n == k else graph.join(felt, X.columns(k, n))
    saturated, slope, curvature = _box(graph, energy, line)
    centre, half = net.scaling.input_centre, net.scaling.input_half
    xi = (saturated - centre) / half

    graph.stage = "network"
    slopes = network_slopes(graph, net, xi, k)
    graph.stage = "baseline"
    known = onnx_form(baseline, graph, place, touch, xi)
    if isinstance(baseline, PadBaseline):
        slopes = _with_polynomial(graph, baseline, xi, half, slopes, k)
    graph.stage = "slopes"
    slopes = _through_box(slopes, slope.columns(0, k), curvature.columns(0, k), k)
    slopes = _to_space(slopes, D)
    if touch is not None and math.isfinite(energy.going.deepest):
        slopes = _leave(graph, baseline, touch, slopes, place)
    graph.stage = "answers"
    _answers(graph, energy, known, touch, slopes, (X, place), finite, apart)


def _finite(graph: Graph, X: Value) -> Value:
    """Return whether all inputs (N, n) of a row are finite, bool (N, 1)."""
    nothing = (X - X).sum(1)  # not-a-number where one of them is infinite or not-a-number
    return graph.op("Equal", nothing, 0.0)


def _saturated(graph: Graph, t: Value, edge: Any, width: Any) -> tuple[Value, Value, Value]:
    """Return σ, σ' and σ'' at t beyond an upper edge."""
    beyond = t > edge
    h = graph.tanh(graph.where(beyond, t - edge, 0.0) / width)
    slope = (1.0 - h) * (1.0 + h)
    value = graph.where(beyond, edge + width * h, t)
    return value, slope, -2.0 * h * slope / width


def _box(graph: Graph, energy: LearntEnergy, line: Value) -> tuple[Value, Value, Value]:
    """Return inputs (N, n) that saturate beyond their ranges, with first and second derivatives."""
    low, high = energy._constants[1][:2]
    width = energy.going.widths
    upper = _saturated(graph, line, high, width)
    lower = _saturated(graph, -line, -low, width)
    below = line < low
    value = graph.where(below, -lower[0], upper[0])
    return value, graph.where(below, lower[1], upper[1]), graph.where(below, -lower[2], upper[2])


def _touch(graph: Graph, energy: LearntEnergy, X: Value, place: Value) -> Touch:
    """Return how deep the probe is in the surface at rest, and the saturated depth at which ℓ is asked."""
    baseline, at = energy.baseline, energy.baseline.radius_input
    assert baseline.surface is not None
    radius: Any = baseline.radius if at is None else X.columns(at, at + 1)
    distance = distance_to(graph, baseline.surface)
    d, normal, bend = distance(place)
    s = radius - d
    contact = s > 0.0
    if not math.isfinite(energy.going.deepest):
        zero = s * 0.0
        return Touch(distance, s, contact, normal, bend, zero, zero + 1.0, zero)
    held, slope, curvature = _saturated(graph, s, energy.going.deepest, energy.going.depth_width)
    return Touch(distance, s, contact, normal, bend, s - held, slope, curvature)


@functools.singledispatch
def onnx_form(baseline: Any, graph: Graph, place: Value, touch: Touch | None, xi: Value) -> BaselineForm:
    """Return U₀ and its derivatives by the place (N, 3), which each kind registers: ``@onnx_form.register``.

    `touch` is the probe at the baseline's surface where there is one, `xi` are the scaled inputs (N, n).
    """
    raise UsageError(
        f"The baseline {type(baseline).name!r} has no ONNX form.",
        why="Its formula is Python code that is compiled for this machine.",
        fix="Export a body under a probe, a pad or beam loads.",
    )


@onnx_form.register
def _constant(baseline: ConstantBaseline, graph: Graph, place: Value, touch: Any, xi: Value) -> BaselineForm:
    zero = place * 0.0
    level = place.columns(0, 1) * 0.0 + baseline.level
    return BaselineForm(level, zero, _outer(zero, zero), level * 0.0, zero)


@onnx_form.register
def _contact(baseline: ContactBaseline, graph: Graph, place: Value, touch: Touch, xi: Value) -> BaselineForm:
    """Return the contact law at the depth s; see `palpate.surrogates.contact_law`."""
    return _law(baseline, graph, graph.where(touch.contact, touch.depth, 1.0), touch.normal, touch.bend)


@onnx_form.register
def _overlap(baseline: OverlapBaseline, graph: Graph, place: Value, touch: Touch, xi: Value) -> BaselineForm:
    """Return the contact law at the equivalent depth of the overlap."""
    e, slope, bend = distance_to(graph, baseline.pressed)(place)
    measured = baseline.radius - e
    depth = measured
    ends = (SMALLEST, measured < touch.depth * SMALLEST), (LARGEST, measured > touch.depth * LARGEST)
    for factor, off in ends:
        depth, slope = (
            graph.where(off, touch.depth * factor, depth),
            graph.where(off, touch.normal * factor, slope),
        )
        bend = graph.where(off.spread(2), touch.bend * factor, bend)
    return _law(baseline, graph, graph.where(touch.contact, depth, 1.0), slope, bend)


def _law(baseline: ContactBaseline, graph: Graph, s: Value, normal: Value, bend: Value) -> BaselineForm:
    """Return the contact law at a depth s of slope −`normal` and Hessian −`bend`."""
    twice, factor, length = baseline.law.numbers()
    p = 0.5 * twice
    g: Any = factor
    g = graph.sqrt(s) * g if twice == 5.0 else s * g if twice == 6.0 else s * 0.0 + g
    ratio: Any = 0.0
    if math.isfinite(length):
        ratio = s / (length + s)
        g = g / graph.sqrt(1.0 + s / length)
    value, slope = g * s * s, g * s * (p - 0.5 * ratio)
    second = g * (p * (p - 1.0) - p * ratio + 0.75 * ratio * ratio)
    hessian = second.spread(2) * _outer(normal, normal) - slope.spread(2) * bend
    gradient, root = -slope * normal, graph.sqrt(2.0 * value)
    return BaselineForm(value, gradient, hessian, root, gradient / root)


@onnx_form.register
def _pad(baseline: PadBaseline, graph: Graph, place: Value, touch: Any, xi: Value) -> BaselineForm:
    """Return ½ ‖S u‖² and its derivatives, with S at the scaled inputs after the felt ones."""
    D = baseline.axes
    k = len(D)
    coefficients, pairs = baseline.rest.compiled()
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


def _with_polynomial(
    graph: Graph, baseline: PadBaseline, xi: Value, half: np.ndarray, slopes: Slopes, k: int
) -> Slopes:
    """Return ℓ with the polynomial P of all scaled inputs added to it."""
    coefficients, exponents = baseline.stiffening.coefficients, baseline.stiffening.exponents
    if not len(coefficients):
        return slopes
    n, highest = exponents.shape[1], int(exponents.max())
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
    return Slopes(slopes.value + total(), slopes.gradient + gradient, slopes.hessian + hessian)


def _outer(a: Value, b: Value) -> Value:
    """Return a bᵀ (N, m, m) of vectors (N, m)."""
    return a.spread(2) * b.spread(1)


def _through_box(slopes: Slopes, slope: Value, curvature: Value, felt: int) -> Slopes:
    """Take derivatives by saturated inputs to those by what came before the saturation."""
    bent = (curvature * slopes.gradient).spread(2) * np.eye(felt)
    return Slopes(slopes.value, slopes.gradient * slope, slopes.hessian * _outer(slope, slope) + bent)


def _to_space(slopes: Slopes, D: np.ndarray) -> Slopes:
    """Take derivatives by felt coordinates u = D x to those by the place x."""
    if len(D) == 3:
        return slopes
    graph = slopes.value.graph
    return Slopes(slopes.value, slopes.gradient @ D, graph.constant(D.T) @ slopes.hessian @ D)


def _leave(graph: Graph, baseline: Any, touch: Touch, slopes: Slopes, place: Value) -> Slopes:
    """Take derivatives by the place c̃ at the saturated depth to those by c; see `contact_baseline`."""
    d, g, H = touch.normal, slopes.gradient, slopes.hessian
    m, rest, curvature = touch.excess, 1.0 - touch.slope, touch.curvature
    usual = baseline.radius if math.isfinite(baseline.radius) else baseline.surface.reach
    bend = _bend(graph, touch.distance, place, g, STEP * usual)
    matrix = [value.spread(2) for value in (m, rest, curvature)]
    outer = _outer(d, d)
    J = matrix[0] * touch.bend - matrix[1] * outer + np.eye(3)
    h = (touch.bend @ g.spread(2)).rows_as(3)
    along = (d * g).sum(1).spread(2)
    new = (J @ g.spread(2)).rows_as(3)
    hessian = (
        J @ H @ J.swap()
        + matrix[0] * bend
        - (matrix[1] * touch.bend + matrix[2] * outer) * along
        - matrix[1] * (_outer(d, h) + _outer(h, d))
    )
    return Slopes(slopes.value, new, hessian)


def _bend(graph: Graph, distance: Distance, place: Value, g: Value, step: float) -> Value:
    """Return the derivative of ∇²d along g, by differences of fourth order."""
    size = graph.sqrt((g * g).sum(1))
    way = g / graph.where(size > 0.0, size, 1.0)
    parts = []
    for many, weight in ((1.0, 8.0), (-1.0, -8.0), (2.0, -1.0), (-2.0, 1.0)):
        bend = distance(place + (many * step) * way)[2]
        parts.append((size * (weight / (12.0 * step))).spread(2) * bend)
    first, second, third, last = parts
    return first + second + third + last


def _answers(
    graph: Graph,
    energy: LearntEnergy,
    known: BaselineForm,
    touch: Touch | None,
    slopes: Slopes,
    inputs: tuple[Value, Value],
    finite: Value,
    apart: bool,
) -> None:
    """Put energy, force, stiffness, depth, trust out; zero without contact.

    Where an input is not finite, or so large that an answer is not, nothing pushes, and the rest is not-a-number.
    """
    X, place = inputs
    kappa = graph.exp(slopes.value)
    value = kappa * known.energy
    b, g = known.gradient, slopes.gradient
    force = -(kappa * b + value * g)
    stiffness = -kappa.spread(2) * (known.hessian + _outer(b, g) + _outer(g, b))
    stiffness = stiffness - value.spread(2) * (_outer(g, g) + slopes.hessian)
    depth = graph.sqrt((place * place).sum(1)) if touch is None else touch.depth
    inside = _inside(graph, energy, X, depth)
    root = graph.sqrt(kappa)
    outputs = {
        "energy": value - energy.baseline.offset,
        "force": force,
        "stiffness": stiffness,
        "amplitude": known.root * root,
        "slope": root * (known.by + 0.5 * known.root * g),
    }
    if energy.root is not None:
        graph.stage = "deviation"
        outputs["deviation"] = _deviation(graph, energy, X, value, force)
        graph.stage = "answers"
    if touch is not None:
        flat, deep = touch.contact, touch.contact.spread(2)
        for name, out in outputs.items():
            outputs[name] = graph.where(deep if name == "stiffness" else flat, out, 0.0)
        inside = inside | ~touch.contact
    outputs["depth"] = depth
    if not apart:
        whole = outputs["energy"] + outputs["force"].sum(1) + outputs["stiffness"].sum(1, 2).rows_as(1)
        finite = finite & _finite(graph, whole + depth)  # no number may be larger than any
    shapes = {"stiffness": (3, 3), "force": (3,), "slope": (3,)}
    for name, out in outputs.items():
        total = out.sum(1, 2).rows_as(1) if name == "stiffness" else out
        number = finite & _finite(graph, total) if apart else finite
        # what is not a number must not push anybody
        otherwise = 0.0 if name in {"force", "stiffness"} else math.nan
        number = number.spread(2) if name == "stiffness" else number
        graph.output(name, graph.where(number, out, otherwise), shapes.get(name, (1,)))
    graph.output("inside", inside & finite, (1,), np.bool_)


def _inside(graph: Graph, energy: LearntEnergy, X: Value, depth: Value) -> Value:
    """Return whether inputs are in their ranges, as deep as trained, and near a training input, bool (N, 1)."""
    low, high = energy._constants[1][:2]
    slack = SLACK * (high - low)
    outside: Value = graph.real((high + slack < X) | (low - slack > X)).sum(1)
    inside: Value = outside < 0.5
    if math.isfinite(energy.going.deepest) and energy.baseline.surface is not None:
        inside = inside & (depth <= energy.going.deepest * (1.0 + SLACK))
    if energy.region is not None:
        scaling = energy.network.scaling
        xi = (X - scaling.input_centre) / scaling.input_half
        gap = xi.spread(1) - energy.region.points[None]
        nearest = (gap * gap).sum(2).least(1).rows_as(1)
        inside = inside & (nearest <= energy.region.radius**2 * (1.0 + SLACK))
    return inside


def _deviation(graph: Graph, energy: LearntEnergy, X: Value, value: Value, force: Value) -> Value:
    """Return the standard deviation of the force relative to its size, zero without a force."""
    root, network = energy.posterior
    D = energy.baseline.directions
    k = len(D)
    scaling = energy.network.scaling
    row, lines = regressors(graph, network, (X - scaling.input_centre) / scaling.input_half, k)
    moved = row @ root  # (N, z)
    by = lines @ root  # (N, k, z)
    if k < 3:
        by = graph.constant(D.T) @ by
    spread = _outer(force, moved) - value.spread(2) * by
    total = graph.sqrt((spread * spread).sum(1, 2).rows_as(1))
    size = graph.sqrt((force * force).sum(1))
    return graph.where(size > 0.0, total / graph.where(size > 0.0, size, 1.0), 0.0)
