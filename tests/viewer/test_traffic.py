"""Fair shares of a server, in virtual time: floods are counted, not timed."""

from __future__ import annotations

import asyncio
import contextlib
import selectors
import socket
from types import SimpleNamespace

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

from palpate.viewer import Viewer
from palpate.viewer.messages import Credit, Hand, Notice
from palpate.viewer.session import MESSAGES, MESSAGES_AT_ONCE, MOST_PAGES, SHORTEST, Session
from palpate.viewer.traffic import HALF_OPEN, SHARE, Bucket, Turns, Waiting
from websocket_page import client_of, get, socket_of

HAND = Hand(0.0, 0.05, (0.0, 0.0, 0.0), False, False, np.zeros(0, "f4")).pack()
PICTURE, MESSAGE = 2e-3, 2e-5  # s of the thread that each takes here


class VirtualTime(asyncio.SelectorEventLoop):
    """An event loop that never waits: where nothing is to do, its clock jumps to what comes next."""

    def __init__(self) -> None:
        loop, self.now = self, 0.0

        class Selector(selectors.DefaultSelector):
            def select(self, timeout=None):
                loop.now += timeout or 0.0
                return super().select(0)

        super().__init__(Selector())

    def time(self) -> float:
        return self.now


def run(scene) -> None:
    async def play() -> None:
        try:
            await scene(loop)
        finally:
            pages = asyncio.all_tasks() - {asyncio.current_task()}
            for page in pages:
                page.cancel()
            await asyncio.gather(*pages, return_exceptions=True)

    loop = VirtualTime()
    try:
        loop.run_until_complete(play())
    finally:
        loop.close()


class FakeSocket:
    """A page's websocket: its messages come from a queue, or without end from a flood."""

    def __init__(self, flood: bytes = b"") -> None:
        self.flood, self.queue, self.frames, self.texts = flood, asyncio.Queue(), 0, []
        self.eager = not flood  # asks for the next picture as soon as one has come

    async def accept(self) -> None: ...

    async def close(self, code: int, reason: str = "") -> None:
        self.texts.append(code)

    async def receive(self):
        return {"bytes": self.flood or await self.queue.get()}

    async def send_text(self, text: str) -> None:
        self.texts.append(text)

    async def send_bytes(self, data: bytes) -> None:
        self.frames += 1
        if self.eager:
            self.queue.put_nowait(Credit(1).pack())


class CountedSession(Session):
    """A session whose messages and pictures take time of a virtual thread and are counted."""

    def __init__(self, loop: VirtualTime) -> None:
        shared = SimpleNamespace(read_state=lambda: None, write_command=lambda **_: None)
        model = SimpleNamespace(body=SimpleNamespace(parameters=[], start=np.zeros(0)), version=1)
        super().__init__(model, SimpleNamespace(shared=shared, alive=True, rate=1e3), clock=loop.time)
        self.virtual, self.begun, self.taken, self.late, self.tasks = loop, [], {}, [], []

    def hello(self):
        return Notice("", "", "")

    def frame(self, page):
        self.begun.append(self.virtual.now)
        self.virtual.now += PICTURE
        return SimpleNamespace(pack=lambda: b"")

    def _news(self, page):
        return []

    def _take(self, page, data):
        self.virtual.now += MESSAGE
        self.taken[page.number] = self.taken.get(page.number, 0) + 1
        if isinstance(data, Sent):
            self.late.append(sum(begun > data.due for begun in self.begun))
        super()._take(page, bytes(data))


class Sent(bytes):
    """A message that knows when it came, s."""

    due = 0.0


def looking(session: CountedSession, sockets: list[FakeSocket]) -> None:
    for quiet in (s for s in sockets if not s.flood):
        quiet.queue.put_nowait(Credit(1).pack())
    session.tasks += [asyncio.ensure_future(session.talk(s)) for s in sockets]


@pytest.mark.parametrize("flood", [Credit(4).pack(), HAND], ids=["credits", "hands"])
def test_a_page_that_floods_takes_nothing_from_another(flood: bytes):
    async def scene(loop: VirtualTime) -> None:
        session, quiet, flooding = CountedSession(loop), FakeSocket(), FakeSocket(flood)
        looking(session, [quiet])
        await asyncio.sleep(2.0)
        alone = quiet.frames
        looking(session, [flooding])
        await asyncio.sleep(2.0)
        assert alone > 0.7 * 2.0 / SHORTEST
        assert quiet.frames - alone > 0.9 * alone
        assert (
            session.taken[2] <= 2.0 * MESSAGES + MESSAGES_AT_ONCE + 50
        )  # the rest is read when its time comes
        assert session.taken[2] > 0.9 * 2.0 * MESSAGES

    run(scene)


def test_a_crowd_shares_alike_and_leaves_half_of_the_thread():
    async def scene(loop: VirtualTime) -> None:
        session, sockets = CountedSession(loop), [FakeSocket(Credit(4).pack()) for _ in range(12)]
        looking(session, sockets)
        await asyncio.sleep(1.0)  # until the cost of a picture is known
        before, begun = [s.frames for s in sockets], loop.now
        await asyncio.sleep(3.0)
        served = [s.frames - b for s, b in zip(sockets, before, strict=True)]
        assert min(served) > 0.9 * max(served) > 5
        assert sum(served) * PICTURE < 1.1 * SHARE * (loop.now - begun)

    run(scene)


class Deaf(FakeSocket):
    """A websocket that takes no more text after the first, as one whose page doesn't read."""

    async def send_text(self, text: str) -> None:
        if self.texts:
            await asyncio.Event().wait()
        self.texts.append(text)


def test_a_page_that_does_not_read_keeps_news_from_nobody_else():
    async def scene(loop: VirtualTime) -> None:
        session, sockets = CountedSession(loop), [Deaf(), FakeSocket()]
        looking(session, sockets)
        await asyncio.sleep(0.5)
        session.loop.alive = False
        await asyncio.wait_for(session.watch(), 10.0)
        assert [len(s.texts) for s in sockets] == [1, 2]
        assert "has ended" in sockets[1].texts[1]

    run(scene)


def test_a_hand_waits_for_one_picture_at_most():
    async def scene(loop: VirtualTime) -> None:
        session, hand = CountedSession(loop), FakeSocket()
        others = [FakeSocket() for _ in range(6)]
        looking(session, others)
        for other in others:  # displays in step: all ask at the same time
            other.eager = False
            for i in range(60):
                loop.call_at(i / 30, other.queue.put_nowait, Credit(1).pack())
        hand.eager = False
        session.tasks.append(asyncio.ensure_future(session.talk(hand)))

        for i in range(200):
            message = Sent(HAND)
            message.due = 0.5 + 0.0071 * i
            loop.call_at(message.due, hand.queue.put_nowait, message)
        await asyncio.sleep(2.5)
        assert len(session.late) == 200
        assert len(session.begun) > 300
        assert max(session.late) <= 1

    run(scene)


def test_one_page_too_many_is_told():
    async def scene(loop: VirtualTime) -> None:
        session, more = CountedSession(loop), FakeSocket()
        looking(session, [FakeSocket() for _ in range(MOST_PAGES)])
        await asyncio.sleep(0.1)
        await session.talk(more)
        assert str(MOST_PAGES) in more.texts[0]
        assert more.texts[1] == 1013  # try again later
        assert more.frames == 0

    run(scene)


def test_a_bucket_keeps_its_rate_whoever_takes():
    at = [0.0]
    bucket = Bucket(10.0, 5.0, lambda: at[0])
    assert [bucket.take() for _ in range(5)] == [0.0] * 5
    assert bucket.take() == pytest.approx(0.1)
    assert bucket.take() == pytest.approx(0.2)
    at[0] = 0.2
    assert not bucket.try_take()
    at[0] = 100.0  # a long silence saves up no more than the burst
    assert sum(bucket.try_take() for _ in range(20)) == 5


def test_turns_know_what_a_picture_costs():
    async def scene(loop: VirtualTime) -> None:
        turns = Turns(0.01, loop.time)
        assert turns.pause(32) == 0.01
        for _ in range(100):
            async with turns.turn():
                loop.now += 0.004
        assert turns.pause(1) == pytest.approx(0.01)
        assert turns.pause(10) == pytest.approx(10 * 0.004 / SHARE, rel=1e-3)

    run(scene)


def test_silent_connections_go_in_the_order_of_their_coming_or_after_their_time():
    timers: list[SimpleNamespace] = []

    def later(seconds, function, connection):
        timer = SimpleNamespace(seconds=seconds, call=lambda: function(connection), cancelled=False)
        timer.cancel = lambda: setattr(timer, "cancelled", True)
        timers.append(timer)
        return timer

    class Line:
        closed = False

        def abort(self) -> None:
            self.closed = True

    waiting, lines = Waiting(3, 5.0, later), [Line() for _ in range(6)]
    for line in lines[:3]:
        waiting.enter(line)
        waiting.enter(line)  # counts once
    waiting.leave(lines[1])  # it asked for something
    for line in lines[3:5]:
        waiting.enter(line)
    assert [line.closed for line in lines] == [True, False, False, False, False, False]
    assert [timer.cancelled for timer in timers] == [True, True, False, False, False]
    assert {timer.seconds for timer in timers} == {5.0}
    timers[3].call()
    assert lines[3].closed
    assert len(waiting) == 2


@pytest.mark.full
def test_half_open_connections_do_not_close_the_door(viewer: Viewer):
    lines = [socket.create_connection(("127.0.0.1", viewer.port), timeout=5) for _ in range(HALF_OPEN + 40)]
    try:
        for line in lines:
            with contextlib.suppress(ConnectionError):
                line.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n")  # and nothing more
        assert get(viewer).status_code == 200
        with client_of(viewer) as client:
            client.next_frame()
        assert sum(map(is_closed, lines)) >= 40  # the oldest had to go
    finally:
        for line in lines:
            line.close()


def is_closed(line: socket.socket) -> bool:
    line.setblocking(False)
    try:
        return line.recv(1) == b""
    except BlockingIOError:
        return False
    except ConnectionError:
        return True


def test_a_websocket_that_pings_without_end_is_cut_off(viewer: Viewer):
    def flood(line: ClientConnection) -> None:
        for _ in range(2000):
            line.ping()
        for _ in range(600):  # all were sent before the server read them: frames under way, then the end
            line.recv(timeout=20)

    with socket_of(viewer) as pinging, client_of(viewer) as client:
        with pytest.raises(ConnectionClosed):
            flood(pinging)
        client.next_frame()


def test_a_server_that_is_flooded_with_messages_answers_another_page(viewer: Viewer):
    with socket_of(viewer, close_timeout=0) as flooding, client_of(viewer) as client:
        flooding.socket.setblocking(False)
        flood = (b"\x82\x83\0\0\0\0" + Credit(4).pack()) * 2000
        sent = 0
        for _ in range(30):  # as much as the server takes, and it takes little
            with contextlib.suppress(BlockingIOError):
                sent += flooding.socket.send(flood)
            client.next_frame()
        assert sent > 0
