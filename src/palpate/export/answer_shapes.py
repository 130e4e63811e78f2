"""Shapes of a surrogate without touch: its body at some inputs, coloured by a field and moved by a displacement."""

from __future__ import annotations

import numpy as np

from palpate.errors import UsageError
from palpate.export.gltf import ShapeSeries
from palpate.surrogates import MeshPlaces, ModalField, Surrogate

__all__ = ["series_of_answers"]

# viridis (van der Walt & Smith 2015, CC0) in nine steps, sRGB, from bright to dark as on the page
_VIRIDIS = ("fde725", "addc30", "5ec962", "28ae80", "21918c", "2c728e", "3b528b", "472d7b", "440154")


def series_of_answers(surrogate: Surrogate, X: np.ndarray, field: str | None = None) -> ShapeSeries:
    """Return the body at inputs X (k, n), numbered from 1, coloured by a field; by default by the first one drawn.

    Of a vector its size colours. A displacement on the same mesh moves the nodes. A UsageError names what can't be
    drawn.
    """
    drawn = {
        name: shown
        for name, shown in surrogate.modal_fields.items()
        if shown.mesh is not None and shown.mesh.is_surface
    }
    if not drawn or (field is not None and field not in drawn):
        raise UsageError(
            f"{surrogate.name!r} has no {'surface' if field is None else f'field {field!r}'} to draw.",
            why=f"On a surface it has: {', '.join(drawn) or 'nothing'}.",
            fix="Choose one of these, or take its numbers and curves with `palpate ask FILE --table …`.",
        )
    shown = drawn[field or next(iter(drawn))]
    assert shown.mesh is not None
    places = shown.mesh
    points, triangles, values = places.points, places.triangles, np.linalg.norm(shown.values(X), axis=2)
    if max(1, len(shown.components)) == 1:
        values = shown.values(X)[..., 0]
    nodes = np.arange(len(points))
    if places.kind == "cells":
        # each triangle has corners of its own, all of the colour of its cell
        nodes, triangles = triangles.ravel(), np.arange(triangles.size).reshape(-1, 3)
        values = values[:, np.repeat(places.cell_of, 3)]
    moved = np.zeros((len(X), len(points), 3))
    for other in drawn.values():
        if _moves(other, places):
            u = other.values(X)
            moved[..., : u.shape[2]] = u
            break
    order = np.arange(1.0, len(X) + 1)
    label = f"{shown.name} ({shown.unit})" if shown.unit else shown.name
    return ShapeSeries(
        points[nodes],
        triangles,
        moved[:, nodes],
        order,
        surrogate.name,
        {label: values},
        colours=_linear_colours(values),
    )


def _moves(shown: ModalField, places: MeshPlaces) -> bool:
    """Return whether a field is a displacement of the nodes of a mesh."""
    own = shown.mesh
    return (
        own is not None
        and own.kind == "nodes"
        and shown.unit == "m"
        and len(shown.components) in {2, 3}
        and np.array_equal(own.points, places.points)
    )


def _linear_colours(values: np.ndarray) -> np.ndarray:
    """Return colours (k, P, 3) of values (k, P) between their least and largest, linear as glTF takes them."""
    table = np.array([[int(code[i : i + 2], 16) / 255.0 for i in (0, 2, 4)] for code in _VIRIDIS])
    low, high = float(values.min()), float(values.max())
    at = (values - low) / (high - low or 1.0) * (len(table) - 1)
    srgb = np.stack([np.interp(at, np.arange(len(table)), table[:, c]) for c in range(3)], axis=-1)
    # IEC 61966-2-1
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
