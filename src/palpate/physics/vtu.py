"""Files for ParaView: VTU for one solution, PVD for several.

VTK's XML format of unstructured grids, version 1.0 with 64-bit headers: arrays in base64, packed by zlib. Written
here and not by a mesh library, because none of those at hand writes what belongs to the whole (`FieldData`).
"""

from __future__ import annotations

import base64
import os
import sys
import zlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from palpate.errors import UsageError
from palpate.physics.deformed import ball_of, nodal_strain, require_state

__all__ = ["write_pvd", "write_vtu"]

TRIANGLE, TETRA = 5, 10  # VTK's numbers of cell types
# a number of the whole body, beside the nodes' means of the same name
CALLED = {"largest_strain": "largest strain at a quadrature point"}
NOT_HERE = -1  # region of a triangle, surface of a tetrahedron


def write_vtu(solution: Any, path: str | os.PathLike[str]) -> Path:
    """Write a solution as VTU.

    The cells are the tetrahedra and, after them, the triangles of the outer surface. Point data: ``displacement`` (m),
    ``largest strain`` (|λ − 1|) and, where the solution has it, ``von Mises stress`` (Pa). Cell data: ``region`` and
    ``surface``, numbers, −1 where a cell has none; the field data ``region: NAME`` and ``surface: NAME`` hold the
    number of each name (numbers alone, because not every reader takes words there). Field data: what else the solution
    knows of itself, in SI units: energies, response, the probe's centre and radius …

    Parameters
    ----------
    solution : SolidSolution
        Anything with `mesh` and `displacement`.
    path : path
        Ending in ``.vtu``.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    UsageError
        If the solution did not converge, the file can't be written or its name has another ending.
    """
    target = _ending_in(".vtu", path)
    require_state(solution)
    mesh = solution.mesh
    sections = [
        _section("FieldData", _metadata(solution)),
        f'<Piece NumberOfPoints="{len(mesh.points)}" NumberOfCells="{len(mesh.tetrahedra) + len(mesh.triangles)}">',
        _section("PointData", _point_data(solution)),
        _section("CellData", _cell_data(mesh)),
        _section("Points", {"Points": np.asarray(mesh.points, dtype=float)}),
        _section("Cells", _cells(mesh)),
        "</Piece>",
    ]
    body = "\n".join(["<UnstructuredGrid>", *sections, "</UnstructuredGrid>"])
    head = 'type="UnstructuredGrid" version="1.0" header_type="UInt64" compressor="vtkZLibDataCompressor"'
    return _write(target, head, body)


def write_pvd(
    solutions: Sequence[Any], path: str | os.PathLike[str], *, values: Iterable[float] | None = None
) -> Path:
    """Write solutions as a series that ParaView plays: a PVD file and a folder of VTU files beside it.

    Parameters
    ----------
    solutions : sequence of SolidSolution
        Steps of a load path or of time, in order.
    path : path
        Ending in ``.pvd``; the steps go to the folder ``NAME``.
    values : sequence of float, optional
        Time in s, or load, of each; 0, 1, 2 … by default.

    Returns
    -------
    pathlib.Path

    Raises
    ------
    UsageError
        If there are no solutions, not as many values, or a file can't be written.
    """
    target = _ending_in(".pvd", path)
    times = list(range(len(solutions))) if values is None else [float(v) for v in values]
    if not solutions or len(times) != len(solutions):
        raise UsageError(f"{len(solutions)} solutions and {len(times)} values make no series.")
    folder = target.with_suffix("")
    _made(folder)
    rows = []
    for step, (time, solution) in enumerate(zip(times, solutions, strict=True)):
        name = f"{step:04d}.vtu"
        write_vtu(solution, folder / name)
        file = quoteattr(f"{folder.name}/{name}")
        rows.append(f'<DataSet timestep="{time:.17g}" group="" part="0" file={file}/>')
    body = "\n".join(["<Collection>", *rows, "</Collection>"])
    return _write(target, 'type="Collection" version="0.1"', body)


def _point_data(solution: Any) -> dict[str, np.ndarray]:
    displacement = np.asarray(solution.displacement, dtype=float)
    data = {"displacement": displacement, "largest strain": nodal_strain(solution)}
    if getattr(solution, "von_mises", None) is not None:
        data["von Mises stress"] = np.asarray(solution.von_mises, dtype=float)
    return data


def _cell_data(mesh: Any) -> dict[str, np.ndarray]:
    no_surface = np.full(len(mesh.tetrahedra), NOT_HERE)
    no_region = np.full(len(mesh.triangles), NOT_HERE)
    return {
        "region": np.concatenate([mesh.region_of, no_region]).astype(np.int32),
        "surface": np.concatenate([no_surface, mesh.surface_of]).astype(np.int32),
    }


def _cells(mesh: Any) -> dict[str, np.ndarray]:
    solid, skin = np.asarray(mesh.tetrahedra), np.asarray(mesh.triangles)
    corners = np.repeat([4, 3], [len(solid), len(skin)])
    return {
        "connectivity": np.concatenate([solid.ravel(), skin.ravel()]).astype(np.int64),
        "offsets": np.cumsum(corners).astype(np.int64),
        "types": np.repeat([TETRA, TRIANGLE], [len(solid), len(skin)]).astype(np.uint8),
    }


def _metadata(solution: Any) -> dict[str, np.ndarray]:
    mesh = solution.mesh
    data: dict[str, np.ndarray] = {}
    names = ("potential_energy", "strain_energy", "response", "response_gradient", "penetration")
    for name in (*names, "least_volume_ratio", "largest_strain", "iterations", "residual"):
        value = getattr(solution, name, None)
        if value is not None:
            data[CALLED.get(name, name.replace("_", " "))] = np.atleast_1d(
                np.asarray(value, dtype=float)
            ).reshape(1, -1)
    if (sphere := ball_of(solution, True)) is not None:
        data["probe centre and radius"] = np.array([[*sphere[0], sphere[1]]])
    for kind, all_names in (("region", mesh.regions), ("surface", mesh.surfaces)):
        data |= {f"{kind}: {name}": np.array([i], dtype=np.int32) for i, name in enumerate(all_names)}
    return data


def _section(tag: str, arrays: Mapping[str, np.ndarray]) -> str:
    rows = [_array(name, values) for name, values in arrays.items()]
    return "\n".join([f"<{tag}>", *rows, f"</{tag}>"])


def _array(name: str, values: np.ndarray) -> str:
    kind = {"f": "Float", "i": "Int", "u": "UInt"}[values.dtype.kind] + str(8 * values.dtype.itemsize)
    width = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
    count = f' NumberOfTuples="{len(values)}"'
    head = f'<DataArray type={quoteattr(kind)} Name={quoteattr(name)}{width}{count} format="binary">'
    return f"{head}{_packed(np.ascontiguousarray(values))}</DataArray>"


def _packed(values: np.ndarray) -> str:
    """One zlib block, after its header: count of blocks, size of a block, of the last, and packed."""
    data = values.tobytes()
    packed = zlib.compress(data)
    header = np.array([1, len(data), len(data), len(packed)], dtype=np.uint64)
    return base64.b64encode(header.tobytes()).decode() + base64.b64encode(packed).decode()


def _ending_in(suffix: str, path: str | os.PathLike[str]) -> Path:
    target = Path(path)
    if target.suffix.lower() == suffix:
        return target
    raise UsageError(
        f"The file {target} doesn't end in {suffix}.",
        why="ParaView tells a file's format by its name.",
        fix=f"Write to {target.with_suffix(suffix).name if target.name else 'NAME' + suffix}.",
    )


def _write(path: Path, head: str, body: str) -> Path:
    order = "LittleEndian" if sys.byteorder == "little" else "BigEndian"
    text = '<?xml version="1.0"?>\n<!-- written by palpate; SI units -->\n'
    text += f'<VTKFile {head} byte_order="{order}">\n{body}\n</VTKFile>\n'
    try:
        path.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise UsageError(f"Could not write {path}.", why=str(error)) from error
    return path


def _made(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"Could not make the folder {folder}.", why=str(error)) from error
