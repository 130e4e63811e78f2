"""Models made by formula, for tests that need a body but no solver."""

from __future__ import annotations

import numpy as np

from palpate.network import Network, Scaling
from palpate.surrogates import TouchModel
from palpate.units import Quantity, Range


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


def spring_beam(stiffness: float = 20.0, load: float = 5.0, nodes: int = 21) -> TouchModel:
    """A 1 m beam whose tip is a linear spring (N/m) pushed down by 0 … load N; every node moves as x²."""
    rest = np.zeros((nodes, 3))
    rest[:, 0] = np.linspace(0.0, 1.0, nodes)
    loads, travel = [Range("tip", 0.0, load, "N")], load / stiffness
    shape = np.zeros((nodes, 2))
    shape[:, 1] = -(rest[:, 0] ** 2) * travel / 2
    names = [Quantity(f"u_{c} at node {i}", "m") for i in range(nodes) for c in "xy"]
    field = linear_network(loads, names, np.repeat(shape.reshape(-1, 1), 2, axis=1))
    force = linear_network([Range("h", 0.0, travel, "m")], [Quantity("tip", "N")], np.full((1, 2), load / 2))
    return TouchModel(
        name="spring",
        networks={"nodes": field, "field": field, "force": force},
        rest=rest,
        nodes_of_interest=np.arange(0, nodes, (nodes - 1) // 5),
        touch_node=nodes - 1,
        touched=(0,),
        directions=np.array([[0.0, -1.0, 0.0]]),
        compliance=0.0,
        mirrors=True,
        reach=travel,
        stiffness_max=stiffness,
        radius=0.005,
        meta={"made": "by formula"},
    )
