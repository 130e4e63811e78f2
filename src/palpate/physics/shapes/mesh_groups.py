"""Nodes, cells and groups of a volume mesh as a file has them."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from palpate.errors import FileFormatError

__all__ = ["FACES", "SOLIDS", "Group", "MeshSource", "require_sound"]

SOLIDS = {"tetra": 4, "hexahedron": 8, "wedge": 6, "pyramid": 5}
"""Kinds of cells of volume, and their numbers of corners."""

FACES = {"triangle": 3, "quad": 4}
"""Kinds of cells of surface, and their numbers of corners."""

# cells without a volume, which a mesh of a body may hold beside the others
THIN = ("vertex", "line", "triangle", "quad", "polygon")


@dataclass(frozen=True, eq=False)
class Group:
    """Cells, faces or nodes that a file calls by a name.

    `members` are of a region: indices of cells, in the order of the blocks; of a surface: corners (n, 4) of faces, the
    last one of a triangle twice; of a set of nodes: nodes.
    """

    name: str  # without signs that mean something in patterns of names
    members: np.ndarray
    numbered: bool = False  # True where the file has a number only
    rank: int = 1  # groups of a lower rank go before others, whatever their size


@dataclass(eq=False)
class MeshSource:
    """The content of a file."""

    path: str  # the file
    points: np.ndarray  # (n, 3) nodes in the unit of the file
    solids: list[tuple[str, np.ndarray]] = field(default_factory=list)
    regions: list[Group] = field(default_factory=list)  # of cells of volume
    faces: list[Group] = field(default_factory=list)
    node_sets: list[Group] = field(default_factory=list)
    others: Counter[str] = field(default_factory=Counter)  # all other cells, by kind
    notes: list[str] = field(default_factory=list)  # on each thing that was passed over or decided

    def add_solids(self, kind: str, corners: np.ndarray) -> None:
        """Add cells of volume."""
        self.solids.append((kind, np.asarray(corners, dtype=np.int64)))

    def count_other(self, kind: str, count: int) -> None:
        """Count cells that are no part of the volume, or of a kind that is not read."""
        if count:
            self.others[kind] += count

    @property
    def unread(self) -> dict[str, int]:
        """Numbers of cells that may have a volume and are of no kind that is read."""
        return {kind: count for kind, count in self.others.items() if not kind.startswith(THIN)}


def require_sound(source: MeshSource) -> None:
    """Refuse numbers of nodes and cells that are not there, and nodes at no place, in whatever format they stood."""
    nodes, cells = len(source.points), sum(len(block) for _, block in source.solids)
    parts = [("A cell", block, nodes) for _, block in source.solids]
    parts += [(f"The surface {group.name!r}", group.members, nodes) for group in source.faces]
    parts += [(f"The set of nodes {group.name!r}", group.members, nodes) for group in source.node_sets]
    parts += [(f"The region {group.name!r}", group.members, cells) for group in source.regions]
    for what, members, there in parts:
        wrong = members[(members < 0) | (members >= there)]
        if wrong.size:
            raise FileFormatError(
                f"{what} of {source.path} names number {int(wrong.flat[0])}, counted from 0, of {there}.",
                why="The file is damaged or cut short.",
                fix="Open it in the program that made it and export it again.",
            )
    used = np.unique(
        np.concatenate([np.empty(0, dtype=np.int64), *(block.ravel() for _, block in source.solids)])
    )
    bad = used[~np.isfinite(source.points[used]).all(axis=1)]
    if len(bad):
        raise FileFormatError(
            f"{len(bad)} nodes of {source.path} have coordinates that are no finite numbers.",
            why=f"The first is node {int(bad[0])}, counted from 0.",
            fix="Open it in the program that made it and export it again.",
        )
