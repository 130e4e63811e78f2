"""The port for measurements: taken by who shows the token, by nobody else, and held up by nobody."""

from __future__ import annotations

import contextlib
import inspect
import queue
import socket
import threading
from collections.abc import Callable

import pytest

from palpate.dataset.measured import listening, measurements, sensor_port
from palpate.errors import DeviceError

GREETING = "palpate 1 length=mm force=N time=s\n"
MEASUREMENT = "0 1 2 3 4 5 6\n"
Port = Callable[[], tuple[int, str, "queue.Queue"]]


@pytest.fixture
def port() -> Port:
    """A port that waits; its number, its token, and what was found: measurements or an error."""
    threads: list[threading.Thread] = []

    def start(wait: float = 10.0):
        announced, found = queue.Queue(), queue.Queue()

        def serve() -> None:
            try:
                with listening(0, wait, lambda *which: announced.put(which)) as connection:
                    found.put(list(measurements(connection.lines(5.0), connection.answer)))
            except DeviceError as error:
                found.put(error)

        threads.append(threading.Thread(target=serve, daemon=True))
        threads[-1].start()
        return *announced.get(timeout=5), found

    yield start
    for thread in threads:
        thread.join(10)
        assert not thread.is_alive()


def line_to(number: int) -> socket.socket:
    return socket.create_connection(("127.0.0.1", number), timeout=10)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_who_begins_with_the_token_is_heard(port: Port, end: str):
    number, token, found = port()
    with line_to(number) as sensor:
        for piece in (
            token[:7],
            token[7:] + end[:1],
            end[1:] + GREETING + "nonsense\n",
            MEASUREMENT + "end\n",
        ):
            sensor.sendall(piece.encode())
        with sensor.makefile() as answers:
            assert answers.readline().startswith("ok t x y z")
            assert answers.readline().startswith("error line 2:")  # counted after the token
    assert len(found.get(timeout=10)) == 1


def test_who_begins_otherwise_is_sent_away_and_the_port_stays(port: Port):
    number, token, found = port()
    for first in (
        GREETING,
        "\n",
        f"{token[:-1]}\n",
        f"{token}x\n",
        f"x{token}\n",
        token[:-1] + "é\n",
        "a" * 5000,
    ):
        with line_to(number) as stranger:
            stranger.sendall(first.encode())
            with contextlib.suppress(ConnectionError):  # where more had come than was read
                assert stranger.recv(100) == b"error line 1: The token comes first.\n"
    line_to(number).close()
    with line_to(number) as sensor:
        sensor.sendall(f"{token}\n{GREETING}{MEASUREMENT}end\n".encode())
        assert len(found.get(timeout=10)) == 1


@pytest.mark.full
def test_silent_connections_hold_nobody_up(port: Port):
    number, token, found = port()
    silent = [line_to(number) for _ in range(3 * sensor_port._STRANGERS)]
    with line_to(number) as sensor:
        sensor.sendall(f"{token}\n{GREETING}{MEASUREMENT}end\n".encode())
        assert len(found.get(timeout=10)) == 1
    for line in silent:
        line.close()


@pytest.mark.full
def test_a_silent_connection_is_sent_away_in_time(port: Port, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(sensor_port, "_FIRST_LINE", 0.05)
    number, _, found = port(wait=0.5)
    with line_to(number) as silent:
        assert silent.recv(100).startswith(b"error line 1")
    error = found.get(timeout=10)
    assert "showed the token" in error.what
    assert "1 connection began otherwise" in error.why


def test_each_port_has_a_token_of_its_own(port: Port):
    tokens = {port(wait=0.05)[1] for _ in range(5)}
    assert len(tokens) == 5
    assert min(map(len, tokens)) >= 24
    assert "secrets.compare_digest" in inspect.getsource(sensor_port)  # takes as long wherever they differ
