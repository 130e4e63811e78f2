"""Results in other solvers' own formats that VTK reads: Exodus, EnSight, OpenFOAM, CGNS and XDMF.

Each time of a file is a case. Files of several blocks are put together; nodes that blocks share stay apart, as they
stand in the file. The readers are C++ and work in a child process.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from palpate.dataset.readers.results import Results
from palpate.dataset.readers.vtk_files import (
    INSTALL,
    Grid,
    cells_of,
    damage_error,
    require_one_mesh,
    results_of_grids,
    sound_grid,
)
from palpate.errors import UsageError
from palpate.input_files import DAMAGE, read_input
from palpate.supervised import read_in_child

__all__ = ["EMPTY", "SUFFIXES", "read_mesh_results"]

SUFFIXES = (".exo", ".ex2", ".exii", ".e", ".case", ".foam", ".cgns", ".xdmf", ".xmf")
EMPTY = (".foam",)
"""Endings of files that are empty by custom, and only name their folder."""
_LARGEST_LIST = 50_000_000  # bytes of an XDMF file whose XML is looked at
_BOUNDARY = "boundary"  # OpenFOAM's block of patches, beside that of the volume


def read_mesh_results(path: Path) -> Results:
    """Read a file of Exodus, EnSight (``.case``), OpenFOAM (``.foam``), CGNS or XDMF with the files that it names."""
    if importlib.util.find_spec("pyvista") is None:
        raise UsageError(f"{path} can't be read without PyVista.", fix=INSTALL)
    grids, times = read_in_child(_read_steps, path)
    require_one_mesh([path] * len(grids), grids)
    return results_of_grids(path, grids, times)


def _read_steps(path: Path) -> tuple[list[Grid], np.ndarray | None]:
    """Return a grid for each time of a file, and the times; None where it has none."""
    import pyvista
    from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow

    usual, said = vtkOutputWindow.GetInstance(), vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(said)  # readers within readers report to it what no observer hears
    try:
        reader: Any = pyvista.get_reader(
            str(path), force_ext=".xdmf" if path.suffix.lower() == ".xmf" else None
        )
        _enable_all(reader)
        times = list(getattr(reader, "time_values", ()) or ())
        grids = []
        for time in times or [None]:
            if time is not None:
                reader.set_active_time_value(time)
            grids.append(_grid(path, reader.read()))
    except DAMAGE as error:
        raise damage_error(path, str(error)) from error
    finally:
        vtkOutputWindow.SetInstance(usual)
    faults = [line.strip() for line in said.GetOutput().splitlines() if "ERR" in line or "Error" in line]
    if faults:
        raise damage_error(
            path, faults[0][:200], "Keep the files that it names beside it, or export it again."
        )
    return grids, np.array(times, dtype=float) if times else None


def _enable_all(reader: Any) -> None:
    """Ask a reader for all arrays: some read none by themselves."""
    for name in ("enable_all_point_arrays", "enable_all_cell_arrays"):
        if hasattr(reader, name):
            getattr(reader, name)()
    vtk = reader.reader
    if hasattr(vtk, "SetAllArrayStatus"):  # Exodus: by kind of object
        vtk.UpdateInformation()
        for kind in (vtk.NODAL, vtk.ELEM_BLOCK, vtk.GLOBAL):
            vtk.SetAllArrayStatus(kind, 1)
    if hasattr(vtk, "SetSqueezePoints"):
        vtk.SetSqueezePoints(0)  # the nodes in the order of the file
    if hasattr(vtk, "SetApplyDisplacements"):
        vtk.SetApplyDisplacements(0)  # the mesh at rest; the displacement is a field


def _series_names(path: Path) -> frozenset[str]:
    """Return the names of the series in an XDMF file; the mesh that they share stands beside them, with old numbers."""
    if path.suffix.lower() not in {".xdmf", ".xmf"} or path.stat().st_size > _LARGEST_LIST:
        return frozenset()
    grids = ElementTree.fromstring(read_input(path)).iter("Grid")
    return frozenset(grid.get("Name", "") for grid in grids if grid.get("CollectionType") == "Temporal")


def _blocks(data: Any, series: frozenset[str] = frozenset(), name: str = "") -> Iterator[Any]:
    """Yield the meshes of a tree of blocks, without OpenFOAM's patches; of an XDMF file those of its series."""
    if data is None or name == _BOUNDARY:
        return
    if hasattr(data, "keys") and hasattr(data, "n_blocks"):
        names = [str(data.get_block_name(i) or "") for i in range(data.n_blocks)]
        chosen = [i for i, own in enumerate(names) if own in series] or range(len(names))
        for i in chosen:
            yield from _blocks(data[i], series, names[i])
    elif data.n_points and data.n_cells:
        yield data.cast_to_unstructured_grid()


def _grid(path: Path, data: Any) -> Grid:
    blocks = list(_blocks(data, _series_names(path)))
    if not blocks:
        raise damage_error(path, "it has no cells")
    whole: Any = blocks[0]
    if len(blocks) > 1:
        whole = whole.merge(blocks[1:], merge_points=False)
    cells, numbers = cells_of(whole)
    at_nodes = dict(whole.point_data.items())
    # OpenFOAM's values belong to cells; those at nodes are made of them, and have the same name
    at_cells = {f"{name} at cells" if name in at_nodes else name: v for name, v in whole.cell_data.items()}
    points = np.asarray(whole.points, dtype=float)
    return sound_grid(
        path, points, cells, numbers, int(whole.n_cells), at_nodes, at_cells, dict(whole.field_data.items())
    )
