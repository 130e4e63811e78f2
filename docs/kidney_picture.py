"""Draws the pressed kidney of the README, still and moving: python docs/kidney_picture.py [PAGE].

PAGE is an exported page, at first that of the gallery: docs/build --only kidney makes it. Chromium opens the page, and
the mouse presses the kidney and lets it go, as a person would.
"""

from __future__ import annotations

import io
import itertools
import shutil
import sys
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

DOCS = Path(__file__).parent
PAGE = DOCS.parent / "build" / "docs" / "gallery" / "kidney" / "kidney-page.html"
STILL, MOVING = DOCS / "images" / "pressed-kidney.png", DOCS / "images" / "pressed-kidney.webp"
SIZE = {"width": 960, "height": 600}  # px, of the window
WIDTH = 720  # px, of the moving picture
PAUSE = 90  # ms between two pictures of the moving one
WAY = (
    (0.0, 0.0),
    (-0.06, -0.01),
    (0.0, 0.02),
    (0.06, 0.02),
)  # of the mouse, from the middle, as shares of the width
STEPS = 8  # pictures from one place of the way to the next
NOTCHES = 9  # of the wheel: how much deeper than at first the ball goes
ARGUMENTS = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def main() -> None:
    """Press the kidney, and write both pictures."""
    page = Path(sys.argv[1]) if len(sys.argv) > 1 else PAGE
    if not page.is_file():
        sys.exit(f"{page} is not there: docs/build --only kidney makes it")
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=[*ARGUMENTS])
        opened = chromium.new_page(viewport=SIZE)
        opened.goto(page.resolve().as_uri())
        opened.wait_for_function("document.documentElement.dataset.middle !== undefined")
        opened.wait_for_timeout(500)  # ms: the picture stands
        pictures = _press(opened)
        chromium.close()
    deepest = pictures[NOTCHES]  # the mouse is still in the middle
    deepest.save(STILL, optimize=True)
    small = [each.resize((WIDTH, WIDTH * SIZE["height"] // SIZE["width"])) for each in pictures]
    moving = io.BytesIO()  # written at once: an interruption leaves the picture before
    small[0].save(moving, "webp", save_all=True, append_images=small[1:], duration=PAUSE, loop=0, quality=70)
    MOVING.write_bytes(moving.getvalue())


def _press(page: Page) -> list[Image.Image]:
    """Lead the mouse along its way with the button held, and return the pictures."""
    x, y = (float(part) for part in page.evaluate("document.documentElement.dataset.middle").split()[:2])
    wide = SIZE["width"]
    places = [(x + wide * across, y + wide * up) for across, up in WAY]
    pictures = [_picture(page)]
    page.mouse.move(*places[0])
    page.mouse.down()
    for _ in range(NOTCHES):
        page.mouse.wheel(0, 100)
        page.wait_for_timeout(60)
        pictures.append(_picture(page))
    page.wait_for_timeout(1500)  # ms: what stands still is drawn finely
    pictures[-1] = _picture(page)
    for begin, end in itertools.pairwise(places):
        for step in range(1, STEPS + 1):
            share = step / STEPS
            page.mouse.move(*(a + share * (b - a) for a, b in zip(begin, end, strict=True)))
            page.wait_for_timeout(60)
            pictures.append(_picture(page))
    page.mouse.up()
    for _ in range(STEPS):
        page.wait_for_timeout(60)
        pictures.append(_picture(page))
    return pictures


def _picture(page: Page) -> Image.Image:
    return Image.open(io.BytesIO(page.screenshot())).convert("RGB")


if __name__ == "__main__":
    main()
