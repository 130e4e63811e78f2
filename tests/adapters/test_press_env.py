"""The Gymnasium environment: its contract, its seeds, and a hand that reaches the wanted force."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import pressed
import tooled
from palpate.errors import UsageError

gymnasium = pytest.importorskip("gymnasium")

from gymnasium.utils.env_checker import check_env

import palpate.adapters.press_env  # noqa: F401  # registers the environment


def environment(**options):
    return gymnasium.make("palpate/Press-v0", body=pressed.surrogate(), **options)


def test_it_keeps_the_contract_of_gymnasium():
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*infinity.*")  # forces have no bound
        check_env(environment().unwrapped, skip_render_check=True)


def test_a_seed_gives_the_same_episode():
    def episode(seed):
        env = environment()
        seen = [env.reset(seed=seed)[0]]
        draws = np.random.default_rng(1)
        seen += [env.step(draws.uniform(-1, 1, 3).astype(np.float32))[0] for _ in range(20)]
        return np.array(seen)

    assert np.array_equal(episode(3), episode(3))
    assert not np.array_equal(episode(3), episode(4))


def test_a_hand_that_pushes_as_hard_as_wanted_reaches_the_force():
    """At rest push and force are equal: half the wanted size, in units of twice the largest."""
    env = environment()
    seen, _ = env.reset(seed=3)
    for _ in range(200):
        side = -0.3 * seen[:2]
        seen, reward, ended, late, info = env.step(np.array([*side, -0.5 * seen[9]], dtype=np.float32))
        assert not ended
    assert late
    assert reward > -0.02
    assert np.linalg.norm(info["force"]) == pytest.approx(info["wanted"], rel=0.02)


def test_leaving_the_trained_region_ends_the_episode():
    env = environment()
    env.reset(seed=3)
    ended = [env.step(np.array([1.0, 0.0, 0.0], dtype=np.float32))[2] for _ in range(200)]
    assert any(ended)


def test_what_does_not_fit_is_refused_in_words():
    with pytest.raises(UsageError, match="must be positive"):
        environment(mass=0.0)
    with pytest.raises(UsageError, match="further inputs are none"):
        environment(parameters=[1.0])


def test_a_tool_tells_its_torque():
    body = tooled.surrogate()
    env = gymnasium.make("palpate/Press-v0", body=body)
    env.reset(seed=1)
    for _ in range(40):
        *_, info = env.step(np.array([0.0, 0.0, -0.5], dtype=np.float32))
        if info["torque"].any():
            break
    place = env.unwrapped._place
    np.testing.assert_allclose(info["torque"], body.torque(place[None])[0], rtol=1e-9)
    assert info["torque"].any()
