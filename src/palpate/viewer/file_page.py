"""A learnt body as one HTML file that works from disk: no server, no network, nothing else beside it.

The page's own script, in one piece, asks the evaluator core as WebAssembly in place of the server. Everything that it
needs is in the file, packed by gzip: the core, the weights, the surface, the field's modes as whole numbers of two
bytes with a scale for each mode, and what the page is told first.
"""

from __future__ import annotations

import base64
import gzip
import html
import json
import os
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from palpate.errors import AccuracyError, UsageError
from palpate.export.build_core import built_core
from palpate.export.check_points import Comparison, compare_body
from palpate.export.field_tables import chosen_field
from palpate.export.wasm_core import WasmCore, wasmtime_module
from palpate.export.weights_block import FIELD, WeightsBlock
from palpate.files import write_file
from palpate.runtime.devices import device_traits
from palpate.runtime.touchable import touchable
from palpate.surrogates import ContactBaseline, FieldSurrogate, Surrogate
from palpate.surrogates.model_card import card_of
from palpate.viewer.messages import Modes, Surface
from palpate.viewer.page_model import PageModel

__all__ = ["ExportedPage", "export_html", "html_page"]

STATIC = Path(__file__).parent / "static"
DRAWN_BY_THE_PAGE = (
    FIELD + 4,
    FIELD + 6,
    FIELD + 7,
)  # modes and moving nodes: the page sums the shape up itself
LARGEST = 32767
DEEP = 2.0  # of the deepest trained depth, at which the body lets go
RATE = 60.0  # Hz, of the pictures


class _Settings(NamedTuple):
    scale: float
    radius: float
    max_force: float


@dataclass(frozen=True)
class ExportedPage:
    """A page that was written, and how far it is from palpate.

    Attributes
    ----------
    file : Path
        The page.
    hash : str
        SHA-256 of the weights.
    comparison : Comparison, optional
        How far it is from palpate; None where wasmtime is not installed, or nothing was to be compared.
    """

    file: Path
    hash: str
    comparison: Comparison | None


def export_html(surrogate: Surrogate, path: str | os.PathLike[str], *, check: bool = True) -> ExportedPage:
    """Write a learnt body as one HTML file, and compare what it answers with palpate if wasmtime is installed.

    Parameters
    ----------
    surrogate : Surrogate
        A body that a probe presses or a pad holds.
    path : path
        The file, which is replaced.
    check : bool
        Whether it is compared.

    Raises
    ------
    UsageError
        If the body is drawn as a line, or a part of it has no C source.
    AccuracyError
        If the core does not answer as palpate does; nothing is written.
    """
    surrogate = _with_one_field(surrogate)
    block = _block(surrogate)
    comparison = None
    if check and wasmtime_module() is not None:
        field = next((f for f in surrogate.fields.values() if isinstance(f, FieldSurrogate)), None)
        comparison = compare_body(surrogate, WasmCore.of(block, field), field=block.field)
        if not comparison.passed:
            raise AccuracyError(
                f"The page of {surrogate.name} does not answer as palpate does.",
                why=str(comparison),
                fix="Nothing was written. Report this with the model file.",
            )
    return ExportedPage(write_file(Path(path), _page(surrogate, block)), block.hash, comparison)


def html_page(surrogate: Surrogate) -> str:
    """Return a learnt body as one HTML file.

    Raises
    ------
    UsageError
        If the body is drawn as a line, or a part of it has no C source.
    """
    surrogate = _with_one_field(surrogate)
    return _page(surrogate, _block(surrogate))


def _with_one_field(surrogate: Surrogate) -> Surrogate:
    """Return the body with the field that is drawn alone."""
    if touchable(surrogate).line is not None:
        raise UsageError(
            f"The body {surrogate.name!r} can't be a page that is one file.",
            why="It is drawn as a line, and the shape of a bent beam has no C source.",
            fix="Export its force with `palpate export c`, or show it with `palpate view`.",
        )
    name = chosen_field(surrogate, None)
    return _shallow(replace(surrogate, fields={} if name is None else {name: surrogate.fields[name]}))


def _shallow(surrogate: Surrogate) -> Surrogate:
    """Return the same body, which lets go of a probe that is twice as deep as trained: its surface takes less room."""
    baseline, deepest = surrogate.energy.baseline, touchable(surrogate).deepest
    surface = baseline.surface
    if surface is None or not isinstance(baseline, ContactBaseline):
        return surrogate
    inner = max(DEEP * deepest - surface.radius, 2 * surface.spacing)
    if inner >= surface.inner:
        return surrogate
    nearer = replace(surface, inner=inner)
    energy = replace(surrogate.energy, baseline=replace(baseline, touched=nearer))
    fields = {
        name: replace(field, surface=nearer) if isinstance(field, FieldSurrogate) else field
        for name, field in surrogate.fields.items()
    }
    return replace(surrogate, energy=energy, fields=fields)


def _block(surrogate: Surrogate) -> WeightsBlock:
    """Return the weights without what the page draws with."""
    block = WeightsBlock.of(surrogate, field=next(iter(surrogate.fields), None))
    return replace(
        block, tables={k: table for k, table in block.tables.items() if k not in DRAWN_BY_THE_PAGE}
    )


def _page(surrogate: Surrogate, block: WeightsBlock) -> str:
    """Return the text of the file."""
    model = PageModel(touchable(surrogate))
    assert model.surface is not None
    traits = device_traits("page")
    place = model.body.workspace(traits.radius)
    hello = model.hello(_Settings(place.scale, place.radius, traits.max_force), RATE)
    modes = model.modes(0) if model.field_count else None
    sizes, numbers = _lists(model.surface, modes)
    parts = {
        "hello": hello.to_json().encode(),
        "sizes": json.dumps(sizes).encode(),
        "surface": numbers,
        "core": built_core("core.wasm"),
        "weights": _by_weight(block.to_bytes()),
    }
    card = card_of(surrogate).with_hash("weights", block.hash)
    return _document(surrogate.name, parts, card.to_json())


def _document(name: str, parts: dict[str, bytes], card: str) -> str:
    """Return the page's skeleton with style, script, parts and model card put into it."""
    skeleton = (STATIC / "index.html").read_text("utf-8")
    body = re.search(r"<body>.*</body>", skeleton, re.DOTALL)
    assert body is not None
    style = (STATIC / "assets" / "page.css").read_text("utf-8")
    script = (STATIC / "assets" / "file.js").read_text("utf-8").replace("</script", "<\\/script")
    packed = "\n".join(
        f'<script type="application/octet-stream" id="palpate-{key}">{_packed(part)}</script>'
        for key, part in parts.items()
    )
    icon = base64.b64encode((STATIC / "favicon.svg").read_bytes()).decode()
    return f"""<!doctype html>
<html lang="en" data-mode="touch" data-file>
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1, viewport-fit=cover">
<meta name="color-scheme" content="light dark">
<title>{html.escape(name)} · palpate</title>
<link rel="icon" type="image/svg+xml" href="data:image/svg+xml;base64,{icon}">
<style>{style}</style>
</head>
{body.group(0).replace("</body>", "")}
{packed}
<script type="application/json" id="palpate-card">{card.replace("<", chr(92) + "u003c")}</script>
<script>{script}</script>
</body>
</html>
"""


def _by_weight(data: bytes) -> bytes:
    """Return the bytes of equal weight of all words of eight bytes one after the other, which packs better."""
    return np.frombuffer(data, dtype=np.uint8).reshape(-1, 8).T.tobytes()


def _packed(data: bytes) -> str:
    return base64.b64encode(gzip.compress(data, compresslevel=9, mtime=0)).decode("ascii")


def _lists(surface: Surface, modes: Modes | None) -> tuple[dict[str, Any], bytes]:
    """Return the sizes of a surface and its field, and their lists as bytes, each to a multiple of eight.

    The order is that of ``file.ts``: rest, triangles, creases, which may be touched; then scales, rest and modes of the
    field as whole numbers of two bytes, and the points that its local mode moves.
    """
    points = np.asarray(surface.rest, dtype=np.float64).reshape(-1, 3)
    lists = [
        points.astype("<f4"),
        np.asarray(surface.triangles).astype("<u4"),
        np.asarray(surface.creases).astype("<u4"),
        np.asarray(surface.touchable).astype("u1"),
    ]
    sizes = {
        "points": len(points),
        "triangles": lists[1].size // 3,
        "creases": lists[2].size // 2,
        "modes": -1,
        "reach": 0.0,
        "rows": 0,
        "touched": 0,
    }
    if modes is not None:
        rows = np.vstack([np.ravel(modes.rest), np.reshape(modes.modes, (-1, np.size(modes.rest)))])
        scales = np.maximum(np.abs(rows).max(axis=1), 1e-300) / LARGEST
        small = [np.round(row / scale).astype("<i2") for row, scale in zip(rows, scales, strict=True)]
        lists += [scales.astype("<f8"), *small, np.asarray(modes.touched).astype("<u4")]
        sizes |= {"modes": len(rows) - 1, "reach": modes.reach, "rows": modes.rows, "touched": lists[-1].size}
    return sizes, b"".join(part.tobytes() + bytes(-part.nbytes % 8) for part in lists)
