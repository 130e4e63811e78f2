"""Driving the page in Chromium: open it, read what it shows, pull on the tip, compare with the network.

Chromium draws in software here; every wait is for a state and not for a time.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from palpate.runtime.touchable import touchable
from palpate.surrogates import Surrogate
from palpate.viewer import Viewer

ARGUMENTS = [
    "--no-sandbox",  # the tests may run as root, in a container
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",  # without a GPU putting the page together takes most of a core, at rest too
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]

DRAGS: dict[Page, tuple[float, float, int]] = {}  # the last one of each page

READ = """() => ({
    data: {...document.documentElement.dataset},
    text: Object.fromEntries([...document.querySelectorAll("output[id]")].map(o => [o.id, o.textContent])),
    flags: [...document.querySelectorAll("#flags li")].map(li => li.dataset.flag),
    withheld: document.documentElement.dataset.hold === "1" &&
        document.getElementById("reason-words").textContent.includes("take hold again"),
})"""


def open_page(
    browser: Browser, viewer: Viewer, complaints: list[str], ready: str = "tip", **options: Any
) -> Page:
    """The page of a viewer, in a context of its own; errors and foreign requests go to `complaints`."""
    options.setdefault("viewport", {"width": 860, "height": 520})
    page = browser.new_context(**options).new_page()
    page.on("console", lambda m: complaints.append(m.text) if m.type in {"error", "warning"} else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    local = (viewer.address, "data:", "blob:")
    page.on("request", lambda r: None if r.url.startswith(local) else complaints.append(f"asks {r.url}"))
    page.goto(viewer.url)
    page.wait_for_selector(f"html[data-tick][data-{ready}]")
    return page


def open_file(browser: Browser, file: Path) -> tuple[Page, list[str]]:
    """The page of a file in a browser without a network, and what the browser complains of."""
    page, complaints = (
        browser.new_context(viewport={"width": 1200, "height": 800}, offline=True).new_page(),
        [],
    )
    page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on(
        "request",
        lambda request: (
            None if request.url.startswith(("file:", "data:", "blob:")) else complaints.append(request.url)
        ),
    )
    page.goto(file.as_uri())
    page.wait_for_function("['middle', 'tip'].some((place) => place in document.documentElement.dataset)")
    return page, complaints


def assert_no(complaints: list[str]) -> None:
    # what software rendering says of its own slowness is no fault of the page
    assert [c for c in complaints if "GPU stall due to ReadPixels" not in c] == []


def tip(page: Page) -> tuple[float, float]:
    """Where the ball at the tip is, px."""
    x, y = page.evaluate("document.documentElement.dataset.tip").split()
    return float(x), float(y)


def vector(data: dict[str, str], name: str) -> np.ndarray:
    return np.array([float(v) for v in data[name].split()])


def number(text: str) -> float:
    return float(text.replace("−", "-"))


def settled(page: Page, flag: str = "") -> dict[str, Any]:
    """What the page shows once body and force have stood still for 0.1 s, with `flag` among the flags."""
    was = page.evaluate(READ)
    for _ in range(400):
        page.wait_for_timeout(40)
        now = page.evaluate(READ)
        if now["withheld"]:
            hold_again(page)
            was = page.evaluate(READ)
            continue
        still = all(now["data"][k] == was["data"][k] for k in ("position", "contact", "force", "grabbed"))
        if not still or "stalled" in now["flags"] or (flag and flag not in now["flags"]):
            was = now
        elif float(now["data"]["time"]) >= float(was["data"]["time"]) + 0.1:
            return now
    pytest.fail(f"the page did not settle: {was}")


def let_go(page: Page) -> dict[str, Any]:
    """What the page shows once nobody holds the body and that is all it says; the body may still swing.

    That there were faults before, as on a busy machine where an input stalled, stays among the flags.
    """
    now = "shown.flags.filter(flag => flag !== 'faults').join()"
    free = f"() => {{ const shown = ({READ})(); return {now} === 'free' && shown; }}"
    return page.wait_for_function(free).json_value()


def hold_again(page: Page) -> None:
    """Let go and do the last drag, or press, again: the machine was so busy that the input stalled."""
    page.mouse.up()
    page.wait_for_function("() => document.documentElement.dataset.grabbed === 'false'")
    page.wait_for_timeout(300)
    if page in DRAGS:
        drag(page, *DRAGS[page])
    else:
        page.mouse.down()


def drag(page: Page, dx: float, dy: float, steps: int = 6) -> None:
    """Grab the tip with the mouse and pull it; the button stays down."""
    DRAGS[page] = (dx, dy, steps)
    x, y = tip(page)
    page.mouse.move(x, y)
    page.mouse.down()
    for i in range(1, steps + 1):
        page.mouse.move(x + dx * i / steps, y + dy * i / steps)


def check_force(model: Surrogate, shown: dict[str, Any], parameters: np.ndarray) -> None:
    """The numbers on the page are the network's own answer at the hand shown."""
    body, position = touchable(model), vector(shown["data"], "position")
    evaluator = body.evaluator()
    evaluator.place(position, holding=True, believed=True)
    evaluator(position, parameters)
    # three decimals on the page, and a position rounded to 32 bits at the largest stiffness
    slack = 0.5e-3 + 1e-6 + body.reach * 2**-23 * body.stiffness_max
    force = [number(shown["text"][f"force-{c}"]) for c in "xy"]
    assert np.allclose(force, evaluator.force[:2], rtol=0, atol=slack)
    assert number(shown["text"]["force-norm"]) == pytest.approx(np.linalg.norm(evaluator.force), abs=slack)
    moved = [number(shown["text"][f"tip-{c}"]) / 1000 for c in "xy"]
    assert np.allclose(moved, evaluator.contact[:2], rtol=0, atol=0.05e-3 + 1e-6)
