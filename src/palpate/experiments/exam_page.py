"""The page on which a person examines a body: practice with answers, then an examination without.

The hand feels the body with its lumps; the page is told of the body without them, and draws that. So neither what is
drawn nor what is sent tells where lumps are, other than by the force that is felt. What a record keeps of them lies on
this machine, where whoever may read the user's files can look.
"""

from __future__ import annotations

import asyncio
import logging
import secrets
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any, Unpack

from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from palpate.devices import hand_kind
from palpate.errors import PalpateError, UsageError
from palpate.experiments.append_record import Clocks
from palpate.experiments.exam_folders import exam_directory, keep_body, past_examinations
from palpate.experiments.exam_kinds import ExamKind, hide_lumps
from palpate.experiments.exam_lumps import body_with_lumps, require_inside, skin_under
from palpate.experiments.exam_practice import Practice
from palpate.experiments.exam_report import score_page
from palpate.experiments.exam_score import score_examination
from palpate.experiments.exam_touch import ExamSurface
from palpate.experiments.examination import Examination, Mark
from palpate.files import TemporaryFolder
from palpate.runtime import LoopProcess
from palpate.runtime.touchable import touchable
from palpate.surrogates import Lump, Surrogate
from palpate.surrogates.baselines import require_one_tool
from palpate.viewer.exam_messages import ExamMark, ExamNews, ExamWish, FormerExam
from palpate.viewer.messages import PROTOCOL
from palpate.viewer.page_model import PageModel
from palpate.viewer.server import application
from palpate.viewer.session import Session
from palpate.viewer.traffic import Bucket, tell_all
from palpate.viewer.web_server import (
    LocalServer,
    ServerOptions,
    skeleton,
    wait_until_interrupted,
)

__all__ = ["ExamPage", "serve_exam"]

logger = logging.getLogger("palpate.viewer")

MOST_PAGES = 8  # pages that are served at a time
MESSAGES, MESSAGES_AT_ONCE = 10.0, 40.0  # of a page, per second and at once
_DRAWS = 20  # of lumps for a practice; four in five have some
_FORMER = 30  # examinations that the page lists
_SETTLE = (
    5.0  # s until a body with learnt lumps is felt: making it takes longer with each lump, which would tell
)
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'"  # of a score


class ExamPage(LocalServer):
    """The page of an examination, at `url` while the context lasts.

    `surrogate` is the body without lumps, which a free probe presses; `kind` says what is hidden. Examinations are kept
    in `directory`, by default this user's. `seed` is that of the first one's lumps, and each further one has the
    next; by default it is random. `lumps` are hidden in every examination in place of drawn ones. `device` names that
    of the hand, ``page`` the page's own, and `clocks` give the times of records, by default the machine's. The server's
    options are those of `Viewer`. `loop` is the real-time process, once started.

    A body that can't be pressed and a lump that leaves it are a UsageError, a missing device a DeviceError of `start`.
    """

    def __init__(
        self,
        kind: ExamKind,
        surrogate: Surrogate,
        *,
        directory: Path | None = None,
        seed: int | None = None,
        lumps: Sequence[Lump] | None = None,
        device: str = "page",
        clocks: Clocks | None = None,
        **server: Unpack[ServerOptions],
    ) -> None:
        super().__init__(**server)
        require_one_tool(surrogate.hand_energy.baseline, "be examined")
        self.kind, self._surrogate, self._device = kind, surrogate, device
        self.directory = exam_directory() if directory is None else directory
        self._seed, self._clocks = secrets.randbits(31) if seed is None else seed, clocks
        self._body = replace(touchable(surrogate), name=kind.title)
        self._surface = ExamSurface.of(self._body)
        self._lumps = None if lumps is None else tuple(lumps)
        for lump in self._lumps or ():
            require_inside(self._body, lump, self._surface.points)
        if surrogate.lumps is not None:
            surrogate.lumps.require(self._lumps or ())
        self._practice: Practice | None = None
        self._exam: Examination | None = None
        self._notice, self._score = "", ""
        self._turn = threading.Lock()
        self._pages: list[WebSocket] = []

    @property
    def caption(self) -> str:
        """The examination's title."""
        return f"{self.kind.title}."

    @property
    def stage(self) -> str:
        """The stage: ``ready``, ``practice`` or ``examination``."""
        if self._exam is not None:
            return "examination"
        return "ready" if self._practice is None else "practice"

    def _application(self) -> Starlette:
        folder = self._closing.enter_context(TemporaryFolder())
        self._rest, self._practised = folder / "rest.palpate", folder / "practised.palpate"
        self._surrogate.save(self._rest)
        loop = LoopProcess(self._rest, device=self._device, aim=True)
        self.loop = self._closing.enter_context(loop)
        self._closing.callback(self._leave_exam)
        hand = hand_kind(self._device)
        session = Session(PageModel(self._body), self.loop, hand, self._device)

        html = skeleton("exam")

        async def page(_: Request) -> Response:
            return HTMLResponse(html)

        routes = [
            Route("/", page),
            Route("/exams/{name}", self._answer_score),
            WebSocketRoute("/exam", self._talk),
        ]
        return application(session, further=routes)

    async def _answer_score(self, request: Request) -> Response:
        past = {exam.name: exam for exam in past_examinations(self.directory)}.get(
            request.path_params["name"]
        )
        if past is None or not past.has_end:
            raise HTTPException(404)
        try:
            page = await run_in_threadpool(lambda: score_page(score_examination(past)))
        except PalpateError as error:
            raise HTTPException(500, str(error)) from error
        return HTMLResponse(page, headers={"content-security-policy": _POLICY})

    async def _talk(self, socket: WebSocket) -> None:
        """Hold the conversation with one page."""
        await socket.accept()
        if len(self._pages) >= MOST_PAGES:
            await socket.close(1013)
            return
        heard = Bucket(MESSAGES, MESSAGES_AT_ONCE)
        self._pages.append(socket)
        try:
            await socket.send_text((await run_in_threadpool(self._greet)).to_json())
            while (message := await socket.receive())["type"] != "websocket.disconnect":
                wish = ExamWish.from_json(message.get("text") or "")
                news = await run_in_threadpool(self._follow, wish)
                await tell_all(self._pages, news.to_json())
                await asyncio.sleep(heard.take())
        except WebSocketDisconnect:
            pass
        except UsageError as error:
            logger.warning("a page was sent away: %s", error)
            await socket.close(1003, error.what)
        finally:
            self._pages.remove(socket)

    def _greet(self) -> ExamNews:
        """Return the state for a page that has just come."""
        with self._turn:
            return self._news()

    def _follow(self, wish: ExamWish) -> ExamNews:
        """Carry out a wish, and return the state after it; a refusal is told in its notice."""
        actions: dict[tuple[str, str], Callable[[ExamWish], None]] = {
            ("ready", "practise"): self._practise,
            ("ready", "examine"): self._examine,
            ("ready", "resume"): self._resume,
            ("practice", "show"): self._show,
            ("practice", "leave"): self._leave,
            ("examination", "end"): self._end,
        }
        with self._turn:
            self._notice = ""
            try:
                if action := actions.get((self.stage, wish.wish)):
                    action(wish)
                elif marked := self._exam or self._practice:
                    self._mark(marked, wish)
            except PalpateError as error:
                logger.warning("%s", error)
                self._notice = " ".join(filter(None, (error.what, error.why, error.fix)))
            return self._news()

    def _draw(self, seed: int) -> tuple[Lump, ...]:
        return hide_lumps(self.kind, self._body, self._surface, seed, self._surrogate.lumps)

    def _with_lumps(self, lumps: Sequence[Lump]) -> Surrogate:
        return body_with_lumps(self._surrogate, self._body, lumps)

    def _some_lumps(self) -> tuple[Lump, ...]:
        """Return lumps at random, one at least; a body without room for any is refused."""
        drawn = (self._draw(secrets.randbits(31)) for _ in range(_DRAWS))
        if lumps := next(filter(None, drawn), ()):
            return lumps
        raise UsageError(
            "There is no room for a lump in this body.",
            why="Under the area that can be pressed all lumps would leave it, for their size.",
            fix="Take a thicker body, or one that was learnt over a larger area.",
        )

    def _practise(self, _: ExamWish) -> None:
        lumps = self._some_lumps()  # practice without a lump teaches nothing
        self._with_lumps(lumps).save(self._practised)
        self.loop.swap(self._practised)
        self._practice, self._score = Practice(self.kind, self._body, lumps), ""

    def _show(self, _: ExamWish) -> None:
        if self._practice is not None:
            self._practice.shown = not self._practice.shown

    def _leave(self, _: ExamWish) -> None:
        self.loop.swap(self._rest)
        self._practice = None

    def _examine(self, _: ExamWish) -> None:
        seed, begun = self._seed, time.monotonic()
        if self._lumps is None:
            self._some_lumps()  # a body that can have none would be examined for nothing
        lumps = self._draw(seed) if self._lumps is None else self._lumps
        felt = self._with_lumps(lumps)
        if self._surrogate.lumps is not None:
            time.sleep(max(0.0, begun + _SETTLE - time.monotonic()))
        exam = Examination.begin(
            self.directory,
            self.kind,
            self._rest,
            lumps,
            clocks=self._clocks,
            seed=seed,
            device=self._device,
            schematic=self._surrogate.lumps is None,
        )
        self._seed += 1
        try:
            felt.save(exam.body_file)
            self._take(exam)
        except BaseException:
            exam.close()
            raise

    def _resume(self, wish: ExamWish) -> None:
        names = {past.name: past for past in past_examinations(self.directory, [self.kind.name])}
        if (past := names.get(wish.name)) is None:
            raise UsageError("There is no such examination.", fix="Choose one of the list.")
        if past.facts["body"] != keep_body(self.directory, self._rest).name:
            raise UsageError(
                f"{past.name} was begun on another body.",
                why="A body of this name was in another file, or was learnt anew.",
                fix="Open the model file with which it was begun, or begin a new examination.",
            )
        exam = Examination.resume(past.folder, self._clocks)
        try:
            if not exam.body_file.is_file():  # it was killed before the body with its lumps was written
                self._with_lumps(exam.past.lumps).save(exam.body_file)
            self._take(exam)
        except BaseException:
            exam.close()
            raise
        self._notice = "It goes on where it was interrupted."

    def _take(self, exam: Examination) -> None:
        """Put the body of an examination into the hand, and record its touch from now on."""
        self.loop.swap(exam.body_file)
        self.loop.start_recording(exam.past.next_trace)
        self._exam, self._score = exam, ""

    def _mark(self, marked: Examination | Practice, wish: ExamWish) -> None:
        if wish.wish == "mark":
            marked.mark(skin_under(self._body, wish.place))
        elif wish.wish == "answer":
            marked.answer(wish.number, hardness=wish.hardness, depth=wish.depth)
        elif wish.wish == "remove":
            marked.remove(wish.number)

    def _end(self, _: ExamWish) -> None:
        if (exam := self._exam) is None:
            return
        exam.end()
        self._exam, self._score = None, exam.folder.name  # nothing is marked any more, whatever fails below
        try:
            self.loop.stop_recording()
            self._notice = score_examination(exam.past, self._body).words
            exam.record.add("scored", words=self._notice)
        finally:
            exam.close()
            self.loop.swap(self._rest)

    def _leave_exam(self) -> None:
        """Let go of an examination as the server ends; it can go on later."""
        if self._exam is not None:
            self._exam.close()
            self._exam = None

    def _news(self) -> ExamNews:
        exam, practice = self._exam, self._practice
        marks = [] if exam is None else [_exam_mark(mark) for mark in exam.marks.values()]
        if practice is not None:
            marks = [_exam_mark(mark, practice.judge(mark)) for mark in practice.marks.values()]
        shown = practice.shown_lumps() if practice is not None and practice.shown else []
        words = self.kind.words
        if self._surrogate.lumps is None:
            words += (
                " The lumps of this body are schematic: their strength comes from a formula, not from solves."
            )
        former = past_examinations(self.directory, [self.kind.name])[:_FORMER] if exam is None else []
        return ExamNews(
            protocol=PROTOCOL,
            title=self.kind.title,
            words=words,
            stage=self.stage,
            notice=self._recording_fault() or self._notice,
            elapsed=0.0 if exam is None else exam.record.seconds,
            marks=tuple(marks),
            lumps=tuple(_exam_mark(mark, answer) for mark, answer in shown),
            former=tuple(
                FormerExam(past.name, _when(str(past.facts["at"])), past.words, past.has_end)
                for past in former
            ),
            score=self._score,
        )

    def _recording_fault(self) -> str:
        """Return why the touch is not recorded any more; empty where it is."""
        recording = self.loop.recording if self._exam is not None else None
        return "" if recording is None or recording.error is None else str(recording.error)


def _exam_mark(mark: Mark, answer: str = "") -> ExamMark:
    return ExamMark(mark.number, mark.place, mark.hardness, mark.depth, answer)


def _when(at: str) -> str:
    """Return a time of a record as this machine's clock says it."""
    return f"{datetime.fromisoformat(at).astimezone():%d %B %Y, %H:%M}"


def serve_exam(
    page: ExamPage, *, open_browser: bool = False, on_ready: Callable[[ExamPage], Any] | None = None
) -> None:
    """Serve the page of an examination until interrupted (Ctrl-C); `on_ready` is called once with the running page."""
    wait_until_interrupted(page, open_browser=open_browser, on_ready=on_ready)
