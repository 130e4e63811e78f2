"""The content of a volume mesh's file before it is judged: nodes, cells, and everything that the file calls by a name.

MeshSource   nodes, cells of volume, and groups of cells, faces and nodes
read_source  reads any format: two of palpate's own readers, else meshio, else PyVista
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.input_files import read_input
from palpate.physics.shapes.abaqus_file import read_abaqus
from palpate.physics.shapes.body_file import named_files, read_with_meshio
from palpate.physics.shapes.gmsh_file import is_gmsh_4, read_gmsh
from palpate.physics.shapes.mesh_groups import FACES, SOLIDS, Group, MeshSource
from palpate.physics.shapes.naming import plain_name

__all__ = ["read_source"]

VTK = (".vtu", ".vtk")
# cell data that writers use for materials and groups, before any other
TAGS = ("gmsh:physical", "medit:ref", "cell_tags", "region", "Region", "material", "MaterialId")
# cell data that numbers the cells, or how the mesh was shared out
TECHNICAL = re.compile(
    r"ghost|original.*id|global.*id|(cell|element).?(id|number)s?$|partition|process|rank|gmsh:geometrical",
    re.I,
)
MOST_LABELS = 200  # numbers that differ more often are no labels
# VTK's numbers of cells, and meshio's words for them
VTK_CELLS = {
    **{5: "triangle", 22: "triangle6", 9: "quad", 23: "quad8", 28: "quad9", 10: "tetra", 24: "tetra10"},
    **{12: "hexahedron", 25: "hexahedron20", 29: "hexahedron27", 13: "wedge", 26: "wedge15", 14: "pyramid"},
    **{
        27: "pyramid13",
        69: "triangle",
        70: "quad",
        71: "tetra",
        72: "hexahedron",
        73: "wedge",
        74: "pyramid",
    },
    **{
        1: "vertex",
        2: "vertex",
        3: "line",
        4: "line",
        21: "line",
        68: "line",
        42: "polyhedron",
        7: "polygon",
    },
}
VOXEL, PIXEL = 11, 8  # VTK's boxes, whose corners run along x first
SOLID_CARD = re.compile(rb"^(CTETRA|CHEXA|CPENTA|CPYRAM?)\*?[ ,\t]", re.MULTILINE | re.IGNORECASE)
VTK_COUNT = re.compile(rb'\bNumberOfCells="(\d+)"|^CELL_TYPES (\d+)', re.MULTILINE)
PROPERTY = re.compile(
    rb'^\$\s*(?:HMNAME\s+(?:PROP|COMP)\s+(\d+)\s*"([^"]+)"|Femap.*?Property\s+(\d+)\s*:\s*(\S.*?))\s*$',
    re.MULTILINE | re.IGNORECASE,
)


def read_source(path: str, labels: str | None = None) -> MeshSource:
    """Read the file of a volume mesh.

    Parameters
    ----------
    path : str
        The file; its ending tells the format.
    labels : str, optional
        Name of the cell data that numbers regions and surfaces; by default those of usual names, else the first
        whole numbers.

    Raises
    ------
    FileFormatError
        If the file is corrupt, or of an unknown format.
    UsageError
        If reading it needs a package that is not installed.
    """
    ending = Path(path).suffix.lower()
    if ending == ".inp":
        return read_abaqus(path)
    if ending == ".msh" and is_gmsh_4(path):
        return read_gmsh(path)
    mesh = _read_vtk(path) if ending in VTK else _read_other(path)
    if ending in {".bdf", ".nas", ".fem"}:
        _require_all_cards(path, mesh)
        _require_basic_system(path, mesh)
        _name_properties(path, mesh)
    source = _collect(path, mesh, labels)
    source.notes.extend(f"The reader says: {line}" for line in _skip_messages(mesh))
    if ending in {".node", ".ele"}:
        source.faces.extend(_tetgen_faces(path, mesh))
    return source


def _read_other(path: str) -> Any:
    """Read a file by meshio; say which file is missing where its numbers stand in another one."""
    try:
        return read_with_meshio(path)
    except FileFormatError as error:
        missing = [other for other in named_files(path) if not other.is_file()]
        if not missing:
            raise
        raise UsageError(
            f"The file {missing[0].name}, which {path} names, is missing.",
            why="The numbers of the mesh stand in it.",
            fix="Keep both files in one folder.",
        ) from error


def _read_vtk(path: str) -> Any:
    """Read a VTK file by meshio; by PyVista where meshio doesn't know its form, or passes over kinds of cells."""
    content = read_input(path)
    try:
        mesh = read_with_meshio(path)
    except FileFormatError:
        if path.lower().endswith(".vtu") and b"</VTKFile>" not in content[-200:]:
            raise  # cut short
        return _read_with_pyvista(path)
    stated = sum(int(a or b) for a, b in VTK_COUNT.findall(content))
    return mesh if stated == sum(len(block.data) for block in mesh.cells) else _read_with_pyvista(path)


def _read_with_pyvista(path: str) -> Any:
    """Read a VTK file in a form that meshio doesn't know, in the layout of a `meshio.Mesh`."""
    if find_spec("pyvista") is None:
        raise UsageError(
            f"The file {path} can't be read without the package pyvista.",
            why="It is damaged, or of a form that only VTK reads: LZ4, legacy 5.1, texts among the numbers, boxes.",
            fix="pip install 'palpate[results]', or export it with zlib compression or as legacy VTK 4.2.",
        )
    import pyvista

    faults: list[str] = []
    try:
        reader = pyvista.get_reader(path)
        # VTK prints what it finds wrong, and goes on with what it has
        reader.reader.AddObserver("ErrorEvent", lambda *_: faults.append("VTK reports an error"))
        grid = reader.read().cast_to_unstructured_grid()
    except (OSError, ValueError, TypeError, RuntimeError, AttributeError) as error:
        raise _damaged_vtk(path, str(error)) from error
    if faults or not grid.n_cells:
        raise _damaged_vtk(path, faults[0] if faults else "it has no cells")
    kinds = np.asarray(grid.celltypes)
    # PyVista 0.49 renamed it
    offset = np.asarray(grid.cell_offsets if hasattr(grid, "cell_offsets") else grid.offset)
    connectivity = np.asarray(grid.cell_connectivity)
    cells, rows = [], []
    for kind in np.unique(kinds).tolist():
        chosen = np.flatnonzero(kinds == kind)
        size = int(offset[chosen[0] + 1] - offset[chosen[0]])
        if (np.diff(offset)[chosen] != size).any():
            word, nodes = (
                VTK_CELLS.get(kind, f"cell of VTK type {kind}"),
                np.empty((len(chosen), 0), dtype=int),
            )
        else:
            nodes = connectivity[offset[chosen][:, None] + np.arange(size)]
            word = VTK_CELLS.get(kind, f"cell of VTK type {kind}")
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


def _damaged_vtk(path: str, said: str) -> FileFormatError:
    return FileFormatError(
        f"The file {path} can't be read as a mesh.",
        why=f"It is damaged or cut short ({said.strip()}).",
        fix="Open it in the program that made it and export it again, as VTU for example.",
    )


def _kind(word: str) -> str:
    """Return the kind of cell without the number of its nodes: ``hexahedron20`` is a hexahedron."""
    return word.rstrip("0123456789")


def _collect(path: str, mesh: Any, labels: str | None) -> MeshSource:
    """Return the content of a `meshio.Mesh`."""
    points = np.zeros((len(mesh.points), 3))
    points[:, : mesh.points.shape[1]] = np.asarray(mesh.points, dtype=float)
    source = MeshSource(path, points)
    solid_rows: list[int] = []
    face_rows: list[int] = []
    for row, block in enumerate(mesh.cells):
        kind = _kind(block.type)
        data = block.data
        if kind in SOLIDS and len(data):
            source.add_solids(kind, np.asarray(data)[:, : SOLIDS[kind]])
            solid_rows.append(row)
        elif kind in FACES and len(data):
            face_rows.append(row)
            source.count_other(kind, len(data))
        else:
            source.count_other(block.type, len(data))
    _collect_numbers(source, mesh, labels, solid_rows, face_rows)
    _collect_sets(source, mesh, solid_rows, face_rows)
    return source


def _collect_numbers(
    source: MeshSource, mesh: Any, labels: str | None, solid_rows: list[int], face_rows: list[int]
) -> None:
    """Add a group for each number in the cell data that label cells."""
    if labels is not None and labels not in mesh.cell_data:
        known = ", ".join(mesh.cell_data) or "none"
        raise UsageError(
            f"{source.path} has no cell data {labels!r}.",
            why=f"Its cell data are: {known}.",
            fix="Pass the name of one that numbers regions, or leave labels out.",
        )
    for rows, dimension in ((solid_rows, 3), (face_rows, 2)):
        key = labels or _label_key(source, mesh.cell_data, rows, dimension)
        if key is None or not rows:
            continue
        numbers = np.concatenate([np.asarray(mesh.cell_data[key][row]).ravel() for row in rows]).astype(
            np.int64
        )
        names = _names_of_numbers(mesh, key, dimension)
        for number in np.unique(numbers).tolist():
            if number == 0 and 0 not in names and dimension == 2:
                continue  # 0 is what writers put where nothing was said
            name = names.get(number, f"{'region' if dimension == 3 else 'surface'} {number}")
            chosen = numbers == number
            if dimension == 3:
                source.regions.append(Group(name, np.flatnonzero(chosen), numbered=number not in names))
            else:
                source.faces.append(_face_group(name, mesh, rows, chosen, numbered=number not in names))


def _face_group(
    name: str, mesh: Any, rows: list[int], chosen: np.ndarray, *, numbered: bool = False
) -> Group:
    """Return the group of the chosen cells of several blocks of triangles and quads."""
    ends = np.cumsum([len(mesh.cells[row].data) for row in rows])[:-1]
    parts = []
    for row, mine in zip(rows, np.split(chosen, ends), strict=True):
        block = mesh.cells[row]
        corners = np.asarray(block.data)[mine][:, : FACES[_kind(block.type)]]
        parts.append(np.column_stack([corners, corners[:, -1]]) if corners.shape[1] == 3 else corners)
    return Group(name, np.concatenate(parts), numbered=numbered)


def _names_of_numbers(mesh: Any, key: str, dimension: int) -> dict[int, str]:
    """Names that the file gives to numbers of cells of a dimension."""
    names = {
        int(value[0]): plain_name(name)
        for name, value in mesh.field_data.items()
        if np.size(value) == 2 and int(value[1]) == dimension
    }
    families = getattr(mesh, "cell_tags", None)  # of MED files: family number to its groups
    if key == "cell_tags" and isinstance(families, Mapping):
        names |= {int(number): plain_name(" ".join(groups)) for number, groups in families.items() if groups}
    return names


def _label_key(
    source: MeshSource, data: Mapping[str, Sequence[Any]], rows: list[int], dimension: int
) -> str | None:
    """Name of the cell data that labels cells: the usual ones first, then whole numbers that differ."""
    if not rows:
        return None
    values = {
        key: np.concatenate([np.asarray(blocks[row]).reshape(len(blocks[row]), -1) for row in rows])
        for key, blocks in data.items()
        if len({np.asarray(blocks[row]).reshape(len(blocks[row]), -1).shape[1] for row in rows}) == 1
    }
    fit = {key: value for key, value in values.items() if _are_labels(value)}
    usual = [tag for tag in TAGS if tag in fit]
    if usual:
        return usual[0]
    varied = [key for key, value in fit.items() if not TECHNICAL.search(key) and len(np.unique(value)) > 1]
    if not varied and "gmsh:geometrical" in fit and len(np.unique(fit["gmsh:geometrical"])) > 1:
        return "gmsh:geometrical"
    if len(varied) > 1 and dimension == 3:
        others = ", ".join(repr(key) for key in varied[1:])
        source.notes.append(
            f"Regions are those of the cell data {varied[0]!r}; {others} could be meant too (labels=…)."
        )
    return varied[0] if varied else None


def _are_labels(value: np.ndarray) -> bool:
    if value.shape[1] != 1 or not np.issubdtype(value.dtype, np.number):
        return False
    if (
        not np.issubdtype(value.dtype, np.integer)
        and not (np.isfinite(value) & (value == np.round(value))).all()
    ):
        return False
    return len(np.unique(value)) <= MOST_LABELS


def _collect_sets(source: MeshSource, mesh: Any, solid_rows: list[int], face_rows: list[int]) -> None:
    """Add the named sets of cells and nodes that some formats have."""
    for name, blocks in mesh.cell_sets.items():
        if name.startswith("gmsh:") or not isinstance(blocks, Sequence) or len(blocks) != len(mesh.cells):
            continue
        for rows, dimension in ((solid_rows, 3), (face_rows, 2)):
            if not rows:
                continue
            masks = [np.zeros(len(mesh.cells[row].data), dtype=bool) for row in rows]
            for mask, row in zip(masks, rows, strict=True):
                if blocks[row] is not None:
                    mask[np.asarray(blocks[row], dtype=np.int64)] = True
            chosen = np.concatenate(masks)
            if not chosen.any():
                continue
            if dimension == 3:
                source.regions.append(Group(plain_name(name), np.flatnonzero(chosen)))
            else:
                source.faces.append(_face_group(plain_name(name), mesh, rows, chosen))
    for name, nodes in getattr(mesh, "point_sets", {}).items():
        source.node_sets.append(Group(plain_name(name), np.asarray(nodes, dtype=np.int64).ravel()))


def _skip_messages(mesh: Any) -> list[str]:
    """Return what meshio says about things that it passes over."""
    lines = [" ".join(line.split()) for line in getattr(mesh, "said", "").splitlines()]
    return list(
        dict.fromkeys(line for line in lines if re.search(r"skip|ignor|unsupported|not support", line, re.I))
    )


def _require_all_cards(path: str, mesh: Any) -> None:
    """Refuse a Nastran file of which meshio has passed over cells, as it does with those of sixteen columns."""
    cards = Counter(word.decode().upper() for word in SOLID_CARD.findall(read_input(path)))
    there = sum(cards.values())
    read = sum(len(block.data) for block in mesh.cells if _kind(block.type) in SOLIDS)
    if read != there:
        raise UsageError(
            f"{there - read} of {there} cells of volume in {path} can't be read.",
            why=f"It has {', '.join(f'{count} {word}' for word, count in cards.items())}; those in fields of sixteen "
            "columns or in lower case are not known.",
            fix="Export the mesh with fields of eight columns.",
        )


def _require_basic_system(path: str, mesh: Any) -> None:
    """Refuse Nastran nodes in a coordinate system of their own, which is not read."""
    systems = np.asarray(mesh.point_data.get("nastran:ref", 0))
    if systems.any():
        raise UsageError(
            f"{int((systems != 0).sum())} nodes of {path} are given in a coordinate system of their own.",
            why=f"Their GRID cards name system {int(systems[systems != 0][0])}, which is not read.",
            fix="Export the mesh with all nodes in the basic system.",
        )


def _name_properties(path: str, mesh: Any) -> None:
    """Add the names that preprocessors write into comments of a Nastran file to the numbers of properties."""
    for match in PROPERTY.finditer(read_input(path)):
        number, name = (match[1], match[2]) if match[1] else (match[3], match[4])
        text = name.decode("utf-8", "replace")
        # a field holds one name; the same number may be a solid's or a shell's
        for dimension, mark in ((3, ""), (2, " ")):
            mesh.field_data.setdefault(text + mark, np.array([int(number), dimension]))


def _tetgen_faces(path: str, mesh: Any) -> list[Group]:
    """Boundary markers from the .face file that TetGen writes beside a mesh."""
    beside = Path(path).with_suffix(".face")
    if not beside.exists():
        return []
    lines = [line.split("#")[0].split() for line in beside.read_text(encoding="utf-8").splitlines()]
    rows = [line for line in lines if line]
    if not rows or len(rows[0]) < 2 or int(rows[0][1]) == 0:
        return []
    nodes = Path(path).with_suffix(".node").read_text(encoding="utf-8").splitlines()
    first = [line.split("#")[0].split() for line in nodes if line.split("#")[0].strip()][1]
    table = np.array([row[:5] for row in rows[1 : int(rows[0][0]) + 1]], dtype=np.int64)
    triangles, marks = table[:, 1:4] - int(first[0]), table[:, 4]
    return [
        Group(f"surface {mark}", np.column_stack([triangles, triangles[:, -1]])[marks == mark], numbered=True)
        for mark in np.unique(marks).tolist()
        if mark
    ]
