"""Files of VTK in forms that only VTK itself reads, in a child process: damaged ones end their reader's process."""

from __future__ import annotations

from importlib.util import find_spec
from types import SimpleNamespace
from typing import Any

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.physics.apart import read_apart
from palpate.physics.shapes.packed_file import plain_file

__all__ = ["read_grid", "read_polydata"]

# VTK's numbers of cells, and meshio's words for them
VTK_CELLS = {
    **{5: "triangle", 22: "triangle6", 9: "quad", 23: "quad8", 28: "quad9", 10: "tetra", 24: "tetra10"},
    **{12: "hexahedron", 25: "hexahedron20", 29: "hexahedron27", 13: "wedge", 26: "wedge15", 14: "pyramid"},
    **{27: "pyramid13", 69: "triangle", 70: "quad", 71: "tetra", 72: "hexahedron", 73: "wedge"},
    **{74: "pyramid", 42: "polyhedron", 7: "polygon"},
    **dict.fromkeys((1, 2), "vertex"),
    **dict.fromkeys((3, 4, 21, 68), "line"),
}
VOXEL, PIXEL = 11, 8  # VTK's boxes, whose corners run along x first


def read_polydata(path: str) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes (n, 3) and triangles (t, 3) of a VTP file, or of a legacy file of polydata."""
    _require_pyvista(path)
    points, triangles = read_apart(_polydata, path, doing=f"VTK read {path}")
    return points, triangles


def read_grid(path: str) -> Any:
    """Return a file of VTK's cells in the layout of a `meshio.Mesh`."""
    _require_pyvista(path)
    return read_apart(_grid, path, doing=f"VTK read {path}")


def _require_pyvista(path: str) -> None:
    if find_spec("pyvista") is None:
        raise UsageError(
            f"The file {path} can't be read without the package pyvista.",
            why="It is damaged, or of a form that only VTK reads: surfaces, LZ4, legacy 5.1, texts among the numbers, "
            "boxes.",
            fix="pip install 'palpate[results]', or export a surface as STL, a mesh with zlib or as legacy VTK 4.2.",
        )


def _read(path: str) -> Any:
    """Return PyVista's object of a file; a function for the child process in which VTK runs."""
    import pyvista

    faults: list[str] = []
    try:
        with plain_file(path) as plain:
            reader = pyvista.get_reader(plain)
            # VTK prints what it finds wrong, and goes on with what it has
            reader.reader.AddObserver("ErrorEvent", lambda *_: faults.append("VTK reports an error"))
            grid = reader.read()
    except (OSError, ValueError, TypeError, RuntimeError, AttributeError) as error:
        raise _damaged(path, str(error)) from error
    if faults or not grid.n_cells:
        raise _damaged(path, faults[0] if faults else "it has no cells")
    return grid


def _polydata(path: str) -> tuple[np.ndarray, np.ndarray]:
    import pyvista

    grid = _read(path)
    if not isinstance(grid, pyvista.PolyData):
        grid = grid.extract_surface()
    # lines and lone points go with the cut into triangles; strips and polygons become triangles
    faces = np.asarray(grid.triangulate().faces).reshape(-1, 4)
    return np.asarray(grid.points, dtype=float), faces[:, 1:].astype(np.int64)


def _grid(path: str) -> Any:
    grid = _read(path).cast_to_unstructured_grid()
    kinds = np.asarray(grid.celltypes)
    # PyVista 0.49 renamed it
    offset = np.asarray(grid.cell_offsets if hasattr(grid, "cell_offsets") else grid.offset)
    connectivity = np.asarray(grid.cell_connectivity)
    cells, rows = [], []
    for kind in np.unique(kinds).tolist():
        chosen = np.flatnonzero(kinds == kind)
        size = int(offset[chosen[0] + 1] - offset[chosen[0]])
        word = VTK_CELLS.get(kind, f"cell of VTK type {kind}")
        if (np.diff(offset)[chosen] != size).any():
            nodes = np.empty((len(chosen), 0), dtype=int)
        else:
            nodes = connectivity[offset[chosen][:, None] + np.arange(size)]
        if kind == VOXEL:
            word, nodes = "hexahedron", nodes[:, [0, 1, 3, 2, 4, 5, 7, 6]]
        if kind == PIXEL:
            word, nodes = "quad", nodes[:, [0, 1, 3, 2]]
        cells.append(SimpleNamespace(type=word, data=nodes))
        rows.append(chosen)
    data = {name: [np.asarray(grid.cell_data[name])[chosen] for chosen in rows] for name in grid.cell_data}
    return SimpleNamespace(
        points=np.asarray(grid.points),
        cells=cells,
        cell_data=data,
        field_data={},
        cell_sets={},
        point_sets={},
    )


def _damaged(path: str, said: str) -> FileFormatError:
    return FileFormatError(
        f"The file {path} can't be read as a mesh.",
        why=f"It is damaged or cut short ({said.strip()}).",
        fix="Open it in the program that made it and export it again, as VTU for example.",
    )
