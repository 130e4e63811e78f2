"""Recordings of the real process: from its first tick, by a button in its midst, killed, and on a disk that is full."""

from __future__ import annotations

import contextlib
import errno
import io
import json
import os
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.devices.tick_record import TICK
from palpate.devices.trace_file import COLUMNS, FORMAT, VERSION, TraceWriter, read_trace
from palpate.errors import FileFormatError, ResourceError, UsageError
from palpate.runtime import LoopProcess, now
from palpate.runtime.replay import Replay, is_recorded_model
from palpate.runtime.touchable import load_touchable
from waiting import wait_for


def assert_same(path, model):
    trace = read_trace(path)
    assert is_recorded_model(trace, model)
    replayed = Replay(trace, load_touchable(model)).run()
    assert replayed.identical, str(replayed)
    return trace


@pytest.mark.full
def test_a_run_is_recorded_from_its_first_tick_and_a_button_records_its_midst(spring_file, tmp_path):
    whole, part = tmp_path / "whole.trace", tmp_path / "part.trace"
    with LoopProcess(spring_file, device="simulated:frequency=3,delay=0.002", record=whole) as loop:
        wait_for(lambda: loop.recording.ticks > 300)
        with pytest.raises(UsageError, match="being recorded"):
            loop.start_recording(part)
        loop.stop_recording()
        loop.start_recording(part).add_event("note", text="by hand")
        wait_for(lambda: loop.recording.ticks > 300)
    trace = assert_same(whole, spring_file)
    assert trace.ticks["tick"][0] == 1
    assert not trace.notes
    assert np.abs(trace.ticks["force"]).max() > 0.1
    trace = assert_same(part, spring_file)
    assert trace.ticks["tick"][0] > 300
    assert trace.events[0]["kind"] == "note"
    assert trace.end["report"]["ticks"] >= trace.ticks["tick"][-1]
    assert trace.end["lost"] == 0
    with pytest.raises(UsageError, match="exists already"), LoopProcess(spring_file, record=whole):
        pass


@pytest.mark.full
def test_a_replay_is_published_at_its_own_pace(spring_file, tmp_path):
    path = tmp_path / "a.trace"
    with LoopProcess(spring_file, device="stroke:frequency=2", record=path) as loop:
        wait_for(lambda: loop.recording.ticks > 500)
    trace = read_trace(path)
    with LoopProcess(spring_file, replay=path) as loop:
        states = []
        while not states or states[-1].tick < len(trace) or now() - states[-1].time > 0.2:
            states.append(loop.read())
            time.sleep(0.002)
        loop.shared.write_command(beat=now(), grabbed=True, target=(0.0, -0.03, 0.0))  # unheard
        wait_for(lambda: not loop.read().force.any())
    seen = {s.tick: s.force for s in states if s.fault == 0 and s.grabbed}
    assert len(seen) > 20
    for tick, force in seen.items():
        np.testing.assert_array_equal(force, trace.ticks["force"][tick - 1])
    behind = [s.time - trace.ticks["time"][s.tick - 1] for s in states if s.tick in seen]
    assert max(behind) - min(behind) < 1e-6, "s: each tick is as long after the first as it was"


@pytest.mark.full
@pytest.mark.skipif(os.name != "posix", reason="signals are POSIX's")
def test_a_killed_recorder_keeps_all_that_it_said_it_had_written(spring_file, tmp_path):
    path = tmp_path / "a.trace"
    script = (
        "import sys, time; from palpate.runtime import LoopProcess\n"
        "with LoopProcess(sys.argv[1], device='stroke', record=sys.argv[2]) as loop:\n"
        "    while True:\n"
        "        time.sleep(0.05); print(loop.recording.ticks, flush=True)\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", script, spring_file, path], stdout=subprocess.PIPE, text=True
    ) as process:
        last = 0
        for line in process.stdout:
            last = int(line)
            if last > 1500:
                break
        process.send_signal(signal.SIGKILL)
    trace = read_trace(path)
    assert len(trace) >= last > 0
    assert "has no end" in trace.notes[0]
    assert Replay(trace, load_touchable(spring_file)).run().identical


def test_an_unfinished_chunk_is_left_out_with_a_note(tmp_path):
    path, ticks = tmp_path / "a.trace", np.zeros(300, TICK)
    ticks["tick"], ticks["force"] = np.arange(300), np.random.default_rng(0).normal(size=(300, 3))
    writer = TraceWriter(path, {"name": "nobody"})
    for part in (ticks[:200], ticks[200:]):
        writer.add_ticks(part)
    writer.close({})
    assert not read_trace(path).notes
    with zipfile.ZipFile(path) as archive:  # with its directory it is a plain archive
        assert archive.testzip() is None
        assert len(archive.namelist()) == 5  # with the copy of the header
    data = path.read_bytes()
    for cut in (data.index(b"ticks-000002.npz") + 100, data.index(b"ticks-000002.npz") - 3):
        path.write_bytes(data[:cut])
        trace = read_trace(path)
        np.testing.assert_array_equal(trace.ticks[list(COLUMNS)], ticks[:200][list(COLUMNS)])
        assert "unfinished chunk" in trace.notes[0]
    path.write_bytes(data[:20])
    with pytest.raises(FileFormatError, match="is no recording"):
        read_trace(path)


@pytest.mark.full
@pytest.mark.skipif(os.name != "posix", reason="limits of a process are POSIX's")
def test_a_full_disk_ends_the_recording_and_not_the_loop(spring_file, tmp_path):
    resource = pytest.importorskip("resource")
    path, limits = tmp_path / "a.trace", resource.getrlimit(resource.RLIMIT_FSIZE)
    with LoopProcess(spring_file, device="stroke", record=path) as loop:
        wait_for(lambda: loop.recording.ticks > 300)
        try:
            resource.setrlimit(resource.RLIMIT_FSIZE, (loop.recording.size + 1000, limits[1]))
            wait_for(lambda: loop.recording.error is not None)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        tick = loop.read().tick
        wait_for(lambda: loop.read().tick > tick + 50)
        assert not loop.recording.active
    assert "full" in str(loop.recording.error)
    trace = read_trace(path)
    assert len(trace) == loop.recording.ticks > 300
    assert Replay(trace, load_touchable(spring_file)).run().identical


def test_a_folder_that_nobody_may_write_to_is_an_error_before_the_loop(spring_file, tmp_path, monkeypatch):
    with (
        pytest.raises(UsageError, match="could not be begun"),
        LoopProcess(spring_file, record=tmp_path / "no" / "a.trace"),
    ):
        pass

    def refuse(*_, **__):
        raise PermissionError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(ResourceError, match="could not be begun"):
        TraceWriter(tmp_path / "a.trace", {})


def test_a_recording_larger_than_memory_is_refused_before_it_is_unfolded(tmp_path, monkeypatch):
    path = tmp_path / "a.trace"
    writer = TraceWriter(path, {"name": "nobody"})
    for _ in range(3):
        writer.add_ticks(np.zeros(1000, TICK))
    writer.close({})
    needed = 3 * 1000 * TICK.itemsize
    assert path.stat().st_size < needed / 20
    for free, fits in ((2 * needed, True), (2 * needed - 2, False)):
        monkeypatch.setattr("psutil.virtual_memory", lambda free=free: SimpleNamespace(available=free))
        with contextlib.nullcontext() if fits else pytest.raises(ResourceError, match="does not fit"):
            assert len(read_trace(path)) == 3000


@pytest.mark.full
@pytest.mark.parametrize("whole", [True, False])
def test_a_flipped_bit_costs_its_block(tmp_path, whole):
    """Everywhere in the file, in heads and contents, with the file's end and without."""
    path, ticks = tmp_path / "a.trace", np.zeros(400, TICK)
    ticks["tick"], ticks["force"] = np.arange(400), np.random.default_rng(0).normal(size=(400, 3))
    writer = TraceWriter(path, {"name": "nobody"})
    for first in range(0, 400, 100):
        writer.add_ticks(ticks[first : first + 100])
    (writer.close({}) if whole else writer.abandon())
    data, rng = path.read_bytes(), np.random.default_rng(1)
    begin = data.index(b"ticks-000001.npz") - 30  # the first header, without its copy, tells what was touched
    end = data.index(b"header-copy.json") - 30 if whole else len(data)
    for place in rng.integers(0 if whole else begin, end, 60).tolist():
        mutant = bytearray(data)
        mutant[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(mutant)
        trace = read_trace(path)
        block = sum(place >= data.index(f"ticks-{k:06d}.npz".encode()) - 30 for k in range(1, 5)) - 1
        kept = ticks if block < 0 else np.delete(ticks, slice(100 * block, 100 * block + 100))
        np.testing.assert_array_equal(trace.ticks[list(COLUMNS)], kept[list(COLUMNS)])
        assert trace.header["name"] == "nobody"
        assert "damaged at byte" in trace.notes[0] or not whole


def test_a_damaged_or_forged_file_is_no_more_than_an_error(tmp_path):
    path, ticks = tmp_path / "a.trace", np.zeros(300, TICK)
    ticks["tick"] = np.arange(300)
    writer = TraceWriter(path, {"name": "nobody"})
    writer.add_ticks(ticks[:200])
    writer.add_ticks(ticks[200:])
    writer.close({})
    data, rng = path.read_bytes(), np.random.default_rng(0)
    middle = data.index(b"ticks-000002.npz") + 60
    path.write_bytes(data[:middle] + b"X" + data[middle + 1 :])
    assert len(read_trace(path)) == 200
    assert "damaged at byte" in read_trace(path).notes[0]
    for _ in range(100):
        mutant = bytearray(data)
        mutant[rng.integers(len(data))] = rng.integers(256)
        path.write_bytes(mutant)
        with contextlib.suppress(FileFormatError):
            assert len(read_trace(path)) in {0, 100, 200, 300}
    for forged in (
        {"count": 10**15, "same": []},
        {"count": -1},
        {"count": 3, "same": [], "tick": np.zeros(7)},
    ):
        chunk = io.BytesIO()
        np.savez(chunk, **forged)
        with zipfile.ZipFile(path, "w") as archive:  # by another program
            archive.writestr("header.json", json.dumps({"format": FORMAT, "version": VERSION}))
            archive.writestr("ticks-000001.npz", chunk.getvalue())
        with pytest.raises(FileFormatError, match="damaged"):
            read_trace(path)
    for header in ("[]", '{"format": "palpate trace", "version": Infinity}', "[" * 100_000):
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("header.json", header)
        with pytest.raises(FileFormatError):
            read_trace(path)
    path.write_bytes(data)
    with pytest.raises(FileFormatError, match="can't be replayed"):
        Replay(read_trace(path), None)
