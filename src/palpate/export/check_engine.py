"""The generic library for engines, run from Python: how packages for them are compared with palpate."""

from __future__ import annotations

import ctypes
import platform
import sys
import tempfile
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from palpate.errors import ResourceError, UsageError
from palpate.export.check_points import ANSWERS
from palpate.export.fmu_binaries import engine_libraries

__all__ = ["CheckEngine", "engine_library"]

_ENDINGS = {"linux": ".so", "win32": ".dll", "darwin": ".dylib"}
_PROCESSORS = {".so": ("x86_64",), ".dll": ("AMD64",), ".dylib": ("x86_64", "arm64")}
_SIZES = 6
_FORCE, _FLAGS = slice(2, 5), 20  # places in an answer's row


def engine_library() -> bytes | None:
    """Return the generic library of this machine; None where there is none for its system and processor."""
    ending = _ENDINGS.get(sys.platform, "")
    return engine_libraries()[ending] if platform.machine() in _PROCESSORS.get(ending, ()) else None


class CheckEngine:
    """A block of weights in the library, that answers as `palpate.export.check_points.Asker` asks; a context."""

    def __init__(self, library: bytes, block: bytes) -> None:
        # a library that was loaded can't be removed on Windows
        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        path = Path(self._folder.name) / f"palpate_engine{_ENDINGS[sys.platform]}"
        path.write_bytes(library)
        try:
            self._calls: Any = ctypes.CDLL(str(path))
        except OSError as error:
            self._folder.cleanup()
            raise ResourceError(
                "The library for engines can't be loaded here.",
                why=str(error),
                fix="Set TMPDIR to a folder from which programs may run, or compare nothing: --no-check.",
            ) from error
        self._calls.palpate_open.restype = ctypes.c_void_p
        fault = ctypes.c_int32()
        self._body = ctypes.c_void_p(self._calls.palpate_open(block, len(block), ctypes.byref(fault)))
        if not self._body:
            self._folder.cleanup()
            raise UsageError(
                f"The library refuses this block of weights (fault {fault.value}).",
                why="It is damaged, or its baseline or memory is none of palpate's own.",
                fix="Export the body again.",
            )
        sizes = (ctypes.c_int32 * _SIZES)()
        self._calls.palpate_sizes(self._body, sizes)
        self._nodes, self._components = sizes[3:5]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._calls.palpate_close(self._body)
        self._folder.cleanup()

    def _call(self, name: str, x: np.ndarray, out: np.ndarray, *first: Any) -> int:
        """Call a function at x (3 + p,), which fills `out`; the flags."""
        row = np.ascontiguousarray(x)
        pointers = [row.ctypes.data, row[3:].ctypes.data, out.ctypes.data]
        return int(getattr(self._calls, name)(self._body, *first, *map(ctypes.c_void_p, pointers)))

    def answers(self, X: np.ndarray) -> np.ndarray:
        """Return `ANSWERS` numbers for each row of X (N, 3 + p); the deviation did not go out."""
        rows = np.full((len(X), ANSWERS), np.nan)
        for row, x in zip(rows, X, strict=True):
            row[_FLAGS] = self._call("palpate_answer", x, row)
        return rows

    def torques(self, X: np.ndarray) -> np.ndarray:
        """Return the torque (N, 3) for each row of X (N, 3 + p)."""
        rows, answer = np.empty((len(X), 3)), np.empty(19)
        for row, x in zip(rows, np.ascontiguousarray(X), strict=True):
            self._call("palpate_answer", x, answer)
            force = answer[_FORCE].copy()
            pointers = [x.ctypes.data, x[3:].ctypes.data, force.ctypes.data, row.ctypes.data]
            self._calls.palpate_torque(self._body, *map(ctypes.c_void_p, pointers))
        return rows

    def walk(self, X: np.ndarray) -> np.ndarray:
        """Return force, stored and lost energy (N, 5) of each step X (N, 1 + 3 + p)."""
        rows, answer, ledger = np.empty((len(X), 5)), np.empty(19), np.empty(4)
        self._calls.palpate_restart(self._body)
        for row, x in zip(rows, X, strict=True):
            self._call("palpate_step", x[1:], answer, ctypes.c_double(x[0]))
            self._calls.palpate_ledger(self._body, ctypes.c_void_p(ledger.ctypes.data))
            row[:3], row[3:] = answer[_FORCE], ledger[:2]
        return rows

    def shapes(self, X: np.ndarray) -> np.ndarray:
        """Return the field (N, nodes, components) for each row of X (N, 3 + p)."""
        out = np.empty((len(X), self._nodes, self._components))
        for value, x in zip(out, X, strict=True):
            self._call("palpate_shape", x, value)
        return out
