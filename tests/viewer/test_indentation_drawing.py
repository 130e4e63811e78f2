"""A pressed body that keeps prints, from its file to the loop: where the print is, the force is less."""

from __future__ import annotations

import dataclasses
import time

import numpy as np
import pytest
import slabs
from slabs import touched_slab

import pressed
from palpate.errors import UsageError
from palpate.runtime import LoopProcess, now
from palpate.runtime.loop import Loop
from palpate.runtime.safety import Limits
from palpate.runtime.shared_state import MAX_PLACES, Shared
from palpate.runtime.touchable import Touchable, load_touchable, touchable
from palpate.surrogates import Surrogate
from palpate.surrogates.memories import Indentation, Relaxation
from palpate.viewer.indentation_drawing import IndentationDrawing
from palpate.viewer.messages import Frame
from palpate.viewer.page_model import PageModel

SPACING, NONE = 0.002, np.zeros(0)
DRAWN = {
    "contact",
    "normal",
    "depth",
    "stiffness",
    "deviation",
    "drawn",
    "displacement",
    "coefficients",
    "indentation",
}
LOOP = {
    f.name: (0.0, 0.0, 0.0) if f.name in {"position", "force"} else 0
    for f in dataclasses.fields(Frame)
    if f.name not in DRAWN
}


def above(depth, x=0.0):
    return np.array([x, 0.0, pressed.RADIUS - depth])


@pytest.fixture(scope="module")
def dents() -> Indentation:
    return slabs.dents(SPACING)


@pytest.fixture
def file(dents, tmp_path):
    return touched_slab().with_memory(dents, spacing=SPACING).save(tmp_path / "printed.palpate")


def test_the_file_tells_of_prints_and_where_they_can_stay(file, dents):
    body = load_touchable(file)
    assert isinstance(body, Touchable)
    found = body.memory
    for name in ("residual", "reach", "stiffening"):
        np.testing.assert_array_equal(getattr(found, name), getattr(dents, name))
    assert found.width == SPACING
    # places on the top, some two millimetres apart
    assert (found.points[:, 2] == 0).all()
    gaps = np.linalg.norm(found.points[:, None] - found.points, axis=2) + np.eye(len(found.points))
    assert gaps.min(axis=1).min() > 0.5 * SPACING
    assert gaps.min(axis=1).max() < 1.5 * SPACING


def test_a_print_is_felt_where_it_is_and_nowhere_else(file):
    body = load_touchable(file)
    answer, elastic = body.evaluator(), touched_slab().energy
    answer(above(0.002, x=0.015), NONE)
    untouched = answer.force.copy()
    answer(body.away, NONE)
    answer(above(0.004), NONE)
    assert 0.5 < answer.force[2] / elastic.force(above(0.004)[None])[0, 2] < 0.85
    answer(body.away, NONE)
    assert not answer.force.any()
    answer(above(0.002), NONE)
    assert answer.force[2] < 0.7 * elastic.force(above(0.002)[None])[0, 2]
    answer(body.away, NONE)
    answer(above(0.002, x=0.015), NONE)
    np.testing.assert_allclose(answer.force, untouched, rtol=1e-3)


def test_without_spacing_the_print_travels(dents, tmp_path):
    kept = Surrogate.load(touched_slab().with_memory(dents).save(tmp_path / "one.palpate"))
    answer = touchable(kept).evaluator()
    answer(above(0.004), NONE)
    answer(above(0.002, x=0.015), NONE)
    assert answer.force[2] < 0.7 * touched_slab().energy.force(above(0.002, x=0.015)[None])[0, 2]


def test_a_print_must_be_as_wide_as_places_are_apart(dents):
    single = Indentation.single(dents.residual, dents.reach, dents.stiffening)
    with pytest.raises(UsageError, match="do not fit places"):
        touched_slab().with_memory(single, spacing=SPACING)
    body = touched_slab().with_memory(dataclasses.replace(single, width=0.003), spacing=SPACING)
    assert touchable(body).memory.width == 0.003


def test_one_memory_takes_the_place_of_the_other(dents):
    body = touched_slab().with_memory(Relaxation(((0.3, 0.1),)), spacing=0.0025)
    assert touchable(body).memory.terms == ((0.3, 0.1),)
    assert len(touchable(body).memory.patches) > 10
    assert "relaxes by 0.3 in 0.1 s" in str(body)
    printed = body.with_memory(dents)
    assert "relaxes" not in str(printed)
    assert "yields from" in str(printed)
    assert touchable(printed).indentation is printed.memory
    assert touchable(body).indentation is None
    assert touchable(printed.with_memory(None)).memory is None


def test_a_body_without_a_drawn_surface_has_no_places_for_a_memory(dents):
    with pytest.raises(UsageError, match="no drawn surface"):
        pressed.surrogate().with_memory(dents, spacing=SPACING)


@pytest.fixture
def printed(file):
    """A body pressed to 4 mm in its middle and left alone, its evaluator, and points along a line of its top."""
    body = load_touchable(file)
    answer = body.evaluator()
    answer(above(0.004), NONE)
    line = np.stack([np.linspace(-0.02, 0.02, 41), np.zeros(41), np.zeros(41)], axis=1)
    return body, answer, line


def test_a_print_is_drawn_as_deep_as_a_ball_rests_on_it(printed):
    body, answer, line = printed
    prints = IndentationDrawing(body, line)
    met = body.indentation.shares(line) @ answer.indentation
    # U = A s³ exp(b x), so √(2U) = p at s = (p²/2A)^⅓ exp(−b x/3)
    rests = np.cbrt(met**2 / (2 * pressed.A)) * np.exp(-pressed.B * line[:, 0] / 3)
    np.testing.assert_allclose(prints.depths(answer.indentation), rests, atol=1e-5)
    assert prints.under(line[20], np.array([0.0, 0.0, 1.0]), answer.indentation) == pytest.approx(
        rests[20], abs=1e-5
    )
    # half a millimetre and more in the middle, next to nothing a centimetre off
    assert rests[20] > 5e-4
    assert prints.depths(answer.indentation)[[10, 30]].max() < 0.03 * rests[20]
    # and the loop agrees that there is no force down to there
    kept = answer.indentation.copy()
    answer(above(rests[20] - 1e-6), NONE)
    assert not answer.force.any()
    answer(above(rests[20] + 1e-5), NONE)
    assert answer.force[2] > 0
    np.testing.assert_array_equal(answer.indentation, kept)


def test_a_virgin_body_draws_no_print(file):
    body = load_touchable(file)
    prints = IndentationDrawing(body, np.zeros((1, 3)))
    assert len(prints.depths(np.zeros(0))) == 0
    assert prints.under(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.zeros(0)) == 0.0
    assert not prints.depths(np.zeros(len(body.indentation.points))).any()


def test_all_points_of_the_top_may_keep_a_print_and_no_others(file, dents, tmp_path):
    model = PageModel(load_touchable(file))
    own, rest = model.surface.yielding.astype(int), np.reshape(model.surface.rest, (-1, 3))
    # those of the sides' upper rims too: they stand at the top's own border
    assert set(own) == set(np.flatnonzero(rest[:, 2] > -1e-9))
    normals = np.reshape(model.surface.normals, (-1, 3))
    np.testing.assert_allclose(normals, np.tile([0.0, 0.0, 1.0], (len(own), 1)), atol=1e-9)
    assert (
        model.hello(Shared.private().read_state(), 1e3).remembers
        == "pressed deeper than 1 mm it keeps an indentation"
    )
    travelling = touched_slab().with_memory(dents).save(tmp_path / "one.palpate")
    assert len(PageModel(load_touchable(travelling)).surface.yielding) == 0


@pytest.mark.full
def test_print_and_elastic_shape_together_touch_the_ball(file):
    body = load_touchable(file)
    model, elastic = PageModel(body), PageModel(touchable(touched_slab()))
    with LoopProcess(file) as loop:
        space = body.workspace(loop.read().radius)

        def picture(depth, held=True):
            target = space.to_hand(above(depth))
            loop.shared.write_command(beat=now() + 60, grabbed=held, target=target)
            time.sleep(0.4)
            state = loop.read()
            return model.frame(LOOP, state, held, NONE), elastic.frame(LOOP, state, held, NONE)

        first, alone = picture(0.0005)
        assert len(first.indentation) == 0, "nothing has yielded yet"
        np.testing.assert_array_equal(first.coefficients, alone.coefficients)
        deep, alone = picture(0.004)
        middle = np.argmin(np.linalg.norm(_printable(model), axis=1))
        kept = deep.indentation[middle]
        assert kept == deep.indentation.max() > 5e-4
        np.testing.assert_allclose(
            deep.coefficients, (1 - kept / 0.004) * alone.coefficients, rtol=1e-3, atol=1e-9
        )
        light, _ = picture(0.5 * kept)
        assert not light.coefficients.any(), "the ball is in the print and does not touch it"
        np.testing.assert_array_equal(light.indentation, deep.indentation)
        gone, _ = picture(0.004, held=False)
        time.sleep(0.5)
        gone, _ = picture(0.004, held=False)
        assert not gone.coefficients.any()
        np.testing.assert_array_equal(gone.indentation, deep.indentation)


def _printable(model):
    return np.reshape(model.surface.rest, (-1, 3))[model.surface.yielding.astype(int)]


def test_more_places_than_the_shared_memory_carries_are_refused(dents):
    body = touchable(touched_slab().with_memory(dents, spacing=0.0007))
    assert len(body.memory.points) > MAX_PLACES
    with pytest.raises(UsageError, match=f"carries {MAX_PLACES}"):
        Loop(body, object(), Shared.private(), body.workspace(0.06), Limits(8.0))


@pytest.mark.full
def test_prints_run_in_the_real_process(file):
    with LoopProcess(file) as loop:
        space = load_touchable(file).workspace(loop.read().radius)
        forces = []
        for depth in (0.002, 0.004, 0.002):
            loop.shared.write_command(beat=now() + 60, grabbed=True, target=space.to_hand(above(depth)))
            time.sleep(0.4)
            forces.append(loop.read().force[2])
        assert loop.report().foreign == ()
    assert forces[2] < 0.8 * forces[0] < 0.8 * forces[1]
