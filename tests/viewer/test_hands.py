"""One hand, several pages."""

from __future__ import annotations

import numpy as np

from palpate.viewer.hands import FORGOTTEN, LONGEST_PERIOD, Hands
from palpate.viewer.messages import Hand, Hold


def hand(*, grabbed: bool = True, hidden: bool = False, period: float = 0.05, parameters=()) -> Hand:
    return Hand(0.0, period, (0.01, 0.02, 0.0), grabbed, hidden, np.array(parameters, "f4"))


def test_the_first_to_grab_holds_and_the_other_watches():
    hands = Hands(np.zeros(0))
    assert hands.hold(1) is Hold.FREE
    command = hands.hear(1, hand(), 0.0)
    assert command is not None
    assert command.grabbed
    assert hands.hear(2, hand(), 0.01) is None
    assert (hands.hold(1), hands.hold(2)) == (Hold.YOURS, Hold.ANOTHER)


def test_letting_go_frees_the_hand():
    hands = Hands(np.zeros(0))
    hands.hear(1, hand(), 0.0)
    command = hands.hear(1, hand(grabbed=False), 0.1)
    assert command is not None
    assert not command.grabbed
    assert hands.hold(2) is Hold.FREE
    assert hands.hear(2, hand(), 0.2) is not None
    assert hands.hold(1) is Hold.ANOTHER


def test_leaving_frees_the_hand_only_if_it_was_held():
    hands = Hands(np.zeros(0))
    hands.hear(1, hand(), 0.0)
    assert not hands.leave(2)
    assert hands.leave(1)
    assert not hands.leave(1)
    assert hands.hold(2) is Hold.FREE


def test_a_silent_holder_is_forgotten_and_not_before():
    hands = Hands(np.zeros(0))
    hands.hear(1, hand(), 0.0)
    assert hands.hear(2, hand(), 0.9 * FORGOTTEN) is None
    assert hands.hear(2, hand(), 1.1 * FORGOTTEN) is not None
    assert hands.hold(1) is Hold.ANOTHER


def test_a_hidden_page_holds_nothing_and_hides_the_body_only_alone():
    hands = Hands(np.zeros(0))
    alone = hands.hear(1, hand(hidden=True), 0.0)
    assert alone is not None
    assert alone.hidden
    assert not alone.grabbed
    shown = hands.hear(2, hand(grabbed=False), 0.0)
    assert shown is not None
    assert not shown.hidden


def test_a_page_can_not_promise_itself_out_of_the_stall_rule():
    command = Hands(np.zeros(0)).hear(1, hand(period=1e6), 0.0)
    assert command is not None
    assert command.period == LONGEST_PERIOD


def test_a_moved_slider_counts_and_a_repeated_one_does_not_undo_it():
    hands = Hands(np.array([2.5]))
    hands.hear(1, hand(grabbed=False, parameters=[2.5]), 0.0)
    hands.hear(2, hand(grabbed=False, parameters=[2.5]), 0.0)
    hands.hear(1, hand(grabbed=False, parameters=[4.0]), 0.1)
    hands.hear(2, hand(grabbed=False, parameters=[2.5]), 0.2)
    assert hands.parameters.tolist() == [4.0]
    hands.hear(2, hand(grabbed=False, parameters=[1.0]), 0.3)
    assert hands.parameters.tolist() == [1.0]


def test_parameters_of_another_count_are_ignored():
    hands = Hands(np.array([2.5]))
    hands.hear(1, hand(parameters=[]), 0.0)
    hands.hear(1, hand(parameters=[1.0, 2.0]), 0.1)
    assert hands.parameters.tolist() == [2.5]
