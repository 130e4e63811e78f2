"""glTF 2.0: a deforming surface as one binary file (GLB) that every viewer, browser and office program shows.

Each step of a stroke is a *morph target*: what it adds to the positions and to the normals at rest. An animation of the
targets' weights plays the stroke, evenly between the steps. Lengths are in m, and y is up, as the format asks:
(x, y, z) of palpate becomes (x, z, −y). The specification is Khronos Group (2021), glTF 2.0, ISO/IEC 12113:2022.
"""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.files import write_file
from palpate.output_files import require_outputs
from palpate.surrogates.fields.surface_interpolation import node_normals

__all__ = ["MOST_TARGETS", "ShapeSeries", "glb_bytes", "write_glb"]

MOST_TARGETS = 8  # morph targets, as many as the weakest viewers show
_FLOAT, _UNSIGNED = 5126, 5125  # component types of glTF
_VERTICES, _INDICES = 34962, 34963  # targets of a buffer view in glTF
_MAGIC, _JSON, _BINARY = 0x46546C67, 0x4E4F534A, 0x004E4942
_COLOUR = (0.80, 0.45, 0.40, 1.0)


@dataclass(frozen=True, eq=False)
class ShapeSeries:
    """A surface, or a line of nodes, in several states."""

    points: np.ndarray  # (P, 3), nodes at rest in m, z up
    cells: np.ndarray  # int (T, 3) triangles, counter-clockwise seen from outside, or (T, 2) pieces of a line
    displacement: np.ndarray  # (k, P, 3), of the nodes in each state, m
    values: np.ndarray  # (k,), time in s, or load, of each state, ascending
    name: str = "body"
    fields: dict[str, np.ndarray] = field(default_factory=dict)  # further fields (k, P), for VTU
    colours: np.ndarray | None = None  # (k, P, 3), of the nodes in each state, linear; none for one colour

    def __post_init__(self) -> None:
        points, states = np.asarray(self.points, dtype=float), np.asarray(self.displacement, dtype=float)
        cells = np.asarray(self.cells, dtype=np.int64)
        good = (
            points.ndim == 2
            and points.shape[1] == 3
            and states.ndim == 3
            and states.shape[1:] == points.shape
        )
        if not good or len(states) != len(self.values) or not len(states) or not np.isfinite(states).all():
            raise UsageError(
                f"Points {points.shape} and displacements {states.shape} with {len(self.values)} values are no series.",
                why="There are points (P, 3), finite displacements (k, P, 3) and k values.",
                fix="Leave out states that did not converge.",
            )
        if cells.ndim != 2 or cells.shape[1] not in {2, 3} or (cells.size and cells.max() >= len(points)):
            raise UsageError(
                f"The cells {cells.shape} are no triangles or pieces of a line of {len(points)} points.",
                why="A row of cells has the numbers of 3 or of 2 points, counted from 0.",
                fix="Split other faces into triangles, and check that the cells belong to these points.",
            )
        for name, value in (("points", points), ("displacement", states), ("cells", cells)):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "values", np.asarray(self.values, dtype=float))

    def thin(self, most: int) -> ShapeSeries:
        """Return the series with at most so many states, the first and the last among them."""
        kept = np.unique(
            np.linspace(0, len(self.values) - 1, min(most, len(self.values))).round().astype(int)
        )
        fields = {name: values[kept] for name, values in self.fields.items()}
        colours = None if self.colours is None else self.colours[kept]
        return ShapeSeries(
            self.points, self.cells, self.displacement[kept], self.values[kept], self.name, fields, colours
        )

    def from_first(self) -> ShapeSeries:
        """Return the series that begins at its first state in place of rest; one of a single state stays as it is."""
        if len(self.values) < 2:
            return self
        first = self.displacement[0]
        return replace(self, points=self.points + first, displacement=self.displacement - first)


def write_glb(
    series: ShapeSeries,
    path: str | os.PathLike[str],
    *,
    targets: int = MOST_TARGETS,
    seconds: float = 2.0,
    card: dict[str, Any] | None = None,
    overwrite: bool = False,
) -> Path:
    """Write a series of shapes as a ``.glb`` file and return its path.

    At most `targets` states become morph targets; a longer series is thinned, since some viewers show no more than
    eight. The stroke to the last state takes `seconds` and comes back. `card` is a model card for the file's `extras`.
    `overwrite` replaces files whatever they are; by default those alone that an earlier export wrote.
    """
    require_outputs([path], endings=(".glb",), overwrite=overwrite)
    return write_file(path, glb_bytes(series, targets=targets, seconds=seconds, card=card))


def glb_bytes(
    series: ShapeSeries,
    *,
    targets: int = MOST_TARGETS,
    seconds: float = 2.0,
    card: dict[str, Any] | None = None,
) -> bytes:
    """Return the bytes of a GLB file; the parameters are those of `write_glb`."""
    if targets < 1 or not seconds > 0:
        raise UsageError(
            f"{targets} targets over {seconds:g} s make no stroke.", fix="Give 1 or more, over 2 s."
        )
    series = series.thin(targets)
    buffer = _Buffer()
    rest, moved = _turn_upright(series.points), _turn_upright(series.displacement)
    surface = series.cells.shape[1] == 3
    attributes = {"POSITION": buffer.add(rest, "VEC3", _VERTICES, ends=True)}
    shapes = [{"POSITION": buffer.add(move, "VEC3", _VERTICES, ends=True)} for move in moved]
    if surface:
        normals = _normals(rest, series.cells)
        attributes["NORMAL"] = buffer.add(normals, "VEC3", _VERTICES)
        for shape, move in zip(shapes, moved, strict=True):
            shape["NORMAL"] = buffer.add(_normals(rest + move, series.cells) - normals, "VEC3", _VERTICES)
    if series.colours is not None:
        base = series.colours[0]
        attributes["COLOR_0"] = buffer.add(base, "VEC3", _VERTICES)
        for shape, colours in zip(shapes, series.colours, strict=True):
            shape["COLOR_0"] = buffer.add(colours - base, "VEC3", _VERTICES)
    primitive = {
        "attributes": attributes,
        "indices": buffer.add(series.cells.ravel(), "SCALAR", _INDICES),
        "mode": 4 if surface else 1,
        "material": 0,
        "targets": shapes,
    }
    times, weights = _keyframes(len(moved), seconds)
    sampler = {
        "input": buffer.add(times, "SCALAR", None, ends=True),
        "output": buffer.add(weights.ravel(), "SCALAR", None),
        "interpolation": "LINEAR",
    }
    scene = _scene(series, primitive, sampler)
    scene |= {
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    if card:
        scene["extras"] = {"model card": card}
    return _packed(scene, bytes(buffer.data))


def _scene(series: ShapeSeries, primitive: dict[str, Any], sampler: dict[str, Any]) -> dict[str, Any]:
    """Return the scene: one node with one mesh, whose weights one animation moves."""
    mesh = {
        "name": series.name,
        "primitives": [primitive],
        "weights": [0.0] * len(series.values),
        "extras": {"targetNames": [f"{value:.6g}" for value in series.values]},
    }
    colour = _COLOUR if series.colours is None else (1.0, 1.0, 1.0, 1.0)
    look = {"baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": 0.7}
    channel = {"sampler": 0, "target": {"node": 0, "path": "weights"}}
    return {
        "asset": {"version": "2.0", "generator": "palpate"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": series.name}],
        "meshes": [mesh],
        "materials": [{"pbrMetallicRoughness": look, "doubleSided": True}],
        "animations": [{"name": "stroke", "samplers": [sampler], "channels": [channel]}],
    }


def _turn_upright(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (..., 3) with y up: (x, z, −y)."""
    return np.stack([vectors[..., 0], vectors[..., 2], -vectors[..., 1]], axis=-1)


def _normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return unit normals (P, 3) at the nodes, weighted by area; up where no triangle is."""
    normals = node_normals(points, triangles)
    normals[~normals.any(axis=1)] = [0.0, 1.0, 0.0]
    return normals


def _keyframes(count: int, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times (2k + 1,) and weights (2k + 1, k): from rest over the states to the last one, and back."""
    there = np.vstack([np.zeros(count), np.eye(count)])
    weights = np.vstack([there, there[-2::-1]])
    return np.linspace(0.0, seconds, len(weights)), weights


class _Buffer:
    """The binary part, and how the scene finds its way in it."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, values: np.ndarray, kind: str, purpose: int | None, *, ends: bool = False) -> int:
        """Append an array and return the number of its accessor; `ends` states least and largest values."""
        whole = values.dtype.kind in "iu"
        stored = np.ascontiguousarray(values, dtype="<u4" if whole else "<f4")
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": stored.nbytes}
        self.views.append(view if purpose is None else {**view, "target": purpose})
        accessor: dict[str, Any] = {
            "bufferView": len(self.views) - 1,
            "componentType": _UNSIGNED if whole else _FLOAT,
            "count": len(stored),
            "type": kind,
        }
        if ends:
            rows = stored.reshape(len(stored), -1)
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.accessors.append(accessor)
        self.data += stored.tobytes()
        return len(self.accessors) - 1


def _packed(scene: dict[str, Any], binary: bytes) -> bytes:
    """Return the file: its head, the scene as JSON, the binary part; each in multiples of four bytes."""
    text = json.dumps(scene, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    parts: Sequence[tuple[int, bytes]] = ((_JSON, text), (_BINARY, binary))
    body = b"".join(struct.pack("<II", len(part), kind) + part for kind, part in parts)
    return struct.pack("<III", _MAGIC, 2, 12 + len(body)) + body
