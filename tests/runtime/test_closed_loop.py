"""The whole loop around a simulated hand, on time that the test makes: energy, rest, and the stiffness limit.

Each run is a loop as it is, with a learnt body, a simulated hand on a device and no clock.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from benchmarks.hand_drives import SENSORS as BENCHMARKED
from benchmarks.hand_drives import Sensed

import held
import pressed
from models import spring_beam
from palpate.devices.device import PLAIN_AXES
from palpate.devices.simulated import SimulatedHand, SimulatedSettings
from palpate.errors import UsageError
from palpate.runtime.loop import Loop
from palpate.runtime.safety import Fault, Limits
from palpate.runtime.shared_state import Shared
from palpate.runtime.touchable import touchable
from palpate.runtime.workspace import HandFrame, Workspace
from palpate.surrogates.memories import Relaxation

LIMITS = Limits(12.0)
FAST, SLOW = (1000.0, 0.0), (200.0, 0.005)  # Hz, s
BODIES = {
    "block": pressed.surrogate,
    "firm block": lambda: pressed.surrogate(factor=2.0),
    "stiff block": lambda: pressed.surrogate(factor=50.0),
    "relaxing block": lambda: pressed.surrogate(factor=50.0, memory=Relaxation(((0.4, 0.1),))),
    "beam": lambda: spring_beam(200.0),
}


class Touch:
    """One body in one simulated hand, and all that was sent and moved."""

    def __init__(self, name, pace, seconds, *, override=False, control=True, **settings):
        body = touchable(BODIES[name]())
        scale = body.workspace(SimulatedHand.traits.radius).scale
        rate, delay = pace
        aim = body.stroke(scale) | settings
        self.hand = SimulatedHand(SimulatedSettings(**aim, delay=delay))
        self.loop = Loop(
            body, self.hand, Shared.private(), body.workspace(0.075), LIMITS,
            rate=rate, stiffness=body.stiffness_max, override=override, control=control,
        )  # fmt: skip
        self.forces, self.speeds, self.places = [], [], []
        for k in range(round(seconds * rate)):
            self.loop.tick(k / rate)
            self.forces.append(self.loop.out.force.copy())
            self.speeds.append(np.linalg.norm(self.hand.velocity))
            self.places.append(self.hand.place.copy())
            assert self.loop.fault is Fault.NONE

    @property
    def floor(self):
        """The bound of the ledger, J."""
        return -self.loop.bounds.felt * self.loop.passivity.leak

    def rms(self, since):
        return math.sqrt(np.mean(np.square(self.speeds[round(since / self.loop.period) :])))


@pytest.mark.grid
@pytest.mark.parametrize("shape", ["random", "adversarial"])
@pytest.mark.parametrize("pace", [FAST, SLOW], ids=["1 kHz", "200 Hz, 5 ms"])
@pytest.mark.parametrize("name", list(BODIES))
def test_no_more_energy_than_sampling_leaks(name, pace, shape):
    touch = Touch(name, pace, 3.0, shape=shape, seed=7)
    assert np.linalg.norm(touch.forces, axis=1).max() > 0.02, "the body was felt"
    assert touch.loop.passivity.lowest >= touch.floor - 1e-9
    assert np.linalg.norm(touch.forces, axis=1).max() <= LIMITS.max_force + 1e-12
    # and the device's own damping takes more than the force gave it
    own = 0.5 * np.square(np.linalg.norm(np.diff(touch.places, axis=0), axis=1)).sum() / touch.loop.period
    assert touch.hand.work <= own + 1e-9


@pytest.mark.grid
@pytest.mark.parametrize("pace", [FAST, SLOW], ids=["1 kHz", "200 Hz, 5 ms"])
@pytest.mark.parametrize("name", list(BODIES))
def test_a_hand_in_contact_comes_to_rest(name, pace):
    touch = Touch(name, pace, 2.0, shape="press", step=1e-5)
    assert np.linalg.norm(touch.forces[-1]) > 0.02
    assert touch.rms(1.0) < 1e-3


def test_the_limit_acts_with_the_delay_that_was_measured_and_says_so():
    quick, late = Touch("stiff block", FAST, 1.0), Touch("stiff block", SLOW, 1.0)
    assert late.loop.bounds.delay == pytest.approx(0.005, rel=0.05)
    assert quick.loop.bounds.felt == pytest.approx(1000.0)
    assert late.loop.bounds.felt == pytest.approx(200 / 3, rel=0.05)
    assert "softened to 67 N/m" in late.loop.bounds.warning
    assert Touch("block", FAST, 0.1).loop.bounds.warning is None
    assert not Touch("block", FAST, 0.1).loop.coupling.active


def test_without_limit_and_controller_the_body_shakes_the_hand():
    """The rivals, on a body six times too stiff: the controller takes what it gives, the limit forestalls it."""
    options = {"shape": "adversarial", "override": True}
    wild = Touch("firm block", SLOW, 4.0, control=False, **options)
    kept = Touch("firm block", SLOW, 4.0, **options)
    calm = Touch("firm block", SLOW, 4.0, shape="adversarial")
    assert wild.loop.bounds.body > 5 * wild.loop.bounds.bound
    assert wild.hand.work > 0.1
    assert kept.hand.work < 0.1 * wild.hand.work
    assert calm.hand.work < kept.hand.work
    assert "as asked" in kept.loop.bounds.warning
    assert "controller is off" in wild.loop.bounds.warning
    assert kept.loop.passivity.injected > 0.0 == wild.loop.passivity.injected


def light_hand(control):
    """Loop and hand: a light device, pressed on a body far too stiff for its delay, whose user wants it so."""
    body = touchable(BODIES["stiff block"]())
    space = body.workspace(0.075)
    settings = SimulatedSettings(
        **body.stroke(space.scale), shape="press", mass=0.1, damping=0.1, grip_damping=1.0, delay=0.005
    )
    hand = SimulatedHand(settings)
    options = {"rate": 200.0, "stiffness": body.stiffness_max, "override": True, "control": control}
    return Loop(body, hand, Shared.private(), space, LIMITS, **options), hand


@pytest.mark.parametrize("control", [True, False])
def test_a_force_that_swings_to_and_fro_ends_in_a_stop_that_is_recorded(control):
    loop, hand = light_hand(control)
    loop.run_for(3.0)
    assert loop.out.record["fault_counts"][Fault.UNSTABLE] == 1
    assert loop.stop.stopped
    assert not loop.out.force.any()
    assert np.linalg.norm(hand.velocity) < 1e-3, "the hand has come to rest"
    assert hand.work < 3.0, "half a second of it, where it would else go on and on"


def test_the_softened_body_is_felt_as_body_and_spring_in_series():
    touch = Touch("stiff block", FAST, 1.5, shape="press")
    loop = touch.loop
    loop.evaluator(loop.coupling.proxy, loop.parameters)
    np.testing.assert_allclose(loop.out.force, loop.evaluator.force, rtol=2e-3, atol=1e-3)
    body = loop.coupling.stiffness * (loop.coupling.proxy - loop.out.position)
    np.testing.assert_allclose(loop.out.force, body)


def test_a_repeated_run_gives_the_same_bits():
    first, second = (Touch("relaxing block", SLOW, 1.0, shape="random", seed=3, step=1e-5) for _ in range(2))
    np.testing.assert_array_equal(first.forces, second.forces)
    np.testing.assert_array_equal(first.loop.passivity.state, second.loop.passivity.state)


SENSORS = BENCHMARKED | {"noise of 100 µm and steps of 55 µm": {"noise": 1e-4, "step": 5.5e-5}}
PACES = {"1 kHz": FAST, "200 Hz": (200.0, 0.0), "200 Hz, 5 ms": SLOW}
_clean = {}


def sensed(motion, pace, *, control=True, **sensor):
    """A hand on a block by a sensor that is not exact: what the force does from tick to tick, and the energy."""
    body, shape = touchable(pressed.surrogate()), {"still": "press", "moving": "sine"}[motion]
    touch = Sensed.of(body, pace, shape, 4.0, {"seed": 5.0} | sensor, controlled=control)
    assert not touch.faults
    return touch


@pytest.mark.full
@pytest.mark.parametrize("pace", list(PACES))
@pytest.mark.parametrize("sensor", list(SENSORS))
@pytest.mark.parametrize("motion", ["still", "moving"])
def test_a_sensor_as_it_is_neither_shakes_the_hand_nor_hides_what_it_is_given(motion, sensor, pace):
    """What the body itself answers to the noise is K times its difference, 2 √2 · 4 σ at most: 12 K σ."""
    options, key = SENSORS[sensor], (motion, pace)
    if key not in _clean:
        _clean[key] = sensed(motion, PACES[pace])
    clean, touch = _clean[key], sensed(motion, PACES[pace], **options)
    speed = 0.2  # m/s, more than this hand's
    error = max(options.get("noise", 0.0), options.get("step", 0.0), speed * options.get("jitter", 0.0))
    assert touch.change <= clean.change + 12.0 * touch.felt * error
    assert touch.air < 1e-3, "nothing is felt in the air"
    assert touch.given <= 0.01 * touch.stored + 1e-4, "J"
    assert touch.stored > 1e-4


def test_without_the_controller_a_late_loop_gives_more_than_that():
    """So the two together are no controller that is merely off."""
    bare = sensed("moving", SLOW, control=False)
    assert bare.given > 0.01 * bare.stored + 1e-4


def test_a_delay_that_nobody_knows_is_called_so():
    hand = SimulatedHand(SimulatedSettings())
    hand.traits = dataclasses.replace(hand.traits, stamped=False)
    body = touchable(BODIES["block"]())
    loop = Loop(body, hand, Shared.private(), body.workspace(0.075), LIMITS, stiffness=body.stiffness_max)
    loop.tick(0.0)
    assert not loop.bounds.delay_known
    assert "unknown" in str(loop.bounds)
    assert "delay of the device is unknown" in loop.bounds.warning
    assert not loop.out.record["delay_known"]
    for known in ({"delay": 0.001}, {"stamped": True}):
        hand.traits = dataclasses.replace(hand.traits, **known)
        loop = Loop(body, hand, Shared.private(), body.workspace(0.075), LIMITS)
        assert loop.bounds.delay_known


def test_a_gripped_pad_is_softened_too():
    body = touchable(held.pad())
    hand = SimulatedHand(SimulatedSettings(delay=0.01, damping=0.02, shape="random"))
    loop = Loop(
        body, hand, Shared.private(), body.workspace(0.075), LIMITS, rate=200.0, stiffness=body.stiffness_max
    )  # fmt: skip
    loop.run_for(1.0)
    assert loop.coupling.active
    assert loop.passivity.lowest >= -loop.bounds.felt * loop.passivity.leak - 1e-9
    published = loop.out.record
    assert published["coupling"] == pytest.approx(loop.bounds.coupling)


TURNED = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))  # x towards the user, y right, z up


def test_axes_turn_positions_there_and_forces_back():
    frame, hand, sent = HandFrame(TURNED), np.zeros(3), np.zeros(3)
    frame.to_hand(np.array([1.0, 2.0, 3.0]), hand, clutched=False)
    assert hand.tolist() == [2.0, 3.0, 1.0]
    frame.to_device(hand, sent)
    assert sent.tolist() == [1.0, 2.0, 3.0]
    mirror = ((-1.0, 0.0, 0.0), *PLAIN_AXES[1:])
    for bad in (mirror, ((2.0, 0.0, 0.0), *PLAIN_AXES[1:]), ((1.0, 0.1, 0.0), *PLAIN_AXES[1:])):
        with pytest.raises(UsageError, match=r"\+1"):
            HandFrame(bad)


def test_a_clutch_moves_the_device_and_not_the_hand():
    frame, hand = HandFrame(), np.zeros(3)
    frame.to_hand(np.array([0.01, 0.0, 0.0]), hand, clutched=False)
    frame.to_hand(np.array([0.05, 0.02, 0.0]), hand, clutched=True)
    assert hand.tolist() == [0.01, 0.0, 0.0]
    frame.to_hand(np.array([0.06, 0.02, 0.0]), hand, clutched=False)
    np.testing.assert_allclose(hand, [0.01, 0.0, 0.0])
    frame.to_hand(np.array([0.07, 0.02, 0.0]), hand, clutched=False)
    np.testing.assert_allclose(hand, [0.02, 0.0, 0.0])


@pytest.mark.parametrize("upright", [False, True])
def test_forces_go_to_the_hand_and_back(upright):
    space, sent, back = Workspace(0.075, 1.0, upright=upright), np.zeros(3), np.zeros(3)
    space.force_on_hand(np.array([1.0, 2.0, 3.0]), sent)
    space.force_on_body(sent, back)
    assert back.tolist() == [1.0, 2.0, 3.0]
