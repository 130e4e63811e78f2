"""A body that bends far, a viewer that shows it, and a browser that looks."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from bodies import arc_beam
from chromium_page import ARGUMENTS, assert_no, open_page, settled
from playwright.sync_api import Browser, Page, sync_playwright

from palpate.surrogates import Surrogate
from palpate.viewer import Viewer, page_model


@pytest.fixture(scope="session")
def rod() -> Surrogate:
    return arc_beam()


@pytest.fixture(scope="package")  # its loop runs at 1 kHz: not beside other folders' tests
def viewer(rod: Surrogate) -> Iterator[Viewer]:
    with Viewer(rod, port=0) as running:
        yield running


@pytest.fixture(scope="module")
def brief_swing() -> Iterator[None]:
    """The swing back to rest takes 0.2 s instead of two, for tests that only wait for its end."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page_model, "FREQUENCY", 10 * page_model.FREQUENCY)
        yield


@pytest.fixture(scope="module")
def browser(chromium: str, brief_swing: None) -> Iterator[Browser]:
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=chromium, args=ARGUMENTS)
        yield running
        running.close()


@pytest.fixture
def complaints() -> list[str]:
    """What the browser complained of; a test that expects something empties it."""
    return []


@pytest.fixture
def visit(browser: Browser, complaints: list[str]) -> Iterator[Callable[..., Page]]:
    """Open the page of a viewer; afterwards there must be no complaint."""
    pages: list[Page] = []

    def one(viewer: Viewer, **options: Any) -> Page:
        pages.append(open_page(browser, viewer, complaints, **options))
        settled(pages[-1])  # the body may still swing from the test before
        return pages[-1]

    yield one
    for page in pages:
        page.context.close()
    assert_no(complaints)


@pytest.fixture(scope="module")
def kept_open(browser: Browser, viewer: Viewer) -> Iterator[tuple[Page, list[str]]]:
    found: list[str] = []
    page = open_page(browser, viewer, found)
    yield page, found
    page.context.close()


@pytest.fixture
def page(kept_open: tuple[Page, list[str]]) -> Iterator[Page]:
    """One page for all tests that leave it as they found it: opening costs a second of shader compilation."""
    settled(kept_open[0], "free")
    yield kept_open[0]
    assert_no(kept_open[1])
    kept_open[1].clear()


@pytest.fixture(scope="session")
def keep() -> Callable[[Page, str], None]:
    """Keep a screenshot, where the variable PALPATE_SCREENSHOTS names a folder."""
    if (folder := os.environ.get("PALPATE_SCREENSHOTS")) is None:
        return lambda page, name: None
    return lambda page, name: page.screenshot(path=Path(folder) / f"{name}.png") and None


@pytest.fixture
def visit_pressed(browser: Browser, complaints: list[str]) -> Iterator[Callable[[Surrogate], Page]]:
    """Open the page of a body that is pressed; afterwards there must be no complaint."""
    with contextlib.ExitStack() as stack:

        def one(body: Surrogate) -> Page:
            running = stack.enter_context(Viewer(body, port=0))
            page = open_page(browser, running, complaints, "middle")
            stack.callback(page.context.close)
            return page

        yield one
    assert_no(complaints)
