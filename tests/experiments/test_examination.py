"""An examination while it is taken: marks stand as they were said, interruptions cost nothing, nothing is replaced."""

from __future__ import annotations

import pytest
from examined import slab

from palpate.errors import UsageError
from palpate.experiments.append_record import Clocks
from palpate.experiments.exam_folders import PastExamination, exam_directory, past_examinations
from palpate.experiments.exam_kinds import kind_of_body
from palpate.experiments.examination import Examination, Mark, standing_marks
from palpate.surrogates import Lump

LUMPS = (Lump((0.005, 0.0, -0.008), 0.005, 10.0), Lump((-0.01, 0.01, -0.012), 0.006, 3.0))


@pytest.fixture
def body(tmp_path):
    path = tmp_path / "slab.palpate"
    path.write_bytes(b"the body of a slab")
    return path


def begin(tmp_path, body, **options):
    return Examination.begin(tmp_path / "exams", kind_of_body("slab", slab()), body, LUMPS, seed=7, **options)


def test_marks_stand_as_they_were_last_said(tmp_path, body):
    with begin(tmp_path, body) as exam:
        first, second, third = (exam.mark((x, 0.0, 0.0)) for x in (0.0, 0.01, 0.02))
        exam.answer(first.number, hardness="hard")
        exam.answer(first.number, depth="deep")
        exam.answer(third.number, hardness="soft")
        exam.answer(third.number, hardness="")
        exam.remove(second.number)
        exam.mark((0.03, 0.0, 0.0))
        expected = [
            Mark(1, (0.0, 0.0, 0.0), "hard", "deep"),
            Mark(3, (0.02, 0.0, 0.0)),
            Mark(4, (0.03, 0.0, 0.0)),  # a number is given once, whatever is removed
        ]
        assert list(exam.marks.values()) == expected
    assert standing_marks(PastExamination.read(exam.folder).events) == expected


def test_an_interrupted_one_goes_on_with_its_marks_lumps_and_time(tmp_path, body):
    time = [0.0]
    clocks = Clocks(lambda: time[0], lambda: 1.7e9 + time[0])
    with begin(tmp_path, body, clocks=clocks) as exam:
        time[0] += 20.0
        exam.mark((0.0, 0.0, 0.0))
    time[0] += 9000.0
    with Examination.resume(exam.folder, clocks) as again:
        assert again.marks == exam.marks
        assert again.past.lumps == LUMPS
        time[0] += 5.0
        again.end()
    past = PastExamination.read(exam.folder)
    assert past.has_end
    assert past.seconds == pytest.approx(25.0)
    with pytest.raises(UsageError, match="has ended"):
        Examination.resume(exam.folder, clocks)


def test_nothing_is_ever_replaced(tmp_path, body):
    standing = Clocks(lambda: 0.0, lambda: 1.7e9)  # a clock that was set back to the same second
    exams = [begin(tmp_path, body, clocks=standing) for _ in range(3)]
    for exam in exams:
        exam.close()
    assert len({exam.folder for exam in exams}) == 3
    assert len(past_examinations(tmp_path / "exams")) == 3
    assert len(list((tmp_path / "exams" / "bodies").iterdir())) == 1  # of one body, once
    (exams[0].folder / "touch-1.trace").touch()
    assert exams[0].past.next_trace.name == "touch-2.trace"
    (exams[0].folder / "touch-3.trace").touch()  # the second was taken away
    assert exams[0].past.next_trace.name == "touch-4.trace"


def test_two_processes_cant_hold_one_examination(tmp_path, body):
    with begin(tmp_path, body) as exam, pytest.raises(UsageError, match="in use"):
        Examination.resume(exam.folder)


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda exam: exam.mark((float("nan"), 0.0, 0.0)), "needs a place"),
        (lambda exam: exam.mark((0.0, 0.0)), "needs a place"),
        (lambda exam: exam.answer(9, hardness="hard"), "no mark 9"),
        (lambda exam: exam.answer(1, hardness="blue"), "no answer"),
        (lambda exam: exam.remove(9), "no mark 9"),
        (lambda exam: [exam.mark((0.0, 0.0, 0.0)) for _ in range(60)], "Remove a mark"),
    ],
)
def test_what_makes_no_sense_is_refused_and_not_recorded(tmp_path, body, act, words):
    with begin(tmp_path, body) as exam:
        exam.mark((0.0, 0.0, 0.0))
        with pytest.raises(UsageError, match=words):
            act(exam)
        assert all(mark.hardness in {"", "hard", "soft"} for mark in exam.marks.values())
        assert standing_marks(exam.record.events) == list(exam.marks.values())


def test_a_folder_without_a_beginning_is_none(tmp_path):
    (tmp_path / "exams" / "slab-1").mkdir(parents=True)
    (tmp_path / "exams" / "slab-1" / "events.jsonl").touch()  # killed before the first event
    assert past_examinations(tmp_path / "exams") == []
    with pytest.raises(UsageError, match="holds no examination"):
        PastExamination.read(tmp_path / "exams" / "slab-1")


def test_examinations_lie_in_the_users_data_directory(monkeypatch, tmp_path):
    for name in ("XDG_DATA_HOME", "LOCALAPPDATA", "HOME", "USERPROFILE"):
        monkeypatch.setenv(name, str(tmp_path))
    assert exam_directory().is_relative_to(tmp_path)
    assert exam_directory().parts[-2:] == ("palpate", "examinations")
