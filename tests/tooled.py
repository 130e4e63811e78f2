"""The flat body of `pressed` under a tool, whose torque is known in closed form, with the surrogate that is exactly it.

The tool is a turned capsule. Its place is its foremost point; where it touches the plane, U = A s³ exp(b x) as for the
ball of `pressed`, and the torque is τ = ‖F‖ a with an arm a that is affine in the place.
"""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np

import pressed
from models import linear_network
from palpate.learning.learn_arm import ARM_OUTPUTS
from palpate.surrogates import ContactLaw, Continuation, LearntEnergy, LearntQuantities, Surrogate
from palpate.surrogates.baselines import PosedBaseline, ToolBaseline
from palpate.surrogates.learnt_torque import ARM, TURNS
from palpate.tools import Capsule, PosedTool
from palpate.units import Quantity, Range

TOOL = PosedTool(Capsule(0.004, 0.02), (0.1, 0.2, 0.0))
# m at the middle of the ranges, and m from there to their ends
MIDDLE, SLOPES = np.array([1e-3, -2e-3, 5e-4]), 1e-4 * np.array([[3.0, -1, 2], [1, 4, 0], [0, 2, -3]])


def surrogate(*, memory: Any = None, meta: Any = None) -> Surrogate:
    """The closed form as a body under a tool."""
    plain = pressed.surrogate(memory=memory, meta=meta)
    energy: LearntEnergy = plain.hand_energy
    contact = energy.baseline
    baseline = ToolBaseline(
        contact.law, contact.touched, contact.probe_radius, tool=json.dumps(TOOL.describe(), sort_keys=True)
    )
    arm = linear_network(list(pressed.INPUTS), list(ARM_OUTPUTS), np.column_stack([MIDDLE, SLOPES]))
    return replace(plain, energy=replace(energy, baseline=baseline), quantities={ARM: LearntQuantities(arm)})


def torque(X: np.ndarray) -> np.ndarray:
    """τ (N, 3), N m, at places within the ranges."""
    low, high = np.array([[r.low for r in pressed.INPUTS], [r.high for r in pressed.INPUTS]])
    scaled = 2.0 * (X - low) / (high - low) - 1.0
    return np.asarray(np.linalg.norm(pressed.force(X), axis=1)[:, None] * (MIDDLE + scaled @ SLOPES.T))


# slopes of ln U by the components of a turn, 1/rad
BY_TURN = np.array([0.7, -1.1, 0.4])
TILT = 0.3  # rad


def turned_surrogate(turns: int = 3) -> Surrogate:
    """The closed form times exp(g · w), w being a turn of so many components: U = A s³ exp(b x + g · w)."""
    body = surrogate()
    energy = body.hand_energy
    inputs = [*pressed.INPUTS, *(Range(name, -TILT, TILT, "rad") for name in TURNS[:turns])]
    slopes = [pressed.B * 0.02, 0.0, 0.0, *(TILT * BY_TURN[:turns])]
    network = linear_network(inputs, [Quantity("ln U/U0")], np.array([[np.log(pressed.A), *slopes]]))
    going = Continuation.of(tuple(inputs), deepest=pressed.DEEPEST)
    return replace(body, energy=LearntEnergy(network, energy.baseline, continuation=going), quantities={})


def posed_surrogate(turns: str) -> Surrogate:
    """A capsule whose axis ("axis") or whole orientation ("full") is an input, on a plane, with a learnt factor."""
    tool = PosedTool(Capsule(0.006, 0.03), (0.0, 0.0, 0.4), turns=turns, tilt=TILT)  # type: ignore[arg-type]
    baseline = PosedBaseline(
        ContactLaw("series", 1e-3), pressed.face(), 0.006, tool=json.dumps(tool.describe(), sort_keys=True)
    )
    inputs = [
        *(Range(f"tip_{axis}", -0.01, 0.01, "m") for axis in "xy"),
        Range("tip_z", -0.004, 0.002, "m"),
        *tool.angles,
    ]
    slopes = [0.1, -0.05, 0.02, *(TILT * BY_TURN[: len(tool.angles)])]
    network = linear_network(inputs, [Quantity("ln U/U0")], np.array([[2.0, *slopes]]))
    going = Continuation.of(tuple(inputs), deepest=0.006)
    return Surrogate(LearntEnergy(network, baseline, continuation=going), meta={"name": "posed"})
