"""A body pressed anywhere, in the loop and in its real process; the body is a closed form (`tests/pressed.py`)."""

from __future__ import annotations

import math

import numpy as np
import pytest

import pressed as slab
from models import linear_network
from palpate.errors import FileFormatError, UsageError
from palpate.runtime import LoopProcess
from palpate.runtime.touchable import Touchable, load_touchable, touchable
from palpate.runtime.workspace import Workspace
from palpate.surrogates import ContactBaseline, ContactLaw, LearntEnergy, Surrogate, TouchedSurface
from palpate.surrogates.memories import Relaxation
from palpate.units import Quantity, Range
from waiting import press, settled, wait_for, watch, watch_for

TERMS = ((0.3, 0.05), (0.2, 0.4))


@pytest.fixture(scope="module")
def body() -> Touchable:
    return touchable(slab.surrogate())


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pressed")
    elastic, relaxing = slab.surrogate(), slab.surrogate(memory=Relaxation(TERMS))
    return {
        "alone": elastic.save(folder / "alone.palpate"),
        "relaxing": relaxing.save(folder / "relaxing.palpate"),
    }


def hessian(s: float, x: float) -> np.ndarray:
    """∂²U/∂c² of U = A s³ exp(b x), s = R − z."""
    b, grown = slab.B, slab.A * math.exp(slab.B * x)
    mixed = -3 * s**2 * b
    return grown * np.array([[b * b * s**3, 0, mixed], [0, 0, 0], [mixed, 0, 6 * s]])


def test_the_stiffness_that_stability_asks_for(body):
    largest = np.linalg.eigvalsh(hessian(slab.DEEPEST, 0.02)).max()
    assert 0.95 * largest < body.stiffness_max <= largest * (1 + 1e-9)


def test_home_is_first_contact_and_away_is_none(body):
    np.testing.assert_allclose(body.home, [0.0, 0.0, slab.RADIUS], atol=1e-6)
    np.testing.assert_allclose(body.normal, [0.0, 0.0, 1.0], atol=1e-6)
    assert (
        body.energy.depth(body.away[None])[0] < -0.9 * slab.RADIUS
    )  # the distance is true to 1.1 radii only
    assert body.deepest == slab.DEEPEST


def test_an_upright_body_turns_places_and_forces_alike():
    space = Workspace.for_reach(0.075, 0.03, centre=(0.1, -0.2, 0.3), upright=True)
    hand, place, sent = np.array([0.01, 0.02, 0.03]), np.empty(3), np.empty(3)
    space.to_body(hand, place)
    np.testing.assert_allclose((place - space.centre) / space.scale, [0.01, -0.03, 0.02])
    np.testing.assert_allclose(space.to_hand(place), hand)
    force = np.array([1.0, 2.0, 3.0])
    space.force_on_hand(force, sent)
    moved = place + 1e-3 * force
    # the same work on either side
    assert sent @ (space.to_hand(moved) - hand) * space.scale == pytest.approx(1e-3 * force @ force)


def test_the_scripted_stroke_presses_to_three_quarters(body):
    space = body.workspace(0.075)
    told = body.stroke(space.scale)
    place = np.empty(3)
    space.to_body(told["amplitude"] * np.array([told[k] for k in "xyz"]), place)
    assert body.energy.depth(place[None])[0] == pytest.approx(0.75 * slab.DEEPEST, rel=1e-6)


def test_a_held_probe_relaxes_by_the_prony_series():
    answer = touchable(slab.surrogate(memory=Relaxation(TERMS))).evaluator()
    place, none = np.array([0.005, 0.0, slab.RADIUS - 0.004]), np.zeros(0)
    answer(place, none)
    first = answer.force.copy()
    np.testing.assert_allclose(first, slab.surrogate().energy.force(place[None])[0], rtol=1e-12)
    for _ in range(300):
        answer.elapsed = 1e-3
        answer(place, none)
    np.testing.assert_allclose(answer.force, first * Relaxation(TERMS).relaxation(0.3), rtol=1e-9)
    answer.elapsed = 1e-3
    answer(answer.away, none)
    assert not answer.force.any(), "tissue doesn't stick"


def test_a_probe_pushed_through_the_body_is_let_go_and_never_pulled_in(body):
    """Down through the face, beyond where the distance ends and turns back, and up again the same way."""
    answer, none, touch = body.evaluator(), np.zeros(0), body.energy
    end = slab.RADIUS + touch.baseline.inner  # depth at which the centre is `inner` beneath the face
    down = np.arange(-0.002, end + 4 * slab.RADIUS, 2e-4)
    there = np.column_stack([0 * down + 0.005, 0 * down, slab.RADIUS - down])
    assert touch.force(there)[:, 2].min() < -1.0, "the energy alone would pull"
    forces, depths, flags = [], [], []
    for x in (*there, *there[::-1]):
        answer(x, none)
        forces.append(answer.force.copy())
        depths.append(answer.depth)
        flags.append(answer.inside)
    forces, once = np.array(forces), len(there)
    held, gone = (down > 0) & (down < end - 1e-4), down > end + 1e-4
    np.testing.assert_allclose(forces[:once][held], touch.force(there[held]), atol=1e-12)
    assert not forces[:once][gone].any()
    assert depths[np.argmax(gone)] == 0.0
    assert not flags[np.argmax(gone)]
    back = forces[once:][::-1]  # by depth
    assert not back[down > 0].any(), "let go, and not held again where d turns back behind the body"
    moved = np.diff(np.vstack([there, there[::-1]]), axis=0)
    assert ((forces[1:] * moved).sum(axis=1) <= 1e-12).all(), "the hand works on the body all the way"


def test_from_behind_nothing_is_felt_before_the_probe_was_in_front(body):
    answer, none = body.evaluator(), np.zeros(0)
    heights = np.arange(-0.06, slab.RADIUS + 0.001, 2e-4)
    for x in np.column_stack([0 * heights, 0 * heights, heights]):
        answer(x, none)
        assert not answer.force.any()
    answer(np.array([0.0, 0.0, slab.RADIUS - 0.003]), none)
    assert answer.force[2] > 0


def test_beside_the_body_beneath_its_rim_the_energy_goes_on(body):
    """There too d climbs faster than a distance, but outwards: a hand that slips off and back goes on feeling it."""
    steps = np.linspace(0.0, 0.01, 21)
    beside = np.array([[slab.CORNERS[0].max() + a, 0.0, -b] for a in steps for b in steps])
    d, slope, _ = body.surface.at(beside)
    steep = (np.linalg.norm(slope, axis=1) > 1.3) & (slope[:, 2] > 0) & (np.abs(d) < slab.RADIUS / 2)
    assert steep.any()
    answer = body.evaluator()
    for x in beside[steep]:
        answer(x, np.zeros(0))
        assert answer.force.any()
        assert not answer.let_go


def test_a_probe_that_was_let_go_is_held_again_after_air(body):
    answer, none = body.evaluator(), np.zeros(0)

    def at(depth):
        answer(np.array([0.0, 0.0, slab.RADIUS - depth]), none)
        return float(answer.force[2])

    deep, shallow = slab.RADIUS + body.surface.inner + 1e-4, 0.003
    pressed = at(shallow)
    assert pressed > 0
    assert at(deep) == 0.0
    assert at(shallow) == 0.0
    assert (answer.stiffness, answer.depth, answer.inside) == (0.0, 0.0, False)
    assert answer.let_go
    at(-1e-4)
    assert at(shallow) == pressed
    at(deep)
    place = np.array([0.0, 0.0, slab.RADIUS - shallow])
    answer.place(place, holding=False, believed=True)
    answer(place, none)
    assert at(shallow) == pressed, "nor is it after nobody held it"


def test_a_memory_lets_go_too_and_recovers_meanwhile():
    body, none = touchable(slab.surrogate(memory=Relaxation(TERMS))), np.zeros(0)
    answer, fresh = body.evaluator(), body.evaluator()
    for depth in np.arange(0.0, 0.028, 1e-3):
        answer.elapsed = 0.1
        answer(np.array([0.0, 0.0, slab.RADIUS - depth]), none)
    assert answer.let_go
    assert not answer.force.any()
    for _ in range(100):
        answer(answer.contact, none)
    answer.elapsed = fresh.elapsed = 1e-3
    for place in (answer.away, np.array([0.0, 0.0, slab.RADIUS - 0.004])):
        answer(place, none)
        fresh(place, none)
    np.testing.assert_allclose(answer.force, fresh.force, rtol=1e-6)


def test_of_a_larger_probe_the_centre_goes_as_deep():
    radius = Range("probe.radius", 0.008, 0.012, "m")
    tail = np.array([[np.log(slab.A), 0.0, 0.0, 0.0, 0.0]])
    network = linear_network([*slab.INPUTS, radius], [Quantity("ln U/U0")], tail)
    surface = TouchedSurface.of(*slab.CORNERS, radius=0.012, spacing=0.003)
    energy = LearntEnergy(network, ContactBaseline(ContactLaw("pad"), surface, radius_at=3))
    answer = touchable(Surrogate(energy)).evaluator()
    for own in (0.008, 0.012):
        for beneath, gone in ((-1e-4, False), (1e-4, True)):
            answer(np.array([0.0, 0.0, 0.03]), np.array([own]))
            answer(np.array([0.0, 0.0, -surface.inner - beneath]), np.array([own]))
            assert answer.let_go is gone


def test_kinds_of_files_are_told_apart(files, spring_file, tmp_path):
    assert not load_touchable(files["alone"]).holds
    assert load_touchable(files["alone"]).name == "slab"
    assert load_touchable(spring_file).holds
    assert touchable(slab.surrogate(meta={"name": ""}), "plate").name == "plate"
    with pytest.raises(FileFormatError):
        load_touchable(tmp_path / "nothing.palpate")


def test_a_body_that_nothing_touches_is_refused():
    beside = slab.surrogate()
    object.__setattr__(beside.energy.baseline, "probe_radius", 1e-9)
    with pytest.raises(UsageError, match="can't be touched"):
        touchable(beside).trained_inputs  # noqa: B018 a property that may fail


@pytest.mark.full
def test_a_stroke_in_the_real_process_feels_the_closed_form(files):
    with LoopProcess(files["alone"], device="stroke:frequency=2,amplitude=0.01") as loop:
        states = watch(
            loop,
            lambda seen: len(settled(seen)) > 50 and {s.depth > 0 for s in settled(seen)} == {True, False},
        )
    touch, whole = slab.surrogate().energy, settled(states)
    X = np.array([s.position for s in whole])
    np.testing.assert_allclose([s.force for s in whole], touch.force(X), atol=1e-9)
    np.testing.assert_allclose([s.depth for s in whole], touch.depth(X), atol=1e-12)
    assert not any(s.force.any() for s in whole if s.depth < 0)
    assert loop.report().foreign == ()


@pytest.mark.full
def test_the_flag_tells_inside_from_outside(files):
    with LoopProcess(files["alone"]) as loop:
        shared, home = loop.shared, slab.RADIUS
        space = load_touchable(files["alone"]).workspace(loop.read().radius)
        for depth, inside in ((0.004, True), (0.009, False)):
            target = space.to_hand(np.array([0.0, 0.0, home - depth]))
            press(loop, target, lambda state, depth=depth: abs(state.depth - depth) < 1e-6)
            assert loop.read().inside is inside
        shared.write_command(grabbed=False)
        wait_for(lambda: loop.read().depth < 0)
        assert not loop.read().force.any()


@pytest.mark.full
def test_memory_runs_in_the_real_process(files):
    with LoopProcess(files["relaxing"]) as loop:
        model = load_touchable(files["relaxing"])
        target = model.workspace(loop.read().radius).to_hand(np.array([0.0, 0.0, slab.RADIUS - 0.004]))
        press(loop, target, lambda state: state.force.any())
        last = watch_for(loop, 1.4)[-1]
    elastic = np.linalg.norm(model.energy.force(last.position[None])[0])
    # all but exp(-1.4/0.4) of the slower branch has gone, whatever the ticks in between
    assert 0.5 < np.linalg.norm(last.force) / elastic < 0.5 + 0.2 * math.exp(-1.3 / 0.4)
    assert loop.report().foreign == ()
