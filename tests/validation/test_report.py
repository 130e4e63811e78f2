"""The report as a page: complete, self-contained, safe with hostile names, the same for the same data."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

from linear_bodies import history, nonsense, plane_data, plane_model, tip_data, tip_model, with_network
from palpate.errors import UsageError
from palpate.validation import Chapter, Limits, validate, write_report
from palpate.validation.report.style import INK

HOSTILE = '<script>window.hacked = 1</script> $\\frac{1}$ "&amp;'
FIGURES = ("shapes", "errors", "growth", "force", "outer", "felt")


def chapter(name: str = "beam", *, limits: Limits | None = None, **changes: Any) -> Chapter:
    touch, data = tip_model(shift=1e-6, slope=1e-7, force=0.999), tip_data()
    validation = validate(touch, data, history=history(), limits=limits)
    made = Chapter(
        name,
        touch,
        data.every(3),
        validation,
        train=data,
        history=history(),
        timings={"sweep": 1.5, "learn": 0.25},
    )
    return dataclasses.replace(made, **changes)


def plane_chapter() -> Chapter:
    touch, data = plane_model(), plane_data()
    return Chapter("plane", touch, data, validate(touch, data), train=data, history=history(heldout=()))


def hostile_chapter() -> Chapter:
    touch, data = tip_model(name=HOSTILE), tip_data(name=HOSTILE)
    return chapter(
        HOSTILE,
        model=touch,
        train=data,
        test=data,
        validation=validate(touch, data, limits=Limits(rmse=1e-30)),
        rivals={HOSTILE: history()},
        settings={HOSTILE: {HOSTILE: [HOSTILE, 1.0, None, True]}},
        timings={HOSTILE: 1.0},
        provenance={HOSTILE: HOSTILE},
    )


class Reader(HTMLParser):
    """Elements with their attributes, and all text outside style."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.text = ""
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {k: v or "" for k, v in attrs}))

    def handle_data(self, data: str) -> None:
        self.text += data

    def all(self, tag: str) -> list[dict[str, str]]:
        return [attrs for name, attrs in self.elements if name == tag]


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two bodies, two loads, a rival, a miss and hostile names, in one page."""
    chapters = [
        chapter(rivals={"founding form": history()}),
        plane_chapter(),
        chapter("too coarse", limits=Limits(rmse=1e-9)),
        hostile_chapter(),
    ]
    folder = tmp_path_factory.mktemp("report")
    return write_report(folder / "new" / "report.html", chapters, machine={"processor": HOSTILE, "cores": 2})


@pytest.fixture(scope="module")
def read(report: Path) -> Reader:
    return Reader(report.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def browser(chromium: str) -> Iterator[Browser]:
    with sync_playwright() as playwright:
        # the tests may run as root, in a container
        running = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        yield running
        running.close()


@pytest.mark.full
def test_nothing_comes_from_elsewhere(report: Path, read: Reader) -> None:
    page = re.sub(r'"data:image/png;base64,[^"]*"', "", report.read_text(encoding="utf-8"))
    assert not re.search(r"https?:|//[a-z]|@import|url\((?!#)", page)
    for tag, attrs in read.elements:
        assert tag not in {"script", "iframe", "object", "embed"}
        for name in ("src", "href", "xlink:href"):
            assert attrs.get(name, "#").startswith(("#", "data:"))
    assert report.stat().st_size < 3e6
    assert [p.name for p in report.parent.iterdir()] == ["report.html"]


def test_every_figure_is_there_and_speaks(read: Reader) -> None:
    figures = [attrs["id"] for attrs in read.all("figure")]
    assert figures == [f"c{i}-{name}" for i in (1, 2, 3, 4) for name in FIGURES]
    drawn = read.all("svg")
    assert len(drawn) == len(figures)
    assert all(attrs["role"] == "img" and len(attrs["aria-label"]) > 40 for attrs in drawn)


def test_names_inside_the_page_are_unique_and_lead_somewhere(read: Reader) -> None:
    ids = [attrs["id"] for _, attrs in read.elements if "id" in attrs]
    assert len(ids) == len(set(ids))
    wanted = {attrs["href"][1:] for _, attrs in read.elements if attrs.get("href", "").startswith("#")}
    for _, attrs in read.elements:
        for value in attrs.values():
            wanted.update(re.findall(r"url\(#([^)]*)\)", value))
    assert len(wanted) > 100
    assert wanted <= set(ids)


def test_every_element_is_closed(read: Reader) -> None:
    """Text of the last element would be swallowed by an open one."""
    assert read.text.rstrip().endswith("a person gains nothing.")


def test_hostile_names_are_only_text(read: Reader) -> None:
    assert not read.all("script")
    assert read.text.count(HOSTILE) > 10
    assert any(HOSTILE in attrs["aria-label"] for attrs in read.all("svg"))


def test_ink_becomes_the_page_s_text_colour(report: Path) -> None:
    page = report.read_text(encoding="utf-8")
    assert INK not in page
    assert "currentColor" in page


def test_a_miss_is_told_on_the_page(read: Reader) -> None:
    assert read.text.count("What was missed") == 2
    assert "1 of 7 limits missed" in read.text
    assert "Every limit kept" in read.text


def test_keys_of_a_study_file_are_set_as_code(report: Path, read: Reader) -> None:
    assert "<code>units_max</code>" in report.read_text(encoding="utf-8")
    assert "`" not in read.text


def test_tables_hold_what_was_given(read: Reader) -> None:
    for words in (
        "sweep",
        "1.5 s",
        "250\N{NO-BREAK SPACE}ms",
        "problem.body.length",
        "founding form",
        "window",
    ):
        assert words.replace("\N{NO-BREAK SPACE}", " ") in read.text.replace("\N{NO-BREAK SPACE}", " ")


@pytest.mark.full
def test_the_same_data_give_the_same_page(tmp_path: Path) -> None:
    pages = [write_report(tmp_path / f"{i}.html", [chapter()]).read_bytes() for i in (1, 2)]
    assert pages[0] == pages[1]


@pytest.mark.full
def test_a_network_that_answers_nonsense_can_be_reported(tmp_path: Path) -> None:
    """Not-a-number at every node: the page comes, and says that a limit was missed."""
    touch, data = tip_model(), tip_data()
    touch = with_network(touch, "nodes", nonsense(touch.fields["nodes"].network))
    validation = validate(touch, data, limits=Limits())
    page = write_report(tmp_path / "nan.html", [chapter(model=touch, validation=validation)])
    assert "not a number" in page.read_text(encoding="utf-8")
    assert not validation.passed


def test_a_report_tells_of_something(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="at least one chapter"):
        write_report(tmp_path / "empty.html", [])


def test_a_report_that_cannot_be_written_says_so(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="Could not write"):
        write_report(tmp_path / "file" / "report.html", [chapter()])
    (tmp_path / "taken").mkdir()
    with pytest.raises(UsageError, match="Could not write"):
        write_report(tmp_path / "taken", [chapter()])
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "taken"]


def visit(browser: Browser, report: Path, width: int, scheme: Any) -> tuple[Page, list[str]]:
    complaints: list[str] = []
    page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
    page.on("console", lambda message: complaints.append(message.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda r: None if r.url.startswith(("file:", "data:")) else complaints.append(r.url))
    page.goto(report.as_uri())
    return page, complaints


@pytest.mark.grid
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1200])
def test_a_browser_shows_it_without_complaint(
    browser: Browser, report: Path, width: int, scheme: str
) -> None:
    page, complaints = visit(browser, report, width, scheme)
    found = page.evaluate(
        """() => ({
            wide: document.documentElement.scrollWidth,
            hacked: "hacked" in window,
            figures: [...document.querySelectorAll("figure svg")].map(s => s.getBoundingClientRect().height),
            pictures: [...document.querySelectorAll("svg image")].map(i => i.getBoundingClientRect().width),
            scrolled: [...document.querySelectorAll("figure .scroll")]
                .filter(s => s.scrollWidth > s.clientWidth).length,
            ink: getComputedStyle(document.body).color,
            text: getComputedStyle(document.querySelector("svg text")).fill,
        })"""
    )
    assert found["wide"] <= width
    assert not found["hacked"]
    assert len(found["figures"]) == 24
    if width == 1200:
        assert found["scrolled"] == 0
    assert min(found["figures"]) > 60
    assert len(found["pictures"]) > 6
    assert min(found["pictures"]) > 1
    assert found["ink"] == found["text"]
    assert complaints == []
    page.close()


@pytest.mark.full
def test_text_stands_out_from_its_ground(browser: Browser, report: Path) -> None:
    """Contrast of at least 4.5 to 1 for all running text, in both schemes (WCAG 2.2, 1.4.3)."""
    for scheme in ("light", "dark"):
        page, _ = visit(browser, report, 1200, scheme)
        pairs = page.evaluate(
            """() => [...document.querySelectorAll("p, dt, dd, th, td, li, figcaption, .grade, svg text")].map(e => {
                let ground = e, style = getComputedStyle(e);
                while (ground && getComputedStyle(ground).backgroundColor === "rgba(0, 0, 0, 0)")
                    ground = ground.parentElement;
                const ink = e instanceof SVGElement ? style.fill : style.color;
                return [ink, getComputedStyle(ground || document.body).backgroundColor];
            })"""
        )
        worst = min(contrast(a, b) for a, b in {tuple(p) for p in pairs})
        assert worst >= 4.5, scheme
        page.close()


def contrast(a: str, b: str) -> float:
    """Ratio of relative luminances of two CSS colours."""
    light = sorted((luminance(a), luminance(b)), reverse=True)
    return (light[0] + 0.05) / (light[1] + 0.05)


def luminance(colour: str) -> float:
    parts = [float(v) / 255 for v in re.findall(r"[\d.]+", colour)[:3]]
    linear = [v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
