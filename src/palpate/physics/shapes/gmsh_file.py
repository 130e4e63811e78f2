"""Meshes of Gmsh in formats 4.0 and 4.1, with all groups of each entity.

Layout after the Gmsh reference manual, "MSH file format version 4.1" and "version 4.0" (Geuzaine & Remacle,
https://gmsh.info). Format 4.0 has the number of a node or element before its data, and other heads of blocks.
"""

from __future__ import annotations

import re
from collections import defaultdict

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.physics.shapes.mesh_groups import FACES, SOLIDS, Group, MeshSource
from palpate.physics.shapes.naming import plain_name
from palpate.physics.shapes.packed_file import read_part

__all__ = ["is_gmsh_4", "read_gmsh"]

# Gmsh's number of an element: its kind by the corners, and the number of its nodes
ELEMENTS = {
    **{15: ("vertex", 1), 1: ("line", 2), 8: ("line", 3), 26: ("line", 4), 27: ("line", 5), 28: ("line", 6)},
    **{2: ("triangle", 3), 9: ("triangle", 6), 20: ("triangle", 9), 21: ("triangle", 10)},
    **{23: ("triangle", 15)},
    **{3: ("quad", 4), 10: ("quad", 9), 16: ("quad", 8), 36: ("quad", 16), 37: ("quad", 25)},
    **{4: ("tetra", 4), 11: ("tetra", 10), 29: ("tetra", 20), 30: ("tetra", 35), 31: ("tetra", 56)},
    **{5: ("hexahedron", 8), 12: ("hexahedron", 27), 17: ("hexahedron", 20), 92: ("hexahedron", 64)},
    **{6: ("wedge", 6), 13: ("wedge", 18), 18: ("wedge", 15), 90: ("wedge", 40)},
    **{7: ("pyramid", 5), 14: ("pyramid", 14), 19: ("pyramid", 13)},
}
NAMES = re.compile(rb'^\s*(\d+)\s+(-?\d+)\s+"(.*)"', re.MULTILINE)


def is_gmsh_4(path: str) -> bool:
    """Tell whether a file is one of Gmsh in format 4.0 or 4.1."""
    return re.match(rb"\s*\$MeshFormat\s+4(\.[01])?\s", read_part(path)[:200]) is not None


class _Numbers:
    """Numbers of a section one after the other, as text or as bytes."""

    def __init__(self, section: bytes, order: str | None) -> None:
        """Start at the first number; `order` is that of the bytes, None of text."""
        self.words = section.split() if order is None else None
        self.section, self.order, self.at = section, order, 0

    def _take(self, code: str, count: int) -> np.ndarray:
        if self.words is not None:
            words = self.words[self.at : self.at + count]
            self.at += count
            if len(words) < count:
                raise ValueError(f"{count - len(words)} numbers are missing")
            return np.array(words).astype(float if code == "f8" else np.int64)
        kind = np.dtype(f"{self.order}{code}")
        taken = np.frombuffer(self.section, dtype=kind, count=count, offset=self.at)
        self.at += count * kind.itemsize
        return taken.astype(float if code == "f8" else np.int64)

    def integers(self, count: int) -> np.ndarray:
        """Return whole numbers of four bytes."""
        return self._take("i4", count)

    def sizes(self, count: int) -> np.ndarray:
        """Return whole numbers of eight bytes."""
        return self._take("u8", count)

    def reals(self, count: int) -> np.ndarray:
        """Return floating-point numbers."""
        return self._take("f8", count)

    def require(self, count: int) -> int:
        """Return a count that the section states; refuse one that it has no room for."""
        if not 0 <= count <= len(self.section):
            raise ValueError(f"it states {count:,} where there is room for {len(self.section):,} bytes")
        return count

    def size(self) -> int:
        """Return one whole number of eight bytes."""
        return int(self.sizes(1)[0])


def read_gmsh(path: str) -> MeshSource:
    """Read a mesh of Gmsh in format 4.1, as text or binary, or in format 4.0 as text.

    An entity may belong to several physical groups, or to none. Where there is no physical group of a dimension,
    the geometry's own entities are groups by their numbers. One part of a partitioned mesh is refused.
    """
    content = read_part(path)
    if b"$PartitionedEntities" in content:
        raise UsageError(
            f"The mesh in {path} is partitioned.",
            why="Its parts were shared out to several processes, and its groups stand with the parts.",
            fix="Save it without partitions in Gmsh (Mesh.SaveAll = 0, no Mesh.Partition).",
        )
    try:
        return _read(path, content)
    except (ValueError, IndexError, KeyError, OverflowError, MemoryError) as error:
        raise FileFormatError(
            f"The file {path} can't be read as a mesh.",
            why=f"It is corrupt or cut short ({error}).",
            fix="Open it in Gmsh and save it again, as Version 4 ASCII for example.",
        ) from error


def _section(content: bytes, name: str) -> bytes:
    start = content.find(f"${name}".encode())
    if start < 0:
        raise ValueError(f"there is no section {name}")
    start = content.index(b"\n", start) + 1
    return content[start : content.index(f"$End{name}".encode(), start)]


def _read(path: str, content: bytes) -> MeshSource:
    form = _section(content, "MeshFormat")
    version, binary, size = form.split()[:3]
    order, old = None, version != b"4.1"
    if old and binary == b"1":
        raise ValueError("binary files of format 4.0 are not read; save it in format 4.1")
    if binary == b"1":
        mark = form[form.index(b"\n") + 1 :][:4]
        order = "<" if mark == b"\x01\0\0\0" else ">"
        if size != b"8":
            raise ValueError(f"sizes of {size.decode()} bytes")
    groups: dict[tuple[int, int], list[int]] = {}
    if b"$Entities" in content:
        groups = _read_entities(_Numbers(_section(content, "Entities"), order), old=old)
    points, row_of = _read_nodes(_Numbers(_section(content, "Nodes"), order), old=old)
    names = {}
    if b"$PhysicalNames" in content:
        for dimension, number, name in NAMES.findall(_section(content, "PhysicalNames")):
            names[int(dimension), int(number)] = plain_name(name.decode("utf-8", "replace"))
    source = MeshSource(path, points)
    elements = _Numbers(_section(content, "Elements"), order)
    _read_elements(source, elements, row_of, groups, names, old=old)
    return source


def _read_entities(numbers: _Numbers, *, old: bool) -> dict[tuple[int, int], list[int]]:
    """Physical groups of each entity (dimension, number)."""
    groups = {}
    for dimension, count in enumerate(numbers.sizes(4).tolist()):
        for _ in range(numbers.require(count)):
            tag = int(numbers.integers(1)[0])
            numbers.reals(3 if dimension == 0 and not old else 6)  # its place
            groups[dimension, tag] = np.abs(numbers.integers(numbers.size())).tolist()
            if dimension:
                numbers.integers(numbers.size())  # what bounds it
    return groups


def _read_nodes(numbers: _Numbers, *, old: bool) -> tuple[np.ndarray, _Rows]:
    """Places (n, 3), and the rows of the nodes' numbers."""
    blocks, count = numbers.sizes(2).tolist()
    numbers.sizes(0 if old else 2)
    numbers.require(blocks)
    points, tags = np.empty((numbers.require(count), 3)), np.empty(count, dtype=np.int64)
    start = 0
    for _ in range(blocks):
        first, second, parametric = numbers.integers(3).tolist()
        dimension = second if old else first
        size = numbers.require(numbers.size())
        rows = slice(start, start + size)
        # places on a curve or face follow the coordinates
        width = 3 + (min(dimension, 2) if parametric else 0) + (1 if parametric and dimension == 3 else 0)
        if old:
            table = numbers.reals((1 + width) * size).reshape(size, 1 + width)
            tags[rows], points[rows] = table[:, 0].astype(np.int64), table[:, 1:4]
        else:
            tags[rows] = numbers.sizes(size)
            points[rows] = numbers.reals(width * size).reshape(size, width)[:, :3]
        start += size
    if start != count:
        raise ValueError(f"{count - start} of {count} nodes are missing")
    return points, _Rows(tags)


class _Rows:
    """The rows of nodes by their numbers, which may have gaps of any size."""

    def __init__(self, tags: np.ndarray) -> None:
        self.order = np.argsort(tags, kind="stable")
        self.tags = tags[self.order]

    def of(self, tags: np.ndarray) -> np.ndarray:
        """Return the rows of numbers of any shape; refuse those that no node has."""
        at = np.minimum(np.searchsorted(self.tags, tags), max(len(self.tags) - 1, 0))
        if not len(self.tags) or (self.tags[at] != tags).any():
            raise ValueError("an element has a node that is not there")
        return np.asarray(self.order[at])


def _read_elements(
    source: MeshSource,
    numbers: _Numbers,
    row_of: _Rows,
    groups: dict[tuple[int, int], list[int]],
    names: dict[tuple[int, int], str],
    *,
    old: bool,
) -> None:
    """Add the cells, and for each group its members."""
    blocks = numbers.require(int(numbers.sizes(2 if old else 4)[0]))
    physical: dict[tuple[int, int], list[np.ndarray]] = defaultdict(list)
    elementary: dict[tuple[int, int], list[np.ndarray]] = defaultdict(list)
    solids = 0
    for _ in range(blocks):
        first, second, element = numbers.integers(3).tolist()
        dimension, entity = (second, first) if old else (first, second)
        count = numbers.require(numbers.size())
        if element not in ELEMENTS:
            raise ValueError(f"{count} elements are of Gmsh's type {element}, which is not read")
        kind, nodes = ELEMENTS[element]
        cells = row_of.of(numbers.sizes(count * (nodes + 1)).reshape(count, nodes + 1)[:, 1:])
        if kind in SOLIDS:
            source.add_solids(kind, cells[:, : SOLIDS[kind]])
            members = np.arange(solids, solids + count)
            solids += count
        elif kind in FACES:
            corners = cells[:, : FACES[kind]]
            members = np.column_stack([corners, corners[:, -1]]) if kind == "triangle" else corners
            source.count_other(kind, count)
        else:
            source.count_other(kind, count)
            continue
        elementary[dimension, entity].append(members)
        for group in groups.get((dimension, entity), []):
            physical[dimension, group].append(members)
    for dimension, named_groups, word in ((3, source.regions, "region"), (2, source.faces, "surface")):
        mine = {key: parts for key, parts in physical.items() if key[0] == dimension}
        given_names = names if mine else {}
        if not mine:
            mine = {key: parts for key, parts in elementary.items() if key[0] == dimension}
            mine = mine if len(mine) > 1 else {}
        for key in sorted(mine):
            name = given_names.get(key, f"{word} {key[1]}")
            named_groups.append(Group(name, np.concatenate(mine[key]), numbered=key not in given_names))
