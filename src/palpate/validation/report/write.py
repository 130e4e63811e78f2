"""Page of a report: one self-contained HTML file."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.errors import UsageError
from palpate.files import system_errors, writing
from palpate.format import bind_units
from palpate.output_files import free_path, with_seal
from palpate.validation.report.answer_pictures import answer_pictures
from palpate.validation.report.body_pictures import body_pictures
from palpate.validation.report.chapter import Chapter
from palpate.validation.report.hand_pictures import hand_pictures
from palpate.validation.report.history_pictures import history_pictures
from palpate.validation.report.load_pictures import load_pictures
from palpate.validation.report.network_pictures import network_rows
from palpate.validation.report.place_pictures import place_pictures
from palpate.validation.report.style import Picture
from palpate.validation.report.summary import story
from palpate.validation.report.tables import check_rows, flat, sources, tables, timing_rows
from palpate.validation.report.touch_pictures import touch_pictures
from palpate.validation.report.trace_pictures import comparison_pictures

if TYPE_CHECKING:
    from markupsafe import Markup

__all__ = ["pictures", "render", "report_context", "write_report"]

TITLE = "What the hand will feel"

PICTURES: tuple[Callable[[Chapter, str], list[Picture]], ...] = (
    answer_pictures,
    load_pictures,
    place_pictures,
    touch_pictures,
    history_pictures,
    hand_pictures,
    comparison_pictures,
)
"""Groups of pictures in the order of the page; each draws what it can of a chapter."""


def write_report(
    path: str | os.PathLike[str],
    chapters: Sequence[Chapter],
    *,
    title: str = TITLE,
    machine: Mapping[str, Any] | None = None,
) -> Path:
    """Write one self-contained HTML file and return its path.

    A report takes the place of an earlier one; where somebody else's file has the name, it gets a number.

    Parameters
    ----------
    path : path
        Of the file; its folder is made if need be.
    chapters : sequence of Chapter
        One per body.
    title : str
        Heading of the page.
    machine : mapping, optional
        Where the figures were made: processor, system, versions.

    Raises
    ------
    UsageError
        If there is no chapter, or the path can't be a file's.
    ResourceError
        If the disk is full, or the folder write-protected.
    """
    target = free_path(path)
    with system_errors(f"Could not write {target}."):
        target.parent.mkdir(parents=True, exist_ok=True)
    with writing(target) as part:  # a reader never meets half a page
        part.touch()  # a path that can't be written is found before the figures are drawn
        page = with_seal(target, render(chapters, title=title, machine=machine))
        part.write_text(page, encoding="utf-8", newline="\n")
    return target


def render(
    chapters: Sequence[Chapter],
    *,
    title: str = TITLE,
    machine: Mapping[str, Any] | None = None,
) -> str:
    """Return the page of at least one chapter as text; the same chapters give the same text."""
    if not chapters:
        raise UsageError("A report needs at least one chapter.", fix="Validate a model first.")
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=PackageLoader("palpate.validation.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"bound": bind_units, "prose": _prose}
    # figures are made here, with every name in them escaped by Matplotlib; the style sheet is palpate's own
    style = Markup(environment.get_template("report.css").render())
    contexts = [report_context(chapter, f"c{i}") for i, chapter in enumerate(chapters, 1)]
    return environment.get_template("report.html").render(
        title=title,
        style=style,
        chapters=contexts,
        sources=sources([c.validation for c in chapters]),
        machine=list(flat(machine or {})),
        svg=Markup,
    )


def _prose(text: str) -> Markup:
    """Return text as HTML: escaped, numbers bound to their units, what stands between backticks as code."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(escape(bind_units(text)))))


def report_context(chapter: Chapter, key: str) -> dict[str, Any]:
    """Return a chapter as the template takes it; `key` starts the name of each picture."""
    v, loads = chapter.validation, chapter.subject.loads
    remarks = v.histories.lines() if v.histories else ()
    return {
        "key": key,
        "name": chapter.name,
        "story": story(chapter),
        "body": body_pictures(chapter, key),
        "pictures": pictures(chapter, key),
        "checks": check_rows(v),
        "failures": [str(c) for c in v.failures],
        "notes": tuple(filter(None, (v.caution, *remarks, *v.notes))),
        "networks": [] if loads is None else network_rows(loads),
        "tables": tables(chapter),
        "timings": timing_rows(chapter.timings),
        "settings": list(flat(chapter.settings or chapter.meta.get("settings", {}))),
        "provenance": list(flat(_brief(chapter.origin or chapter.meta))),
    }


def pictures(chapter: Chapter, key: str) -> list[Picture]:
    """Draw all pictures of a chapter."""
    return [made for group in PICTURES for made in group(chapter, key)]


def _brief(origin: Mapping[str, Any]) -> dict[str, Any]:
    """Return provenance for a table: isometries as their number."""
    brief = dict(origin)
    if isinstance(symmetry := brief.get("symmetry"), Mapping):
        brief["symmetry"] = f"{len(symmetry.get('isometries', [1]))} images"
    return brief
