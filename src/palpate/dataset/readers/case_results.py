"""Results of one solve, read by the same readers and the same mapping as an import of many."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.dataset.readers.import_results import MappedCases, map_cases, read_files
from palpate.dataset.readers.mapping import ImportMapping, Input, read_mapping
from palpate.dataset.readers.results import Column, Results
from palpate.errors import UsageError
from palpate.units import Range

__all__ = ["mapping_of_outputs", "read_case", "read_numbers"]


def mapping_of_outputs(
    mapping: Mapping[str, Any], ranges: Sequence[Range], loads: Mapping[str, Any]
) -> ImportMapping:
    """Return the mapping of a solver's files: what the user says of the outputs, and the inputs of the study.

    `loads` are the nodes and directions of inputs that are forces on nodes.
    """
    if "inputs" in mapping or "join" in mapping:
        word = "inputs" if "inputs" in mapping else "join"
        raise UsageError(
            f"The mapping of a solver's results says {word!r}.",
            why="The inputs are those of the study, [[inputs]], and all files of a case belong together.",
            fix=f"Take {word!r} out of the mapping.",
        )
    entries = [
        Input(name=r.name, unit=r.unit, range=(r.low, r.high), load=loads.get(r.name), **{"from": r.name})
        for r in ranges
    ]
    wishes = read_mapping({**mapping, "join": "columns"}).model_copy(update={"inputs": tuple(entries)})
    if not wishes.outputs:
        raise UsageError(
            "The mapping of the solver's results names no outputs.",
            why="Nothing would be kept of a solve.",
            fix='Add [[mapping.outputs]] with a name and the column that it comes from, `from = "…"`; '
            "`palpate dataset import FILES --dry-run` lists the columns of a result.",
        )
    return wishes


def read_case(
    files: Sequence[Path], mapping: ImportMapping, x: np.ndarray, solution: str = "last"
) -> MappedCases:
    """Read the files that a solver wrote for the inputs `x` (n,); `mapping` is that of `mapping_of_outputs`.

    Where they hold several solutions, such as load steps, the ``"last"`` or the ``"first"`` is taken; with ``"only"``
    they are refused.
    """
    results = read_files(files, mapping)
    if not results.cases:
        raise UsageError(f"{results.source} holds no solution.", fix="Look at the solver's messages.")
    if solution == "only" and results.cases > 1:
        raise UsageError(
            f"{results.source} holds {results.cases} solutions.",
            why='The study says `solution = "only"`.',
            fix='Write one, or choose `solution = "last"`.',
        )
    return _map_results(results, -1 if solution == "last" else 0, mapping, x)


def _map_results(results: Results, row: int, mapping: ImportMapping, x: np.ndarray) -> MappedCases:
    columns = {name: replace(c, values=c.values[[row]]) for name, c in results.columns.items()}
    for entry, value in zip(mapping.inputs, x, strict=True):
        columns[entry.name] = Column(entry.name, np.array([float(value)]), entry.unit)
    return map_cases(replace(results, cases=1, columns=columns), mapping)


def read_numbers(
    columns: Mapping[str, np.ndarray], source: str, mapping: ImportMapping, x: np.ndarray
) -> MappedCases:
    """Return what a mapping takes of vectors (k,) by name, which came for the inputs `x` (n,) without a file.

    The numbers of a vector are the columns ``NAME.0``, ``NAME.1`` and so on; one number alone is ``NAME``.
    """
    named = {}
    for name, values in columns.items():
        for i, value in enumerate(values):
            own = name if len(values) == 1 else f"{name}.{i}"
            named[own] = Column(own, np.array([float(value)]))
    return _map_results(Results((Path(source),), "numbers", 1, named), 0, mapping, x)
