"""The page itself."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from palpate.errors import UsageError
from palpate.format import bind_units
from palpate.validation.report.chapter import Chapter
from palpate.validation.report.held import HeldChapter
from palpate.validation.report.held.told import held_told
from palpate.validation.report.networks import network_rows
from palpate.validation.report.pictures import pictures
from palpate.validation.report.summary import story
from palpate.validation.report.surrogates import SurrogateChapter
from palpate.validation.report.surrogates.told import surrogate_told
from palpate.validation.report.tables import flat, judged_rows, node_rows, sources, timing_rows

if TYPE_CHECKING:
    from markupsafe import Markup

__all__ = ["render", "write_report"]

TITLE = "What the hand will feel"

AnyChapter: TypeAlias = Chapter | SurrogateChapter | HeldChapter


def write_report(
    path: str | os.PathLike[str],
    chapters: Sequence[AnyChapter],
    *,
    title: str = TITLE,
    machine: Mapping[str, Any] | None = None,
) -> Path:
    """Write one self-contained HTML file and return its path.

    Parameters
    ----------
    path : path
        Of the file; its folder is made if need be.
    chapters : sequence of Chapter, SurrogateChapter or HeldChapter
        One per body.
    title : str
    machine : mapping, optional
        What the figures were made on: processor, system, versions.

    Raises
    ------
    UsageError
        If there is no chapter, or the file can't be written.
    """
    target = Path(path)
    part = target.with_name(f".{target.name}.part")
    try:
        # a path that can't be written is found before the figures are drawn
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.is_dir():
            raise IsADirectoryError(f"{target} is a folder")
        part.touch()
        part.write_text(render(chapters, title=title, machine=machine), encoding="utf-8", newline="\n")
        part.replace(target)  # a reader never meets half a page
    except OSError as error:
        raise UsageError(
            f"The report can't be written to {target}.",
            why=str(error),
            fix="Name a file in a folder that you may write to.",
        ) from error
    finally:
        with contextlib.suppress(OSError):
            part.unlink()
    return target


def render(
    chapters: Sequence[AnyChapter],
    *,
    title: str = TITLE,
    machine: Mapping[str, Any] | None = None,
) -> str:
    """The page as text; the same chapters give the same text.

    Raises
    ------
    UsageError
        If there is no chapter.
    """
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
    told = [_told(chapter, f"c{i}") for i, chapter in enumerate(chapters, 1)]
    return environment.get_template("report.html").render(
        title=title,
        style=style,
        chapters=told,
        sources=sources([c.validation for c in chapters]),
        machine=list(flat(machine or {})),
        svg=Markup,
    )


def _prose(text: str) -> Markup:
    """Text as HTML: escaped, numbers bound to their units, what stands between backticks as code."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(escape(bind_units(text)))))


def _told(chapter: AnyChapter, key: str) -> dict[str, Any]:
    if isinstance(chapter, SurrogateChapter):
        return surrogate_told(chapter, key)
    if isinstance(chapter, HeldChapter):
        return held_told(chapter, key)
    head, rows = node_rows(chapter.validation)
    return {
        "key": key,
        "name": chapter.name,
        "story": story(chapter),
        "pictures": pictures(chapter, key),
        "judged": judged_rows(chapter.validation),
        "failures": [str(c) for c in chapter.validation.failures],
        "notes": chapter.validation.notes,
        "networks": network_rows(chapter.touch),
        "tables": [("Error of each displacement", head, rows)],
        "timings": timing_rows(chapter.timings),
        "settings": list(flat(chapter.settings or chapter.touch.meta.get("settings", {}))),
        "provenance": list(flat(chapter.provenance or chapter.train.provenance)),
    }
