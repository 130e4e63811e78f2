"""Size, opening and time of a picture of a body as one HTML file, in Chromium and from disk.

    python -m benchmarks.page_speed [--quick] [--json]

An organ of 20,000 vertices with 16 modes: an ellipsoid with a waist, an uneven mesh, a curved touched surface, 320
units, and modes of made-up dents by proper orthogonal decomposition. The page is opened from disk without a network,
pressed, and led over the body. Each picture's script is timed by the page's own clock around everything that the
browser calls for it: the pointer, the evaluator, the field, normals, colours, panel and the calls to WebGL; what the
graphics processor does is not in it. The browser's trace tells how much of that time the script had the processor.
"""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import Browser, Page, sync_playwright
from scipy.spatial import ConvexHull

from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.network import Network, Scaling, TrainedRegion
from palpate.surrogates import (
    ContactBaseline,
    ContactLaw,
    Continuation,
    FieldSurrogate,
    LearntEnergy,
    Surrogate,
    TouchedSurface,
)
from palpate.surrogates.fields import DepthAmplitude, LocalMode
from palpate.surrogates.fields.local_mode import design
from palpate.units import Quantity, Range, bounds
from palpate.viewer.file_page import export_html

__all__ = ["organ", "tables"]

VERTICES, MODES, UNITS = 20_000, 16, 320
RADIUS, DEEPEST = 0.006, 0.008
AXES = np.array([0.055, 0.032, 0.026])  # m, half of a kidney's size
SNAPSHOTS = 300
SIZE, OPENING, PICTURE = 5.0, 1.0, 4.0  # MB, s, ms
VIEWPORT = {"width": 900, "height": 560}  # small, since software draws it
OPENED, LED = 5, 400  # pages that are opened, and pictures that are timed


def organ(vertices: int = VERTICES, modes: int = MODES) -> Surrogate:
    """Return an organ with a field on so many vertices through so many modes; the same each time."""
    points, triangles = _mesh(vertices)
    surface = TouchedSurface.of(points, triangles, radius=RADIUS)
    energy = _energy(surface)
    return Surrogate(
        energy, {"displacement": _field(energy, points, triangles, modes)}, meta={"name": "organ"}
    )


def _mesh(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points (n, 3) of a closed surface and its triangles (t, 3), as uneven as a mesher's."""
    rng, k = np.random.default_rng(0), np.arange(count)
    z, turn = 1.0 - 2.0 * (k + 0.5) / count, np.pi * (1.0 + np.sqrt(5.0)) * k
    ball = np.column_stack([np.sqrt(1.0 - z * z) * np.cos(turn), np.sqrt(1.0 - z * z) * np.sin(turn), z])
    ball += rng.normal(0.0, 0.25 * np.sqrt(4.0 * np.pi / count), ball.shape)
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    triangles = ConvexHull(ball).simplices.astype(np.int64)
    a, b, c = np.moveaxis(ball[triangles], 1, 0)
    inward = np.einsum("ti,ti->t", np.cross(b - a, c - a), a) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    waist = 1.0 - 0.18 * np.exp(-((ball[:, 0] / 0.35) ** 2)) * (ball[:, 1] > 0) * ball[:, 1] ** 2
    order = rng.permutation(count)  # a mesher's numbers follow nothing
    place = np.argsort(order)
    return np.ascontiguousarray((ball * waist[:, None] * AXES)[order]), place[triangles]


def _energy(surface: TouchedSurface) -> LearntEnergy:
    """Return an energy of so many units over the upper half of the body."""
    rng, high = np.random.default_rng(1), AXES + RADIUS
    inputs = tuple(
        Range(f"c_{axis}", -high[i] if i < 2 else 0.25 * high[2], high[i], "m")
        for i, axis in enumerate("xyz")
    )
    low, top = bounds(inputs)
    network = Network.axis_aligned(
        inputs,
        [Quantity("ln U/U0")],
        centres=rng.uniform(-1.2, 1.2, (UNITS, 3)),
        widths=rng.uniform(0.5, 1.5, (UNITS, 3)),
        weights=rng.normal(0.0, 0.01, (1, UNITS)),
        tail=np.array([[6.0, 0.1, 0.0, -0.1]]),
        scaling=Scaling((low + top) / 2, (top - low) / 2, np.zeros(1), np.ones(1)),
    )
    region = TrainedRegion.of(rng.uniform(-1.0, 1.0, (2048, 3)))
    baseline = ContactBaseline(ContactLaw("series", 1e-3), surface, RADIUS)
    return LearntEnergy(network, baseline, region, Continuation.of(inputs, deepest=DEEPEST))


def _field(energy: LearntEnergy, points: np.ndarray, triangles: np.ndarray, count: int) -> FieldSurrogate:
    """Return a displacement whose modes are those of made-up snapshots, beside a dent that moves with the probe."""
    rng, surface = np.random.default_rng(2), energy.baseline.surface
    assert surface is not None
    nodes = len(points)
    normals = surface.at(points)[1]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    values = np.zeros((SNAPSHOTS, nodes, 3))
    for snapshot in values:
        foot = rng.choice(np.flatnonzero(points[:, 2] > 0))
        far = np.linalg.norm(points - points[foot], axis=1)
        push = -DEEPEST * normals[foot]
        for width, share in ((0.008, 0.15), (0.02, 0.3), (0.05, 0.3)):
            snapshot += share * np.exp(-((far / width) ** 2))[:, None] * push if width > 0.01 else 0.0
        bulge = 0.06 * DEEPEST * np.exp(-(((far - 0.025) / 0.015) ** 2))[:, None] * normals
        snapshot[:] = snapshot + bulge
        snapshot *= (
            np.clip((points[:, 2] + AXES[2]) / AXES[2], 0.0, 1.0)[:, None] ** 0.5
        )  # it lies on its bed
    mass = np.full(nodes, 1.0 / nodes)
    _, sizes, rows = np.linalg.svd(values.reshape(SNAPSHOTS, -1), full_matrices=False)
    modes = rows[:count].reshape(count, nodes, 3) * np.sqrt(nodes)
    typical = sizes[:count] / np.sqrt(SNAPSHOTS * nodes)
    low, high = bounds(energy.inputs)
    network = Network.axis_aligned(
        energy.inputs,
        [Quantity(f"b{k}", "m") for k in range(count)],
        centres=rng.uniform(-1, 1, (40, 3)),
        widths=np.ones((40, 3)),
        weights=rng.normal(0.0, 0.3, (count, 40)),
        tail=rng.normal(0.0, 0.3, (count, 4)),
        scaling=Scaling((low + high) / 2, (high - low) / 2, np.zeros(count), typical),
    )
    return FieldSurrogate(
        "displacement",
        "m",
        network,
        modes,
        np.zeros((nodes, 3)),
        points,
        triangles,
        mass,
        DepthAmplitude("series", DEEPEST, 1e-3),
        surface,
        RADIUS,
        local_mode=LocalMode(_dent(), 0.02, 5e-4),
    )


def _dent() -> np.ndarray:
    """Return splines of a dent that narrows with the depth, and draws its rim in a little."""
    rho, r, q = np.linspace(0.0, 0.999, 200), 14, 6
    table, some = np.zeros((2, r, q)), design(rho * (r - 3), r)[:, :-3]
    for j in range(q):
        dent = np.exp(-((rho * 0.02 / (0.006 - 0.0002 * j)) ** 2))
        table[0, :-3, j] = -0.5 * DEEPEST * np.linalg.lstsq(some, dent, rcond=None)[0]
    table[1] = -0.1 * table[0]
    return table


WATCH = """
window.pictures = [];
window.drawn = []; // the browser's numbers of those pictures
window.opened = null;
window.lead = null; // while set, the pointer is at another place of the canvas in each picture
const ask = window.requestAnimationFrame.bind(window);
window.requestAnimationFrame = (draw) => {
  const id = ask((time) => {
    const { dataset } = document.documentElement;
    delete dataset.summed;
    const begun = performance.now();
    if (window.lead !== null) window.lead();
    draw(time);
    const ended = performance.now();
    if (dataset.summed !== undefined) { // the body was drawn anew
      window.pictures.push(ended - begun);
      window.drawn.push(id);
    }
    if (window.opened === null && dataset.middle !== undefined) window.opened = ended;
  });
  return id;
};
"""
LEAD = """([x, y]) => {
  const canvas = document.getElementById("view");
  let step = 0;
  window.lead = () => {
    step += 1;
    const at = { clientX: x + 50 * Math.sin(0.2 * step), clientY: y + 25 * Math.sin(0.13 * step) };
    const held = { pointerId: 1, pointerType: "mouse", buttons: 1, bubbles: true };
    canvas.dispatchEvent(new PointerEvent("pointermove", { ...at, ...held }));
  };
}"""
ARGUMENTS = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


@dataclass(frozen=True)
class _Seen:
    """What was measured of one page.

    Attributes
    ----------
    opening : float
        From navigation to the first picture, s.
    pictures, work : (n,)
        Time of each picture's script by the page's clock, and on the processor, ms.
    complaints : tuple of str
        What the browser complained of.
    """

    opening: float
    pictures: np.ndarray
    work: np.ndarray
    complaints: tuple[str, ...]


def _open(browser: Browser, page_file: Path, pictures: int) -> _Seen:
    """Open a page from disk, press it, and lead the probe over it for so many pictures."""
    context = browser.new_context(viewport=VIEWPORT, offline=True)
    page, complaints = context.new_page(), []
    page.on("console", lambda m: complaints.append(m.text) if "GPU stall" not in m.text else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    own = ("file:", "data:", "blob:")
    page.on("request", lambda r: None if r.url.startswith(own) else complaints.append(f"asks {r.url}"))
    page.add_init_script(WATCH)
    page.goto(page_file.as_uri(), wait_until="commit")
    page.wait_for_function("window.opened !== null", timeout=60_000)
    opening = page.evaluate("window.opened") / 1e3
    times = work = np.zeros(0)
    if pictures:
        x, y = map(float, page.evaluate("document.documentElement.dataset.middle").split())
        page.mouse.move(x, y)
        page.mouse.down()
        page.wait_for_function("document.documentElement.dataset.sinking === 'false'", timeout=60_000)
        browser.start_tracing(page=page, categories=["devtools.timeline"])
        page.evaluate("window.pictures.length = window.drawn.length = 0")
        page.evaluate(LEAD, [x, y])
        page.wait_for_function(f"window.pictures.length >= {pictures}", timeout=240_000, polling=200)
        events = json.loads(browser.stop_tracing())["traceEvents"]
        times, work = np.array(page.evaluate("window.pictures")), _on_processor(events, page)
    context.close()
    return _Seen(opening, times, work, tuple(complaints))


def _on_processor(events: list[dict[str, Any]], page: Page) -> np.ndarray:
    """Return the processor's time (n,) of the pictures that were drawn, ms, from a browser's trace."""
    drawn = set(page.evaluate("window.drawn"))
    return np.array(
        [
            event["tdur"] / 1e3
            for event in events
            if event["name"] == "FireAnimationFrame"
            and "tdur" in event
            and event["args"]["data"]["id"] in drawn
        ]
    )


def tables(*, quick: bool) -> list[Table]:
    """Return the table of one page: its size, its opening, its pictures."""
    body = organ(2000, 4) if quick else organ()
    with tempfile.TemporaryDirectory() as folder, _browser() as browser:
        done = export_html(body, Path(folder) / "organ.html")
        size = done.file.stat().st_size / 1e6
        opened = [_open(browser, done.file, 0) for _ in range(1 if quick else OPENED)]
        led = _open(browser, done.file, 20 if quick else LED)
    seen = [*opened, led]
    opening, pictures = float(np.median([one.opening for one in seen])), led.pictures
    complaints = sorted({words for one in seen for words in one.complaints})
    middle, work = float(np.median(pictures)), float(np.median(led.work))
    figures = [
        ("size of the file, MB", size, SIZE),
        ("from navigation to the first picture with the body on it, median, s", opening, OPENING),
        ("the same, slowest, s", max(one.opening for one in seen), None),
        ("script of a picture, median, ms", middle, PICTURE),
        ("script of a picture, 95th percentile, ms", float(np.quantile(pictures, 0.95)), None),
        ("the same on the processor, median, ms", work, PICTURE),
        ("the same on the processor, 95th percentile, ms", float(np.quantile(led.work, 0.95)), None),
        ("complaints on the console, and requests", float(len(complaints)), 0.0),
    ]
    rows = [{"what": what, "value": value, "most": most} for what, value, most in figures]
    claims = [
        Claim("size, MB", (size,), SIZE, ".2f"),
        Claim("opening, median, s", (opening,), OPENING, ".2f"),
        Claim("script of a picture, median, ms", (middle,), PICTURE, ".1f"),
        Claim("script of a picture on the processor, median, ms", (work,), PICTURE, ".1f"),
        Claim("complaints and requests", (float(len(complaints)),), 0.0, ".0f"),
    ]
    notes = (
        f"an organ of {VERTICES:,} vertices and {MODES} modes, {UNITS} units, touched anywhere on its upper half",
        f"Chromium without a graphics processor: its own software draws, beside the script; {len(pictures)} pictures",
        "that makes few pictures a second, so the curve and the numbers, anew ten times a second, are in nearly each",
        "the page's clock runs on while other programs of a busy machine have the core; the processor's time does not",
        *complaints,
    )
    columns = (
        Column("what", "of one page"),
        Column("value", "measured", ".2f"),
        Column("most", "wanted, at most", ".0f"),
    )
    claims = [] if quick else claims
    return [Table("page_speed", f"A body as one HTML file{quick_mark(quick)}", columns, rows, claims, notes)]


@contextmanager
def _browser() -> Iterator[Browser]:
    """Return a Chromium that draws in software."""
    path = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=path, args=list(ARGUMENTS))
        yield running
        running.close()


if __name__ == "__main__":
    sys.exit(main(only="page_speed"))
