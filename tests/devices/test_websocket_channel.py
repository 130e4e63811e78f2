"""A websocket's end in the loop keeps to its budget, whatever the service sends."""

from __future__ import annotations

import contextlib
import itertools
import socket
import threading

import pytest
from websockets.frames import Frame, Opcode
from websockets.server import ServerProtocol

from palpate.devices.websocket_channel import WebsocketChannel
from palpate.errors import DeviceLostError

STEP = 1e-4  # s that each look at the clock takes
BUDGET = 2.5e-4  # s of a call


class Clock:
    """A clock that goes on by a step with each look at it: what is counted is work, and not this machine's time."""

    def __init__(self):
        self.looks = 0

    def __call__(self):
        self.looks += 1
        return STEP * self.looks


def frame(content=b"", opcode=Opcode.TEXT, *, fin=True):
    return Frame(opcode, content, fin=fin).serialize(mask=False)


@contextlib.contextmanager
def service(content, *, ends=False):
    """A service that sends these bytes once a client is there; its address, and what it has received."""
    listener, done, received = socket.create_server(("127.0.0.1", 0)), threading.Event(), []

    def serve():
        connection, _ = listener.accept()
        protocol = ServerProtocol()
        with connection:
            while not (requests := protocol.events_received()):
                protocol.receive_data(connection.recv(4096))
            protocol.send_response(protocol.accept(requests[0]))
            connection.sendall(b"".join(protocol.data_to_send()))
            with contextlib.suppress(OSError):
                connection.sendall(content)
                while not ends and not done.is_set():
                    connection.settimeout(0.05)
                    with contextlib.suppress(TimeoutError):
                        received.append(connection.recv(1 << 16))

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield f"ws://127.0.0.1:{listener.getsockname()[1]}", received
    finally:
        done.set()
        thread.join()
        listener.close()


def calls_until_message(channel, clock):
    """Return the first messages, and how many calls it took; each call keeps to its budget."""
    for calls in itertools.count(1):
        before = clock.looks
        messages = channel.receive(0.0)
        assert clock.looks - before <= 2 + BUDGET / STEP
        if messages:
            return messages, calls
    return [], 0


@contextlib.contextmanager
def opened(content, *, ends=False):
    """A channel to a service that sends these bytes, its clock, and what the service has received."""
    clock = Clock()
    with service(content, ends=ends) as (url, received):
        channel = WebsocketChannel(url, "a service", clock)
        yield channel, clock, received
        channel.close()


@pytest.mark.full
def test_pings_without_end_cost_a_call_no_more_than_its_budget():
    """Each takes a look at the clock after 256 bytes: 80 kB of pings are 310 looks, in calls of a few."""
    with opened(frame(opcode=Opcode.PING) * 40_000 + frame(b"at last")) as (channel, clock, received):
        messages, calls = calls_until_message(channel, clock)
    assert messages == ["at last"]
    assert calls > 80
    assert sum(map(len, received)) > 0, "pings are answered"


IN_PIECES = frame(b"[", fin=False) + frame(b"0.123," * 100, Opcode.CONT, fin=False) * 1000


@pytest.mark.parametrize(
    "content", [frame(b"[" + b"0.123," * 150_000 + b"0]"), IN_PIECES], ids=["whole", "in pieces"]
)
def test_numbers_of_nearly_a_megabyte_are_no_message_of_a_device(content):
    with opened(content) as (channel, clock, _), pytest.raises(DeviceLostError, match="32768 bytes"):
        calls_until_message(channel, clock)


def test_many_messages_come_in_their_order_a_few_to_each_call():
    texts = [str(k) for k in range(500)]
    with opened(b"".join(frame(text.encode()) for text in texts)) as (channel, _, _):
        seen = []
        while len(seen) < len(texts):
            came = channel.receive(1.0)
            assert 0 < len(came) <= 16
            seen += came
    assert seen == texts


def test_what_was_sent_before_the_end_is_read_first():
    with opened(frame(b"one") * 40, ends=True) as (channel, _, _):
        seen = []
        while len(seen) < 40:
            seen += channel.receive(1.0)
        with pytest.raises(DeviceLostError, match="closed the connection"):
            channel.receive(1.0)
    assert seen == ["one"] * 40
