"""The page that plays how a network grew: one self-contained HTML file that needs no server and no network."""

from __future__ import annotations

import html
import json
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.errors import UsageError
from palpate.files import write_file
from palpate.format import script_json
from palpate.output_files import free_path, with_seal

if TYPE_CHECKING:
    from palpate.learning.growth_frames import GrowthRecorder

__all__ = ["growth_html", "write_growth_page"]

TEMPLATE = Path(__file__).parent / "templates" / "growth.html"


def growth_html(growth: GrowthRecorder, name: str) -> str:
    """Return the page of a recorded run as text, under the body's name."""
    if not growth.frames:
        raise UsageError(
            "There is no growth to be shown.",
            why="No network was learnt with this recorder.",
            fix="Pass it to a learner first: learn(…, watch=recorder).",
        )
    words = {
        "name": html.escape(name),
        "data": script_json(json.dumps(growth.describe(), separators=(",", ":"))),
    }
    # in one pass: a name may hold braces, too
    return re.sub(r"\{\{(name|data)\}\}", lambda m: words[m[1]], TEMPLATE.read_text(encoding="utf-8"))


def write_growth_page(path: str | os.PathLike[str], growth: GrowthRecorder, name: str) -> Path:
    """Write the page and return its path; the parameters are those of `growth_html`."""
    file = free_path(path)
    return write_file(file, with_seal(file, growth_html(growth, name)))
