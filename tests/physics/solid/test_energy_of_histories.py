"""Energies of bodies with a history: what an instant stores, and the balance of work, stored energy and heat."""

from __future__ import annotations

import numpy as np
import pytest
from solids import SIZE, Stretched, above, gel

from laws.histories import march
from palpate.physics.interactions import SphereProbe
from palpate.physics.materials import LinearElastic, LinearHardening, Plastic, Viscoelastic
from palpate.physics.shapes import Block
from palpate.physics.solid import Body

PROBE = SphereProbe(radius=0.01, depth=(0.0, 0.005))
ELEMENT = 0.018  # m: what is tested holds on any mesh
PLACE = above(0.003)
TERMS = ((0.4, 2.0), (0.2, 20.0))
STEP = 1e-6  # m
MATRIX = np.array([[0.02, 0.01, 0.0], [0.0, -0.01, 0.004], [0.006, 0.0, 0.008]])


def under_probe(material, **options):
    return Body(Block(SIZE, element=0.03), material, **options).problem(PROBE, element=ELEMENT)


@pytest.mark.full
@pytest.mark.parametrize("poisson", [0.45, 0.5])
def test_in_an_instant_force_and_energy_are_those_of_the_elastic_law(poisson):
    """Nothing flows: U is the elastic one, and its derivatives are force and stiffness."""
    elastic = under_probe(gel(poisson)).solve(PLACE)
    solver = under_probe(Viscoelastic(gel(poisson), TERMS)).open()
    found = solver.solve(PLACE)
    # in mixed form NGSolve integrates an elastic law by a finer rule: see History
    assert found.potential_energy == pytest.approx(
        elastic.potential_energy, rel=1e-7 if poisson < 0.48 else 1e-3
    )
    up = np.array([0.0, 0.0, STEP])
    ahead, behind = (solver.solve(PLACE + sign * up) for sign in (1, -1))
    slope = (ahead.potential_energy - behind.potential_energy) / (2 * STEP)
    assert found.response[2] == pytest.approx(-slope, rel=1e-5)
    near = [solver.solve(PLACE + sign * up / 10).response for sign in (1, -1)]
    stiffness = found.response_gradient[2]
    error = np.abs((near[0] - near[1]) / (STEP / 5) - stiffness).max()
    assert error < 1e-5 * np.abs(stiffness).max()


LAWS = {
    "viscoelastic": Viscoelastic(LinearElastic(young=9e3, poisson=0.45), TERMS),
    "plastic": Plastic(LinearElastic(young=9e3, poisson=0.45), LinearHardening(50.0, 2e3)),
}


@pytest.mark.full
@pytest.mark.parametrize("form", ["displacement", "mixed"])
@pytest.mark.parametrize("law", LAWS)
def test_work_is_stored_and_lost(law, form):
    """Stretched and brought back homogeneously, so that the law alone tells the heat, in J/m³."""
    size, share = (0.02, 0.02, 0.01), np.r_[np.linspace(0, 1, 41), np.linspace(1, 0.2, 33)[1:]]
    body = Body(Block(size, element=0.02), LAWS[law], fixed=(), formulation=form)
    found = (
        body.problem(Stretched(tuple(map(tuple, MATRIX))))
        .open()
        .march(0.1 * np.arange(1, len(share)), share[1:, None])
    )
    volume = np.prod(size)
    work = np.cumsum(_trapezoids(np.r_[0.0, [-one.response[0] for one in found]], share))
    *_, heat, stored = march(LAWS[law], np.eye(3) + share[:, None, None] * MATRIX, 0.1)
    energy = np.array([one.strain_energy for one in found])
    np.testing.assert_allclose(energy, stored[1:] * volume, rtol=1e-9)
    np.testing.assert_array_equal(energy, [one.potential_energy for one in found])
    # the trapezoid's error in 40 steps, and a step in which the plastic body begins to flow
    np.testing.assert_allclose(energy + np.cumsum(heat[1:]) * volume, work, atol=2e-3 * work.max())
    assert np.sum(heat) * volume > 0.05 * work.max()


def _trapezoids(values, places):
    return (values[1:] + values[:-1]) / 2 * np.diff(places)
