"""A sitting for real: Chromium as the participant, with the page and with a double of a Haply, killed and taken up."""

from __future__ import annotations

import contextlib
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest
from playwright.sync_api import Error, sync_playwright

from palpate.devices.doubles.haply_simulator import HaplySimulator, SimulatorSettings
from palpate.devices.trace_file import read_trace
from palpate.experiments.ready_plans import ready_plan
from palpate.experiments.study_folder import read_table
from palpate.runtime.replay import Replay
from palpate.runtime.touchable import load_touchable
from pressed import surrogate

pytestmark = pytest.mark.full

ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--no-first-run"]  # the tests may run as root, in a container
TRIALS = 6  # one of practice, four counted, one catch


@pytest.fixture(scope="module")
def browser(chromium):
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=chromium, args=ARGUMENTS)
        yield running
        running.close()


@pytest.fixture
def plan(tmp_path):
    surrogate().save(tmp_path / "body.palpate")
    text = ready_plan("discrimination", "live", ["body.palpate"])
    for before, after in (
        ("trials = 80", "trials = 4"),
        ("practice = 4", "practice = 1"),
        ("catch = 4", "catch = 1"),
        ("break_every = 40", "break_every = 3"),
        ("break_seconds = 60", "break_seconds = 1"),
        ("interval_seconds = 3.0", "interval_seconds = 0.3"),
    ):
        text = text.replace(before, after)
    (tmp_path / "live.toml").write_text(text, "utf-8")
    return tmp_path / "live.toml"


class Sitting:
    """`palpate experiment run` in a process of its own, and its two pages in a browser."""

    def __init__(self, browser, plan: Path, *options: str) -> None:
        command = [sys.executable, "-m", "palpate", "experiment", "run", plan.name, "sub-01", "--no-browser"]
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

    def _open(self, browser, url):
        page = browser.new_context(viewport={"width": 390, "height": 780}).new_page()
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.goto(url)
        page.wait_for_selector("html[data-phase]")
        return page

    @property
    def phase(self) -> str:
        return self.page.evaluate("document.documentElement.dataset.phase")

    def act(self, trials: int, *, press: bool) -> None:
        """Answer so many trials, then stop in the middle of a touch; at the end of the sitting, at once."""
        answered, until = 0, time.monotonic() + 200.0
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
                with contextlib.suppress(
                    Error
                ):  # on a busy machine a press may come too late: it is tried again
                    self._leave("touch", 5_000)
                self.page.mouse.up()
            elif phase == "question":
                self.page.keyboard.press("2")
                self._leave("question")
                answered += 1
            elif phase == "done":
                return
            time.sleep(0.02)
        raise AssertionError(f"still {self.phase} after {answered} answers")

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


def assert_replayable(folder: Path, rows: list[dict[str, str]]) -> None:
    """Each touch of each trial comes out the same, to the last bit, with the body that was felt."""
    for row in rows:
        for name in row["recordings"].split(","):
            trace = read_trace(folder / name)
            body = Path(trace.header["model"]["path"])
            replayed = Replay(trace, load_touchable(body)).run()
            assert "to the last bit" in str(replayed)
            assert len(trace) > 100


@pytest.mark.parametrize("device", ["page", "haply"])
def test_a_killed_sitting_goes_on_and_every_touch_can_be_replayed(device, browser, plan):
    with HaplySimulator(SimulatorSettings(port=0, events=0, frequency=1.0, amplitude=-0.01)) as service:
        options = ()
        if device == "haply":
            options = ("--device", f"haply:ws://localhost:{service.port},events={service.events_port}")
        first = Sitting(browser, plan, *options)
        first.act(2, press=device == "page")
        first.end(kill=True)
        folder = plan.parent / "live" / "sub-01" / "beh"
        (table,) = folder.glob("*_events.tsv")
        before = table.read_bytes()
        assert len(read_table(table)) == 2

        second = Sitting(browser, plan, *options)
        second.control.fill("#note", "A phone rang.")
        second.control.click("#write")
        second.act(TRIALS, press=device == "page")
        assert second.end() == 0
    assert table.read_bytes().startswith(before)
    rows = read_table(table)
    assert [int(row["trial"]) for row in rows] == list(range(1, TRIALS + 1))
    assert [row["part"] for row in rows] == ["1"] * 2 + ["2"] * 4
    assert "A phone rang." in (folder / f"{table.name.removesuffix('events.tsv')}notes.tsv").read_text(
        "utf-8"
    )
    assert_replayable(folder, rows[:1] + rows[-1:])
    again = subprocess.run(
        [sys.executable, "-m", "palpate", "experiment", "run", plan.name, "sub-01", "--no-browser"],
        cwd=plan.parent, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert again.returncode == 2
    assert "has finished run 1" in again.stderr
