"""The value a user writes: a mesh, two moduli, what is held."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.massspring.pad import PointPad, point_areas
from benchmarks.massspring.springs import SpringNetwork, spring_network
from palpate.errors import UsageError
from palpate.physics.solid.solid_checks import by_region, surfaces_of

if TYPE_CHECKING:
    from benchmarks.massspring.solver import MassSpringSolver

__all__ = ["MassSpringBody"]


@dataclass(frozen=True, eq=False)
class MassSpringBody:
    """A body of points and springs on the tetrahedra of a mesh.

    Parameters
    ----------
    mesh : BodyMesh
        Points, tetrahedra, named surfaces and regions, m.
    material : Material or {region: Material}
        Gives Young's modulus, Poisson's ratio and the density; anything else a material knows is lost on springs.
    fixed : str or tuple of str
        Surfaces whose points don't move.
    volume : bool
        Whether the tetrahedra resist a change of volume; without it every material behaves as if ν were 1/4.

    Raises
    ------
    UsageError
        If a surface or region is unknown, or nothing is fixed.

    Examples
    --------
    >>> rival = MassSpringBody(problem.mesh, tissue, fixed="bottom")    # doctest: +SKIP
    >>> rival.open(probe).solve((0.05, 0.05, 0.055)).response           # doctest: +SKIP
    """

    mesh: Any
    material: Any
    fixed: str | tuple[str, ...] = "bottom"
    volume: bool = True

    def __post_init__(self) -> None:
        if not self.fixed_surfaces:
            raise UsageError("Nothing is fixed.", fix="Name a surface: fixed='bottom'.")
        self._per_tetrahedron("young")

    @property
    def fixed_surfaces(self) -> tuple[str, ...]:
        """Names of the fixed surfaces."""
        return surfaces_of(self.fixed, self.mesh)

    def network(self) -> SpringNetwork:
        """The springs and volumes."""
        young, poisson = self._per_tetrahedron("young"), self._per_tetrahedron("poisson")
        return spring_network(self.mesh.points, self.mesh.tetrahedra, young, poisson, volume=self.volume)

    def masses(self) -> np.ndarray:
        """Mass of each point in kg, shape (node,): a quarter of each tetrahedron's."""
        quarter = self._per_tetrahedron("density") * self.mesh.volumes / 4
        corners = self.mesh.tetrahedra
        return np.bincount(corners.ravel(), np.repeat(quarter, 4), minlength=len(self.mesh.points))

    def free(self) -> np.ndarray:
        """Which points may move, bool of shape (node,): those of the tetrahedra that are not fixed."""
        moves = np.zeros(len(self.mesh.points), dtype=bool)
        moves[self.mesh.tetrahedra] = True
        for surface in self.fixed_surfaces:
            moves[self.mesh.triangles_of(surface)] = False
        return moves

    def pad(self, probe: Any) -> PointPad:
        """The pad of a `SphereProbe` on the points of the surface it touches."""
        triangles = self.mesh.triangles_of(probe.touches)
        areas = point_areas(self.mesh.points, triangles)
        nodes = np.flatnonzero((areas > 0) & self.free())
        stop = np.inf if probe.stop is None else probe.stop
        return PointPad(nodes, areas[nodes], probe.radius, probe.pad, stop)

    def open(self, probe: Any) -> MassSpringSolver:
        """A solver for a `SphereProbe`, at rest and out of contact."""
        from benchmarks.massspring.solver import MassSpringSolver

        return MassSpringSolver(self, probe)

    def _per_tetrahedron(self, quantity: str) -> np.ndarray:
        regions = self.mesh.regions
        materials = dict(by_region(self.material, regions, ("young", "poisson", "density")))
        values = np.array([float(getattr(materials[region], quantity)) for region in regions])
        return np.asarray(values[self.mesh.region_of])
