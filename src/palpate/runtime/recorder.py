"""The parent's side of a recording: a thread that empties the loop's ring into a file, twice a second.

A disk that is full or slow never reaches the loop. A file that can't be written any more ends the recording, not the
touch: `TraceRecorder.error` says why, and what was written before stays.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import platform
import threading
import time
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from palpate.devices.trace_file import TraceWriter
from palpate.errors import DeviceError, PalpateError
from palpate.runtime.recording import Ring

__all__ = ["TraceRecorder", "machine_facts", "model_facts"]

_LOOK, _CHUNK = 0.1, 0.5  # s between two looks at the ring, and between two chunks of the file
_BEGIN, _PAUSE = 10.0, 0.01  # s within which a running loop begins a recording, and between two looks at that
_LAST = 0.2  # s that the loop's first state may still be on its way where a recording is stopped at once


class TraceRecorder:
    """Records what one loop writes into a ring into one new file, from its making until `stop`.

    The header says what is known of model, device and rate before the loop says more. `error` is why the recording has
    stopped by itself; `ticks` and `size` count ticks and bytes that are in the file.
    """

    def __init__(self, ring: Ring, path: str | os.PathLike[str], header: Mapping[str, Any]) -> None:
        self.path, self.ticks = Path(path), 0
        self.error: PalpateError | None = None
        self._ring = ring
        self._writer = TraceWriter(
            self.path, dict(header) | machine_facts() | {"recorded": datetime.now(UTC).isoformat()}
        )
        self._rows: list[np.ndarray] = []
        self._events: list[dict[str, Any]] = []
        self._lost = ring.lost
        self._ending, self._end = threading.Event(), threading.Event()
        ring.read = int(ring.head)
        ring.number += 1
        ring.asked[()] = self._number = ring.number
        self._thread = threading.Thread(target=self._work, name="palpate-recorder", daemon=True)

    def start(self) -> None:
        """Begin to write."""
        self._thread.start()

    @property
    def active(self) -> bool:
        """True until it is stopped, or stops by itself."""
        return not self._end.is_set() and self.error is None

    @property
    def size(self) -> int:
        """Bytes that are in the file."""
        return self._writer.size

    @property
    def lost(self) -> int:
        """Number of ticks that were overwritten before they could be written down."""
        return self._ring.lost - self._lost

    def add_event(self, kind: str, **facts: Any) -> None:
        """Note an event of a kind, such as ``swap``: another surrogate answers from here on.

        The facts are numbers and texts that tell of it; ``tick`` is the newest tick written.
        """
        self._events.append({"kind": kind, "tick": self.ticks} | facts)

    def stop(self, end: Callable[[], Mapping[str, Any]] | None = None) -> None:
        """Write what is left and close the file; harmless when repeated.

        `end` returns what is to be said of the end, as JSON takes it.
        """
        if self._end.is_set():
            return
        self._end.set()
        self._ending.set()
        if self._thread.is_alive():
            self._thread.join()
        self._ring.asked[()] = 0
        self._try(self._chunk)
        if self.error is None:
            facts = {"ticks": self.ticks, "lost": self.lost} | dict(end() if end else {})
            self._try(lambda: self._writer.close(facts))

    def discard(self) -> None:
        """Remove the file of a recording that has not begun."""
        if not self.ticks:
            self.path.unlink(missing_ok=True)

    def _work(self) -> None:
        waited = 0.0
        self._try(self._begin)
        while self.error is None and not self._ending.wait(_LOOK):
            waited += _LOOK
            self._collect()
            if waited >= _CHUNK:
                waited = 0.0
                self._try(self._chunk)

    def _begin(self) -> None:
        """Wait for the loop's first word, and write down what it remembers."""
        left = _BEGIN
        while int(self._ring.begun) != self._number:
            if self._ending.is_set():
                left = min(left, _LAST)
            if left <= 0.0:
                if self._ending.is_set():
                    return
                raise DeviceError(f"The recording {self.path} has not begun.", why="The loop doesn't tick.")
            time.sleep(_PAUSE)
            left -= _PAUSE
        self._writer.add_json("loop", self._ring.facts)
        state = self._ring.state
        if state is None:
            self.add_event("state", text="what the loop remembered was too much to keep")
        else:
            self._writer.add_state(state)

    def _collect(self) -> None:
        before = self.lost
        rows = self._ring.take()
        if self.lost > before:
            self.add_event("lost", count=self.lost - before)
        if len(rows):
            self._rows.append(rows)

    def _chunk(self) -> None:
        """Write down what has come since the last chunk."""
        self._collect()
        if self._rows:
            rows = np.concatenate(self._rows)
            self._writer.add_ticks(rows)
            self.ticks += len(rows)
            self._rows.clear()
        if count := len(self._events):  # another thread may add one meanwhile
            self._writer.add_events(self._events[:count])
            del self._events[:count]

    def _try(self, step: Callable[[], None]) -> None:
        """Take a step of writing; one that fails ends the recording."""
        if self.error is not None:
            return
        try:
            step()
        except PalpateError as error:
            self.error = error
            self._ring.asked[()] = 0
            with contextlib.suppress(OSError):
                self._writer.abandon()


def machine_facts() -> dict[str, Any]:
    """Return what the last bits of a computed force depend on besides the model: versions, and the processor."""
    import numba

    from palpate.version import __version__

    return {
        "palpate": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
        "processor": _processor(),
    }


def _processor() -> str:
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return f"{platform.machine()}, {line.partition(':')[2].strip()}"
    return f"{platform.machine()}, {platform.processor()}"


def model_facts(path: str | os.PathLike[str]) -> dict[str, str]:
    """Return name, path as given, and checksum of a model's file, by which a replay finds it and knows it again."""
    path = Path(path)
    return {"file": path.name, "path": str(path), "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
