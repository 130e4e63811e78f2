"""One evaluator for every body: nothing is allocated, and what is held by a pad is felt, let go and held in place."""

from __future__ import annotations

import numpy as np
import pytest

import pressed
from allocated import kept_by
from bent import CREEPS, body
from held import INPUTS, PAD_SPRING, ROD_SPRING, SLIP, pad, pad_force, yielding_rod
from models import spring_beam
from palpate.runtime import LoopProcess
from palpate.runtime.touchable import load_touchable, touchable
from palpate.surrogates.memories import Relaxation
from waiting import press, wait_for

PLACE = np.array([0.005, -0.01])  # m

BODIES = {
    "beam": spring_beam,
    "rod": body,
    "creeping rod": lambda: body(CREEPS),
    "probe": pressed.surrogate,
    "relaxing": lambda: pressed.surrogate(memory=Relaxation(((0.3, 0.05),))),
    "pad": pad,
    "yielding rod": yielding_rod,
}


@pytest.mark.grid
@pytest.mark.parametrize("make", BODIES.values(), ids=BODIES)
def test_a_tick_allocates_nothing(make):
    model = touchable(make())
    answer, parameters = model.evaluator(), np.array([(r.low + r.high) / 2 for r in model.parameters])
    place, start = np.zeros(3), model.home - 0.1 * model.deepest * model.normal
    answer.elapsed = 1e-3

    def tick() -> None:
        place[:] = start
        answer.place(place, holding=True, believed=True)
        answer(place, parameters)
        answer.place(place, holding=False, believed=True)
        answer(place, parameters)

    tick()
    assert kept_by(tick, 200) < 200


def test_a_pad_is_felt_as_its_energy_says():
    model = touchable(pad())
    assert model.holds
    assert not model.home.any()
    answer, d = model.evaluator(), np.array([0.004, -0.002, 0.006])
    position = d.copy()
    answer.place(position, holding=True, believed=True)
    answer(position, PLACE)
    np.testing.assert_allclose(answer.force, pad_force(d, PLACE[0]), rtol=1e-12)
    assert answer.depth == pytest.approx(np.linalg.norm(d))
    assert answer.inside
    n = answer.force / np.linalg.norm(answer.force)
    assert answer.stiffness == pytest.approx(np.exp(-10 * PLACE[0]) * n @ PAD_SPRING @ n)
    assert model.stiffness_max == pytest.approx(np.exp(0.2) * 110)  # at the end of the places


def test_a_pad_that_nobody_holds_is_at_rest():
    answer, position = touchable(pad()).evaluator(), np.full(3, 0.005)
    answer.place(position, holding=False, believed=True)
    answer(position, PLACE)
    assert not answer.force.any()
    assert not answer.contact.any()


def test_a_held_pad_stays_where_it_has_taken_hold():
    """To move its place would change the energy by no work of the hand."""
    answer, d = touchable(pad()).evaluator(), np.array([0.004, 0.0, 0.0])

    def felt(holding: bool, p_x: float) -> np.ndarray:
        position = d.copy()
        answer.place(position, holding=holding, believed=True)
        answer(position, np.array([p_x, 0.0]))
        return answer.force.copy()

    first = felt(True, 0.005)
    np.testing.assert_array_equal(felt(True, -0.015), first)
    assert not felt(False, -0.015).any()
    np.testing.assert_allclose(felt(True, -0.015), pad_force(d, -0.015), rtol=1e-12)


def test_a_rod_that_yields_lies_where_nothing_pulls_and_is_taken_hold_of_there():
    """Drawn to q₀ beyond the slip y and let go, its two springs balance at q = (q₀ − y)/2."""
    model = touchable(yielding_rod())
    assert not model.upright
    answer, none = model.evaluator(), np.zeros(0)
    answer.elapsed, far = 1e-3, 0.03
    down = np.array([0.0, -1.0, 0.0])

    def move(w: float | None) -> None:
        position = np.zeros(3) if w is None else np.array([0.02, 0.0, 0.0]) + w * down
        answer.place(position, holding=w is not None, believed=True)
        answer(position, none)

    for w in np.linspace(0.0, far, 31):
        move(w)
    root = np.sqrt(ROD_SPRING)
    np.testing.assert_allclose(answer.force, -0.5 * root * (root * far + SLIP) * down, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(answer.contact, far * down, atol=1e-12)
    move(None)
    assert not answer.force.any()
    lies = (root * far - SLIP) / 2 / root
    np.testing.assert_allclose(answer.contact, lies * down, atol=1e-9)
    move(-0.01)  # from elsewhere: no jump, and then a node that moves as the hand does
    np.testing.assert_allclose(answer.contact, lies * down, atol=1e-9)
    np.testing.assert_allclose(answer.force, 0.0, atol=1e-9)
    move(-0.008)
    np.testing.assert_allclose(answer.contact, (lies + 0.002) * down, atol=1e-9)
    np.testing.assert_allclose(answer.force, -ROD_SPRING * 0.002 * down, rtol=1e-6, atol=1e-9)


@pytest.mark.full
def test_a_pad_in_the_real_process(tmp_path):
    path = pad().save(tmp_path / "pad.palpate")
    model, d = load_touchable(path), np.array([0.003, -0.004, 0.002])
    assert (model.name, model.parameters) == ("pad", INPUTS[3:])
    with LoopProcess(path, parameters=PLACE) as loop:
        target = model.workspace(loop.read().radius).to_hand(d)
        felt = pad_force(d, PLACE[0])
        press(loop, target, lambda state: np.allclose(state.force, felt, rtol=1e-9) and state.inside)
        loop.shared.write_command(grabbed=False)
        wait_for(lambda: not loop.read().force.any())
    assert loop.report().foreign == ()
    assert set(loop.report().faults) <= {"clock_jump"}, "a busy machine's"
