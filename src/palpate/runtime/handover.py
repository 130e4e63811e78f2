"""A learnt body on its way from one process to another of the same program, through shared memory.

To read a file, unpack its tables and work out what a hand must know of the body takes a tenth of a second and more,
much of it while nothing else runs in the interpreter. A loop can't do that between two ticks. So the process that
started the loop does it, and leaves the finished value in shared memory: objects pickled, their arrays behind them, as
they lie in memory. The loop's process maps them and copies nothing.

Unlike a file, which never holds pickled objects, this memory is readable by its owner alone, and its name comes from
the process that started the loop.
"""

from __future__ import annotations

import pickle
import struct
import time
from dataclasses import replace

from palpate.network import shared_memory
from palpate.runtime.touchable import Touchable

__all__ = ["hand_over", "prepared", "take"]

_MAGIC = b"palpate handover 1\n"
# bytes: before the sizes, alignment of the arrays, and that of memory
_HEAD, _LINE, _PAGE = 64, 64, 4096
_SIZE = struct.Struct("<q")
_AT_ONCE = 32  # pages that are touched in one piece


def prepared(body: Touchable) -> Touchable:
    """Return what a loop needs of a body, without the fields of surfaces, and with all that takes long worked out."""
    lines = {name: shown for name, shown in body.fields.items() if shown.carrier == "line"}
    slim = replace(body, fields=lines, meta={})
    _ = slim.stiffness_max, slim.force_max, slim.deepest, slim.away, slim.reach
    slim.evaluator()
    return slim


def hand_over(body: Touchable) -> str:
    """Leave a body in shared memory and return the name, for `take` in another process; who took it removes it."""
    buffers: list[pickle.PickleBuffer] = []
    data = pickle.dumps(body, protocol=5, buffer_callback=buffers.append)
    parts = [memoryview(data), *(buffer.raw() for buffer in buffers)]
    sizes = [_SIZE.pack(len(parts)), *(_SIZE.pack(len(part)) for part in parts)]
    place, places = _aligned(_HEAD + _SIZE.size * len(sizes)), list[int]()
    for part in parts:
        places.append(place)
        place = _aligned(place + len(part))
    name = shared_memory.create_for("another surrogate", _MAGIC, place)
    memory = shared_memory.attach(name, _MAGIC)
    memory[_HEAD : _HEAD + _SIZE.size * len(sizes)] = b"".join(sizes)
    for start, part in zip(places, parts, strict=True):
        memory[start : start + len(part)] = part.tobytes()
    memory.close()
    return name


def take(name: str) -> Touchable:
    """Return the body that another process has left, its arrays where they lie, and remove the name."""
    memory = shared_memory.attach_to("body", name, _MAGIC)
    shared_memory.remove(name)
    view = memoryview(memory)
    _touch(view)
    (count,) = _SIZE.unpack_from(view, _HEAD)
    sizes = [_SIZE.unpack_from(view, _HEAD + _SIZE.size * (1 + k))[0] for k in range(count)]
    place, parts = _aligned(_HEAD + _SIZE.size * (1 + count)), list[memoryview]()
    for size in sizes:
        parts.append(view[place : place + size])
        place = _aligned(place + size)
    body: Touchable = pickle.loads(parts[0], buffers=parts[1:])  # of the process that started this one
    return body


def _aligned(place: int) -> int:
    return -(-place // _LINE) * _LINE


def _touch(view: memoryview) -> None:
    """Bring every page into this process, a few at a time: the first touch of a page takes a microsecond."""
    for start in range(0, len(view), _AT_ONCE * _PAGE):
        view[start : start + _AT_ONCE * _PAGE : _PAGE].tobytes()
        time.sleep(0)
