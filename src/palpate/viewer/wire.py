"""The wire format: message dataclasses as bytes, or as JSON, and back.

A binary message is, little-endian and without padding,

    u8 kind, the fixed fields in the order of declaration, then each list: u32 count, count × f32

so that both sides need one struct and a few copies per message, and a frame of 21 nodes has about 400 bytes.
A JSON message is an object whose ``kind`` is the class's name.
"""

from __future__ import annotations

import dataclasses
import json
import struct
import types
import typing
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from palpate.errors import UsageError
from palpate.output_files import json_data

__all__ = ["Binary", "Json", "Layout", "Wire"]

# wire type → struct code and how many numbers a field holds; None: a list with its count in front
CODES: dict[str, tuple[str, int | None]] = {
    "flag": ("?", 1),
    "u8": ("B", 1),
    "u16": ("H", 1),
    "u32": ("I", 1),
    "f32": ("f", 1),
    "f64": ("d", 1),
    "vec3": ("3f", 3),
    "vec3d": ("3d", 3),
    "floats": ("", None),
}


@dataclass(frozen=True)
class Wire:
    """Annotation of a binary message's field."""

    kind: str  # a key of `CODES`
    about: str  # meaning and unit, in a line

    @classmethod
    def fields(cls, message: type[Binary]) -> tuple[tuple[str, Wire], ...]:
        """Names and wires of a message's fields, in the order of the bytes: lists come last."""
        hints = typing.get_type_hints(message, include_extras=True)
        rows = [(name, wire) for name, hint in hints.items() for wire in getattr(hint, "__metadata__", ())]
        return tuple(sorted(rows, key=lambda row: row[1].kind == "floats"))


@dataclass(frozen=True)
class Layout:
    """The bytes of one message class: fixed fields first, lists after."""

    fixed: tuple[tuple[str, int], ...]  # name, count of numbers
    lists: tuple[str, ...]
    packer: struct.Struct

    @classmethod
    def of(cls, message: type[Binary]) -> Layout:
        """Layout of a message class, worked out once."""
        if message not in _layouts:
            _layouts[message] = cls._work_out(message)
        return _layouts[message]

    @classmethod
    def _work_out(cls, message: type[Binary]) -> Layout:
        codes = [(name, *CODES[wire.kind]) for name, wire in Wire.fields(message)]
        fixed = tuple((name, count) for name, _, count in codes if count is not None)
        lists = tuple(name for name, _, count in codes if count is None)
        return cls(fixed, lists, struct.Struct("<B" + "".join(code for _, code, _ in codes)))


_layouts: dict[type, Layout] = {}


class Binary:
    """Base of the binary messages."""

    KIND: ClassVar[int]

    def pack(self) -> bytes:
        """Return the message as bytes."""
        layout = Layout.of(type(self))
        numbers: list[Any] = []
        for name, count in layout.fixed:
            value = getattr(self, name)
            numbers.extend(value) if count == 3 else numbers.append(value)
        parts = [layout.packer.pack(self.KIND, *numbers)]
        for name in layout.lists:
            data = np.ascontiguousarray(getattr(self, name), dtype="<f4")
            parts += (struct.pack("<I", data.size), data.tobytes())
        return b"".join(parts)

    @classmethod
    def unpack(cls, data: bytes) -> Self:
        """Read the message from bytes that are one whole message of this class."""
        layout = Layout.of(cls)
        try:
            kind, *numbers = layout.packer.unpack_from(data)
            lists, end = _unpack_lists(data, layout)
        except (struct.error, ValueError) as error:
            raise _foreign(cls, str(error)) from error
        if kind != cls.KIND or end != len(data):
            raise _foreign(cls, f"kind {kind}, {len(data)} bytes")
        stream = iter(numbers)
        fixed = {
            name: next(stream) if count == 1 else tuple(next(stream) for _ in range(count))
            for name, count in layout.fixed
        }
        return cls(**fixed, **lists)


def _unpack_lists(data: bytes, layout: Layout) -> tuple[dict[str, np.ndarray], int]:
    at, lists = layout.packer.size, {}
    for name in layout.lists:
        (count,) = struct.unpack_from("<I", data, at)
        lists[name] = np.frombuffer(data, "<f4", count, at + 4)
        at += 4 + 4 * count
    return lists, at


def _foreign(message: type[Binary], why: str) -> UsageError:
    return UsageError(
        f"These bytes are no {message.__name__} message.",
        why=why,
        fix="Reload the page: it may come from another version of palpate.",
    )


class Json:
    """Base of the JSON messages."""

    def to_json(self) -> str:
        """Return the message as JSON; numbers that are not finite become null, which JSON can say."""
        values = dataclasses.asdict(typing.cast(Any, self))
        return json.dumps({"kind": type(self).__name__} | json_data(values), allow_nan=False)

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Read the message from JSON."""
        try:
            values = json.loads(text)
            kind = values.pop("kind")
            return typing.cast(Self, _build({cls.__name__: cls}[kind], values))
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise UsageError(f"This text is no {cls.__name__} message.", why=str(error)) from error


def _build(kind: Any, value: Any) -> Any:
    """A value of an annotated type from plain JSON."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in {typing.Union, types.UnionType}:
        return None if value is None else _build(arguments[0], value)
    if origin is tuple:
        inner = arguments[0]
        return tuple(_build(inner, v) for v in value)
    if dataclasses.is_dataclass(kind):
        hints = typing.get_type_hints(kind)
        return kind(**{k: _build(hints[k], v) for k, v in value.items()})  # type: ignore[operator]
    return value
