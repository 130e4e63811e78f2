"""Plans, sittings and the folder of an experiment: seeds, interruptions, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from palpate.cli.experiment_commands import write_plan as write_the_plan
from palpate.errors import FileFormatError, StudyError, UsageError
from palpate.experiments import analyse, read_plan
from palpate.experiments.analysis import Analysis, PersonResult
from palpate.experiments.analysis_picture import draw_analysis, save_pictures
from palpate.experiments.ready_plans import KINDS, ready_plan
from palpate.experiments.sitting import Sitting
from palpate.experiments.study_folder import Participant, StudyFolder, read_table


def write_plan(folder, kind="discrimination", name="trial", **changes):
    text = ready_plan(kind, name, ["body.palpate", "other.palpate"])
    for before, after in changes.items():
        text = text.replace(*after) if isinstance(after, tuple) else text.replace(before, after)
    file = folder / f"{name}.toml"
    file.write_text(text, encoding="utf-8")
    return file


def answered(sitting, count=10**6, seed=0):
    """Rows as a table has them, of so many random answers."""
    rng, rows = np.random.default_rng(seed), []
    while len(rows) < count and (trial := sitting.next()) is not None:
        response = int(rng.integers(1, len(trial.bodies) + 1))
        rows.append({"response": str(response)})
        sitting.answer(response)
    return rows


@pytest.mark.parametrize("kind", KINDS)
def test_a_ready_plan_is_a_plan_and_a_sitting_goes_on_from_its_answers(kind, tmp_path):
    plan = read_plan(write_plan(tmp_path, kind))
    first = Sitting(plan, "sub-01")
    rows = answered(first, 30)
    second = Sitting(plan, "sub-01")
    second.restore(rows)
    assert second.next() == first.next()
    assert second.done == len(rows)
    rest = answered(second)
    assert len(rows) + len(rest) == second.total
    assert second.next() is None


def test_a_sitting_does_not_go_on_from_answers_to_other_trials(folder):
    files = run_through(folder, "01", count=6)
    rows = files.rows()
    Sitting(folder.plan, "sub-01").restore(rows)
    rows[5]["level"] = str(float(rows[5]["level"]) + 0.05)
    with pytest.raises(UsageError, match="can't go on"):
        Sitting(folder.plan, "sub-01").restore(rows)
    with pytest.raises(UsageError, match="of its table is of another trial"):
        Sitting(folder.plan, "sub-02").restore(rows)


def test_a_folder_of_something_else_is_left_alone(tmp_path):
    file = write_plan(tmp_path)
    (tmp_path / "trial").mkdir()
    (tmp_path / "trial" / "dataset_description.json").write_text("{}")
    (tmp_path / "trial" / "participants.tsv").write_text("participant_id\tage\nsub-01\t30\n")
    with pytest.raises(UsageError, match=r"participants\.tsv, and nothing is ever overwritten"):
        StudyFolder.beside(file).prepare(file)
    assert (tmp_path / "trial" / "dataset_description.json").read_text() == "{}"


def test_a_plan_names_bodies_from_where_it_lies(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    bodies = [tmp_path / "whole.palpate", Path("models") / "other.palpate"]
    (tmp_path / "plans").mkdir()
    file = Path("plans") / "trial.toml"
    write_the_plan(bodies, "discrimination", "trial", file, show=False)
    plan = read_plan(file)
    for named, body in zip((plan.reference, plan.comparison[0].file), bodies, strict=True):
        assert (file.parent / named).resolve() == body.resolve()
    with pytest.raises(UsageError, match="letters and digits"):
        write_the_plan(bodies, "discrimination", "my trial", None, show=False)


def test_people_differ_and_runs_differ(tmp_path):
    plan = read_plan(write_plan(tmp_path))
    courses = []
    for label, run in (("sub-01", 1), ("sub-01", 2), ("sub-02", 1)):
        sitting, bodies = Sitting(plan, label, run), []
        for _ in range(30):
            bodies.append(sitting.next().bodies)
            sitting.answer(1)
        courses.append(bodies)
    assert courses[0] != courses[1] != courses[2] != courses[0]


def test_the_right_answer_is_the_stiffer_body(tmp_path):
    sitting = Sitting(read_plan(write_plan(tmp_path)), "sub-01")
    for _ in range(60):
        trial = sitting.next()
        stiffer = trial.target if trial.value >= 1.0 else 3 - trial.target
        assert trial.is_correct(stiffer)
        assert not trial.is_correct(3 - stiffer)
        sitting.answer(stiffer)


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("low = 0.55", "low = 1.2", "softer and stiffer"),
        ('question = "discrimination"', 'question = "detection"', "an input of the body"),
        ("trials = 80", "trials = 1", "trials"),
        ("trials = 80", "trails = 80", "trails"),
        ("max_force = 3.0", "max_force = 300.0", "max_force"),
    ],
)
def test_a_wrong_plan_is_refused_in_words(before, after, said, tmp_path):
    file = write_plan(tmp_path, change=(before, after))
    with pytest.raises(StudyError, match=said):
        read_plan(file)


@pytest.fixture
def folder(tmp_path):
    file = write_plan(tmp_path)
    own = StudyFolder.beside(file)
    own.prepare(file)
    return own


def run_through(folder, label, count=10**6, seed=0, shift=0.0):
    """Answer a sitting, or its rest, as a simulated person to whom the comparison is stiffer by `shift`."""
    who = Participant(label)
    folder.enrol(who)
    files = folder.sitting(who, 1)
    sitting, rng = Sitting(folder.plan, who.label), np.random.default_rng(seed)
    sitting.restore(files.rows())
    while sitting.done < count and (trial := sitting.next()) is not None:
        p = 0.01 + 0.98 / (1.0 + np.exp(-1.7 * (trial.level + shift) / 0.2))
        yes = rng.random() < p
        response = trial.target if yes else 3 - trial.target
        row = {"trial": trial.number, "kind": trial.kind, "condition": trial.condition, "part": 1}
        row |= {"level": f"{trial.level:.9g}", "intervals": ",".join(trial.bodies), "response": response}
        row |= {"correct": int(trial.is_correct(response)), "limits_hit": 0, "clock_jump": "0"}
        files.append(row)
        sitting.answer(response)
    return files


def test_analysis_finds_each_person_and_the_group(folder):
    for k in range(1, 4):
        run_through(folder, f"{k:02d}", seed=k)
    run_through(folder, "09", count=20)
    result = analyse(folder)
    assert [p.participant for p in result.people] == ["sub-01", "sub-02", "sub-03"]
    assert any("sub-09" in text for text in result.left_out)
    (group,) = result.groups
    assert group.location.low < 0.0 < group.location.high
    assert group.log_spread.low < np.log(0.6745 * 0.2) < group.log_spread.high
    json.dumps(result.as_dict())
    assert "Weber fraction" in str(result)
    for person in result.people:
        assert sum(count for _, _, count in person.points) == 80
    svg, png = save_pictures(result, folder)
    assert "sub-02" in svg.read_text("utf-8")
    assert png.stat().st_size > 10_000
    folder.forget(Participant("sub-02"))
    assert not any(picture.exists() for picture in folder.pictures)  # they show a person


def test_rows_of_a_picture_are_people_also_where_conditions_have_others(tmp_path):
    text = ready_plan("discrimination", "two", ["a.palpate", "a.palpate", "c.palpate"])
    (tmp_path / "plan.toml").write_text(text, "utf-8")
    people = tuple(
        PersonResult(f"sub-{k}", condition, 80, (0.1 * k - 0.1, 0.1 * k, 0.1 * k + 0.1), (0.1, 0.2, 0.3), 0.0,
                     1.0, 0.5, (), ((0.0, 0.5, 80),))
        for condition, k in (("same", 1), ("same", 3), ("body2", 2), ("body2", 3))
    )  # fmt: skip
    drawn = draw_analysis(Analysis(read_plan(tmp_path / "plan.toml"), people, (), (), ()))
    labels = drawn.axes[2].get_yticklabels()  # of both columns
    shown = [
        (labels[round(line.get_ydata()[0])].get_text(), round(line.get_xdata()[0], 9))
        for axes in drawn.axes[2:]
        for line in axes.lines[1::2]  # middles; intervals are between them
    ]
    assert shown == [(p.participant, round(p.location[1], 9)) for p in people]


def test_a_line_that_a_kill_cut_off_is_left_out(folder):
    files = run_through(folder, "01", count=7)
    whole = files.table.read_bytes()
    with files.table.open("ab") as table:
        table.write(b"3.2\t1.0\t1\t8\ttri")
    analyse(folder)  # it does not change the file
    assert files.table.read_bytes() != whole
    assert len(files.rows()) == 7
    assert files.table.read_bytes() == whole


def test_nothing_is_overwritten(folder, tmp_path):
    files = run_through(folder, "01", count=3)
    first = files.recording(4, 1)
    first.write_bytes(b"a touch")
    assert files.recording(4, 1) != first
    files.describe({"part": 1})
    files.describe({"part": 2})
    assert len(list(files.folder.glob("*_beh.json"))) == 2
    changed = write_plan(tmp_path, change=("trials = 80", "trials = 60"))
    with pytest.raises(UsageError, match="has changed since the first sitting"):
        folder.prepare(changed)
    run_through(folder, "x1", count=1)
    with pytest.raises(UsageError, match="case"):
        folder.sitting(Participant("X1"), 1)


def test_two_programs_do_not_run_one_sitting(folder):
    files = run_through(folder, "01", count=3)
    with files.held(), pytest.raises(UsageError, match="another process"), files.held():
        pass
    with files.held(), pytest.raises(UsageError, match="being run"):
        folder.forget(Participant("sub-01"))
    with files.held():
        pass


def test_forget_removes_a_person_and_nobody_else(folder):
    for label in ("01", "02"):
        run_through(folder, label, count=3)
    assert folder.forget(Participant("sub-01")) == 1
    assert folder.people() == ["sub-02"]
    assert [row["participant_id"] for row in read_table(folder.root / "participants.tsv")] == ["sub-02"]
    assert not [p for p in folder.root.rglob("*") if "sub-01" in p.name]
    with pytest.raises(UsageError, match="is not in"):
        folder.forget(Participant("sub-01"))


def test_a_label_is_no_name_and_no_path():
    for label in ("../elsewhere", "Anna Berg", "sub-", "a/b"):
        with pytest.raises(UsageError, match="label"):
            Participant(label)


def test_a_damaged_table_is_refused(folder):
    files = run_through(folder, "01", count=3)
    with files.table.open("a", encoding="utf-8") as table:
        table.write("1\t2\n")
    with pytest.raises(FileFormatError, match="columns"):
        analyse(folder)


def test_each_column_has_a_meaning(folder):
    files = run_through(folder, "01", count=3)
    header = files.table.read_text("utf-8").splitlines()[0].split("\t")
    described = json.loads((folder.root / "task-trial_events.json").read_text("utf-8"))
    assert header == list(described)
    assert all(described[name]["Description"] for name in header)


def test_experts_rate_apart_from_others(tmp_path):
    """Each kind of expertise has quartiles and odds of its own; what is rated two higher has odds above one."""
    file = write_plan(tmp_path, "rating")
    folder = StudyFolder.beside(file)
    folder.prepare(file)
    rng = np.random.default_rng(2)
    for k in range(1, 7):
        who = Participant(f"{k:02d}", expertise="surgeon" if k % 2 else "student")
        folder.enrol(who)
        files, sitting = folder.sitting(who, 1), Sitting(folder.plan, who.label)
        while (trial := sitting.next()) is not None:
            row = {"trial": trial.number, "kind": trial.kind, "condition": trial.condition, "part": 1}
            middle = 3 + 2 * (trial.condition != "reference") * (k % 2)
            files.append(row | {r.name: middle + int(rng.integers(-1, 2)) for r in folder.plan.rating})
            sitting.answer(1)
    result = analyse(folder)
    json.dumps(result.as_dict())
    odds = {
        r.expertise: r.odds for r in result.ratings if r.statement == "stiffness" and r.condition == "body1"
    }
    assert odds["surgeon"][0] > 1.0
    assert odds["student"][2] < odds["surgeon"][0]  # the others' ratings are of one distribution
    assert {r.people for r in result.ratings} == {3}
    assert "odds of a higher rating" in str(result)
