"""The strain energy of a plane beam on NGSolve finite elements.

Geometrically exact (Reissner 1972, J. Appl. Math. Phys. 23, 795-804; Simo 1985, Comput. Methods Appl. Mech.
Eng. 49, 55-70): with the centre line's displacement (u, v) and the section's rotation t over the arc length x
of the undeformed beam,

    axial strain  ε = (1 + u') cos t + v' sin t - 1
    shear strain  γ = v' cos t - (1 + u') sin t
    curvature     κ = t'
    W = ½ ∫ EA ε² + kGA γ² + EI κ² dx

The small-displacement beam (Timoshenko 1921) has ε = u', γ = v' - t and κ = t' instead.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

__all__ = ["ReissnerBeam", "Stiffness"]


@dataclass(frozen=True)
class Stiffness:
    """Section stiffnesses: stretching EA and shear kGA in N, bending EI in N·m²."""

    axial: float
    shear: float
    bending: float


class ReissnerBeam:
    """Strain energy, internal forces and tangent of a clamped plane beam (a `newton.Model`).

    Unknowns z (dof,) are nodal and interior values of u, v, t, ordered along the beam so that the tangent has
    a narrow band; the clamped ones are left out.

    Parameters
    ----------
    vertices : (node,) array
        Positions of the mesh's vertices in m, ascending; the first one is clamped.
    order : int
        Polynomial order of the elements.
    stiffness : Stiffness
    large : bool
        Geometrically exact, or small displacements.
    """

    def __init__(self, vertices: np.ndarray, order: int, stiffness: Stiffness, *, large: bool) -> None:
        import ngsolve

        ngsolve.SetNumThreads(1)
        scalar = ngsolve.H1(_mesh(vertices), order=order)
        self._space = ngsolve.FESpace([scalar, scalar, scalar])
        self._field = ngsolve.GridFunction(self._space)
        self._work = self._field.vec
        self._result = self._work.CreateVector()
        self._measures = ngsolve.CF(_strains(self._field.components, large=large))
        self._form = ngsolve.BilinearForm(self._space)
        axial, shear, curvature = _strains(self._space.TrialFunction(), large=large)
        density = (
            stiffness.axial * axial**2 + stiffness.shear * shear**2 + stiffness.bending * curvature**2
        ) / 2
        self._form += ngsolve.Variation(density.Compile() * ngsolve.dx)
        self._number(scalar.ndof, len(vertices))
        # what an indefinite tangent is shifted by: a buckled beam is short of bending stiffness only
        bending = ngsolve.BilinearForm(self._space)
        bending += ngsolve.Variation(stiffness.bending * curvature**2 / 2 * ngsolve.dx)
        self._bending = self._banded(bending, np.zeros(self.size))
        self._vertices = vertices
        self.energy_floor = 1e-24 * stiffness.bending / float(vertices[-1] - vertices[0])

    def _number(self, scalar_ndof: int, vertex_count: int) -> None:
        """Number the unknowns along the beam and find the tangent's entries in banded storage."""
        import ngsolve

        offsets = np.arange(3) * scalar_ndof
        order: list[int] = list(offsets)  # the three values of vertex 0, which is clamped
        for element in range(vertex_count - 1):
            dofs = np.array(self._space.GetDofNrs(ngsolve.ElementId(ngsolve.VOL, element)))
            interior = np.setdiff1d(dofs, np.add.outer([element, element + 1], offsets).ravel())
            order += [*interior, *(element + 1 + offsets)]
        self.root = np.array(order[:3])
        self._free = np.array(order[3:])
        # position of each vertex's three values among the free unknowns; vertex 0 has none
        position = np.full(self._space.ndof, -1)
        position[self._free] = np.arange(self._free.size)
        self.vertex_dofs = position[np.add.outer(np.arange(1, vertex_count), offsets)]
        self._form.AssembleLinearization(self._field.vec)
        _, columns, starts = self._form.mat.CSR()
        rows = position[np.repeat(np.arange(self._space.ndof), np.diff(np.asarray(starts, dtype=int)))]
        columns = position[np.asarray(columns)]
        self._entries = np.flatnonzero((rows >= 0) & (columns >= rows))
        rows, columns = rows[self._entries], columns[self._entries]
        band = int((columns - rows).max())
        self._band_index = (band + rows - columns, columns)
        self._band_shape = (band + 1, self._free.size)
        self._is_translation = self._free < 2 * scalar_ndof
        self._translations = np.zeros(self._band_shape)
        self._translations[self._band_index] = self._is_translation[rows] & self._is_translation[columns]

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self._free.size)

    def energy(self, z: np.ndarray) -> float:
        """W in J."""
        return float(self._form.Energy(self._at(z)))

    def force(self, z: np.ndarray) -> np.ndarray:
        """∂W/∂z, shape (dof,)."""
        forces: np.ndarray = self._forces(z)[self._free]
        return forces

    def clamp_force(self, z: np.ndarray) -> np.ndarray:
        """∂W/∂(u, v, t) at the clamped vertex, shape (3,)."""
        forces: np.ndarray = self._forces(z)[self.root]
        return forces

    def tangent(self, z: np.ndarray) -> BandedTangent:
        """∂²W/∂z²."""
        return BandedTangent(self._banded(self._form, z), self._bending)

    def relax(self, z: np.ndarray, load: np.ndarray) -> np.ndarray:
        """Minimise W - load·z over u and v, the rotations held: given them, the strains are linear in u and v.

        The axial and shear forces are then in balance with the loads, however slender the beam.
        """
        banded = self._banded(self._form, z) * self._translations
        banded[-1] += ~self._is_translation
        tangent = BandedTangent(banded, self._bending)
        step = tangent.solve((self.force(z) - load) * self._is_translation, 0.0)
        return z if step is None else z - step

    def distributed(self, force: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
        """Load vector of a constant force per length (x, y) in N/m: (dof,) and the clamped three."""
        import ngsolve

        du, dv, _ = self._space.TestFunction()
        form = ngsolve.LinearForm(self._space)
        form += (force[0] * du + force[1] * dv) * ngsolve.dx
        form.Assemble()
        values = form.vec.FV().NumPy()
        return values[self._free].copy(), values[self.root].copy()

    def strains(self, z: np.ndarray, per_element: int = 5) -> np.ndarray:
        """Axial strain, shear strain and curvature from end to end of each element, shape (points, 3)."""
        self._at(z)
        # just inside its ends, where a point belongs to one element only
        inside = np.linspace(1e-9, 1 - 1e-9, per_element)
        x = (self._vertices[:-1, None] + np.diff(self._vertices)[:, None] * inside).ravel()
        return np.asarray(self._measures(self._space.mesh(x)))

    def _at(self, z: np.ndarray) -> Any:
        self._work.FV().NumPy()[self._free] = z
        return self._work

    def _banded(self, form: Any, z: np.ndarray) -> np.ndarray:
        """Second derivative of an energy in upper banded storage."""
        form.AssembleLinearization(self._at(z))
        banded = np.zeros(self._band_shape)
        banded[self._band_index] = np.asarray(form.mat.CSR()[0])[self._entries]
        return banded

    def _forces(self, z: np.ndarray) -> np.ndarray:
        self._form.Apply(self._at(z), self._result)
        return np.asarray(self._result.FV().NumPy())


class BandedTangent:
    """A symmetric matrix K, and M to shift it by, in upper banded storage (band + 1, dof) (a `newton.Tangent`)."""

    def __init__(self, banded: np.ndarray, shifter: np.ndarray) -> None:
        self._banded, self._shifter = banded, shifter

    def solve(self, rhs: np.ndarray, shift: float) -> np.ndarray | None:
        """(K + shift·M)⁻¹ rhs by Cholesky's method, or None if K + shift·M is not positive definite."""
        banded = self._banded + shift * self._shifter if shift else self._banded
        try:
            factor = cholesky_banded(banded, check_finite=False)
        except LinAlgError:
            return None
        solution: np.ndarray = cho_solve_banded((factor, False), rhs, check_finite=False)
        return solution


def _mesh(vertices: np.ndarray) -> Any:
    """A one-dimensional mesh of the given vertices."""
    import ngsolve
    from netgen.meshing import Element0D, Element1D, MeshPoint, Pnt
    from netgen.meshing import Mesh as NetgenMesh

    mesh = NetgenMesh(dim=1)
    points = [mesh.Add(MeshPoint(Pnt(float(x), 0, 0))) for x in vertices]
    mesh.SetMaterial(1, "beam")
    for left, right in itertools.pairwise(points):
        mesh.Add(Element1D([left, right], index=1))
    mesh.Add(Element0D(points[0], index=1))
    mesh.Add(Element0D(points[-1], index=2))
    mesh.SetBCName(0, "root")
    mesh.SetBCName(1, "tip")
    return ngsolve.Mesh(mesh)


def _strains(field: Any, *, large: bool) -> tuple[Any, Any, Any]:
    """Axial strain, shear strain and curvature of (u, v, t)."""
    import ngsolve

    u, v, t = field
    du, dv, dt = (ngsolve.grad(part)[0] for part in (u, v, t))
    if not large:
        return du, dv - t, dt
    sin, cos = ngsolve.sin(t), ngsolve.cos(t)
    # cos t - 1 = -2 sin²(t/2): the strains of tiny deflections keep all their digits
    return du * cos + dv * sin - 2 * ngsolve.sin(t / 2) ** 2, dv * cos - du * sin - sin, dt
