"""A touched body whose energy is known: no fault, no error; each fault fails its own limits and no other."""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest

from palpate.errors import AccuracyError, UsageError
from palpate.network import TrainedRegion
from palpate.units import bounds
from palpate.validation import TouchFunction, TouchSolves, Validation, validate
from palpate.validation.figures.loop_work import work_of_polygons
from palpate.validation.figures.smoothness import STEP
from palpate.validation.limits import FAINT_JND, FORCE_JND, Limits
from palpate.validation.unseen_solves import force_jnd
from palpate.validation.verdict import verdict
from pressed import (
    DEEPEST,
    INPUTS,
    RADIUS,
    A,
    B,
    dataset,
    force,
    places,
    solves,
    steady,
    stiffness,
    surrogate,
)


def missed(v: Validation) -> set[str]:
    return {c.criterion.key for c in v.failures}


def function(change=None, **more) -> TouchFunction:  # type: ignore[no-untyped-def]
    """The closed form with something added to its force."""
    felt = force if change is None else lambda X: force(X) + change(X)
    return TouchFunction("slab", INPUTS, felt, stiffness=stiffness, depth=lambda X: RADIUS - X[:, 2], **more)


@pytest.mark.full
def test_the_exact_surrogate_has_no_error() -> None:
    v = validate(surrogate(), solves())
    assert v.passed
    assert {c.grade for c in v.checks} == {"good"}
    assert v.force.max is not None
    assert v.force.max < 1e-12
    assert v.energy.p95 < 1e-12
    assert v.stiffness is not None
    assert v.stiffness.p95 < 1e-11
    for work in (v.loops, v.border_loops):
        assert work is not None
        assert work.loops == 100
        assert work.max < 1e-9
        assert work.energy > 0
    v.raise_if_failed()


@pytest.mark.full
def test_too_few_solves_are_cautioned_of_wherever_they_are_read() -> None:
    few, enough = (validate(surrogate(), solves(places(n))) for n in (5, 20))
    assert "5 unseen solves can't judge much" in few.caution
    assert few.caution in str(few)
    assert few.as_dict()["caution"] == few.summary()["caution"] == few.caution
    assert enough.caution == enough.as_dict()["caution"] == ""
    assert "caution" not in enough.summary()
    assert "Caution" not in str(enough)


@pytest.mark.full
def test_a_force_too_large_by_a_tenth_fails_the_lines_of_its_size_alone() -> None:
    """U, F and K are all 1.1 of the truth: 10 % misses the limits of the force and keeps that of the stiffness."""
    v = validate(surrogate(factor=1.1), solves())
    assert missed(v) == {"force_median", "force_p95", "light_force_p95"}
    for value in (v.force.median, v.force.p95, v.force.max, v.energy.p95, v.stiffness and v.stiffness.p95):
        assert value == pytest.approx(0.1, rel=1e-9)
    assert v.force.direction_p95 == pytest.approx(0.0, abs=1e-9)
    assert v.force.max_jnd == pytest.approx(0.1 / FORCE_JND)
    with pytest.raises(AccuracyError) as caught:
        v.raise_if_failed()
    assert caught.value.exit_code == 1
    assert caught.value.what == "slab misses 3 of 8 limits on 200 solves that it has never seen."
    assert "Force error, median: 10 % measured, 3.5 % asked. The worst case is at c_x = " in caught.value.why
    assert "palpate.learn" in caught.value.fix


def test_a_force_that_is_no_gradient_fails_the_closed_paths_alone() -> None:
    """A twist of 1.5 % about the vertical: too weak to be felt, strong enough to draw energy from."""
    v = validate(
        function(lambda X: 0.75 * np.stack([-X[:, 1], X[:, 0], 0 * X[:, 0]], axis=1) * _touch(X)), solves()
    )
    assert missed(v) == {"loop_work", "border_loop_work"}
    assert "not the gradient of an energy" in v.failures[0].criterion.fix


def _touch(X: np.ndarray) -> np.ndarray:
    """Grows with the force, so that the share of the twist does not depend on the depth."""
    return (np.maximum(RADIUS - X[:, 2], 0.0)[:, None] / DEEPEST) ** 2


def test_a_force_faded_outside_fails_across_the_border_alone() -> None:
    low, high = bounds(INPUTS)
    far = lambda X: np.maximum(np.maximum(low - X, X - high), 0.0).max(axis=1)  # noqa: E731
    v = validate(function(lambda X: force(X) * (np.exp(-far(X)[:, None] / 0.003) - 1)), solves())
    assert missed(v) == {"border_loop_work"}
    assert v.loops is not None
    assert v.loops.max < 1e-9


def test_a_stiffness_of_another_body_fails_its_line_alone() -> None:
    v = validate(dataclasses.replace(function(), stiffness=lambda X: 1.2 * stiffness(X)), solves())
    assert missed(v) == {"stiffness_p95"}
    assert v.stiffness is not None
    assert v.stiffness.p95 == pytest.approx(0.2)


def test_a_ripple_finer_than_a_millimetre_fails_the_smoothness_alone() -> None:
    """Of 0.3 mN and 0.5 mm: the spline through every second wave does not see it, the hand at 1 kHz does.

    Along x the body's own force bends by B² F h² < 5 µN; a wave of amplitude a bends by up to 2a(1 − cos 2πh/λ).
    """
    wave, size = 0.5e-3, 3e-4
    X = places()
    X[:, 1:] = [0.0, RADIUS - DEEPEST]  # strokes along x at one depth
    rippled = function(lambda X: size * np.sin(2 * np.pi * X[:, :1] / wave) * [0.0, 0.0, 1.0])
    v = validate(rippled, solves(X))
    assert missed(v) - {"loop_work", "border_loop_work"} == {"smoothness"}
    assert v.smoothness is not None
    crest = 2 * size * (1 - math.cos(2 * math.pi * STEP / wave))
    own = B**2 * np.linalg.norm(force(X), axis=1).max() * STEP**2
    # five steps to a wave: some step is within a tenth of a wave, 36°, of the crest
    assert math.cos(math.radians(36)) * crest - own <= v.smoothness.largest <= crest + own
    assert validate(function(), solves(X)).smoothness.p95 == pytest.approx(1.0, abs=0.01)


def test_solves_along_a_stroke_are_the_reference_where_they_are_given() -> None:
    """A force whose depth counts twice bends twice as much as the solved one: (2 s)² against s² is four times."""
    s = np.linspace(1e-3, DEEPEST, 21)
    X = np.stack([0 * s, 0 * s, RADIUS - s], axis=1)
    stroke = TouchSolves(X, np.stack([0 * s, 0 * s, 3 * A * s**2], axis=1))
    deep = TouchFunction("deep", INPUTS, lambda X: force(X * [0, 0, 1]) * [0, 0, 4])
    v = validate(deep, solves(), strokes=[stroke])
    assert v.smoothness is not None
    assert v.smoothness.max == pytest.approx(4.0, rel=1e-6)
    assert "finite-element" in v.smoothness.reference
    with pytest.raises(UsageError, match="5 solves has no curve"):
        validate(deep, solves(), strokes=[stroke.take(np.arange(5))])


@pytest.mark.full
@pytest.mark.parametrize(("stated", "held"), [(0.01, 0.9), (0.004, 0.489), (0.03, 1.0)])
def test_an_interval_holds_what_the_errors_say(stated: float, held: float) -> None:
    """Errors of 1 % standard deviation lie within 1.645 σ with P(|N| < 1.645 σ/1 %), to 4 binomial deviations."""
    X = places(1000)
    wrong = 1 + 0.01 * np.random.default_rng(1).normal(size=(1000, 1))
    v = validate(surrogate(root=steady(stated)), TouchSolves(X, force(X) * wrong))
    assert v.coverage is not None
    expected = math.erf(1.645 * stated / 0.01 / math.sqrt(2))
    assert expected == pytest.approx(held, abs=1e-3)
    assert v.coverage.share == pytest.approx(
        expected, abs=4 * math.sqrt(expected * (1 - expected) / 1000) + 1e-9
    )
    assert v.coverage.median_deviation == pytest.approx(stated)
    assert missed(v) == (set() if stated == 0.01 else {"interval_coverage"})


@pytest.mark.full
def test_a_band_is_missed_on_either_side() -> None:
    check = next(
        c
        for c in validate(surrogate(root=steady(0.01)), solves()).checks
        if c.criterion.key == "interval_coverage"
    )
    grades = {
        0.79: "fail",
        0.8: "pass",
        0.84: "pass",
        0.9: "good",
        0.97: "pass",
        0.98: "fail",
        math.nan: "fail",
    }
    assert {m: dataclasses.replace(check, measured=m).grade for m in grades} == grades
    assert "100 % measured, 80 % … 97 % asked" in str(check)
    with pytest.raises(UsageError, match="interval_coverage"):
        Limits(interval_coverage=(0.9, 0.8))


def test_a_just_noticeable_difference_is_larger_for_faint_forces() -> None:
    np.testing.assert_array_equal(
        force_jnd(np.array([0.1, 0.99, 1.0, 5.0])), [FAINT_JND] * 2 + [FORCE_JND] * 2
    )


def test_thirds_and_the_edge_are_told_apart() -> None:
    """A force that is wrong by 2 % in the deepest third only."""
    test = solves()
    deep = lambda X: np.where(RADIUS - X[:, 2] > 2 * depth.max() / 3, 0.02, 0.0)[:, None] * force(X)  # noqa: E731
    depth = RADIUS - test.X[:, 2]
    parts = {p.name: p for p in validate(function(deep), test).parts}
    assert parts["shallow third"].median == 0.0
    assert parts["deep third"].median == pytest.approx(0.02)
    assert parts["deep third"].count == int((depth > 2 * depth.max() / 3).sum())
    scaled = np.abs(2 * (test.X - bounds(INPUTS)[0]) / (bounds(INPUTS)[1] - bounds(INPUTS)[0]) - 1)
    assert parts["edge of the ranges (5 %)"].count == int((scaled > 0.9).any(axis=1).sum())
    assert parts["all"].count == 200
    assert parts["all"].felt == int(
        (np.linalg.norm(test.force, axis=1) > 0.05 * np.linalg.norm(test.force, axis=1).max()).sum()
    )


@pytest.mark.full
def test_the_worst_cases_are_named_with_their_inputs_and_forces() -> None:
    test = solves()
    heavy = np.flatnonzero(np.linalg.norm(test.force, axis=1) > 0.5)
    wrong = test.force.copy()
    wrong[heavy[3]] *= 1 / 1.05
    wrong[heavy[7]] *= 1 / 1.02
    v = validate(surrogate(), dataclasses.replace(test, force=wrong))
    assert [c.relative for c in v.worst[:2]] == pytest.approx([0.05, 0.02])
    assert v.worst[0].truth == tuple(wrong[heavy[3]])
    assert v.worst[0].answer == pytest.approx(test.force[heavy[3]])
    assert [value for _, value, _ in v.worst[0].at.inputs] == list(test.X[heavy[3]])
    assert v.worst[0].depth == pytest.approx(RADIUS - test.X[heavy[3], 2])
    assert "worst 1: 5 %" in str(v)


def test_a_mesh_beyond_its_limit_keeps_a_surrogate_from_passing() -> None:
    """Three touches on a finer mesh suffice, by mean and deviation; verdict and file tell the mesh's part."""
    test = solves()
    heavy = np.flatnonzero(np.linalg.norm(test.force, axis=1) > 0.5)[:3]
    fine = TouchSolves(test.X[heavy], test.force[heavy] * np.array([1.0, 0.97, 1.01])[:, None])
    off = np.array([0.0, 0.03 / 0.97, 0.01 / 1.01])
    part = 4 / 3 * (off.mean() + 1.645 * off.std(ddof=1))
    assert part > 4 / 3 * off.max()
    loose, strict = (
        validate(surrogate(), test, refined=fine, limits=Limits(mesh_force=m)) for m in (0.06, 0.035)
    )
    assert loose.mesh_part == pytest.approx(part)
    assert "mesh_force" not in missed(loose)
    assert "mesh_force" in missed(strict)
    assert "element" in strict.failures[0].criterion.fix
    assert "force ± 5.3 % in all, of it the mesh 5.3 %" in verdict(loose)[1]
    assert loose.summary()["force error, the mesh's part"] == pytest.approx(part)
    assert validate(surrogate(), test).mesh_part is None


@pytest.mark.full
def test_the_mesh_s_own_error_stands_apart() -> None:
    """The refined body is 5 % stiffer: an exact surrogate of the coarse one is then off by 1 − 1/1.05."""
    fine = TouchSolves(places()[:50], 1.05 * force(places()[:50]))
    v = validate(surrogate(), solves(), refined=fine)
    assert missed(v) == {"refined_force_median"}
    assert v.mesh is not None
    for value in (v.mesh.together_median, v.mesh.together_p95, v.mesh.mesh_median, v.mesh.mesh_p95):
        assert value == pytest.approx(1 - 1 / 1.05)
    assert v.mesh.paired == v.mesh.count
    assert "the mesh alone is off by 4.8 % median" in str(v)
    # an error C h² differs from C (h/2)² by three quarters of itself
    assert v.mesh_part == pytest.approx(4 / 3 * (1 - 1 / 1.05))
    assert v.whole_force_error == pytest.approx(v.force.p95 + v.mesh_part)
    apart = validate(surrogate(), solves(), refined=TouchSolves(places(9, seed=1), force(places(9, seed=1))))
    assert apart.mesh is not None
    assert apart.mesh.paired == 0
    assert apart.mesh.mesh_p95 is None
    assert any("Refined solves are few" in note for note in apart.notes)


def test_what_is_not_known_is_said_and_not_judged() -> None:
    X = places()
    v = validate(TouchFunction("bare", INPUTS, force), TouchSolves(X, force(X)))
    judged = {c.criterion.key for c in v.checks}
    assert not judged & {"stiffness_p95", "interval_coverage", "refined_force_p95", "displacement_mean"}
    for word in ("Stiffness", "90 % interval", "mesh's own error", "Displacement"):
        assert any(word in note for note in v.notes)
    assert [p.name for p in v.parts] == ["all", "edge of the ranges (5 %)"]


@pytest.mark.full
def test_solves_that_were_trained_on_are_no_test() -> None:
    test = solves()
    low, high = bounds(INPUTS)
    scaled = 2 * (test.X - low) / (high - low) - 1
    v = validate(surrogate(region=TrainedRegion.of(scaled[:30])), test)
    assert v.samples == 170
    assert any(note.startswith("30 solves left out") for note in v.notes)
    with pytest.raises(UsageError, match="trained on all 200 solves"):
        validate(surrogate(region=TrainedRegion.of(scaled)), test)


@pytest.mark.full
def test_a_dataset_is_judged_like_its_arrays() -> None:
    test = solves()
    one, other = validate(surrogate(factor=1.02), test), validate(surrogate(factor=1.02), dataset(test))
    assert one.as_dict() == other.as_dict()
    assert json.loads(json.dumps(one.as_dict(), allow_nan=False))["force"]["median"] == pytest.approx(0.02)
    with pytest.raises(UsageError, match="probe has a radius of 8 mm, the surrogate's 10 mm"):
        validate(surrogate(), dataset(test, radius=0.008))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"X": np.zeros((200, 2))}, "inputs have shape"),
        ({"force": np.zeros((200, 3))}, "none has a force"),
        ({"force": np.full((200, 3), np.nan)}, "not finite"),
        ({"stiffness": np.zeros((200, 3))}, "stiffness has shape"),
    ],
)
def test_solves_that_can_t_judge_are_refused(changes: dict, words: str) -> None:  # type: ignore[type-arg]
    with pytest.raises(UsageError, match=words):
        dataclasses.replace(solves(), **changes)


def test_work_around_a_polygon_is_the_curl_times_its_area() -> None:
    corners = np.array([[0.0, 0, 0], [0.02, 0, 0], [0.02, 0.01, 0], [0, 0.01, 0]])
    work = work_of_polygons(
        lambda X: np.stack([-X[:, 1], X[:, 0], 0 * X[:, 0]], axis=1), [corners, corners[::-1]]
    )
    np.testing.assert_allclose(work.net, [2 * 2e-4, -2 * 2e-4], rtol=1e-13)
    assert not work.open.any()


def test_the_quadrature_finds_bends_wherever_they_are() -> None:
    """F = −∇ max(0, x − e)² bends at x = e; around a triangle its work is zero, also where e is next to a corner."""
    corner = np.array([[0.0, 0, 0], [0.03, 0.002, 0], [0.01, 0.02, 0.004]])
    for e in (0.0299, 0.029999, 0.0123, 1e-6):
        work = work_of_polygons(lambda X, e=e: -2 * np.maximum(X - [e, 0, 0], 0.0) * [1, 0, 0], [corner])
        assert abs(work.net[0]) < 1e-11 * work.energy[0]


def test_a_jump_of_the_force_is_said_to_be_left_open() -> None:
    step = TouchFunction("step", INPUTS, lambda X: force(X) * np.where(X[:, 1:2] > 0.1234e-2, 1.0, 1.5))
    v = validate(step, solves())
    assert "loop_work" in missed(v)
