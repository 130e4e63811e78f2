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
from palpate.surrogates import LearntEnergy, LearntQuantities, Surrogate
from palpate.surrogates.baselines import ToolBaseline
from palpate.surrogates.learnt_torque import ARM
from palpate.tools import Capsule, PosedTool

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
