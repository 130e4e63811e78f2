"""Fields of solves, each at the nodes of the mesh that it was solved on, and the mesh that they shall be shown on.

What travels with the probe is learnt where it was solved: carried to other nodes first, the flank of a local mode would
lose some tenths of a millimetre between elements of 5 mm. Only what that leaves, which is smooth, is carried.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from palpate.errors import UsageError
from palpate.surrogates import TouchedSurface
from palpate.surrogates.fields import DepthAmplitude, LocalMode
from palpate.surrogates.fields.field_kernels import moving_values
from palpate.surrogates.fields.posed_contact import PosedContact
from palpate.surrogates.fields.surface_interpolation import SurfaceInterpolation, node_normals
from palpate.units import Range, bounds

__all__ = ["Snapshots", "Solves"]


@dataclass(frozen=True, eq=False)
class Snapshots:
    """Fields of some touches at the nodes of one mesh.

    Attributes
    ----------
    X : (N, n)
        Centre of the probe (m), then further inputs.
    values : (N, P, components)
        Less the field at rest.
    groups : (N,) int
        Solves of one group are left out together.
    points : (P, 3)
        At rest, m.
    mass : (P,)
        Share of the surface that each node stands for.
    triangles : (t, 3) int
        Nodes of each triangle of the surface.
    """

    X: np.ndarray
    values: np.ndarray
    groups: np.ndarray
    points: np.ndarray
    mass: np.ndarray
    triangles: np.ndarray


@dataclass(frozen=True, eq=False)
class Solves:
    """Snapshots in contact, and all that is known beside them."""

    snapshots: tuple[Snapshots, ...]  # one for each mesh that solves were made on
    inputs: tuple[Range, ...]
    surface: TouchedSurface  # that the probe touches
    radius: float  # of the probe, m; where it is an input, a usual one
    points: np.ndarray  # (nodes, 3), at rest, m, of the mesh that the field is shown on
    triangles: np.ndarray  # (t, 3)
    mass: np.ndarray  # (nodes,)
    radius_input: int | None  # the input that is the radius
    # to that mesh; None where it is the snapshots' own
    interpolations: tuple[SurfaceInterpolation | None, ...]
    # (3,), m, way from a solve's place to the centre of the ball that touches; `surface` is the body's less it
    shift: np.ndarray
    contact: PosedContact | None = None  # where a tool touches whose balls tell the depth

    @classmethod
    def of(
        cls,
        snapshots: Sequence[Snapshots],
        inputs: Sequence[Range],
        surface: TouchedSurface,
        radius: float,
        points: np.ndarray,
        triangles: np.ndarray,
        mass: np.ndarray,
        radius_input: int | None = None,
        shift: Sequence[float] = (0.0, 0.0, 0.0),
        contact: PosedContact | None = None,
    ) -> Solves:
        """All of them, as they are."""
        facing = node_normals(points, triangles)
        interpolations = tuple(
            None
            if one.points.shape == points.shape and (one.points == points).all()
            else SurfaceInterpolation.of(one.points, one.triangles, points, facing)
            for one in snapshots
        )
        context = (surface, radius, points, triangles, mass, radius_input)
        return cls(
            tuple(snapshots), tuple(inputs), *context, interpolations, np.array(shift, dtype=float), contact
        )

    @property
    def touching(self) -> Solves:
        """Return those in contact; solves of which none is are refused."""
        deep = self.depth > 0
        if not deep.any():
            raise UsageError(
                f"None of {len(deep)} solves has contact.",
                why="Without contact a field is what it is at rest.",
                fix="Press deeper, or check the surface and the probe's radius.",
            )
        return self.take(deep)

    def take(self, some: np.ndarray) -> Solves:
        """Those where `some` (N,) is true."""
        kept = [
            (replace(one, X=one.X[own], values=one.values[own], groups=one.groups[own]), interpolation)
            for one, interpolation, own in zip(
                self.snapshots, self.interpolations, self._split(some), strict=True
            )
            if own.any()
        ]
        snapshots, interpolations = zip(*kept, strict=True)
        return replace(self, snapshots=snapshots, interpolations=interpolations)

    def _split(self, rows: np.ndarray) -> list[np.ndarray]:
        """Return the rows of each snapshots, of an array (N, …)."""
        return np.split(rows, np.cumsum([len(one.X) for one in self.snapshots])[:-1])

    @cached_property
    def X(self) -> np.ndarray:
        """Inputs (N, n) of all."""
        return np.concatenate([one.X for one in self.snapshots])

    @cached_property
    def groups(self) -> np.ndarray:
        """Groups (N,) of all."""
        return np.concatenate([one.groups for one in self.snapshots])

    @cached_property
    def depth(self) -> np.ndarray:
        """Depth (N,) of the rigid probe, m."""
        if self.contact is not None:
            return self.contact.at(self.X)[0]
        radius = self.radius if self.radius_input is None else self.X[:, self.radius_input]
        return self.surface.depth(np.ascontiguousarray(self.X[:, :3]), radius)

    @cached_property
    def contact_points(self) -> tuple[np.ndarray, np.ndarray]:
        """Touched places at rest and normals there, each (N, 3)."""
        if self.contact is not None:
            return self.contact.at(self.X)[1:]
        C = np.ascontiguousarray(self.X[:, :3])
        d, normals, _ = self.surface.at(C)
        return C + self.shift - d[:, None] * normals, normals

    def touched(self, local_mode: LocalMode, points: np.ndarray) -> np.ndarray:
        """Return which points (P, 3) in m a local mode moves, (P,) bool."""
        return local_mode.touches(self.surface, points - self.shift)

    @property
    def values(self) -> list[np.ndarray]:
        """Fields of the snapshots."""
        return [one.values for one in self.snapshots]

    @property
    def components(self) -> int:
        """Number of components of the field."""
        return int(self.snapshots[0].values.shape[2])

    @property
    def scaled(self) -> np.ndarray:
        """Inputs (N, n) over the ranges, −1 to 1."""
        low, high = bounds(self.inputs)
        return np.asarray((2.0 * self.X - low - high) / (high - low))

    @property
    def size(self) -> float:
        """Root mean square of the fields over surface and solves."""
        squares = [(one.values**2).sum(axis=2) @ one.mass for one in self.snapshots]
        return float(np.sqrt(np.concatenate(squares).mean()))

    def rows(self) -> Iterator[tuple[int, int]]:
        """Return for every solve the number of its snapshots, and the row there."""
        return ((k, i) for k, one in enumerate(self.snapshots) for i in range(len(one.X)))

    def moving(self, local_mode: LocalMode, amplitude: DepthAmplitude) -> list[np.ndarray]:
        """Return a local mode's share of the snapshots, each (N, P, components), as if all nodes were touched."""
        return [
            moving_values(local_mode, amplitude.deepest, touches, one.points)
            for touches, one in zip(self._touches(amplitude), self.snapshots, strict=True)
        ]

    def _touches(self, amplitude: DepthAmplitude) -> list[np.ndarray]:
        """Return s, f, contact point, normal and further inputs of the snapshots, each (N, 8 + p)."""
        columns = (
            self.depth[:, None],
            amplitude.at(self.depth)[:, None],
            *self.contact_points,
            self.X[:, 3:],
        )
        return self._split(np.hstack(columns))

    def remainder(self, local_mode: LocalMode | None, amplitude: DepthAmplitude) -> np.ndarray:
        """Return the rest that a local mode leaves of the fields at the nodes that are shown, (N, nodes, components).

        It is taken away where it is known, at the nodes of the snapshots; only the rest is carried.
        """
        whole = self._interpolated(self.values)
        if local_mode is None:
            return whole
        shown = self.moving(local_mode, amplitude)
        rest = self._interpolated([u - one for u, one in zip(self.values, shown, strict=True)])
        return np.where(self.touched(local_mode, self.points)[:, None], rest, whole)

    def _interpolated(self, fields: Sequence[np.ndarray]) -> np.ndarray:
        both = zip(self.interpolations, fields, strict=True)
        return np.concatenate(
            [field if interpolation is None else interpolation(field) for interpolation, field in both]
        )
