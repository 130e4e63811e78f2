"""The callback that the OpenHaptics library calls a thousand times a second, compiled: it needs no interpreter.

A callback in Python would wait for the interpreter's lock, which the loop's thread holds while it spins before a tick;
and a loop would wait for a callback that the system has put aside. This one shares nothing with Python but a `Mailbox`,
an array of numbers at a fixed place:

- the loop writes a force between two changes of `WRITTEN`; the callback takes it only if that was even and the same
  before and after, and else keeps the one that it has;
- the callback writes places into two slots by turns and then raises `FRAMES`; the loop reads the slot of that number
  again, should it have changed meanwhile.

Each such pair of accesses has a call of the library in between, which no compiler moves them across; the processors
that the library exists for (x86) keep the order of stores, and of loads.

In a frame the callback reads place, buttons and switches, sends the force, and takes the library's errors until there
are none. It sends zero where the loop has written nothing for `PATIENCE` frames, and after an error, until the loop
has answered (`RESUMED`). An error that is none of the motors' own limits ends it, after a last frame with zero force.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np
from llvmlite import ir
from numba import cfunc, types
from numba.extending import intrinsic
from numba.np.numpy_support import carray

from palpate.devices.openhaptics_library import DONE, GOING_ON, Code
from palpate.kernels import part

__all__ = [
    "CAUSE",
    "FATAL",
    "FATAL_INTERNAL",
    "FIRST",
    "HIDDEN",
    "INTERNAL",
    "LEAVING",
    "RESUMED",
    "SILENCE",
    "STOPS",
    "Mailbox",
    "servo",
]

FIRST = 50  # frames at the start whose places and velocities are kept
SILENCE = 1.0  # cause of a stop: the loop was silent; all others are the library's errors
_extension: Any = intrinsic  # whose own types know nothing of the typing context that it takes away
_POSITION, _VELOCITY, _FORCE = Code.POSITION, Code.VELOCITY, Code.FORCE
_TRANSFORM, _TORQUE = Code.TRANSFORM, Code.TORQUE
_BUTTONS, _INKWELL, _SWITCH = Code.BUTTONS, Code.INKWELL, Code.SAFETY_SWITCH
_MOST_ERRORS = 64  # a list that is longer doesn't end

# cells of 8 bytes; addresses and counts are numbers too, which a double holds exactly up to 2⁵³
BASE, DEVICE, BEGIN, END, DOUBLES, INTEGERS, BOOLEANS, SET, ERROR, HIDDEN = range(10)
# of the loop; FORCE has three cells, and the torque's three in mN m
WRITTEN, RESUMED, LEAVING, PATIENCE, FORCE, ORIENTS, RENDERS = 10, 11, 12, 13, 14, 20, 21
FRAMES, STOPS, CAUSE, INTERNAL, FATAL, FATAL_INTERNAL = range(22, 28)  # of the callback
SEEN, SILENT, PUSH, FETCHED, SLOTS = 28, 29, 30, 36, 38  # its own; PUSH has six cells, FETCHED two
# within one of the two slots; PLACE has three cells, TURN the sixteen of a matrix, column by column
PLACE, BUTTONS, INKWELL, SWITCH, TURN, _SLOT = 0, 3, 4, 5, 6, 22
_WRENCH = 6
EARLY = SLOTS + 2 * _SLOT  # FIRST times place and velocity
_CELLS = EARLY + 6 * FIRST


class Mailbox:
    """The numbers (floats, in `cells`) that the loop and the callback share.

    They hold the addresses of the library's functions, the handle of the device, and its patience: the frames without a
    new force after which zero is sent.
    """

    def __init__(self, functions: Mapping[str, int], device: int, patience: int) -> None:
        self.cells = cells = np.zeros(_CELLS)
        self._integers, self._bytes = cells.view(np.int32), cells.view(np.uint8)
        self.turn = np.zeros(16)
        cells[BASE], cells[DEVICE], cells[PATIENCE] = cells.ctypes.data, device, patience
        names = (
            "hdBeginFrame",
            "hdEndFrame",
            "hdGetDoublev",
            "hdGetIntegerv",
            "hdGetBooleanv",
            "hdSetDoublev",
        )
        for cell, name in zip(range(BEGIN, ERROR), names, strict=True):
            cells[cell] = functions[name]
        cells[ERROR], cells[HIDDEN] = functions["hdGetError"], sys.platform == "win32"

    def write(self, x: float, y: float, z: float, a: float = 0.0, b: float = 0.0, c: float = 0.0) -> None:
        """Leave a force, N, and a torque, mN m, for the next frame."""
        cells = self.cells
        cells[WRITTEN] += 1.0
        cells[FORCE], cells[FORCE + 1], cells[FORCE + 2] = x, y, z
        cells[FORCE + 3], cells[FORCE + 4], cells[FORCE + 5] = a, b, c
        cells[WRITTEN] += 1.0

    def read(self, place: np.ndarray) -> tuple[int, int, bool, bool]:
        """Write the latest place (3,), mm, into `place`; return frame, buttons, inkwell and safety switch.

        `turn` (16,) is the handle's matrix of the same frame, column by column, where the device tells one.
        """
        cells = self.cells
        frame = int(cells[FRAMES])
        while True:
            slot = SLOTS + _SLOT * (frame & 1)
            place[:] = cells[slot : slot + 3]
            self.turn[:] = cells[slot + TURN : slot + TURN + 16]
            mask = int(self._integers[2 * (slot + BUTTONS)])
            inkwell, switch = (bool(self._bytes[8 * (slot + cell)]) for cell in (INKWELL, SWITCH))
            if frame == (latest := int(cells[FRAMES])):
                return frame, mask, inkwell, switch
            frame = latest

    def early(self) -> np.ndarray:
        """Return places, mm, and velocities, mm/s, of the frames of the start, (FIRST, 6)."""
        return self.cells[EARLY:].reshape(FIRST, 6)


def _call(context: Any, builder: Any, signature: Any, args: Any) -> Any:
    """Call what lies at the address that is the first argument, with the others."""
    returns = signature.return_type != types.void
    result = ir.IntType(64) if returns else ir.VoidType()
    kind = ir.FunctionType(result, [argument.type for argument in args[1:]])
    value = builder.call(builder.inttoptr(args[0], kind.as_pointer()), args[1:])
    return value if returns else context.get_dummy_value()


@_extension
def _frame(typingctx: Any, address: Any, device: Any) -> Any:
    """Call ``void f(unsigned int)`` at an address."""
    return types.void(types.int64, types.uint32), _call


@_extension
def _transfer(typingctx: Any, address: Any, code: Any, place: Any) -> Any:
    """Call ``void f(unsigned int, void *)`` at an address."""
    return types.void(types.int64, types.uint32, types.int64), _call


@_extension
def _returned(typingctx: Any, address: Any) -> Any:
    """Call a function without arguments at an address, and return the first eight bytes of what it returns.

    A structure of twelve bytes comes back in two registers (System V and Arm calling conventions); the first holds
    the first two of its three numbers.
    """
    return types.uint64(types.int64), _call


@_extension
def _hidden(typingctx: Any, address: Any, place: Any) -> Any:
    """Call a function that writes what it returns to a place (64-bit Windows)."""
    return types.void(types.int64, types.int64), _call


@functools.cache
def servo() -> Any:
    """Return the compiled callback; its ``address`` is what the library takes, its data is a mailbox's base."""
    return cfunc(types.uint32(types.voidptr), cache=True)(_called)


@part
def _choose_force(box, written, wrench):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Take force and torque (6,) that were written whole, and zero where the loop is silent or a stop unanswered."""
    if written == box[WRITTEN] and written % 2.0 == 0.0:
        for i in range(_WRENCH):
            box[PUSH + i] = wrench[i]
        box[SILENT] = box[SILENT] + 1.0 if written == box[SEEN] else 0.0
        box[SEEN] = written
    else:
        box[SILENT] += 1.0
    pushes = False
    for i in range(_WRENCH):
        pushes = pushes or box[PUSH + i] != 0.0
    if pushes and box[SILENT] > box[PATIENCE] and box[STOPS] == box[RESUMED]:
        box[CAUSE], box[INTERNAL] = SILENCE, 0.0
        box[STOPS] += 1.0
    if box[STOPS] != box[RESUMED] or box[LEAVING] != 0.0:
        for i in range(_WRENCH):
            box[PUSH + i] = 0.0


@part
def _push(box, base):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Send force and torque."""
    _transfer(np.int64(box[SET]), np.uint32(_FORCE), base + 8 * PUSH)
    if box[RENDERS] != 0.0:
        _transfer(np.int64(box[SET]), np.uint32(_TORQUE), base + 8 * (PUSH + 3))


@part
def _take_errors(box, words):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Take all errors of the library, the newest first; returns whether another frame may be begun."""
    may_begin, stopped = True, False
    for _ in range(_MOST_ERRORS):
        if box[HIDDEN] != 0.0:
            _hidden(np.int64(box[ERROR]), np.int64(box[BASE]) + 8 * FETCHED)
            error = words[FETCHED]
        else:
            error = _returned(np.int64(box[ERROR]))
        code = np.int64(error & np.uint64(0xFFFFFFFF))
        internal = np.float64(np.int32(error >> np.uint64(32)))
        if code == 0:
            break
        if 0x0200 <= code <= 0x0203:
            if not stopped:
                stopped = True
                box[CAUSE], box[INTERNAL] = np.float64(code), internal
                box[STOPS] += 1.0
        elif box[FATAL] == 0.0:
            box[FATAL_INTERNAL] = internal
            box[FATAL] = np.float64(code)
        if code == 0x0104 or 0x0400 <= code <= 0x0402:
            may_begin = False
    return may_begin


def _called(data):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    box, words = carray(data, (_CELLS,), np.float64), carray(data, (_CELLS,), np.uint64)
    base, device = np.int64(box[BASE]), np.uint32(box[DEVICE])
    frames = np.int64(box[FRAMES]) + 1
    slot = SLOTS + _SLOT * (frames & 1)
    doubles, booleans = np.int64(box[DOUBLES]), np.int64(box[BOOLEANS])
    written = box[WRITTEN]
    _frame(np.int64(box[BEGIN]), device)
    x, y, z, a, b, c = (
        box[FORCE],
        box[FORCE + 1],
        box[FORCE + 2],
        box[FORCE + 3],
        box[FORCE + 4],
        box[FORCE + 5],
    )
    _transfer(doubles, np.uint32(_POSITION), base + 8 * (slot + PLACE))
    if box[ORIENTS] != 0.0:
        _transfer(doubles, np.uint32(_TRANSFORM), base + 8 * (slot + TURN))
    _choose_force(box, written, (x, y, z, a, b, c))
    _transfer(np.int64(box[INTEGERS]), np.uint32(_BUTTONS), base + 8 * (slot + BUTTONS))
    _transfer(booleans, np.uint32(_INKWELL), base + 8 * (slot + INKWELL))
    _transfer(booleans, np.uint32(_SWITCH), base + 8 * (slot + SWITCH))
    if frames <= FIRST:
        early = base + 8 * (EARLY + 6 * (frames - 1))
        _transfer(doubles, np.uint32(_POSITION), early)
        _transfer(doubles, np.uint32(_VELOCITY), early + 24)
    _push(box, base)
    _frame(np.int64(box[END]), device)
    may_begin = _take_errors(box, words)
    if box[FATAL] != 0.0:
        if may_begin:
            for i in range(_WRENCH):
                box[PUSH + i] = 0.0
            _frame(np.int64(box[BEGIN]), device)
            _push(box, base)
            _frame(np.int64(box[END]), device)
        return np.uint32(DONE)
    box[FRAMES] = np.float64(frames)
    return np.uint32(DONE if box[LEAVING] != 0.0 else GOING_ON)
