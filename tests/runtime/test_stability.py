"""The two bounds, against their published figures and against the loop that they speak of."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.runtime.stability import passive_stiffness, stable_stiffness, stiffness_warning
from palpate.runtime.workspace import Workspace


@pytest.mark.parametrize(
    ("rate", "delay", "bound"), [(1000.0, 0.0, 1000.0), (1000.0, 1e-3, 1000 / 3), (200.0, 5e-3, 200 / 3)]
)
def test_figures(rate, delay, bound):
    assert stable_stiffness(0.5, rate, delay=delay) == pytest.approx(bound)
    if delay == 0.0:
        assert passive_stiffness(0.5, rate) == pytest.approx(bound)


def spectral_radius(stiffness, mass, damping, period, held):
    """Of a mass with damper under F = −K x sampled every `period` s and sent `held` periods late."""
    decay = np.exp(-damping * period / mass)
    move = mass / damping * (1 - decay)  # ∫ of the velocity's decay over a period
    push = (period - move) / damping
    n = 2 + held
    step = np.zeros((n, n))
    step[0, :2], step[1, 1] = (1.0, move), decay
    answer = np.array([push, (1 - decay) / damping])
    if held == 0:
        step[:2, 0] -= stiffness * answer
    else:
        step[:2, n - 1] += answer
        step[2, 0] = -stiffness
        for i in range(3, n):
            step[i, i - 1] = 1.0
    return np.abs(np.linalg.eigvals(step)).max()


@pytest.mark.parametrize(("rate", "held"), [(1000.0, 0), (1000.0, 1), (500.0, 2)])
def test_gil_bound_separates_stable_from_unstable_loops(rate, held):
    damping, mass = 0.5, 0.5
    bound = stable_stiffness(damping, rate, delay=held / rate)
    assert spectral_radius(0.95 * bound, mass, damping, 1 / rate, held) < 1.0
    assert spectral_radius(1.05 * bound, mass, damping, 1 / rate, held) > 1.0


def test_virtual_damping_costs_passivity_and_helps_stability():
    assert passive_stiffness(0.5, 1000.0, virtual_damping=0.2) < passive_stiffness(0.5, 1000.0)
    assert stable_stiffness(0.5, 1000.0, virtual_damping=0.2) > stable_stiffness(0.5, 1000.0)
    assert passive_stiffness(0.5, 1000.0, virtual_damping=0.6) == 0.0


def test_warning_comes_with_its_figures_or_not_at_all():
    assert stiffness_warning(999.0, 0.5, 1000.0) is None
    assert "1000 N/m" in stiffness_warning(1001.0, 0.5, 1000.0)
    assert stiffness_warning(330.0, 0.5, 1000.0, delay=1e-3) is None
    assert "oscillate" in stiffness_warning(340.0, 0.5, 1000.0, delay=1e-3)
    assert stiffness_warning(1e9, None, 1000.0) is None, "nothing without a motor oscillates"
    with pytest.raises(UsageError):
        passive_stiffness(0.5, 0.0)
    with pytest.raises(UsageError):
        stable_stiffness(0.5, 1000.0, delay=-1.0)


def test_workspace_scales_positions_and_stiffness():
    workspace = Workspace.for_reach(0.075, 0.3)
    out = np.zeros(3)
    workspace.to_body(np.array([0.0, -0.06, 0.0]), out)
    np.testing.assert_allclose(out, [0.0, -0.3, 0.0])
    np.testing.assert_allclose(workspace.to_hand(out), [0.0, -0.06, 0.0])
    # force per metre of hand: the same force over fewer metres
    assert workspace.felt(20.0) == pytest.approx(20.0 * 0.3 / 0.06)
    for radius, reach in ((0.0, 0.3), (0.075, 0.0), (np.nan, 0.3), (0.075, np.inf)):
        with pytest.raises(UsageError):
            Workspace.for_reach(radius, reach)
