"""One hand, several pages."""

from __future__ import annotations

import numpy as np

from palpate.viewer.hand_lock import FORGOTTEN, LONGEST_PERIOD, HandLock
from palpate.viewer.messages import Hand, Hold


def hand(*, grabbed: bool = True, hidden: bool = False, period: float = 0.05, parameters=()) -> Hand:
    return Hand(0.0, period, (0.01, 0.02, 0.0), grabbed, hidden, np.array(parameters, "f4"))


def test_the_first_to_grab_holds_and_the_other_watches():
    lock = HandLock(np.zeros(0))
    assert lock.hold(1) is Hold.FREE
    command = lock.hear(1, hand(), 0.0)
    assert command is not None
    assert command.grabbed
    assert lock.hear(2, hand(), 0.01) is None
    assert (lock.hold(1), lock.hold(2)) == (Hold.YOURS, Hold.ANOTHER)


def test_letting_go_frees_the_hand():
    lock = HandLock(np.zeros(0))
    lock.hear(1, hand(), 0.0)
    command = lock.hear(1, hand(grabbed=False), 0.1)
    assert command is not None
    assert not command.grabbed
    assert lock.hold(2) is Hold.FREE
    assert lock.hear(2, hand(), 0.2) is not None
    assert lock.hold(1) is Hold.ANOTHER


def test_leaving_frees_the_hand_only_if_it_was_held():
    lock = HandLock(np.zeros(0))
    lock.hear(1, hand(), 0.0)
    assert not lock.leave(2)
    assert lock.leave(1)
    assert not lock.leave(1)
    assert lock.hold(2) is Hold.FREE


def test_a_silent_holder_is_forgotten_and_not_before():
    lock = HandLock(np.zeros(0))
    lock.hear(1, hand(), 0.0)
    assert lock.hear(2, hand(), 0.9 * FORGOTTEN) is None
    assert lock.hear(2, hand(), 1.1 * FORGOTTEN) is not None
    assert lock.hold(1) is Hold.ANOTHER


def test_a_hidden_page_holds_nothing_and_hides_the_body_only_alone():
    lock = HandLock(np.zeros(0))
    alone = lock.hear(1, hand(hidden=True), 0.0)
    assert alone is not None
    assert alone.hidden
    assert not alone.grabbed
    shown = lock.hear(2, hand(grabbed=False), 0.0)
    assert shown is not None
    assert not shown.hidden


def test_a_page_can_not_promise_itself_out_of_the_stall_rule():
    command = HandLock(np.zeros(0)).hear(1, hand(period=1e6), 0.0)
    assert command is not None
    assert command.period == LONGEST_PERIOD


def test_a_moved_slider_counts_and_a_repeated_one_does_not_undo_it():
    lock = HandLock(np.array([2.5]))
    lock.hear(1, hand(grabbed=False, parameters=[2.5]), 0.0)
    lock.hear(2, hand(grabbed=False, parameters=[2.5]), 0.0)
    lock.hear(1, hand(grabbed=False, parameters=[4.0]), 0.1)
    lock.hear(2, hand(grabbed=False, parameters=[2.5]), 0.2)
    assert lock.parameters.tolist() == [4.0]
    lock.hear(2, hand(grabbed=False, parameters=[1.0]), 0.3)
    assert lock.parameters.tolist() == [1.0]


def test_parameters_of_another_count_are_ignored():
    lock = HandLock(np.array([2.5]))
    lock.hear(1, hand(parameters=[]), 0.0)
    lock.hear(1, hand(parameters=[1.0, 2.0]), 0.1)
    assert lock.parameters.tolist() == [2.5]
