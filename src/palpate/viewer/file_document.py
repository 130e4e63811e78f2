"""The document of a page that is one file: skeleton, style, script and packed parts."""

from __future__ import annotations

import base64
import gzip
import html
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from palpate.format import script_json

__all__ = ["pack", "page_document", "page_statics", "shuffle_words", "with_parts"]

STATIC = Path(__file__).parent / "static"
# how the built modules begin and end
_IMPORT = re.compile(r'import\{([^{}]*)\}from"\./([^"/]+)";')
_EXPORT = re.compile(r"export\{([^{}]*)\};?\s*$")
_ALIAS = re.compile(r"([\w$]+) as ([\w$]+)")


def page_statics() -> tuple[str, str]:
    """Return style and script of every page."""
    style = (STATIC / "assets" / "page.css").read_text("utf-8")
    chunks: dict[str, str] = {}
    _add_chunk("file.js", chunks)
    # a page from disk may load no modules: they become functions of one plain script
    script = "\n".join(["(() => {", '"use strict";', "const chunks = {};", *chunks.values(), "})();"])
    return style, script.replace("</script", "<\\/script")


def _add_chunk(name: str, chunks: dict[str, str]) -> None:
    """Add a built module as a function of the modules before it, after those that it imports."""
    text = (STATIC / "assets" / name).read_text("utf-8")
    imported = [match[2] for match in _IMPORT.finditer(text)]
    for other in imported:
        if other not in chunks:
            _add_chunk(other, chunks)
    text = _IMPORT.sub(lambda match: f"const{{{match[1].replace(' as ', ':')}}}=chunks['{match[2]}'];", text)
    text = _EXPORT.sub(lambda match: "return{" + _ALIAS.sub(r"\2:\1", match[1]) + "};", text)
    chunks[name] = f"chunks['{name}']=(()=>{{{text}}})();"


def page_document(name: str, parts: Mapping[str, str], card: str, *, mode: str = "touch") -> str:
    """Return the page's skeleton with style, script, packed parts and model card put into it."""
    skeleton = (STATIC / "index.html").read_text("utf-8")
    body = re.search(r"<body>.*</body>", skeleton, re.DOTALL)
    assert body is not None
    style, script = page_statics()
    icon = base64.b64encode((STATIC / "favicon.svg").read_bytes()).decode()
    licence = (STATIC / "THIRD-PARTY.txt").read_text("utf-8")  # of what the script contains
    return f"""<!doctype html>
<!--
{licence}-->
<html lang="en" data-mode="{mode}" data-file>
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1, viewport-fit=cover">
<meta name="color-scheme" content="light dark">
<title>{html.escape(name)} · palpate</title>
<link rel="icon" type="image/svg+xml" href="data:image/svg+xml;base64,{icon}">
<style>{style}</style>
</head>
{body.group(0).replace("</body>", "")}
{with_parts(parts, card)}
<script>{script}</script>
</body>
</html>
"""


def with_parts(parts: Mapping[str, str], card: str) -> str:
    """Return packed parts and a model card as scripts that no browser runs."""
    scripts = [
        f'<script type="application/octet-stream" id="palpate-{key}">{part}</script>'
        for key, part in parts.items()
    ]
    return "\n".join(
        [*scripts, f'<script type="application/json" id="palpate-card">{script_json(card)}</script>']
    )


def shuffle_words(data: bytes, width: int = 8) -> bytes:
    """Return the bytes of equal weight of all words of `width` bytes one after the other, which packs better."""
    return np.frombuffer(data, dtype=np.uint8).reshape(-1, width).T.tobytes()


def pack(data: bytes) -> str:
    """Return bytes as base64 of their gzip."""
    return base64.b64encode(gzip.compress(data, compresslevel=9, mtime=0)).decode("ascii")
