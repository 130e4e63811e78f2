"""Renews the tables of the study file's reference from the study's own records: python docs/study_reference.py."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel

from palpate.learning import Settings, default, founding
from palpate.record_complaints import unit_in
from palpate.study import Study
from palpate.study.body_records import (
    BodyRecord,
    InclusionRecord,
    LayerRecord,
    SectionRecord,
    SkinRecord,
)
from palpate.study.interaction_records import VariedRecord
from palpate.study.loads_kind import LoadRecord
from palpate.study.material_records import (
    FibreRecord,
    HardeningRecord,
    MaterialRecord,
    SolidMaterialRecord,
)
from palpate.study.memory_kind import MemoryRecord
from palpate.study.part_records import PartSurfaceRecord
from palpate.study.solver_study import (
    SolverInputRecord,
    SolverRecord,
    SolverStudy,
    SolverSweepRecord,
    SolverTestRecord,
    UMBridgeRecord,
)
from palpate.study.stage_records import SECTIONS, RuntimeRecord
from palpate.study.study import InteractionRecord
from palpate.study.tool_kind import SHAPES, FileShape

PAGE = Path(__file__).parent / "guide" / "study-file.md"
BEGIN, END = "<!-- generated: begin -->", "<!-- generated: end -->"


def renewed(text: str) -> str:
    """The page's text with its generated part renewed."""
    head, rest = text.split(BEGIN)
    return "\n".join([head + BEGIN, "", *_tables(), END + rest.split(END)[1]])


def _tables() -> Iterator[str]:
    yield from _table("Top level", Study, "")
    for body in get_args(BodyRecord):
        yield from _kind_of("body", body)
    for title, record in (
        ("`[body.section]`, of a cantilever", SectionRecord),
        ("`[body.material]` of a cantilever, in place of a name", MaterialRecord),
        ("`[body.material]` and other materials of a solid body, in place of a name", SolidMaterialRecord),
        ("`[[body.material.fibres]]`, once per family", FibreRecord),
        ("`[body.material.hardening]`", HardeningRecord),
        ("`[[body.surfaces]]` of a part, once per surface", PartSurfaceRecord),
        ("`[[body.layers]]`, once per layer", LayerRecord),
        ("`[body.skin]`, of a dome", SkinRecord),
        ("`[body.inclusion]`, of a dome", InclusionRecord),
    ):
        yield from _table(title, record, _purpose(record))
    for acting in get_args(InteractionRecord):
        yield from _kind_of("interaction", acting)
    for shape in (*SHAPES.values(), FileShape):
        yield from _kind_of("interaction.shape", shape)
    yield from _table("`[[interaction.loads]]`, once per load", LoadRecord, _purpose(LoadRecord))
    yield from _table("`[memory]`, of a body that yields or creeps", MemoryRecord, _purpose(MemoryRecord))
    yield from _table("`[[varied]]`, once per number", VariedRecord, _purpose(VariedRecord))
    kinds = [acting.model_fields["kind"].default for acting in get_args(InteractionRecord)]
    for kind in (*kinds, "memory"):
        sections = SECTIONS[kind]
        where = "of a body with memory" if kind == "memory" else f"with the interaction `{kind}`"
        for name, record in sections.items():
            yield from _table(f"`[{name}]` {where}", record, _purpose(record))
            if name == "filter":
                yield from _settings()
    yield from _table("`[runtime]`", RuntimeRecord, _purpose(RuntimeRecord))
    yield from _table("Top level, with `[solver]`", SolverStudy, _purpose(SolverStudy))
    for title, record in (
        ("`[solver]`", SolverRecord),
        ("`[solver]` with `url`", UMBridgeRecord),
        ("`[[inputs]]` with `[solver]`, once per input", SolverInputRecord),
        ("`[sweep]` with `[solver]`", SolverSweepRecord),
        ("`[test]` with `[solver]`", SolverTestRecord),
    ):
        yield from _table(title, record, _purpose(record))


def _kind_of(table: str, record: type[BaseModel]) -> Iterator[str]:
    kind = record.model_fields["kind"].default
    yield from _table(f'`[{table}]`, `kind = "{kind}"`', record, _purpose(record))


def _purpose(record: type[BaseModel]) -> str:
    return (record.__doc__ or "").strip().splitlines()[0]


def _table(title: str, record: type[BaseModel], about: str) -> Iterator[str]:
    yield f"### {title}"
    yield ""
    if about:
        yield about
        yield ""
    yield "| key | kind | default | meaning |"
    yield "|---|---|---|---|"
    schema = record.model_json_schema()["properties"]
    for name, field in record.model_fields.items():
        if _is_table(name, field.annotation):
            continue
        unit = unit_in((*field.metadata, field.annotation)) or ""
        start = "needed" if field.is_required() else _shown(field.get_default(call_default_factory=True))
        yield f"| `{name}` | {_kind(schema[name], unit)} | {start} | {field.description or ''} |"
    yield ""


def _is_table(name: str, annotation: Any) -> bool:
    return (name not in {"material", "materials"} and _has_record(annotation)) or name in {
        "body",
        "interaction",
    }


def _has_record(annotation: Any) -> bool:
    """Whether an annotation names a record, however deep."""
    own = isinstance(annotation, type) and issubclass(annotation, BaseModel)
    return own or any(_has_record(part) for part in get_args(annotation))


def _kind(schema: dict[str, Any], unit: str) -> str:
    bounds = [
        f"{sign} {schema[key]:g}"
        for key, sign in (("minimum", "≥"), ("exclusiveMinimum", ">"), ("maximum", "≤"))
        if key in schema
    ]
    if "const" in schema:
        return f"`{json.dumps(schema['const'])}`"
    if "enum" in schema:
        return ", ".join(f"`{json.dumps(word)}`" for word in schema["enum"])
    kinds = [schema.get("type"), *(part.get("type") for part in schema.get("anyOf", ()))]
    many = "list of " if "array" in kinds else ""
    if unit:
        return many + f"{unit}" + "".join(f", {b}" for b in bounds)
    words = {
        "integer": "integer",
        "number": "number",
        "boolean": "true or false",
        "string": "text",
        "object": "table",
        "array": "list",
    }
    if many and "string" not in kinds:
        return f"list of {_entries(schema)}"
    if "anyOf" in schema:
        kinds = [
            words.get(part.get("type", ""), "") for part in schema["anyOf"] if part.get("type") != "null"
        ]
        inner = [f"≥ {part['minimum']:g}" for part in schema["anyOf"] if "minimum" in part]
        return ", ".join([" or ".join(k if k else "table" for k in kinds), *inner])
    return ", ".join([words.get(schema.get("type", ""), ""), *bounds])


def _entries(schema: dict[str, Any]) -> str:
    """What a list holds: numbers, texts, or quantities, which are numbers or texts."""
    texts = [part for part in (schema.get("items", {}), *schema.get("prefixItems", ())) if part]
    if any(part.get("type") == "string" for part in texts):
        return "texts"
    return "quantities" if any({"type": "string"} in part.get("anyOf", ()) for part in texts) else "numbers"


def _shown(value: Any) -> str:
    if value is None or value in ((), {}):
        return "–"
    if isinstance(value, BaseModel):
        content = value.model_dump(exclude_unset=True)
        return "`{ " + ", ".join(f"{k} = {v:g}" for k, v in content.items()) + " }`"
    if isinstance(value, tuple):
        return "`[" + ", ".join(map(repr, value)) + "]`"
    if isinstance(value, float):
        return f"`{value:g}`"
    return f"`{json.dumps(value)}`"


def _settings() -> Iterator[str]:
    yield "### `[filter] settings`"
    yield ""
    yield "Single settings of the filter, by name: `settings = { error_min = 0.005 }`. Their meaning is in"
    yield "[learning](../method/learning.md) and in the docstring of `palpate.Settings`."
    yield ""
    yield "| setting | `default` | `founding` |"
    yield "|---|---|---|"
    ours, theirs = default(), founding()
    for name in Settings.__dataclass_fields__:
        yield f"| `{name}` | {_shown(getattr(ours, name))} | {_shown(getattr(theirs, name))} |"
    yield ""


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
