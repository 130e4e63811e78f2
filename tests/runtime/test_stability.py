"""The two bounds, against their published figures and against the loop that they speak of."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.runtime.stability import FeltStiffness, passive_stiffness, stable_stiffness
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


def test_delayed_springs_are_passive_below_the_bound_at_every_frequency():
    """Colgate & Schenkel's theorem itself, on a fine lattice of frequencies up to half the rate."""
    rng = np.random.default_rng(3)
    for _ in range(50):
        damping, rate, delay = rng.uniform(0.1, 5.0), rng.uniform(100.0, 2000.0), rng.uniform(0.0, 0.01)
        T, omega = 1.0 / rate, np.linspace(1e-4, 1.0, 20_001) * np.pi * rate
        K = passive_stiffness(damping, rate, delay=delay)
        H = K * np.exp(-1j * omega * delay)
        asked = T / 2 * ((1 - np.exp(-1j * omega * T)) * H).real / (1 - np.cos(omega * T))
        assert asked.max() <= damping * (1 + 1e-6)
        assert asked.max() >= damping * (1 - 1e-3), "and no more is asked for than must be"


def test_a_body_is_softened_to_the_bound_and_no_softer():
    soft = FeltStiffness(999.0, 0.5, 1000.0)
    assert (soft.coupling, soft.felt, soft.warning) == (np.inf, 999.0, None)
    stiff = FeltStiffness(4000.0, 0.5, 1000.0)
    assert stiff.bound == pytest.approx(1000.0)
    assert 1 / (1 / stiff.coupling + 1 / stiff.body) == pytest.approx(stiff.bound)
    assert stiff.felt == pytest.approx(1000.0)
    assert "softened to 1000 N/m" in stiff.warning
    late = FeltStiffness(340.0, 0.5, 1000.0, delay=1e-3)
    assert late.felt == pytest.approx(1000 / 3)
    as_it_is = FeltStiffness(4000.0, 0.5, 1000.0, override=True)
    assert (as_it_is.coupling, as_it_is.felt) == (np.inf, 4000.0)
    assert "as asked" in as_it_is.warning
    drawn = FeltStiffness(1e9, None, 1000.0)
    assert (drawn.coupling, drawn.warning) == (np.inf, None), "nothing without a motor oscillates"
    assert FeltStiffness(100.0, 0.0, 1000.0).felt <= 1.0, "a device without damping bears nothing"


def test_bounds_refuse_nonsense():
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
