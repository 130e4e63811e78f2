"""Cook's membrane, nearly incompressible and in plane strain: a body that locks where displacements stand alone.

A panel with the corners (0, 0), (48, 44), (48, 60) and (0, 44) mm, clamped at x = 0 and sheared upwards by a uniform
dead traction at x = 48 mm (Cook 1974, J. Struct. Div. ASCE 100, 1851-1863). Plane strain: a slab whose faces slide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from benchmark_bodies import Boxes

from palpate.physics.interactions import SurfaceTraction, roller
from palpate.physics.materials import LinearElastic, NeoHookean
from palpate.physics.solid import Body

MM = 1e-3


@dataclass(frozen=True)
class Panel:
    """From the unit cube to the slab, of a thickness in m."""

    thickness: float

    def __call__(self, points):
        s, t, w = points.T
        low, high = 44 * s, 44 + 16 * s
        return np.stack([48 * MM * s, MM * (low + t * (high - low)), self.thickness * w], axis=1)


def raised(material, n, traction, point, form="auto"):
    """Displacement upwards in m of a point (x, y) in m, n elements along each side."""
    shape = Boxes((n, n, 1), Panel(48 * MM / n))
    held = (roller("bottom", "z"), roller("top", "z"))
    body = Body(shape, material, fixed="left", held=held, formulation=form)
    solver = body.problem(SurfaceTraction("right", "y", (0.0, 2 * traction))).open()
    found = solver.solve(traction)
    assert found.converged, found.message
    field = solver._model.field
    field.show(found.state)
    return float(field.displacement(field.mesh(*point, shape.place.thickness / 2))[1])


# Finite strain, E = 240.565 MPa, ν = 0.4999 (μ = 80.1938 MPa, K = 400942 MPa), W = ½ μ (Ī₁ - 3) + ½ K (J - 1)²,
# F = 100 N on 16 mm × 1 mm: de Souza Neto et al. 1996, Int. J. Solids Struct. 33, 3277-3296; Elguedj et al. 2008,
# Comput. Methods Appl. Mech. Eng. 197, 2732-2762. The benchmark of OpenGeoSys for this law has, by F-bar elements,
# 6.891 mm at the upper corner with 30 elements along a side (6.873 with 25), 4.703 mm without F-bar.
RUBBER = NeoHookean(240.565e6, 0.4999, form="isochoric")
SHEAR = 6.25e6
CORNER, RUBBER_RISE = (48 * MM, 60 * MM), 6.891 * MM
# Small strain, λ = 7500, μ = 0.375 (ν = 0.499975), F = 1 per unit of thickness (here in N, mm): 16.432584 at the middle
# of the loaded side, by Richardson extrapolation of nodally integrated triangles; the reference of P. Krysl's FAESOR
# programs (elements of Krysl & Zhu 2008, Int. J. Numer. Methods Eng. 76, 1020-1043).
LAME, MU = 7500e6, 0.375e6
GEL = LinearElastic(MU * (3 * LAME + 2 * MU) / (LAME + MU), LAME / 2 / (LAME + MU))
LINE = 1e6 / 16
MIDDLE, GEL_RISE = (48 * MM, 52 * MM), 16.432584 * MM


def raised_by_linear_displacements(material, n, traction, point):
    """The same by displacements of first order, which a `Body` refuses."""
    import ngsolve as ng

    shape = Boxes((n, n, 1), Panel(48 * MM / n))
    mesh = shape.mesh()
    space = ng.VectorH1(mesh, order=1, dirichlet="left", dirichletz="bottom|top")
    u, v = space.TnT()
    form, load, found = ng.BilinearForm(space, symmetric=True), ng.LinearForm(space), ng.GridFunction(space)
    form += ng.Variation(material.energy(ng.Id(3) + ng.Grad(u)) * ng.dx)
    load += traction * v[1] * ng.ds("right")
    form.AssembleLinearization(found.vec)
    found.vec.data = form.mat.Inverse(space.FreeDofs(), inverse="sparsecholesky") * load.Assemble().vec
    return float(found(mesh(*point, shape.place.thickness / 2))[1])


def limit(values):
    """Aitken's extrapolation of three values on meshes whose elements are halved."""
    first, second = np.diff(values)
    return values[-1] + second / (first / second - 1)


@pytest.mark.full
def test_displacements_alone_lock_and_the_mixed_form_does_not():
    """Eight elements along a side: first order reaches 28 %, second order 93 %, the mixed form 98 %."""
    mixed, stiff = (raised(GEL, 8, LINE, MIDDLE, form) / GEL_RISE for form in ("mixed", "displacement"))
    stiffest = raised_by_linear_displacements(GEL, 8, LINE, MIDDLE) / GEL_RISE
    assert GEL.poisson > 0.4999
    assert 0.98 < mixed < 1
    assert stiff < 0.94
    assert stiffest < 0.3
    assert raised(GEL, 4, LINE, MIDDLE) > stiff * GEL_RISE  # the mixed form with half the elements is better


@pytest.mark.full
def test_small_strain_meets_the_published_rise():
    values = [raised(GEL, n, LINE, MIDDLE) for n in (4, 8, 16)]
    assert limit(values) == pytest.approx(GEL_RISE, rel=2e-3)


@pytest.mark.full
def test_finite_strain_meets_the_published_rise():
    values = [raised(RUBBER, n, SHEAR, CORNER) for n in (2, 4, 8)]
    assert limit(values) == pytest.approx(RUBBER_RISE, rel=5e-3)
