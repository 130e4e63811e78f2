"""TypeScript of the message dataclasses: interfaces, encoders and decoders, from one source."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Mapping
from enum import IntEnum
from typing import Any

from palpate.viewer import messages
from palpate.viewer.wire import CODES, Binary, Json, Wire

__all__ = ["generate"]

BINARY: tuple[type[Binary], ...] = (
    messages.Frame,
    messages.Hand,
    messages.Credit,
    messages.Surface,
    messages.Step,
    messages.Modes,
)
JSON: tuple[type[Json], ...] = (messages.Hello, messages.Notice, messages.Shown)
RECORDS: tuple[type, ...] = (messages.RangeInfo, messages.FieldInfo, messages.Line, messages.StepInfo)
ENUMS: tuple[type[IntEnum], ...] = (messages.Loop, messages.Hold)

# wire type → TypeScript type, DataView suffix, bytes of one number
TYPES = {
    "flag": ("boolean", "Uint8", 1),
    "u8": ("number", "Uint8", 1),
    "u16": ("number", "Uint16", 2),
    "u32": ("number", "Uint32", 4),
    "f32": ("number", "Float32", 4),
    "f64": ("number", "Float64", 8),
    "vec3": ("Vec3", "Float32", 4),
    "vec3d": ("Vec3", "Float64", 8),
    "floats": ("Float32Array", "Float32", 4),
}

HEAD = """\
// Generated from palpate/viewer/messages.py; change it there, then
//   python -m palpate.viewer.messages > src/palpate/viewer/client/src/messages.ts

export type Vec3 = [number, number, number];
"""


def generate() -> str:
    """Return the whole of ``messages.ts``."""
    parts = [HEAD, f"export const PROTOCOL = {messages.PROTOCOL};\n"]
    parts += [_enum(e) for e in ENUMS]
    parts += [_interface(r) for r in (*RECORDS, *JSON)]
    parts += [_parser(j) for j in JSON]
    for message in BINARY:
        parts += [_binary_interface(message), _encoder(message), _decoder(message)]
    return "\n".join(parts)


def _about(kind: type) -> str:
    return f"/** {(kind.__doc__ or '').splitlines()[0]} */"


def _enum(kind: type[IntEnum]) -> str:
    rows = "".join(f"  {m.name}: {m.value},\n" for m in kind)
    return f"{_about(kind)}\nexport const {kind.__name__} = {{\n{rows}}} as const;\n"


def _interface(kind: type) -> str:
    hints = typing.get_type_hints(kind)
    rows = "".join(f"  {f.name}: {_type(hints[f.name])};\n" for f in dataclasses.fields(kind))
    return f"{_about(kind)}\nexport interface {kind.__name__} {{\n{rows}}}\n"


def _type(hint: Any) -> str:
    plain = {str: "string", float: "number", int: "number", bool: "boolean", messages.Vec3: "Vec3"}
    if hint in plain:
        return plain[hint]
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin is types.UnionType:
        return f"{_type(arguments[0])} | null"
    if origin is tuple and arguments[-1] is Ellipsis:
        return f"{_type(arguments[0])}[]"
    if origin is Mapping:
        return "Record<string, unknown>"
    return str(hint.__name__)


def _parser(kind: type) -> str:
    name = kind.__name__
    return (
        f"export function is{name}(message: {{ kind: string }}): message is {name} & {{ kind: string }} {{\n"
        f'  return message.kind === "{name}";\n}}\n'
    )


def _binary_interface(message: type[Binary]) -> str:
    rows = "".join(
        f"  /** {wire.about} */\n  {name}: {TYPES[wire.kind][0]};\n" for name, wire in Wire.fields(message)
    )
    head = f"export const {message.__name__.upper()} = {message.KIND};\n"
    return f"{head}\n{_about(message)}\nexport interface {message.__name__} {{\n{rows}}}\n"


def _fields(message: type[Binary]) -> list[tuple[str, str]]:
    """Names and wire types in the order of the bytes."""
    return [(name, wire.kind) for name, wire in Wire.fields(message)]


def _bytes(kind: str) -> int:
    return TYPES[kind][2] * (CODES[kind][1] or 0)


def _encoder(message: type[Binary]) -> str:
    name, fields = message.__name__, _fields(message)
    lists = [n for n, kind in fields if kind == "floats"]
    fixed = 1 + sum(_bytes(kind) for _, kind in fields)
    size = " + ".join([str(fixed), *(f"4 + 4 * m.{n}.length" for n in lists)])
    body = [f"  const view = new DataView(new ArrayBuffer({size}));", f"  view.setUint8(0, {message.KIND});"]
    at = 1
    for n, kind in fields:
        if kind != "floats":
            body += _write(n, kind, at)
            at += _bytes(kind)
    if lists:
        body.append(f"  let at = {at};")
    for n in lists:
        body += [
            f"  view.setUint32(at, m.{n}.length, true);",
            "  at += 4;",
            f"  for (const value of m.{n}) {{",
            "    view.setFloat32(at, value, true);",
            "    at += 4;",
            "  }",
        ]
    lines = "\n".join([*body, "  return view.buffer;"])
    return f"export function encode{name}(m: {name}): ArrayBuffer {{\n{lines}\n}}\n"


def _write(name: str, kind: str, at: int) -> list[str]:
    _, suffix, size = TYPES[kind]
    if kind == "flag":
        return [f"  view.setUint8({at}, m.{name} ? 1 : 0);"]
    end = ", true" if size > 1 else ""
    if CODES[kind][1] == 3:
        return [f"  view.set{suffix}({at + i * size}, m.{name}[{i}], true);" for i in range(3)]
    return [f"  view.set{suffix}({at}, m.{name}{end});"]


def _read(kind: str, at: int) -> str:
    _, suffix, size = TYPES[kind]
    end = ", true" if size > 1 else ""
    numbers = [f"view.get{suffix}({at + i * size}{end})" for i in range(CODES[kind][1] or 0)]
    if kind == "flag":
        return f"{numbers[0]} !== 0"
    return numbers[0] if len(numbers) == 1 else f"[{', '.join(numbers)}]"


def _decoder(message: type[Binary]) -> str:
    name, fields = message.__name__, _fields(message)
    lists = [n for n, kind in fields if kind == "floats"]
    body = ["  const view = new DataView(buffer);"]
    at, values = 1, []
    for n, kind in fields:
        if kind != "floats":
            values.append(f"    {n}: {_read(kind, at)},")
            at += _bytes(kind)
    end = str(at)
    for n in lists:
        body += [
            f"  const {n}At = {end};",
            f"  const {n}End = {n}At + 4 + 4 * view.getUint32({n}At, true);",
        ]
        # sliced: a Float32Array must start at a multiple of 4; every platform with WebGL is little-endian
        values.append(f"    {n}: new Float32Array(buffer.slice({n}At + 4, {n}End)),")
        end = f"{n}End"
    lines = "\n".join([*body, "  return {", *values, "  };"])
    return f"export function decode{name}(buffer: ArrayBuffer): {name} {{\n{lines}\n}}\n"
