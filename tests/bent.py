"""A rod in closed form that yields or creeps: h = w exp(w²/2), the tip goes down by w."""

from __future__ import annotations

import math

import numpy as np

from palpate.network import Network, Scaling
from palpate.surrogates.memories import IwanElements
from palpate.surrogates.plastic import HeldBody
from palpate.units import Quantity, Range

D = np.array([0.0, -1.0, 0.0])
REACH = 0.4
YIELDS = IwanElements.sliders(
    np.array([20.0, 60.0, 40.0]), np.array([math.inf, 0.1, 0.2]), np.array([0.0, 0.1, 0.0])
)
CREEPS = IwanElements.dashpots(np.array([60.0, 40.0]), np.array([math.inf, 0.5]))


def affine(inputs: list[Range], names: list[str], tail: np.ndarray) -> Network:
    n, m = len(inputs), len(names)
    scaling = Scaling(np.zeros(n), np.ones(n), np.zeros(m), np.ones(m))
    outputs = [Quantity(name, "m") for name in names]
    empty = np.zeros((0, n))
    return Network.axis_aligned(
        inputs, outputs, centres=empty, widths=empty, weights=np.zeros((m, 0)), tail=tail, scaling=scaling
    )


def body(elements: IwanElements = YIELDS, nodes: int = 2) -> HeldBody:
    """ℓ = ½ w²: h = w exp(w²/2), h' = (1 + w²) exp(w²/2); drawn as a slender rod under a force at its tip."""
    stretch = affine([Range("w²", 0.0, REACH**2, "m²")], ["ℓ"], np.array([[0.0, 0.5]]))
    s = np.linspace(0.0, 1.0, nodes)
    tail = np.zeros((2 * nodes, 3))
    tail[1::2, 1] = -(s**2) * (3 - s) / 2
    names = [f"u_{c} at {i}" for i in range(nodes) for c in "xy"]
    shape = affine([Range("w", -REACH, REACH, "m"), Range("P", -99.0, 99.0, "N")], names, tail)
    return HeldBody(
        name="made",
        stretch=stretch,
        shape=shape,
        elements=elements,
        mirrors=True,
        rest=np.outer(s, [1.0, 0.0, 0.0]),
        nodes_of_interest=np.array([nodes - 1]),
        touch_node=nodes - 1,
        directions=D[None],
        reach=REACH,
    ).checked()
