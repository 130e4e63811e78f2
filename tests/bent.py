"""A rod in closed form that yields or creeps: U = ½ K w² exp(w²), so q = √K w exp(w²/2); the tip goes down by w."""

from __future__ import annotations

import math

import numpy as np

from models import DOWN, linear_network, planar_field, spring_energy
from palpate.surrogates import Surrogate
from palpate.surrogates.memories import IwanElements
from palpate.units import Quantity, Range

D = DOWN[0]
REACH = 0.4
STIFFNESS = 120.0  # K, N/m
ROOT = math.sqrt(STIFFNESS)
YIELDS = IwanElements.sliders(
    np.array([1.0, 3.0, 2.0]) / 6.0, np.array([math.inf, 0.1, 0.2]) * ROOT, np.array([0.0, 0.1, 0.0])
)
CREEPS = IwanElements.dashpots(np.array([0.6, 0.4]), np.array([math.inf, 0.5]))


def body(elements: IwanElements = YIELDS, nodes: int = 2) -> Surrogate:
    """Drawn as a slender rod under a force at its tip."""
    s = np.linspace(0.0, 1.0, nodes)
    tail = np.zeros((2 * nodes, 3))
    tail[1::2, 1] = -(s**2) * (3 - s) / 2 * REACH
    names = [Quantity(f"u_{c} at {i}", "m") for i in range(nodes) for c in "xy"]
    asked = [Range("w", -REACH, REACH, "m"), Range("P", -99.0, 99.0, "N")]
    field = planar_field(
        "displacement",
        linear_network(asked, names, tail),
        np.outer(s, [1.0, 0.0, 0.0]),
        touched=np.ones(1, np.int64),
        asked_by="place and load",
        of_interest=np.array([nodes - 1]),
    )
    energy = spring_energy(STIFFNESS, [Range("w", -REACH, REACH, "m")], hardening=1.0)
    return Surrogate(energy, {"displacement": field}, elements, {"name": "made"})
