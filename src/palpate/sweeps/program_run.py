"""One run of another program: without a shell, with a limit on its time, and ended with all that it started."""

from __future__ import annotations

import contextlib
import os
import subprocess
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import psutil

from palpate.input_files import plain_text
from palpate.processes import is_supervised, kill_group

__all__ = ["OUTPUT", "ProgramEnd", "last_lines", "run_program"]

OUTPUT = "output.log"
"""Name of the file in the folder of a case that takes what the program prints."""

_LOOK = 0.01  # s between looks at processes that were ended
_TAIL = 20_000  # bytes at the end of the output that are looked at
_LINES, _WIDTH = 8, 200  # lines of a message, and characters of each


@dataclass(frozen=True)
class ProgramEnd:
    """The end of a program: its exit code, the reason in words where it failed, and the last lines of its output."""

    code: int | None
    failure: str
    lines: tuple[str, ...]


def run_program(
    command: Sequence[str], folder: Path, environment: Mapping[str, str], limit: float
) -> ProgramEnd:
    """Run a program in a folder until it ends, or for `limit` s; what it prints goes to `OUTPUT` there.

    In a child of `palpate.supervised` the program belongs to the group of that process, and so dies with it; elsewhere
    it gets a group of its own. What it has started and left behind is ended too.
    """
    inside = is_supervised()
    with (folder / OUTPUT).open("wb") as log:
        try:
            process = _start(command, folder, environment, log, own_group=not inside)
        except OSError as error:
            return ProgramEnd(None, f"{Path(command[0]).name} could not be started: {error}", ())
        overdue = False
        try:
            process.wait(timeout=limit)
        except subprocess.TimeoutExpired:
            overdue = True
        finally:
            _end(process, inside=inside)
    program, failure = Path(command[0]).name, ""
    if overdue:
        failure = f"{program} took longer than {limit:g} s and was ended"
    elif process.returncode:
        failure = f"{program} ended with exit code {process.returncode}"
        if process.returncode < 0:
            failure = f"{program} was ended by signal {-process.returncode}"
    return ProgramEnd(process.returncode, failure, last_lines(folder / OUTPUT))


def _start(
    command: Sequence[str], folder: Path, environment: Mapping[str, str], log: IO[bytes], *, own_group: bool
) -> subprocess.Popen[bytes]:
    # this process finds its packages by PYTHONPATH; a program that is Python of another version must not
    inherited = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    return subprocess.Popen(
        list(command),
        cwd=folder,
        env={**inherited, **environment},
        stdin=subprocess.DEVNULL,
        stdout=log,
        stderr=subprocess.STDOUT,
        start_new_session=own_group,
    )


def _end(process: subprocess.Popen[bytes], *, inside: bool) -> None:
    """End a program and all that it started; where it shares this process's group, all others of the group."""
    if not inside:
        kill_group(process)
        return
    while members := _others_of_group(process.pid):
        for member in members:
            with contextlib.suppress(psutil.Error):
                member.kill()
        process.poll()  # the program itself is gone only when its exit code has been fetched
        time.sleep(_LOOK)
    process.wait()


def _others_of_group(program: int) -> list[psutil.Process]:
    """Return the processes that a program started, and those of this process's group, without this one."""
    here = os.getpid()
    members: dict[int, psutil.Process] = {}
    with contextlib.suppress(psutil.Error):
        parent = psutil.Process(program)
        members = {child.pid: child for child in [parent, *parent.children(recursive=True)]}
    if hasattr(os, "getpgid") and os.getpgrp() == here:
        for process in psutil.process_iter():
            with contextlib.suppress(OSError, psutil.Error):
                if os.getpgid(process.pid) == here:
                    members[process.pid] = process
    members.pop(here, None)
    return [member for member in members.values() if _is_alive(member)]


def _is_alive(process: psutil.Process) -> bool:
    try:
        return bool(process.is_running() and process.status() != psutil.STATUS_ZOMBIE)
    except psutil.Error:
        return False


def last_lines(path: Path) -> tuple[str, ...]:
    """Return the last lines of a file that say something, as plain text; nothing where there is no file."""
    try:
        with path.open("rb") as file:
            file.seek(max(0, path.stat().st_size - _TAIL))
            text = file.read().decode(errors="replace")
    except OSError:
        return ()
    lines = [line.strip() for line in plain_text(text).splitlines() if line.strip()]
    return tuple(line[:_WIDTH] for line in lines[-_LINES:])
