"""The page of an examination: what it tells and keeps to itself, and what of it survives a kill."""

from __future__ import annotations

import contextlib
import json
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from examined import slab
from websockets.sync.client import ClientConnection

import pressed
from palpate.devices.doubles.haply_simulator import HaplySimulator, SimulatorSettings
from palpate.devices.trace_file import read_trace
from palpate.errors import DeviceError, UsageError
from palpate.experiments.exam_folders import past_examinations
from palpate.experiments.exam_kinds import kind_of_body
from palpate.experiments.exam_page import ExamPage
from palpate.experiments.exam_score import score_examination
from palpate.experiments.examination import Examination
from palpate.processes import helper_environment
from palpate.runtime.replay import Replay
from palpate.runtime.touchable import load_touchable
from palpate.surrogates import Lump
from palpate.viewer.exam_messages import ExamWish
from viewer.chromium_page import ARGUMENTS
from websocket_page import get, socket_of

LUMP = Lump((0.0, 0.0, -0.009), 0.006, 10.0)


def wait_until(check, seconds: float = 30.0) -> None:
    until = time.monotonic() + seconds
    while not check():
        assert time.monotonic() < until
        time.sleep(0.02)


class Examiner:
    """A program in the place of a person at the page."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.news = json.loads(self.socket.recv(timeout=10))

    def wish(self, wish: str, **more) -> dict:
        self.socket.send(ExamWish(wish, **more).to_json())
        self.news = json.loads(self.socket.recv(timeout=30))
        return self.news


@contextlib.contextmanager
def examiner(page: ExamPage) -> Iterator[Examiner]:
    with socket_of(page, path="exam") as socket:
        yield Examiner(socket)


def greeting(page: ExamPage) -> str:
    """All that a page is told of the body."""
    with socket_of(page) as socket:
        return str(socket.recv(timeout=10))


def exam_page(folder: Path, **options) -> ExamPage:
    options = {"device": "stroke:frequency=4", "lumps": [LUMP], "port": 0} | options
    return ExamPage(kind_of_body("slab", slab()), pressed.surrogate(), directory=folder, **options)


def test_an_examination_of_another_body_of_the_same_name_does_not_go_on(tmp_path):
    page = exam_page(tmp_path / "exams")
    page._rest = pressed.surrogate().save(tmp_path / "rest.palpate")
    other = pressed.surrogate().signed("Another", "MIT").save(tmp_path / "other.palpate")
    with Examination.begin(tmp_path / "exams", page.kind, other, [LUMP]) as exam:
        name = exam.folder.name
    with pytest.raises(UsageError, match="begun on another body"):
        page._resume(ExamWish("resume", name=name))


def felt_depth(page: ExamPage) -> float:
    return float(page.loop.read().depth)


@pytest.fixture(scope="module")
def taken(tmp_path_factory):
    """An examination by a scripted hand, in two parts: its folder, and all that the page was told meanwhile."""
    folder, heard = tmp_path_factory.mktemp("exams"), []
    with exam_page(folder) as page, examiner(page) as person:
        before = greeting(page)
        heard.append(person.wish("examine"))
        wait_until(lambda: page.loop.recording.ticks > 600)
        heard.append(person.wish("mark", place=(0.001, 0.0, 0.0)))
        heard.append(person.wish("answer", number=1, hardness="hard", depth="deep"))
        assert greeting(page) == before  # the body that the page knows has not changed
    with exam_page(folder) as page, examiner(page) as person:
        name = person.news["former"][0]["name"]
        assert get(page, f"exams/{name}").status_code == 404  # its score would tell where the lump is
        heard.append(person.wish("resume", name=name))
        wait_until(lambda: page.loop.recording.ticks > 600)
        heard.append(person.wish("mark", place=(-0.018, 0.018, 0.0)))
        ended = person.wish("end")
        score = get(page, f"exams/{name}")
    return folder, heard, ended, score


def test_nothing_tells_of_lumps_before_the_end(taken):
    _, heard, _, _ = taken
    for news in heard:
        assert news["stage"] == "examination"
        assert news["lumps"] == news["former"] == []
        assert all(mark["answer"] == "" for mark in news["marks"])
    # all that differs from one news to the next is what the person did, and the time
    still = ("title", "words", "score", "protocol")
    assert len({tuple(news[name] for name in still) for news in heard}) == 1


def test_marks_and_answers_are_there_after_an_interruption(taken):
    _, heard, _, _ = taken
    assert [mark["number"] for mark in heard[-1]["marks"]] == [1, 2]
    assert heard[-2]["marks"] == heard[-3]["marks"]
    assert heard[-2]["marks"][0] | {"place": []} == {
        "number": 1, "place": [], "hardness": "hard", "depth": "deep", "answer": ""
    }  # fmt: skip


def test_the_score_is_that_of_the_record(taken):
    folder, _, ended, page = taken
    (past,) = past_examinations(folder)
    score = score_examination(past, slab())
    assert ended["stage"] == "ready"
    assert ended["notice"] == score.words == past.words
    assert (score.hits, len(score.false_alarms)) == (1, 1)
    assert score.touch.presses
    assert score.words.replace("⌀", "") in page.text.replace("⌀", "")


def test_each_part_is_felt_again_bit_for_bit(taken):
    folder, _, _, _ = taken
    (past,) = past_examinations(folder)
    assert [path.name for path in past.traces] == ["touch-1.trace", "touch-2.trace"]
    for path in past.traces:
        assert Replay(read_trace(path), load_touchable(past.folder / "felt.palpate")).run().identical


@pytest.mark.full
def test_practice_answers_each_mark_and_shows_lumps_when_asked(tmp_path):
    with exam_page(tmp_path) as page, examiner(page) as person:
        assert person.wish("practise")["lumps"] == []
        shown = person.wish("show")["lumps"]
        assert shown
        found = person.wish("mark", place=shown[0]["place"])["marks"][0]["answer"]
        assert found.startswith("Found: ")
        sort = {name: shown[0][name] for name in ("hardness", "depth")}
        assert person.wish("answer", number=1, **sort)["marks"][0]["answer"].endswith("All right.")
        missed = person.wish("mark", place=(0.05, 0.05, 0.0))["marks"][1]["answer"]
        assert missed.startswith("No lump lies here.")
        assert person.wish("leave")["stage"] == "ready"
    assert past_examinations(tmp_path) == []  # practice is not kept


@pytest.mark.full
def test_the_hand_feels_the_lump_in_the_examination_alone(tmp_path):
    with exam_page(tmp_path, lumps=[Lump((0.0, 0.0, -0.008), 0.006, 10.0)]) as page, examiner(page) as person:

        def ratio() -> float:
            """Force over that of the body without lumps, at a deep press."""
            wait_until(lambda: felt_depth(page) > 0.0035)
            state = page.loop.read()
            own = slab().energy.force(state.position[None])[0]
            return float(state.force[2] / own[2])

        assert ratio() < 1.2
        person.wish("examine")
        wait_until(lambda: page.loop.recording.ticks > 400)
        assert ratio() > 1.5
        person.wish("end")
        time.sleep(0.5)
        assert ratio() < 1.2


@pytest.mark.grid
@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"lumps": [Lump((0.0, 0.0, -0.002), 0.006, 10.0)]}, UsageError, "leaves the skin"),
        ({"device": "haply:ws://localhost:9,events=9,search=0,wait=0.2"}, DeviceError, "Haply"),
    ],
)
def test_what_cant_be_examined_is_refused_in_words(tmp_path, options, error, words):
    with pytest.raises(error, match=words), exam_page(tmp_path, **options):
        pass


@pytest.mark.full
def test_a_haply_examines_and_is_felt_again_bit_for_bit(tmp_path):
    settings = SimulatorSettings(port=0, events=0, amplitude=-0.02, frequency=1.0)
    with HaplySimulator(settings) as service:
        device = f"haply:ws://localhost:{service.port},events={service.events_port}"
        with exam_page(tmp_path, device=device) as page, examiner(page) as person:
            person.wish("examine")
            wait_until(lambda: page.loop.recording.ticks > 1500, 60.0)
            assert person.wish("mark", place=page.loop.read().position.tolist())["notice"] == ""
            assert person.wish("end")["stage"] == "ready"
    (past,) = past_examinations(tmp_path)
    (trace,) = past.traces
    assert read_trace(trace).ticks["depth"].max() > 0.0
    assert Replay(read_trace(trace), load_touchable(past.folder / "felt.palpate")).run().identical


@pytest.mark.full
@pytest.mark.timeout(400)
@pytest.mark.parametrize("device", ["page", "haply"])
def test_an_examination_in_a_browser_survives_a_kill(device, tmp_path, chromium):
    from playwright.sync_api import sync_playwright

    file = pressed.surrogate().save(tmp_path / "slab.palpate")
    command = [sys.executable, "-m", "palpate", "exam", str(file), "--folder", str(tmp_path / "exams")]
    command += ["--port", "0", "--no-browser", "--lump", "0; 0; -9 mm; 6 mm; 10"]

    def start() -> tuple[subprocess.Popen, str]:
        process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=helper_environment())
        stack.callback(process.stderr.close)
        stack.callback(process.kill)
        for line in process.stderr:
            if address := re.search(r"http://\S+", line):
                return process, address[0]
        pytest.fail("it did not start")

    def press_and_mark(number: int) -> None:
        if device == "haply":  # its hand presses up and down: a mark is taken where it is
            page.wait_for_selector("#exam-mark:enabled")
            page.keyboard.press("m")
            page.wait_for_selector(f"#exam-marks li:nth-child({number})")
            return
        x, y = map(float, page.evaluate("document.documentElement.dataset.middle").split())
        page.mouse.move(x, y)
        for _ in range(30):  # on a busy machine the hand falls silent, and has to take hold again
            page.mouse.down()
            page.wait_for_timeout(500)
            enabled = page.is_enabled("#exam-mark")
            if enabled:
                page.keyboard.press("m")
            page.mouse.up()
            if enabled:
                break
        page.wait_for_selector(f"#exam-marks li:nth-child({number})")

    with contextlib.ExitStack() as stack, sync_playwright() as playwright:
        if device == "haply":
            settings = SimulatorSettings(port=0, events=0, amplitude=-0.02, frequency=0.5)
            service = stack.enter_context(HaplySimulator(settings))
            command += ["--device", f"haply:ws://localhost:{service.port},events={service.events_port}"]
        browser = playwright.chromium.launch(executable_path=chromium, args=ARGUMENTS)
        page = browser.new_page()
        page.set_default_timeout(90_000)
        process, address = start()
        page.goto(address)
        page.wait_for_selector("html[data-tick][data-middle]")
        page.click("#exam-begin")
        page.wait_for_selector("html[data-exam=examination]")
        press_and_mark(1)
        page.click("#exam-marks button:text('hard')")
        page.wait_for_selector("#exam-marks button[aria-pressed=true]")
        process.kill()
        process.wait()
        process, address = start()
        page.goto(address)
        page.wait_for_selector("html[data-tick][data-middle]")
        page.click("#exam-list summary")
        page.click("#exam-former button")
        page.wait_for_selector("#exam-marks button[aria-pressed=true]")
        press_and_mark(2)
        page.click("#exam-end")
        page.click("#exam-end")
        page.wait_for_selector("#exam-score:not([hidden])")
        assert page.inner_text("#exam-notice").startswith("1 of 1 lump found, 0 false alarms")
        process.terminate()
        process.wait()
        browser.close()
    (past,) = past_examinations(tmp_path / "exams")
    for path in past.traces:
        assert Replay(read_trace(path), load_touchable(past.folder / "felt.palpate")).run().identical
