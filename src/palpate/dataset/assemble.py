"""Inputs and answers of a solver, labelled and joined into a dataset."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from palpate.dataset.dataset import Dataset
from palpate.dataset.schema import (
    FORMAT,
    FORMAT_VERSION,
    Field,
    Layout,
    beam_fields,
    check_schema,
    with_bookkeeping,
)
from palpate.errors import UsageError
from palpate.units import Range

__all__ = ["assemble"]


def assemble(
    ranges: Sequence[Range],
    layout: Layout,
    inputs: np.ndarray,
    answers: Mapping[str, np.ndarray],
    provenance: Mapping[str, Any],
    samples: np.ndarray | None = None,
    schema: Iterable[Field] | None = None,
) -> Dataset:
    """Label inputs and answers as a dataset.

    Parameters
    ----------
    ranges : sequence of n ranges
        Name, unit and interval of each input.
    layout : Layout
        Nodes, axes and surface of the body.
    inputs : (sample, n) array
        Inputs of each solve, in the units of `ranges`.
    answers : mapping
        An array for each field of the schema and of the bookkeeping, samples first; optional fields may be
        missing.
    provenance : mapping
        Plain data for a JSON file: where the answers come from.
    samples : (sample,) array of int, optional
        Number of each sample in its design; by default they count from 0.
    schema : fields, optional
        Fields that the solver answers; by default those of a plane beam.

    Raises
    ------
    UsageError
        If an answer is missing, or the schema does not fit the layout.
    """
    import xarray

    schema = beam_fields(len(layout.rest)) if schema is None else tuple(schema)
    check_schema(schema, layout, len(ranges))
    units = ", ".join(r.unit for r in ranges)
    variables: dict[str, Any] = {
        "inputs": (("sample", "input"), np.asarray(inputs, dtype=float), _attrs(units, "inputs")),
    }
    for field in with_bookkeeping(schema):
        if field.name in answers:
            values = np.asarray(answers[field.name], dtype=_text_type(field))
            variables[field.name] = (("sample", *field.dims), values, _attrs(field.unit, field.meaning))
        elif not field.optional:
            raise UsageError(
                f"The answers lack {field.name!r}.",
                why="The schema says that each solve answers it.",
                fix="Answer it, or mark the field as optional.",
            )
    coords = _coords(ranges, layout, schema)
    coords["sample"] = ("sample", np.arange(len(inputs)) if samples is None else np.asarray(samples))
    attrs = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "provenance": json.dumps(dict(provenance), sort_keys=True),
    }
    return Dataset(xarray.Dataset(variables, coords, attrs))


def _coords(ranges: Sequence[Range], layout: Layout, schema: Iterable[Field]) -> dict[str, Any]:
    dims = {dim for field in schema for dim in field.dims}
    coords = _input_coords(ranges, layout)
    coords |= {
        "axis": ("axis", _text(layout.axes)),
        "component": ("component", _text(layout.components)),
        "node": ("node", np.arange(len(layout.rest))),
        "rest": (("node", "axis"), layout.rest, _attrs("m", "position at rest")),
        "of_interest": ("node", layout.of_interest),
    }
    if "along" in dims:
        coords["along"] = ("along", _text(r.name for r in ranges))
    labels = (layout.labels or {}).items()
    coords |= {dim: (dim, _text(names)) for dim, names in labels if dim in dims}
    for dim, (values, unit) in (layout.scales or {}).items():
        coords[dim] = (dim, np.asarray(values, dtype=float), _attrs(unit, dim))
    if layout.cells is not None:
        centres, cell_of = layout.cells
        coords["cell_centre"] = (
            ("cell", "axis"),
            np.asarray(centres, dtype=float),
            _attrs("m", "middle of the cell"),
        )
        if len(cell_of):
            coords["cell_of"] = ("triangle", np.asarray(cell_of, dtype=np.int64))
    return coords | _surface_coords(layout)


def _input_coords(ranges: Sequence[Range], layout: Layout) -> dict[str, Any]:
    coords: dict[str, Any] = {
        "input": ("input", _text(r.name for r in ranges)),
        "input_unit": ("input", _text(r.unit for r in ranges)),
        "input_low": ("input", np.array([r.low for r in ranges])),
        "input_high": ("input", np.array([r.high for r in ranges])),
    }
    if len(layout.load_nodes):
        coords["input_node"] = ("input", np.array(layout.load_nodes, dtype=np.int64))
        coords["input_direction"] = (("input", "axis"), np.asarray(layout.load_directions, dtype=float))
    return coords


def _surface_coords(layout: Layout) -> dict[str, Any]:
    if layout.triangles is None:
        return {}
    meaning = _attrs("", "nodes of the surface's triangles, counter-clockwise from outside")
    coords: dict[str, Any] = {"triangles": (("triangle", "corner"), layout.triangles, meaning)}
    if layout.surface_of is not None:
        coords["surface"] = ("surface", _text(layout.surfaces))
        coords["surface_of"] = ("triangle", np.asarray(layout.surface_of, dtype=np.int64))
    if layout.drawn is not None:
        points, own = layout.drawn
        meaning = _attrs("m", "vertices at rest of the body's own surface, which is drawn")
        coords["drawn_points"] = (("drawn_node", "axis"), np.asarray(points, dtype=float), meaning)
        coords["drawn_triangles"] = (("drawn_triangle", "corner"), np.asarray(own, dtype=np.int64))
    return coords


def _text_type(field: Field) -> Any:
    return np.dtypes.StringDType() if isinstance(field.fill, str) else None


def _text(strings: Iterable[str]) -> np.ndarray:
    # variable-length text: Zarr has no stable format for NumPy's fixed-length one
    return np.array(list(strings), dtype=np.dtypes.StringDType())


def _attrs(unit: str, meaning: str) -> dict[str, str]:
    return {"units": unit, "long_name": meaning}
