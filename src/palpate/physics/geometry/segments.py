"""Parts of a surface: split along sharp edges, or chosen by a box or a function."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.physics.geometry.checks import require_name, require_triple
from palpate.physics.geometry.triangulation import Triangulation, edge_faces

__all__ = ["FEATURE_ANGLE", "SurfacePatch", "patched", "segments"]

FEATURE_ANGLE = 40.0  # degrees between neighbouring triangles from which the edge between them is sharp
Point = tuple[float, float, float]


@dataclass(frozen=True)
class SurfacePatch:
    """A name for a part of an imported surface.

    Attributes
    ----------
    name : str
    lower, upper : tuple of three floats, optional
        Corners in m of an upright box: what has its centre inside gets the name.
    where : callable, optional
        In place of a box: a function of centres (n, 3) in m to bool (n,). Define it in a module, so that other
        processes find it.

    Raises
    ------
    UsageError
        Unless there is either a box or a function.
    """

    name: str
    lower: Point | None = None
    upper: Point | None = None
    where: Callable[[np.ndarray], np.ndarray] | None = None

    def __post_init__(self) -> None:
        require_name("The name of a patch", self.name)
        boxed = self.lower is not None and self.upper is not None
        if boxed == (self.where is not None) or (self.lower is None) != (self.upper is None):
            raise UsageError(
                f"The patch {self.name!r} has no clear place.",
                why="It is either a box of two corners or a function.",
                fix="Pass lower=(x, y, z) and upper=(x, y, z), or where=function.",
            )
        if boxed:
            object.__setattr__(self, "lower", require_triple("A patch's lower corner", self.lower))
            object.__setattr__(self, "upper", require_triple("A patch's upper corner", self.upper))

    def contains(self, centres: np.ndarray) -> np.ndarray:
        """Which of the centres (n, 3) in m belong to the patch, bool (n,)."""
        if self.where is not None:
            return np.asarray(self.where(centres), dtype=bool)
        return np.asarray(((centres >= self.lower) & (centres <= self.upper)).all(axis=1))

    def describe(self) -> dict[str, Any]:
        """The patch as plain data."""
        function = self.where and f"{self.where.__module__}.{self.where.__qualname__}"
        return {"name": self.name, "lower": self.lower, "upper": self.upper, "where": function}


def segments(surface: Triangulation, angle: float = FEATURE_ANGLE) -> np.ndarray:
    """Number the parts of a closed surface that sharp edges bound, the largest area first.

    Parameters
    ----------
    surface : Triangulation
        Closed: each edge belongs to two triangles.
    angle : float
        In degrees; an edge is sharp where the normals of its two triangles differ by more.

    Returns
    -------
    (t,) int array
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    _, edge_of, _ = edge_faces(surface.triangles)
    order = np.argsort(edge_of.ravel(), kind="stable")
    first, second = (order // 3)[0::2], (order // 3)[1::2]
    cosine = np.einsum("ei,ei->e", surface.normals[first], surface.normals[second])
    smooth = cosine > np.cos(np.radians(angle))
    size = len(surface.triangles)
    graph = coo_array((np.ones(smooth.sum()), (first[smooth], second[smooth])), shape=(size, size))
    count, label = connected_components(graph, directed=False)
    a, b, c = np.moveaxis(surface.corners, 1, 0)
    areas = np.bincount(label, np.linalg.norm(np.cross(b - a, c - a), axis=1), minlength=count)
    # rounded, so that equal parts keep the order of their first triangles
    rank = np.argsort(np.argsort(-np.round(areas / areas.max(), 6), kind="stable"), kind="stable")
    return np.asarray(rank[label])


def patched(
    names: Sequence[str], index: np.ndarray, centres: np.ndarray, patches: Sequence[SurfacePatch]
) -> tuple[tuple[str, ...], np.ndarray]:
    """Give the parts inside the patches their names; a later patch goes over an earlier one.

    Parameters
    ----------
    names : sequence of str
    index : (n,) int array
        Into `names`.
    centres : (n, 3) array
        In m.
    patches : sequence of SurfacePatch

    Returns
    -------
    names : tuple of str
        Those that are left, the patches' first.
    index : (n,) int array

    Raises
    ------
    UsageError
        If a patch contains nothing.
    """
    label = np.array([names[i] for i in index], dtype=object)
    for patch in patches:
        inside = patch.contains(centres)
        if not inside.any():
            low, high = (", ".join(f"{v:.4g}" for v in f(axis=0)) for f in (centres.min, centres.max))
            raise UsageError(
                f"The patch {patch.name!r} contains no part of the surface.",
                why=f"The centres of the surface's faces lie between ({low}) and ({high}) m.",
                fix="Move or enlarge its box, in m.",
            )
        label[inside] = patch.name
    present = set(label)
    kept = tuple(dict.fromkeys(n for n in (*[p.name for p in patches], *names) if n in present))
    position = {name: i for i, name in enumerate(kept)}
    return kept, np.array([position[n] for n in label], dtype=np.int64)
