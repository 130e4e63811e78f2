"""How far the work on a part is: its words, and a time that is left which the clock proves right."""

from __future__ import annotations

import pytest

from palpate.cli.work_estimate import WorkEstimate


def test_a_round_is_told_in_a_users_words_and_ends_when_it_said():
    now = 100.0
    work = WorkEstimate(lambda: now)
    work.begin("a rough surrogate first")
    assert work.words == "a rough surrogate first"
    assert work.share == 0.0
    for done in range(13):
        work.count_solves(done, 12)
        now += 3.0
    assert work.words == "12 of 12 first solves"
    now -= 3.0
    assert work.remaining == pytest.approx(20.0), "all solves are done, a first learning is left"
    work.learn()
    assert work.words == "12 of 12 first solves; learning"
    now += 12.0
    assert work.remaining == pytest.approx(8.0)
    assert work.share == pytest.approx(48.0 / 56.0)
    now += 48.0
    assert work.remaining == 0.0
    assert work.share == 1.0
    work.end_round()

    begin = now
    for done in range(7):  # a round in which everything takes as long as before
        work.count_solves(done, 12)
        now += 2.0
    now -= 2.0
    assert work.words == "6 of 12 finer solves"
    assert begin + 12 * 2.0 + 60.0 == pytest.approx(now + work.remaining)
    assert 0.0 < work.share < 0.5
    work.count_solves(12, 12)
    work.learn()
    work.end_round()
    work.count_solves(1, 4)
    assert work.words == "1 of 4 more solves"
    work.count_solves(4, 4)
    work.count_solves(1, 2)  # unseen solves, which judge
    assert work.words == "1 of 2 more solves"
