"""`palpate.import_results`: files of another solver and a mapping, made into an ordinary dataset."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.dataset.assemble import assemble
from palpate.dataset.dataset import Dataset
from palpate.dataset.readers.column_choice import chosen_columns
from palpate.dataset.readers.formats import read_results
from palpate.dataset.readers.imported_layout import along_axes, body_layout, further_places
from palpate.dataset.readers.load_energies import with_energies
from palpate.dataset.readers.long_tables import by_case_and_axis, by_case_and_place
from palpate.dataset.readers.mapping import ImportMapping, read_mapping
from palpate.dataset.readers.results import Column, Results, join_cases, join_columns
from palpate.dataset.readers.slope_of_energy import contradiction
from palpate.dataset.schema import Field, Layout, conjugate_unit
from palpate.errors import UsageError
from palpate.format import count
from palpate.input_files import read_input
from palpate.units import Range, parse_quantity

__all__ = ["Imported", "MappedCases", "import_results", "map_cases", "read_files"]

_UNITS = {"displacement": "m", "strain_energy": "J", "potential_energy": "J"}


@dataclass(frozen=True, eq=False)
class Imported:
    """Dataset made of another solver's results, and what was done for it.

    Attributes
    ----------
    dataset : Dataset
        Inputs and answers in SI units, one row a case.
    results : Results
        All that the files hold, as they have it.
    notes : tuple of str
        Sentences about what was skipped, converted and derived.
    """

    dataset: Dataset
    results: Results
    notes: tuple[str, ...]

    def __str__(self) -> str:
        return "\n".join([str(self.dataset), *(f"  {note}" for note in self.notes)])


def import_results(
    files: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    mapping: str | os.PathLike[str] | Mapping[str, Any],
) -> Imported:
    """Make a dataset of another solver's results.

    Parameters
    ----------
    files : path or sequence of paths
        All of one model on one mesh, in the order of the cases; see `palpate.read_results` for their formats.
    mapping : path or dict
        TOML file or dictionary that says which columns are inputs, outputs and coordinates; see the guide “Results of
        other solvers”.

    Returns
    -------
    Imported
        The dataset, and sentences about what was skipped and derived.

    Raises
    ------
    FileFormatError
        If a file is damaged or unknown; the message names its line.
    UsageError
        If the mapping doesn't fit the files.
    """
    paths = [Path(files)] if isinstance(files, str | os.PathLike) else [Path(file) for file in files]
    wishes = read_mapping(mapping)
    results = read_files(paths, wishes)
    if not wishes.inputs or not wishes.outputs:
        raise UsageError(
            "The mapping names no inputs." if not wishes.inputs else "The mapping names no outputs.",
            why=f"Columns of {results.source} are {', '.join(results.columns)}.",
            fix="Add [[inputs]] and [[outputs]] with a name and the column that each comes from.",
        )
    results = by_case_and_axis(by_case_and_place(results, wishes), wishes)
    return _dataset(results, wishes, paths)


def read_files(paths: Sequence[Path], mapping: ImportMapping) -> Results:
    """Read files and join them as the mapping says; numbers in their names become columns."""
    if not paths:
        raise UsageError("There are no files to import.", fix="Name at least one.")
    groups: dict[Any, list[Path]] = {}
    for path in paths:
        stem = {"stem": path.parent / path.stem, "columns": None, "cases": path}[mapping.join]
        groups.setdefault(stem, []).append(path)
    joined = []
    for files in groups.values():
        parts = join_columns([read_results(path) for path in files])
        joined.append(_with_numbers_of_names(parts, mapping.file_pattern))
    return join_cases(joined)


def _with_numbers_of_names(results: Results, pattern: str) -> Results:
    """Add the numbers that a pattern finds in the name of a file as columns."""
    if not pattern:
        return results
    match = next((m for path in results.files if (m := re.search(pattern, path.name))), None)
    if match is None:
        raise UsageError(
            f"The name of {results.source} does not fit file_pattern.", why=f"The pattern is {pattern!r}."
        )
    columns = dict(results.columns)
    for name, text in match.groupdict().items():
        try:
            value = parse_quantity(text, "")
        except UsageError as error:
            raise UsageError(
                f"{name!r} in the name of {results.source} is {text!r}, no number.",
                why=error.why,
                fix="Correct file_pattern; a point in an ending such as .frd may be too much.",
            ) from error
        columns[name] = Column(name, np.full(results.cases, value))
    return replace(results, columns=columns)


def _dataset(results: Results, mapping: ImportMapping, paths: Sequence[Path]) -> Imported:
    """Return the dataset of results whose mapping is complete."""
    cases = map_cases(results, mapping)
    _require_independent(cases)
    extent = float(np.ptp(cases.layout.rest, axis=0).max()) if len(cases.layout.rest) else 0.0
    about_slope = contradiction(cases.fields, cases.answers, cases.inputs, cases.ranges, extent)
    nodal = [field.name for field in cases.fields if "node" in field.dims]
    finite, count_of_cases = cases.finite, len(cases.inputs)
    notes = list(cases.notes)
    if not finite.all():
        failed = count(int((~finite).sum()), "case")
        notes.append(f"{failed} without finite answers: marked as not converged.")
    answers = cases.answers | {
        "converged": finite,
        "iterations": np.zeros(count_of_cases, dtype=int),
        "residual": np.full(count_of_cases, np.nan),
        "message": np.where(finite, "imported", "the files have no finite answer").astype(object),
        "solve_seconds": np.full(count_of_cases, np.nan),
    }
    notes = list(dict.fromkeys([*notes, *about_slope, *_about_coordinates(results, nodal)]))
    origin = _provenance(results, mapping, paths, notes)
    data = assemble(cases.ranges, cases.layout, cases.inputs, answers, origin, schema=cases.fields)
    return Imported(data, results, tuple(notes))


@dataclass(frozen=True, eq=False)
class MappedCases:
    """Inputs and answers of results in SI units, as a mapping chose them."""

    ranges: tuple[Range, ...]
    layout: Layout
    fields: tuple[Field, ...]
    inputs: np.ndarray  # (case, n)
    answers: dict[str, np.ndarray]  # by the name of their field, cases first
    notes: tuple[str, ...]

    @property
    def finite(self) -> np.ndarray:
        """True for each case whose answers are all numbers, shape (case,)."""
        finite = np.ones(len(self.inputs), dtype=bool)
        for field in self.fields:
            values = self.answers[field.name].reshape(len(self.inputs), -1)
            finite &= np.isfinite(values).all(axis=1)
        return finite


def map_cases(results: Results, mapping: ImportMapping) -> MappedCases:
    """Return what results hold of the inputs and outputs of a complete mapping."""
    notes = list(results.notes)
    inputs, units = _inputs(results, mapping)
    fields, answers, nodes = _outputs(results, mapping, units)
    rows = np.flatnonzero(np.isfinite(inputs).all(axis=1))
    if len(rows) < len(inputs):
        lost = count(len(inputs) - len(rows), "case")
        notes.append(f"Skipped {lost} whose inputs are not all numbers.")
    inputs, answers = inputs[rows], {name: values[rows] for name, values in answers.items()}
    nodal = [field.name for field in fields if "node" in field.dims]
    further = further_places(results, mapping, {dim for field in fields for dim in field.dims})
    at_nodes = {name: answers[name] for name in nodal}
    layout, kept, about_nodes = body_layout(results, mapping, nodes, at_nodes, cells="cells" in further)
    layout = replace(layout, **further)
    answers |= {name: answers[name][:, kept] for name in nodal}
    fields = [replace(field, shape=tuple(answers[field.name].shape[1:])) for field in fields]
    ranges = _ranges(mapping, inputs, units)
    weight = bool(mapping.body.get("self_weight"))
    fields, answers, about_energies = with_energies(fields, answers, inputs, ranges, layout, weight)
    return MappedCases(
        ranges, layout, tuple(fields), inputs, answers, (*notes, *about_nodes, *about_energies)
    )


_TOGETHER = 1e-9  # what the correlation of two inputs that always vary together misses to one


def _require_independent(cases: MappedCases) -> None:
    """Refuse two inputs that always vary together: what each of them does can't be told."""
    if len(cases.inputs) < 3:
        return
    correlation = np.abs(np.corrcoef(cases.inputs.T)).reshape(len(cases.ranges), -1)
    for i, j in zip(*np.triu_indices(len(cases.ranges), 1), strict=True):
        if correlation[i, j] > 1 - _TOGETHER:
            names = cases.ranges[i].name, cases.ranges[j].name
            raise UsageError(
                f"The inputs {names[0]!r} and {names[1]!r} always vary together.",
                why=f"In all {len(cases.inputs)} cases one is a straight line over the other, so the answers don't "
                "tell what each of them does.",
                fix=f"Leave {names[1]!r} out of the inputs, or import cases in which they vary apart.",
            )


def _inputs(results: Results, mapping: ImportMapping) -> tuple[np.ndarray, list[str]]:
    """Return the inputs of all cases (case, n) and their SI units."""
    columns, units = [], []
    for entry in mapping.inputs:
        wanted = "N" if entry.load is not None else None
        found, unit = chosen_columns(results, entry, mapping, wanted)
        if len(found) != 1 or found[0].places:
            where = f" with a value for each of the {found[0].places}" if found[0].places else ""
            raise UsageError(
                f"The input {entry.name!r} is not one number for each case.",
                why=f"It comes from {', '.join(column.name for column in found)}{where}.",
                fix='Name one component, and a place: at = 12, or reduce = "mean".',
            )
        if wanted is not None and unit != wanted:
            raise UsageError(
                f"The load {entry.name!r} is in {unit or 'pure numbers'}, not in N.",
                fix='Correct its unit, or write times = "5 N" for a load factor.',
            )
        columns.append(found[0].values)
        units.append(unit)
    return np.stack(columns, axis=1), units


def _outputs(
    results: Results, mapping: ImportMapping, units: Sequence[str]
) -> tuple[list[Field], dict[str, np.ndarray], str]:
    """Return the fields, the answers of all cases, and the name of the nodes that fields belong to."""
    fields, answers, nodes = [], {}, ""
    for entry in mapping.outputs:
        wanted = _UNITS.get(entry.name) if entry.invariant is None else None
        found, unit = chosen_columns(results, entry, mapping, wanted)
        where = found[0].places
        if any(column.places != where for column in found):
            raise UsageError(
                f"The components of {entry.name!r} belong to different places.",
                fix="Choose components of one kind of places.",
            )
        dim = _dimension(results, where, entry.name, mapping)
        if dim == "node" and nodes and where != nodes:
            raise UsageError(
                f"The output {entry.name!r} belongs to {where!r}, others to {nodes!r}.",
                why="A dataset has one set of nodes.",
                fix="Choose columns of one set, or single places by `at`.",
            )
        nodes = nodes or (where if dim == "node" else "")
        values = np.stack([column.values for column in found], axis=-1)
        if entry.name == "displacement" and dim == "node":
            values = along_axes(results, mapping, values)
        meaning = entry.meaning or f"from {', '.join(column.name for column in found)}"
        field, answers[entry.name] = _field(Field(entry.name, unit=unit, meaning=meaning), values, units, dim)
        fields.append(field)
    return fields, answers, nodes


def _dimension(results: Results, where: str, name: str, mapping: ImportMapping) -> str:
    """Return the dataset's dimension of the places that an output has values at; "" of one number a case."""
    if not where:
        return ""
    places = results.places[where]
    if places.axis:
        return mapping.axis
    if places.nodal:
        return "node"
    if where == "cells" and places.coordinates:
        return "cell"
    raise UsageError(
        f"The output {name!r} has a value for each of the {where}, whose places the files do not tell.",
        fix='Take a quantity at nodes or cells, or one number: reduce = "max".',
    )


def _field(field: Field, values: np.ndarray, units: Sequence[str], dim: str) -> tuple[Field, np.ndarray]:
    """Return a field with its dimensions, and its values (case, place, k) or (case, k), without k where it is 1."""
    if field.name == "displacement" and dim == "node":
        return replace(field, dims=("node", "component"), shape=values.shape[1:]), values
    if field.name == "response" and not dim:
        if values.shape[1] != len(units):
            raise UsageError(
                f"The response has {values.shape[1]} components for {count(len(units), 'input')}.",
                fix="Name one column for each input.",
            )
        unit = ", ".join(map(conjugate_unit, units))
        return replace(field, dims=("input",), shape=values.shape[1:], unit=unit), values
    dims: tuple[str, ...] = (dim,) if dim else ()
    if values.shape[-1] == 1:
        values = values[..., 0]
    else:
        dims = (*dims, f"{field.name}_component")
    return replace(field, dims=dims, shape=values.shape[1:]), values


def _ranges(mapping: ImportMapping, inputs: np.ndarray, units: Sequence[str]) -> tuple[Range, ...]:
    ranges = []
    for entry, values, unit in zip(mapping.inputs, inputs.T, units, strict=True):
        low, high = values.min(initial=np.inf), values.max(initial=-np.inf)
        if mapping.mirrored and len(units) == 1 and entry.load is not None and 0 < low < high:
            low = 0.0  # no load, no deflection
        if entry.range is not None:
            low, high = (parse_quantity(end, unit, f"The range of {entry.name!r}") for end in entry.range)
        if not low < high:
            raise UsageError(
                f"The input {entry.name!r} does not vary.",
                why=f"It is {f'{low:g} {unit}'.strip()} in {count(len(values), 'case')}."
                if len(values)
                else "There is no case.",
                fix="Import cases in which it varies, or leave it out of the inputs.",
            )
        ranges.append(Range(entry.name, float(low), float(high), unit))
    return tuple(ranges)


def _about_coordinates(results: Results, nodal: Sequence[str]) -> list[str]:
    """Return a warning of coordinates that may be those of the deformed body."""
    axes = {axis for places in results.places.values() for axis in places.coordinates}
    if (
        "displacement" not in nodal
        or not results.format.startswith("COMSOL")
        or not axes & {"x", "y", "z", "r"}
    ):
        return []
    return [
        "The coordinates may be spatial ones: with geometric nonlinearity COMSOL's x, y, z are those of the deformed "
        "body. Then export the material coordinates X, Y, Z."
    ]


def _provenance(
    results: Results, mapping: ImportMapping, paths: Sequence[Path], notes: Sequence[str]
) -> dict[str, Any]:
    files = [{"name": path.name, "sha256": hashlib.sha256(read_input(path)).hexdigest()} for path in paths]
    return {
        "words": mapping.name,
        "problem": {
            "body": {"type": "imported", "name": mapping.name, "mirrored": mapping.mirrored, **mapping.body},
            "interactions": [dict(entry) for entry in mapping.interactions],
        },
        "imported": {
            "format": results.format,
            "files": files,
            "mapping": mapping.model_dump(mode="json", by_alias=True, exclude_defaults=True),
            "notes": list(notes),
        },
    }
