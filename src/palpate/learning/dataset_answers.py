"""The answers of a dataset of any physics: its numbers, its fields over a mesh, and its curves along an axis.

A variable of a dataset is a number for each solve; several numbers, where a dimension has no places; a curve, where its
dimension has a coordinate of numbers such as times; or a field, where its dimension is the nodes or the cells.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from palpate.dataset import Dataset
from palpate.dataset.schema import BOOKKEEPING
from palpate.errors import UsageError
from palpate.format import count
from palpate.surrogates import AxisPlaces, MeshPlaces
from palpate.units import Quantity, Range

__all__ = ["DatasetAnswers", "FieldAnswers", "NumberAnswers"]

_TOGETHER = 1.0 - 1e-9  # correlation from which on two inputs are one


@dataclass(frozen=True, eq=False)
class NumberAnswers:
    """Numbers of one unit that every solve answers."""

    outputs: tuple[Quantity, ...]
    values: np.ndarray  # (N, m)


@dataclass(frozen=True, eq=False)
class FieldAnswers:
    """A field or a curve that every solve answers."""

    name: str
    unit: str
    places: MeshPlaces | AxisPlaces
    values: np.ndarray  # (N, P, C)
    components: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class DatasetAnswers:
    """Inputs and answers of the N solves that converged and whose answers are finite."""

    X: np.ndarray  # (N, n), SI units
    inputs: tuple[Range, ...]
    numbers: Mapping[str, NumberAnswers]
    fields: Mapping[str, FieldAnswers]
    notes: tuple[str, ...]  # what was left out, and why

    def tables(self) -> list[np.ndarray]:
        """Return the values of every number, field and curve, each (N, m)."""
        every = [
            *(one.values for one in self.numbers.values()),
            *(one.values for one in self.fields.values()),
        ]
        return [values.reshape(len(self.X), -1) for values in every]

    @classmethod
    def of(cls, data: Dataset, *, to_learn: bool = True) -> DatasetAnswers:
        """Return the answers of a dataset; those to judge by need not vary.

        An input that never varies, two inputs that always vary together, and a dataset without answers are refused.
        """
        good = data.ok
        names = [str(n) for n in good.data.data_vars if str(n) not in _NO_ANSWERS]
        names = [n for n in names if good.data[n].dtype.kind in "fiu" and good.data[n].dims[0] == "sample"]
        finite = {n: np.isfinite(good[n]).reshape(len(good), -1).all(axis=1) for n in names}
        notes = [f"{n} has no finite value in any solve." for n in names if not finite[n].any()]
        names = [n for n in names if finite[n].any()]
        rows = np.all([finite[n] for n in names], axis=0) if names else np.ones(len(good), dtype=bool)
        lost = {n: int((~finite[n]).sum()) for n in names}
        notes += [f"{count(lost[n], 'solve')} left out: {n} is not finite there." for n in names if lost[n]]
        good = good.take(np.flatnonzero(rows))
        constant = [n for n in names if to_learn and len(good) and not np.ptp(good[n], axis=0).any()]
        notes += [f"{n} is the same in every solve, and left out." for n in constant]
        names = [n for n in names if n not in constant]
        if to_learn:
            _require_inputs(good)
        numbers: dict[str, NumberAnswers] = {}
        fields: dict[str, FieldAnswers] = {}
        shared = _Places(good)
        for name in names:
            places = shared.of(name)
            if places is None:
                numbers[name] = _numbers(good, name)
            else:
                fields[name] = _field(good, name, places)
        if not numbers and not fields:
            raise UsageError(
                "This dataset has no answers that could be learnt.",
                why=" ".join(notes) or "It has inputs alone.",
                fix="Import or sweep quantities, fields or curves that vary with the inputs.",
            )
        return cls(good.X, good.ranges, numbers, fields, tuple(notes))


_NO_ANSWERS = {"inputs"} | {entry.name for entry in BOOKKEEPING}


class _Places:
    """The nodes, cells and axes of a dataset, each one object for all variables that belong to it."""

    def __init__(self, data: Dataset) -> None:
        self._data, self._made = data, dict[str, MeshPlaces | AxisPlaces]()

    def of(self, name: str) -> MeshPlaces | AxisPlaces | None:
        """Return where a variable's values are; None of numbers."""
        array = self._data.data[name]
        if len(array.dims) < 2:
            return None
        dim = str(array.dims[1])
        if dim not in self._made:
            coordinate = array.coords.get(dim)
            if dim in {"node", "cell"}:
                self._made[dim] = _mesh(self._data, dim)
            elif coordinate is None or coordinate.dtype.kind not in "fiu":
                return None
            else:
                unit = str(coordinate.attrs.get("units", ""))
                self._made[dim] = AxisPlaces(dim, unit, np.asarray(coordinate.values, dtype=float))
        return self._made[dim]


def _mesh(data: Dataset, dim: str) -> MeshPlaces:
    """Return the nodes or cells of a dataset; a plane body lies at z = 0."""
    triangles = data["triangles"] if "triangles" in data else np.zeros((0, 3), np.int64)
    points = _in_space(data.rest)
    if dim == "node":
        return MeshPlaces(points, triangles)
    cell_of = data["cell_of"] if "cell_of" in data else np.zeros(0, np.int64)
    return MeshPlaces(points, triangles, "cells", _in_space(data["cell_centre"]), cell_of)


def _in_space(points: np.ndarray) -> np.ndarray:
    return np.hstack([points, np.zeros((len(points), 3 - points.shape[1]))])


def _require_inputs(data: Dataset) -> None:
    """Refuse inputs by which nothing can be told apart."""
    X, names = data.X, [r.name for r in data.ranges]
    for name, column in zip(names, X.T, strict=True):
        if not np.ptp(column):
            raise UsageError(
                f"The input {name!r} never varies.",
                why=f"It is {column[0]:g} in all {len(X)} solves." if len(X) else "There is no solve.",
                fix="Solve cases in which it varies, or leave it out of the inputs.",
            )
    scaled = (X - X.mean(axis=0)) / X.std(axis=0)
    alike = np.abs(scaled.T @ scaled / len(X)) - np.eye(len(names))
    i, j = np.unravel_index(int(alike.argmax()), alike.shape)
    if alike[i, j] > _TOGETHER:
        raise UsageError(
            f"The inputs {names[i]!r} and {names[j]!r} always vary together.",
            why="What one of them does can't be told from what the other does.",
            fix="Solve cases in which one varies without the other, or leave one of them out.",
        )


def _numbers(data: Dataset, name: str) -> NumberAnswers:
    array = data.data[name]
    values = np.asarray(array.values, dtype=float).reshape(len(data), -1)
    units = _units(data, name)
    if values.shape[1] == 1:
        return NumberAnswers((Quantity(name, units[0]),), values)
    names = _component_names(data, name, 1, values.shape[1])
    units = units if len(units) == values.shape[1] else units[:1] * values.shape[1]
    return NumberAnswers(
        tuple(Quantity(f"{name} {part}", unit) for part, unit in zip(names, units, strict=True)), values
    )


def _field(data: Dataset, name: str, places: MeshPlaces | AxisPlaces) -> FieldAnswers:
    values = np.asarray(data[name], dtype=float)
    values = values.reshape(*values.shape[:2], -1)
    components: tuple[str, ...] = ()
    if values.shape[2] > 1:
        components = tuple(_component_names(data, name, 2, values.shape[2]))
    return FieldAnswers(name, _units(data, name)[0], places, values, components)


def _units(data: Dataset, name: str) -> list[str]:
    return [unit.strip() for unit in str(data.data[name].attrs.get("units", "")).split(",")]


def _component_names(data: Dataset, name: str, axis: int, number: int) -> list[str]:
    """Return the names of the components of a variable: the labels of its dimension, or numbers from 1."""
    array = data.data[name]
    labels = array.coords.get(str(array.dims[axis])) if len(array.dims) == axis + 1 else None
    if labels is None or labels.dtype.kind in "fiu":
        return [str(i + 1) for i in range(number)]
    return [str(label) for label in labels.values]
