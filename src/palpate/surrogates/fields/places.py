"""Places that a field has values at: the nodes or the cells of a mesh, or the points of an axis."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np

from palpate.checks import own_arrays
from palpate.errors import UsageError
from palpate.format import count

__all__ = ["AxisPlaces", "MeshPlaces"]


@dataclass(frozen=True, eq=False)
class MeshPlaces:
    """Nodes or cells of a mesh, with the surface by which they are drawn.

    Attributes
    ----------
    points : (nodes, 3)
        Nodes of the mesh, m; of a plane body in the plane z = 0.
    triangles : (t, 3) int
        Nodes of the triangles that are drawn; may be none.
    kind : {"nodes", "cells"}
        Whether a field has a value for each node or for each cell.
    centres : (cells, 3)
        Middle of each cell, m; none for a field at nodes.
    cell_of : (t,) int
        The cell that each triangle belongs to, by whose value it is coloured; none for a field at nodes.

    Raises
    ------
    UsageError
        If the arrays do not fit together.
    """

    points: np.ndarray
    triangles: Annotated[np.ndarray, np.int64] = field(default_factory=lambda: np.zeros((0, 3), np.int64))
    kind: Literal["nodes", "cells"] = "nodes"
    centres: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    cell_of: Annotated[np.ndarray, np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))

    def __post_init__(self) -> None:
        own_arrays(self, "points", "centres")
        own_arrays(self, "triangles", "cell_of", dtype=np.int64)
        nodes, corners, cells = len(self.points), self.triangles, len(self.centres)
        fits = self.points.shape == (nodes, 3) and corners.shape == (len(corners), 3)
        fits = fits and self.centres.shape == (cells, 3) and nodes > 0
        fits = fits and bool(((corners >= 0) & (corners < nodes)).all() and np.isfinite(self.points).all())
        if self.kind == "cells":
            fits = fits and cells > 0 and self.cell_of.shape in {(0,), (len(corners),)}
            fits = fits and bool(((self.cell_of >= 0) & (self.cell_of < cells)).all())
        if not fits:
            raise UsageError(
                f"Points {self.points.shape}, triangles {corners.shape} and cells {self.centres.shape} are no mesh.",
                why="Triangles name its points, and each belongs to one of its cells.",
                fix="Give points (nodes, 3) in m and triangles (t, 3) of their indices.",
            )

    def __len__(self) -> int:
        return len(self.coordinates)

    @property
    def is_surface(self) -> bool:
        """True where values at the places can be drawn on triangles."""
        return len(self.triangles) > 0 and (self.kind == "nodes" or len(self.cell_of) > 0)

    def __str__(self) -> str:
        return count(len(self), "node" if self.kind == "nodes" else "cell")

    @property
    def coordinates(self) -> np.ndarray:
        """Place (P, 3) of each value, m."""
        return self.points if self.kind == "nodes" else self.centres

    def nearest(self, point: np.ndarray) -> int:
        """Return the place nearest to a point (3,), m."""
        return int(((self.coordinates - np.asarray(point, float)) ** 2).sum(axis=1).argmin())

    def in_words(self, place: int) -> str:
        """Return where a place is, such as "at (12, 0, 3) mm"."""
        x = 1e3 * self.coordinates[place]
        return f"at ({', '.join(f'{v:.4g}' for v in x)}) mm"


@dataclass(frozen=True, eq=False)
class AxisPlaces:
    """Points of an axis, such as times or frequencies, along which a field is a curve.

    Attributes
    ----------
    name, unit : str
        What runs along it, and its SI unit.
    values : (P,)
        Ascending.

    Raises
    ------
    UsageError
        If the values do not ascend.
    """

    name: str
    unit: str
    values: np.ndarray

    def __post_init__(self) -> None:
        own_arrays(self, "values")
        if self.values.ndim != 1 or not self.values.size or not (np.diff(self.values) > 0).all():
            raise UsageError(
                f"The axis {self.name!r} does not ascend.",
                why="A curve has one value at each of its points.",
                fix="Give finite values in ascending order, each once.",
            )

    def __len__(self) -> int:
        return len(self.values)

    def __str__(self) -> str:
        ends = f"{self.values[0]:.4g} to {self.values[-1]:.4g} {self.unit}".strip()
        return f"{count(len(self), 'point')} of {self.name} from {ends}"

    @property
    def coordinates(self) -> np.ndarray:
        """Value (P, 1) of the axis at each place."""
        return self.values[:, None]

    def nearest(self, point: np.ndarray) -> int:
        """Return the place nearest to a value (1,) of the axis."""
        return int(np.abs(self.values - float(np.asarray(point).ravel()[0])).argmin())

    def in_words(self, place: int) -> str:
        """Return where a place is, such as "at time 0.25 s"."""
        return f"at {self.name} {self.values[place]:.4g} {self.unit}".rstrip()
