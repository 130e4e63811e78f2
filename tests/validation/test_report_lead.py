"""What a report says first, how it counts solves, and its picture of the body."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

from linear_bodies import history, tip_data, tip_model
from palpate.validation import Chapter, Limits, validate
from palpate.validation.report.body_pictures import drawn_triangles
from palpate.validation.report.place_pictures import place_pictures
from palpate.validation.report.summary import story
from pressed import dataset, solves, surrogate

COUNTS = re.compile(r"(\d+) (?:other )?solves? to learn from|learnt from (\d+) other solve")


def test_the_first_paragraph_says_by_what_how_good_and_what_to_do() -> None:
    model, data = tip_model(force=0.99), tip_data()
    chapter = Chapter(
        "beam", model, data, validate(model, data, history=history()), train=data, history=history()
    )
    lead = story(chapter).lead
    assert lead.startswith("The learnt body beam is judged here by")
    assert "off by 1 % at the median" in lead
    assert "A hand notices a difference of 7 %, or of 10 % below 1 N (Jones 1989;" in lead
    assert lead.endswith("exported (`palpate export`).")
    strict = dataclasses.replace(chapter, validation=validate(model, data, limits=Limits(force_p95=1e-6)))
    assert "To do: see below" in story(strict).lead
    advised = dataclasses.replace(strict, advice="take 30 solves")
    assert story(advised).lead.endswith("To do: take 30 solves.")
    few = data.every(14)
    judged = dataclasses.replace(chapter, test=few, validation=validate(model, few))
    assert "To do: judge it by more solves" in story(judged).lead


def test_solves_are_counted_in_one_way() -> None:
    """Of 40 solves the surrogate has learnt from the first 30; the others gave no better one."""
    model, train, test = surrogate(meta={"solves": 30, "samples": 30}), dataset(solves()), solves()
    assert len(train) > 40
    chapter = Chapter("slab", model, test, validate(model, test), train=train)
    (places,) = place_pictures(chapter, "c")
    told = story(chapter)
    facts = [fact.figure for fact in told.facts if fact.meaning == "to learn from"]
    texts = " ".join(
        [told.lead, told.solved, told.learnt, places.caption, *(f"{f} to learn from" for f in facts)]
    )
    counts = {int(a or b) for a, b in COUNTS.findall(texts)}
    assert counts == {30}


@pytest.mark.parametrize("out", [(0.5, -0.7, 0.45), (1.0, 0.2, -0.3)])
def test_of_a_cube_three_faces_are_drawn_nearest_last(out: tuple[float, float, float]) -> None:
    points = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    square = np.array([[0, 1, 3], [0, 3, 2]])
    faces = [square, square[:, ::-1] + 4]
    faces += [np.array([[0, 4, 5], [0, 5, 1]]), np.array([[2, 7, 6], [2, 3, 7]])]
    faces += [np.array([[0, 2, 6], [0, 6, 4]]), np.array([[1, 7, 3], [1, 5, 7]])]
    triangles = np.concatenate(faces)
    flat, order, shade = drawn_triangles(points, triangles, np.array(out))
    assert len(order) == 6, "three faces of two triangles"
    depths = points[triangles[order]].mean(axis=1) @ np.array(out)
    assert (np.diff(depths) >= -1e-12).all()
    assert ((shade > 0.0) & (shade <= 1.0)).all()
    a, b = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    side = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    assert (side > 0.0).all(), "counter-clockwise, as seen from outside"
    # the drawing keeps areas times the cosine of the view
    seen = np.abs(np.array(out)).sum() / np.linalg.norm(out)
    assert 0.5 * side.sum() == pytest.approx(seen)
