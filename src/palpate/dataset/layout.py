"""Where a body's nodes are, and what its surface is made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError

__all__ = ["Layout"]


@dataclass(frozen=True, eq=False)
class Layout:
    """What all answers for one body have in common.

    Attributes
    ----------
    rest : (node, 2) or (node, 3) array
        Positions at rest in m.
    of_interest : (node,) array of bool, optional
        By default the nodes of the triangles, or all nodes where there are none.
    load_nodes : sequence of int
        For each input the index of the node that it acts on; empty where inputs don't act on nodes.
    load_directions : (n, 2) or (n, 3) array
        For each input its direction.
    axes, components : tuple of str
        Names of the axes of space and of a node's displacement. By default those of a plane beam, whose nodes
        have a rotation too, or those of a solid.
    triangles : (t, 3) array of int, optional
        Nodes of the surface's triangles, counter-clockwise seen from outside.
    surfaces : tuple of str
        Names of the surfaces.
    surface_of : (t,) array of int, optional
        For each triangle the index of its surface.
    labels : mapping of a dimension to names, optional
        For further dimensions of the answers; by default ``{"reaction": ("F_x", "F_y", "M")}`` in the plane.

    Raises
    ------
    UsageError
        If the arrays don't fit together.
    """

    rest: np.ndarray
    of_interest: np.ndarray | None = None
    load_nodes: Sequence[int] = ()
    load_directions: Sequence[Sequence[float]] = ()
    axes: tuple[str, ...] = ()
    components: tuple[str, ...] = ()
    triangles: np.ndarray | None = None
    surfaces: tuple[str, ...] = ()
    surface_of: np.ndarray | None = None
    labels: Mapping[str, Sequence[str]] | None = None

    def __post_init__(self) -> None:
        fix = object.__setattr__  # a frozen value fills in its own defaults
        rest = np.asarray(self.rest, dtype=float)
        _require(rest.ndim == 2 and rest.shape[1] in {2, 3}, f"rest has the shape {rest.shape}")
        plane = rest.shape[1] == 2
        fix(self, "rest", rest)
        fix(self, "axes", tuple(self.axes or "xyz"[: rest.shape[1]]))
        fix(self, "components", tuple(self.components or ("u_x", "u_y", "rotation" if plane else "u_z")))
        if self.labels is None:
            fix(self, "labels", {"reaction": ("F_x", "F_y", "M")} if plane else {})
        if self.triangles is not None:
            fix(self, "triangles", np.asarray(self.triangles, dtype=np.int64))
            _check_triangles(self.triangles, len(rest))
        fix(self, "of_interest", self._interest())
        self._check()

    def _interest(self) -> np.ndarray:
        if self.of_interest is not None:
            return np.asarray(self.of_interest, dtype=bool)
        marked = np.full(len(self.rest), self.triangles is None)
        if self.triangles is not None:
            marked[self.triangles] = True
        return marked

    def _check(self) -> None:
        nodes, interest = len(self.rest), np.shape(np.asarray(self.of_interest))
        _require(interest == (nodes,), f"of_interest has the shape {interest} for {nodes} nodes")
        loads = (len(self.load_nodes), len(self.load_directions))
        _require(loads[0] == loads[1], f"there are {loads[0]} load_nodes and {loads[1]} load_directions")
        _require(
            len(self.axes) == self.rest.shape[1], f"axes are {self.axes} in {self.rest.shape[1]} dimensions"
        )
        if self.surface_of is not None:
            of, count = np.asarray(self.surface_of), 0 if self.triangles is None else len(self.triangles)
            _require(of.shape == (count,), f"surface_of has the shape {of.shape} for {count} triangles")
            named = not of.size or (of.min() >= 0 and of.max() < len(self.surfaces))
            _require(named, f"surface_of counts beyond the {len(self.surfaces)} surfaces")


def _check_triangles(triangles: np.ndarray, nodes: int) -> None:
    shape = triangles.shape
    _require(len(shape) == 2 and shape[1] == 3, f"triangles has the shape {shape}")
    inside = triangles.size == 0 or (triangles.min() >= 0 and triangles.max() < nodes)
    _require(inside, f"triangles names nodes outside 0 … {nodes - 1}")


def _require(fits: bool, why: str) -> None:
    if not fits:
        raise UsageError(
            "The arrays of this layout don't fit together.",
            why=f"{why[0].upper()}{why[1:]}.",
            fix="Give rest (node, 2 or 3), of_interest (node,) and triangles (t, 3) of the same nodes.",
        )
