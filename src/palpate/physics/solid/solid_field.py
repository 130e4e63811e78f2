"""The unknowns of an opened body: displacement of order k and, in regions of mixed form, pressure of order k - 1.

The pair is that of Taylor & Hood (1973, Comput. Fluids 1, 73-100), stable for k ≥ 2. Each mixed region has a
pressure of its own, so that it may jump between materials.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from palpate.physics.shapes.mesh import BodyMesh
from palpate.physics.shapes.naming import members, require_known

__all__ = ["CORNERS", "MIDDLES", "MidSides", "SolidField"]

CORNERS = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]])  # of NGSolve's tetrahedron
PAIRS = list(itertools.combinations(range(4), 2))
# middles of its edges, in the order of `PAIRS`
MIDDLES = np.array([(CORNERS[i] + CORNERS[j]) / 2 for i, j in PAIRS])


@dataclass(frozen=True, eq=False)
class MidSides:
    """Nodes in the middle of edges."""

    edges: np.ndarray  # (m, 2) vertices that each lies between, the lower number first, in ascending order
    points: np.ndarray  # (m, 3) places at rest in m; beside the straight edge where elements are curved
    displacement: np.ndarray  # (m, 3) in m


class SolidField:
    """Finite-element space of a body, and the state under inspection (an `interactions.Field`).

    `rest` is the NGSolve mesh `mesh` as plain arrays, `order` the polynomial order of the displacement, which is zero
    on the surfaces `fixed`; the regions `mixed` have a pressure as well.
    """

    def __init__(
        self, mesh: Any, rest: BodyMesh, order: int, fixed: Sequence[str], mixed: Sequence[str] = ()
    ) -> None:
        import ngsolve

        ngsolve.SetNumThreads(1)
        self.mesh, self.rest, self.order = mesh, rest, order
        for name in fixed:
            require_known("surface", name, rest.surfaces)
        fixed_parts = [member for name in fixed for member in members(name, rest.surfaces)]
        motion = ngsolve.VectorH1(mesh, order=order, dirichlet=_pattern(fixed_parts))
        pressures = [
            ngsolve.Compress(ngsolve.H1(mesh, order=order - 1, definedon=mesh.Materials(_pattern([region]))))
            for region in mixed
        ]
        self.space = ngsolve.FESpace([motion, *pressures]) if mixed else motion
        trial = self.space.TrialFunction()
        self.trial = trial[0] if mixed else trial
        self.pressure_trial = dict(zip(mixed, trial[1:], strict=True)) if mixed else {}
        self.state = ngsolve.GridFunction(self.space)
        parts = self.state.components if mixed else (self.state,)
        self.displacement = parts[0]
        self.pressure = dict(zip(mixed, parts[1:], strict=True))
        self.base = ngsolve.GridFunction(motion)
        self.motion_size = int(motion.ndof)
        self.free = np.fromiter(self.space.FreeDofs(), dtype=bool, count=self.space.ndof)

    @property
    def size(self) -> int:
        """Number of all unknowns."""
        return int(self.space.ndof)

    @property
    def moving(self) -> np.ndarray:
        """Mask of the displacements among the unknowns, bool of shape (dof,)."""
        return np.arange(self.size) < self.motion_size

    def show(self, z: np.ndarray) -> None:
        """Make unknowns (dof,) the state under inspection."""
        self.state.vec.FV().NumPy()[:] = z

    def set_base(self, z: np.ndarray) -> None:
        """Make the displacement in unknowns (dof,) the body's base state."""
        self.base.vec.FV().NumPy()[:] = z[: self.motion_size]

    def surface(self, name: str) -> Any:
        """Return the NGSolve region of a named surface."""
        require_known("surface", name, self.rest.surfaces)
        return self.mesh.Boundaries(_pattern(members(name, self.rest.surfaces)))

    def region(self, name: str) -> Any:
        """Return the NGSolve region of a named part of the volume."""
        return self.mesh.Materials(_pattern([name]))

    def surface_dofs(self, name: str) -> np.ndarray:
        """Return a mask of the displacements on a named surface, bool of shape (dof,)."""
        dofs = np.fromiter(self.space.GetDofs(self.surface(name)), dtype=bool, count=self.size)
        return np.asarray(dofs & self.moving)

    def at_nodes(self, field: Any = None) -> np.ndarray:
        """Return values (node, 3) in m of `displacement`, or of another such grid function, at the mesh's vertices."""
        values = (self.displacement if field is None else field).vec.FV().NumPy()
        # the components one after the other, each beginning with the vertices
        return np.array(values.reshape(3, -1)[:, : len(self.rest.points)].T)

    def interpolate(self, displacement: Any) -> np.ndarray:
        """Return unknowns (dof,) of a displacement given as a coefficient function (3,), on the whole body."""
        import ngsolve

        image = ngsolve.GridFunction(self.base.space)
        image.Set(displacement)
        return self._embed(image.vec.FV().NumPy())

    def load(self, integrand: Callable[[Any], Any]) -> np.ndarray:
        """Return the load vector l (dof,) of a linear form, given as a function of the test displacement v."""
        import ngsolve

        form = ngsolve.LinearForm(self.base.space)
        form += integrand(self.base.space.TestFunction())
        form.Assemble()
        return self._embed(form.vec.FV().NumPy())

    def mid_sides(self) -> MidSides:
        """Return the middles of edges, displaced as the field is."""
        edges, places, points = self._middles
        return MidSides(edges, points, np.asarray(self.displacement(places)))

    @cached_property
    def _middles(self) -> tuple[np.ndarray, Any, np.ndarray]:
        """Edges (m, 2), NGSolve's mapped points in their middles, and these places (m, 3) in m."""
        import ngsolve

        rule = ngsolve.IntegrationRule(points=[tuple(m) for m in MIDDLES], weights=[1 / 36] * 6)
        mapped = self.mesh.MapToAllElements(rule, self.mesh.Materials(".*"))
        nodes = self.mesh.ngmesh.Elements3D().NumPy()["nodes"][:, :4].astype(np.int64) - 1
        ends = np.sort(nodes[:, PAIRS].reshape(-1, 2), axis=1)
        edges, first = np.unique(ends, axis=0, return_index=True)
        places = mapped[first]
        points = np.asarray(ngsolve.CF((ngsolve.x, ngsolve.y, ngsolve.z))(places))
        return edges, places, points

    def _embed(self, motion: np.ndarray) -> np.ndarray:
        unknowns = np.zeros(self.size)
        unknowns[: self.motion_size] = motion
        return unknowns


def _pattern(names: Sequence[str]) -> str:
    """Return a regular expression that matches these names only, as NGSolve reads regions."""
    return "|".join(re.escape(name) for name in names)
