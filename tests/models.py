"""Bodies made by formula, for tests that need one but no solver."""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.network import Network, Scaling
from palpate.surrogates import LearntEnergy, NodeField, PadBaseline, RestStiffness, Stiffening, Surrogate
from palpate.units import Quantity, Range

DOWN = np.array([[0.0, -1.0, 0.0]])


def linear_network(inputs: list[Range], outputs: list[Quantity], tail: np.ndarray, units: int = 2) -> Network:
    """A network that is affine in its scaled inputs, tail (m, 1 + n), with `units` units of zero weight."""
    n, m = len(inputs), len(outputs)
    low, high = np.array([r.low for r in inputs]), np.array([r.high for r in inputs])
    scaling = Scaling((low + high) / 2, (high - low) / 2, np.zeros(m), np.ones(m))
    return Network.axis_aligned(
        inputs,
        outputs,
        centres=np.zeros((units, n)),
        widths=np.ones((units, n)),
        weights=np.zeros((m, units)),
        tail=tail,
        scaling=scaling,
    )


def spring_energy(
    stiffness: float | np.ndarray,
    ranges: list[Range],
    directions: np.ndarray = DOWN,
    *,
    hardening: float = 0.0,
    units: int = 2,
) -> LearntEnergy:
    """U = ½ K w² exp(hardening w²) of one direction, or ½ w·K w of several, with a network that is zero."""
    k = len(directions)
    half = (ranges[0].high - ranges[0].low) / 2
    P = Stiffening.none(k)
    if hardening:
        P = Stiffening(np.array([hardening * half**2]), np.array([[2]]))
    baseline = PadBaseline(RestStiffness.even(np.atleast_2d(stiffness)), P, axes=np.asarray(directions))
    network = linear_network(ranges, [Quantity("ℓ", "")], np.zeros((1, 1 + k)), units)
    return LearntEnergy(network, baseline)


def planar_field(name: str, network: Network, points: np.ndarray, **options: Any) -> NodeField:
    """A field whose network answers x and y of every node in turn; the last node is held."""
    columns = np.array([(node, component) for node in range(len(points)) for component in range(2)])
    return NodeField(name, "m", network, columns, points, len(points) - 1, **options)


def spring_beam(stiffness: float = 20.0, load: float = 5.0, nodes: int = 21) -> Surrogate:
    """A 1 m beam whose tip is a linear spring (N/m) pushed down by 0 … load N; every node moves as x²."""
    points = np.zeros((nodes, 3))
    points[:, 0] = np.linspace(0.0, 1.0, nodes)
    loads, travel = [Range("tip", 0.0, load, "N")], load / stiffness
    shape = np.zeros((nodes, 2))
    shape[:, 1] = -(points[:, 0] ** 2) * travel / 2
    names = [Quantity(f"u_{c} at node {i}", "m") for i in range(nodes) for c in "xy"]
    network = linear_network(loads, names, np.repeat(shape.reshape(-1, 1), 2, axis=1))
    interest = np.arange(0, nodes, (nodes - 1) // 5)
    field = planar_field("displacement", network, points, mirror=DOWN[0], of_interest=interest)
    energy = spring_energy(stiffness, [Range("h", -travel, travel, "m")])
    return Surrogate(energy, {"displacement": field}, meta={"name": "spring", "made": "by formula"})
