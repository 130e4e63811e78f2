"""The record of a model card as lines that a person reads: nested bullets, numbers with SI units.

The same names and values stand in the card's JSON as the file has them.
"""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from palpate.format import share

__all__ = ["bullets", "escape_markdown", "html_page", "html_record", "rows"]

_RELATIVE = ("error", "RMSE", "percentile", "median", "p95", "share")  # names of figures that are shares
_METRES = (
    "radius",
    "depth",
    "over",
    "stop",
    "length",
    "height",
    "thickness",
    "width",
    "size",
    "element",
    "amplitude",
)
_PASCALS = ("young", "shear", "bulk", "shear_modulus", "bulk_modulus", "yield_stress", "saturation", "mu")
_UNITS: dict[str, str] = {
    **dict.fromkeys(_METRES, "m"),
    **dict.fromkeys(_PASCALS, "Pa"),
    "density": "kg/m³",
    "gravity": "m/s²",
    "pad": "N/m³",
    "within": "°",
    "feature_angle": "°",
    "painted_area": "m²",
    "trained_area": "m²",
    "lower": "m",
    "upper": "m",
}
_INTERVALS = ("depth",)  # names whose two numbers are the ends of a range
_HEADS = ("type", "law", "name")  # keys that say what a part is, shown in the line of its name
_MOST = 12  # values of a list that are shown, at most


def bullets(part: Mapping[str, Any], escape: Callable[[str], str] = str, depth: int = 0) -> list[str]:
    """Return a record of names and JSON values as nested Markdown bullets; what is empty is left out.

    `escape` is applied to each text of the record.
    """
    lines: list[str] = []
    for name, value in part.items():
        if _is_empty(value):
            continue
        label = escape(str(name).replace("_", " "))
        if _is_record(value):
            lines += _record_lines(label, name, value, escape, depth)
        elif isinstance(value, list | tuple) and any(_is_record(item) for item in value):
            for item in value:
                lines += _record_lines(label, name, item, escape, depth)
        else:
            lines.append(_line(depth, label, escape(_words(str(name), value))))
    return lines


def rows(part: Mapping[str, Any]) -> dict[str, str]:
    """Return a nested record as rows: the names on the way to each value, and the value in words."""
    found: dict[str, str] = {}
    path: list[str] = []
    for line in bullets(part):
        depth = (len(line) - len(line.lstrip())) // 2
        name, _, words = line.lstrip()[2:].partition(": ")
        path = [*path[:depth], name]
        if words:
            where = ", ".join(path)
            found[where] = f"{found[where]}; {words}" if where in found else words
    return found


def escape_markdown(text: str) -> str:
    """Return text that Markdown and HTML take as it stands."""
    for mark in ("\\", "`", "*", "_", "[", "]", "<", ">", "|", "#"):
        text = text.replace(mark, f"\\{mark}" if mark not in "<>" else {"<": "&lt;", ">": "&gt;"}[mark])
    return text.replace("\n", " ")


def html_record(name: str, kind: str, parts: Mapping[str, Any]) -> str:
    """Return titles, with texts, lists or records of texts under them, as a part of an HTML page; all is escaped."""
    lines = [f"<h2>{html.escape(name)}</h2>", f"<p>{html.escape(kind)}</p>", "<dl>"]
    for title, part in parts.items():
        items = [f"{key}: {value}" for key, value in part.items()] if isinstance(part, Mapping) else part
        texts = [items] if isinstance(items, str) else items
        lines.append(f"<dt><b>{html.escape(title)}</b></dt>")
        lines += [f'<dd style="overflow-wrap: anywhere">{html.escape(str(text))}</dd>' for text in texts]
    return "\n".join([*lines, "</dl>"])


def html_page(title: str, part: str) -> str:
    """Return a page that holds a part alone, and needs nothing else."""
    return (
        f'<!doctype html>\n<html lang="en">\n<head><meta charset="utf-8"><title>{html.escape(title)}</title>\n'
        '<meta name="viewport" content="width=device-width"><style>body { font: 16px/1.5 system-ui, sans-serif; '
        "max-width: 44em; margin: 2em auto; padding: 0 1em; }</style></head>\n"
        f"<body>\n{part}\n</body>\n</html>\n"
    )


def _record_lines(label: str, name: str, value: Any, escape: Callable[[str], str], depth: int) -> list[str]:
    """Return the line of a part, which says what it is, and the lines of its own parts below."""
    if not _is_record(value):
        return [_line(depth, label, escape(_words(name, value)))]
    rest = dict(value)
    # a count of the same name, or the kind of the part, stands in the part's own line
    heads = [rest.pop(key) for key in (name, *_HEADS) if key in rest and isinstance(rest[key], str | int)]
    shown = list(dict.fromkeys(str(head) for head in heads if str(head)))
    return [_line(depth, label, escape(", ".join(shown))), *bullets(rest, escape, depth + 1)]


def _line(depth: int, label: str, words: str) -> str:
    return f"{'  ' * depth}- {label}" + (f": {words}" if words else "")


def _is_record(value: Any) -> bool:
    return isinstance(value, Mapping)


def _is_empty(value: Any) -> bool:
    """Return whether nothing is said: none, no text, or a list or record of such."""
    if isinstance(value, Mapping):
        return all(map(_is_empty, value.values()))
    if isinstance(value, list | tuple):
        return all(map(_is_empty, value))
    return value is None or value == ""


def _words(name: str, value: Any) -> str:
    """Return a plain value, or a list of plain values, with its unit."""
    unit = _UNITS.get(name, "")
    if isinstance(value, list | tuple):
        if name in _INTERVALS and len(value) == 2:
            return f"{_plain(name, value[0])} to {_plain(name, value[1])} {unit}"
        return _list_text(name, value) + (f" {unit}" if unit and _has_numbers(value) else "")
    text = _plain(name, value)
    return f"{text} {unit}" if unit and _has_numbers([value]) else text


def _list_text(name: str, values: Sequence[Any]) -> str:
    shown = [
        "any"
        if _is_empty(v)
        else f"({_list_text(name, v)})"
        if isinstance(v, list | tuple)
        else _plain(name, v)
        for v in values[:_MOST]
    ]
    return ", ".join(shown) + (f", … ({len(values)} in all)" if len(values) > _MOST else "")


def _has_numbers(values: Sequence[Any]) -> bool:
    return any(
        _has_numbers(v)
        if isinstance(v, list | tuple)
        else isinstance(v, int | float) and not isinstance(v, bool)
        for v in values
    )


def _plain(name: str, value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float) and math.isfinite(value):
        return share(value) if any(word in name for word in _RELATIVE) else f"{value:.6g}"
    return str(value)
