"""Nodes, cells and groups of a volume mesh as a file has them."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

__all__ = ["FACES", "SOLIDS", "Group", "MeshSource"]

SOLIDS = {"tetra": 4, "hexahedron": 8, "wedge": 6, "pyramid": 5}
"""Kinds of cells of volume, and their numbers of corners."""

FACES = {"triangle": 3, "quad": 4}
"""Kinds of cells of surface, and their numbers of corners."""

# cells without a volume, which a mesh of a body may hold beside the others
THIN = ("vertex", "line", "triangle", "quad", "polygon")


@dataclass(frozen=True, eq=False)
class Group:
    """Cells, faces or nodes that a file calls by a name.

    Attributes
    ----------
    name : str
        The name, without signs that mean something in patterns of names.
    members : int array
        Of a region: indices of cells, in the order of the blocks. Of a surface: corners (n, 4) of faces, the last
        one of a triangle twice. Of a set of nodes: nodes.
    numbered : bool
        True where the file has a number only.
    rank : int
        Groups of a lower rank go before others, whatever their size.
    """

    name: str
    members: np.ndarray
    numbered: bool = False
    rank: int = 1


@dataclass(eq=False)
class MeshSource:
    """The content of a file.

    Attributes
    ----------
    path : str
        The file.
    points : (n, 3) array
        Nodes in the unit of the file.
    solids : list of (str, (k, corners) int array)
        Cells of volume by kind, a key of `SOLIDS`, by their corners.
    regions, faces, node_sets : list of Group
        Groups of cells of volume, of faces and of nodes.
    others : Counter
        Numbers of all other cells, by kind.
    notes : list of str
        A sentence about each thing that was passed over or decided.
    """

    path: str
    points: np.ndarray
    solids: list[tuple[str, np.ndarray]] = field(default_factory=list)
    regions: list[Group] = field(default_factory=list)
    faces: list[Group] = field(default_factory=list)
    node_sets: list[Group] = field(default_factory=list)
    others: Counter[str] = field(default_factory=Counter)
    notes: list[str] = field(default_factory=list)

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
