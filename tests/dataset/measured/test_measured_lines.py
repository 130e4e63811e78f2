"""The line protocol, over pipes and over TCP of this machine."""

from __future__ import annotations

import os
import queue
import socket
import threading
import time

import numpy as np
import pytest

from palpate.dataset.measured import lines_of, listening, measurements
from palpate.errors import DeviceError, PortInUseError, UsageError

HELLO = "palpate 1 length=mm force=mN time=ms"


def taken(*lines):
    answers = []
    found = list(measurements(lines, answers.append))
    return found, answers


def test_good_lines_become_measurements_in_si():
    found, answers = taken("# a sensor", HELLO, "", "20 1 2 3 -4 5 6 # touched", "30,1,2,3,4,5,6")
    assert answers == ["ok t x y z fx fy fz"]
    assert len(found) == 2
    np.testing.assert_allclose(found[0].position, [[1e-3, 2e-3, 3e-3]])
    np.testing.assert_allclose(found[0].force, [[-4e-3, 5e-3, 6e-3]])
    np.testing.assert_allclose(found[0].time, [0.02])


def test_other_columns_are_announced():
    found, answers = taken("palpate 1 length=mm force=gf columns=x,y,z,fz", "1 2 3 10")
    assert answers == ["ok x y z fz"]
    np.testing.assert_allclose(found[0].force, [[0, 0, 0.0980665]])
    np.testing.assert_array_equal(found[0].along, [[0, 0, 1.0]])


@pytest.mark.parametrize(
    "bad", ["1 2 3", "0 1 2 3 4 5 x", "0 1 2 3 4 5 nan", "0 1 2 3 4 5 6 7", "\ufffd\x00"]
)
def test_a_malformed_line_is_answered_and_skipped(bad):
    found, answers = taken(HELLO, bad, "0 1 2 3 4 5 6")
    assert len(found) == 1
    assert len(answers) == 2
    assert answers[1].startswith("error line 2: ")
    assert "\n" not in answers[1]


@pytest.mark.parametrize(
    "bad",
    [
        "0 1 2 3 4 5 6",
        "palpate",
        "palpate 2 length=mm force=N time=s",
        "palpate 1 length=mm time=s",
        "palpate 1 length=inch force=N time=s",
        "palpate 1 length=mm length=m force=N time=s",
        "palpate 1 length=mm force=N mass=kg",
        "palpate 1 length=mm force=N time=s columns=x,y",
        "palpate 1 length=mm force=N time=s columns=depth,f",
    ],
)
def test_nothing_is_measured_before_a_greeting_that_names_its_units(bad):
    found, answers = taken(bad, "0 1 2 3 4 5 6", HELLO, "0 1 2 3 4 5 6", "end", "0 1 2 3 4 5 6")
    assert len(found) == 1
    # of lines without any greeting the first is answered alone
    assert [a.split()[0] for a in answers] == ["error"] * (1 if bad[0] == "0" else 2) + ["ok"]


def test_a_stream_ends_when_it_closes_and_when_it_is_silent():
    reading, writing = os.pipe()
    with open(reading, "rb", closefd=True) as stream:
        os.write(writing, b"one\r\ntwo\n0 0 0 0 0 0 1")  # … 12.5: who knows
        os.close(writing)
        assert list(lines_of(stream, 5.0)) == ["one", "two"]
    reading, writing = os.pipe()
    with open(reading, "rb", closefd=True) as stream:
        os.write(writing, b"one\n")
        began = time.monotonic()
        assert list(lines_of(stream, 0.3)) == ["one"]
        assert time.monotonic() - began > 0.25
        os.close(writing)  # lets the reading thread end


def test_a_line_without_end_is_cut_and_its_rest_dropped():
    reading, writing = os.pipe()
    with open(reading, "rb") as stream:
        os.write(writing, b"1" * 5000 + b"\nnext\n\xff\xfe\n")
        os.close(writing)
        lines = list(lines_of(stream, 5.0))
    assert [len(line) for line in lines] == [1000, 4, 2]
    assert lines[1] == "next"


def served(stall=5.0, wait=5.0):
    """A thread that serves one connection; its port, and a queue of what it found."""
    ports, found = queue.Queue(), queue.Queue()

    def serve():
        try:
            with listening(0, wait, lambda port, _: ports.put(port), token=False) as connection:
                found.put(list(measurements(connection.lines(stall), connection.answer)))
        except DeviceError as error:
            found.put(error)

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    return ports.get(timeout=5), found, thread


def test_a_stream_without_a_greeting_is_told_once():
    answers = []
    assert not list(measurements(["1 2 3", "4 5 6", "palpate 2 length=mm", "end"], answers.append))
    assert [a.split(":")[0] for a in answers] == ["error line 1", "error line 3"]


def test_measurements_over_tcp_with_errors_answered():
    port, found, thread = served()
    with socket.create_connection(("127.0.0.1", port), timeout=5) as sensor, sensor.makefile("rw") as talk:
        talk.write("1 2 3\n")
        talk.flush()
        assert talk.readline().startswith("error line 1: Units come first.")
        talk.write(f"{HELLO}\n")
        talk.flush()
        assert talk.readline() == "ok t x y z fx fy fz\n"
        talk.write("0 1 2 3 4 5 6\nnonsense\n10 1 2 3 4 5 6\nend\n")
        talk.flush()
        assert talk.readline().startswith("error line 4: ")
        assert talk.readline() == ""  # closed from the other side
    assert len(found.get(timeout=5)) == 2
    thread.join(5)
    assert not thread.is_alive()


def test_a_connection_that_breaks_or_says_nothing_ends_cleanly():
    port, found, thread = served()
    sensor = socket.create_connection(("127.0.0.1", port), timeout=5)
    sensor.sendall(f"{HELLO}\n0 1 2 3 4 5 6\n0 1 2".encode())
    sensor.close()
    assert len(found.get(timeout=5)) == 1
    thread.join(5)
    port, found, thread = served(stall=0.3)
    with socket.create_connection(("127.0.0.1", port), timeout=5) as sensor:
        sensor.sendall(f"{HELLO}\n0 1 2 3 4 5 6\n".encode())
        assert len(found.get(timeout=5)) == 1
    thread.join(5)
    assert not thread.is_alive()


@pytest.mark.full
def test_a_sensor_that_never_reads_its_errors_does_not_stop_the_others():
    port, found, _ = served(stall=20.0)
    with socket.create_connection(("127.0.0.1", port), timeout=30) as sensor:
        sensor.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        sensor.sendall(f"{HELLO}\n".encode() + b"nonsense\n" * 60_000 + b"0 1 2 3 4 5 6\nend\n")
        assert len(found.get(timeout=30)) == 1


def test_only_this_machine_is_listened_to_and_a_busy_port_is_named():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen(1)
        port = other.getsockname()[1]
        with pytest.raises(PortInUseError, match=str(port)), listening(port, 1.0, lambda *_: None):
            pass
    with pytest.raises(UsageError), listening(70000, 1.0, lambda *_: None):
        pass
    _, found, _ = served(wait=0.2)
    assert "Nobody connected" in str(found.get(timeout=5))
