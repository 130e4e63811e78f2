"""A learnt body as one HTML file that works from disk: no server, no network, nothing else beside it.

The page's own script, in one piece, asks the evaluator core as WebAssembly in place of the server. Everything that it
needs is in the file, packed by gzip: the core, the weights, the surface, the modes of the fields (`packed_surface`),
and what the page is told first.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from palpate.devices import device_traits
from palpate.export.build_core import built_core
from palpate.export.check_points import Comparison, ExportedFile, compare_body, compare_field, compare_rest
from palpate.export.field_tables import PROMISE, SURFACE, field_tables
from palpate.export.wasm_core import WasmCore, wasmtime_module
from palpate.export.weights_block import FIELD, WeightsBlock
from palpate.files import write_file
from palpate.output_files import require_outputs, with_seal
from palpate.runtime.touchable import touchable
from palpate.surrogates import FieldSurrogate, NodeField, Surrogate
from palpate.surrogates.fields import surface_fields
from palpate.surrogates.model_card import ModelCard, card_of
from palpate.viewer.about_record import about_record
from palpate.viewer.answer_check import compare_page
from palpate.viewer.answer_page import AnswerPage
from palpate.viewer.file_document import pack, page_document, page_statics, shuffle_words
from palpate.viewer.file_line import compare_line, line_facts
from palpate.viewer.messages import Hello, Modes
from palpate.viewer.packed_surface import PackedSurface, rounded_points
from palpate.viewer.page_model import PageModel
from palpate.viewer.surface_drawing import SurfaceDrawing

__all__ = ["ExportedPage", "export_html", "html_page"]

# modes and moving nodes: the page sums the shape up itself
DRAWN_BY_THE_PAGE = (FIELD + 4, FIELD + 6, FIELD + 7)
LARGEST = 5_000_000  # bytes of a file, beyond which no further field is added
DEEP = 2.0  # depth at which the body lets go, over the deepest trained depth
RATE = 60.0  # Hz, rate of the pictures
_REPORT = "Nothing was written. Report this with the model file."
_MARGIN = 20_000  # bytes for facts, card and the document around the parts
MOVED = 0.1  # share of a field's promise, by which rounding a place may move it
FINEST = 2**-28  # least step of places over the body's size; without a field it is 2**-19


class _Settings(NamedTuple):
    scale: float
    radius: float
    max_force: float


@dataclass(frozen=True)
class ExportedPage(ExportedFile):
    """A page that was written, and how far it is from palpate."""

    left_out: tuple[str, ...] = ()  # fields too large for 5 MB, or on other nodes than the first


def export_html(
    surrogate: Surrogate, path: str | os.PathLike[str], *, check: bool = True, overwrite: bool = False
) -> ExportedPage:
    """Write a learnt body as NAME.html, and compare what it answers with palpate if wasmtime is installed.

    A probe presses the body, a pad holds it, or a hand holds a node of a line; a surrogate that can't be touched has
    sliders, and its page computes without the core: there the parts of the page are read back and asked. Where they do
    not answer as palpate does, nothing is written. `overwrite` replaces files whatever they are; by default those alone
    that an earlier export wrote.
    """
    require_outputs([path], endings=(".html", ".htm"), overwrite=overwrite)
    if not surrogate.can_be_touched:
        answers = AnswerPage.of(surrogate, Path(path).stem.removesuffix("-page"))
        comparison = compare_page(surrogate, answers.parts) if check else None
        if comparison is not None:
            comparison.require(f"The page of {surrogate.name} does", why="", fix=_REPORT)
        file = write_file(Path(path), with_seal(path, answers.document()))
        return ExportedPage(file, answers.hash, comparison, answers.left_out)
    page = _Page.of(surrogate)
    comparison = page.compare() if check and wasmtime_module() is not None else None
    if comparison is not None:
        comparison.require(f"The page of {surrogate.name} does", why="", fix=_REPORT)
    file = write_file(Path(path), with_seal(path, page.text))
    return ExportedPage(file, page.block.hash, comparison, page.left_out)


def html_page(surrogate: Surrogate) -> str:
    """Return a learnt body as one HTML file; one with a part without C source has none."""
    return _Page.of(surrogate).text if surrogate.can_be_touched else AnswerPage.of(surrogate).document()


@dataclass(frozen=True, eq=False)
class _PageField:
    """A field of a page, as it is (`shown`) and as the page holds it (`rounded`)."""

    shown: FieldSurrogate
    rounded: FieldSurrogate
    block: WeightsBlock  # its weights without modes; of the first field those of the body, too
    facts: dict[str, Any]  # what the numbers of its modes mean
    weights: str  # the block as it stands in the file
    modes: str  # the modes as they stand in the file


@dataclass(frozen=True, eq=False)
class _Page:
    """A page's text, and what is compared with palpate."""

    surrogate: Surrogate
    block: WeightsBlock
    fields: tuple[_PageField, ...]
    left_out: tuple[str, ...]
    text: str
    nodes: WeightsBlock | None = None  # the network of a line's nodes

    @classmethod
    def of(cls, surrogate: Surrogate) -> _Page:
        """Return the page of a body with as many of its fields as it has room for."""
        surrogate, outline = _shallow(surrogate), _outline(surrogate)
        known, surrogate = [field.name for field in surrogate.fields.values()], _exported(surrogate)
        model = PageModel(touchable(surrogate), outline=outline)
        traits = device_traits("page")
        place = model.body.workspace(traits.radius)
        most = min(traits.max_force, model.body.meta.get("runtime", {}).get("max_force", math.inf))
        hello = model.hello(_Settings(place.scale, place.radius, most), RATE)
        # the friction of a file is that of its weights
        hello = replace(hello, parameters=hello.parameters[: len(surrogate.parameters)])
        if model.body.line is not None:
            return cls._of_line(surrogate, model.body.line, hello)
        assert model.surface is not None
        # what carries the body's own surface, where there is one
        coarse = SurfaceDrawing(model.body, detail=False, outline=outline)
        step = _step(np.asarray(model.surface.rest), hello)
        surface = PackedSurface.of(coarse.surface, step)
        drawn, own_parts = _pack_own_surface(model, surface, step)
        keys = {field.name: key for key, field in surrogate.fields.items()}
        names = [info.name for info in hello.fields]
        block = WeightsBlock.of(surrogate, field=keys[names[0]] if names else None)
        bare = _without_modes(block)
        parts = {
            "surface": pack(surface.data),
            "core": pack(built_core("core.wasm")),
            "weights-0": pack(shuffle_words(bare.to_bytes())),
            **own_parts,
        }
        room = LARGEST - sum(map(len, parts.values())) - sum(len(text) for text in page_statics())
        chosen = [keys[name] for name in names]
        fields = list(_fields_with_room(surrogate, chosen, block, coarse, surface, room))
        kept = {field.shown.name for field in fields}
        left_out = tuple(name for name in known if name not in kept)
        card = card_of(surrogate).with_hash(f"{bare.label}, of a page", bare.hash)
        missing = {"fields that are not in this file": ", ".join(left_out)} if left_out else {}
        hello = replace(hello, fields=tuple(info for info in hello.fields if info.name in kept))
        hello = replace(hello, meta=_meta(surrogate, card) | missing)
        for i, field in enumerate(fields):
            parts[f"field-{i}"] = field.modes
            if i > 0:
                parts[f"weights-{i}"] = field.weights
        facts = {
            "places": _places(model),
            "surface": surface.facts,
            "drawn": drawn,
            "fields": [field.facts for field in fields],
            "line": None,
        }
        parts |= {"hello": pack(hello.to_json().encode()), "facts": pack(json.dumps(facts).encode())}
        text = page_document(surrogate.name, parts, card.to_json())
        return cls(surrogate, bare, tuple(fields), left_out, text)

    @classmethod
    def _of_line(cls, surrogate: Surrogate, line: NodeField, hello: Hello) -> _Page:
        """Return the page of a body that is drawn as a line: the network of its nodes in place of a surface."""
        block = WeightsBlock.of(surrogate)
        card = card_of(surrogate).with_hash(f"{block.label}, of a page", block.hash)
        nodes = WeightsBlock.of_network(line.network)
        facts: dict[str, Any] = {
            "places": None,
            "surface": None,
            "drawn": None,
            "fields": [],
            "line": line_facts(line, surrogate),
        }
        hello = replace(hello, meta=_meta(surrogate, card))
        parts = {
            "core": pack(built_core("core.wasm")),
            "weights-0": pack(shuffle_words(block.to_bytes())),
            "line": pack(shuffle_words(nodes.to_bytes())),
            "hello": pack(hello.to_json().encode()),
            "facts": pack(json.dumps(facts).encode()),
        }
        text = page_document(surrogate.name, parts, card.to_json())
        return cls(surrogate, block, (), (), text, nodes)

    def compare(self) -> Comparison:
        """Return how far the core is from palpate, with the fields as the page sums them up."""
        if self.nodes is not None:
            core = WasmCore.of(self.block, network=self.nodes)
            whole = compare_body(self.surrogate, core)
            parts = {**whole.parts, "line": compare_line(self.surrogate, core)}
            if touchable(self.surrogate).stays:
                parts["rest"] = compare_rest(self.surrogate, core)
            return replace(whole, parts=parts)
        rounded, further = (
            [field.rounded for field in self.fields],
            [field.block for field in self.fields[1:]],
        )
        core = WasmCore.of(self.block, rounded, further)
        whole = compare_body(self.surrogate, core)
        parts = {
            f"field {field.shown.name}": compare_field(self.surrogate, field.shown, core.show(i))
            for i, field in enumerate(self.fields)
        }
        return replace(whole, parts={**whole.parts, **parts})


def _meta(surrogate: Surrogate, card: ModelCard) -> dict[str, Any]:
    """Return the record of a body and its card as the page shows them."""
    return about_record(surrogate.meta) | about_record(_card_in_words(card))


def _shallow(surrogate: Surrogate) -> Surrogate:
    """Return the same body, which lets go of a probe about twice as deep as trained: its surface takes less room."""
    baseline, deepest = surrogate.hand_energy.baseline, touchable(surrogate).deepest
    surface = baseline.surface
    if surface is None:
        return surrogate
    inner = max(DEEP * deepest - surface.radius, 2 * surface.spacing)
    if inner >= surface.inner:
        return surrogate
    nearer = baseline.with_surface(replace(surface, inner=inner))
    return surrogate.with_energy(replace(surrogate.hand_energy, baseline=nearer))


def _exported(surrogate: Surrogate) -> Surrogate:
    """Return the body with the fields that the evaluator core knows, none under a tool that turns."""
    fields = {
        key: field for key, field in surrogate.fields.items() if getattr(field, "contact", None) is None
    }
    return surrogate if len(fields) == len(surrogate.fields) else replace(surrogate, fields=fields)


def _outline(surrogate: Surrogate) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the surface at rest (points, triangles) of a body between two jaws, whose fields a page does not hold."""
    fields = list(surface_fields(surrogate.fields).values())
    return fields[0].pictured if fields and touchable(surrogate).gripper is not None else None


def _places(model: PageModel) -> dict[str, Any] | None:
    """Return where the body keeps indentations that the page draws; None where there are none."""
    memory = model.body.indentation
    if memory is None or model.surface is None or not len(model.surface.yielding):
        return None
    return {"points": memory.points.tolist(), "width": float(memory.width)}


def _step(rest: np.ndarray, hello: Hello) -> float:
    """Return the step of the points' coordinates, m, so that a field is moved by little of what it may be off."""
    points = rest.reshape(-1, 3)
    size = float(np.ptp(points, axis=0).max())
    moves = bool(hello.fields) and hello.fields[0].components == 3
    wanted = 2.0 * MOVED * PROMISE * hello.fields[0].high if moves else size * 2**-19
    return max(wanted, size * FINEST)


def _fields_with_room(
    surrogate: Surrogate,
    keys: Sequence[str],
    block: WeightsBlock,
    coarse: SurfaceDrawing,
    surface: PackedSurface,
    room: int,
) -> Iterator[_PageField]:
    """Yield the first field, which the body's block holds, and those after it for which `room` (bytes) is left."""
    for index, key in enumerate(keys):
        own = block if index == 0 else _block_of_field(surrogate, key, block)
        further = _page_field(surrogate.fields[key], own, coarse.modes(index), surface)
        size = len(further.modes) + len(further.weights) * (index > 0)
        if index == 0 or size <= room - _MARGIN:
            yield further
            room -= size


def _block_of_field(surrogate: Surrogate, name: str, block: WeightsBlock) -> WeightsBlock:
    """Return the arrays of one more field of a body; its surface is in the body's own block."""
    tables = field_tables(surrogate, name, block.tables)
    return WeightsBlock({k: v for k, v in tables.items() if not SURFACE <= k < SURFACE + 3}, field=name)


def _pack_own_surface(
    model: PageModel, carrier: PackedSurface, step: float
) -> tuple[dict[str, Any] | None, dict[str, str]]:
    """Return the facts and parts of the body's own surface and of its binding; none where the field's is drawn."""
    drawing = model.drawing
    own = drawing.fields[0].drawn if drawing.fields else None
    if own is None:
        return None, {}
    surface = PackedSurface.of(drawing.surface, step)
    facts, data = surface.binding(own, carrier, drawing.nodes)
    return {"surface": surface.facts, "binding": facts}, {
        "drawn": pack(surface.data),
        "binding": pack(data),
    }


def _page_field(shown: Any, block: WeightsBlock, modes: Modes, surface: PackedSurface) -> _PageField:
    """Return a field of the page from the block with its modes."""
    scales, small = block.tables[FIELD + 3].values, block.tables[FIELD + 4].values
    facts, data = surface.field(modes, scales)
    rows = (small.reshape(len(scales), -1) * scales[:, None]).reshape(len(scales), *shown.rest.shape)
    points = rounded_points(shown.points, surface.facts["step"])
    rounded = replace(shown, rest=rows[0], modes=rows[1:], points=points)
    bare = _without_modes(block)
    return _PageField(shown, rounded, bare, facts, pack(shuffle_words(bare.to_bytes())), pack(data))


def _without_modes(block: WeightsBlock) -> WeightsBlock:
    """Return a block without what the page draws with."""
    tables = {k: table for k, table in block.tables.items() if k not in DRAWN_BY_THE_PAGE}
    return replace(block, tables=tables)


def _card_in_words(card: ModelCard) -> dict[str, Any]:
    """Return what a model card says beside the record of the body's making."""
    words = card.in_words()
    return {name: words[name] for name in words if name not in {"trained on", "errors"}}
