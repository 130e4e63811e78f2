"""Words for whoever moves the hand: a person at a page is told of the page, nobody else is."""

from __future__ import annotations

import dataclasses
import re

import pytest

from palpate.devices import device_names, hand_kind
from palpate.devices.hand_kind import HandKind
from palpate.runtime import Fault
from palpate.runtime.shared_state import Shared

OF_A_PAGE = re.compile(r"\b(page|tab|mouse|finger|take hold|let go)\b")


def test_every_device_has_a_hand_and_only_the_page_is_the_page():
    kinds = {name: hand_kind(f"{name}:option=1") for name in device_names()}
    assert {name for name, kind in kinds.items() if kind is HandKind.PAGE} == {"page"}
    assert kinds["trace"] is HandKind.RECORDING
    assert kinds["stroke"] is kinds["simulated"] is HandKind.PROGRAM
    assert kinds["haply"] is kinds["gamepad"] is HandKind.DEVICE


@pytest.mark.parametrize("hand", HandKind)
def test_the_reasons_of_a_missing_force_are_for_that_hand(hand: HandKind):
    shared = Shared.private()
    state = shared.read_state()
    shared.close()
    told = [fault.meaning_for(hand) for fault in Fault]
    assert len(set(told)) == len(Fault)
    state = dataclasses.replace(state, waiting=True, withheld=Fault.INPUT_STALLED)
    told += [state.reason(hand), hand.silence, hand.way_back, hand.holder("x")]
    if hand is HandKind.PAGE:
        assert state.reason(hand).endswith("let go, and take hold again.")
    else:
        assert [words for words in told if OF_A_PAGE.search(words)] == []
        assert hand.holder("x")
