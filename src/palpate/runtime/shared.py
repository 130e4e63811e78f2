"""The memory that the real-time process shares with everyone else: one state block out, one command block in.

Both blocks live in one memory-mapped file (in RAM where the system has ``/dev/shm``), whose path is its name.
Each block has exactly one writer and any number of readers, guarded by a sequence lock: the writer makes the
counter odd, copies, makes it even; a reader who sees an odd or a changed counter tries again, so that the
writer never waits (Boehm 2012, "Can seqlocks get along with programming language memory models?"). Processors
with weakly ordered memory may still reorder the copies and Python has no fence, so the block also carries a
checksum: a torn record never leaves `Block.fetch`.

A plain mapped file and not `multiprocessing.shared_memory`: that one starts a tracker process, and before
Python 3.13 every process that merely attached removed the block when it ended.
"""

from __future__ import annotations

import mmap
import os
import tempfile
import threading
import time
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from palpate.errors import DeviceError, UsageError
from palpate.runtime.histogram import BINS, percentile

__all__ = ["COMMAND", "MAX_INPUTS", "STATE", "Block", "Shared", "State", "now"]

now = time.perf_counter  # s; monotonic and the same for every process of the machine

MAX_INPUTS = 8
FAULT_KINDS = 16

STATE = np.dtype(
    [
        ("tick", "i8"),
        ("time", "f8"),  # s, `now()` when the tick began
        ("hand", "f8", 3),  # m, device coordinates
        ("position", "f8", 3),  # m, body: offset from the touched node's rest position
        ("contact", "f8", 3),  # m, body: where the touched node is
        ("force", "f8", 3),  # N on the hand, as sent
        ("loads", "f8", MAX_INPUTS),  # N, the loads that hold the body there
        ("mirrored", "u1"),
        ("inside", "u1"),  # within the trained range
        ("clamped", "u1"),  # the force limit acted
        ("grabbed", "u1"),  # a hand holds the body
        ("stalled", "u1"),  # the input is older than its device allows
        ("fault", "i4"),  # `Fault` of this tick
        ("last_fault", "i4"),  # the latest that was not NONE
        ("faults", "i8"),  # onsets since the start
        ("fault_counts", "i8", FAULT_KINDS),  # the same by kind
        ("clamped_ticks", "i8"),
        ("lateness", "f8"),  # s, this tick's start behind its schedule
        ("lateness_max", "f8"),
        ("work", "f8"),  # s, CPU time of the tick before
        ("rate", "f8"),  # Hz, achieved
        ("scale", "f8"),  # metres of body per metre of hand
        ("radius", "f8"),  # m, the hand's workspace
        ("max_force", "f8"),  # N
        ("histogram", "i8", BINS),  # lateness, `Histogram` bins
        ("work_histogram", "i8", BINS),
    ],
    align=True,
)

COMMAND = np.dtype(
    [
        ("beat", "f8"),  # s, `now()` of the page's last heartbeat
        ("sequence", "i8"),  # counts the targets
        ("grabbed", "u1"),
        ("hidden", "u1"),  # the tab is in the background
        ("quit", "u1"),
        ("target", "f8", 3),  # m, hand in device coordinates
        ("period", "f8"),  # s between heartbeats
        ("parameters", "f8", MAX_INPUTS),  # the untouched inputs; NaN: not set, middle of its range
    ],
    align=True,
)


@dataclass(frozen=True, eq=False)
class State:
    """One published tick, copied out of the shared memory. Fields and units as in `STATE`.

    Percentiles are taken here, by the reader, and not in the loop.
    """

    tick: int
    time: float
    hand: np.ndarray
    position: np.ndarray
    contact: np.ndarray
    force: np.ndarray
    loads: np.ndarray
    mirrored: bool
    inside: bool
    clamped: bool
    grabbed: bool
    stalled: bool
    fault: int
    last_fault: int
    faults: int
    fault_counts: np.ndarray
    clamped_ticks: int
    lateness: float
    lateness_max: float
    work: float
    rate: float
    scale: float
    radius: float
    max_force: float
    histogram: np.ndarray
    work_histogram: np.ndarray

    @property
    def lateness_p50(self) -> float:
        """Median lateness since the start, s."""
        return percentile(self.histogram, 0.5)

    @property
    def lateness_p99(self) -> float:
        """Lateness that one tick in a hundred exceeds, s."""
        return percentile(self.histogram, 0.99)

    @property
    def lateness_p999(self) -> float:
        """Lateness that one tick in a thousand exceeds, s."""
        return percentile(self.histogram, 0.999)

    @property
    def work_p50(self) -> float:
        """Median CPU time of a tick, s."""
        return percentile(self.work_histogram, 0.5)

    @property
    def work_p99(self) -> float:
        """CPU time that one tick in a hundred exceeds, s."""
        return percentile(self.work_histogram, 0.99)

    @classmethod
    def of(cls, record: np.ndarray) -> State:
        """Copy a record of dtype `STATE`, shape ()."""
        flags = {"mirrored", "inside", "clamped", "grabbed", "stalled"}
        values: dict[str, Any] = {}
        for name in STATE.names or ():
            value = record[name]
            values[name] = value.copy() if value.ndim else bool(value) if name in flags else value.item()
        return cls(**values)


class Block:
    """One record in shared bytes: a single writer publishes, readers fetch, nobody waits.

    `record` (shape ()) and the views taken of it are this side's private copy: the writer fills it and calls
    `publish`; a reader calls `fetch` and finds it renewed.
    """

    HEADER = 16

    def __init__(self, memory: memoryview, dtype: np.dtype[np.void]) -> None:
        self._sequence = np.ndarray((), np.int64, memory, 0)
        self._checksum = np.ndarray((), np.uint32, memory, 8)
        self._shared = np.ndarray(dtype.itemsize, np.uint8, memory, self.HEADER)
        self._private = np.zeros(dtype.itemsize, np.uint8)
        self._scratch = np.zeros(dtype.itemsize, np.uint8)
        self._fetched = -1
        self.record = self._private.view(dtype).reshape(())

    def publish(self) -> None:
        """Copy the private record out: about 2 µs, never blocks."""
        sequence = int(self._sequence) | 1  # odd also where the writer before us died while writing
        self._sequence[()] = sequence
        self._shared[:] = self._private
        self._checksum[()] = zlib.crc32(self._private.data)
        self._sequence[()] = sequence + 1

    def fetch(self) -> bool:
        """Renew the private record; False, and no change, if a write was under way."""
        sequence = int(self._sequence)
        if sequence & 1:
            return False
        if sequence == self._fetched:
            return True
        self._scratch[:] = self._shared
        if int(self._sequence) != sequence or zlib.crc32(self._scratch.data) != int(self._checksum):
            return False
        self._private[:] = self._scratch
        self._fetched = sequence
        return True

    def release(self) -> None:
        """Let go of the shared bytes, so that the map can be closed; the private record stays."""
        size = self._private.size
        self._sequence, self._checksum = np.zeros((), np.int64), np.zeros((), np.uint32)
        self._shared = np.zeros(size, np.uint8)


_PAGE = 4096
_SIZE = 3 * _PAGE  # header, state, command
_MAGIC = b"palpate runtime %08x\n" % zlib.crc32(repr((STATE.descr, COMMAND.descr)).encode())


class Shared:
    """The state and the command block under one name.

    `create` makes them (the parent: viewer or command line), `attach` joins them (the loop). The loop writes
    `state` and reads `command`; everybody else calls `read_state` and `write_command`.
    """

    def __init__(self, name: str, memory: mmap.mmap) -> None:
        self.name = name
        self._map = memory
        self._lock = threading.Lock()
        view = memoryview(memory)
        self.state = Block(view[_PAGE : 2 * _PAGE], STATE)
        self.command = Block(view[2 * _PAGE :], COMMAND)
        view.release()

    @classmethod
    def create(cls) -> Shared:
        """Make both blocks, empty: tick 0, nothing grabbed, parameters not set.

        Raises
        ------
        DeviceError
            If the system gives no shared memory.
        """
        ram = Path("/dev/shm")
        try:
            handle, name = tempfile.mkstemp(
                prefix="palpate-", suffix=".shm", dir=ram if os.access(ram, os.W_OK) else None
            )
            with os.fdopen(handle, "r+b") as file:
                file.write(_MAGIC.ljust(_SIZE, b"\0"))
        except OSError as error:
            raise DeviceError(
                "No shared memory for the real-time process.",
                why=str(error),
                fix=f"Free some space in {ram if ram.is_dir() else tempfile.gettempdir()}.",
            ) from error
        shared = cls.attach(name)
        shared.command.record["parameters"] = np.nan
        shared.command.publish()
        shared.state.publish()
        return shared

    @classmethod
    def attach(cls, name: str) -> Shared:
        """Join the blocks made by `create` in another process.

        Raises
        ------
        DeviceError
            If there are none of that name, or another version of palpate made them.
        """
        try:
            with Path(name).open("r+b") as file:
                memory = mmap.mmap(file.fileno(), 0)
        except (OSError, ValueError) as error:
            raise DeviceError(
                f"There is no shared memory named {name!r}.",
                why=str(error),
                fix="Its owner has ended; start the real-time process through palpate.runtime.LoopProcess.",
            ) from error
        if memory[: len(_MAGIC)] != _MAGIC or len(memory) != _SIZE:
            memory.close()
            raise DeviceError(
                f"{name!r} is not this version's shared memory.",
                why="Another program or another version of palpate made it.",
                fix="Run both sides from one installation.",
            )
        return cls(name, memory)

    @classmethod
    def private(cls) -> Shared:
        """Blocks without a name, which no other process sees."""
        return cls("", mmap.mmap(-1, _SIZE))

    def read_state(self) -> State:
        """The newest published tick.

        Raises
        ------
        DeviceError
            If a write never ends: the real-time process died in the midst of one.
        """
        until = now() + 0.5
        while not self.state.fetch():
            if now() > until:
                raise DeviceError(
                    "The real-time process stopped while it was publishing.",
                    why="Its process was killed.",
                    fix="Start it again.",
                )
            time.sleep(0)
        return State.of(self.state.record)

    def write_command(
        self,
        *,
        beat: float | None = None,
        target: Sequence[float] | np.ndarray | None = None,
        grabbed: bool | None = None,
        hidden: bool | None = None,
        period: float | None = None,
        parameters: Sequence[float] | np.ndarray | None = None,
        quit: bool | None = None,
    ) -> None:
        """Change what is given, keep the rest, publish.

        Parameters
        ----------
        beat : s, optional
            `now()` when the page was last heard.
        target : (3,) m, optional
            Hand in device coordinates; each one counts as a fresh sample.
        grabbed, hidden, quit : bool, optional
        period : s, optional
            What the page promises between two heartbeats.
        parameters : (p,), optional
            The untouched inputs in SI units, p ≤ 8.

        Raises
        ------
        UsageError
            If there are more parameters than the block holds.
        """
        values = {"beat": beat, "grabbed": grabbed, "hidden": hidden, "period": period, "quit": quit}
        with self._lock:
            record = self.command.record
            for name, value in values.items():
                if value is not None:
                    record[name] = value
            if target is not None:
                record["target"] = target
                record["sequence"] += 1
            if parameters is not None:
                if len(parameters) > MAX_INPUTS:
                    raise UsageError(
                        f"{len(parameters)} parameters were given; the runtime carries {MAX_INPUTS}.",
                        fix="Fix the least important inputs when the model is made.",
                    )
                record["parameters"][: len(parameters)] = parameters
            self.command.publish()

    def close(self) -> None:
        """Unmap; the name stays for others. Harmless when repeated."""
        self.state.release()
        self.command.release()
        self._map.close()

    def unlink(self) -> None:
        """Remove the name. Harmless when repeated."""
        if self.name:
            Path(self.name).unlink(missing_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
        self.unlink()
