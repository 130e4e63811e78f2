"""A body that remembers, in the loop and in its real process; the body is a closed form (`tests/bent.py`)."""

from __future__ import annotations

import numpy as np
import pytest

from bent import CREEPS, REACH, STIFFNESS, D, body
from palpate.devices.device import Sample, Traits
from palpate.runtime import LoopProcess, now
from palpate.runtime.loop import Loop
from palpate.runtime.safety import Limits
from palpate.runtime.shared_state import Shared
from palpate.runtime.touchable import Touchable, load_touchable, touchable
from waiting import wait_for, watch_for

TICK, STRONG = 1e-3, Limits(1e3, 1e9)
PAST_YIELD = 0.3  # m


class Plain:
    """A device that is where it is told."""

    traits = Traits(0.075, 20.0, None, "for tests")

    def __init__(self) -> None:
        self.sample = Sample()

    def read(self, now: float) -> Sample:
        self.sample.time = now
        return self.sample

    def write(self, force: np.ndarray) -> None:
        pass

    def close(self) -> None:
        pass


class Hand:
    """A loop without a process, whose hand is led tick by tick."""

    def __init__(self, model: Touchable) -> None:
        self.shared, self.device, self.time = Shared.private(), Plain(), 0.0
        space = model.workspace(0.075)
        self.loop = Loop(model, self.device, self.shared, space, STRONG)
        self.to_hand = space.to_hand

    def tick(self, w: float | None) -> None:
        """One tick with the hand at w along the load, or without a hand."""
        self.time += TICK
        self.device.sample.holding = w is not None
        if w is not None:
            self.device.sample.position[:] = self.to_hand(w * D)
        self.loop.tick(self.time)

    def lead(self, start: float, end: float, ticks: int = 100) -> None:
        for w in np.linspace(start, end, ticks):
            self.tick(float(w))

    @property
    def where(self) -> float:
        """w of the held node, m."""
        return float(self.loop.evaluator.loads[0])

    @property
    def asked(self) -> float:
        """Force of the body before safety, along the load, N."""
        return float(D @ self.loop.evaluator.force)


@pytest.fixture
def bent() -> Hand:
    """Bent past yield and let go."""
    hand = Hand(touchable(body()))
    hand.lead(0.0, PAST_YIELD)
    hand.tick(None)
    return hand


def test_a_rod_bent_past_yield_stays_where_nothing_pulls(bent: Hand):
    way = np.linspace(0.0, PAST_YIELD, 100)
    alone = body().follow(way[:, None], TICK * np.arange(100))
    assert bent.where == pytest.approx(alone.rest @ D, rel=1e-9)
    assert 0.05 < bent.where < PAST_YIELD
    assert bent.asked == 0.0
    before = bent.where
    for _ in range(50):
        bent.tick(None)
    assert bent.where == pytest.approx(before, abs=1e-12)


def test_a_hand_takes_hold_where_the_node_is(bent: Hand):
    """From any place: no jump, and then a node that moves as the hand does, on the line of unloading."""
    lies = bent.where
    bent.tick(-0.1)
    assert bent.where == pytest.approx(lies, abs=1e-12)
    assert bent.asked == pytest.approx(0.0, abs=1e-9)
    bent.lead(-0.1, -0.08)
    assert bent.where == pytest.approx(lies + 0.02, abs=1e-9)
    assert bent.asked < -0.5
    bent.lead(-0.08, -0.1)
    assert bent.asked == pytest.approx(0.0, abs=1e-9), "reloading and unloading are one elastic line"


def test_a_hand_that_cannot_be_believed_takes_hold_anew(bent: Hand):
    bent.lead(0.0, 0.01)
    pulled, lies = bent.asked, bent.where
    bent.tick(np.nan)
    assert not bent.shared.state.record["force"].any()
    bent.tick(-0.2)  # meanwhile the hand went elsewhere
    assert bent.where == pytest.approx(lies, abs=1e-12)
    assert bent.asked == pytest.approx(pulled, rel=1e-9)


def test_a_rod_that_creeps_comes_back_in_time():
    hand = Hand(touchable(body(CREEPS)))
    hand.lead(0.0, 0.2, 500)
    hand.tick(None)
    first, path = hand.where, []
    assert 0.0 < first < 0.2
    for _ in range(4000):
        hand.tick(None)
        path.append(hand.where)
    assert np.all(np.diff(path) < 0)
    assert path[-1] < 0.02 * first


def test_a_body_and_its_file_are_told_from_others(tmp_path):
    made = body()
    again = load_touchable(made.save(tmp_path / "rod.palpate"))
    assert again.holds
    assert str(again.energy) == str(made.energy)
    assert (again.name, again.reach, again.parameters) == ("made", REACH, ())
    assert again.stays
    # K (1 + 5 w² + 2 w⁴) exp(w²), the second derivative of ½ K w² exp(w²), at the end
    stiffest = STIFFNESS * (1 + 5 * REACH**2 + 2 * REACH**4) * np.exp(REACH**2)
    assert again.stiffness_max == pytest.approx(stiffest, rel=1e-9)


@pytest.mark.full
def test_in_the_real_process_it_stays_bent(tmp_path):
    path = body().save(tmp_path / "rod.palpate")
    with LoopProcess(path, max_force=1e3) as loop:
        to_hand = load_touchable(path).workspace(loop.read().radius).to_hand
        for w in np.linspace(0.0, PAST_YIELD, 60):
            loop.shared.write_command(beat=now() + 60, grabbed=True, target=to_hand(w * D))
            watch_for(loop, 0.02)
        loop.shared.write_command(beat=now() + 60, grabbed=True, target=to_hand(PAST_YIELD * D))
        # the hand is followed at a bounded speed, and a busy machine lets the loop sleep
        wait_for(lambda: abs(loop.read().loads[0] - PAST_YIELD) < 1e-9)
        held = loop.read()
        assert -held.force @ D == pytest.approx(held.loads[1], rel=1e-6)
        loop.shared.write_command(grabbed=False)
        wait_for(lambda: not loop.read().force.any())
        free = watch_for(loop, 0.2)[-1]
        assert not free.force.any()
        assert 0.05 < free.loads[0] < 0.25
        np.testing.assert_allclose(free.contact, free.loads[0] * D, atol=1e-12)
        assert watch_for(loop, 0.2)[-1].loads[0] == pytest.approx(free.loads[0], abs=1e-12)
    assert loop.report().foreign == ()
