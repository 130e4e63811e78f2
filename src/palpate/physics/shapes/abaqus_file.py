"""Input files of Abaqus and CalculiX: nodes, elements, sets, surfaces, parts and their instances.

Keywords and the order of nodes on the faces of elements after the Abaqus Keywords Reference Guide, and the CalculiX
CrunchiX manual (Dhondt, https://www.calculix.de), which agree on them.

read_abaqus   the mesh of a file, its assembly put together
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.physics.shapes.mesh_groups import SOLIDS, Group, MeshSource
from palpate.physics.shapes.naming import plain_name
from palpate.physics.shapes.packed_file import read_part

__all__ = ["read_abaqus"]

MOST_NUMBERS = 5_000_000  # that a line may generate
DEEPEST = 10  # files that include each other
# keywords that make nodes or elements out of others
MAKERS = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SUBMODEL")
SOLID = re.compile(r"D?C3D(\d+)")
SHELL = re.compile(r"(?:STRI|DS|SFM3D|M3D|R3D|CPS|CPE|CAX|S)(\d+)")
# kinds of solid elements by their numbers of nodes
KINDS = {
    **dict.fromkeys((4, 10), "tetra"),
    **dict.fromkeys((8, 20, 27), "hexahedron"),
    **dict.fromkeys((6, 15), "wedge"),
    **dict.fromkeys((5, 13), "pyramid"),
}
# corners of the faces S1, S2, …
SIDES = {
    "tetra": ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    "hexahedron": ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
    "wedge": ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    "pyramid": ((0, 1, 2, 3), (0, 4, 1), (1, 4, 2), (2, 4, 3), (3, 4, 0)),
}


@dataclass(eq=False)
class _Block:
    """A keyword with its options, and the lines of data below it."""

    word: str
    options: dict[str, str]
    line: int
    rows: list[list[str]]


@dataclass(eq=False)
class _Part:
    """Nodes, elements and sets of a part, an instance or a whole file."""

    name: str
    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    elements: dict[int, tuple[str, list[int]]] = field(default_factory=dict)
    element_sets: dict[str, list[int]] = field(default_factory=dict)
    node_sets: dict[str, list[int]] = field(default_factory=dict)
    surfaces: dict[str, list[tuple[str, str]]] = field(default_factory=dict)
    sections: list[str] = field(default_factory=list)
    internal: set[str] = field(default_factory=set)
    others: dict[str, int] = field(default_factory=dict)
    spelling: dict[str, str] = field(default_factory=dict)


@dataclass(eq=False)
class _Instance:
    part: _Part
    name: str
    move: np.ndarray
    turn: np.ndarray


def _refuse(path: str, line: int, what: str, why: str, fix: str) -> UsageError:
    return UsageError(f"{path}, line {line}: {what}", why=why, fix=fix)


def _blocks(path: str, name: Path, depth: int = 0) -> Iterator[_Block]:
    """Yield the keywords of a file and of those that it includes."""
    try:
        lines = read_part(name).decode("utf-8", "replace").splitlines()
    except UsageError as error:
        if not depth:
            raise
        raise UsageError(
            f"{path} includes {name}, which can't be read.",
            why=error.why,
            fix="Put the file beside it, or export the whole mesh into one file.",
        ) from error
    if depth > DEEPEST:
        raise _refuse(path, 1, "files include each other.", f"{name} is {depth} deep.", "Write one file.")
    block: _Block | None = None
    number = 0
    while number < len(lines):
        text = lines[number].strip()
        number += 1
        if not text or text.startswith("**"):
            continue
        if not text.startswith("*"):
            if block is not None:
                block.rows.append([cell.strip() for cell in text.split(",")])
            continue
        if block is not None:
            yield block
        start = number
        while text.endswith(",") and number < len(lines):
            text += lines[number].strip()
            number += 1
        word, *pairs = text[1:].split(",")
        split = [pair.partition("=") for pair in pairs]
        options = {key.strip().upper(): value.strip().strip('"') for key, _, value in split if key.strip()}
        block = _Block(" ".join(word.upper().split()), options, start, [])
        if block.word == "INCLUDE":
            yield from _blocks(path, name.parent / options.get("INPUT", ""), depth + 1)
            block = None
    if block is not None:
        yield block


def read_abaqus(path: str) -> MeshSource:
    """Read the mesh of an input file; FileFormatError and UsageError tell what is damaged, missing or not read.

    Regions are the sets of the solid sections, and where an element has none, its smallest set. Instances of an
    assembly are placed where it says; with several, their names stand before those of the sets. Surfaces are
    ``*SURFACE``, sets of nodes, and shell elements by their sets.
    """
    parts: dict[str, _Part] = {}
    root = _Part("")
    instances: list[_Instance] = []
    assembly = _Part("assembly")
    scope = root
    try:
        for block in _blocks(path, Path(path)):
            if block.word == "PART":
                name = block.options.get("NAME", "")
                scope = parts.setdefault(name.upper(), _Part(name))
            elif block.word == "INSTANCE":
                instances.append(_instance(path, block, parts))
                scope = instances[-1].part
            elif block.word in {"END PART", "ASSEMBLY", "END INSTANCE"}:
                scope = root if block.word == "END PART" else assembly
            elif block.word == "END ASSEMBLY":
                scope = root
            else:
                _read_block(path, block, scope)
    except (ValueError, IndexError) as error:
        if isinstance(error, UsageError | FileFormatError):
            raise
        raise FileFormatError(
            f"The file {path} can't be read as an input file.",
            why=f"A number or an option is damaged ({error}).",
            fix="Export it again from the program that made it.",
        ) from error
    if not instances:
        instances = [_Instance(part, part.name, np.zeros(3), np.eye(3)) for part in parts.values()]
    if root.nodes:
        instances.insert(0, _Instance(root, "", np.zeros(3), np.eye(3)))
    return _assemble(path, instances, assembly)


def _instance(path: str, block: _Block, parts: dict[str, _Part]) -> _Instance:
    name = block.options.get("NAME", "")
    wanted = block.options.get("PART", "")
    part = parts.get(wanted.upper())
    if part is None:
        raise _refuse(
            path,
            block.line,
            f"the instance {name!r} is of the part {wanted!r}, which is not there.",
            f"Parts before it are: {', '.join(p.name for p in parts.values()) or 'none'}.",
            "Export the assembly with its parts in one file.",
        )
    copy = _Part(
        name,
        dict(part.nodes),
        dict(part.elements),
        {key: list(value) for key, value in part.element_sets.items()},
        {key: list(value) for key, value in part.node_sets.items()},
        {key: list(value) for key, value in part.surfaces.items()},
        list(part.sections),
        set(part.internal),
        dict(part.others),
        dict(part.spelling),
    )
    move, turn = np.zeros(3), np.eye(3)
    if block.rows:
        move = np.array([float(v or 0) for v in (block.rows[0] + ["0"] * 3)[:3]])
    if len(block.rows) > 1:
        turn, shift = _rotation([float(v) for v in block.rows[1][:7]])
        move = turn @ move + shift
    block.rows.clear()
    return _Instance(copy, name, move, turn)


def _rotation(values: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Matrix and shift of a turn by an angle in degrees about the line through two points."""
    start, end = np.array(values[:3]), np.array(values[3:6])
    x, y, z = (end - start) / np.linalg.norm(end - start)
    angle = np.radians(values[6])
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return turn, start - turn @ start


def _read_block(path: str, block: _Block, scope: _Part) -> None:
    if block.word in MAKERS:
        raise _refuse(
            path,
            block.line,
            f"*{block.word} is not read.",
            "It makes nodes or elements out of others.",
            "Export the mesh with all nodes and elements written out.",
        )
    if block.word == "NODE":
        _read_nodes(path, block, scope)
    elif block.word == "ELEMENT":
        _read_elements(path, block, scope)
    elif block.word in {"ELSET", "NSET"}:
        _read_set(block, scope)
    elif block.word == "SURFACE":
        name = _spell(scope, block.options.get("NAME", ""))
        rows = [[*row, ""][:2] for row in block.rows]
        if block.options.get("TYPE", "ELEMENT").upper() == "NODE":
            scope.node_sets.setdefault(name, []).extend(
                node for first, _ in rows for node in _members(first, scope.node_sets, block)
            )
        else:
            scope.surfaces.setdefault(name, []).extend((first, side.upper()) for first, side in rows)
            scope.internal |= {first.upper() for first, _ in rows if not first.isdigit()}
    elif block.word == "SOLID SECTION":
        scope.sections.append(block.options.get("ELSET", "").upper())


def _spell(scope: _Part, name: str) -> str:
    """Return the key of a name, whose case means nothing, and keep how it was first written."""
    scope.spelling.setdefault(name.upper(), name)
    return name.upper()


def _read_nodes(path: str, block: _Block, scope: _Part) -> None:
    if block.options.get("SYSTEM", "R").upper() != "R":
        raise _refuse(
            path,
            block.line,
            f"nodes are given in the system {block.options['SYSTEM']!r}.",
            "Only rectangular coordinates are read.",
            "Export them in rectangular coordinates.",
        )
    for row in block.rows:
        x, y, z = (float(v or 0) for v in (row[1:4] + ["0"] * 3)[:3])
        scope.nodes[int(row[0])] = (x, y, z)
    if "NSET" in block.options:
        name = _spell(scope, block.options["NSET"])
        scope.node_sets.setdefault(name, []).extend(int(row[0]) for row in block.rows)


def _read_elements(path: str, block: _Block, scope: _Part) -> None:
    kind = block.options.get("TYPE", "").upper()
    solid, shell = SOLID.match(kind), SHELL.match(kind)
    size = int(solid[1]) if solid else int(shell[1]) if shell else 0
    if kind.startswith("STRI65"):
        size = 6
    if (solid and size not in KINDS) or not size:
        # a member of a frame, a spring, a mass: no part of the volume; but what is solid must not be lost
        word = f"solid {kind}" if solid or kind.startswith(("COH3D", "SC", "CSS")) else f"line {kind}"
        scope.others[word] = scope.others.get(word, 0) + len(block.rows)
        return
    numbers = [int(cell) for row in block.rows for cell in row if cell]
    if len(numbers) % (size + 1):
        raise FileFormatError(
            f"{path}, line {block.line}: the elements of type {kind} are not whole.",
            why=f"Each has a number and {size} nodes, and {len(numbers)} numbers are there.",
            fix="Export the mesh again.",
        )
    word = KINDS[size] if solid else "triangle" if size in {3, 6, 7} else "quad"
    table = [numbers[k : k + size + 1] for k in range(0, len(numbers), size + 1)]
    for number, *nodes in table:
        scope.elements[number] = (word, nodes)
    if "ELSET" in block.options:
        name = _spell(scope, block.options["ELSET"])
        scope.element_sets.setdefault(name, []).extend(row[0] for row in table)


def _read_set(block: _Block, scope: _Part) -> None:
    sets = scope.element_sets if block.word == "ELSET" else scope.node_sets
    written = block.options.get(block.word, "")
    instance = block.options.get("INSTANCE")
    name = _spell(scope, written if instance is None else f"{instance}.{written}")
    if instance is not None:
        scope.spelling[name] = written
    if "INTERNAL" in block.options or written.startswith("_"):
        scope.internal.add(name)
    members: list[int] = []
    for row in block.rows:
        cells = [cell for cell in row if cell]
        if "GENERATE" in block.options:
            first, last, step = (int(v) for v in [*cells, "1"][:3])
            if len(range(first, last + 1, step)) > MOST_NUMBERS:
                raise ValueError(
                    f"line {block.line} generates the numbers {first} to {last}, more than a mesh has"
                )
            members += range(first, last + 1, step)
        else:
            for cell in cells:
                members += _members(cell, sets, block)
    sets.setdefault(name, []).extend(members)


def _members(cell: str, sets: dict[str, list[int]], block: _Block) -> list[int]:
    """Return the numbers that a cell of a set stands for: its own, or those of the set that it names."""
    bare = cell.rpartition(".")[2]
    if bare.isdigit():
        return [int(bare)]
    instance = block.options.get("INSTANCE")
    return sets.get(cell.upper()) or sets.get(f"{instance}.{cell}".upper(), [])


@dataclass(eq=False)
class _Assembly:
    """Cells of all instances by kind, and where each of them is found again."""

    cells: dict[str, list[list[int]]] = field(default_factory=dict)
    place: dict[tuple[int, int], tuple[str, int]] = field(default_factory=dict)  # by instance and number
    rows: list[dict[int, int]] = field(default_factory=list)  # of the nodes of each instance
    first: dict[str, int] = field(default_factory=dict)  # index of the first cell of a kind of volume

    def add(self, path: str, part: _Part, start: int) -> None:
        """Add the elements of an instance, whose nodes begin at row `start`."""
        row_of = {number: start + k for k, number in enumerate(part.nodes)}
        for number, (kind, corners) in part.elements.items():
            mine = self.cells.setdefault(kind, [])
            self.place[len(self.rows), number] = kind, len(mine)
            count = SOLIDS.get(kind, 3 if kind == "triangle" else 4)
            missing = [node for node in corners[:count] if node not in row_of]
            if missing:
                raise FileFormatError(
                    f"Element {number} of {path} has a node {missing[0]} that is not there.",
                    why="The file is cut short, or its nodes stand in another file.",
                    fix="Export the mesh again, with all nodes.",
                )
            mine.append([row_of[node] for node in corners[:count]])
        self.rows.append(row_of)


def _assemble(path: str, instances: list[_Instance], assembly: _Part) -> MeshSource:
    """Put the instances at their places, and their sets beside each other."""
    nodes = [
        np.array(list(i.part.nodes.values()), dtype=float).reshape(-1, 3) @ i.turn.T + i.move
        for i in instances
    ]
    source = MeshSource(path, np.concatenate(nodes) if nodes else np.empty((0, 3)))
    if not len(source.points):
        raise FileFormatError(
            f"{path} holds no nodes.",
            why="There is no *NODE in it, or its parts have no instance.",
            fix="Export the mesh into the input file.",
        )
    whole = _Assembly()
    for instance in instances:
        whole.add(path, instance.part, sum(map(len, whole.rows)))
        for kind, count in instance.part.others.items():
            source.count_other(kind, count)
    for kind, cells in whole.cells.items():
        if kind in SOLIDS:
            whole.first[kind] = sum(len(block) for _, block in source.solids)
            source.add_solids(kind, np.array(cells))
        else:
            source.count_other(kind, len(cells))
    several = len(instances) > 1
    for i, instance in enumerate(instances):
        prefix = f"{instance.name} " if several and instance.name else ""
        _add_groups(source, instance.part, i, prefix, whole)
        if several:
            places = [whole.place[i, number] for number in instance.part.elements]
            members = [whole.first[kind] + row for kind, row in places if kind in SOLIDS]
            source.regions.append(Group(plain_name(instance.name or "model"), np.array(members), rank=2))
    for i, instance in enumerate(instances):
        _add_groups(source, _of_instance(assembly, instance.name), i, "", whole)
    return source


def _of_instance(assembly: _Part, name: str) -> _Part:
    """Return those sets of an assembly that are in one instance, and its surfaces."""
    start = f"{name.upper()}."
    part = _Part(name, spelling=assembly.spelling)
    for theirs, mine in ((assembly.element_sets, part.element_sets), (assembly.node_sets, part.node_sets)):
        mine.update({key: value for key, value in theirs.items() if key.startswith(start)})
    part.internal = {key for key in part.element_sets if key in assembly.internal}
    part.internal |= {key for key in part.element_sets if key.removeprefix(start) in assembly.internal}
    for key, entries in assembly.surfaces.items():
        for first, side in entries:
            in_set = f"{start}{first.upper()}" in part.element_sets
            if in_set or first.upper().startswith(start):
                part.surfaces.setdefault(key, []).append((f"{start}{first}" if in_set else first, side))
    return part


def _add_groups(source: MeshSource, part: _Part, i: int, prefix: str, whole: _Assembly) -> None:
    """Add the sets and surfaces of a part as groups."""

    def name(key: str) -> str:
        return prefix + plain_name(part.spelling.get(key, key))

    for key, numbers in part.element_sets.items():
        there = [whole.place[i, number] for number in numbers if (i, number) in whole.place]
        solid = [whole.first[kind] + row for kind, row in there if kind in SOLIDS]
        if solid and key not in part.internal:
            source.regions.append(Group(name(key), np.unique(solid), rank=0 if key in part.sections else 1))
        shell = [whole.cells[kind][row] for kind, row in there if kind not in SOLIDS]
        if shell and key not in part.internal:
            source.faces.append(Group(name(key), _four(shell)))
    for key, numbers in part.node_sets.items():
        nodes = [whole.rows[i][number] for number in numbers if number in whole.rows[i]]
        if nodes and key not in part.internal:
            source.node_sets.append(Group(name(key), np.unique(nodes)))
    for key, entries in part.surfaces.items():
        faces = [face for first, side in entries for face in _faces(part, i, first, side, whole)]
        if faces:
            source.faces.append(Group(name(key), _four(faces), rank=0))


def _faces(part: _Part, i: int, first: str, side: str, whole: _Assembly) -> list[list[int]]:
    """Corners of the faces that an entry of a surface names: a side of an element or of all in a set, or all sides."""
    bare = first.rpartition(".")[2]
    numbers = [int(bare)] if bare.isdigit() else part.element_sets.get(first.upper(), [])
    chosen = re.fullmatch(r"S(\d)", side)
    faces = []
    for kind, row in (whole.place[i, number] for number in numbers if (i, number) in whole.place):
        corners = whole.cells[kind][row]
        if kind not in SOLIDS:
            faces.append(corners)
            continue
        sides = [SIDES[kind][int(chosen[1]) - 1]] if chosen else SIDES[kind]
        faces += [[corners[k] for k in corner] for corner in sides]
    return faces


def _four(faces: list[list[int]]) -> np.ndarray:
    """Corners (n, 4) of faces, the last one of a triangle twice."""
    return np.array([[*face, face[-1]][:4] for face in faces], dtype=np.int64)
