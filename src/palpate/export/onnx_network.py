"""A radial-basis-function network in an ONNX graph: values, slopes, curvatures.

    ℓ = T·[1, ξ] + Σ_k w_k g(‖A_k ξ − b_k‖²)

Its derivatives are further operators of the same graph.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.export.onnx_graph import Graph, Value
from palpate.network import Network, Scaling
from palpate.network.radial import radial

__all__ = ["Slopes", "add_network", "network_slopes", "network_values", "regressors"]


@dataclass(frozen=True)
class Slopes:
    """A function with its derivatives by m inputs: value (N, 1), gradient (N, m), Hessian (N, m, m)."""

    value: Value
    gradient: Value
    hessian: Value


@dataclass(frozen=True)
class _Units:
    """Units of a network at scaled inputs."""

    phi: Value  # g (N, h)
    first: Value  # g' by the squared distance
    second: Value  # g''
    pulled: list[Value]  # Aᵀ(A ξ − b) of the first inputs, each (N, h)


def _units(graph: Graph, network: Network, xi: Value, felt: int) -> _Units:
    """Return the units' answers at scaled inputs (N, n)."""
    A, b = network.factors, network.shifts
    rows = [xi @ A[:, r].T - b[:, r] for r in range(A.shape[1])]
    q: Any = rows[0] * rows[0]
    for row in rows[1:]:
        q = q + row * row
    pulled = []
    for i in range(felt):
        u: Any = rows[0] * A[:, 0, i]
        for r, row in enumerate(rows[1:], 1):
            u = u + row * A[:, r, i]
        pulled.append(u)
    return _Units(*radial(network.radial, q, graph.exp, graph.sqrt), pulled)


def _rows(network: Network) -> np.ndarray:
    """Return constant, slopes and weights (1 + n + h, m) of the outputs, in their units."""
    s = network.scaling
    rows = np.vstack([network.tail.T, network.weights.T])
    if network.basis is not None:
        rows = rows @ network.basis.T
    rows = rows * s.output_scale
    rows[0] += s.output_centre
    return np.asarray(rows)


def network_slopes(graph: Graph, network: Network, xi: Value, felt: int) -> Slopes:
    """Return the only output of a network at scaled inputs xi (N, n) with its derivatives by the first `felt` of them.

    The derivatives are by inputs that are not scaled.
    """
    n, half, rows = len(network.inputs), network.scaling.input_half, _rows(network)
    tail, weights = rows[: 1 + n], rows[1 + n :]
    value = xi @ tail[1:] + tail[0]
    slope, straight = tail[1 : 1 + felt, 0] / half[:felt], xi.columns(0, felt) * 0.0
    if not network.units:
        bend = straight.spread(2) * straight.spread(1)
        return Slopes(value, straight + slope, bend)
    units = _units(graph, network, xi, felt)
    w = weights[:, 0]
    by = [(units.first * u) @ (2.0 * w[:, None] / half[i]) for i, u in enumerate(units.pulled)]
    gradient = (graph.join(*by) if felt > 1 else by[0]) + slope
    A, entries = network.factors, {}
    for i in range(felt):
        for j in range(i, felt):
            gram = np.einsum("kr,kr->k", A[:, :, i], A[:, :, j])
            size = half[i] * half[j]
            curved = (units.second * units.pulled[i] * units.pulled[j]) @ (4.0 * w[:, None] / size)
            entries[i, j] = entries[j, i] = curved + units.first @ (2.0 * (w * gram)[:, None] / size)
    every = [entries[i, j] for i in range(felt) for j in range(felt)]
    hessian = (graph.join(*every) if felt > 1 else every[0]).rows_as(felt, felt)
    return Slopes(value + units.phi @ weights, gradient, hessian)


def regressors(graph: Graph, network: Network, xi: Value, felt: int) -> tuple[Value, Value]:
    """Return [1, ξ, φ] (N, 1 + n + h), and its derivatives (N, felt, 1 + n + h) by the first inputs, not scaled."""
    n, half = len(network.inputs), network.scaling.input_half
    one = xi.columns(0, 1) * 0.0 + 1.0
    first = [np.eye(1, 1 + n, 1 + i) / half[i] for i in range(felt)]
    if not network.units:
        flat = [one @ row for row in first]
        return graph.join(one, xi), graph.join(*[row.spread(1) for row in flat])
    units = _units(graph, network, xi, felt)
    lines = [
        graph.join(one @ first[i], units.first * u * (2.0 / half[i])).spread(1)
        for i, u in enumerate(units.pulled)
    ]
    return graph.join(one, xi, units.phi), (graph.join(*lines) if felt > 1 else lines[0])


def _scale_inputs(graph: Graph, scaling: Scaling, X: Value) -> tuple[Any, Value | None]:
    """Return scaled inputs (N, n), and what bends multiply their derivatives by h (N, n); None without bends."""
    far: Any = X - scaling.input_centre
    h, b = scaling.input_half, scaling.input_bend
    if not scaling.is_bent:
        return far / h, None
    least = h / (2.0 * (1.0 + np.abs(b)))
    d: Any = graph.maximum(far * b + h, least)
    near = graph.where(d > least, h / d, far * 0.0 + 1.0)
    return far / d, near * (h / d)


def network_values(graph: Graph, network: Network, X: Value) -> Value:
    """Return the outputs (N, m) of a network at inputs X (N, n), not scaled."""
    row, _ = regressors(graph, network, _scale_inputs(graph, network.scaling, X)[0], 1)
    return row @ _rows(network)


def add_network(graph: Graph, *networks: Network) -> None:
    """Add the input ``x`` (N, n), and the outputs ``y`` (N, m) and ``jacobian`` (N, m, n), to a graph.

    Of several networks of the same inputs and outputs these are sums.
    """
    n, m = len(networks[0].inputs), len(networks[0].outputs)
    X = graph.input("x", n)
    graph.stage = "network"
    values: Any = None
    slopes: Any = None
    for network in networks:
        rows = _rows(network)
        xi, turn = _scale_inputs(graph, network.scaling, X)
        row, lines = regressors(graph, network, xi, n)
        value, slope = row @ rows, (lines @ rows).swap()
        if turn is not None:
            slope = slope * turn.spread(1)
        values = value if values is None else values + value
        slopes = slope if slopes is None else slopes + slope
    graph.output("y", values, (m,))
    graph.output("jacobian", slopes, (m, n))
