"""A body pressed anywhere, in the loop and in its real process; the body is a closed form (`tests/pressed.py`)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from test_process import watch

import pressed as slab
from palpate.errors import FileFormatError, UsageError
from palpate.runtime import LoopProcess, now
from palpate.runtime.pressed import PressedBody
from palpate.runtime.touchable import load_touchable, touchable, workspace_for
from palpate.runtime.workspace import Workspace
from palpate.surrogates import TouchedBody
from palpate.surrogates.relaxation import Branches

TERMS = ((0.3, 0.05), (0.2, 0.4))
RELAXING = {"name": "slab", "relaxation": {"terms": [list(t) for t in TERMS]}}


@pytest.fixture(scope="module")
def body() -> PressedBody:
    return PressedBody.of(slab.surrogate())


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pressed")
    elastic, relaxing = slab.surrogate(), slab.surrogate(meta=RELAXING)
    return {
        "alone": elastic.save(folder / "alone.palpate"),
        "body": TouchedBody(elastic).save(folder / "body.palpate"),
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
    assert body.touch.depth(body.away[None])[0] < -0.9 * slab.RADIUS  # the distance is true to 1.1 radii only
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
    space = workspace_for(body, 0.075)
    told = body.stroke(space.scale)
    place = np.empty(3)
    space.to_body(told["amplitude"] * np.array([told[k] for k in "xyz"]), place)
    assert body.touch.depth(place[None])[0] == pytest.approx(0.75 * slab.DEEPEST, rel=1e-6)


def test_a_held_probe_relaxes_by_the_prony_series():
    answer = PressedBody.of(slab.surrogate(meta=RELAXING)).evaluator()
    place, none = np.array([0.005, 0.0, slab.RADIUS - 0.004]), np.zeros(0)
    answer(place, none)
    first = answer.force.copy()
    np.testing.assert_allclose(first, slab.surrogate().force(place[None])[0], rtol=1e-12)
    for _ in range(300):
        answer.elapsed = 1e-3
        answer(place, none)
    np.testing.assert_allclose(answer.force, first * Branches(TERMS).relaxation(0.3), rtol=1e-9)
    answer.elapsed = 1e-3
    answer(answer.away, none)
    assert not answer.force.any(), "tissue doesn't stick"


@pytest.mark.parametrize("wrong", [{"terms": [[0.3]]}, {"terms": [[0.7, 1.0], [0.4, 2.0]]}, {}, "soon"])
def test_a_relaxation_that_is_none_is_refused(wrong):
    with pytest.raises(FileFormatError, match="how the body relaxes"):
        PressedBody.of(slab.surrogate(meta={"relaxation": wrong})).evaluator()


def test_kinds_of_files_are_told_apart(files, spring_file, tmp_path):
    assert isinstance(load_touchable(files["alone"]), PressedBody)
    assert load_touchable(files["body"]).name == "slab"
    assert not isinstance(load_touchable(spring_file), PressedBody)
    assert touchable(slab.surrogate(meta={}), "plate").name == "plate"
    with pytest.raises(FileFormatError):
        load_touchable(tmp_path / "nothing.palpate")


def test_a_body_that_nothing_touches_is_refused():
    beside = slab.surrogate(continuation=None, region=None)
    object.__setattr__(beside, "radius", 1e-9)
    with pytest.raises(UsageError, match="can't be pressed"):
        PressedBody.of(beside).presses  # noqa: B018 a property that may fail


@pytest.mark.parametrize("kind", ["alone", "body"])
def test_a_stroke_in_the_real_process_feels_the_closed_form(files, kind):
    with LoopProcess(files[kind], device="stroke:frequency=2,amplitude=0.01") as loop:
        states = watch(loop, 1.0)
    touch = slab.surrogate()
    whole = [s for s in states if s.tick > 100 and s.fault == 0 and s.faults == 0]
    assert len(whole) > 50
    X = np.array([s.position for s in whole])
    np.testing.assert_allclose([s.force for s in whole], touch.force(X), atol=1e-9)
    np.testing.assert_allclose([s.depth for s in whole], touch.depth(X), atol=1e-12)
    pressed = np.array([s.depth for s in whole]) > 0
    assert pressed.any()
    assert not pressed.all(), "half of a sine is in the air"
    assert not any(s.force.any() for s in whole if s.depth < 0)
    report = loop.report()
    assert report.foreign == ()
    assert report.work_p50 < 150e-6


def test_the_flag_tells_inside_from_outside(files):
    with LoopProcess(files["alone"]) as loop:
        shared, home = loop.shared, slab.RADIUS
        space = workspace_for(load_touchable(files["alone"]), loop.read().radius)
        for depth, inside in ((0.004, True), (0.009, False)):
            target = space.to_hand(np.array([0.0, 0.0, home - depth]))
            shared.write_command(beat=now() + 60, grabbed=True, target=target)
            state = watch(loop, 0.4)[-1]
            assert state.depth == pytest.approx(depth, abs=1e-6)
            assert state.inside is inside
        shared.write_command(grabbed=False)
        state = watch(loop, 0.1)[-1]
        assert not state.force.any()
        assert state.depth < 0


def test_memory_runs_in_the_real_process(files):
    with LoopProcess(files["relaxing"]) as loop:
        model = load_touchable(files["relaxing"])
        target = workspace_for(model, loop.read().radius).to_hand(np.array([0.0, 0.0, slab.RADIUS - 0.004]))
        loop.shared.write_command(beat=now() + 60, grabbed=True, target=target)
        states = watch(loop, 1.5)
    last = states[-1]
    elastic = np.linalg.norm(model.touch.force(last.position[None])[0])
    # all but exp(-1.4/0.4) of the slower branch has gone, whatever the ticks in between
    assert 0.5 < np.linalg.norm(last.force) / elastic < 0.5 + 0.2 * math.exp(-1.3 / 0.4)
    assert loop.report().foreign == ()
