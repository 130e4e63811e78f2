"""Files of the VTK family, as ParaView and many solvers write them: ``.vtu``, ``.vtp``, ``.vtk``, and series ``.pvd``.

PyVista reads them where it is installed (``pip install 'palpate[results]'``). Without it meshio, which palpate has
always, reads ``.vtu`` files of the usual codings. Both work in a child process: VTK is written in C++ and some files
crash it, and packed numbers may take any memory.
"""

from __future__ import annotations

import importlib.util
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from palpate.dataset.readers.results import TIME, Column, Places, Results, refuse
from palpate.dataset.readers.surface import CORNERS, cells_of_triangles, outer_surface
from palpate.errors import FileFormatError, UsageError
from palpate.input_files import DAMAGE, plain_text, read_input
from palpate.supervised import read_in_child

__all__ = [
    "INSTALL",
    "KINDS",
    "SUFFIXES",
    "Grid",
    "cells_of",
    "damage_error",
    "read_series",
    "read_vtk",
    "read_vtu",
    "require_one_mesh",
    "results_of_grids",
    "sound_grid",
]

FORMAT = "VTK"
_LARGEST_SERIES = 50_000_000  # bytes of a list of files
SUFFIXES = (".pvd", ".vtu", ".vtp", ".vtk")
INSTALL = "Install PyVista: pip install 'palpate[results]'"
# VTK's numbers of the cells that have faces; the second of a pair has nodes between the corners
KINDS = {
    5: "triangle",
    22: "triangle",
    9: "quad",
    23: "quad",
    28: "quad",
    10: "tetra",
    24: "tetra",
    12: "hexahedron",
    25: "hexahedron",
    29: "hexahedron",
    13: "wedge",
    26: "wedge",
    14: "pyramid",
    27: "pyramid",
}
_PARTS = {2: "xy", 3: "xyz"}
_TENSORS = {6: ("xx", "yy", "zz", "xy", "yz", "xz")}  # VTK's order of a symmetric tensor


@dataclass(frozen=True, eq=False)
class Grid:
    """Content of one file: nodes, cells by kind, and arrays of nodes, of cells and of the whole."""

    points: np.ndarray
    cells: Sequence[tuple[str, np.ndarray]]
    numbers: Sequence[np.ndarray]  # of the cells of each kind, among all cells
    count: int
    point_data: Mapping[str, np.ndarray]
    cell_data: Mapping[str, np.ndarray]
    field_data: Mapping[str, np.ndarray]


def read_vtk(path: Path) -> Results:
    """Read a file of the VTK family; of a ``.pvd`` each step is a case.

    Columns are called as the array, of a vector ``NAME.x``, of a symmetric tensor ``NAME.xx``.
    """
    if path.suffix.lower() != ".pvd":
        return results_of_grids(path, [_read(path)], None)
    entries = read_series(path)
    times = np.array([_time(path, time) for time, _ in entries])
    order = np.argsort(times, kind="stable")
    times, files = times[order], [entries[i][1] for i in order]
    grids = [_read(file) for file in files]
    require_one_mesh(files, grids)
    return results_of_grids(path, grids, times)


def require_one_mesh(files: Sequence[Path], grids: Sequence[Grid]) -> None:
    """Refuse steps whose nodes are others, or elsewhere, than in the first; the files are those of the steps."""
    for file, grid in zip(files, grids, strict=True):
        if grid.points.shape != grids[0].points.shape or grid.count != grids[0].count:
            raise refuse(
                file,
                None,
                f"it has {len(grid.points)} nodes and {grid.count} cells, the first step {len(grids[0].points)} and "
                f"{grids[0].count}.",
                why="The body was meshed anew between the steps.",
                fix="Export results on one mesh.",
            )
        if not np.allclose(grid.points, grids[0].points, rtol=0, atol=1e-6 * np.ptp(grids[0].points)):
            raise refuse(
                file,
                None,
                "its nodes are elsewhere than in the first step.",
                why="The coordinates are those of the deformed body, or of another mesh.",
                fix="Export the undeformed mesh, with the displacement as a field.",
            )


def _time(path: Path, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise refuse(path, None, f"the time step {text!r} is no number.") from None


def read_series(path: Path) -> list[tuple[str, Path]]:
    """Return the time steps, as they stand there, and the files of a ``.pvd`` collection."""
    try:
        rows = ElementTree.fromstring(read_input(path, largest=_LARGEST_SERIES)).findall("Collection/DataSet")
    except (ElementTree.ParseError, ValueError, RecursionError) as error:
        line = error.position[0] if isinstance(error, ElementTree.ParseError) else None
        raise refuse(path, line, "the series can't be read.", why=f"{error}.") from error
    if len({row.get("part", "0") for row in rows}) > 1:
        raise refuse(
            path,
            None,
            "the series has several parts for one time.",
            fix="Export one part, or the parts apart.",
        )
    if not rows:
        raise refuse(
            path, None, "the series names no files.", why="It is empty, or no collection of DataSet entries."
        )
    return [(plain_text(row.get("timestep", "nan")), path.parent / row.get("file", "")) for row in rows]


def _read(path: Path) -> Grid:
    if not path.exists():
        raise refuse(path, None, "there is no such file.", fix="Keep the files of a series together.")
    if importlib.util.find_spec("pyvista") is not None:
        return read_in_child(_read_with_pyvista, path)
    if path.suffix.lower() == ".vtu":
        return read_vtu(path)
    raise UsageError(
        f"{path} can't be read without PyVista.", why="meshio reads .vtu files only.", fix=INSTALL
    )


def read_vtu(path: Path) -> Grid:
    """Read a ``.vtu`` file of a usual coding, by meshio."""
    return read_in_child(_read_with_meshio, path)


def _read_with_pyvista(path: Path) -> Grid:
    import pyvista

    faults: list[str] = []
    try:
        reader = pyvista.get_reader(str(path))
        # VTK prints what it finds wrong, and goes on with what it has
        reader.reader.AddObserver("ErrorEvent", lambda *_: faults.append("VTK reports an error"))
        grid: Any = reader.read()
        whole = grid.cast_to_unstructured_grid()
        cells, numbers = cells_of(whole)
    except DAMAGE as error:
        raise damage_error(path, str(error)) from error
    if faults or not whole.n_points:
        raise damage_error(path, faults[0] if faults else "it has no nodes")
    return sound_grid(
        path,
        np.asarray(whole.points, dtype=float),
        cells,
        numbers,
        int(whole.n_cells),
        dict(whole.point_data.items()),
        dict(whole.cell_data.items()),
        dict(whole.field_data.items()),
    )


def cells_of(whole: Any) -> tuple[list[tuple[str, np.ndarray]], list[np.ndarray]]:
    """Return the known cells of an unstructured grid by kind, and their numbers among all its cells."""
    kinds = [kind for kind in whole.cells_dict if kind in KINDS]
    cells = [(KINDS[kind], whole.cells_dict[kind]) for kind in kinds]
    return cells, [np.flatnonzero(whole.celltypes == kind) for kind in kinds]


def _read_with_meshio(path: Path) -> Grid:
    import meshio
    from meshio import vtu  # meshio.read ends the program where it can't read

    try:
        mesh = vtu.read(path)
    except (meshio.ReadError, *DAMAGE) as error:
        raise damage_error(
            path, f"{error or 'meshio does not know its coding'}", f"{INSTALL}, or export it again."
        ) from error
    kinds = [(block.type.rstrip("0123456789"), block.data) for block in mesh.cells]
    cell_data = {name: np.concatenate(values) for name, values in mesh.cell_data.items()}
    ends = np.cumsum([0, *(len(block.data) for block in mesh.cells)])
    count, numbers = int(ends[-1]), [np.arange(a, b) for a, b in itertools.pairwise(ends)]
    points = np.asarray(mesh.points, dtype=float)
    return sound_grid(path, points, kinds, numbers, count, mesh.point_data, cell_data, mesh.field_data)


def sound_grid(
    path: Path,
    points: np.ndarray,
    cells: Sequence[tuple[str, np.ndarray]],
    numbers: Sequence[np.ndarray],
    count: int,
    *data: Mapping[str, Any],
) -> Grid:
    """Return the content of a file whose cells name nodes that are there; names of arrays are plain texts."""
    for kind, nodes in cells:
        if nodes.size and not (nodes.min() >= 0 and nodes.max() < len(points)):
            raise damage_error(path, f"a {kind} names a node that is not among its {len(points)}")
    if points.ndim != 2 or not np.isfinite(points).all():
        raise damage_error(path, "coordinates of nodes are no finite numbers")
    plain = [{plain_text(str(name)): np.array(values) for name, values in arrays.items()} for arrays in data]
    return Grid(
        np.array(points), [(kind, np.array(nodes)) for kind, nodes in cells], list(numbers), count, *plain
    )


def damage_error(path: Path, why: str, fix: str = "") -> FileFormatError:
    """Return the error of a file that its reader in C++ can't read."""
    return refuse(
        path, None, "the file can't be read.", why=f"It is damaged, cut short or foreign: {why}.", fix=fix
    )


def results_of_grids(path: Path, grids: Sequence[Grid], times: np.ndarray | None) -> Results:
    """Return the content of grids of one mesh as results, each a case; `times` (case,) are those of a series."""
    first = grids[0]
    columns = [] if times is None else [Column(TIME, times, None, "{time}")]
    notes: list[str] = []
    for where, arrays in (
        ("nodes", [grid.point_data for grid in grids]),
        ("cells", [grid.cell_data for grid in grids]),
        ("", [grid.field_data for grid in grids]),
    ):
        for name, sample in arrays[0].items():
            reason = _reason_to_skip(name, sample, arrays)
            if reason:
                notes.append(f"Skipped {name}: {reason}.")
                continue
            columns += _columns(
                name, np.stack([np.asarray(step[name], dtype=float) for step in arrays]), where
            )
        further = dict.fromkeys(name for step in arrays[1:] for name in step if name not in arrays[0])
        notes += [f"Skipped {name}: the first step has no such array." for name in further]
    plane = first.points.shape[1] == 2 or not np.ptp(first.points[:, 2])
    coordinates = {
        axis: Column(axis, first.points[:, i], None, "{length}")
        for i, axis in enumerate("xy" if plane and len(first.points) > 1 else "xyz")
    }
    triangles = outer_surface(first.cells, first.points)
    places = {
        "nodes": Places(np.arange(len(first.points)), coordinates, triangles),
        "cells": _cells(first, triangles, tuple(coordinates)),
    }
    used = {column.places for column in columns} | {"nodes"}
    places = {name: value for name, value in places.items() if name in used}
    form = f"{FORMAT} {path.suffix}"
    return Results.of(path, form, len(grids), columns, places, notes)


def _cells(grid: Grid, triangles: np.ndarray | None, axes: Sequence[str]) -> Places:
    """Return the cells of a file with their middles, and the cell of each triangle of the surface."""
    blocks = [
        (*block, own) for block, own in zip(grid.cells, grid.numbers, strict=True) if block[0] in CORNERS
    ]
    middles = np.full((grid.count, grid.points.shape[1]), np.nan)
    for kind, nodes, own in blocks:
        middles[own] = grid.points[nodes[:, : CORNERS[kind]]].mean(axis=1)
    columns = {axis: Column(axis, middles[:, i], None, "{length}") for i, axis in enumerate(axes)}
    owners = None if triangles is None else cells_of_triangles(blocks, triangles)
    return Places(np.arange(grid.count), columns, nodal=False, cell_of=owners)


def _reason_to_skip(name: str, sample: Any, arrays: Sequence[Mapping[str, Any]]) -> str:
    values = np.asarray(sample)
    if values.dtype.kind not in "fiub":
        return "it holds no numbers"
    if not all(name in step for step in arrays):
        return "not every step has it"
    if len({np.shape(step[name]) for step in arrays}) > 1:
        return "its size differs from step to step"
    return ""


def _columns(name: str, values: np.ndarray, where: str) -> list[Column]:
    """Return the components of an array (case, place, component) as columns."""
    if not where:
        values = values.reshape(len(values), 1, -1)  # of the whole body: all numbers are components
    if values.ndim == 2 or values.shape[-1] == 1:
        flat = values.reshape(len(values), -1)
        return [Column(name, flat if where else flat[:, 0], None, _measure(name), where)]
    width = values.shape[-1]
    values = values.reshape(len(values), -1, width)
    parts = tuple(_PARTS.get(width, ())) or _TENSORS.get(width) or tuple(map(str, range(width)))
    return [
        Column(f"{name}.{part}", values[:, :, i] if where else values[:, 0, i], None, _measure(name), where)
        for i, part in enumerate(parts)
    ]


def _measure(name: str) -> str:
    return "{length}" if name.lower() in {"u", "disp", "displacement", "displacements"} else ""
