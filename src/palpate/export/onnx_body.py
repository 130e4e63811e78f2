"""A learnt body as an ONNX graph: energy, force, stiffness, trust, from the same formulas as the compiled kernels.

    U = U₀ κ − offset        F = −κ (∇U₀ + U₀ ∇ℓ)        ∂F/∂x = −κ [∇²U₀ + ∇U₀ ∇ℓᵀ + ∇ℓ ∇U₀ᵀ + U₀ (∇ℓ ∇ℓᵀ + ∇²ℓ)]

The derivatives are part of the graph, in closed form, for any number of rows at a time. Below, N is that number, a
scalar is (N, 1), a vector (N, 3), a matrix (N, 3, 3), and k the number of felt coordinates. For the same in compiled
form see `palpate.surrogates.energy_kernels`; beyond the trained ranges see `palpate.surrogates.continuation`.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.export.onnx_graph import Graph, Value
from palpate.export.onnx_network import Slopes, network_slopes, network_values, regressors
from palpate.export.onnx_surface import distance_to
from palpate.surrogates import Surrogate
from palpate.surrogates.baselines import Baseline
from palpate.surrogates.baselines.graph_form import BaselineForm, Distance, Touch, outer
from palpate.surrogates.energy import LearntEnergy
from palpate.surrogates.learnt_torque import ARM
from palpate.units import bounds

__all__ = ["BODY_OUTPUTS", "add_body", "add_torque"]

SLACK = 1e-9  # share of a range: round-off at its edge is still inside, as in the compiled kernels
STEP = 1e-3  # step over the probe's radius, of the difference for the third derivative of the distance
BODY_OUTPUTS = (
    "energy",
    "force",
    "stiffness",
    "amplitude",
    "slope",
    "depth",
    "inside",
    "deviation",
    "torque",
)


def add_body(graph: Graph, energy: LearntEnergy, *, apart: bool = False) -> None:
    """Add the input ``x`` (N, n), and the outputs `BODY_OUTPUTS` of an energy, to a graph.

    ``deviation`` is left out where the body has no posterior, ``torque`` is that of `add_torque`.
    Where one output is no number, all are not; kept `apart`,
    each speaks for itself, so that it can be computed without the others.
    """
    baseline, net = energy.baseline, energy.network
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
    known = baseline.graph_form(graph, place, touch, xi)
    if (more := baseline.graph_exponent(graph, xi, half)) is not None:
        value, gradient, hessian = more
        slopes = Slopes(slopes.value + value, slopes.gradient + gradient, slopes.hessian + hessian)
    graph.stage = "slopes"
    slopes = _through_box(slopes, slope.columns(0, k), curvature.columns(0, k), k)
    slopes = _to_space(slopes, D)
    if touch is not None and math.isfinite(energy.going.deepest):
        slopes = _leave(graph, baseline, touch, slopes, place)
    graph.stage = "answers"
    _answers(graph, energy, known, touch, slopes, (X, place), finite, apart)


def add_torque(graph: Graph, surrogate: Surrogate) -> None:
    """Add the output ``torque`` (N, 3), N m, of a tool whose torque was learnt, to the graph of its energy.

    A tool whose torque is a slope of its energy by its turn is refused: the graph does not have that slope.
    """
    arm = surrogate.quantities.get(ARM)
    if arm is None:
        if surrogate.torque_evaluator is not None:
            raise UsageError(
                f"The torque of {surrogate.name!r} has no ONNX form.",
                why="Its tool's orientation is an input: the torque is a slope of its energy, which a graph lacks.",
                fix="Ask it in Python, or learn the tool in a fixed orientation.",
            )
        return
    graph.stage = "torque"
    low, high = bounds(arm.inputs)
    force, X = Value(graph, "force"), Value(graph, "x")
    inside = graph.minimum(graph.maximum(graph.where(_finite(graph, X), X, low[None]), low), high)
    size = graph.sqrt((force * force).sum(1))
    graph.output("torque", size * network_values(graph, arm.network, inside), (3,))


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
    find = functools.partial(distance_to, graph)
    distance = find(baseline.surface)
    d, normal, bend = distance(place)
    s = radius - d
    contact = s > 0.0
    if not math.isfinite(energy.going.deepest):
        zero = s * 0.0
        return Touch(distance, find, s, contact, normal, bend, zero, zero + 1.0, zero)
    held, slope, curvature = _saturated(graph, s, energy.going.deepest, energy.going.depth_width)
    return Touch(distance, find, s, contact, normal, bend, s - held, slope, curvature)


def _through_box(slopes: Slopes, slope: Value, curvature: Value, felt: int) -> Slopes:
    """Take derivatives by saturated inputs to those by what came before the saturation."""
    bent = (curvature * slopes.gradient).spread(2) * np.eye(felt)
    return Slopes(slopes.value, slopes.gradient * slope, slopes.hessian * outer(slope, slope) + bent)


def _to_space(slopes: Slopes, D: np.ndarray) -> Slopes:
    """Take derivatives by felt coordinates u = D x to those by the place x."""
    if len(D) == 3:
        return slopes
    graph = slopes.value.graph
    return Slopes(slopes.value, slopes.gradient @ D, graph.constant(D.T) @ slopes.hessian @ D)


def _leave(graph: Graph, baseline: Baseline, touch: Touch, slopes: Slopes, place: Value) -> Slopes:
    """Take derivatives by the place c̃ at the saturated depth to those by c; see `contact_baseline`."""
    d, g, H = touch.normal, slopes.gradient, slopes.hessian
    m, rest, curvature = touch.excess, 1.0 - touch.slope, touch.curvature
    assert baseline.surface is not None  # it is touched
    usual = baseline.radius if math.isfinite(baseline.radius) else baseline.surface.reach
    bend = _bend(graph, touch.distance, place, g, STEP * usual)
    matrix = [value.spread(2) for value in (m, rest, curvature)]
    square = outer(d, d)
    J = matrix[0] * touch.bend - matrix[1] * square + np.eye(3)
    h = (touch.bend @ g.spread(2)).rows_as(3)
    along = (d * g).sum(1).spread(2)
    new = (J @ g.spread(2)).rows_as(3)
    hessian = (
        J @ H @ J.swap()
        + matrix[0] * bend
        - (matrix[1] * touch.bend + matrix[2] * square) * along
        - matrix[1] * (outer(d, h) + outer(h, d))
    )
    return Slopes(slopes.value, new, hessian)


def _bend(graph: Graph, distance: Distance, place: Value, g: Value, step: float) -> Value:
    """Return the derivative of ∇²d along g, by differences of fourth order."""
    size = graph.sqrt((g * g).sum(1))
    way = g / graph.where(size > 0.0, size, 1.0)
    parts: list[Value] = []
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
    stiffness = -kappa.spread(2) * (known.hessian + outer(b, g) + outer(g, b))
    stiffness = stiffness - value.spread(2) * (outer(g, g) + slopes.hessian)
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
    spread = outer(force, moved) - value.spread(2) * by
    total = graph.sqrt((spread * spread).sum(1, 2).rows_as(1))
    size = graph.sqrt((force * force).sum(1))
    return graph.where(size > 0.0, total / graph.where(size > 0.0, size, 1.0), 0.0)
