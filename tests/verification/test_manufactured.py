"""Orders of convergence against manufactured solutions.

The unit cube slides along its planes, and its top is lifted by q. Prescribed is a displacement whose images in these
planes continue it smoothly, so that neither it nor the adjoint solution has a singularity at edges, and the theory of
smooth solutions holds (Babuška & Aziz 1972; for functionals of the solution Babuška & Miller 1984, Int. J. Numer.
Methods Eng. 20, 1085-1109): order k + 1 in L2, k in H1, 2k in the reaction force; the pressure of the mixed pair k.
The body force that belongs to it enters by parts: b·v = P : ∇v less the work of the top's tractions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from benchmark_bodies import Boxes, Loaded, Moved

from palpate.physics.interactions import roller
from palpate.physics.materials import LinearElastic, NeoHookean
from palpate.physics.solid import Body

SIDES = (("left", "x"), ("right", "x"), ("front", "y"), ("back", "y"), ("bottom", "z"))
QUADRATURE = 4  # beyond that of polynomials, for the sines


@dataclass(frozen=True)
class Case:
    """A material, its form, and the prescribed displacement: shares of three waves, and the lift of the top.

    Nearly incompressible bodies have waves without divergence and a small lift: otherwise the pressure is hundreds of
    times the shear stress, and its error, which the displacement's bound contains (Brezzi & Fortin 1991, section
    VI.3), hides all else.
    """

    material: Any
    form: str
    waves: tuple[float, float, float]
    lift: float

    def exact(self):
        """u (3,) on the unit cube: no normal displacement on five faces, the lift on the top."""
        import ngsolve as ng

        x, y, z = (math.pi * axis for axis in (ng.x, ng.y, ng.z))
        u = self.waves[0] * ng.sin(x) * ng.cos(y) * ng.cos(z)
        v = self.waves[1] * ng.cos(x) * ng.sin(y) * ng.cos(z)
        w = self.waves[2] * ng.cos(x) * ng.cos(y) * ng.sin(z) + self.lift * ng.z
        return ng.CF((u, v, w))

    def gradient(self):
        """∂u/∂X (3, 3)."""
        import ngsolve as ng

        u = self.exact()
        return ng.CF(tuple(u[i].Diff(axis) for i in range(3) for axis in (ng.x, ng.y, ng.z)), dims=(3, 3))

    def stress(self):
        """P (3, 3) in Pa."""
        import ngsolve as ng

        F = (ng.Id(3) + self.gradient()).MakeVariable()
        return self.material.energy(F).Diff(F).Compile()

    def body_force(self):
        return Loaded(self._work)

    def _work(self, field, v):
        import ngsolve as ng

        inside = ng.InnerProduct(self.stress(), ng.Grad(v)) * ng.dx(bonus_intorder=QUADRATURE)
        traction = (self.stress() * ng.specialcf.normal(3)) * v
        return inside - traction * ng.ds(definedon=field.surface("top"), bonus_intorder=QUADRATURE)


def errors(n, case):
    """L2 and H1 of the displacement, reaction at the top and, in mixed form, L2 of the pressure, all relative."""
    import ngsolve as ng

    held = tuple(roller(*pair) for pair in SIDES)
    body = Body(Boxes((n, n, n), np.copy), case.material, fixed=(), held=held, formulation=case.form)
    lift = Moved(lambda x, y, z: (0, 0, 1), surfaces=(), sliding=(("top", 2),))
    solver = body.problem(lift, case.body_force()).open(tolerance=1e-11)
    found = solver.solve((case.lift, 1.0))
    assert found.converged, found.message
    field = solver._model.field
    field.show(found.state)

    def share(found, wanted):
        squares = [ng.InnerProduct(f, f).Compile() for f in (found - wanted, wanted)]
        whole = ng.Integrate(ng.CF(tuple(squares)), field.mesh, order=2 * (2 + QUADRATURE))
        return math.sqrt(whole[0] / whole[1])

    top = ng.ds(definedon=field.surface("top"), bonus_intorder=2 * QUADRATURE)
    force = -ng.Integrate(case.stress()[2, 2] * top, field.mesh)
    known = [share(field.displacement, case.exact()), share(ng.Grad(field.displacement), case.gradient())]
    known.append(abs(found.response[0] / force - 1))
    if case.form == "mixed":
        volumetric = case.material.volumetric
        pressure = volumetric.modulus * volumetric.measure(ng.Id(3) + case.gradient())
        known.append(share(field.pressure["body"], pressure))
    return np.array(known)


PLAIN, SOLENOIDAL = (0.04, -0.028, 0.02), (0.02, -0.014, -0.006)
CASES = {
    "linear": Case(LinearElastic(9e3, 0.3), "displacement", PLAIN, 0.1),
    "neo-Hooke": Case(NeoHookean(9e3, 0.3), "displacement", PLAIN, 0.1),
    "linear mixed": Case(LinearElastic(9e3, 0.4999), "mixed", SOLENOIDAL, 1e-3),
    "neo-Hooke mixed": Case(NeoHookean(9e3, 0.49, form="isochoric"), "mixed", SOLENOIDAL, 0.01),
}

K = 2  # order of the displacement


def observed(name):
    """Orders from elements of a third to those of a sixth of the side."""
    return np.log2(errors(3, CASES[name]) / errors(6, CASES[name]))


@pytest.mark.full
def test_displacement_and_force_converge_as_theory_says():
    distance, slope, reaction = observed("neo-Hooke")
    assert distance == pytest.approx(K + 1, abs=0.2)
    assert slope == pytest.approx(K, abs=0.2)
    assert reaction > 2 * K - 0.2


@pytest.mark.full
def test_the_force_is_exact_where_its_adjoint_solution_is_linear():
    """At small strain the reaction to a lift tests equilibrium with uniaxial strain, which the elements hold."""
    assert errors(4, CASES["linear"])[2] < 1e-10


@pytest.mark.full
def test_small_strain_converges_as_theory_says():
    distance, slope, _ = observed("linear")
    assert distance == pytest.approx(K + 1, abs=0.2)
    assert slope == pytest.approx(K, abs=0.2)


@pytest.mark.full
@pytest.mark.parametrize("name", ["linear mixed", "neo-Hooke mixed"])
def test_the_mixed_form_converges_as_theory_says(name):
    """At least: the displacement begins above its asymptote, where what it inherits from the pressure still counts."""
    distance, slope, reaction, pressure = observed(name)
    assert distance > K + 0.8
    assert slope > K - 0.2
    assert pressure > K - 0.1
    if name == "neo-Hooke mixed":
        assert reaction > 2 * K - 0.2
