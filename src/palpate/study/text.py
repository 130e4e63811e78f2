"""A study as TOML with comments, and back, with errors that name the line or the key."""

from __future__ import annotations

import difflib
import json
import os
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from palpate.errors import StudyError, UsageError
from palpate.study.held import HeldStudy
from palpate.study.models import Study
from palpate.study.record import Unit
from palpate.study.stages import AnyStudy
from palpate.study.touching import TouchStudy
from palpate.study.touching.shapes import KINDS

__all__ = ["read_study", "study_schema", "to_toml"]


def read_study(path: str | os.PathLike[str]) -> AnyStudy:
    """Read a study file; the kind of its body tells whether it is of a beam or of a pressed body.

    Raises
    ------
    StudyError
        If the file is missing, no TOML, or says something a study can't mean: all such places are listed.
    """
    path = Path(path)
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise StudyError(f"{path} does not exist.", fix="Write one with `palpate init`.") from error
    except (OSError, UnicodeDecodeError) as error:
        raise StudyError(
            f"{path} can't be read as a study.",
            why=f"{error}.",
            fix="A study is a text file: write one with `palpate init`.",
        ) from error
    except tomllib.TOMLDecodeError as error:
        twice = "overwrite" in str(error)
        fix = "A key or a table stands there twice: keep one." if twice else "Mend that line."
        raise StudyError(f"{path} is not valid TOML.", why=f"{error}.", fix=fix) from error
    record = _record_for(content, path)
    try:
        return record.model_validate(content)
    except ValidationError as error:
        raise StudyError(
            f"{path} does not describe a study:",
            why="\n".join(f"  {line}" for line in _complaints(error, record)),
            fix=_where_to_look(record, content),
        ) from error


def _where_to_look(record: type[Study | TouchStudy], content: dict[str, Any]) -> str:
    """Which example and which schema tell every key."""
    if record is Study:
        return "`palpate init --print` shows every key with its meaning; `palpate schema` is for editors."
    kind = content.get("body", {}).get("kind")
    preset = {"layered": "layered", "dome": "breast-dome", "organ": "liver"}.get(kind, "block")
    return f"`palpate init --preset {preset} --print` shows every key; `palpate schema touch` is for editors."


def _record_for(content: dict[str, Any], path: Path) -> type[Study | TouchStudy]:
    """What a file is to be read as: by the kind of its body, else by whether it has a probe."""
    body = content.get("body")
    kind = body.get("kind") if isinstance(body, dict) else None
    known = ("cantilever", *KINDS)
    if kind is not None and kind not in known:
        close = difflib.get_close_matches(str(kind), known, n=1)
        raise StudyError(
            f"{path} does not describe a study:",
            why=f"  body.kind: there is no kind of body {kind!r}; there are {', '.join(known)}",
            fix=f"Did you mean {close[0]!r}?" if close else "Choose one of these.",
        )
    return TouchStudy if kind in KINDS or (kind is None and "probe" in content) else Study


def study_schema(kind: str = "beam") -> str:
    """JSON schema of a study file, for editors: of a ``"beam"``, or of a ``"touch"`` for pressed bodies.

    Raises
    ------
    UsageError
        For another kind.
    """
    records: dict[str, type[BaseModel]] = {"beam": Study, "touch": TouchStudy}
    if kind not in records:
        raise UsageError(f"There is no kind of study {kind!r}.", fix="Choose beam or touch.")
    return json.dumps(records[kind].model_json_schema(), indent=2)


def to_toml(study: AnyStudy) -> str:
    """The study as a commented TOML file that `read_study` reads back as the same study.

    Raises
    ------
    UsageError
        If it is of a body that remembers: those are ready-made and have no file.
    """
    if isinstance(study, HeldStudy):
        raise UsageError(
            f"{study.preset} has no study file.",
            why="Studies of bodies that remember are ready-made.",
            fix=f"Run it: palpate demo {study.preset}. Others: palpate.learning.plastic.",
        )
    lines = [
        "# A palpate study: what is solved, learnt, checked and touched.",
        '# Quantities are numbers in SI units, or text with a unit: "5 mm", "2 GPa".',
        "",
    ]
    lines += _scalars(study)
    for name in type(study).model_fields:
        value = getattr(study, name)
        if isinstance(value, BaseModel):
            lines += ["", f"# {_purpose(value)}", f"[{name}]", *_scalars(value), *_tables(name, value)]
        elif isinstance(value, tuple):
            for item in value:
                lines += ["", f"# {_purpose(item)}", f"[[{name}]]", *_scalars(item)]
            if not value and (item := _rows_of(type(study), name)):
                lines += ["", f"# {_purpose(item)}", f"# [[{name}]]", *_example(item)]
    return "\n".join(lines) + "\n"


def _purpose(record: BaseModel | type[BaseModel]) -> str:
    return (record.__doc__ or "").strip().splitlines()[0]


def _rows_of(record: type[BaseModel], name: str) -> type[BaseModel] | None:
    """The record that a list of tables is of; None of other keys."""
    kinds = get_args(record.model_fields[name].annotation)
    return next((k for k in kinds if isinstance(k, type) and issubclass(k, BaseModel)), None)


def _example(record: type[BaseModel]) -> Iterator[str]:
    """Commented keys of a table that may stand there."""
    for name, field in record.model_fields.items():
        yield f"# {name} = {_toml((field.examples or [''])[0])}  # {field.description}"


def _scalars(record: BaseModel) -> Iterator[str]:
    for name, field in type(record).model_fields.items():
        value = getattr(record, name)
        if isinstance(value, BaseModel) or (isinstance(value, tuple) and _rows_of(type(record), name)):
            continue
        if isinstance(value, dict):
            if value:
                yield f"{name} = {{ {', '.join(f'{k} = {_toml(v)}' for k, v in value.items())} }}"
            continue
        comment = f"  # {field.description}" if field.description else ""
        if value is None and not field.examples:
            continue
        if value is None:  # TOML has no such value: an example stands there as a comment
            yield f"# {name} = {_toml((field.examples or [''])[0])}{comment}"
            continue
        unit = None if isinstance(value, (str, tuple)) else _unit((*field.metadata, field.annotation))
        yield f"{name} = {_toml(value, unit)}{comment}"


def _tables(prefix: str, record: BaseModel) -> Iterator[str]:
    for name in type(record).model_fields:
        value = getattr(record, name)
        if isinstance(value, tuple) and value and isinstance(value[0], BaseModel):
            for item in value:
                yield ""
                yield f"[[{prefix}.{name}]]"
                yield from _scalars(item)
                yield from _tables(f"{prefix}.{name}", item)
        if isinstance(value, BaseModel):
            yield ""
            yield f"[{prefix}.{name}]"
            yield from _scalars(value)
            yield from _tables(f"{prefix}.{name}", value)


def _unit(parts: Iterable[Any]) -> str | None:
    """The unit among a field's annotations, however deep."""
    for part in parts:
        if isinstance(part, Unit):
            return part.name
        if found := _unit((*get_args(part), *getattr(part, "__metadata__", ()))):
            return found
    return None


def _toml(value: Any, unit: str | None = None) -> str:
    if unit is not None:
        return json.dumps(f"{value!r} {unit}")
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(v) for v in value) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)  # TOML's basic strings are JSON's
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value)


def _complaints(error: ValidationError, record: type[BaseModel]) -> Iterator[str]:
    """One line per mistake: where, what, and the nearest key that exists."""
    items = [(_place(item["loc"]), item) for item in error.errors(include_url=False)]
    for place, item in items:
        # what is wrong with a whole because of one of its parts, or of another form it might have had, is no news
        if any(other != place and other[: len(place)] == place for other, _ in items):
            continue
        yield f"{'.'.join(place) or 'study'}: {_words(item, record)}"


def _place(location: tuple[int | str, ...]) -> tuple[str, ...]:
    """Keys that lead to a mistake; a union's tag is no key of the file."""
    told = [str(p) for i, p in enumerate(location) if not (i == 1 and location[0] == "body" and p in KINDS)]
    return tuple(p for p in told if not _is_tag(p))


def _is_tag(part: str) -> bool:
    return part.endswith("Record") or part in {"str", "float"} or part.startswith("function-")


def _words(item: Any, record: type[BaseModel]) -> str:
    if item["type"] == "extra_forbidden":
        close = difflib.get_close_matches(str(item["loc"][-1]), _known_keys(record, item["loc"][:-1]), n=1)
        return "there is no such key" + (f"; did you mean {close[0]!r}?" if close else "")
    if item["type"] == "string_pattern_mismatch":
        return f"{item['input']!r} can't name files: letters, digits, dots, dashes and underscores can"
    return str(item["msg"]).removeprefix("Value error, ")


def _known_keys(record: type[BaseModel], place: tuple[int | str, ...]) -> set[str]:
    """Keys of a study's table at this place."""
    schema = record.model_json_schema()
    tables = list(_forms(schema, schema))
    for key in place:
        tables = [form for table in tables for part in _parts(table, key) for form in _forms(part, schema)]
    return {key for table in tables for key in table.get("properties", {})}


def _forms(part: dict[str, Any], schema: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """What a part of a schema stands for: of a union, each of its forms."""
    if "$ref" in part:
        yield from _forms(schema["$defs"][str(part["$ref"]).rpartition("/")[2]], schema)
    elif forms := part.get("anyOf", part.get("oneOf")):
        for form in forms:
            yield from _forms(form, schema)
    else:
        yield part


def _parts(table: dict[str, Any], key: int | str) -> Iterator[dict[str, Any]]:
    """Below a table by a key, below a list by a number; a union's tag leads to the table itself."""
    if key in table.get("properties", {}):
        yield table["properties"][key]
    elif not isinstance(key, int):
        yield table
    elif "items" in table:
        yield table["items"]
