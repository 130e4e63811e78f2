"""A record is only ever appended to: what a kill leaves can be read and gone on with, by one process at a time."""

from __future__ import annotations

import subprocess
import sys

import pytest

from palpate.errors import FileFormatError, UsageError
from palpate.experiments.append_record import AppendRecord, Clocks, read_events


class Time:
    """Two clocks that a test moves."""

    def __init__(self):
        self.steady, self.wall = 100.0, 1.7e9
        self.clocks = Clocks(lambda: self.steady, lambda: self.wall)

    def go(self, seconds, jump=0.0):
        self.steady += seconds
        self.wall += seconds + jump


def kinds(path):
    return [event["kind"] for event in read_events(path)]


def test_time_is_that_of_the_steady_clock_without_interruptions(tmp_path):
    time, path = Time(), tmp_path / "events.jsonl"
    with AppendRecord(path, time.clocks) as record:
        record.add("begun")
        time.go(10.0)
        record.add("marked")
    time.go(5000.0)
    with AppendRecord(path, time.clocks) as record:
        time.go(3.0)
        assert record.add("ended")["elapsed"] == pytest.approx(13.0)
    assert kinds(path) == ["begun", "marked", "ended"]


@pytest.mark.parametrize("jump", [-7200.0, 86400.0])
def test_a_jump_of_the_wall_clock_is_an_event_and_no_time(tmp_path, jump):
    time, path = Time(), tmp_path / "events.jsonl"
    with AppendRecord(path, time.clocks) as record:
        record.add("begun")
        time.go(4.0, jump)
        assert record.add("marked")["elapsed"] == pytest.approx(4.0)
    events = read_events(path)
    assert [event["kind"] for event in events] == ["begun", "clock", "marked"]
    assert events[1]["seconds"] == pytest.approx(jump)


def test_a_clock_set_back_between_two_runs_is_noted(tmp_path):
    time, path = Time(), tmp_path / "events.jsonl"
    with AppendRecord(path, time.clocks) as record:
        record.add("begun")
    time.go(60.0, -3600.0)
    with AppendRecord(path, time.clocks) as record:
        assert record.events[-1]["kind"] == "clock"


@pytest.mark.parametrize("cut", [1, 20])
def test_a_line_that_was_cut_off_stays_and_is_left_out(tmp_path, cut):
    path = tmp_path / "events.jsonl"
    with AppendRecord(path) as record:
        record.add("begun")
        record.add("marked", number=1)
    path.write_bytes(path.read_bytes()[:-cut])
    before = path.read_bytes()
    with AppendRecord(path) as record:
        record.add("resumed")
    assert path.read_bytes().startswith(before)
    whole = ["marked"] if cut == 1 else []  # without its line's end alone an event is whole
    assert kinds(path) == ["begun", *whole, "resumed"]


def test_a_killed_process_leaves_each_event_that_it_was_told_of(tmp_path):
    path = tmp_path / "events.jsonl"
    code = (
        "import sys\nfrom palpate.experiments.append_record import AppendRecord\n"
        "record = AppendRecord(sys.argv[1])\n"
        "for k in range(10**6):\n    record.add('marked', number=k)\n    print(k, flush=True)\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        for _ in range(20):
            process.stdout.readline()
        with pytest.raises(UsageError, match="in use"):
            AppendRecord(path)
        process.kill()
        acknowledged = 20 + len(process.stdout.read().split())
    numbers = [event["number"] for event in read_events(path)]
    assert numbers[: acknowledged - 1] == list(range(acknowledged - 1))
    with AppendRecord(path) as record:
        assert len(record.events) == len(numbers)


def test_a_foreign_file_is_refused(tmp_path):
    path = tmp_path / "events.jsonl"
    path.write_text("no\nrecord\n", encoding="utf-8")
    with pytest.raises(FileFormatError, match="no record"):
        read_events(path)
