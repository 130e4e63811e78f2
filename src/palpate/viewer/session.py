"""The pages of one server: credits, frames, heartbeats, and the end of the real-time process.

One frame is composed per credit, at the moment it is sent, from the newest published tick. A page that grants
nothing gets nothing; `MOST_CREDITS` bounds what it may have outstanding and `SHORTEST` how fast it may ask. Pages take
turns (`traffic`), and a page is heard at most `MESSAGES` times a second: one that floods waits for itself alone.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import logging
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from starlette.websockets import WebSocket, WebSocketDisconnect

from palpate.devices.hand_kind import HandKind
from palpate.errors import DeviceError, UsageError
from palpate.runtime.loop_report import EDGES
from palpate.runtime.safety import Fault
from palpate.runtime.shared_state import Shared, State, now
from palpate.runtime.stability import FeltStiffness
from palpate.viewer.hand_lock import Command, HandLock
from palpate.viewer.messages import (
    Credit,
    Feel,
    Frame,
    Hand,
    Hello,
    Loop,
    Notice,
    Reason,
    Recording,
    RecordWish,
    StopWish,
)
from palpate.viewer.page_model import PageModel, vector
from palpate.viewer.page_recording import PageRecording
from palpate.viewer.part_messages import Ready
from palpate.viewer.traffic import Bucket, Turns, tell_all

__all__ = ["NOT_SOFTENED", "LoopLike", "Page", "Session", "softening"]

logger = logging.getLogger("palpate.viewer")

MOST_CREDITS = 4  # frames that a page may have outstanding
SHORTEST = 1.0 / 125.0  # s between frames to one page: no display that matters is faster
STALE = 0.25  # s without a tick until the loop counts as frozen
RATE_KNOWN = 0.5  # s after the loop has rested until its rate is that of a touched body again
WATCH = 0.1  # s between looks at the real-time process
GRACE = 0.5  # s; a signal that ends the whole program may reach the real-time process first
MOST_PAGES = 32  # pages that are served at a time
# messages of a page, per second and at once; a display at 360 Hz needs 485
MESSAGES, MESSAGES_AT_ONCE = 1000.0, 250.0
SLICE = 0.02  # s; a page that is owed less than that is heard on
MAX_U32 = 2**32 - 1
_NO_FAULT = (Fault.NONE, Fault.INPUT_STALLED, Fault.STOPPED)

NOT_SOFTENED = Feel(0.0, 0.0, 0.0, override=False, words="")
ENDED = Notice(
    "The real-time process has ended: the force is zero and nothing moves any more.",
    "It was killed or failed; the terminal that serves this page may say more.",
    "Start palpate again, and open the new address that its terminal shows.",
)
CROWDED = Notice(
    f"{MOST_PAGES} pages look at this body already.",
    "More would share the same pictures among them.",
    "Close one; this page then finds its place by itself.",
)


class LoopLike(Protocol):
    """A running loop as a session needs it; `palpate.runtime.LoopProcess` is one."""

    @property
    def shared(self) -> Shared:
        """The memory shared with the real-time process."""

    @property
    def alive(self) -> bool:
        """True while the process runs."""

    @property
    def rate(self) -> float:
        """Ticks per second that it aims at, Hz."""


@dataclass(eq=False)
class Page:
    """One connected page."""

    number: int
    socket: WebSocket
    heard: Bucket
    model: PageModel  # with which its pictures are drawn
    credits: int = 0
    echo: float = 0.0  # ms, the page's clock
    histogram: np.ndarray | None = None  # of lateness, as of the frame before
    reason: tuple[str, bool, int] = ("", False, 0)  # as told last: words, stopped, drops of the force so far
    feel: Feel = NOT_SOFTENED
    granted: asyncio.Event = field(default_factory=asyncio.Event)

    def grant(self, frames: int) -> None:
        """Add credits, up to `MOST_CREDITS`."""
        self.credits = min(self.credits + frames, MOST_CREDITS)
        if self.credits:
            self.granted.set()

    async def spend(self) -> None:
        """Wait for a credit and use it up."""
        await self.granted.wait()
        self.credits -= 1
        if not self.credits:
            self.granted.clear()


class Session:
    """A body, its real-time process and the pages that look at it.

    `hand` says who moves the hand, and `device` names the device, as in ``haply``. `clock` gives the time in s for the
    pages' shares. Nothing is recorded without a folder for `recordings`.
    """

    def __init__(
        self,
        model: PageModel,
        loop: LoopLike,
        hand: HandKind = HandKind.PAGE,
        device: str = "page",
        clock: Callable[[], float] = time.perf_counter,
        recordings: Path | None = None,
    ) -> None:
        self.model, self.loop, self._clock = model, loop, clock
        self._hand, self._device = hand, device.partition(":")[0]
        self._lock = HandLock(model.body.start)
        self._pages: dict[int, Page] = {}
        self._numbers: Iterator[int] = itertools.count(1)
        self._turns = Turns(SHORTEST, clock)
        self._ended, self._rested = False, -math.inf
        self._recording: PageRecording | None = None
        if recordings is not None:
            recordable: Any = loop
            self._recording = PageRecording(recordable, recordings, model.body.name, self._tell_all)
        self._models = {model.version: model}
        self._wishes: set[asyncio.Task[None]] = set()
        self._state = loop.shared.read_state()

    async def talk(self, socket: WebSocket) -> None:
        """Hold one page's whole conversation."""
        await socket.accept()
        if len(self._pages) >= MOST_PAGES:
            await socket.send_text(CROWDED.to_json())
            await socket.close(1013)
            return
        heard = Bucket(MESSAGES, MESSAGES_AT_ONCE, self._clock)
        page = Page(next(self._numbers), socket, heard, self.model)
        self._pages[page.number] = page
        with contextlib.suppress(WebSocketDisconnect):
            await socket.send_text(self.hello().to_json())
            if self._ended:
                await socket.send_text(ENDED.to_json())
            if self._recording is not None and self._recording.latest.active:
                await socket.send_text(self._recording.latest.to_json())
            sender = asyncio.create_task(self._show(page))
            try:
                await self._listen(page)
            finally:
                sender.cancel()
                self._forget(page)
                await asyncio.gather(sender, return_exceptions=True)

    async def watch(self) -> None:
        """Tell the pages and the log once when the real-time process ends."""
        while self.loop.alive:
            await asyncio.sleep(WATCH)
        await asyncio.sleep(GRACE)
        self._ended = True
        logger.error("%s %s", ENDED.what, ENDED.fix)
        await self._tell_all(ENDED)

    async def _tell_all(self, news: Notice | Recording | Hello) -> None:
        await tell_all([page.socket for page in self._pages.values()], news.to_json())

    def hello(self) -> Hello:
        """Return the first message to every page."""
        state = self._read()[0]
        named = state.device if self._hand is HandKind.DEVICE else ""
        return self.model.hello(state, self.loop.rate, self._hand, named or self._hand.holder(self._device))

    def frame(self, page: Page) -> Frame:
        """Return the newest state as one page sees it."""
        state, loop = self._read()
        held = state.grabbed and not state.stalled and loop is Loop.RUNNING
        return page.model.frame(self._facts(page, state, loop, held), state, held, self._lock.parameters)

    async def replace(self, model: PageModel) -> None:
        """Show another surrogate of the same body: each page is told, and is drawn the old one until it has the new."""
        self.model = model
        in_use = {page.model.version for page in self._pages.values()} | {model.version}
        self._models = {v: m for v, m in self._models.items() if v in in_use} | {model.version: model}
        await self._tell_all(self.hello())

    def version(self, number: int | None) -> PageModel | None:
        """Return a version of the body that a page may ask for; the newest for None."""
        return self.model if number is None else self._models.get(number)

    def _facts(self, page: Page, state: State, loop: Loop, held: bool) -> dict[str, Any]:
        """Return the fields of `Frame` that tell of the loop and the page."""
        fault, faults, last_fault = _faults(state)
        return {
            "tick": state.tick,
            "time": now(),
            "echo": page.echo,
            "position": vector(state.position),
            "force": vector(state.force if loop is Loop.RUNNING else np.zeros(3)),
            "torque": vector(state.torque if loop is Loop.RUNNING else np.zeros(3)),
            "rate": state.rate,
            "lateness": _latest(state, page),
            "lateness_p50": state.lateness_p50,
            "lateness_p99": state.lateness_p99,
            "lateness_max": state.lateness_max,
            "work_p50": state.work_p50,
            "faults": faults,
            "fault": fault,
            "last_fault": last_fault,
            "loop": loop,
            "hold": self._lock.hold(page.number),
            "inside": state.inside or not held,
            "clamped": state.clamped and held,
            "grabbed": state.grabbed and loop is Loop.RUNNING,
            "resting": now() - self._rested < RATE_KNOWN,
            "stalled": state.stalled,
            "parameters": self._lock.parameters,
        }

    def _read(self) -> tuple[State, Loop]:
        """The newest tick, or the last one of a process that has ended."""
        if self._ended or not self.loop.alive:
            return self._state, Loop.ENDED
        try:
            self._state = self.loop.shared.read_state()
        except DeviceError:  # stopped, or just killed, while publishing; `watch` says which
            return self._state, Loop.FROZEN
        if self._state.idle:
            self._rested = now()
        return self._state, Loop.RUNNING if now() - self._state.time < STALE else Loop.FROZEN

    async def _show(self, page: Page) -> None:
        """Send frames for credits, for ever."""
        with contextlib.suppress(WebSocketDisconnect):
            while True:
                await page.spend()
                async with self._turns.turn():
                    picture = self.frame(page).pack()
                    news = self._news(page)
                for message in news:
                    await page.socket.send_text(message.to_json())
                await page.socket.send_bytes(picture)  # outside: a page that does not read holds nobody up
                await asyncio.sleep(self._turns.pause(len(self._pages)))

    def _news(self, page: Page) -> list[Reason | Feel]:
        """Return what has changed since the page was told last: why there is no force, whether the body is softened."""
        state, news = self._state, list[Reason | Feel]()
        words = state.reason(self._hand)
        reason = (words, state.stopped, state.faults)
        if reason != page.reason:
            page.reason = reason
            # a stop needs no explaining
            drops = [drop for drop in state.onsets if drop[1] is not Fault.STOPPED]
            at, fault = drops[-1] if drops else (now(), Fault.NONE)
            dropped = fault.meaning_for(self._hand) if drops else ""
            news.append(Reason(words, state.stopped, dropped, max(0.0, now() - at)))
        if (feel := softening(state.felt_stiffness)) != page.feel:
            page.feel = feel
            news.append(feel)
        return news

    async def _listen(self, page: Page) -> None:
        """Take a page's messages until it leaves; bytes that are no message end the conversation."""
        try:
            while (data := (await page.socket.receive()).get("bytes")) is not None:
                self._take(page, data)
                if (debt := page.heard.take()) > SLICE:
                    await asyncio.sleep(debt)
        except UsageError as error:
            logger.warning("a page was sent away: %s", error)
            await page.socket.close(1003, error.what)

    def _take(self, page: Page, data: bytes) -> None:
        if data[:1] == bytes([Credit.KIND]):
            page.grant(Credit.unpack(data).frames)
            return
        if data[:1] == bytes([RecordWish.KIND]):
            self._record(RecordWish.unpack(data).wanted)
            return
        if data[:1] == bytes([StopWish.KIND]):
            stop = StopWish.unpack(data).stop
            self.loop.shared.write_command(stop=stop, resume=not stop)
            return
        if data[:1] == bytes([Ready.KIND]):
            page.model = self.version(Ready.unpack(data).version) or page.model
            return
        hand = Hand.unpack(data)
        if self._hand is not HandKind.PAGE and hand.grabbed:  # the hand is not the page's
            hand = replace(hand, grabbed=False)
        page.echo = hand.sent
        if (command := self._lock.hear(page.number, hand, now())) is not None:
            self._tell(command)

    def _record(self, wanted: bool) -> None:
        """Take a page's wish; its messages go on meanwhile."""
        if self._recording is not None:
            wish = asyncio.create_task(self._recording.want(wanted))
            self._wishes.add(wish)
            wish.add_done_callback(self._wishes.discard)

    def _tell(self, command: Command) -> None:
        self.loop.shared.write_command(
            beat=command.beat,
            target=command.target if command.grabbed else None,
            grabbed=command.grabbed,
            hidden=command.hidden,
            period=command.period,
            parameters=command.parameters if command.parameters.size else None,
        )

    def _forget(self, page: Page) -> None:
        del self._pages[page.number]
        if self._lock.leave(page.number):
            self.loop.shared.write_command(grabbed=False)


def softening(stiffness: FeltStiffness) -> Feel:
    """Return what a page is told of what may be felt wrongly on its device; `NOT_SOFTENED` where nothing is."""
    if (words := stiffness.warning) is None:
        return NOT_SOFTENED
    return Feel(stiffness.body, stiffness.bound, stiffness.felt, stiffness.override, words)


def _latest(state: State, page: Page) -> float:
    """The largest lateness (s) since the page's frame before: the upper edge of the highest bin that grew."""
    before, page.histogram = page.histogram, state.histogram
    if before is None:
        return state.lateness
    grown = np.flatnonzero(state.histogram != before)
    if not grown.size or grown[-1] == 0:
        return state.lateness  # all below a microsecond
    return min(float(EDGES[min(grown[-1], EDGES.size - 1)]), state.lateness_max)


def _faults(state: State) -> tuple[int, int, int]:
    """Fault of the tick, count so far, latest kind; without stalls and stops, which the page tells otherwise."""
    counts = {k: int(c) for k, c in enumerate(state.fault_counts) if c and k not in _NO_FAULT}
    latest = state.last_fault if state.last_fault in counts else max(counts, default=0)
    return (0 if state.fault in _NO_FAULT else state.fault), min(sum(counts.values()), MAX_U32), latest
