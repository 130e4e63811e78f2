"""A pressed body that keeps prints, from its file to the loop: where the print is, the force is less."""

from __future__ import annotations

import time

import numpy as np
import pytest
from slabs import touched_slab

import pressed
from palpate.errors import FileFormatError, UsageError
from palpate.runtime import LoopProcess, now
from palpate.runtime.pressed import PressedBody
from palpate.runtime.touchable import load_touchable, workspace_for
from palpate.surrogates import TouchedBody
from palpate.surrogates.plastic import Dents
from palpate.surrogates.relaxation import Branches

SPACING, NONE = 0.002, np.zeros(0)


def above(depth, x=0.0):
    return np.array([x, 0.0, pressed.RADIUS - depth])


def amplitude(depth):
    return float(np.sqrt(2 * touched_slab().touch.energy(above(depth)[None])[0]))


@pytest.fixture(scope="module")
def dents() -> Dents:
    """Yields from 1 mm on; pressed to 4 mm, a quarter of the amplitude stays."""
    first, whole = amplitude(0.001), amplitude(0.004)
    return Dents(
        np.array([0.0, 0.25 * whole]),
        np.array([first, whole]),
        np.array([1.0, 1.1]),
        np.zeros((1, 3)),
        SPACING,
    )


@pytest.fixture
def file(dents, tmp_path):
    return touched_slab().yielding(dents, spacing=SPACING).save(tmp_path / "printed.palpate")


def test_the_file_tells_of_prints_and_where_they_can_stay(file, dents):
    body = load_touchable(file)
    assert isinstance(body, PressedBody)
    found = body.dents
    for name in ("dent", "reach", "stiffening"):
        np.testing.assert_array_equal(getattr(found, name), getattr(dents, name))
    assert found.width == SPACING
    # places on the top, some two millimetres apart
    assert (found.points[:, 2] == 0).all()
    gaps = np.linalg.norm(found.points[:, None] - found.points, axis=2) + np.eye(len(found.points))
    assert gaps.min(axis=1).min() > 0.5 * SPACING
    assert gaps.min(axis=1).max() < 1.5 * SPACING


def test_a_print_is_felt_where_it_is_and_nowhere_else(file):
    body = load_touchable(file)
    answer, elastic = body.evaluator(), touched_slab().touch
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
    kept = TouchedBody.load(touched_slab().yielding(dents).save(tmp_path / "one.palpate"))
    answer = PressedBody.of(kept).evaluator()
    answer(above(0.004), NONE)
    answer(above(0.002, x=0.015), NONE)
    assert answer.force[2] < 0.7 * touched_slab().touch.force(above(0.002, x=0.015)[None])[0, 2]


def test_a_print_must_be_as_wide_as_places_are_apart(dents):
    single = Dents.single(dents.dent, dents.reach, dents.stiffening)
    with pytest.raises(UsageError, match="do not fit places"):
        touched_slab().yielding(single, spacing=SPACING)
    told = touched_slab().yielding(single, spacing=SPACING, width=0.003)
    assert PressedBody.of(told).dents.width == 0.003


def test_one_memory_takes_the_place_of_the_other(dents):
    body = touched_slab().relaxing(Branches(((0.3, 0.1),)), spacing=0.0025)
    assert PressedBody.of(body).branches == Branches(((0.3, 0.1),))
    printed = body.yielding(dents)
    assert PressedBody.of(printed).branches is None
    assert PressedBody.of(printed).dents is not None
    assert PressedBody.of(printed.relaxing(Branches(((0.3, 0.1),)))).dents is None


@pytest.mark.parametrize(
    "wrong", [{}, "soon", {"dent": [0.0], "reach": [1.0], "stiffening": [1.0], "width": 1.0}]
)
def test_yielding_that_is_none_is_refused(wrong):
    with pytest.raises(FileFormatError, match="how the body yields"):
        PressedBody.of(pressed.surrogate(meta={"yielding": wrong})).evaluator()
    both = {"yielding": wrong, "relaxation": {"terms": [[0.3, 0.1]]}}
    with pytest.raises(FileFormatError, match="that it relaxes"):
        PressedBody.of(pressed.surrogate(meta=both)).evaluator()


def test_prints_run_in_the_real_process(file):
    with LoopProcess(file) as loop:
        space = workspace_for(load_touchable(file), loop.read().radius)
        forces = []
        for depth in (0.002, 0.004, 0.002):
            loop.shared.write_command(beat=now() + 60, grabbed=True, target=space.to_hand(above(depth)))
            time.sleep(0.4)
            forces.append(loop.read().force[2])
        assert loop.report().foreign == ()
    assert forces[2] < 0.8 * forces[0] < 0.8 * forces[1]
