"""The page of `palpate touch` in a real browser: a part is set up on it, watched while it is learnt, and touched."""

from __future__ import annotations

import dataclasses
import io
import math
import re
from collections.abc import Iterator
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
import trimesh
from chromium_page import READ, assert_no, hold_again, vector
from playwright.sync_api import Browser, Page
from slabs import DEVIATION, touched_slab

from palpate.errors import UsageError
from palpate.study import Study
from palpate.study.part_choices import chosen_study, shown_part
from palpate.study.part_study import part_study
from palpate.surrogates import Surrogate
from palpate.units import parse_quantity
from palpate.viewer.part_page import PartPage, Progress, serve_part
from palpate.viewer.shown_part import PartChoices, ShownPart

pytestmark = [pytest.mark.full, pytest.mark.timeout(180)]

LENGTH, WIDTH, HEIGHT = 40.0, 30.0, 20.0  # mm, of a box with 12 triangles


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    path = tmp_path_factory.mktemp("part") / "pad.stl"
    trimesh.creation.box((LENGTH, WIDTH, HEIGHT)).export(path)
    return part_study(path)[0]


@pytest.fixture
def chosen() -> list[Study]:
    """The studies with which the solves would begin."""
    return []


@pytest.fixture
def server(study: Study, chosen: list[Study]) -> Iterator[PartPage]:
    def begin(choices: PartChoices) -> None:
        chosen.append(chosen_study(study, choices))

    def take(unit: str) -> ShownPart:
        return shown_part(part_study(study.body.file, unit=unit)[0])

    with serve_part("pad", on_start=begin, on_unit=take, port=0) as page:
        yield page


@pytest.fixture
def page(browser: Browser, server: PartPage, complaints: list[str]) -> Iterator[Page]:
    page = browser.new_context(viewport={"width": 1000, "height": 640}).new_page()
    page.on("console", lambda m: complaints.append(m.text) if m.type in {"error", "warning"} else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    local = (server.address, "data:", "blob:")
    page.on("request", lambda r: None if r.url.startswith(local) else complaints.append(f"asks {r.url}"))
    page.goto(server.url)
    yield page
    page.context.close()
    assert_no(complaints)


def begin(page: Page, **texts: str) -> None:
    for name, text in texts.items():
        page.fill(f"#{name.replace('_', '-')}", text)
    page.click("#start")


def problem(page: Page) -> str:
    page.wait_for_selector("#problem:not([hidden])")
    return page.inner_text("#problem")


def misfit(page: Page, field: str) -> str:
    """The sentence beside a field, of which there is one."""
    page.wait_for_selector(f"#{field}[aria-invalid=true]")
    return page.inner_text(f"#{field}-misfit")


def middle(page: Page) -> tuple[float, float]:
    """The middle of the picture, where the upper face is."""
    box = page.locator("#part-view").bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def ready(page: Page, server: PartPage, study: Study) -> None:
    """Show the part, and wait until it can be set up."""
    page.wait_for_selector("html[data-stage=reading]")
    server.show_part(shown_part(study))
    page.wait_for_selector("html[data-partdrawn][data-picked]")


def picked(page: Page) -> tuple[int, int]:
    held, touched = page.evaluate("document.documentElement.dataset.picked").split()
    return int(held), int(touched)


def test_a_part_is_set_up_by_picks_and_texts(server, page, study, chosen, keep):
    ready(page, server, study)
    assert picked(page) == (2, 2), "at first it stands on its underside, and is touched above"
    assert "40 × 30 × 20 mm" in page.inner_text("#part-facts")
    for unit, size in (("cm", "400 × 300 × 200 mm"), ("mm", "40 × 30 × 20 mm")):
        page.select_option("#unit", unit)
        page.wait_for_selector(f"#part-facts:has-text('{size}')")
    page.wait_for_selector("html[data-partdrawn][data-picked]")

    begin(page, young="4")
    assert "Young's modulus: '4' has no unit" in misfit(page, "young")
    begin(page, young="4 kPa", ball_depth="25 mm")
    assert "The depth of 25 mm is more than the part is thick, 20 mm." in misfit(page, "ball-depth")
    begin(page, ball_depth="2 mm", poisson="0.6")
    assert "out of range" in misfit(page, "poisson")
    page.fill("#poisson", "0.4")

    page.click("#roles [data-role='0']")
    page.mouse.click(*middle(page))  # the upper face is given back
    assert picked(page) == (2, 0)
    begin(page)
    assert problem(page).startswith("Nothing is touched.")
    page.click("#roles [data-role='2']")
    page.click("[data-tool=brush]")
    x, y = middle(page)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 4, y, steps=2)
    page.mouse.up()
    assert picked(page) in {(2, 1), (2, 2)}
    keep(page, "part-setup")
    page.locator("#face-list select").first.evaluate("s => s.closest('details').open = true")
    page.click("[data-take=rest]")
    held, touched = picked(page)
    assert (held, touched) == (2, 10)
    assert not chosen
    begin(page)
    page.wait_for_selector("html[data-stage=working]")
    (made,) = chosen
    assert made.body.material.young == pytest.approx(4e3)
    assert made.interaction.depth[1] == pytest.approx(2e-3)
    areas = {face.name: 1e6 * face.area for face in made.body.shape().faces}
    assert areas["touched"] == pytest.approx(LENGTH * WIDTH + 2 * HEIGHT * (LENGTH + WIDTH))
    assert areas[made.body.fixed] == pytest.approx(LENGTH * WIDTH)


def test_a_click_asks_before_it_takes_a_face_away(server, page, study, keep):
    """Nothing is chosen at first; what a click did is taken back, and done again, step by step."""
    ready(page, server, study)
    assert page.locator("#roles [aria-pressed=true]").count() == 0
    page.mouse.click(*middle(page))
    page.wait_for_selector("#ask:not([hidden])")
    keep(page, "part-asks")
    assert "This place is touched." in page.inner_text("#ask-words")
    assert picked(page) == (2, 2)
    page.keyboard.press("Escape")
    page.wait_for_selector("#ask[hidden]", state="attached")
    page.mouse.click(*middle(page))
    page.click("#ask [data-role='1']")
    assert picked(page) == (4, 0)
    assert page.get_attribute("#roles [data-role='1']", "aria-pressed") == "true"
    page.keyboard.press("Control+z")
    assert picked(page) == (2, 2)
    page.keyboard.press("Control+Shift+z")
    assert picked(page) == (4, 0)
    page.click("#undo")
    assert picked(page) == (2, 2)
    assert page.is_disabled("#undo")

    page.click("#roles [data-role='2']")
    page.mouse.click(*middle(page))  # it is touched already: a second click takes nothing back
    page.wait_for_selector("#ask:not([hidden])")
    assert picked(page) == (2, 2)
    assert page.is_hidden("#ask [data-role='2']")
    page.click("#ask [data-role='0']")
    assert picked(page) == (2, 0)
    page.click("[data-take=reset]")
    assert picked(page) == (2, 2)
    page.fill("#young", "4 kPa")
    page.keyboard.press("Control+z")  # in a text it undoes letters
    assert picked(page) == (2, 2)
    page.focus("#part-view")
    page.keyboard.press("Control+z")
    assert picked(page) == (2, 0)


def test_a_number_is_judged_when_its_field_is_left(server, page, study, chosen):
    """The sentence goes as soon as the number is right, without leaving the field again; nothing begins meanwhile."""
    ready(page, server, study)
    page.fill("#ball-depth", "25 mm")
    assert page.is_hidden("#ball-depth-misfit")
    page.focus("#young")
    assert "more than the part is thick, 20 mm" in misfit(page, "ball-depth")
    page.focus("#ball-depth")
    page.fill("#ball-depth", "2 mm")
    page.wait_for_selector("#ball-depth-misfit[hidden]", state="attached")
    for field, text, words in (
        ("young", "4", "has no unit"),
        ("young", "-4 kPa", "not above zero"),
        ("poisson", "0.5", "less than 0.5"),
        ("ball-radius", "3 cm", "larger than the part"),
    ):
        page.fill(f"#{field}", text)
        page.press(f"#{field}", "Tab")
        page.wait_for_selector(f"#{field}-misfit:has-text('{words}')")
    page.select_option("#material", "liver")  # which has numbers of its own
    page.fill("#ball-radius", "3 mm")
    page.wait_for_selector("#ball-radius-misfit[hidden]", state="attached")
    about = page.inner_text("#material-about")
    assert "5.5 kPa" in about
    assert "published from 3.9 kPa to 7.1 kPa" in about
    assert "Roulot et al. 2008" in about
    assert not chosen
    begin(page)
    page.wait_for_selector("html[data-stage=working]")
    assert chosen[0].body.material == "liver"


def test_the_held_face_is_seen_through_the_part(server, page, study):
    """The underside is hatched in the colour of what is held, though the camera looks from above."""
    ready(page, server, study)

    def blue() -> int:
        page.wait_for_timeout(300)  # until it is drawn
        content = page.locator("#part-view").screenshot()
        pixels = plt.imread(io.BytesIO(content), format="png")[:, :, :3]
        return int((pixels[:, :, 2] > pixels[:, :, 0] + 0.15).sum())

    assert blue() > 1000
    page.locator("#face-list select").first.evaluate("s => s.closest('details').open = true")
    for select in page.locator("#face-list select").all():
        if select.input_value() == "1":
            select.select_option("0")
    assert picked(page) == (0, 2)
    assert blue() == 0


def test_a_page_whose_server_is_gone_says_so(server, page, study, complaints):
    ready(page, server, study)
    server.stop()
    page.wait_for_selector("#banner:not([hidden])")
    assert "The server of this page has ended" in page.inner_text("#banner")
    assert page.is_disabled("#start")
    complaints.clear()  # of the connection that is refused


def test_the_page_fits_a_phone(server, page, study):
    page.set_viewport_size({"width": 390, "height": 844})
    ready(page, server, study)
    page.click("#face-details summary")
    page.fill("#ball-depth", "25 mm")
    page.press("#ball-depth", "Tab")
    misfit(page, "ball-depth")
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    small = page.evaluate(
        "[...document.querySelectorAll('button, select, input, summary')].filter(e => e.offsetParent)"
        ".map(e => [e.id || e.textContent, e.getBoundingClientRect().height]).filter(([, height]) => height < 44)"
    )
    assert small == []


@pytest.fixture
def versions(tmp_path: Path) -> list[Path]:
    """Surrogates of one slab: the second one moves twice as far, the third one is of another mesh."""
    first = touched_slab()
    field = first.fields["displacement"]
    twice = dataclasses.replace(field, modes=2 * field.modes, local_mode=None)
    low = field.points[field.triangles][:, :, 2].max(axis=1) < -0.005
    other = dataclasses.replace(twice, triangles=field.triangles[~low])
    bodies = [
        first,
        *(dataclasses.replace(first, fields={"displacement": shown}) for shown in (twice, other)),
    ]
    return [body.save(tmp_path / f"slab-{i}.palpate") for i, body in enumerate(bodies)]


def test_a_part_is_touched_while_it_gets_better(server, page, study, versions, tmp_path, keep):
    places = np.array([[0.0, 0.0, 0.02], [0.005, 0.005, 0.02]])
    server.show_part(shown_part(study))
    server.show_progress(Progress("2 of 12 first solves", places=places, remaining=50.0, share=0.25))
    page.wait_for_selector("html[data-learning][data-partdrawn]")
    assert page.inner_text("#phase") == "2 of 12 first solves"
    assert re.fullmatch(r", about (50|45|40|35|30) s", page.inner_text("#remaining"))
    assert 0.25 <= page.evaluate("document.getElementById('work-share').value") < 0.9
    assert page.inner_text("#pressable").startswith("It can't be pressed yet.")
    assert page.get_attribute("#pressable", "role") == "status", "it is read aloud when it changes"
    page.wait_for_selector("#part-view[data-camera]")
    page.wait_for_timeout(500)  # until the room above the part is drawn
    stood = page.get_attribute("#part-view", "data-camera")
    assert page.is_hidden("#error-median"), "nothing is said of an error before there is one"
    keep(page, "part-solving")
    report = tmp_path / "slab.html"
    report.write_text("<p>A report.</p>", encoding="utf-8")
    first = Progress("12 of 12 first solves; learning", 12, 0.02, 0.008, 0.031, places, 41.0, report, 0.5)
    server.show_body(versions[0])
    server.show_progress(first)
    page.wait_for_selector("html[data-touching='1'][data-tick][data-middle]")
    page.wait_for_selector("#error-p95:text-is('3.1')")
    assert page.inner_text("#pressable").startswith("You can press it now.")
    assert page.get_attribute("#view", "data-camera") == stood, "the view stays when the part can be touched"
    assert 41 <= int(page.inner_text("#elapsed").split()[0]) < 60
    page.wait_for_function("document.getElementById('remaining').textContent === ', a little longer'")

    assert page.get_attribute("#trust-toggle", "aria-pressed") == "true"
    assert page.inner_text("#legend-title") == "uncertainty of the force (%)"
    assert float(page.evaluate("document.documentElement.dataset.largest")) == pytest.approx(
        100 * DEVIATION, rel=1e-3
    )
    assert "not touched" in page.inner_text("#legend-note")
    least, untouched = (colour(page, where) for where in ("#legend-bar", "#legend-note .untouched"))
    assert np.ptp(least) > 80, "what is known best has a colour"
    assert np.ptp(untouched) < 20, "what nobody touches is grey"
    assert near(page, untouched) > 300, "the slab's sides"
    keep(page, "part-trust")
    page.click("#trust-toggle")
    assert page.is_hidden("#legend-note")
    assert page.inner_text("#legend-title") == "displacement (mm)"
    page.evaluate("window.mark = 'not reloaded'")
    x, y = page.evaluate("document.documentElement.dataset.middle").split()
    page.mouse.move(float(x), float(y) + 10)
    page.mouse.down()
    check_displacement(versions[0], page)
    assert page.inner_text("#deviation") == f"± {100 * DEVIATION:g}\N{NO-BREAK SPACE}%"
    assert "Over all places it is 3.1\N{NO-BREAK SPACE}% at most" in page.inner_text("#deviation-note")

    server.show_body(versions[1])
    before = "3.1 % before; the new one is being checked"
    server.show_progress(dataclasses.replace(first, error_p95=math.nan, solves=24, trial=before))
    page.wait_for_selector(f"#improved:text-is('{before}')")
    assert page.is_hidden("#deviation-note"), "the new one is not checked yet"
    server.show_progress(dataclasses.replace(first, error_p95=0.028, solves=24))
    page.wait_for_selector("#error-p95:text-is('2.8')")
    assert page.inner_text("#improved") == "", "other solves judge the same body"
    words = "improved: 2.8 % → 2.2 % on the same 20 unseen solves"
    server.show_progress(dataclasses.replace(first, error_p95=0.022, solves=24, trial=words))
    page.wait_for_selector("html[data-touching='2'][data-improved]")
    assert page.inner_text("#improved") == page.inner_text("#toast") == words
    check_displacement(versions[1], page)
    keep(page, "part-improved")
    server.show_body(versions[2])
    page.wait_for_selector("html[data-touching='3']")
    check_displacement(versions[2], page)
    keep(page, "part-other-mesh")
    assert page.evaluate("window.mark") == "not reloaded"
    assert page.inner_text("#model-name") == "pad", "the part's name, whatever the files are called"
    page.mouse.up()

    response = page.request.get(server.address + "report")
    assert "A report." in response.text()
    assert "script-src" not in response.headers["content-security-policy"]
    page.click("#enough")
    assert server.stopped.wait(5)
    server.end("Done: 2 % were reached.")
    page.wait_for_selector("#enough[hidden]", state="attached")
    assert page.inner_text("#phase") == "Done: 2 % were reached."


def colour(page: Page, selector: str) -> np.ndarray:
    """The first colour of an element's background, red, green and blue from 0 to 255."""
    style = page.locator(selector).evaluate(
        "e => getComputedStyle(e).backgroundImage + getComputedStyle(e).backgroundColor"
    )
    return np.array([int(n) for n in re.search(r"rgb\((\d+), (\d+), (\d+)\)", style).groups()])


def near(page: Page, rgb: np.ndarray) -> int:
    """Number of the picture's pixels in this colour, brighter or darker as the light makes it."""
    content = page.locator("#view").screenshot()
    pixels = 255 * plt.imread(io.BytesIO(content), format="png")[:, :, :3]
    shade = pixels.mean(axis=2, keepdims=True) / rgb.mean()
    flat = np.abs(pixels - shade * rgb).max(axis=2) < 6
    return int((flat & (shade[:, :, 0] > 0.4) & (shade[:, :, 0] < 0.9)).sum())


def check_displacement(file: Path, page: Page) -> None:
    """The largest displacement that is drawn is that of a surrogate under the probe that is shown."""
    shown = pressed(page)["data"]
    moved = Surrogate.load(file).fields["displacement"].values(vector(shown, "position")[None])[0]
    assert float(shown["largest"]) == pytest.approx(np.linalg.norm(moved, axis=1).max(), rel=1e-4)


def pressed(page: Page) -> dict:
    """What the page shows once the probe has arrived and stands still."""
    was = page.evaluate(READ)
    for _ in range(400):
        page.wait_for_timeout(100)
        now = page.evaluate(READ)
        if now["withheld"] or "stalled" in now["flags"]:  # a busy machine
            hold_again(page)
        still = all(now["data"][k] == was["data"][k] for k in ("position", "largest", "force"))
        if still and now["data"]["sinking"] == "false" and "inside" in now["flags"]:
            return now
        was = now
    pytest.fail(f"the page did not settle: {was}")


LENGTHS = """
6 mm|6mm|0,5 mm|10,5mm|1 000 mm|1.000,5 mm|1,000.5 mm|1,000 mm|1.000 mm|1'000 mm|−5 mm|1e-3 m|1E3 um|2,5e3 µm|5 μm|
2.50 × 10⁻⁸ m|.5 cm|5. cm|5,|5 MM|5 Mm|5 CM|5 M|1 in|1_000 mm|0x10 mm|½ mm|５ mm|∞ m|nan m|1 00 mm|5||mm|5 mm 3|5 kPa|
1e400 m|–5 mm
""".replace("\n", "").split("|")


def test_the_page_draws_the_lengths_that_the_server_reads(server, page, study):
    def read(text: str) -> float:
        try:
            return parse_quantity(text, "m")
        except UsageError:
            return 0.0  # nothing is drawn

    ready(page, server, study)
    for text in LENGTHS:
        page.fill("#ball-radius", text)
        drawn = float(page.get_attribute("#ball-radius", "data-metres"))
        assert drawn == pytest.approx(read(text), rel=1e-12), text


def test_a_tool_is_chosen_for_a_part(server, page, study, chosen, keep):
    ready(page, server, study)
    assert page.input_value("#tool") == "ball"
    page.select_option("#tool", "punch")
    assert page.is_hidden("#ball-radius")
    begin(page, size_edge="0.001 mm")
    assert "Choose one with a radius of at least" in misfit(page, "size-edge")
    begin(page, size_edge="1 mm", size_radius="70 mm")
    assert "140 mm across, and the part 40 mm long" in misfit(page, "size-radius")
    keep(page, "part-tool")
    begin(page, size_radius="4 mm", size_turn_x="5°", ball_depth="1 mm")
    page.wait_for_function("() => document.documentElement.dataset.stage === 'working'")
    assert str(chosen[0].interaction.build_tool()) == "punch of radius 4 mm, edge 1 mm, turned by 5°"
    assert chosen[0].interaction.depth[1] == 1e-3
