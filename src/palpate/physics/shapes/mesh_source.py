"""The content of a volume mesh's file before it is judged: nodes, cells, and everything that the file calls by a name.

MeshSource   nodes, cells of volume, and groups of cells, faces and nodes
read_source  reads any format: two of palpate's own readers, else meshio, else PyVista
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from typing import Any

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.file_kinds import part_ending
from palpate.physics.apart import read_apart
from palpate.physics.shapes.abaqus_file import read_abaqus
from palpate.physics.shapes.body_file import named_files, read_with_meshio, tetgen_file
from palpate.physics.shapes.gmsh_file import is_gmsh_4, read_gmsh
from palpate.physics.shapes.mesh_groups import FACES, SOLIDS, Group, MeshSource, require_sound
from palpate.physics.shapes.naming import plain_name
from palpate.physics.shapes.packed_file import read_part, require_counts
from palpate.physics.shapes.vtk_file import read_grid

__all__ = ["read_source"]

VTK = (".vtu", ".vtk")
NASTRAN = (".bdf", ".nas", ".fem")
# formats whose numbers a library in C reads, which runs in a process of its own
LIBRARIES = {
    **dict.fromkeys((".xdmf", ".xmf", ".med", ".h5m"), "h5py"),
    **dict.fromkeys((".exo", ".e"), "netCDF4"),
}
# cell data that writers use for materials and groups, before any other
TAGS = ("gmsh:physical", "medit:ref", "cell_tags", "region", "Region", "material", "MaterialId")
# cell data that numbers the cells, or how the mesh was shared out
TECHNICAL = re.compile(
    r"ghost|original.*id|global.*id|(cell|element).?(id|number)s?$|partition|process|rank|gmsh:geometrical",
    re.I,
)
MOST_LABELS = 200  # numbers that differ more often are no labels
SOLID_CARD = re.compile(rb"^(CTETRA|CHEXA|CPENTA|CPYRAM?)\*?[ ,\t]", re.MULTILINE | re.IGNORECASE)
VTK_COUNT = re.compile(rb'\bNumberOfCells="(\d+)"|^CELL_TYPES (\d+)', re.MULTILINE)
PROPERTY = re.compile(
    rb'^\$\s*(?:HMNAME\s+(?:PROP|COMP)\s+(\d+)\s*"([^"]+)"|Femap.*?Property\s+(\d+)\s*:\s*(\S.*?))\s*$',
    re.MULTILINE | re.IGNORECASE,
)


def read_source(path: str, labels: str | None = None) -> MeshSource:
    """Read the file of a volume mesh.

    Its ending tells the format. `labels` names the cell data that numbers regions and surfaces; by default those of
    usual names, else the first whole numbers.
    """
    source = _read(path, labels)
    require_sound(source)
    return source


def _read(path: str, labels: str | None) -> MeshSource:
    ending = part_ending(path)
    if ending == ".inp":
        return read_abaqus(path)
    if ending == ".msh" and is_gmsh_4(path):
        return read_gmsh(path)
    mesh = _read_vtk(path) if ending in VTK else _read_other(path)
    if ending in NASTRAN:
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
    ending = part_ending(path)
    try:
        if ending in NASTRAN and not (content := read_part(path)).count(b"BEGIN BULK"):
            # Gmsh writes the bulk data alone
            return read_with_meshio(path, b"BEGIN BULK\n" + content)
        if ending in LIBRARIES and _is_installed(LIBRARIES[ending]):
            return read_apart(read_with_meshio, path, doing=f"reading {path}")
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


def _is_installed(package: str) -> bool:
    try:
        return find_spec(package) is not None
    except ValueError:  # it is there, and not to be used
        return False


def _read_vtk(path: str) -> Any:
    """Read a VTK file by meshio; by PyVista where meshio doesn't know its form, or passes over kinds of cells."""
    content = read_part(path)
    require_counts(path, content)
    try:
        mesh = read_with_meshio(path)
    except FileFormatError:
        if part_ending(path) == ".vtu" and b"</VTKFile>" not in content[-200:]:
            raise  # cut short
        return read_grid(path)
    stated = sum(int(a or b) for a, b in VTK_COUNT.findall(content))
    return mesh if stated == sum(len(block.data) for block in mesh.cells) else read_grid(path)


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
        numbers = _numbers(source.path, key, [np.asarray(mesh.cell_data[key][row]) for row in rows])
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


def _numbers(path: str, key: str, blocks: list[np.ndarray]) -> np.ndarray:
    """Return the whole number of each cell; refuse data of which cells have several, or broken ones."""
    flat = [block.reshape(len(block), -1) for block in blocks]
    values = np.concatenate([block[:, :1] for block in flat]).ravel()
    if any(block.shape[1] != 1 for block in flat):
        what = f"{flat[0].shape[1]} numbers for each cell: a vector or a tensor"
    elif not np.issubdtype(values.dtype, np.number) or not _are_whole(values):
        what = "numbers that are not whole"
    else:
        return np.asarray(values, dtype=np.int64)
    raise UsageError(
        f"The cell data {key!r} of {path} can't tell regions apart.",
        why=f"They are {what}.",
        fix="Pass as labels the name of cell data with one whole number for each cell, or leave labels out.",
    )


def _are_whole(values: np.ndarray) -> bool:
    return bool((np.isfinite(values) & (values == np.round(values))).all())


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
    if not np.issubdtype(value.dtype, np.integer) and not _are_whole(value):
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
    cards = Counter(word.decode().upper() for word in SOLID_CARD.findall(read_part(path)))
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
    for match in PROPERTY.finditer(read_part(path)):
        number, name = (match[1], match[2]) if match[1] else (match[3], match[4])
        text = name.decode("utf-8", "replace")
        # a field holds one name; the same number may be a solid's or a shell's
        for dimension, mark in ((3, ""), (2, " ")):
            mesh.field_data.setdefault(text + mark, np.array([int(number), dimension]))


def _tetgen_faces(path: str, mesh: Any) -> list[Group]:
    """Boundary markers from the .face file that TetGen writes beside a mesh."""
    beside = tetgen_file(path, ".face")
    if not beside.exists():
        return []
    lines = [line.split("#")[0].split() for line in beside.read_text(encoding="utf-8").splitlines()]
    rows = [line for line in lines if line]
    if not rows or len(rows[0]) < 2 or int(rows[0][1]) == 0:
        return []
    nodes = tetgen_file(path, ".node").read_text(encoding="utf-8").splitlines()
    first = [line.split("#")[0].split() for line in nodes if line.split("#")[0].strip()][1]
    table = np.array([row[:5] for row in rows[1 : int(rows[0][0]) + 1]], dtype=np.int64)
    triangles, marks = table[:, 1:4] - int(first[0]), table[:, 4]
    return [
        Group(f"surface {mark}", np.column_stack([triangles, triangles[:, -1]])[marks == mark], numbered=True)
        for mark in np.unique(marks).tolist()
        if mark
    ]
