"""The recording that a page asks for: one at a time, into a folder of the server, never for longer than an hour.

A page says only whether it wants one. Where it goes is the server's choice, so that no page can write elsewhere.
"""

from __future__ import annotations

import asyncio
import re
from collections.abc import Awaitable, Callable
from datetime import datetime
from pathlib import Path
from typing import Protocol

from palpate.errors import PalpateError
from palpate.runtime.recorder import TraceRecorder
from palpate.viewer.messages import Recording

__all__ = ["LONGEST", "PageRecording", "Recordable"]

LONGEST = 3600.0  # s of a recording: a forgotten one must not fill the disk
_NEWS = 1.0  # s between two messages on a recording that runs


class Recordable(Protocol):
    """A loop that can be recorded; `palpate.runtime.LoopProcess` is one."""

    def start_recording(self, path: Path) -> TraceRecorder:
        """Record every tick from now on into a new file."""

    def stop_recording(self) -> TraceRecorder | None:
        """End the recording."""


class PageRecording:
    """Starts and stops recordings of one loop for its pages, in files of a folder whose names begin with the body's.

    `tell` sends a `Recording` to all pages.
    """

    def __init__(
        self, loop: Recordable, folder: Path, name: str, tell: Callable[[Recording], Awaitable[None]]
    ) -> None:
        self._loop, self._folder, self._tell = loop, folder, tell
        self._stem = re.sub(r"[^\w-]+", "-", name).strip("-") or "touch"
        self._turn = asyncio.Lock()
        self._watching: asyncio.Task[None] | None = None
        self._began = 0.0
        self.latest = Recording(active=False, file="", seconds=0.0, size=0.0, lost=0, problem="")

    async def want(self, wanted: bool) -> None:
        """Start or stop, as a page wants it, and tell all pages."""
        async with self._turn:  # several pages may ask at once
            if wanted and not self.latest.active:
                await self._start()
            elif not wanted and self.latest.active:
                await self._stop()

    async def _start(self) -> None:
        path = self._folder / f"{self._stem}-{datetime.now():%Y%m%d-%H%M%S}.trace"
        try:
            # in a thread, as everything here that waits for a disk: the hand's messages go on meanwhile
            recorder = await asyncio.to_thread(self._loop.start_recording, path)
        except PalpateError as error:
            await self._say(
                Recording(active=False, file="", seconds=0.0, size=0.0, lost=0, problem=str(error))
            )
            return
        self._began = asyncio.get_running_loop().time()
        await self._say(self._of(recorder))
        self._watching = asyncio.create_task(self._watch(recorder))

    async def _stop(self) -> None:
        if self._watching is not None:
            self._watching.cancel()
        if (recorder := await asyncio.to_thread(self._loop.stop_recording)) is not None:
            await self._say(self._of(recorder))

    async def _watch(self, recorder: TraceRecorder) -> None:
        """Tell once a second how the recording goes, and end one that was forgotten."""
        while recorder.active and self._seconds() < LONGEST:
            await asyncio.sleep(_NEWS)
            await self._say(self._of(recorder))
        if recorder.active:
            await asyncio.to_thread(self._loop.stop_recording)
            await self._say(self._of(recorder))

    def _seconds(self) -> float:
        return asyncio.get_running_loop().time() - self._began

    def _of(self, recorder: TraceRecorder) -> Recording:
        problem = "" if recorder.error is None else str(recorder.error)
        return Recording(
            recorder.active, recorder.path.name, self._seconds(), float(recorder.size), recorder.lost, problem
        )

    async def _say(self, news: Recording) -> None:
        self.latest = news
        await self._tell(news)
