"""The page of `palpate touch`: a part is set up on it, and touched while it is learnt better and better.

The server starts at once; whoever carries out the solves tells the page what there is to show::

    page = serve_part("kidney", on_start=begin)       # the page can be opened
    page.show_part(part)                              # a person chooses, and presses "start": begin(choices)
    page.show_progress(Progress("solving", ...))      # as often as there is news
    page.show_body("kidney-12.palpate")               # the first starts the loop, each later one takes its place
    page.stopped.is_set()                             # a person finds it good enough

All of these may be called in any thread. What page and server say to each other stands in `part_messages`.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import threading
from collections.abc import AsyncIterator, Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Unpack

import numpy as np
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, Response
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from palpate.devices import hand_kind
from palpate.errors import PalpateError, UsageError
from palpate.format import millimetres
from palpate.runtime import LoopProcess
from palpate.runtime.touchable import load_touchable
from palpate.tools.tool_sizes import BALL
from palpate.units import parse_quantity
from palpate.viewer.compression import BinaryAnswers
from palpate.viewer.drawn_tool import drawn_tool
from palpate.viewer.messages import PROTOCOL, DrawnTool
from palpate.viewer.page_model import PageModel
from palpate.viewer.part_messages import (
    Answer,
    EndWish,
    LearningProgress,
    PartNews,
    Picks,
    Role,
    StartWish,
    UnitWish,
    WrapWish,
)
from palpate.viewer.server import body_routes
from palpate.viewer.session import Session
from palpate.viewer.shown_part import PartChoices, ShownPart, choices_of, error_line, wished_tool
from palpate.viewer.solve_dots import on_surface
from palpate.viewer.traffic import Bucket, tell_all
from palpate.viewer.web_server import LocalServer, ServerOptions, local_application, skeleton
from palpate.viewer.wire import Json

__all__ = ["PartPage", "Progress", "serve_part"]

logger = logging.getLogger("palpate.viewer")

MOST_PAGES = 32  # pages that are served at a time
# messages of a page, per second and at once; a start after long brushing takes fifty
MESSAGES, MESSAGES_AT_ONCE = 20.0, 200.0
REPORT_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'none'"


@dataclass(frozen=True, eq=False)
class Progress:
    """The state of solving and learning.

    Attributes
    ----------
    phase : str
        What goes on, in words: ``"meshing"``, ``"7 of 12 first solves"``, ``"12 of 12 first solves; learning"``.
    solves : int
        Solves that are done.
    target : float
        Relative force error at the 95th percentile that ends the work.
    error_median, error_p95 : float
        Relative force error against solves kept apart, of the body shown; not-a-number before the first.
    places : (k, 3) array
        Places of the solves that are done, m: contact points on the surface, or centres of the ball.
    seconds : float
        Time since the start, s.
    report : path, optional
        The report, once there is one.
    remaining : float
        Estimated time until the next surrogate, s; not-a-number where it is not known.
    share : float
        Share of the way to the next surrogate that is done, 0 to 1.
    painted_area, trained_area : float
        Area that was to be touched, and its part that is trained, m²; not-a-number where they are not known.
    trial : str
        The latest surrogate beside the one before it, on the same solves, in words: which was kept, and both errors.
    """

    phase: str
    solves: int = 0
    target: float = 0.02
    error_median: float = float("nan")
    error_p95: float = float("nan")
    places: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    seconds: float = 0.0
    report: str | os.PathLike[str] | None = None
    remaining: float = float("nan")
    share: float = 0.0
    trial: str = ""
    painted_area: float = float("nan")
    trained_area: float = float("nan")


@dataclass(eq=False)
class _Visitor:
    """One page that is open, and what it has picked so far."""

    socket: WebSocket
    picks: dict[Role, list[np.ndarray]] = field(default_factory=dict)

    def take(self, picks: Picks) -> None:
        """Add a piece of what was picked."""
        role = Role(picks.role)
        if picks.first:
            self.picks[role] = []
        self.picks.setdefault(role, []).append(np.asarray(picks.triangles, dtype=np.int64))

    def picked(self, role: Role, count: int) -> np.ndarray | None:
        """Return the triangles of a role, of `count` that there are; None where nothing was changed."""
        if role not in self.picks:
            return None
        chosen = np.unique(np.concatenate([*self.picks[role], np.zeros(0, dtype=np.int64)]))
        return chosen[(chosen >= 0) & (chosen < count)]


class PartPage(LocalServer):
    """The page of a part that is set up, solved, learnt and touched, at `url` while the context lasts.

    Parameters
    ----------
    name : str
        Title of the page.
    on_start : callable
        Gets the `PartChoices` when a person presses *start*, in a thread of its own. Where they don't fit it raises a
        `PalpateError`, which the page answers with; otherwise it returns at once, and the work goes on elsewhere.
    on_unit : callable, optional
        Gets another unit of the file's numbers, and returns the part as it is then; by default the unit stays.
    on_wrap : callable, optional
        Gets the size in m by which a refused part shall be wrapped, and returns the part as it is then. Needed where
        `offer_wrap` is called.
    port, host, strict_port, token : int, str, bool, bool
        As for `Viewer`.
    device : str
        The real-time process's device: ``page`` is the page's own hand.
    recordings : path
        Folder for what is recorded by the page's button.

    Attributes
    ----------
    stopped : threading.Event
        Set when a person finds the body good enough: no more solves shall begin.
    visited : threading.Event
        Set when the first page has been opened.
    loop : LoopProcess or None
        The real-time process, once there is a body to touch.
    """

    def __init__(
        self,
        name: str,
        *,
        on_start: Callable[[PartChoices], object],
        on_unit: Callable[[str], ShownPart] | None = None,
        on_wrap: Callable[[float], ShownPart] | None = None,
        device: str = "page",
        recordings: str | os.PathLike[str] = ".",
        **server: Unpack[ServerOptions],
    ) -> None:
        super().__init__(**server)
        self.name, self._on_start, self._on_unit = name, on_start, on_unit
        self._on_wrap, self._wrap = on_wrap, ""
        self._device, self._recordings = device, Path(recordings)
        self.stopped, self.visited = threading.Event(), threading.Event()
        self.loop: LoopProcess | None = None
        self._part: ShownPart | None = None
        self._parts_shown = 0
        self._stage, self._words = "reading", "The part is being read."
        self._progress: Progress | None = None
        self._session: Session | None = None
        self._version = 0
        self._changing, self._starting = threading.Lock(), threading.Lock()
        self._visitors: list[_Visitor] = []
        self._events: asyncio.AbstractEventLoop | None = None
        self._watcher: asyncio.Task[None] | None = None
        self._parts = BinaryAnswers(keep=True)

    @property
    def caption(self) -> str:
        """The part's name."""
        return f"{self.name}. Set it up there, and touch it;"

    def offer_wrap(self, words: str, size: float) -> None:
        """Say why a part is refused, and let a person have it wrapped by about `size`, in m."""
        self._wrap = millimetres(size).replace("\N{NO-BREAK SPACE}", " ")
        self._turn("refused", words)

    def show_part(self, part: ShownPart, *, begun: bool = False) -> None:
        """Show a part, on which a person now chooses what is held and touched.

        Parameters
        ----------
        part : ShownPart
            The part.
        begun : bool
            Whether the work begins without a person's choice: no page can start it then.
        """
        self._part = part if self._on_unit is not None else replace(part, units=())
        self._parts = BinaryAnswers(keep=True)
        self._parts_shown += 1
        self._turn("working" if begun else "choosing", "")

    def show_progress(self, progress: Progress) -> None:
        """Show how far solves and learning are; where nobody has pressed *start*, the work begins without."""
        self._progress = progress
        if self._stage not in {"working", "ended"}:
            self._turn("working", "")
        self._tell(self._learning(progress))

    def show_body(self, path: str | os.PathLike[str]) -> None:
        """Let the surrogate of a file be touched, in place of the one before if there was one.

        Raises
        ------
        FileFormatError
            If the file holds nothing that can be touched.
        UsageError
            If it is no surrogate of the body that is touched: the one before stays.
        DeviceError
            If the real-time process does not start, or has ended.
        """
        with self._changing:
            centre = None if self._session is None else self._session.model.centre
            body = replace(load_touchable(path), name=self.name)
            model = PageModel(body, self._version + 1, centre)
            if self.loop is None:
                self._open(model, path, body.meta.get("runtime", {}))
            else:
                self.loop.swap(path)
                self._do(self._replace(model))
            self._version = model.version
        self._turn(self._stage if self._stage in {"working", "ended"} else "working", self._words)

    def end(self, words: str) -> None:
        """Say that no more solves come, and why; what is there can be touched on."""
        self._turn("ended", words)

    def _open(self, model: PageModel, path: str | os.PathLike[str], limits: Mapping[str, Any]) -> None:
        """Start the real-time process with a study's limits, the device's by default, and a session for its pages."""
        own: dict[str, Any] = {name: limits.get(name) for name in ("max_force", "max_torque")}
        loop = LoopProcess(path, device=self._device, **own)
        self.loop = self._closing.enter_context(loop)
        hand = hand_kind(self._device)
        self._session = Session(model, self.loop, hand, self._device, recordings=self._recordings)
        self._do(self._watch(self._session))

    async def _watch(self, session: Session) -> None:
        self._watcher = asyncio.create_task(session.watch())

    async def _replace(self, model: PageModel) -> None:
        if self._session is not None:
            await self._session.replace(model)

    def _application(self) -> Starlette:
        @contextlib.asynccontextmanager
        async def lifespan(_: Starlette) -> AsyncIterator[None]:
            self._events = asyncio.get_running_loop()
            yield
            if self._watcher is not None:
                self._watcher.cancel()
                await asyncio.gather(self._watcher, return_exceptions=True)

        return local_application([*self._routes(), *body_routes(lambda: self._session)], lifespan=lifespan)

    def _routes(self) -> list[BaseRoute]:
        html = skeleton("part")

        def part() -> ShownPart:
            if self._part is None:
                raise HTTPException(404)
            return self._part

        async def page(_: Request) -> Response:
            return HTMLResponse(html)

        async def facts(_: Request) -> Response:
            text = await run_in_threadpool(lambda: part().facts().to_json())
            return Response(text, media_type="application/json")

        async def surface(request: Request) -> Response:
            return await self._parts.answer(request, "surface", part().surface.pack)

        async def faces(request: Request) -> Response:
            return await self._parts.answer(request, "faces", lambda: part().picks().pack())

        async def report(_: Request) -> Response:
            path = self._progress.report if self._progress is not None else None
            if path is None or not Path(path).is_file():
                raise HTTPException(404)
            headers = {"content-security-policy": REPORT_POLICY}
            return FileResponse(path, media_type="text/html", headers=headers)

        return [
            Route("/", page),
            Route("/part/facts", facts),
            Route("/part/surface", surface),
            Route("/part/faces", faces),
            Route("/report", report),
            WebSocketRoute("/part", self._talk),
        ]

    async def _talk(self, socket: WebSocket) -> None:
        """Hold the conversation with one page."""
        await socket.accept()
        if len(self._visitors) >= MOST_PAGES:
            await socket.close(1013)
            return
        visitor, heard = _Visitor(socket), Bucket(MESSAGES, MESSAGES_AT_ONCE)
        self._visitors.append(visitor)
        self.visited.set()
        try:
            await socket.send_text(self._news().to_json())
            if self._progress is not None:
                await socket.send_text(self._learning(self._progress).to_json())
            while True:
                message = await socket.receive()
                if message["type"] == "websocket.disconnect":
                    return
                await self._take(visitor, message)
                await asyncio.sleep(heard.take())
        except WebSocketDisconnect:
            pass
        except UsageError as error:
            logger.warning("a page was sent away: %s", error)
            await socket.close(1003, error.what)
        finally:
            self._visitors.remove(visitor)

    async def _take(self, visitor: _Visitor, message: Any) -> None:
        """Take one message of a page."""
        data = message.get("bytes")
        if data is None:
            answer = await run_in_threadpool(self._answer, visitor, message.get("text") or "")
            await visitor.socket.send_text(answer.to_json())
        elif data[:1] == bytes([EndWish.KIND]):
            EndWish.unpack(data)
            self.stopped.set()
            self._turn(self._stage, "No more solves begin; what is done is kept.")
        else:
            picks = Picks.unpack(data)
            if picks.role not in {Role.HELD, Role.TOUCHED}:
                raise UsageError(f"A page picked triangles for the role {picks.role}.")
            visitor.take(picks)

    def _answer(self, visitor: _Visitor, text: str) -> Answer:
        """Carry out a wish of a page that chooses; return what does not fit."""
        if '"WrapWish"' in text:
            return self._wrap_by(WrapWish.from_json(text))
        unit = '"UnitWish"' in text
        wish = UnitWish.from_json(text) if unit else StartWish.from_json(text)
        trial = isinstance(wish, StartWish) and wish.trial
        with self._starting:
            if self._part is None or self._stage != "choosing":
                if trial:
                    return Answer("", trial=True)
                return Answer("The work has begun already, by another page." if self._part else "")
            misfits = None if isinstance(wish, UnitWish) else self._part.misfits(wish)
            try:
                if isinstance(wish, UnitWish):
                    self._take_unit(self._part, wish.unit)
                elif not (misfits or trial):
                    self._start_by(self._part, visitor, wish)
            except PalpateError as error:
                return Answer(error_line(error), misfits)
            return Answer("", misfits, trial, None if misfits else _drawn_tool(wish))

    def _wrap_by(self, wish: WrapWish) -> Answer:
        """Let a refused part be wrapped, and show it; return why it can't be."""
        with self._starting:
            if self._stage != "refused" or self._on_wrap is None:
                return Answer("The part is wrapped already, by another page.")
            try:
                part = self._on_wrap(parse_quantity(wish.size, "m", "The size of the wrap", bare=False))
            except PalpateError as error:
                return Answer(error_line(error))
            self.show_part(part)
            self._turn("choosing", " ".join(part.notes))  # which tell how far the surface moved
            return Answer("")

    def _take_unit(self, part: ShownPart, unit: str) -> None:
        if self._on_unit is not None and unit in part.units:
            self.show_part(self._on_unit(unit))

    def _start_by(self, part: ShownPart, visitor: _Visitor, wish: StartWish) -> None:
        """Begin with what a page has chosen."""
        count = len(part.triangles)
        held, touched = visitor.picked(Role.HELD, count), visitor.picked(Role.TOUCHED, count)
        self._on_start(choices_of(wish, held, touched))
        if self._stage == "choosing":
            self._turn("working", "")

    def _news(self) -> PartNews:
        wrap = self._wrap if self._stage == "refused" else ""
        return PartNews(PROTOCOL, self.name, self._stage, self._words, self._version, self._parts_shown, wrap)

    def _learning(self, progress: Progress) -> LearningProgress:
        places = np.asarray(progress.places, dtype=float).reshape(-1, 3)
        if self._part is not None:
            places = on_surface(self._part, places)
        median, p95, remaining, painted, trained = (
            float(number) if np.isfinite(number) else None
            for number in (
                progress.error_median,
                progress.error_p95,
                progress.remaining,
                progress.painted_area,
                progress.trained_area,
            )
        )
        return LearningProgress(
            phase=progress.phase,
            solves=progress.solves,
            target=progress.target,
            error_median=median,
            error_p95=p95,
            trial=progress.trial,
            places=tuple((x, y, z) for x, y, z in places.tolist()),
            seconds=progress.seconds,
            report=progress.report is not None,
            remaining=remaining,
            share=progress.share,
            painted_area=painted,
            trained_area=trained,
        )

    def _turn(self, stage: str, words: str) -> None:
        """Go on to a stage, and tell all pages."""
        self._stage, self._words = stage, words
        self._tell(self._news())

    def _tell(self, news: Json) -> None:
        """Send a message to all pages, from any thread."""
        self._do(tell_all((visitor.socket for visitor in self._visitors), news.to_json()))

    def _do(self, work: Any) -> None:
        """Let the server's thread carry out a coroutine; nothing happens where the server has ended."""
        events = self._events
        if events is None or events.is_closed():
            work.close()
            return
        asyncio.run_coroutine_threadsafe(work, events)


def _drawn_tool(wish: StartWish | UnitWish) -> DrawnTool | None:
    """Return the tool that a page wishes for, to be drawn; None for a ball."""
    return None if isinstance(wish, UnitWish) or wish.tool == BALL else drawn_tool(wished_tool(wish))


def serve_part(
    name: str, *, on_start: Callable[[PartChoices], object], part: ShownPart | None = None, **options: Any
) -> PartPage:
    """Start the page of a part; it can be opened when this returns.

    Parameters
    ----------
    part : ShownPart, optional
        What is shown at first; by default the page says that the part is being read, until `PartPage.show_part`.

    Returns
    -------
    PartPage
        Running; its `stop` ends it.

    Notes
    -----
    The other parameters and the errors are those of `PartPage`, which is a context manager.
    """
    page = PartPage(name, on_start=on_start, **options).start()
    if part is not None:
        page.show_part(part)
    return page
