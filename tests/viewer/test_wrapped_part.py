"""A scan that cuts itself on the page of `palpate touch`: refused in words, wrapped by a click, and set up."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import trimesh
from chromium_page import assert_no
from playwright.sync_api import Browser, Page

from palpate.cli.console import Console
from palpate.cli.touch_page import TouchedPart, touch_on_page
from palpate.errors import UsageError
from palpate.options import PartOptions
from palpate.study import Study, read_study
from palpate.study.part_study import part_study, part_text, study_file
from palpate.units import parse_quantity
from palpate.viewer.part_page import PartPage

pytestmark = [pytest.mark.full, pytest.mark.timeout(180)]

RADII, APART = (20.0, 16.0), 22.0  # mm, of two balls that overlap


class Command:
    """`palpate touch` of a scan in a thread, whose work only takes note of the study that it is given."""

    def __init__(self, scan: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.scan, self.begun, self.failures = scan, [], []
        self.page: PartPage | None = None
        self._running = threading.Event()
        self.touched = TouchedPart(0.02, 60.0, 1, Console())
        monkeypatch.setattr(self.touched, "begin", lambda file_of: self.begun.append(file_of()))
        monkeypatch.setattr("palpate.cli.touch_page.wait_until_interrupted", self._serve)
        self._thread = threading.Thread(target=self._touch, daemon=True)
        self._ended = threading.Event()
        self._thread.start()
        assert self._running.wait(30)

    def _serve(self, page: PartPage, *, open_browser: bool, on_ready) -> None:
        with page:
            self.page = page
            on_ready(page)
            self._running.set()
            self._ended.wait()

    def _touch(self) -> None:
        try:
            touch_on_page("scan", self._study, self._write, self.touched, on_ready=lambda page: None, port=0)
        except UsageError as error:
            self.failures.append(error)

    def _study(self, unit: str | None, wrap: float | None) -> tuple[Study, Path, bool]:
        study, _ = part_study(self.scan, options=PartOptions(unit=unit, wrap=wrap))
        return study, study_file(self.scan), False

    def _write(self, study: Study) -> Path:
        file = study_file(self.scan)
        file.write_text(part_text(study, ()), encoding="utf-8")
        return file

    def end(self) -> None:
        self._ended.set()
        self._thread.join(30)


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Command]:
    balls = [trimesh.creation.icosphere(3, radius=radius) for radius in RADII]
    balls[1].apply_translation((APART, 0, 0))
    scan = tmp_path / "scan.stl"
    trimesh.util.concatenate(balls).export(scan)
    running = Command(scan, monkeypatch)
    yield running
    running.end()


@pytest.fixture
def page(browser: Browser, command: Command, complaints: list[str]) -> Iterator[Page]:
    page = browser.new_context(viewport={"width": 1000, "height": 640}).new_page()
    page.on("console", lambda m: complaints.append(m.text) if m.type in {"error", "warning"} else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(command.page.url)
    page.wait_for_selector("html[data-stage=refused]")
    yield page
    page.context.close()
    assert_no(complaints)


@pytest.mark.filterwarnings("ignore:.*was read with repairs")
def test_a_scan_that_cuts_itself_is_wrapped_by_a_click(command, page, keep):
    words = page.inner_text("#refusal-words")
    assert "cuts itself" in words
    assert "--wrap 1mm" in words, "a fortieth of its length of 58 mm"
    assert page.inner_text("#wrap") == "wrap it (1 mm)"
    assert page.is_hidden("#part-section")
    keep(page, "part-refused")

    for size, problem in (("2", "has no unit"), ("0.01 mm", "too fine")):
        page.fill("#wrap-size", size)
        page.click("#wrap")
        page.wait_for_selector(f"#wrap-problem:has-text('{problem}')")
    assert page.get_attribute("html", "data-stage") == "refused"

    page.fill("#wrap-size", "2 mm")
    assert page.inner_text("#wrap") == "wrap it (2 mm)"
    page.click("#wrap")
    page.wait_for_selector("html[data-stage=choosing][data-partdrawn][data-picked]", timeout=60_000)
    assert page.is_hidden("#refusal")
    told = page.inner_text("#banner").replace("\N{NO-BREAK SPACE}", " ")
    moved = re.search(r"moved by ([\d.]+ mm) \(95 % of it\), ([\d.]+ mm) at most", told)
    usual, most = (parse_quantity(text, "m") for text in moved.groups())
    assert usual <= most <= 2e-3
    assert "was wrapped, 2 mm fine" in page.inner_text("#part-notes").replace("\N{NO-BREAK SPACE}", " ")
    keep(page, "part-wrapped")

    page.click("#start")
    page.wait_for_selector("html[data-stage=working]")
    assert page.is_hidden("#banner")
    (file,) = command.begun
    study = read_study(file)
    assert study.body.wrap == pytest.approx(2e-3)
    # the surface that is touched is that of two balls, by their own equations
    skin = study.body.shape().skin
    off = [
        np.linalg.norm(skin.points - [1e-3 * i * APART, 0, 0], axis=1) - 1e-3 * r for i, r in enumerate(RADII)
    ]
    assert np.abs(np.minimum(*off)).max() <= 2e-3
    page.goto("about:blank")  # else the page complains that its server is gone
    command.end()
    assert not command.failures


def test_a_refusal_that_nobody_mends_is_the_commands_error(command, page):
    page.wait_for_selector("#refusal-words:has-text('cuts itself')")
    page.goto("about:blank")
    command.end()
    (failure,) = command.failures
    assert "cuts itself" in failure.what
    assert failure.wrap == pytest.approx(1e-3)
    assert not command.begun
    assert not study_file(command.scan).exists()
