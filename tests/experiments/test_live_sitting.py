"""A sitting for real: Chromium as the participant, with the page and with a double of a Haply, killed and taken up."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from playwright.sync_api import sync_playwright
from scripted_participant import Sitting, shortened

from palpate.devices.doubles.haply_simulator import HaplySimulator, SimulatorSettings
from palpate.devices.trace_file import read_trace
from palpate.experiments.ready_plans import ready_plan
from palpate.experiments.study_folder import read_table
from palpate.runtime.replay import Replay
from palpate.runtime.touchable import load_touchable
from pressed import surrogate

pytestmark = pytest.mark.full

ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--no-first-run"]  # the tests may run as root, in a container
TRIALS = 6  # one of practice, four counted, one catch


@pytest.fixture(scope="module")
def browser(chromium):
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=chromium, args=ARGUMENTS)
        yield running
        running.close()


@pytest.fixture
def plan(tmp_path):
    surrogate().save(tmp_path / "body.palpate")
    text = shortened(ready_plan("discrimination", "live", ["body.palpate"]), 4)
    (tmp_path / "live.toml").write_text(text, "utf-8")
    return tmp_path / "live.toml"


def assert_replayable(folder: Path, rows: list[dict[str, str]]) -> None:
    """Each touch of each trial comes out the same, to the last bit, with the body that was felt."""
    for row in rows:
        for name in row["recordings"].split(","):
            trace = read_trace(folder / name)
            body = Path(trace.header["model"]["path"])
            replayed = Replay(trace, load_touchable(body)).run()
            assert "to the last bit" in str(replayed)
            assert len(trace) > 100


@pytest.mark.parametrize("device", ["page", "haply"])
def test_a_killed_sitting_goes_on_and_every_touch_can_be_replayed(device, browser, plan):
    with HaplySimulator(SimulatorSettings(port=0, events=0, frequency=1.0, amplitude=-0.01)) as service:
        options = ()
        if device == "haply":
            options = ("--device", f"haply:ws://localhost:{service.port},events={service.events_port}")
        first = Sitting(browser, plan, *options)
        first.act(2, press=device == "page")
        first.end(kill=True)
        folder = plan.parent / "live" / "sub-01" / "beh"
        (table,) = folder.glob("*_events.tsv")
        before = table.read_bytes()
        assert len(read_table(table)) == 2

        second = Sitting(browser, plan, *options)
        second.control.fill("#note", "A phone rang.")
        second.control.click("#write")
        second.act(TRIALS, press=device == "page")
        assert second.end() == 0
    assert table.read_bytes().startswith(before)
    rows = read_table(table)
    assert [int(row["trial"]) for row in rows] == list(range(1, TRIALS + 1))
    assert [row["part"] for row in rows] == ["1"] * 2 + ["2"] * 4
    assert "A phone rang." in (folder / f"{table.name.removesuffix('events.tsv')}notes.tsv").read_text(
        "utf-8"
    )
    assert_replayable(folder, rows[:1] + rows[-1:])
    again = subprocess.run(
        [sys.executable, "-m", "palpate", "experiment", "run", plan.name, "sub-01", "--no-browser"],
        cwd=plan.parent, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert again.returncode == 2
    assert "has finished run 1" in again.stderr


@pytest.mark.parametrize("kind", ["detection", "rating"])
def test_detection_and_ratings_go_on_after_a_kill(kind, browser, tmp_path):
    surrogate().save(tmp_path / "body.palpate")
    surrogate(factor=1.2).save(tmp_path / "other.palpate")
    text = shortened(ready_plan(kind, "live", ["body.palpate", "other.palpate"]), 3, catch=0)
    lump = {"high = 0.012": "high = 0.006", "[0.0, 0.0, -0.02]": "[0.0, 0.0, -0.009]"}
    for before, after in lump.items():
        text = text.replace(before, after)
    (tmp_path / "live.toml").write_text(text, "utf-8")
    total = 1 + 3 * (2 if kind == "rating" else 1)  # ratings are of the reference, too

    first = Sitting(browser, tmp_path / "live.toml")
    first.act(2, press=True)
    first.end(kill=True)
    (table,) = (tmp_path / "live" / "sub-01" / "beh").glob("*_events.tsv")
    before = table.read_bytes()
    second = Sitting(browser, tmp_path / "live.toml")
    second.act(total, press=True, answer=lambda felt: max(felt, key=felt.get))
    assert second.end() == 0

    rows = read_table(table)
    assert table.read_bytes().startswith(before)
    assert [int(row["trial"]) for row in rows] == list(range(1, total + 1))
    assert [row["part"] for row in rows] == ["1"] * 2 + ["2"] * (total - 2)
    assert_replayable(table.parent, rows[:1] + rows[-1:])
    if kind == "rating":
        names = ("stiffness", "smoothness", "resemblance", "confidence")
        assert {tuple(row[name] for name in names) for row in rows} == {("3", "4", "5", "6")}
        assert {row["condition"] for row in rows[1:]} == {"reference", "body1"}
    else:
        assert {row["condition"] for row in rows} == {"body1"}
        assert all(0.003 <= float(row["value"]) <= 0.006 for row in rows)
