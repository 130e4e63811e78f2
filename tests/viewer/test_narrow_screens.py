"""Every page that palpate shows, on a phone: nothing is wider than the screen, and a finger meets each control."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import numpy as np
import pytest
import trimesh
from blocks import dents
from bodies import arc_beam
from playwright.sync_api import Browser, Page
from slabs import family, touched_slab

import pressed
from held import pad
from linear_bodies import history, tip_data, tip_model
from palpate.learning import PRESETS, learn
from palpate.learning.growth_frames import GrowthRecorder
from palpate.study.part_choices import shown_part
from palpate.study.part_study import part_study
from palpate.units import Quantity, Range
from palpate.validation import Chapter, validate, write_report
from palpate.validation.report.growth_page import write_growth_page
from palpate.viewer import BodyViewer, Viewer
from palpate.viewer.file_page import export_html
from palpate.viewer.part_page import PartPage, Progress, serve_part

pytestmark = [pytest.mark.full, pytest.mark.timeout(180)]

PHONE = {"width": 390, "height": 844}
FINGER = 44  # px, the least side of a target (WCAG 2.2, 2.5.5)
TOUCHED = {"beam", "pressed body", "pad", "device", "learnt part"}


@contextmanager
def served(body: object, **options: object) -> Iterator[str]:
    with Viewer(body, port=0, **options) as viewer:
        yield viewer.url


@contextmanager
def solved(_: Path) -> Iterator[str]:
    with BodyViewer(dents(), name="pressed block", port=0) as viewer:
        yield viewer.url


@contextmanager
def part(folder: Path) -> Iterator[PartPage]:
    trimesh.creation.box((40.0, 30.0, 20.0)).export(folder / "pad.stl")
    with serve_part("pad", on_start=lambda choices: None, port=0) as page:
        page.show_part(shown_part(part_study(folder / "pad.stl")[0]))
        yield page


@contextmanager
def chosen_part(folder: Path) -> Iterator[str]:
    with part(folder) as page:
        yield page.url


@contextmanager
def solved_part(folder: Path) -> Iterator[str]:
    with part(folder) as page:
        page.show_progress(Progress("7 of 12 first solves", remaining=48.0, share=0.4, seconds=31.0))
        yield page.url


@contextmanager
def learnt_part(folder: Path) -> Iterator[str]:
    report = folder / "report.html"
    report.write_text("<p>A report.</p>", encoding="utf-8")
    with part(folder) as page:
        page.show_body(touched_slab().save(folder / "pad.palpate"))
        words = "12 of 12 first solves; learning"
        page.show_progress(Progress(words, 12, 0.02, 0.008, 0.031, np.zeros((1, 3)), 41.0, report, 20.0, 0.6))
        yield page.url


@contextmanager
def one_file(folder: Path) -> Iterator[str]:
    export_html(family(), folder / "body.html", check=False)
    yield (folder / "body.html").as_uri()


@contextmanager
def report(folder: Path) -> Iterator[str]:
    model, data = tip_model(shift=1e-6, slope=1e-7, force=0.999), tip_data()
    validation = validate(model, data, history=history())
    chapter = Chapter("beam", model, data.every(3), validation, train=data, history=history())
    slab, few = touched_slab(), pressed.solves(pressed.places(8))
    pressed_chapter = Chapter(
        "a slab", slab, few, validate(slab, few), train=pressed.dataset(pressed.solves())
    )
    yield write_report(folder / "report.html", [chapter, pressed_chapter]).as_uri()


@contextmanager
def growth(folder: Path) -> Iterator[str]:
    recorder, inputs = GrowthRecorder(), [Range(name, 0.0, 1.0, "m") for name in "abc"]
    X = np.random.default_rng(0).uniform(size=(60, 3))
    learn(X, np.sin(4 * X[:, :1]), inputs, [Quantity("p", "J")], settings=PRESETS["mran"](), watch=recorder)
    yield write_growth_page(folder / "growth.html", recorder, "a body").as_uri()


PAGES: dict[str, tuple[Callable[[Path], AbstractContextManager[str]], str]] = {
    "beam": (lambda _: served(arc_beam()), "html[data-tick][data-tip]"),
    "pressed body": (lambda _: served(touched_slab()), "html[data-tick][data-middle]"),
    "pad": (lambda _: served(pad()), "html[data-tick][data-tip]"),
    "device": (lambda _: served(touched_slab(), device="stroke"), "html[data-tick][data-middle]"),
    "solved body": (solved, 'html[data-drawn="0"]'),
    "part": (chosen_part, "html[data-partdrawn]"),
    "solved part": (solved_part, "html[data-partdrawn]"),
    "learnt part": (learnt_part, "html[data-tick][data-middle]"),
    "one file": (one_file, "html[data-middle]"),
    "report": (report, "footer"),
    "growth": (growth, "#time"),
}
"""Each page that there is, and what it has once it is drawn."""

SMALL = """(least) => {
    const targets = [...document.querySelectorAll("button, select, input, summary, a[href]")];
    const box = (e) => ((/checkbox|radio/.test(e.type) && e.closest("label")) || e).getBoundingClientRect();
    const inText = (e) => e.matches("p a, li a, dd a, figcaption a");  // a line of text is no target of its own
    return targets
        .filter((e) => e.checkVisibility() && !inText(e))
        .map((e) => [e.id || e.outerHTML.slice(0, 80), box(e).width, box(e).height])
        .filter(([, width, height]) => width < least || height < least);
}"""
WIDE = """() => [...document.body.querySelectorAll("*")]
    .filter((e) => e.checkVisibility() && !e.closest(".scroll, svg, pre"))
    .filter((e) => e.getBoundingClientRect().right > innerWidth + 0.5)
    .map((e) => e.id || e.outerHTML.slice(0, 80))"""
FIRST = """() => [...document.querySelectorAll("button, select, input, summary, a[href], [tabindex='0']")]
    .find((e) => e.checkVisibility() && !e.disabled).id"""


def opened(browser: Browser, url: str, ready: str, **options: object) -> Page:
    page = browser.new_context(**options).new_page()
    page.goto(url)
    page.wait_for_selector(ready, state="attached")
    for details in page.locator("details").all():
        details.evaluate("d => d.open = true")
    return page


@pytest.mark.parametrize("name", PAGES)
def test_a_page_fits_a_phone_and_a_finger(browser: Browser, tmp_path: Path, keep, name: str):
    make, ready = PAGES[name]
    with make(tmp_path) as url:
        page = opened(browser, url, ready, viewport=PHONE, has_touch=True, is_mobile=True)
        keep(page, f"phone {name}")
        assert page.evaluate("innerWidth") == PHONE["width"], "a phone shows no page smaller than it is"
        assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
        assert page.evaluate(WIDE) == []
        assert page.evaluate(SMALL, FINGER) == []
        if name in TOUCHED:
            assert page.evaluate(FIRST) == "stop"
        page.context.close()
