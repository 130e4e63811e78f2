"""The memory that the real-time process shares with everyone else: state and prints out, commands in.

All blocks live in one memory-mapped file (`network.mapped`), whose path is its name.
"""

from __future__ import annotations

import mmap
import threading
import time
import zlib
from collections.abc import Sequence
from types import TracebackType
from typing import Self

import numpy as np

from palpate.errors import DeviceError, UsageError
from palpate.network import mapped
from palpate.network.seqlock import Block
from palpate.runtime.records import COMMAND, MAX_INPUTS, PRINTS, STATE, State

__all__ = ["COMMAND", "MAX_INPUTS", "STATE", "Block", "Shared", "State", "now"]

now = time.perf_counter  # s; monotonic and the same for every process of the machine

_PAGE = 4096
_PRINTS = 3 * _PAGE  # behind header, state and command
_SIZE = _PRINTS + -(-(PRINTS.itemsize + Block.HEADER) // _PAGE) * _PAGE
_MAGIC = b"palpate runtime %08x\n" % zlib.crc32(repr((STATE.descr, COMMAND.descr, PRINTS.descr)).encode())


class Shared:
    """The blocks of state, prints and commands under one name.

    `create` makes them (the parent: viewer or command line), `attach` joins them (the loop). The loop writes
    `state` and `prints` and reads `command`; everybody else calls `read_state` and `write_command`.
    """

    def __init__(self, name: str, memory: mmap.mmap) -> None:
        self.name = name
        self._map = memory
        self._lock = threading.Lock()
        view = memoryview(memory)
        self.state = Block(view[_PAGE : 2 * _PAGE], STATE)
        self.command = Block(view[2 * _PAGE : _PRINTS], COMMAND)
        self.prints = Block(view[_PRINTS:], PRINTS)
        view.release()

    @classmethod
    def create(cls) -> Shared:
        """Make the blocks, empty: tick 0, nothing grabbed, parameters not set.

        Raises
        ------
        DeviceError
            If the system gives no shared memory.
        """
        try:
            name = mapped.create(_MAGIC, _SIZE)
        except OSError as error:
            raise DeviceError(
                "No shared memory for the real-time process.",
                why=str(error),
                fix=f"Free some space in {mapped.folder()}.",
            ) from error
        shared = cls.attach(name)
        shared.command.record["parameters"] = np.nan
        shared.command.publish()
        shared.state.publish()
        shared.prints.publish()
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
            memory = mapped.attach(name)
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
        with self._lock:  # a server's threads share this side's copy
            while not self.state.fetch():
                if now() > until:
                    raise DeviceError(
                        "The real-time process stopped while it was publishing.",
                        why="Its process was killed.",
                        fix="Start it again.",
                    )
                time.sleep(0)
            self.prints.fetch()  # in the midst of a write those before it stand
            return State.of(self.state.record, self.prints.record)

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
        self.prints.release()
        self._map.close()

    def unlink(self) -> None:
        """Remove the name; who has attached keeps the memory. Harmless when repeated."""
        if self.name:
            mapped.remove(self.name)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
        self.unlink()
