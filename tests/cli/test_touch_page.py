"""`palpate touch` on its page: a rough surrogate first, then better ones, and everything kept beside the part."""

from __future__ import annotations

import contextlib
import json
import math
import os
import re
import signal
import subprocess
import sys
import threading
import time
import urllib.request
from dataclasses import replace
from http.cookiejar import CookieJar
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from websockets.sync.client import connect

import pressed
from palpate.cli.console import Console
from palpate.cli.improvement_lines import mesh_in_words, trial_in_words
from palpate.cli.touch_page import TouchedPart
from palpate.errors import UsageError
from palpate.format import share
from palpate.runtime import warm_up
from palpate.study import Study
from palpate.study.part_choices import shown_part
from palpate.study.part_study import part_study
from palpate.study.part_work import rough_study, work_on
from palpate.study.run import Paths
from palpate.surrogates import Surrogate
from palpate.viewer.part_messages import StartWish
from palpate.viewer.part_page import Progress, serve_part


@pytest.fixture
def study(tmp_path: Path) -> Study:
    trimesh.creation.box((40.0, 30.0, 20.0)).export(tmp_path / "pad.stl")
    return part_study(tmp_path / "pad.stl")[0]


class Improvement:
    """Steps as an improvement makes them, of files that need no solves."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.studies: list[tuple[str, object, object]] = []
        self.ended: list[str] = []
        self.phases = [("solved", 12), ("learnt", 12), ("solved", 16), ("learnt", 16), ("ended", 16)]
        monkeypatch.setattr("palpate.study.improve_study.improve_study", self)
        monkeypatch.setattr("palpate.sweeps.local_cluster", contextlib.nullcontext)

    def __call__(self, study: Study, paths: Paths, *, cluster: object, **options: object):
        self.studies.append((study.name, cluster, study.sweep.element))
        try:
            for phase, solves in self.phases:
                yield self.step(study, paths, phase, solves)
        finally:
            self.ended.append(study.name)

    def step(self, study: Study, paths: Paths, phase: str, solves: int) -> SimpleNamespace:
        is_new = phase == "learnt"
        if is_new:
            origin = {"provenance": {"problem": study.problem().describe()}}
            factor = 1.1 if study.name.endswith("-rough") else 1.0
            pressed.surrogate(factor=factor, meta={"dataset": origin}).save(paths.model)
        return SimpleNamespace(
            phase=phase, solves=solves, unseen=0, error=float("nan"), median=float("nan"), seconds=1.0, is_new=is_new,
            reached=False, reason="The time is over." * (phase == "ended"), places=np.zeros((solves, 3)),
            train=pressed.dataset(pressed.solves()), test=pressed.dataset(pressed.solves()),
            surrogate=pressed.surrogate() if paths.model.exists() else None,
            model_path=paths.model if paths.model.exists() else None, before=math.nan, tried=math.nan,
            mesh=math.nan,
        )  # fmt: skip


def carried_out(study: Study, folder: Path, **options: object) -> list[dict]:
    said: list[dict] = []
    work_on(study, Paths(folder, study.name), said.append, until=0.02, limit=600.0, **options)
    json.dumps(said)
    return said


def bodies(said: list[dict]) -> list[str]:
    return [Path(line["body"]).name for line in said if "body" in line]


def test_a_rough_surrogate_comes_first_and_is_replaced(study, tmp_path, monkeypatch):
    work = Improvement(monkeypatch)
    said = carried_out(study, tmp_path, workers=2)
    assert work.studies == [("pad-rough", 2, study.interaction.radius), ("pad", 2, study.sweep.element)]
    assert bodies(said) == ["pad-rough.palpate", "pad.palpate", "pad.palpate"]
    assert work.ended == ["pad-rough", "pad"], "the rough study ends with its first surrogate"
    assert [line["step"]["solves"] for line in said if "step" in line] == [12, 12, 12, 16, 16, 16]
    assert said[-1]["ended"]["reason"] == "The time is over."


def test_the_studys_first_solves_tell_the_error_of_the_rough_surrogate(study, tmp_path, monkeypatch):
    """A force that is a tenth too large everywhere; a later call finds the rough surrogate in its file."""
    Improvement(monkeypatch)
    steps = [line["step"] for line in carried_out(study, tmp_path) if "step" in line]
    assert [np.isfinite(step["error"]) for step in steps] == [False, True, *[False] * 4]
    assert (steps[1]["error"], steps[1]["median"]) == (pytest.approx(0.1), pytest.approx(0.1))
    (tmp_path / "pad.palpate").unlink()
    again = [line["step"] for line in carried_out(study, tmp_path) if "step" in line]
    assert again[0]["error"] == pytest.approx(0.1)


def test_the_studys_own_surrogate_is_compared_with_the_rough_one_on_the_same_solves(
    study, tmp_path, monkeypatch
):
    work = Improvement(monkeypatch)
    work.phases.insert(2, ("judged", 12))
    (step,) = (
        line["step"]
        for line in carried_out(study, tmp_path)
        if "step" in line and line["step"]["phase"] == "judged"
    )
    assert step["before"] == pytest.approx(0.1), "the rough one is a tenth too stiff"
    assert step["is_new"], "the study's own is in the hand, whichever is better"


@pytest.mark.parametrize(
    ("is_new", "before", "tried", "words"),
    [
        (True, 0.03, 0.027, "improved: 3 % → 2.7 % on the same 20 unseen solves"),
        (True, 0.027, 0.0275, "replaced: 2.7 % → 2.8 % on the same 20 unseen solves"),
        (False, 0.027, 0.03, "kept, since a new one has 3 %, not 2.7 %, on the same 20 unseen solves"),
        (True, math.nan, 0.03, ""),
    ],
)
def test_a_new_surrogate_is_told_beside_the_one_before(is_new, before, tried, words):
    step = SimpleNamespace(is_new=is_new, before=before, tried=tried, unseen=20)
    assert trial_in_words(step).replace("\N{NO-BREAK SPACE}", " ") == words


def test_the_mesh_s_part_stands_in_the_error_that_is_told():
    step = SimpleNamespace(error=0.007, mesh=0.012)
    assert (
        mesh_in_words(step).replace("\N{NO-BREAK SPACE}", " ") == "force ± 1.9 % in all, of it the mesh 1.2 %"
    )
    assert mesh_in_words(SimpleNamespace(error=0.007, mesh=math.nan)) == ""


def test_the_same_command_goes_on_with_what_there_is(study, tmp_path, monkeypatch):
    work = Improvement(monkeypatch)
    carried_out(study, tmp_path)
    said = carried_out(study, tmp_path)
    assert bodies(said[:1]) == ["pad.palpate"], "what was learnt before can be touched at once"
    assert [name for name, _, _ in work.studies] == ["pad-rough", "pad", "pad"]


def test_the_error_that_an_earlier_run_found_is_told_at_once(study, tmp_path, monkeypatch):
    Improvement(monkeypatch)
    carried_out(study, tmp_path)
    file = tmp_path / "pad.palpate"
    model = Surrogate.load(file)
    assert "judged" not in carried_out(study, tmp_path)[0], "its file does not tell"
    curve = [{"solves": 12, "force_median": 0.01, "force_p95": 0.03}]
    curve.append({"solves": 16, "force_median": 0.004, "force_p95": 0.0094})
    replace(model, meta={**model.meta, "learning_curve": curve}).save(file)
    assert carried_out(study, tmp_path)[0]["judged"] == {"solves": 16, "median": 0.004, "error": 0.0094}


class Saying(list[dict]):
    """Work that says these lines, and solves nothing."""

    def ask(self, line: str) -> None:
        pass

    def close(self) -> int:
        return 0


def test_a_known_error_is_told_until_the_new_one_is_there(tmp_path, monkeypatch, capsys):
    """Of an earlier run, it stays until the same surrogate is judged; of the one before, it is said in words."""

    def step(phase: str, solves: int, error: float) -> dict:
        more = {"unseen": 8, "seconds": 1.0, "before": math.nan, "tried": math.nan, "mesh": math.nan}
        return {
            "phase": phase,
            "solves": solves,
            "error": error,
            "median": error / 2,
            "is_new": True,
            "places": [],
        } | more

    work = Saying([
        {"judged": {"solves": 16, "median": 0.004, "error": 0.0094}},
        {"step": step("learnt", 16, math.nan)},
        {"step": step("judged", 16, 0.01)},
        {"step": step("learnt", 12, math.nan)},  # a study's own after the rough one
        {"step": step("judged", 12, 0.008)},
        {"ended": {"reached": False, "reason": "The time is over.", "report": ""}},
    ])  # fmt: skip
    monkeypatch.setattr("palpate.cli.touch_page._Work", lambda: work)
    monkeypatch.setattr("palpate.cli.touch_page.WarmUp", lambda *names: SimpleNamespace(close=lambda: None))
    shown: list[Progress] = []
    ended = threading.Event()
    touched = TouchedPart(0.02, 60.0, 1, Console())
    touched.page = SimpleNamespace(
        show_progress=shown.append, end=lambda words: ended.set(), stopped=threading.Event()
    )
    touched.begin(lambda: tmp_path / "no.toml")
    assert ended.wait(10.0)
    touched.close()
    lines = capsys.readouterr().err
    assert "16 solves: a first surrogate" not in lines, "it is no first one"
    assert lines.count("8 unseen solves, after") == 2
    assert [progress.error_p95 for progress in shown] == pytest.approx(
        [0.0094, 0.0094, 0.01, math.nan, 0.008, 0.008], nan_ok=True
    )
    words = f"{share(0.01)} before; the new one is being checked"
    assert [progress.trial for progress in shown] == ["", "", "", words, "", ""]


def test_a_surrogate_of_another_study_is_not_put_into_the_hand(study, tmp_path, monkeypatch):
    work = Improvement(monkeypatch)
    carried_out(study, tmp_path)
    harder = study.interaction.model_copy(update={"pad": 1e7})
    changed = study.model_copy(update={"interaction": harder})
    said = carried_out(changed, tmp_path)
    assert [name for name, _, _ in work.studies] == ["pad-rough", "pad"] * 2
    assert "body" not in said[0]
    (tmp_path / "pad.palpate").write_text("no surrogate")
    again = carried_out(changed, tmp_path)
    assert bodies(again[:1]) == ["pad-rough.palpate"], "the rough one is of this study"


def test_the_batch_that_is_solved_when_it_is_stopped_is_learnt_from(study, tmp_path, monkeypatch):
    work = Improvement(monkeypatch)
    said = carried_out(study, tmp_path, stopped=lambda: len(work.studies) == 2)
    assert bodies(said) == ["pad-rough.palpate", "pad.palpate"]
    assert [line["step"]["phase"] for line in said if "step" in line] == ["solved", "solved", "learnt"]


def test_a_page_can_not_start_work_that_has_begun(study):
    chosen: list[object] = []
    with serve_part("pad", on_start=chosen.append, port=0) as page:
        page.show_part(shown_part(study), begun=True)
        cookies = "; ".join(f"{name}={value}" for name, value in page.cookies.items())
        with connect(
            f"{page.address.replace('http', 'ws', 1)}part",
            origin=page.address.rstrip("/"),
            additional_headers={"Cookie": cookies},
        ) as socket:
            assert json.loads(socket.recv(timeout=5))["stage"] == "working"
            socket.send(StartWish("ecoflex 00-30", "", "", "", "5 mm", "2 mm").to_json())
            assert "begun already" in json.loads(socket.recv(timeout=5))["problem"]
    assert not chosen


@pytest.mark.full
def test_the_work_on_a_part_begins_once(tmp_path):
    """A second start is refused before its study is written; one that fails has not begun."""
    touched = TouchedPart(0.02, 60.0, 1, Console())
    written: list[str] = []

    def write(name: str) -> Path:
        written.append(name)
        return tmp_path / f"{name}.toml"

    def refuse() -> Path:
        raise UsageError("These choices don't fit.")

    try:
        with serve_part("pad", on_start=written.append, port=0) as touched.page:
            with pytest.raises(UsageError, match="don't fit"):
                touched.begin(refuse)
            touched.begin(lambda: write("first"))
            with pytest.raises(UsageError, match="begun already"):
                touched.begin(lambda: write("second"))
    finally:
        touched.close()
    assert written == ["first"]


@pytest.mark.full
def test_the_page_says_that_it_warms_up_before_a_body_is_in_the_hand(tmp_path, monkeypatch):
    monkeypatch.setattr(warm_up, "is_ready", lambda own: False)
    touched, seen, shown = TouchedPart(0.02, 60.0, 1, Console()), [], threading.Event()
    body = SimpleNamespace(
        show_progress=lambda progress: seen.append(progress.phase),
        show_body=lambda path: shown.set(),
        end=lambda words: None,
        stopped=threading.Event(),
    )
    touched.page = body
    try:
        touched.begin(lambda: tmp_path / "no.toml")
        touched._bodies.put("body.palpate")
        assert shown.wait(60.0)
    finally:
        touched.close()
    assert any(phase.startswith("warming up, ") for phase in seen)


def test_it_stops_after_the_batch_that_is_solved(study, tmp_path, monkeypatch):
    Improvement(monkeypatch)
    said = carried_out(study, tmp_path, stopped=(tmp_path / "pad.palpate").exists)
    assert [line["step"]["solves"] for line in said if "step" in line] == [12, 12, 12]
    assert said[-1]["ended"]["reason"] == "It was stopped."


def test_a_mesh_keeps_its_elements_and_has_no_rough_study(study):
    rough = rough_study(study)
    assert rough is not None
    assert rough.sweep.element == study.interaction.radius
    assert rough.body == study.body
    body = study.body.model_copy(update={"file": "pad.vtu"})
    assert rough_study(study.model_copy(update={"body": body})) is None


def lines_until(process: subprocess.Popen, words: str, seconds: float = 240.0) -> list[str]:
    """Lines that a command prints, up to the one with these words."""
    lines, until = [], time.monotonic() + seconds
    for line in process.stderr:
        lines.append(line)
        if words in line:
            return lines
        assert time.monotonic() < until, "".join(lines)
    raise AssertionError("".join(lines))


@pytest.mark.full
@pytest.mark.timeout(300)
def test_a_part_is_touched_while_it_is_solved(tmp_path):
    """The real command on a small block: page, work, first touch, Ctrl-C, and nothing is left behind."""
    part = tmp_path / "pad.stl"
    trimesh.creation.box((30.0, 30.0, 12.0)).export(part)
    options = ("--radius", "8 mm", "--depth", "2 mm", "--view", "--start", "--port", "0", "--minutes", "1")
    process = subprocess.Popen(
        [sys.executable, "-m", "palpate", "touch", str(part), *options],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, cwd=tmp_path,
    )  # fmt: skip
    try:
        address = re.search(r"http://\S+", lines_until(process, "Ctrl-C ends it")[-1])[0]
        opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(CookieJar()))
        origin = address.split("?")[0]
        opener.open(address, timeout=10).close()  # the token becomes a cookie
        with opener.open(origin, timeout=10) as page:
            assert b'data-mode="part"' in page.read()
        lines_until(process, "It can be touched")
        with opener.open(f"{origin}surface", timeout=10) as surface:
            assert len(surface.read()) > 1000
        process.send_signal(signal.SIGINT)
        process.wait(30)
        assert process.returncode == 130, process.stderr.read()
    finally:
        process.kill()
        process.wait()
        process.stderr.close()
    assert (tmp_path / "pad.toml").is_file()
    assert (tmp_path / "pad-rough.palpate").is_file()
    assert not [line for line in _processes() if str(os.fspath(tmp_path)) in line]


def _processes() -> list[str]:
    names = []
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            names.append((folder / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace"))
    return names
