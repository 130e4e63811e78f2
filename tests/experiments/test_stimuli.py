"""Bodies that are made stiffer, and the conductor of a sitting on a loop that stands in."""

from __future__ import annotations

import itertools
import tomllib
from types import SimpleNamespace

import numpy as np
import pytest

from models import spring_beam
from palpate.errors import DeviceError, ResourceError, UsageError
from palpate.experiments import stiffened
from palpate.experiments.conductor import Conductor
from palpate.experiments.experiment_plan import Plan
from palpate.experiments.ready_plans import ready_plan
from palpate.experiments.sitting import Sitting
from palpate.experiments.stimuli import Stimuli
from palpate.experiments.study_folder import Participant, StudyFolder, read_table
from palpate.runtime.touchable import load_touchable
from palpate.surrogates import Surrogate
from pressed import surrogate


@pytest.mark.grid
@pytest.mark.parametrize("body", [surrogate(), spring_beam()], ids=["pressed", "held"])
def test_a_stiffened_body_is_the_body_times_a_ratio(body: Surrogate):
    X = body.hand_energy.trained_rows()[:50]
    for ratio in (0.5, 1.0, 1.3):
        other = stiffened(body, ratio).hand_energy
        scale = np.abs(body.hand_energy.force(X)).max()
        assert np.abs(other.force(X) - ratio * body.hand_energy.force(X)).max() <= 1e-14 * scale
        stiffness = body.hand_energy.stiffness(X)
        assert other.stiffness(X) == pytest.approx(ratio * stiffness, rel=1e-12, abs=1e-12)
    with pytest.raises(UsageError, match="ratio"):
        stiffened(body, 0.0)


class StandIn:
    """A loop that presses when it is told to; recordings are empty files."""

    def __init__(self, deepest: float) -> None:
        self.scale, self.swaps, self.commands, self.pressed = 1.0, [], [], False
        self.shared = SimpleNamespace(write_command=lambda **c: self.commands.append(c))
        self.recording, self.deepest, self.lost = None, deepest, False

    def read(self) -> SimpleNamespace:
        if self.lost:
            raise DeviceError("The device is gone.")
        depth = 0.4 * self.deepest if self.pressed else 0.0
        force = np.array([0.0, 0.0, 1.0 if self.pressed else 0.0])
        return SimpleNamespace(grabbed=True, stalled=False, force=force, depth=depth, blending=False,
                               clamped=False, position=np.zeros(3))  # fmt: skip

    def swap(self, file) -> None:
        self.swaps.append(file.name)

    def start_recording(self, path) -> None:
        path.write_bytes(b"")
        self.recording = SimpleNamespace(error=None)

    def stop_recording(self) -> SimpleNamespace | None:
        return self.recording


class Clock:
    def __init__(self) -> None:
        self.time, self.offset = 100.0, 0.0

    def steady(self) -> float:
        return self.time

    def wall(self) -> float:
        return 1e9 + self.time + self.offset


@pytest.fixture
def stage(tmp_path):
    """A conductor with its stand-ins, and what leads it through one trial."""
    surrogate().save(tmp_path / "body.palpate")
    text = ready_plan("discrimination", "trial", ["body.palpate"]).replace('name = "page"', 'name = "haply"')
    file = tmp_path / "trial.toml"
    file.write_text(
        text.replace("trials = 80", "trials = 10").replace("practice = 4", "practice = 0"), "utf-8"
    )
    folder = StudyFolder.beside(file)
    stimuli = Stimuli(folder.plan, tmp_path, folder.root / "stimuli")
    folder.prepare(file)
    files, clock = folder.sitting(Participant("01"), 1), Clock()
    loop = StandIn(stimuli.bodies["reference"].deepest)
    sitting = Sitting(folder.plan, "sub-01")
    conductor = Conductor(
        folder.plan,
        sitting,
        stimuli,
        files,
        loop,
        clock=clock.steady,
        wall=clock.wall,  # type: ignore[arg-type]
    )

    def lead(until: str, most: int = 2000) -> None:
        for _ in range(most):
            if conductor.phase == until:
                return
            clock.time += 1.0 / 60.0
            loop.pressed = conductor.phase == "touch"
            conductor.step()
        raise AssertionError(f"{conductor.phase} is not {until}")

    return SimpleNamespace(c=conductor, loop=loop, clock=clock, files=files, lead=lead, tmp=tmp_path)


def test_a_trial_is_written_when_it_is_answered(stage):
    c = stage.c
    c.hear({"go": True})
    assert c.phase == "consent"  # nothing goes on without it
    c.hear({"agree": True})
    c.hear({"go": True})
    stage.lead("question")
    assert not stage.files.table.exists()
    c.hear({"answer": 3})
    c.hear({"answer": "1"})
    assert c.phase == "question"  # no such interval
    c.hear({"answer": 2})
    (row,) = read_table(stage.files.table)
    assert row["response"] == "2"
    assert row["presses"] == "1,1"
    assert row["peak_force"] == "1,1"
    assert c.phase == "ready"
    assert len(row["recordings"].split(",")) == 2


def test_the_participants_view_tells_nothing(stage):
    """Whatever is compared, the view is the same for the reference and the comparison."""
    c = stage.c
    c.hear({"agree": True})
    c.hear({"go": True})
    stage.lead("touch")
    views = [c.participant_view()]
    stage.lead("between")
    stage.lead("touch")
    views.append(c.participant_view())
    assert [v.pop("interval") for v in views] == [1, 2]
    for view in views:
        assert set(view) == {
            "phase",
            "words",
            "page",
            "intervals",
            "depth",
            "beyond",
        }  # no force with a device
        view.pop("depth")
    assert views[0] == views[1]


def test_a_pause_gives_the_trial_again(stage):
    c = stage.c
    c.hear({"agree": True})
    c.hear({"go": True})
    stage.lead("touch")
    trial = c.sitting.next()
    c.command({"wish": "pause"})
    assert {"stop": True} in stage.loop.commands
    c.hear({"go": True})
    assert c.phase == "paused"
    c.command({"wish": "resume", "note": "a\tnote"})
    assert c.sitting.next() == trial
    c.hear({"go": True})
    stage.lead("question")
    c.hear({"answer": 1})
    assert "attempt-2" in read_table(stage.files.table)[0]["recordings"]


def test_a_jump_of_the_clock_is_noted_and_changes_no_time(stage):
    c = stage.c
    c.hear({"agree": True})
    c.hear({"go": True})
    stage.lead("question")
    stage.clock.offset = -3600.0
    c.hear({"answer": 1})
    (row,) = read_table(stage.files.table)
    assert float(row["clock_jump"]) == pytest.approx(-3600.0, abs=0.1)
    assert 0.0 < float(row["duration"]) < 60.0
    assert "clock went back by 60 min; the" in c.control_view()["said"]


def test_a_jump_of_the_clock_between_trials_is_noted_with_the_next_and_not_again(stage):
    c = stage.c
    c.hear({"agree": True})
    for jump in (0.0, -7200.0, 0.0):
        stage.clock.offset += jump
        c.hear({"go": True})
        stage.lead("question")
        c.hear({"answer": 1})
    rows = read_table(stage.files.table)
    assert [float(row["clock_jump"]) for row in rows] == pytest.approx([0.0, -7200.0, 0.0], abs=0.1)
    assert all(float(a["onset"]) < float(b["onset"]) for a, b in itertools.pairwise(rows))
    again = Sitting(c.plan, "sub-01")
    again.restore(list(rows))
    assert again.done == 3


def test_a_device_that_is_gone_ends_in_words(stage):
    c = stage.c
    c.hear({"agree": True})
    c.hear({"go": True})
    stage.lead("touch")
    stage.loop.lost = True
    stage.lead("failed")
    assert "wait" in c.participant_view()["words"]
    assert "The device is gone." in c.control_view()["said"]


def test_the_time_of_a_sitting_is_limited(stage):
    stage.c.hear({"agree": True})
    stage.clock.time += 60.0 * 45.0 + 1.0
    stage.lead("done")
    assert "time" in stage.c.participant_view()["words"]


def test_bodies_that_are_missing_or_not_enough_are_refused(stage):
    plan = stage.c.plan.model_copy(update={"reference": "nowhere.palpate"})
    with pytest.raises(UsageError, match="not there"):
        Stimuli(plan, stage.tmp, stage.tmp / "stimuli")
    vary = stage.c.plan.vary.model_copy(update={"what": "lump_radius"})
    with pytest.raises(UsageError, match="no input 'lump_radius'"):
        Stimuli(stage.c.plan.model_copy(update={"vary": vary}), stage.tmp, stage.tmp / "stimuli")


def test_a_hidden_lump_is_felt_and_one_that_leaves_the_skin_is_refused(stage):
    body = stage.c.stimuli.bodies["reference"]
    place = (body.home - (body.radius + 0.02) * body.normal).tolist()
    text = ready_plan("detection", "lump", ["body.palpate"])
    text = text.replace("place = [0.0, 0.0, -0.02]", f"place = {place}")
    plan = Plan.model_validate(tomllib.loads(text))
    stimuli = Stimuli(plan, stage.tmp, stage.tmp / "lumps")
    trial = Sitting(plan, "sub-01").next()
    press = (body.home - 0.5 * body.deepest * body.normal)[None]
    forces = {}
    for interval, name in enumerate(trial.bodies, 1):
        touched = load_touchable(stimuli.felt(trial, interval).file)
        forces[name] = np.linalg.norm(touched.energy.force(press))
    assert forces["same"] > 1.02 * forces["reference"]
    large = plan.model_copy(update={"vary": plan.vary.model_copy(update={"high": 0.03})})
    with pytest.raises(UsageError, match="leaves the skin"):
        Stimuli(large, stage.tmp, stage.tmp / "lumps")
    x, y, z = place
    moved = plan.model_copy(update={"vary": plan.vary.model_copy(update={"place": (x + 1e-3, y, z)})})
    again = Stimuli(moved, stage.tmp, stage.tmp / "lumps").felt(trial, trial.target)
    assert again.file != stimuli.felt(trial, trial.target).file  # the lump where the plan now has it


def test_a_full_disk_ends_in_words_and_the_trial_comes_again(stage, monkeypatch):
    c = stage.c
    c.hear({"agree": True})
    c.hear({"go": True})
    stage.lead("question")
    trial = c.sitting.next()

    def refuse(*_):
        raise ResourceError("The disk is full.")

    monkeypatch.setattr(stage.files, "append", refuse)
    monkeypatch.setattr(stage.files, "note", refuse)
    c.hear({"answer": 1})
    assert c.phase == "failed"
    assert "The disk is full." in c.control_view()["said"]
    assert c.sitting.next() == trial


def test_a_hand_that_is_no_number_is_not_heard(stage):
    for hand in (float("nan"), "deep", None, [0.5]):
        stage.c.hear({"hand": hand, "held": True})
    assert stage.c._hand == 0.0
    assert not stage.c._held
