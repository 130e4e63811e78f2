"""A study as a TOML file with comments, and back, with errors that name the line or the key."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any, get_args

import tomlkit
from pydantic import BaseModel, ValidationError
from tomlkit.items import AoT

from palpate.errors import FileFormatError, StudyError
from palpate.file_kinds import file_kind, way_for
from palpate.input_files import read_toml
from palpate.output_files import STUDY_HEAD
from palpate.record_complaints import complaints, unit_in
from palpate.study.study import Study
from palpate.units import parse_quantity

__all__ = ["key_line", "read_study", "study_schema", "to_toml"]

_EXAMPLES = {"cantilever": "beam-nylon", "layered": "layered", "dome": "breast-dome", "organ": "liver"}
"""Presets that show every key of a kind of body; the block shows those of the others."""

_PRESETS = {"pad": "grasp", "tool": "fingertip"}
"""Presets that show the keys of an interaction."""

_READABLE = {
    "m": (("m", 1.0), ("mm", 1e-3)),
    "Pa": (("GPa", 1e9), ("MPa", 1e6), ("kPa", 1e3)),
    "rad": (("deg", math.pi / 180),),
}
"""Units, from large to small, in which a quantity is written instead of its SI unit."""

_WRITTEN_OUT = 1e9  # whole numbers below it are written without an exponent


def read_study(path: str | os.PathLike[str]) -> Study:
    """Read a study file.

    Files of version 0.1.0, with `[[loads]]` or `[probe]` in place of `[interaction]`, are read too.

    Parameters
    ----------
    path : path
        TOML file, as `palpate init` writes it.

    Raises
    ------
    StudyError
        If the file is missing, is no TOML, or says something that a study can't mean: all such places are listed.
    """
    path = Path(path)
    kind = file_kind(path)
    if kind and kind != "a study file" and path.exists():
        raise StudyError(
            f"{path} is {kind}, not a study file.",
            fix=f"{way_for(path)} A study file is a text, NAME.toml: write one with `palpate init`.",
        )
    if not path.exists():
        fix = {
            "a dataset of solves": "Write one with `palpate sweep STUDY.toml`, or give the path of another.",
            "a model file": "Name a study file, NAME.toml; `palpate learn` writes the model file.",
        }.get(kind, "Write one with `palpate init`.")
        raise StudyError(f"{path} does not exist.", fix=fix)
    try:
        content = read_toml(path)
    except FileFormatError as error:
        raise StudyError(
            error.what, why=error.why, fix=f"{error.fix} `palpate init` writes a study."
        ) from error
    if "solver" in content:
        raise StudyError(
            f"{path} is a study of another program's solver, [solver].",
            why="Only `palpate sweep` starts that program; what it solves is a dataset.",
            fix=f"`palpate sweep {path}` solves; then name its dataset, such as "
            f"`palpate learn {path.parent / str(content.get('name', path.stem))}.zarr`.",
        )
    try:
        return Study.model_validate(_beside(path.parent, _from_first_version(content)))
    except ValidationError as error:
        raise StudyError(
            f"{path} does not describe a study:",
            why="\n".join(f"  {line}" for line in complaints(error, Study)),
            fix=f"`palpate init {_example_of(content)} --print` shows every key with its meaning; "
            "`palpate schema` is for editors.",
        ) from error


def _from_first_version(content: dict[str, Any]) -> dict[str, Any]:
    """Return the content of a file, with what acts on the body where it stands today."""
    if "interaction" in content:
        return content
    content = dict(content)
    if "loads" in content:
        content["interaction"] = {"kind": "loads", "loads": content.pop("loads")}
    elif isinstance(content.get("probe"), dict):
        content["interaction"] = {"kind": "probe", **content.pop("probe")}
    target = content.get("target")
    if isinstance(target, dict) and "filter_relapse" in target:
        content["target"] = {
            "filter_regression" if k == "filter_relapse" else k: v for k, v in target.items()
        }
    return content


def _beside(folder: Path, content: dict[str, Any]) -> dict[str, Any]:
    """Return the content of a file with the files that it names as paths that start from where the program runs."""
    acting, body = content.get("interaction"), content.get("body")
    if isinstance(acting, dict):
        shapes = {
            key: shape | {"file": str(folder / shape["file"])}
            for key in ("shape", "jaw", "other")
            if isinstance(shape := acting.get(key), dict) and isinstance(shape.get("file"), str)
        }
        content = content | {"interaction": acting | shapes}
    if not isinstance(body, dict):
        return content
    body = _with_modules(folder, body)
    if isinstance(body.get("file"), str):
        body["file"] = str(folder / body["file"])
    return content | {"body": body}


def _with_modules(folder: Path, part: Any) -> Any:
    """Return a part of `[body]` with the paths of modules of materials."""
    if isinstance(part, list):
        return [_with_modules(folder, item) for item in part]
    if not isinstance(part, dict):
        return part
    part = {key: _with_modules(folder, value) for key, value in part.items()}
    if isinstance(module := part.get("module"), str) and module.endswith(".py"):
        part["module"] = str(folder / module)
    return part


def _example_of(content: dict[str, Any]) -> str:
    """Return what `palpate init` is told to show the keys of a file's body: a preset, or the part's file."""
    body, acting = content.get("body"), content.get("interaction")
    if isinstance(body, dict) and body.get("kind") == "part":
        return str(body.get("file", "PART.stl"))
    if isinstance(acting, dict) and (preset := _PRESETS.get(str(acting.get("kind")))):
        return f"--preset {preset}"
    kind = body.get("kind", "cantilever") if isinstance(body, dict) else "cantilever"
    return f"--preset {_EXAMPLES.get(str(kind), 'block')}"


def key_line(text: str, *keys: str) -> tuple[int, str]:
    """Return number and text of the line of a study file that says a key, such as ("body", "material", "young").

    It is the line of the key itself, of the inline table that holds it, or of the table where the key has its default;
    0 and "" where the file says none of these.
    """
    table, nearest, held = tuple[str, ...](), (0, ""), 0
    for number, line in enumerate(text.splitlines(), 1):
        if header := re.match(r"\s*\[([\w. -]+)\]", line):
            table = path = tuple(part.strip() for part in header[1].split("."))
        elif re.match(r"\s*\[\[", line):
            table = path = ("",)  # one of several tables: none of their keys is asked for
        elif key := re.match(r"\s*([\w.-]+)\s*=", line):
            path = (*table, *key[1].split("."))
        else:
            continue
        if path == keys[: len(path)] and len(path) > held:
            nearest, held = (number, line.partition(" #")[0].strip()), len(path)
    return nearest


def study_schema() -> str:
    """Return the JSON schema of study files, for editors."""
    return json.dumps(Study.model_json_schema(), indent=2)


def to_toml(study: Study, notes: Iterable[str] = ()) -> str:
    """Return the study as a TOML file with a comment for each key, which `read_study` reads back as the same study.

    Parameters
    ----------
    study : Study
        The study to write.
    notes : iterable of str
        Lines of further comments for the head of the file.
    """
    document = tomlkit.document()
    document.add(tomlkit.comment(STUDY_HEAD))
    document.add(tomlkit.comment('Quantities are numbers in SI units, or text with a unit: "5 mm", "2 GPa".'))
    for note in notes:
        document.add(tomlkit.comment(note) if note else tomlkit.nl())
    document.add(tomlkit.nl())
    _fill(document, study)
    # tomlkit parts a table from the comment above it
    return re.sub(r"(\n# [^\n]*)\n\n\[", r"\1\n[", tomlkit.dumps(document))


def _fill(table: Any, record: BaseModel) -> None:
    """Write a record's keys, and then its tables, into a table."""
    # the kind of a table comes first
    for name, field in sorted(type(record).model_fields.items(), key=lambda item: item[0] != "kind"):
        value = getattr(record, name)
        tables = (
            isinstance(value, BaseModel) or _record_of(type(record), name, value) or _holds_records(value)
        )
        if not tables and name not in getattr(record, "unused_keys", ()):
            _add_key(table, name, field, value)
    for name in type(record).model_fields:
        value = getattr(record, name)
        if isinstance(value, BaseModel):
            _add_comment(table, value)
            inner = tomlkit.table()
            _fill(inner, value)
            table.add(name, inner)
        elif _holds_records(value):
            inner = tomlkit.table()
            _fill_by_name(inner, value)
            table.add(name, inner)
        elif (item := _record_of(type(record), name, value)) and (value or _can_vary(record)):
            _add_tables(table, name, item, value)


def _holds_records(value: Any) -> bool:
    """Return whether a value is a table of records by name."""
    return isinstance(value, dict) and any(isinstance(entry, BaseModel) for entry in value.values())


def _fill_by_name(table: Any, records: dict[str, Any]) -> None:
    """Write records and texts by their names; texts first, as TOML wants it."""
    for name, value in sorted(records.items(), key=lambda item: isinstance(item[1], BaseModel)):
        if isinstance(value, BaseModel):
            inner = tomlkit.table()
            _fill(inner, value)
            table.add(name, inner)
        else:
            table.add(name, value)


def _can_vary(record: BaseModel) -> bool:
    """Return whether numbers of a study's body can be inputs."""
    # the names of its surfaces would tell, too, but those of a part are in its file, which may be elsewhere
    return isinstance(record, Study) and "probe" in record.body.INTERACTIONS


def _add_tables(table: Any, name: str, item: type[BaseModel], values: Iterable[BaseModel] | None) -> None:
    """Write a list of tables; where it is empty, a commented example of one."""
    if not values:
        if values == ():
            _add_comment(table, item)
            table.add(tomlkit.comment(f"[[{name}]]"))
            for key, field in item.model_fields.items():
                example = json.dumps((field.examples or [""])[0], ensure_ascii=False)
                table.add(tomlkit.comment(f"{key} = {example}  # {field.description}"))
        return
    _add_comment(table, item)
    tables: AoT = tomlkit.aot()
    for value in values:
        inner = tomlkit.table()
        _fill(inner, value)
        tables.append(inner)
    table.add(name, tables)


def _add_comment(table: Any, record: BaseModel | type[BaseModel]) -> None:
    table.add(tomlkit.nl())
    table.add(tomlkit.comment((record.__doc__ or "").strip().splitlines()[0]))


def _add_key(table: Any, name: str, field: Any, value: Any) -> None:
    """Write one key with its meaning as a comment."""
    comment = field.description or ""
    if value is None:  # TOML has no such value: an example stands there as a comment
        if field.examples:
            example = tomlkit.item(_plain(field.examples[0])).as_string()
            table.add(tomlkit.comment(f"{name} = {example}" + (f"  # {comment}" if comment else "")))
        return
    if isinstance(value, dict):
        if not value:
            return
        item: Any = tomlkit.inline_table()
        item.update(value)
    else:
        unit = None if isinstance(value, str) else unit_in((*field.metadata, field.annotation))
        item = tomlkit.item(_plain(value) if unit is None else _with_units(value, unit))
    if comment:
        item.comment(comment)
    table.add(name, item)


def _with_units(value: Any, unit: str) -> Any:
    """Return a quantity in SI units, or a list of them, as text that reads well and back to the same number."""
    if isinstance(value, (list, tuple)):
        return [_with_units(part, unit) for part in value]
    units = _READABLE.get(unit, ())
    for name, size in units:
        text = f"{_digits(round(value / size, 9))} {name}"
        if (abs(value) >= size or name == units[-1][0]) and parse_quantity(text, unit) == value:
            return text
    return f"{_digits(float(value))} {unit}"


def _digits(value: float) -> str:
    """Return a number with no more digits than it needs to be read back."""
    if value.is_integer() and abs(value) < _WRITTEN_OUT:
        return f"{value:.0f}"
    return next((text for n in range(1, 17) if float(text := f"{value:.{n}g}") == value), repr(value))


def _plain(value: Any) -> Any:
    return [_plain(v) for v in value] if isinstance(value, (list, tuple)) else value


def _record_of(record: type[BaseModel], name: str, value: Any) -> type[BaseModel] | None:
    """Return the record of which a key holds a list of tables; None for other keys."""
    if isinstance(value, tuple) and value:
        return type(value[0]) if isinstance(value[0], BaseModel) else None
    if value != ():
        return None
    kinds = get_args(record.model_fields[name].annotation)
    return next((k for k in kinds if isinstance(k, type) and issubclass(k, BaseModel)), None)
