"""Putting the answers of a solver together as a labelled dataset."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.dataset.dataset import FORMAT, FORMAT_VERSION, Dataset
from palpate.units import Range

__all__ = ["ANSWERS", "Layout", "assemble"]


@dataclass(frozen=True)
class Layout:
    """Where a body's nodes are and which of them the inputs act on.

    Attributes
    ----------
    rest : (node, 2) array
        Positions at rest in m.
    of_interest : (node,) array of bool
    load_nodes : sequence of int
        For each input the index of the node that it acts on.
    load_directions : (n, 2) array
        For each input its direction (x, y).
    """

    rest: np.ndarray
    of_interest: np.ndarray
    load_nodes: Sequence[int]
    load_directions: Sequence[tuple[float, float]]


# name: dimensions after "sample", unit of each component, meaning
ANSWERS: dict[str, tuple[tuple[str, ...], str, str]] = {
    "displacement": (("node", "component"), "m, m, rad", "offset from the rest position and rotation"),
    "root_reaction": (("reaction",), "N, N, N m", "force and moment of the clamp on the body"),
    "strain_energy": ((), "J", "energy stored in the body"),
    "potential_energy": ((), "J", "strain energy less the potential of the loads"),
    "largest_strain": ((), "", "largest strain of a fibre along the body"),
    "converged": ((), "", "whether this row is an equilibrium"),
    "iterations": ((), "", "Newton iterations"),
    "residual": ((), "", "relative error left, in the energy norm"),
    "message": ((), "", "why the solver stopped"),
    "solve_seconds": ((), "s", "wall-clock time of the solve"),
}
OPTIONAL = frozenset({"largest_strain"})  # not every body has it, nor had earlier versions


def assemble(
    ranges: Sequence[Range],
    layout: Layout,
    inputs: np.ndarray,
    answers: Mapping[str, np.ndarray],
    provenance: Mapping[str, Any],
    samples: np.ndarray | None = None,
) -> Dataset:
    """Label inputs and answers.

    Parameters
    ----------
    ranges : n ranges
    layout : Layout
    inputs : (sample, n) array
        In the units of `ranges`.
    answers : mapping
        An array for each name in `ANSWERS`, samples first; ``"largest_strain"`` may be missing.
    provenance : mapping
        Plain data for a JSON file: where the answers come from.
    samples : (sample,) array of int, optional
        Number of each sample; by default they count from 0.

    Returns
    -------
    Dataset
    """
    import xarray

    variables: dict[str, Any] = {
        "inputs": (("sample", "input"), np.asarray(inputs, dtype=float), _attrs(_units(ranges), "inputs")),
    }
    for name, (dims, unit, meaning) in ANSWERS.items():
        if name in OPTIONAL and name not in answers:
            continue
        values = np.asarray(answers[name], dtype=np.dtypes.StringDType() if name == "message" else None)
        variables[name] = (("sample", *dims), values, _attrs(unit, meaning))
    coords = _coords(ranges, layout)
    coords["sample"] = ("sample", np.arange(len(inputs)) if samples is None else np.asarray(samples))
    attrs = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "provenance": json.dumps(dict(provenance), sort_keys=True),
    }
    return Dataset(xarray.Dataset(variables, coords, attrs))


def _coords(ranges: Sequence[Range], layout: Layout) -> dict[str, Any]:
    return {
        "input": ("input", _text(r.name for r in ranges)),
        "input_unit": ("input", _text(r.unit for r in ranges)),
        "input_low": ("input", np.array([r.low for r in ranges])),
        "input_high": ("input", np.array([r.high for r in ranges])),
        "input_node": ("input", np.array(layout.load_nodes, dtype=np.int64)),
        "input_direction": (("input", "axis"), np.asarray(layout.load_directions, dtype=float)),
        "axis": ("axis", _text("xy")),
        "component": ("component", _text(("u_x", "u_y", "rotation"))),
        "reaction": ("reaction", _text(("F_x", "F_y", "M"))),
        "node": ("node", np.arange(len(layout.rest))),
        "rest": (("node", "axis"), np.asarray(layout.rest, dtype=float), _attrs("m", "position at rest")),
        "of_interest": ("node", np.asarray(layout.of_interest, dtype=bool)),
    }


def _text(words: Any) -> np.ndarray:
    # variable-length text: Zarr has no stable format for NumPy's fixed-length one
    return np.array(list(words), dtype=np.dtypes.StringDType())


def _attrs(unit: str, meaning: str) -> dict[str, str]:
    return {"units": unit, "long_name": meaning}


def _units(ranges: Sequence[Range]) -> str:
    return ", ".join(r.unit for r in ranges)
