"""The page of a surrogate that no hand feels: sliders for its inputs, its numbers, fields and curves.

The page's script computes everything by itself, in double precision: networks, their deviations, the trained region and
the sums over modes. Of a field the drawn part alone goes out, in single precision.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.surrogates import AxisPlaces, LearntQuantities, MeshPlaces, ModalField, Surrogate
from palpate.surrogates.model_card import card_of
from palpate.units import bounds
from palpate.viewer.about_record import about_record
from palpate.viewer.answer_arrays import ArrayBlock, quantities_facts
from palpate.viewer.file_document import pack, page_document, page_statics, with_parts
from palpate.viewer.surfaces import split
from palpate.viewer.web_server import skeleton

__all__ = ["LARGEST", "AnswerPage"]

LARGEST = 5_000_000  # bytes of a file, beyond which no further field is added
_SAMPLES = 64  # places in the trained ranges by which the ends of a colour scale are set


@dataclass(frozen=True, eq=False)
class AnswerPage:
    """A page's parts, and what had no room in it."""

    name: str
    parts: dict[str, str]
    card: str
    hash: str
    left_out: tuple[str, ...]

    @classmethod
    def of(cls, surrogate: Surrogate, name: str = "") -> AnswerPage:
        """Return the page of a surrogate without an energy, with as many of its fields as it has room for.

        `name` is its title where its own record has none.
        """
        name = str(surrogate.meta.get("name", "")) or name or surrogate.name
        main = ArrayBlock("answers-main")
        groups = [quantities_facts(group, main) for group in surrogate.quantities.values()]
        low, high = bounds(surrogate.inputs)
        facts: dict[str, Any] = {
            "name": name,
            "purpose": surrogate.purpose,
            "inputs": [
                {"name": r.name, "unit": r.unit, "low": r.low, "high": r.high} for r in surrogate.inputs
            ],
            "groups": groups,
            "solves": _solves(surrogate, main),
        }
        modal = surrogate.modal_fields.values()
        facts["curves"] = [_curve_facts(f, f.axis, main) for f in modal if f.axis is not None]
        parts: dict[str, str] = {}
        room = LARGEST - sum(map(len, page_statics())) - len(pack(main.to_bytes()))
        drawn: list[dict[str, Any]] = []
        left_out, meshes = [], _Meshes()
        X = np.random.default_rng(0).uniform(low, high, (_SAMPLES, len(low)))
        for shown in modal:
            if shown.mesh is None:
                continue
            block = ArrayBlock(f"answers-{len(drawn)}")
            made = _field_facts(shown, shown.mesh, block, meshes, X)
            text = "" if made is None else pack(block.to_bytes())
            if made is None or len(text) > room:
                left_out.append(shown.name)
                continue
            room -= len(text)
            drawn.append(made)
            meshes.drawn[made["mesh"], made["kind"]] = made["drawing"]
            parts[block.name] = text
        card = card_of(surrogate)
        words = card.in_words()
        about = {key: words[key] for key in words if key not in {"trained on", "errors"}}
        missing = {"fields that are not on this page": ", ".join(left_out)} if left_out else {}
        facts |= {"fields": drawn, "meta": about_record(surrogate.meta) | about_record(about) | missing}
        data = main.to_bytes()
        digest = hashlib.sha256(data).hexdigest()
        parts |= {main.name: pack(data), "answers": pack(json.dumps(facts).encode())}
        return cls(name, parts, card.to_json(), digest, tuple(left_out))

    def document(self) -> str:
        """Return the page as one HTML file."""
        return page_document(self.name, self.parts, self.card, mode="answers")

    def served(self) -> str:
        """Return the page as a server sends it, which has script and style beside it."""
        text = skeleton("answers")
        return text.replace("</body>", f"{with_parts(self.parts, self.card)}</body>")


class _Meshes:
    """Numbers of meshes: fields on the same nodes and triangles are drawn on one."""

    def __init__(self) -> None:
        self._numbers: dict[bytes, int] = {}
        self.drawn: dict[tuple[int, str], dict[str, Any]] = {}  # facts of what stands in the page already

    def number(self, places: MeshPlaces) -> int:
        """Return the number of a mesh."""
        key = hashlib.sha256(places.points.tobytes() + places.triangles.tobytes()).digest()
        return self._numbers.setdefault(key, len(self._numbers))


def _modes(shown: ModalField, rows: np.ndarray, block: ArrayBlock) -> dict[str, Any]:
    """Return the facts of a field or a curve at some of its places."""
    return {
        "name": shown.name,
        "unit": shown.unit,
        "components": list(shown.components),
        "coefficients": quantities_facts(shown.coefficients, block),
        "mean": block.add(shown.mean[rows], "f4"),
        "modes": block.add(shown.modes[:, rows], "f4"),
        "scatter": block.add(shown.scatter[rows], "f4"),
        "widening": None if np.isnan(shown.widening) else shown.widening,
        "solved": None if shown.solved is None else block.add(shown.solved),
    }


def _curve_facts(shown: ModalField, axis: AxisPlaces, block: ArrayBlock) -> dict[str, Any]:
    """Return the facts of a curve."""
    facts = _modes(shown, np.arange(len(axis)), block)
    return facts | {"axis": {"name": axis.name, "unit": axis.unit, "values": axis.values.tolist()}}


def _field_facts(
    shown: ModalField, places: MeshPlaces, block: ArrayBlock, meshes: _Meshes, X: np.ndarray
) -> dict[str, Any] | None:
    """Return the facts of a field on a mesh; None for one without a surface to draw."""
    if not places.is_surface:
        return None
    nodes = np.unique(places.triangles)
    rows = nodes if places.kind == "nodes" else np.unique(places.cell_of)
    mesh, values = meshes.number(places), shown.values(X)[:, rows]
    drawing = meshes.drawn.get((mesh, places.kind))
    return _modes(shown, rows, block) | {
        "mesh": mesh,
        "kind": places.kind,
        "drawing": _drawing(places, nodes, rows, block) if drawing is None else drawing,
        "scales": list(_scales(shown, values)),
        "moves": places.kind == "nodes" and shown.unit == "m" and values.shape[2] in {2, 3},
    }


def _drawing(places: MeshPlaces, nodes: np.ndarray, rows: np.ndarray, block: ArrayBlock) -> dict[str, Any]:
    """Return the surface that is drawn: of each of its points the row of the field, and that of the nodes."""
    patches = split(places.points, places.triangles, np.zeros(len(places.triangles), bool))
    if places.kind == "nodes":
        rest, triangles, creases = places.points[patches.nodes], patches.triangles, patches.creases
        source = moved = np.searchsorted(nodes, patches.nodes)
    else:
        # each triangle has corners of its own, all of the colour of its cell
        rest, triangles = places.points[places.triangles].reshape(-1, 3), np.arange(places.triangles.size)
        _, first = np.unique(patches.triangles.ravel(), return_index=True)
        creases = first[patches.creases]
        source = np.repeat(np.searchsorted(rows, places.cell_of), 3)
        moved = np.searchsorted(nodes, places.triangles.ravel())
    return {
        "rest": block.add(rest, "f4"),
        "triangles": block.add(triangles, "i4"),
        "creases": block.add(creases, "i4"),
        "source": block.add(source, "i4"),
        "moved": block.add(moved, "i4"),
    }


def _scales(shown: ModalField, values: np.ndarray) -> Iterator[dict[str, Any]]:
    """Yield the colour scales of a field: of a vector that of its size, then those of its components."""
    columns = [(name, k, values[..., k]) for k, name in enumerate(shown.components)]
    if len(columns) < 2:
        scales = [(shown.name, 0, values[..., 0])]
    else:
        size = np.linalg.norm(values, axis=2)
        scales = [(shown.name, -1, size), *((f"{shown.name} {name}", k, v) for name, k, v in columns)]
    for name, component, some in scales:
        low, high = float(some.min()), float(some.max())
        low = 0.0 if component < 0 else low
        yield {
            "name": name,
            "component": component,
            "low": low,
            "high": high if high > low else low + (abs(low) or 1.0),
        }


def _solves(surrogate: Surrogate, block: ArrayBlock) -> dict[str, Any] | None:
    """Return the inputs (N, n) of the solves that were learnt from, where a part holds them."""
    for shown in surrogate.modal_fields.values():
        if shown.solved_at is not None:
            return block.add(shown.solved_at, "f8")
    parts: list[LearntQuantities] = list(surrogate.quantities.values())
    parts += [f.coefficients for f in surrogate.modal_fields.values()]
    for part in parts:
        if part.region is not None:
            return block.add(part.network.scaling.unscale_inputs(part.region.points), "f8")
    return None
