"""Sentences about what is wrong in a record that a person wrote: which key, what stands there, and what may.

Pydantic finds the mistakes; none of its own messages reaches a reader.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from types import NoneType, UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from palpate.checks import did_you_mean
from palpate.records import Unit

__all__ = ["complaints", "range_words", "unit_in"]

_LONGEST = 60  # characters of an input that a complaint repeats
_BOUNDS = {"greater_than": "gt", "greater_than_equal": "ge", "less_than": "lt", "less_than_equal": "le"}
_KINDS = {
    "float": "number",
    "int": "whole number",
    "finite": "finite number",
    "string": "text",
    "tuple": "list",
    "list": "list",
    "model": "table",
    "dict": "table",
}


@dataclass(frozen=True)
class _Place:
    """Where a mistake is: the keys that lead there, the fields they may mean, and the types of these."""

    keys: tuple[str, ...]
    fields: tuple[FieldInfo, ...]
    forms: tuple[Any, ...]


def complaints(error: ValidationError, model: type[BaseModel], whole: str = "study") -> Iterator[str]:
    """Yield one line per mistake: the key, what is wrong with it, what is allowed, and an example.

    `whole` is how the record is called, for mistakes of no single key.
    """
    items = [(_place(item["loc"], model), item) for item in error.errors(include_url=False)]
    by_keys: dict[tuple[str, ...], list[str]] = {}
    for place, item in items:
        # what is wrong with a whole because of one of its parts, or of another form it might have had, is no news
        if any(_is_below(other.keys, place.keys) for other, _ in items) or _is_other_form(item, items):
            continue
        by_keys.setdefault(place.keys, []).append(_sentence(item, place, model))
    for keys, sentences in by_keys.items():
        first, *others = dict.fromkeys(sentences)
        subject = first.partition(" is no ")[0]  # 5 is no text and no table
        yield f"{'.'.join(keys) or whole}: {' and '.join([first, *(o.removeprefix(f'{subject} is ') for o in others)])}"


def _is_below(keys: tuple[str, ...], above: tuple[str, ...]) -> bool:
    return keys != above and keys[: len(above)] == above


def _is_other_form(item: Any, items: Sequence[tuple[_Place, Any]]) -> bool:
    """Return whether an entry is missing only in a longer list, another form of which has mistakes of its own."""
    place = item["loc"]
    depth = next(
        (i for i, key in enumerate(place) if isinstance(key, str) and key.startswith("tuple[")), None
    )
    if item["type"] != "missing" or depth is None:
        return False
    return any(
        other["loc"][:depth] == place[:depth] and other["loc"][: depth + 1] != place[: depth + 1]
        for _, other in items
    )


def _place(location: tuple[int | str, ...], model: type[BaseModel]) -> _Place:
    """Return where a mistake is; Pydantic's location names the tags of unions, too, which are no keys."""
    keys, fields, tagged = list[str](), tuple[FieldInfo, ...](), False
    forms: tuple[Any, ...] = (model,)
    for key in location:
        if tagged:  # the kind of a union
            forms, tagged = tuple(f for f in forms if f.model_fields["kind"].default == key), False
            continue
        named = tuple(known[key] for form in forms if key in (known := _fields(form)))
        values = [part for form in forms for part in _entries(form, key)]
        if named:
            fields, tagged = named, named[0].discriminator is not None
            forms = tuple(form for field in fields for form in _forms(field.annotation))
        elif values:
            forms = tuple(form for part in values for form in _forms(part))
        elif isinstance(key, str) and _is_tag(key):
            continue
        keys.append(str(key))
    return _Place(tuple(keys), fields, forms)


def _fields(form: Any) -> dict[Any, FieldInfo]:
    """Return the fields of a record by their keys; nothing of other types."""
    if not (isinstance(form, type) and issubclass(form, BaseModel)):
        return {}
    return {field.alias or name: field for name, field in form.model_fields.items()}


def _entries(form: Any, key: int | str) -> Sequence[Any]:
    """Return the types of what lies in a list at a number, or in a table by a name."""
    origin, parts = get_origin(form), get_args(form)
    if origin in {tuple, list} and isinstance(key, int):
        return parts[:1] if Ellipsis in parts or origin is list else parts[key : key + 1]
    return parts[1:] if origin is dict else ()


def _forms(annotation: Any) -> Iterator[Any]:
    """Yield the types that an annotation allows."""
    if get_origin(annotation) is Annotated:
        yield from _forms(get_args(annotation)[0])
    elif get_origin(annotation) in {Union, UnionType}:
        for part in get_args(annotation):
            yield from _forms(part)
    elif annotation is not NoneType:
        yield annotation


def _is_tag(key: str) -> bool:
    return key in {"str", "int", "float", "bool"} or key.endswith("Record") or "[" in key


def _sentence(item: Any, place: _Place, model: type[BaseModel]) -> str:
    """Return what is wrong at a place."""
    kind, shown = item["type"], _shown(item["input"])
    if kind == "value_error":
        text = str(item["msg"]).removeprefix("Value error, ")
    elif kind == "missing":
        text = f"{'an entry' if isinstance(item['loc'][-1], int) else 'this key'} is missing{_example(place.fields)}"
    elif kind == "extra_forbidden":
        known = {str(key) for form in _place(item["loc"][:-1], model).forms for key in _fields(form)}
        word = str(item["loc"][-1])  # known, it is one of the same table of another kind
        text = f"there is no such key{' here' if word in known else _close(word, known)}"
    elif kind in {"literal_error", "union_tag_invalid", "union_tag_not_found"}:
        text = _none_of(item, place, shown)
    elif kind in _BOUNDS:
        text = _out_of_range(shown, item["ctx"], place)
    elif kind in {"too_short", "too_long"}:
        bounds = {"ge": item["ctx"].get("min_length"), "le": item["ctx"].get("max_length")}
        entries = range_words({name: bound for name, bound in bounds.items() if bound is not None})
        text = f"it has {item['ctx']['actual_length']} entries; it takes {entries}"
    elif kind == "string_pattern_mismatch":
        text = f"{shown} can't name files: letters, digits, dots, dashes and underscores can"
    elif kind == "string_too_short":
        text = f"the text is empty{_example(place.fields)}"
    elif kind.startswith("bool"):
        text = f"{shown} is neither true nor false"
    else:
        text = f"{shown} is no {_KINDS.get(kind.partition('_')[0], 'such value')}{_example(place.fields)}"
    return text


def _none_of(item: Any, place: _Place, shown: str) -> str:
    """Return that a word is none of those allowed, and which those are."""
    allowed = item["ctx"].get("expected_tags", item["ctx"].get("expected", ""))
    if item["type"] == "literal_error":
        choices = [str(c) for form in place.forms for c in get_args(form)]
        return f"{shown} is none of {allowed}{_close(str(item['input']), choices)}"
    kinds = [str(form.model_fields["kind"].default) for form in place.forms]
    if item["type"] == "union_tag_not_found":
        return f"`kind` is missing; there are {', '.join(kinds)}"
    tag = str(item["ctx"]["tag"])
    return f"there is no kind of {place.keys[-1]} {tag!r}; there are {', '.join(kinds)}{_close(tag, kinds)}"


def _close(word: str, known: Sequence[str] | set[str]) -> str:
    question = did_you_mean(word, known, shown=repr)
    return f"; d{question[1:]}" if question else ""


def _out_of_range(shown: str, missed: dict[str, float], place: _Place) -> str:
    """Return that a number is out of range, and the range: that of the field to which the bound missed belongs."""
    fields = [field for field in place.fields if missed.items() <= _limits(field).items()]
    limits = _limits(fields[0]) if fields else missed
    unit = unit_in([part for field in place.fields for part in (*field.metadata, field.annotation)]) or ""
    value = f"{shown} {unit}".rstrip()
    return f"{value} is out of range; allowed is {range_words(limits, unit)}{_example(fields)}"


def _limits(field: FieldInfo) -> dict[str, float]:
    """Return the bounds of a field by how they bind."""
    return {
        name: getattr(part, name)
        for part in field.metadata
        for name in _BOUNDS.values()
        if hasattr(part, name)
    }


def range_words(limits: dict[str, float], unit: str = "") -> str:
    """Return a range in words; the limits are by how they bind: gt, ge, lt and le."""
    words = {"gt": "more than", "ge": "at least", "lt": "less than", "le": "at most"}
    return " and ".join(f"{words[k]} {limits[k]:.6g} {unit}".rstrip() for k in words if k in limits)


def unit_in(parts: Sequence[Any]) -> str | None:
    """Return the unit among a field's annotations, however deep; None where there is none, or it is a pure number."""
    for part in parts:
        if isinstance(part, Unit) and part.name:
            return part.name
        if name := unit_in((*get_args(part), *getattr(part, "__metadata__", ()))):
            return name
    return None


def _example(fields: Sequence[FieldInfo]) -> str:
    """Return an example of what a key may hold."""
    for value in (value for field in fields[:1] for value in (*(field.examples or ()), field.default)):
        if (
            isinstance(value, (str, int, float, list, tuple))
            and value not in ("", ())
            and (shown := _shown(value))
        ):
            return f"; for example {shown}"
    return ""


def _shown(value: Any) -> str:
    """Return a value as it stands in a file, cut where it is long; nothing of what a file can't hold."""
    try:
        text = json.dumps(value, ensure_ascii=False)
    except (TypeError, ValueError):
        return ""
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
