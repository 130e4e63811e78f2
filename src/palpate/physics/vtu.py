"""Files for ParaView: VTU for one solution, PVD for several.

meshio writes mesh and fields; what belongs to the whole body (`FieldData`) it reads but does not write, so that is
added here.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from palpate.errors import UsageError
from palpate.files import system_errors, writing
from palpate.physics.deformed import ball_of, nodal_strain, require_state

__all__ = ["write_pvd", "write_vtu"]

# a number of the whole body, beside the nodes' means of the same name
TITLES = {"largest_strain": "largest strain at a quadrature point"}
NOWHERE = -1  # the region of a triangle and the surface of a tetrahedron, which have none


def write_vtu(solution: Any, path: str | os.PathLike[str]) -> Path:
    """Write a solution, anything with `mesh` and `displacement`, as a file that ends in ``.vtu``, and return its path.

    The cells are the tetrahedra and, after them, the triangles of the outer surface. Point data: ``displacement`` (m),
    ``largest strain`` (|λ − 1|) and, where the solution has it, ``von Mises stress`` (Pa). Cell data: ``region`` and
    ``surface``, numbers, −1 where a cell has none; the field data ``region: NAME`` and ``surface: NAME`` hold the
    number of each name (numbers alone, because not every reader takes words there). Field data: what else the solution
    knows of itself, in SI units: energies, response, the probe's centre and radius …
    """
    import meshio

    target = _require_ending(".vtu", path)
    require_state(solution)
    mesh = solution.mesh
    blocks = [
        ("tetra", mesh.tetrahedra, mesh.region_of, np.full(len(mesh.tetrahedra), NOWHERE)),
        ("triangle", mesh.triangles, np.full(len(mesh.triangles), NOWHERE), mesh.surface_of),
    ]
    blocks = [block for block in blocks if len(block[1])]
    cells = [(kind, nodes) for kind, nodes, _, _ in blocks]
    data = {
        name: [np.asarray(block[column], dtype=np.int32) for block in blocks]
        for name, column in (("region", 2), ("surface", 3))
    }
    grid = meshio.Mesh(mesh.points, cells, point_data=_point_data(solution), cell_data=data)
    with writing(target) as part:
        meshio.vtu.write(part, grid, header_type="UInt64")
        # what belongs to the whole body meshio reads, but does not write
        tree = ElementTree.parse(part)
        body = tree.getroot().find("UnstructuredGrid")
        assert body is not None
        body.insert(0, _field_data(_metadata(solution)))
        tree.write(part, encoding="utf-8", xml_declaration=True)
    return target


def write_pvd(
    solutions: Sequence[Any], path: str | os.PathLike[str], *, values: Iterable[float] | None = None
) -> Path:
    """Write solutions as a series that ParaView plays: a PVD file, whose path is returned, and a folder of VTU files.

    The name ends in ``.pvd``; the steps go to the folder ``NAME`` beside it. `values` are the time in s, or the load,
    of each of the solutions, which are in order; 0, 1, 2 … by default.
    """
    target = _require_ending(".pvd", path)
    times = list(range(len(solutions))) if values is None else [float(v) for v in values]
    if not solutions or len(times) != len(solutions):
        raise UsageError(f"{len(solutions)} solutions and {len(times)} values make no series.")
    folder = target.with_suffix("")
    with system_errors(f"Could not write {folder}."):
        folder.mkdir(parents=True, exist_ok=True)
    file = ElementTree.Element("VTKFile", type="Collection", version="0.1")
    collection = ElementTree.SubElement(file, "Collection")
    for step, (time, solution) in enumerate(zip(times, solutions, strict=True)):
        name = f"{step:04d}.vtu"
        write_vtu(solution, folder / name)
        entry = {"timestep": f"{time:.17g}", "group": "", "part": "0", "file": f"{folder.name}/{name}"}
        ElementTree.SubElement(collection, "DataSet", entry)
    with writing(target) as part:
        ElementTree.ElementTree(file).write(part, encoding="utf-8", xml_declaration=True)
    return target


def _point_data(solution: Any) -> dict[str, np.ndarray]:
    displacement = np.asarray(solution.displacement, dtype=float)
    data = {"displacement": displacement, "largest strain": nodal_strain(solution)}
    if getattr(solution, "von_mises", None) is not None:
        data["von Mises stress"] = np.asarray(solution.von_mises, dtype=float)
    return data


def _metadata(solution: Any) -> dict[str, np.ndarray]:
    mesh = solution.mesh
    data: dict[str, np.ndarray] = {}
    names = ("potential_energy", "strain_energy", "response", "response_gradient", "penetration")
    for name in (*names, "least_volume_ratio", "largest_strain", "iterations", "residual"):
        value = getattr(solution, name, None)
        if value is not None:
            data[TITLES.get(name, name.replace("_", " "))] = np.atleast_1d(
                np.asarray(value, dtype=float)
            ).reshape(1, -1)
    if (sphere := ball_of(solution, True)) is not None:
        data["probe centre and radius"] = np.array([[*sphere[0], sphere[1]]])
    for kind, all_names in (("region", mesh.regions), ("surface", mesh.surfaces)):
        data |= {f"{kind}: {name}": np.array([i], dtype=np.int32) for i, name in enumerate(all_names)}
    return data


def _field_data(arrays: Mapping[str, np.ndarray]) -> ElementTree.Element:
    """Return the XML element of arrays that belong to the whole body."""
    element = ElementTree.Element("FieldData")
    for name, values in arrays.items():
        kind = "Float64" if values.dtype.kind == "f" else "Int32"
        head = {"type": kind, "Name": name, "NumberOfTuples": str(len(values)), "format": "ascii"}
        width = {"NumberOfComponents": str(values.shape[1])} if values.ndim == 2 else {}
        row = ElementTree.SubElement(element, "DataArray", head | width)
        row.text = " ".join(map(repr, values.ravel().tolist()))
    return element


def _require_ending(suffix: str, path: str | os.PathLike[str]) -> Path:
    target = Path(path)
    if target.suffix.lower() == suffix:
        return target
    raise UsageError(
        f"The file {target} doesn't end in {suffix}.",
        why="ParaView tells a file's format by its name.",
        fix=f"Write to {target.with_suffix(suffix).name if target.name else 'NAME' + suffix}.",
    )
