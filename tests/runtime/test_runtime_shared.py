"""The sequence lock: nobody ever sees half a record."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from palpate.errors import DeviceError, UsageError
from palpate.runtime import shared_state as module
from palpate.runtime.shared_state import MAX_PLACES, STATE, Shared, State, now, size_of

WRITER = """
import sys
from palpate.runtime.shared_state import MAX_PLACES, size_of
from palpate.runtime.shared_state import Shared, now
shared = Shared.attach(sys.argv[1])
record, k, until = shared.state.record, 0, now() + 60.0
while now() < until and not (shared.command.fetch() and shared.command.record["quit"]):
    k += 1
    for name in ("tick", "hand", "force", "histogram", "work_histogram", "max_force"):
        record[name] = k
    shared.state.publish()
"""


@pytest.mark.full
def test_reader_never_sees_a_torn_record(shared):
    writer = subprocess.Popen([sys.executable, "-c", WRITER, shared.name])
    record, seen, until = shared.state.record, set(), now() + 60.0
    try:
        while len(seen) < 500:
            assert now() < until, "the writer must have been met at work"
            if shared.state.fetch():
                tick = int(record["tick"])
                for name in ("hand", "force", "histogram", "work_histogram", "max_force"):
                    assert (record[name] == tick).all()
                seen.add(tick)
    finally:
        shared.write_command(quit=True)
        assert writer.wait(20) == 0
    assert shared.read_state().tick >= max(seen)


def test_unfinished_write_changes_nothing(shared):
    other = Shared.attach(shared.name)
    other.state.record["tick"] = 7
    other.state.publish()
    assert shared.state.fetch()
    shared.state._sequence[()] += 1  # a writer has begun
    assert not shared.state.fetch()
    assert shared.state.record["tick"] == 7
    other.close()


def test_checksum_catches_what_the_counter_misses(shared):
    """Stores that a weakly ordered processor lets overtake the counter."""
    shared.state.publish()
    reader = Shared.attach(shared.name)
    shared.state._shared[3] ^= 1
    assert not reader.state.fetch()
    shared.state._shared[3] ^= 1
    assert reader.state.fetch()
    reader.close()


@pytest.mark.full
def test_writer_that_died_writing_is_noticed(shared):
    shared.state._sequence[()] += 1
    with pytest.raises(DeviceError, match="stopped while it was publishing"):
        shared.read_state()


def test_state_has_the_records_fields(shared):
    assert [f.name for f in dataclasses.fields(State)] == [*STATE.names, "indentation"]
    state = shared.read_state()
    assert state.tick == 0
    assert state.grabbed is False
    assert state.force.shape == (3,)
    shared.state.record["force"] = 1.0
    assert not state.force.any(), "a state is a copy"


def test_indentations_travel_with_the_state(shared):
    assert shared.read_state().indentation.shape == (0,), "nothing has yielded"
    loop = Shared.attach(shared.name)
    for amplitude in (np.array([0.5]), np.linspace(0, 1, MAX_PLACES)):
        loop.indentation.record["count"] = len(amplitude)
        loop.indentation.record["amplitude"][: len(amplitude)] = amplitude
        loop.indentation.publish(size_of(loop.indentation.record))
        kept = shared.read_state().indentation
        np.testing.assert_array_equal(kept, amplitude.astype("f4"))
    loop.indentation._sequence[()] += 1  # died writing: those before it stand
    np.testing.assert_array_equal(shared.read_state().indentation, kept)
    loop.close()


def test_command_keeps_what_is_not_given(shared):
    loop = Shared.attach(shared.name)
    assert loop.command.fetch()
    assert np.isnan(loop.command.record["parameters"]).all(), "not set"
    shared.write_command(target=(0.01, 0.02, 0.03), grabbed=True, parameters=[2.0])
    shared.write_command(beat=5.0, hidden=True)
    assert loop.command.fetch()
    record = loop.command.record
    assert record["target"].tolist() == [0.01, 0.02, 0.03]
    assert (record["beat"], record["grabbed"], record["hidden"], record["sequence"]) == (5.0, 1, 1, 1)
    assert record["parameters"][0] == 2.0
    with pytest.raises(UsageError, match="carries 8"):
        shared.write_command(parameters=[0.0] * 9)
    loop.close()


def test_names_end_with_their_owner(tmp_path):
    blocks = Shared.create()
    path = Path(blocks.name)
    assert path.exists()
    for _ in range(2):
        blocks.close()
        blocks.unlink()
    assert not path.exists()
    with pytest.raises(DeviceError, match="no shared memory"):
        Shared.attach(blocks.name)
    foreign = tmp_path / "foreign"
    foreign.write_bytes(b"x" * module._SIZE)
    with pytest.raises(DeviceError, match="another version of palpate"):
        Shared.attach(str(foreign))
