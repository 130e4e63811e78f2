"""All that a loop remembers from one tick to the next, as values by name, so that a replay can begin in its midst.

What a tick depends on besides its inputs is scattered: the body's memory, the ledger and the forces on their way, the
proxy of the coupling, the ramp of the limits, the offset that a clutch has left, the mean age of the samples.
`snapshot` walks through the loop's own objects and takes every number and every array that it finds there; `restore`
puts them into a loop that was made in the same way. A stage that begins to remember something is so saved without a
word here.

Left out are the devices, the shared memory, what is frozen, and the constants of compiled kernels.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import FileFormatError

if TYPE_CHECKING:
    from palpate.runtime.loop import Loop

__all__ = ["restore", "snapshot"]

_OUTSIDE = {
    "device",  # its samples are recorded
    "recorder",
    "stages",
    "swap",  # no recording begins while one is under way
    "_wished",  # views of the command block
    "_quit",
    "_stops",
    "_resumes",
    "_arguments",  # weights and tables that kernels read, and their scratch
    "_constants",
    "_posterior",
}
# what older recordings do not have: it begins as in a new loop
_LATER = ("passivity.added", "evaluator.torque", "evaluator._torque_at", "turn", "_turn")
_NUMBERS = (bool, int, float, np.number, type(None))

_Entry = tuple[str, Any, Callable[[Any], None]]


def snapshot(loop: Loop) -> dict[str, Any]:
    """Return numbers and copies of arrays by name: what `loop` remembers between two ticks."""
    return {path: _plain(value) for path, value, _ in _entries(loop)}


def restore(loop: Loop, values: Mapping[str, Any]) -> None:
    """Put what a loop remembered into one that was made for the same body, device and rate; it is changed in place.

    The values are those of `snapshot`, also after a way through a file, where numbers are arrays of shape (). A
    FileFormatError says that the two loops differ in what they remember.
    """
    if "bounds.delay" in values:
        loop.take_delay(float(values["bounds.delay"]))
    for path, now, put in list(_entries(loop)):
        if path != "bounds.delay" and not (path.startswith(_LATER) and path not in values):
            _put(path, now, put, values.get(path))


def _plain(value: Any) -> Any:
    """Return a value as an array or a number; None as an array without entries."""
    if value is None or isinstance(value, tuple):
        return np.array(value or (), dtype=float)
    return value.copy() if isinstance(value, np.ndarray) else value


def _put(path: str, now: Any, put: Callable[[Any], None], value: Any) -> None:
    empty = value is not None and np.size(value) == 0
    wanted = np.shape(now) if isinstance(now, (np.ndarray, tuple)) else ()
    if value is None or not (np.shape(value) == wanted or (empty and wanted == ())):
        raise FileFormatError(
            f"What the loop remembered as {path} doesn't fit this body.",
            why="It is missing."
            if value is None
            else f"It was recorded as {np.shape(value)}, here it is {wanted}.",
            fix="Replay it on the body that was touched, with the version of palpate that recorded it.",
        )
    if isinstance(now, np.ndarray):
        now[...] = value
    elif isinstance(now, tuple):
        put(tuple(np.asarray(value, dtype=float).tolist()))
    elif empty:
        put(None)
    elif isinstance(now, (bool, np.bool_)):
        put(bool(value))
    elif isinstance(now, int):
        put(type(now)(int(value)))
    else:
        put(float(value))


def _entries(loop: Loop) -> Iterator[_Entry]:
    """Yield name, value and setter of all that a loop remembers, in an order of its own."""
    yield "bounds.delay", loop.bounds.delay, _nowhere
    for name in ("hand", "position", "force"):
        yield f"out.{name}", getattr(loop.out, name), _nowhere
    yield from _walk(loop, "", {id(loop), id(loop.out), id(loop.bounds)})


def _walk(owner: Any, path: str, seen: set[int]) -> Iterator[_Entry]:
    for name, value in list(vars(owner).items()):
        if name in _OUTSIDE:
            continue
        yield from _visit(value, f"{path}{name}", seen, _setter(owner, name))


def _visit(value: Any, path: str, seen: set[int], put: Callable[[Any], None]) -> Iterator[_Entry]:
    if isinstance(value, np.ndarray):
        if value.dtype.kind in "fiub" and value.flags.writeable and id(value) not in seen:
            seen.add(id(value))
            yield path, value, put
    elif isinstance(value, _NUMBERS):
        yield path, value, put
    elif isinstance(value, tuple):
        if value and all(isinstance(part, float) for part in value):
            yield path, value, put
        else:
            for k, part in enumerate(value):
                if not isinstance(part, _NUMBERS):
                    yield from _visit(part, f"{path}.{k}", seen, _nowhere)
    elif _ours(value) and id(value) not in seen:
        seen.add(id(value))
        yield from _walk(value, f"{path}.", seen)


def _ours(value: Any) -> bool:
    """Return whether an object is a part of the loop that may change."""
    kind = type(value)
    if not kind.__module__.startswith("palpate.") or not hasattr(value, "__dict__"):
        return False
    return not (
        dataclasses.is_dataclass(value) and kind.__dataclass_params__.frozen
    ) and kind.__name__ not in {"Block", "Shared"}


def _setter(owner: Any, name: str) -> Callable[[Any], None]:
    return lambda value: setattr(owner, name, value)


def _nowhere(_: Any) -> None:
    """Put nothing: the value can't be replaced."""
