"""The evaluator core as WebAssembly, run from Python: how an export to a page is compared with palpate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.export.build_core import built_core
from palpate.export.check_points import ANSWERS
from palpate.export.weights_block import WeightsBlock
from palpate.surrogates import FieldSurrogate

__all__ = ["WasmCore", "wasmtime_module"]

PAGE = 65_536  # bytes of WebAssembly memory
FRAME, MOST = 8, 16  # numbers of a shape before its coefficients: those of the frame, and the further inputs


def wasmtime_module() -> Any:
    """Return the package wasmtime; None where it is not installed."""
    try:
        import wasmtime
    except ImportError:
        return None
    return wasmtime


class WasmCore:
    """One body in the module that pages run in wasmtime.

    It is given by the bytes of a `WeightsBlock`. `fields` are the field whose coefficients that block knows, then those
    of `further` blocks, each with the arrays of one more field. `network` is the block of a network beside the body.
    """

    def __init__(
        self,
        block: bytes,
        fields: Sequence[FieldSurrogate] = (),
        further: Sequence[bytes] = (),
        network: bytes | None = None,
    ) -> None:
        wasmtime = wasmtime_module()
        if wasmtime is None:
            raise UsageError(
                "WebAssembly can't be run from Python here.",
                why="The package wasmtime is not installed.",
                fix="Run: pip install 'palpate[check]'",
            )
        engine = wasmtime.Engine()
        self._store, self._fields, self._shown = wasmtime.Store(engine), tuple(fields), 0
        instance = wasmtime.Instance(self._store, wasmtime.Module(engine, built_core("core.wasm")), [])
        self._exports = instance.exports(self._store)
        self._memory = self._exports["memory"]
        self._call("_initialize")
        at = room = self._call("room")
        opened = [("open", block), *(("open_field", part) for part in further)]
        for call, part in opened if network is None else [*opened, ("open_network", network)]:
            self._reserve(at + len(part))
            self._memory.write(self._store, part, at)
            fault = self._call(call, len(part)) if call == "open" else self._call(call, at, len(part))
            if fault:
                raise UsageError(
                    f"The core refuses this block of weights (fault {fault}).",
                    why="It is damaged, of another version, or of a kind of body that is not in the core.",
                    fix="Export the body again.",
                )
            at += len(part)
        self._reserve(at + self._call("needs", at - room) + 64)
        self._call("start")

    @classmethod
    def of(
        cls,
        block: WeightsBlock,
        fields: Sequence[FieldSurrogate] = (),
        further: Sequence[WeightsBlock] = (),
        network: WeightsBlock | None = None,
    ) -> WasmCore:
        """Return the core with blocks that are not yet bytes."""
        whole = None if network is None else network.to_bytes()
        return cls(block.to_bytes(), fields, [part.to_bytes() for part in further], whole)

    def show(self, index: int) -> WasmCore:
        """Return the core itself, which from now on answers `shapes` of this field."""
        self._shown = index
        return self

    def _call(self, name: str, *arguments: Any) -> Any:
        return self._exports[name](self._store, *arguments)

    def _reserve(self, size: int) -> None:
        missing = -(-(size - self._memory.data_len(self._store)) // PAGE)
        if missing > 0:
            self._memory.grow(self._store, missing)

    def _read(self, at: int, count: int) -> np.ndarray:
        return np.frombuffer(bytes(self._memory.read(self._store, at, at + 8 * count)), dtype=np.float64)

    def _ask(self, x: np.ndarray) -> None:
        self._memory.write(
            self._store, np.ascontiguousarray(x, dtype=np.float64).tobytes(), self._call("asked")
        )

    def answers(self, X: np.ndarray) -> np.ndarray:
        """Return an answer's 19 numbers, the deviation and the flags for each row of X (N, 3 + p)."""
        out = np.empty((len(X), ANSWERS))
        for row, x in zip(out, X, strict=True):
            self._ask(x)
            row[20] = self._call("trust")
            row[:20] = self._read(self._call("answered"), 20)
        return out

    def torques(self, X: np.ndarray) -> np.ndarray:
        """Return the torque (N, 3) for each row of X (N, 3 + p)."""
        out = np.empty((len(X), 3))
        for row, x in zip(out, X, strict=True):
            self._ask(x)
            self._call("answer")
            row[:] = self._read(self._call("torque"), 3)
        return out

    def predict(self, X: np.ndarray, outputs: int) -> np.ndarray:
        """Return the outputs (N, m) of the network beside the body for each row of X (N, n)."""
        out = np.empty((len(X), outputs))
        for row, x in zip(out, X, strict=True):
            self._ask(x)
            self._call("predict")
            row[:] = self._read(self._call("shaped"), outputs)
        return out

    def walk(self, X: np.ndarray) -> np.ndarray:
        """Return force, stored and lost energy (N, 5) of each step X (N, 1 + 3 + p): seconds, a place, parameters."""
        out = np.empty((len(X), 5))
        self._call("start")
        for row, x in zip(out, X, strict=True):
            self._ask(x[1:])
            self._call("step", float(x[0]))
            row[:3] = self._read(self._call("answered"), 5)[2:]
            row[3:] = self._read(self._call("state"), 2)
        return out

    def release(self, x: np.ndarray, seconds: float) -> np.ndarray:
        """Return where (3,) the body lies, m, once it is let go for so long after `walk` at x (3 + p,)."""
        self._ask(x)
        self._call("release", seconds)
        return self._read(self._call("asked"), 3).copy()

    def shapes(self, X: np.ndarray) -> np.ndarray:
        """Return the field (N, nodes, components) for each row of X (N, 3 + p), summed up as the page does."""
        field = self._fields[self._shown]
        out = np.repeat(field.rest[None], len(X), axis=0)
        for value, x in zip(out, X, strict=True):
            self._ask(x)
            if not self._call("touch", self._shown) & 1:
                continue
            shape = self._read(self._call("shaped"), self._call("shape_size", self._shown))
            numbers, modes = shape[FRAME + MOST + 1 :], len(field.modes)
            value += np.tensordot(numbers[:modes], field.modes, axes=1)
            if field.local_mode is not None:
                _add_local(value, numbers[modes:], field, shape[2:5] + np.array(field.shift))
        return out


def _add_local(value: np.ndarray, profile: np.ndarray, field: FieldSurrogate, contact: np.ndarray) -> None:
    """Add the local mode of a profile: cubic B-splines of the distance from the contact point."""
    assert field.local_mode is not None
    components = value.shape[1]
    table = profile.reshape(-1, 4, components)
    offset = (field.points - contact) / field.local_mode.reach
    far = np.linalg.norm(offset, axis=1)
    moved = np.flatnonzero(np.asarray(field.touched, dtype=bool) & (far < 1))
    t = far[moved] * (len(table) - 3)
    first = np.minimum(t.astype(int), len(table) - 4)
    u = t - first
    v = 1 - u
    splines = np.stack([v**3, 3 * u**3 - 6 * u**2 + 4, 3 * v**3 - 6 * v**2 + 4, u**3], axis=1) / 6
    lines = np.einsum("nj,njhc->nhc", splines, table[first[:, None] + np.arange(4)])
    wide = np.hstack([np.ones((len(moved), 1)), offset[moved]])
    value[moved] += np.einsum("nh,nhc->nc", wide, lines)
