"""The score of an examination: lumps matched with marks, chances with intervals, false alarms, and its page."""

from __future__ import annotations

import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest
from examined import plane, touch_along

from palpate.experiments.exam_lumps import LumpPlace
from palpate.experiments.exam_report import score_page
from palpate.experiments.exam_score import ExamScore, LumpResult, match_marks, share_interval
from palpate.experiments.examination import Mark
from palpate.surrogates import Lump


def lump_place(x, y, cover=0.004):
    return LumpPlace(np.array([x, y, 0.0]), np.array([0.0, 0.0, 1.0]), cover)


def test_marks_are_matched_as_well_as_any_way_to_match_them():
    rng = np.random.default_rng(3)
    for _ in range(50):
        lumps = [lump_place(*rng.uniform(-0.02, 0.02, 2)) for _ in range(3)]
        marks = [Mark(k, (*rng.uniform(-0.02, 0.02, 2), 0.0)) for k in range(3)]
        radii = rng.uniform(0.005, 0.02, 3)
        pairs = match_marks(lumps, radii, marks)
        away = [[np.linalg.norm(at.above - mark.place) for mark in marks] for at in lumps]
        ways = []
        for order in itertools.permutations(range(3)):
            near = [(k, j) for k, j in enumerate(order) if away[k][j] <= radii[k]]
            ways.append((len(near), -sum(away[k][j] for k, j in near)))
        found = len(pairs), -sum(away[k][mark.number] for k, mark in pairs.items())
        assert found == pytest.approx(max(ways))


def test_no_marks_and_no_lumps_are_no_pairs():
    assert match_marks([], [], [Mark(1, (0.0, 0.0, 0.0))]) == {}
    assert match_marks([lump_place(0.0, 0.0)], [0.01], []) == {}


@pytest.mark.parametrize(("hits", "count"), [(0, 1), (1, 1), (3, 4), (7, 20), (0, 5)])
def test_the_interval_ends_where_the_score_test_does(hits, count):
    # p inside: |p̂ − p| ≤ z √(p (1 − p)/n), whose equality is at the ends
    share = hits / count
    for p in share_interval(hits, count):
        assert abs(share - p) == pytest.approx(1.959964 * math.sqrt(p * (1 - p) / count), abs=1e-9)
    assert share_interval(0, 0) == (0.0, 1.0)


@pytest.fixture
def score():
    lumps = [Lump((x, 0.0, -0.009), 0.005, ratio) for x, ratio in ((0.0, 10.0), (0.03, 3.0))]
    marks = (
        Mark(1, (0.001, 0.0, 0.0), "hard", "deep"),  # finds the first, which is shallow
        Mark(2, (0.004, 0.0, 0.0)),  # the same lump again
        Mark(3, (-0.04, 0.04, 0.0), "soft", "deep"),
    )
    results = (
        LumpResult(lumps[0], lump_place(0.0, 0.0), 0.005, marks[0]),
        LumpResult(lumps[1], lump_place(0.03, 0.0, 0.006), 0.005),
    )
    facts = {"kind": "begun", "title": "A <slab>", "at": "2026-01-02T03:04:05+00:00", "device": "page"}
    events = (facts, {"kind": "clock", "seconds": -3600.0}, {"kind": "resumed"})
    past = SimpleNamespace(name="slab-1", facts=facts, events=events, jumps=(-3600.0,))
    touch = touch_along(np.array([(x, y) for x in (-0.03, 0.0, 0.03) for y in (-0.02, 0.0, 0.02)]), 0.005)
    return ExamScore(past, results, marks, plane(), touch, 200.0)


def test_found_missed_and_false(score):
    assert score.hits == 1
    assert [mark.number for mark in score.false_alarms] == [3]
    assert score.right("hardness") == (1, 1)
    assert score.right("depth") == (0, 1)
    assert score.by("depth") == {"deep": (0, 1), "shallow": (1, 1)}
    assert score.by("hardness") == {"hard": (1, 1), "soft": (0, 1)}
    assert score.by("size") == {"⌀ 10 mm": (1, 2)}
    assert score.words.startswith("1 of 2 lumps found, 1 false alarm, ")


def test_the_page_of_a_score_says_all_of_it_without_a_script(score):
    page = score_page(score)
    assert "A &lt;slab&gt;" in page
    assert "<script" not in page
    for words in ("found by mark 1", "missed", "hard (right), deep (wrong)", "Mark 3.", "went back by 60 min",
                  "interrupted 1 time", "Strips" if score.order.parallel >= 0.6 else "order"):  # fmt: skip
        assert words in page
    assert page.count("<circle") == 2 + 1  # lumps, and where the search began
