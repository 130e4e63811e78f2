"""The kinds of hand that move a body, and words for each: nobody is told to let go of a mouse that isn't there."""

from __future__ import annotations

from enum import StrEnum

__all__ = ["HandKind"]


class HandKind(StrEnum):
    """Who moves the hand: a person at the page, a person at a device, a recorded touch, or a program."""

    PAGE = "page"  # mouse, finger, pen, keyboard or the browser's gamepad
    DEVICE = "device"
    RECORDING = "recording"
    PROGRAM = "program"

    @property
    def silence(self) -> str:
        """Why the force is zero where the hand was not heard of, as a clause."""
        return _SILENCE[self]

    @property
    def way_back(self) -> str:
        """A sentence on how a force that is withheld comes back, without its capital letter."""
        return _WAY_BACK[self]

    def holder(self, device: str) -> str:
        """Return who moves the hand, in words; `device` is the device's name. Of a page's own hand that is empty."""
        words = {
            HandKind.PAGE: "",
            HandKind.RECORDING: "a recorded touch",
            HandKind.PROGRAM: f"a program ({device})",
        }
        return words.get(self, f"the device {device}")


_SILENCE = {
    HandKind.PAGE: "the page was in the background, or too busy to say where its hand is",
    HandKind.DEVICE: "the device was silent for longer than it may be",
    HandKind.RECORDING: "the recorded hand was silent for longer than its device allowed",
    HandKind.PROGRAM: "the program that moves the hand was silent for too long",
}
_WAY_BACK = {
    HandKind.PAGE: "let go, and take hold again.",
    HandKind.DEVICE: "move the hand out of the body, or bring what it holds back to rest.",
    HandKind.RECORDING: "the recorded hand has to leave the body, or to bring what it holds back to rest.",
    HandKind.PROGRAM: "the program has to move the hand out of the body, or to bring what it holds back to rest.",
}
