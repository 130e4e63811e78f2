"""The report of a touched body: what its figures show is what was solved and what the surrogate answers."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from linear_bodies import history, tip_data, tip_model
from models import linear_network
from palpate.format import bind_units, interval
from palpate.surrogates import ContactBaseline, ContactLaw, Continuation, LearntEnergy, Surrogate
from palpate.units import Quantity, Range
from palpate.validation import Chapter, TouchSolves, validate, write_report
from palpate.validation.report.touch_pictures import View, at_depth, contact_points, curves, plot_curves
from pressed import DEEPEST, INPUTS, RADIUS, A, B, face, force, places, solves, steady, surrogate

HOSTILE = '<script>window.hacked = 1</script> $\\frac{1}$ "&amp;'


def columns() -> TouchSolves:
    """Five depths in each of four columns."""
    feet_at = np.array([[-0.015, -0.015], [0.015, -0.01], [0.0, 0.0], [0.01, 0.015]])
    depth = np.linspace(0.2, 1.0, 5) * DEEPEST
    X = np.array([[x, y, RADIUS - s] for x, y in feet_at for s in depth])
    return solves(X)


def test_curves_lie_on_the_closed_form_with_the_solves_of_their_column() -> None:
    test = columns()
    found = curves(surrogate().energy, test)
    assert len(found) == 4
    assert sorted(np.concatenate([c.rows for c in found])) == list(range(20))
    for curve in found:
        line = np.repeat(test.X[curve.rows[:1]], len(curve.depth), axis=0)
        line[:, 2] = RADIUS - curve.depth
        np.testing.assert_allclose(curve.force, np.linalg.norm(force(line), axis=1), atol=1e-12)
        assert (np.diff(RADIUS - test.X[curve.rows, 2]) < 0).all()


@pytest.mark.full
def test_depths_of_one_place_are_told_from_places() -> None:
    test = columns()
    assert "The 20 solves lie over 4 places, at several depths of each." in str(validate(surrogate(), test))
    assert "at several depths" not in str(validate(surrogate(), solves()))


def test_a_flat_face_is_seen_from_above() -> None:
    S, X = surrogate().energy, places(50)
    view = View.of(S, X)
    np.testing.assert_allclose(view.out, [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(view.flat(contact_points(S, X)), X[:, :2], atol=1e-12)
    assert view.labels() == ("x / mm", "y / mm")
    there = at_depth(S, view, X[:, :2], X[0], 0.004)
    np.testing.assert_allclose(there, np.column_stack([X[:, :2], np.full(50, RADIUS - 0.004)]), atol=1e-6)


@pytest.mark.full
def test_of_a_family_it_is_told_which_body_is_shown(tmp_path: Path) -> None:
    inputs = (*INPUTS, Range("young", 5e3, 15e3, "Pa"))
    network = linear_network(list(inputs), [Quantity("ln U/U0")], np.array([[np.log(A), B * 0.02, 0, 0, 0]]))
    baseline, going = (
        ContactBaseline(ContactLaw("pad"), face(), RADIUS),
        Continuation.of(inputs, deepest=DEEPEST),
    )
    S = Surrogate(LearntEnergy(network, baseline, continuation=going))
    alike = columns()
    X = np.hstack([alike.X, np.repeat([[6e3], [8e3], [1e4], [1.2e4]], 5, axis=0)])
    X[4, 2] -= 1e-5  # the first column's last touch is the deepest
    test = TouchSolves(X, alike.force, alike.energy, alike.stiffness)
    legend = plot_curves(S.energy, test).axes[0].get_legend()
    told = [text.get_text().partition("; ")[2] for text in legend.get_texts()]
    assert sorted(told) == ["young = 1.2e+04 Pa", "young = 1e+04 Pa", "young = 6000 Pa", "young = 8000 Pa"]
    text = write_report(tmp_path / "f.html", [Chapter("f", S, test, validate(S, test))]).read_text("utf-8")
    assert "The surrogate states no deviation. Shown for young = 6000 Pa." in text


@pytest.mark.full
@pytest.mark.parametrize("images", [1, 8])
def test_a_picture_of_a_part_says_that_it_is_one(tmp_path: Path, images: int) -> None:
    S, test = surrogate(meta={"solves": 12, "samples": 12 * images}), solves()
    v = validate(S, test)
    assert v.smoothness is not None
    text = write_report(tmp_path / "part.html", [Chapter("part", S, test, v)]).read_text("utf-8")
    assert text.count("a part of the body of which the rest is mirror images") == (0 if images == 1 else 2)
    assert f"{v.smoothness.p95:.2f} times as much as its reference (the model" in " ".join(text.split())


@pytest.mark.full
def test_both_kinds_of_bodies_stand_in_one_report(tmp_path: Path) -> None:
    S, test = surrogate(root=steady(0.01), meta={"name": HOSTILE, "solves": 12}), solves()
    touched = Chapter(HOSTILE, S, test, validate(S, test), settings={HOSTILE: 1.0})
    unsure = dataclasses.replace(touched, name="no posterior", model=surrogate())
    touch, data = tip_model(), tip_data()
    held = Chapter("beam", touch, data, validate(touch, data), train=data, history=history())
    text = write_report(tmp_path / "both.html", [held, touched, unsure]).read_text(encoding="utf-8")
    assert "<script" not in text
    assert text.count('id="c2-trust"') == text.count('id="c3-curves"') == text.count('id="c1-shapes"') == 1
    assert "The surrogate states no deviation." in text
    # overconfident or too careful: here no error at all, which no 90 % interval should hold all of
    assert "Share of errors within the 90" in text.split("What was missed")[1]
    assert bind_units(interval(INPUTS[0])) in text
