"""Nodes, surface and loads of an imported body, in the axes that the mapping chose."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from palpate.dataset.readers.column_choice import index_of_place, places_in_metres
from palpate.dataset.readers.mapping import ImportMapping, Load, Nodes
from palpate.dataset.readers.result_units import values_in_si
from palpate.dataset.readers.results import Places, Results
from palpate.dataset.schema import Layout
from palpate.errors import UsageError
from palpate.format import count

__all__ = ["along_axes", "body_layout", "further_places"]

_REST = "surface"  # name of the triangles that belong to no surface of the mapping
_SAME = 1e-6  # distance over the body's size that is rounding of coordinates printed with six digits


def along_axes(results: Results, mapping: ImportMapping, values: np.ndarray) -> np.ndarray:
    """Return the components (case, node, k) of a displacement along the chosen axes."""
    chosen, every = _axes(results, mapping)
    if values.shape[-1] == len(chosen):
        return values
    if values.shape[-1] == len(every):
        return values[..., [every.index(axis) for axis in chosen]]
    raise UsageError(
        f"The displacement has {values.shape[-1]} components for {len(chosen)} coordinates.",
        why=f"Coordinates are {', '.join(chosen)}.",
        fix='Name one component for each: from = ["u", "v"].',
    )


def _axes(results: Results, mapping: ImportMapping) -> tuple[list[str], list[str]]:
    """Return the axes that the mapping chose, and all axes of the file."""
    nodal = next((p for p in results.places.values() if p.nodal and p.coordinates), None)
    every = [] if nodal is None else list(nodal.coordinates)
    chosen = list(mapping.coordinates or every)
    for axis in chosen:
        _index(axis, every, "`coordinates`")
    return chosen, every


def _index(axis: str, axes: Sequence[str], where: str) -> int:
    if axis in axes:
        return axes.index(axis)
    raise UsageError(
        f"The files have no coordinate {axis!r}, which {where} names.",
        why=f"Their coordinates are {', '.join(axes) or 'none'}.",
        fix="Correct the mapping.",
    )


def body_layout(
    results: Results,
    mapping: ImportMapping,
    nodes: str,
    answers: Mapping[str, np.ndarray],
    *,
    cells: bool = False,
) -> tuple[Layout, np.ndarray, list[str]]:
    """Return the layout of a body, the indices of the nodes that are kept, and sentences about the others.

    `nodes` names the nodes that fields belong to; empty where there are none: the body is then one point. `answers` are
    the fields (case, node, …) at these nodes; a node without a number in any case is left out. With `cells` the mesh is
    kept whole, for fields at its cells.
    """
    loads = [entry.load for entry in mapping.inputs if entry.load is not None]
    if cells and not nodes:
        nodes = next((name for name, places in results.places.items() if places.nodal), "")
    if not nodes:
        if loads:
            raise UsageError(
                "A load acts on a node, and no output is a field of nodes.", fix="Map a displacement."
            )
        nowhere = Layout(rest=np.zeros((1, 3)), of_interest=np.zeros(1, dtype=bool))
        return nowhere, np.zeros(1, dtype=int), []
    places = results.places[nodes]
    chosen, every = _axes(results, mapping)
    if not places.coordinates or len(chosen) not in {2, 3}:
        raise UsageError(
            f"The places {nodes!r} have {len(chosen) if places.coordinates else 'no'} coordinates.",
            why="A field needs the place of each node in the plane or in space.",
            fix="Import a file with coordinates too, such as the .frd beside a .dat, or single places by `at`.",
        )
    points = places_in_metres(results, places, mapping)
    kept, notes = _kept_nodes(places, points, answers, mapping.nodes or Nodes())
    rest = points[kept][:, [every.index(axis) for axis in chosen]]
    triangles, surface_of = None, None
    plane = len(chosen) == 2 and not loads and not mapping.interactions and not mapping.surfaces
    if places.triangles is not None and (len(chosen) == 3 or plane):
        triangles, surface_of = _surface(places, points, kept, mapping.surfaces)
    if loads and len(loads) < len(mapping.inputs):
        raise UsageError(
            "Some inputs are loads on nodes, others are not.", fix="Give every input a `load`, or none."
        )
    at, directions = _loads(loads, places.ids[kept], rest)
    layout = Layout(
        rest=rest,
        load_nodes=at,
        load_directions=directions,
        components=tuple(f"u_{axis}" for axis in "xyz"[: len(chosen)]),
        triangles=triangles,
        surfaces=() if triangles is None else (*mapping.surfaces, _REST),
        surface_of=surface_of,
        labels={},
    )
    return layout, kept, notes


def further_places(results: Results, mapping: ImportMapping, dims: Collection[str]) -> dict[str, Any]:
    """Return the cells and the axis that outputs with these dimensions have values at, as a `Layout` takes them."""
    more: dict[str, Any] = {}
    if mapping.axis and mapping.axis in dims:
        column = next(iter(results.places["axis"].coordinates.values()))
        values, unit = values_in_si(column, mapping.units)
        more["scales"] = {mapping.axis: (values, unit)}
    if "cell" in dims:
        if mapping.nodes is not None:
            raise UsageError(
                "Fields at cells are of the whole mesh.", fix="Leave `nodes` out of the mapping."
            )
        places = results.places["cells"]
        chosen, every = _axes(results, mapping)
        middles = places_in_metres(results, places, mapping)[:, [every.index(axis) for axis in chosen]]
        cell_of = np.zeros(0, np.int64) if places.cell_of is None else places.cell_of
        more["cells"] = middles, cell_of
    return more


def _kept_nodes(
    places: Places, points: np.ndarray, answers: Mapping[str, np.ndarray], wish: Nodes
) -> tuple[np.ndarray, list[str]]:
    """Return the indices of the nodes that are wanted and have answers, in their order, and notes."""
    axes, notes = list(places.coordinates), []
    kept = np.ones(len(points), dtype=bool)
    size = float(np.ptp(points, axis=0).max(initial=0.0))
    tolerance = _SAME * size if wish.tolerance is None else wish.tolerance
    for axis, value in wish.near.items():
        kept &= np.abs(points[:, _index(axis, axes, "`nodes`")] - value) <= tolerance
    if not kept.any():
        raise UsageError(
            "No node is where `nodes` wants them.",
            why=f"Within {tolerance:.3g} m of {', '.join(f'{k} = {v:g} m' for k, v in wish.near.items())}.",
            fix="Correct `near`, or give a larger `tolerance`.",
        )
    if not kept.all():
        notes.append(f"{int(kept.sum()):,} of {len(kept):,} nodes kept.")
    for name, values in answers.items():
        number = np.isfinite(values).reshape(*values.shape[:2], -1).all(axis=2).any(axis=0)
        if not (number & kept).any():
            raise UsageError(
                f"{name!r} is not a number at any node that is kept, in any case.",
                fix="Export it where the body is.",
            )
        if (kept & ~number).any():
            notes.append(f"Skipped {count(int((kept & ~number).sum()), 'node')} without {name} in any case.")
        kept &= number
    indices = np.flatnonzero(kept)
    if wish.sort is not None:
        along = points[indices, _index(wish.sort, axes, "`nodes`")]
        indices = indices[np.argsort(along, kind="stable")]
    return indices, notes


def _surface(
    places: Places, points: np.ndarray, kept: np.ndarray, surfaces: Mapping[str, Mapping[str, float]]
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Return the triangles whose nodes are all kept, and for each the number of its surface."""
    assert places.triangles is not None
    new = np.full(len(points), -1)
    new[kept] = np.arange(len(kept))
    triangles = places.triangles[(new[places.triangles] >= 0).all(axis=1)]
    if not len(triangles):
        return None, None
    surface_of = np.full(len(triangles), len(surfaces))
    tolerance = _SAME * float(np.ptp(points, axis=0).max())
    for number, (name, near) in enumerate(surfaces.items()):
        part = np.ones(len(triangles), dtype=bool)
        for axis, value in near.items():
            column = points[triangles][:, :, _index(axis, list(places.coordinates), f"the surface {name!r}")]
            part &= (np.abs(column - value) <= tolerance).all(axis=1)
        if not part.any():
            raise UsageError(
                f"No triangle lies on the surface {name!r}.", fix="Correct its coordinate or its unit."
            )
        surface_of[part] = number
    return new[triangles], surface_of


def _loads(loads: Sequence[Load], ids: np.ndarray, rest: np.ndarray) -> tuple[list[int], list[list[float]]]:
    """Return the node and the unit direction of each load."""
    nodes, directions = [], []
    for load in loads:
        nodes.append(index_of_place(load.at, ids, rest, "A load"))
        direction = np.array(load.direction, dtype=float)
        length = float(np.linalg.norm(direction))
        if direction.shape != (rest.shape[1],) or not length > 0:
            raise UsageError(
                f"A load has the direction {load.direction}.",
                fix=f"Give {rest.shape[1]} numbers, not all zero.",
            )
        directions.append((direction / length).tolist())
    return nodes, directions
