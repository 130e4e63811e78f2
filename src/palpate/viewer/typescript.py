"""TypeScript of the message dataclasses: interfaces, encoders and decoders, from one source."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Mapping
from enum import IntEnum
from typing import Any

from palpate.viewer import exam_messages, messages, part_messages
from palpate.viewer.wire import CODES, Binary, Json, Wire

__all__ = ["generate"]

_DECLARED: list[type[Any]] = [
    kind
    for module in (messages, part_messages, exam_messages)
    for kind in vars(module).values()
    if isinstance(kind, type) and kind.__module__ == module.__name__
]
"""Classes of the modules in their order; the protocols among them are no messages."""
BINARY: list[type[Binary]] = [kind for kind in _DECLARED if issubclass(kind, Binary)]
JSON: list[type[Json]] = [kind for kind in _DECLARED if issubclass(kind, Json)]
ENUMS: list[type[IntEnum]] = [kind for kind in _DECLARED if issubclass(kind, IntEnum)]
RECORDS = [kind for kind in _DECLARED if not issubclass(kind, Binary | Json | IntEnum)]

# wire type → TypeScript type
TYPES = dict.fromkeys(CODES, "number") | {
    "flag": "boolean",
    "vec3": "Vec3",
    "vec3d": "Vec3",
    "floats": "Float32Array",
}

HEAD = """\
// Generated from palpate/viewer/messages.py, part_messages.py and exam_messages.py; change it there, then
//   python -m palpate.viewer.messages > src/palpate/viewer/client/src/messages.ts

import { decode, encode } from "./wire";
import type { Layout } from "./wire";

export type Vec3 = [number, number, number];
"""


def generate() -> str:
    """Return the whole of ``messages.ts``."""
    parts = [HEAD, f"export const PROTOCOL = {messages.PROTOCOL};\n"]
    parts += [_enum(e) for e in ENUMS]
    parts += [_interface(r) for r in (*RECORDS, *JSON)]
    parts += [_parser(j) for j in JSON]
    for message in BINARY:
        parts += [_binary_interface(message), _codec(message)]
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
    if origin is tuple:
        return f"[{', '.join(map(_type, arguments))}]"
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
        f"  /** {wire.about} */\n  {name}: {TYPES[wire.kind]};\n" for name, wire in Wire.fields(message)
    )
    head = f"export const {message.__name__.upper()} = {message.KIND};\n"
    return f"{head}\n{_about(message)}\nexport interface {message.__name__} {{\n{rows}}}\n"


def _codec(message: type[Binary]) -> str:
    name = message.__name__
    layout, kind = f"{name.upper()}_LAYOUT", name.upper()
    rows = "".join(f'  ["{field}", "{wire.kind}"],\n' for field, wire in Wire.fields(message))
    return (
        f"const {layout}: Layout = [\n{rows}];\n\n"
        f"export const encode{name} = (m: {name}): ArrayBuffer => encode({kind}, {layout}, m);\n"
        f"export const decode{name} = (buffer: ArrayBuffer): {name} => decode<{name}>({layout}, buffer);\n"
    )
