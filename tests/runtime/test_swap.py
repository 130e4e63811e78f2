"""Another surrogate takes the place of the one in the hand: force, energy and memory, on time that the test makes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import held
import pressed
from models import spring_beam
from palpate.devices.device import Sample, Traits
from palpate.devices.simulated import SimulatedHand, SimulatedSettings
from palpate.devices.trace_file import read_trace
from palpate.errors import UsageError
from palpate.runtime.handover import hand_over, prepared, take
from palpate.runtime.loop import Loop
from palpate.runtime.recorder import TraceRecorder
from palpate.runtime.recording import Ring, TickRecorder
from palpate.runtime.replay import Replay, loop_facts
from palpate.runtime.safety import Fault, Limits
from palpate.runtime.shared_state import Shared
from palpate.runtime.swap import swap_between
from palpate.runtime.touchable import touchable
from palpate.surrogates import Surrogate
from palpate.surrogates.memories import Indentation, IwanElements, Patches, Relaxation
from surrogates.touch_made import overlap_baseline, touch_energy

LIMITS = Limits(12.0)
RELAXES = Relaxation(((0.4, 0.1), (0.2, 0.5)))
PLACES = np.array([[0.0, 0.0, 0.0], [0.004, 0.0, 0.0], [0.0, 0.004, 0.0], [-0.004, 0.0, 0.0]])
YIELDS = Indentation(
    np.array([0.0, 0.02, 0.05]), np.array([0.01, 0.035, 0.07]), np.array([1.0, 1.05, 1.1]), PLACES, 0.003
)
ON_PLACES = Relaxation(((0.4, 0.1),), patches=Patches(PLACES, 0.003))


class Held:
    """A device without motors whose handle stays where the test puts it, m of the hand."""

    traits = Traits(radius=0.075, max_force=12.0, damping=None, source="the test")

    def __init__(self):
        self.sample = Sample()
        self.sample.holding, self.sample.patience = True, math.inf

    def at(self, *place):
        self.sample.position[:] = place

    def read(self, now):
        self.sample.time = now
        return self.sample

    def write(self, force):
        pass

    def close(self):
        pass


class Touch:
    """A loop around a body on a device, and what it answered."""

    def __init__(self, body, device=None, *, rate=1000.0, control=True, recorder=None):
        self.body, self.device = touchable(body), device or Held()
        self.loop = Loop(
            self.body, self.device, Shared.private(), self.body.workspace(0.075), LIMITS, rate=rate,
            stiffness=self.body.stiffness_max, control=control, recorder=recorder,
        )  # fmt: skip
        self.k, self.wanted, self.shares, self.added = 0, [], [], []

    def press(self, depth):
        """Put the hand at a depth (m of the body) under the place of first contact."""
        self.device.at(0.0, -depth / self.loop.workspace.scale, 0.0)

    def swap(self, body, seconds=0.2):
        self.loop.swap = swap = swap_between(self.body, touchable(body), seconds=seconds)
        self.body = touchable(body)
        return swap

    def tick(self, count):
        for _ in range(count):
            self.loop.tick(self.k * self.loop.period)
            self.k += 1
            self.wanted.append(self.loop.wanted.copy())
            self.added.append(self.loop.passivity.added)
            assert self.loop.fault is Fault.NONE

    def until_swapped(self):
        start = self.k
        while self.loop.swap is not None:
            self.tick(1)
            assert self.k - start < 20_000
        return self.k - start


@pytest.mark.parametrize("seconds", [0.1, 0.2])
def test_the_force_goes_from_one_to_the_other_without_a_jump(seconds):
    old, new = pressed.surrogate(), pressed.surrogate(factor=1.5)
    touch = Touch(old)
    touch.press(0.002)
    touch.tick(100)
    swap = touch.swap(new, seconds)
    ticks = touch.until_swapped()
    touch.tick(1)
    assert (swap.begun, swap.ended) == (101, 101 + ticks - 1)
    assert ticks * touch.loop.period >= seconds
    force = np.array(touch.wanted)[:, 2]
    step = np.diff(force)
    assert force[-1] == pytest.approx(1.5 * force[50])
    assert (step[100:] >= -1e-12).all()
    assert step.max() <= 1.5 * touch.loop.period / seconds * (force[-1] - force[50]) * (1 + 1e-9)
    # and from then on it is that of a loop that has known no other
    alone = Touch(new)
    alone.device, alone.loop.device, alone.loop.workspace = touch.device, touch.device, touch.loop.workspace
    alone.tick(1)
    np.testing.assert_array_equal(touch.wanted[-1], alone.wanted[-1])
    assert touch.loop.out.record["swaps"] == 1
    assert not touch.loop.out.record["blending"]


@pytest.mark.parametrize("order", [1, -1])
def test_a_ball_s_other_form_takes_the_place_of_the_first(order):
    """Of few solves learning may choose a depth, of more of them an overlap: either goes on in the other's hand."""
    surface = overlap_baseline().touched
    forms = [Surrogate(touch_energy(surface=surface)), Surrogate(touch_energy(baseline=overlap_baseline()))]
    old, new = forms[::order]
    touch = Touch(old)
    touch.press(0.002)
    touch.tick(100)
    touch.swap(new)
    touch.until_swapped()
    touch.tick(1)
    place = touch.loop.out.position[None]
    assert touch.wanted[-1] == pytest.approx(touchable(new).energy.force(place)[0], rel=1e-6)
    assert np.linalg.norm(touch.wanted[-1]) > 0.0


def test_what_blending_adds_is_the_difference_of_the_energies_and_is_booked():
    touch = Touch(pressed.surrogate())
    touch.tick(10)
    for depth in np.linspace(0.0, 0.004, 200):
        touch.press(depth)
        touch.tick(1)
    touch.swap(pressed.surrogate(factor=1.5))
    touch.until_swapped()
    place = touch.loop.out.position[None]
    assert touch.loop.passivity.added == pytest.approx(0.5 * pressed.energy(place)[0], rel=1e-9)
    assert touch.loop.out.record["added"] == touch.loop.passivity.added
    touch.swap(pressed.surrogate(factor=1.2))
    touch.until_swapped()
    assert touch.loop.passivity.added == pytest.approx(0.5 * pressed.energy(place)[0]), "a loss is no licence"


def test_a_body_gains_no_more_than_the_hand_gave_but_for_a_power_that_nobody_feels():
    touch = Touch(pressed.surrogate())
    touch.tick(10)
    for depth in np.linspace(0.0, 0.003, 100):
        touch.press(depth)
        touch.tick(1)
    given = touch.loop.passivity.energy
    assert given > 1e-6
    touch.swap(pressed.surrogate(factor=8.0))
    touch.tick(400)
    gained = np.array(touch.added)
    assert touch.loop.swap is not None, "it goes on slowly"
    late = np.diff(gained[gained >= given])
    assert len(late) > 100
    assert late.max() <= 1e-3 * touch.loop.period * (1 + 1e-9)
    assert late.min() > 0.0
    touch.press(-0.002)
    assert touch.until_swapped() * touch.loop.period <= 0.25, "where nothing is felt nothing holds it up"


BODIES = {
    "block": lambda factor: pressed.surrogate(factor=factor),
    "stiff block": lambda factor: pressed.surrogate(factor=50.0 * factor),
    "relaxing block": lambda factor: pressed.surrogate(factor=50.0 * factor, memory=RELAXES),
    "yielding block": lambda factor: pressed.surrogate(factor=factor, memory=YIELDS),
    "beam": lambda factor: spring_beam(200.0 * factor),
}


@pytest.mark.full
@pytest.mark.parametrize("pace", [(1000.0, 0.0), (200.0, 0.005)], ids=["1 kHz", "200 Hz, 5 ms"])
@pytest.mark.parametrize("name", list(BODIES))
def test_no_more_energy_than_sampling_leaks_and_blending_adds(name, pace):
    """Six swaps, softer and stiffer, under a hand that moves at random; the device's damping takes the rest."""
    rate, delay = pace
    body = touchable(BODIES[name](1.0))
    aim = body.stroke(body.workspace(0.075).scale)
    hand = SimulatedHand(SimulatedSettings(**aim, delay=delay, shape="random", seed=11))
    touch = Touch(BODIES[name](1.0), hand, rate=rate)
    felt, places, largest = touch.loop.bounds.felt, [], 0.0
    for factor in (1.4, 0.8, 1.6, 1.0, 1.3, 0.9):
        touch.swap(BODIES[name](factor))
        for _ in range(round(0.5 * rate)):
            touch.tick(1)
            places.append(hand.place.copy())
            felt = max(felt, touch.loop.bounds.felt)
            largest = max(largest, float(np.linalg.norm(touch.loop.out.force)))
    ledger = touch.loop.passivity
    assert largest > 0.02, "the body was felt"
    assert touch.loop.out.record["swaps"] == 6
    assert ledger.lowest >= -felt * ledger.leak - ledger.added - 1e-9
    own = 0.5 * np.square(np.linalg.norm(np.diff(places, axis=0), axis=1)).sum() / touch.loop.period
    assert hand.work <= own + ledger.added + 1e-9


@pytest.mark.full
def test_what_blending_added_is_damped_as_the_hand_gets_it_back():
    """The rival: without the controller a hand that shakes on purpose has the added energy back, and more."""

    def shaken(control):
        body = touchable(pressed.surrogate(factor=20.0))
        aim = body.stroke(body.workspace(0.075).scale)
        hand = SimulatedHand(SimulatedSettings(**aim, damping=0.05, friction=0.0, shape="adversarial"))
        touch = Touch(pressed.surrogate(factor=20.0), hand, control=control)
        touch.tick(600)
        for factor in (30.0, 20.0) * 6:
            touch.swap(pressed.surrogate(factor=factor), 0.1)
            touch.tick(150)
        return hand.work, touch.loop.passivity

    (given, wild), (kept, ledger) = shaken(False), shaken(True)
    assert ledger.added == pytest.approx(wild.added, rel=0.5)
    assert given > 2.0 * wild.added
    assert kept < 0.1 * ledger.added
    assert ledger.injected > ledger.added
    assert ledger.lowest > 0.1 * wild.lowest


SELF = {
    "forgets": (pressed.surrogate, 0.003),
    "relaxes": (lambda: pressed.surrogate(memory=RELAXES), 0.003),
    "relaxes on places": (lambda: pressed.surrogate(memory=ON_PLACES), 0.003),
    "yields": (lambda: pressed.surrogate(memory=YIELDS), 0.005),
    "stays bent": (held.yielding_rod, 0.03),
}


@pytest.mark.grid
@pytest.mark.parametrize("name", list(SELF))
def test_a_body_that_takes_its_own_place_is_felt_as_if_nothing_happened(name):
    """Also what it remembers goes on: it is pressed, swapped while pressed, let go, pressed again and let go."""
    make, depth = SELF[name]

    def answers(swaps):
        touch = Touch(make())
        for k, share in enumerate([0.0, 1.0, 1.0, 0.3, 0.0, 0.8, 0.0]):
            if k in swaps:
                touch.swap(make(), 0.1)
            start = -touch.device.sample.position[1] * touch.loop.workspace.scale
            for part in np.linspace(0.0, 1.0, 150):
                touch.press(start + part * (share * depth - start))
                touch.tick(1)
        assert touch.loop.swap is None
        return np.array(touch.wanted)

    plain = answers(())
    assert np.abs(plain).max() > 0.05
    np.testing.assert_allclose(answers((2, 5)), plain, rtol=0.0, atol=1e-9 * np.abs(plain).max())


def test_an_indentation_stays_where_it_was_pressed():
    """On other places too: each takes over from the nearest."""
    touch = Touch(pressed.surrogate(memory=YIELDS))
    for depth in [*np.linspace(0.0, 0.006, 100), *np.linspace(0.006, -0.001, 100)]:
        touch.press(depth)
        touch.tick(1)
    before = touch.loop.evaluator.indentation.copy()
    assert before.max() > 0.01
    points = PLACES[[2, 0, 0, 1, 3]] + 1e-4
    finer = Indentation(YIELDS.residual, YIELDS.reach, YIELDS.stiffening, points, 0.003)
    touch.swap(pressed.surrogate(memory=finer))
    touch.until_swapped()
    np.testing.assert_array_equal(touch.loop.evaluator.indentation, before[[2, 0, 0, 1, 3]])


def test_a_relaxing_body_takes_over_no_more_than_was_stored():
    coarse = ON_PLACES.start()
    q, slope = 0.03, np.array([0.0, 0.0, -10.0])
    for _ in range(200):
        coarse.step(np.array([0.001, 0.0, 0.008]), q, slope, 1e-3)
    many = np.concatenate([PLACES + shift for shift in ([0, 0, 0], [5e-4, 0, 0], [0, 5e-4, 0])])
    for law in (
        Relaxation(((0.4, 0.1),), patches=Patches(many, 0.003)),
        Relaxation(((0.3, 0.2), (0.1, 2.0)), patches=Patches(PLACES[:2], 0.003)),
    ):
        state = law.start()
        law.carry_from(ON_PLACES)(coarse, state)
        state.step(np.array([0.001, 0.0, 0.008]), q, slope, 0.0)
        fresh = law.start()
        fresh.step(np.array([0.001, 0.0, 0.008]), q, slope, 0.0)
        assert np.linalg.norm(state.force) < np.linalg.norm(fresh.force), "it has relaxed before"
        assert 0.0 <= state.stored <= fresh.stored


def test_a_rod_that_lies_elsewhere_is_let_go_and_taken_hold_of_in_the_midst():
    touch = Touch(held.yielding_rod())
    for depth in np.linspace(0.0, 0.04, 200):
        touch.press(depth)
        touch.tick(1)
    touch.device.sample.holding = False
    touch.tick(5)
    lies = touch.loop.evaluator.contact.copy()
    assert np.linalg.norm(lies) > 1e-3, "it stays bent"
    touch.swap(held.yielding_rod())
    touch.tick(60)
    touch.device.sample.holding = True
    touch.tick(1)
    np.testing.assert_allclose(touch.loop.wanted, 0.0, atol=1e-9)
    touch.until_swapped()
    np.testing.assert_allclose(touch.loop.evaluator.contact, lies, atol=1e-9)


def test_the_coupling_follows_the_stiffness_and_pulls_without_a_jump():
    """From a body that needs no spring to one that does: the spring comes in mid-press, with a memory too."""
    soft, stiff = (pressed.surrogate(factor=f, memory=RELAXES) for f in (2.0, 60.0))
    body = touchable(soft)
    aim = body.stroke(body.workspace(0.075).scale)
    hand = SimulatedHand(SimulatedSettings(**aim, shape="press"))
    touch = Touch(soft, hand)
    touch.tick(1500)
    assert not touch.loop.coupling.active
    touch.swap(stiff, 0.4)
    touch.until_swapped()
    assert touch.loop.coupling.active
    assert touch.loop.bounds.body == pytest.approx(touch.loop.workspace.felt(touchable(stiff).stiffness_max))
    step = np.linalg.norm(np.diff(touch.wanted[1500:], axis=0), axis=1)
    assert step.max() < 0.05, "N; the force itself is of newtons"
    assert np.linalg.norm(touch.wanted[-1]) > 0.1


def other_probe():
    body = pressed.surrogate()
    baseline = replace(body.energy.baseline, probe_radius=0.009)
    return Surrogate(replace(body.energy, baseline=baseline), meta={"name": "slab"})


def relaxing():
    return pressed.surrogate(memory=RELAXES)


REFUSED = {
    "held": (pressed.surrogate, held.pad, "the body is pressed there, and held"),
    "memory": (pressed.surrogate, relaxing, "the memory is none there, and relaxation"),
    "another memory": (lambda: pressed.surrogate(memory=YIELDS), relaxing, "the memory is indentation there"),
    "inputs": (held.pad, held.yielding_rod, "the inputs are d_x .*, and w"),
    "probe": (pressed.surrogate, other_probe, "10 mm there, and 9 mm"),
    "travels": (relaxing, lambda: pressed.surrogate(memory=ON_PLACES), "travels with the probe"),
}


@pytest.mark.parametrize("name", list(REFUSED))
def test_what_is_no_surrogate_of_the_same_body_is_refused(name):
    old, new, words = REFUSED[name]
    with pytest.raises(UsageError, match=words) as raised:
        swap_between(touchable(old()), touchable(new()))
    assert raised.value.fix


def test_elements_of_another_number_and_a_jump_are_refused():
    few = IwanElements.sliders(np.array([1.0]), np.array([np.inf]), np.zeros(1))
    rod = held.yielding_rod()
    with pytest.raises(UsageError, match="2 elements remember can't be handed on to 1"):
        swap_between(touchable(rod), touchable(rod.with_memory(few)))
    block = touchable(pressed.surrogate())
    with pytest.raises(UsageError, match=r"at least 0\.1 s"):
        swap_between(block, block, seconds=0.05)


@pytest.mark.parametrize(
    ("most", "new", "words"),
    [
        ("MAX_INPUTS", spring_beam, "inputs; the runtime carries 0"),
        (
            "MAX_PLACES",
            lambda: pressed.surrogate(memory=YIELDS),
            "4 places with an indentation; the runtime carries 0",
        ),
    ],
)
def test_a_surrogate_too_large_for_the_runtime_is_refused_by_what_is_too_large(most, new, words, monkeypatch):
    monkeypatch.setattr(f"palpate.runtime.shared_state.{most}", 0)
    with pytest.raises(UsageError, match=words) as raised:
        swap_between(touchable(new()), touchable(new()))
    assert raised.value.why
    assert raised.value.fix


@pytest.mark.full
@pytest.mark.parametrize("before", [0, 300])
@pytest.mark.parametrize("name", list(BODIES))
def test_swaps_are_replayed_to_the_last_bit(name, before, tmp_path):
    """Of three swaps in the midst of strokes; a recording that is wanted during a blend begins after it."""
    body = touchable(BODIES[name](1.0))
    aim = body.stroke(body.workspace(0.075).scale)
    ring, files = Ring.private(1000.0), {}
    hand = SimulatedHand(SimulatedSettings(**aim, shape="adversarial", delay=0.003, step=1e-5))
    touch = Touch(BODIES[name](1.0), hand, rate=500.0, recorder=TickRecorder(ring))
    ring.describe(loop_facts(body, touch.loop, LIMITS))
    touch.tick(before)
    recorder = TraceRecorder(ring, tmp_path / "a.trace", {"device": "test"})
    touch.loop.recorder.begin(touch.loop)
    recorder.start()
    for factor in (1.4, 0.8, 1.2):
        touch.tick(100)
        swap = touch.swap(BODIES[name](factor), 0.15)
        files[f"{factor}"] = touch.body
        touch.tick(1)
        facts = {"file": f"{factor}", "path": f"{factor}"}
        recorder.add_event("swap", loop_tick=swap.begun, seconds=swap.seconds, model=facts)
        touch.until_swapped()
    touch.tick(200)
    recorder.stop()
    trace = read_trace(tmp_path / "a.trace")
    assert trace.flag("blending").sum() >= 3 * 75
    replayed = Replay(trace, body, successor=lambda event: files[event["model"]["file"]]).run()
    assert replayed.identical, str(replayed)
    assert np.abs(trace.ticks["force"]).max() > 1e-3
    lost = Replay(trace, body, successor=lambda event: None).run()
    assert not lost.identical
    assert "1.4 answers from tick" in lost.causes[-3]


def test_a_recording_that_is_wanted_during_a_blend_begins_after_it(tmp_path):
    ring = Ring.private(1000.0)
    touch = Touch(pressed.surrogate(), recorder=TickRecorder(ring))
    touch.press(0.002)
    ring.describe(loop_facts(touch.body, touch.loop, LIMITS))
    swap = touch.swap(pressed.surrogate(factor=1.5))
    touch.tick(20)
    recorder = TraceRecorder(ring, tmp_path / "a.trace", {})
    touch.until_swapped()
    touch.tick(1)
    recorder.start()
    touch.tick(50)
    recorder.stop()
    trace = read_trace(tmp_path / "a.trace")
    assert trace.ticks["tick"][0] > swap.ended - 1
    assert not trace.flag("blending").any()
    assert Replay(trace, touch.body).run().identical


@pytest.mark.parametrize("name", [*BODIES, "pad", "rod"])
def test_a_body_that_is_handed_over_in_memory_answers_with_the_same_bits(name):
    body = touchable(
        {"pad": held.pad, "rod": held.yielding_rod}[name]() if name not in BODIES else BODIES[name](1.0)
    )
    other = take(hand_over(prepared(body)))
    felt = len(body.energy.baseline.directions)
    answers = [one.evaluator() for one in (body, other)]
    for x in body.trained_inputs[:20]:
        place, parameters = x[:felt] @ body.energy.baseline.directions, np.ascontiguousarray(x[felt:])
        for answer in answers:
            answer.elapsed = 1e-3
            answer(place.copy(), parameters)
        np.testing.assert_array_equal(answers[0].force, answers[1].force)
    assert (other.stiffness_max, other.name) == (body.stiffness_max, body.name)
    np.testing.assert_array_equal(other.away, body.away)
