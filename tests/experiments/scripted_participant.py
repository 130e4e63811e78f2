"""A participant by script: Chromium in the place of a person, on the two pages of `palpate experiment run`."""

from __future__ import annotations

import contextlib
import math
import re
import subprocess
import sys
import time
from pathlib import Path

from playwright.sync_api import Error

__all__ = ["Sitting", "shortened"]

_SEEN = 20.0  # % of the bar of depth from which on a reading counts: above, its step is a small part
_FORGET = "window.bars = [[], []]"  # depth and force, %, as the page shows them in each interval
_LOOK = (
    _FORGET
    + """; setInterval(() => {
    if (document.documentElement.dataset.phase !== "touch") return;
    const second = document.querySelector("#which").textContent.startsWith("Second");
    window.bars[+second].push(["#depth i", "#force i"].map(
        (bar) => parseFloat(document.querySelector(bar).style.height) || 0));
}, 20);"""  # the page itself looks: between two looks of a script a busy machine may let the touch pass
)
_ALIKE = 0.1  # of ln depth: as the law is off by 0.3 in its power at most, 3 % of stiffness


def shortened(text: str, trials: int, catch: int = 1) -> str:
    """A ready plan whose sitting takes seconds: one trial of practice, short touches, a break of a second."""
    for key, value in {
        "trials": trials, "practice": 1, "catch": catch, "break_every": max(3, trials // 2), "break_seconds": 1,
        "interval_seconds": 0.3, "pause_seconds": 0.5,
    }.items():  # fmt: skip
        text, count = re.subn(rf"(?m)^{key} = \S+", f"{key} = {value}", text)
        if not count:
            text = text.replace("[sitting]\n", f"[sitting]\n{key} = {value}\n")
    return text


class Sitting:
    """`palpate experiment run` in a process of its own, and its two pages in a browser."""

    def __init__(self, browser, plan: Path, *options: str, label: str = "sub-01") -> None:
        command = [sys.executable, "-m", "palpate", "experiment", "run", plan.name, label, "--no-browser"]
        self.process = subprocess.Popen(
            [*command, "--port", "0", *options], cwd=plan.parent, stderr=subprocess.PIPE, text=True
        )
        urls, said = {}, []
        for line in self.process.stderr:
            said.append(line)
            if known := re.match(r"(participant|control): +(http\S+)", line):
                urls[known[1]] = known[2]
            if len(urls) == 2:
                break
        assert len(urls) == 2, "".join(said)
        self.complaints = []
        self.page, self.control = (self._open(browser, urls[name]) for name in ("participant", "control"))
        self.page.evaluate(_LOOK)

    def _open(self, browser, url):
        page = browser.new_context(viewport={"width": 390, "height": 780}).new_page()
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.goto(url)
        page.wait_for_selector("html[data-phase]")
        return page

    @property
    def phase(self) -> str:
        return self.page.evaluate("document.documentElement.dataset.phase")

    def act(self, trials: int, *, press: bool, seconds: float = 200.0, answer=None) -> None:
        """Answer so many trials, then stop in the middle of a touch; at the end of the sitting, at once.

        `answer` gives an answer to the stiffness that the page showed, by interval; a trial in which it showed none, as
        on a busy machine, is asked for again. Without it the second is chosen. Ratings are given in turn.
        """
        answered, until = 0, time.monotonic() + seconds
        while time.monotonic() < until:
            phase = self.phase
            if phase == "consent":
                self._click("#agree")
            elif phase == "ready":
                self._click("#go")
            elif phase == "touch":
                if press:
                    self._press()
                if answered == trials:
                    time.sleep(0.2)
                    return
                self._feel()
                self.page.mouse.up()
            elif phase == "question":
                felt = self._stiffness() if answer else {}
                if self.page.locator("#ratings button").count():
                    self._rate()
                elif felt is None:
                    self._ask_again()
                    continue
                else:
                    self.page.keyboard.press(str(answer(felt) if answer else 2))
                self._leave("question")
                answered += 1
                self.page.evaluate(_FORGET)
            elif phase == "done":
                return
            time.sleep(0.02)
        raise AssertionError(f"still {self.phase} after {answered} answers")

    def _feel(self) -> None:
        """Hold until the touch is over; a press that came too late is tried again."""
        until = time.monotonic() + 5.0
        while self.phase == "touch" and time.monotonic() < until:
            time.sleep(0.03)

    def _stiffness(self) -> dict[int, float] | None:
        """The stiffness of both bodies at the depth at which they were seen most alike; None where there is none."""
        first, second = (
            [
                (depth, force)
                for depth, force in bars[len(bars) // 2 :]
                if depth > _SEEN and 0.0 < force < 100.0
            ]
            for bars in self.page.evaluate("window.bars")  # the force ramps in at first
        )
        pairs = [(a, b) for a in first for b in second]
        if not pairs:
            return None
        pair = min(pairs, key=lambda pair: abs(math.log(pair[0][0] / pair[1][0])))
        if abs(math.log(pair[0][0] / pair[1][0])) > _ALIKE:
            return None
        # a ball's force grows with depth to the power of 3/2 (Hertz), near enough for so small a difference
        return {k: force / depth**1.5 for k, (depth, force) in enumerate(pair, 1)}

    def _ask_again(self) -> None:
        """Have the experimenter pause and go on: the trial comes again."""
        self.control.click("#pause")
        self._leave("question")
        self.control.click("#resume:enabled")
        self._leave("paused")
        self.page.evaluate(_FORGET)

    def _rate(self) -> None:
        for number, statement in enumerate(self.page.locator("#ratings fieldset").all()):
            statement.locator(f"input[value='{3 + number}']").check()
        self.page.click("#ratings button")

    def _click(self, what: str) -> None:
        with contextlib.suppress(Error):  # the phase has changed meanwhile
            self.page.click(what, timeout=300)

    def _press(self) -> None:
        box = self.page.locator("#pad").bounding_box()
        if box is None:
            return
        x, y = box["x"] + box["width"] / 2, box["y"] + 20
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        self.page.mouse.move(x, y + 0.4 * box["height"], steps=4)

    def _leave(self, phase: str, most: float = 60_000) -> None:
        self.page.wait_for_selector(f"html:not([data-phase={phase}])", timeout=most)

    def end(self, *, kill: bool = False) -> int:
        if kill:
            self.process.kill()
        code = self.process.wait(60)
        self.process.stderr.close()
        for page in (self.page, self.control):
            page.context.close()
        assert self.complaints == []
        return code
