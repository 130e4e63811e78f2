"""Force, energy and reactions while a sphere presses and slides; states that do not depend on the way to them."""

from __future__ import annotations

import itertools

import ngsolve as ngs
import numpy as np
import pytest

from palpate.physics.interactions import SphereProbe
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block
from palpate.physics.solid import Body

SIZE, RADIUS, PAD, STOP = (0.06, 0.06, 0.03), 0.01, 2e6, 0.004
FOOT = np.array([0.028, 0.033])  # nothing is symmetric about it
SLIDE = 0.002  # m, along x and half as far along y
ORDER = 10  # of the contact energy's own quadrature, which the force shares
STEP = 1e-6  # m, of differences of the energy


def above(foot, depth):
    """The sphere's centre whose tip is at a depth in m below the surface at rest."""
    return np.array([*foot, SIZE[2] + RADIUS - depth])


def pressing():
    """From 3 to 5 mm."""
    return [above(FOOT, depth) for depth in np.linspace(0.003, 0.005, 9)]


def sliding():
    """On at 5 mm."""
    return [above(FOOT + share * np.array([SLIDE, SLIDE / 2]), 0.005) for share in np.linspace(0, 1, 9)]


@pytest.fixture(
    scope="module",
    params=[pytest.param(0.45, id="displacement"), pytest.param(0.4999, id="mixed", marks=pytest.mark.full)],
)
def solver(request):
    probe = SphereProbe(RADIUS, pad=PAD, stop=STOP, depth=(0.0, 0.006))
    return (
        Body(Block(SIZE, element=0.03), NeoHookean(9e3, request.param)).problem(probe, element=0.009).open()
    )


def solved(solver, centres):
    solver.reset()
    found = [solver.solve(centre) for centre in centres]
    assert all(one.converged for one in found), [one.message for one in found]
    return found


@pytest.fixture(scope="module")
def pressed(solver):
    return solved(solver, pressing())


@pytest.fixture(scope="module")
def slid(solver, pressed):
    return solved(solver, sliding())


def work(found):
    """∫ -F · dc in J along straight steps, by the trapezoidal rule and its correction with the slopes of F."""
    total = 0.0
    for a, b in itertools.pairwise(found):
        step = b.inputs - a.inputs
        total -= (a.response + b.response) @ step / 2
        total -= step @ (a.response_gradient - b.response_gradient) @ step / 12
    return total


@pytest.mark.full
def test_the_work_of_pressing_and_sliding_is_the_change_of_energy(pressed, slid):
    """A smooth force would leave an error of h⁴/720 of the change of its third derivative.

    The force has kinks: a quadrature point that comes into contact adds a stiffness K' of a few N/m, up to K'h²/24 or
    1e-5 of the energy to the rule's error, of either sign, and some tens of points do.
    """
    for found in (pressed, slid):
        energies = [one.potential_energy for one in found]
        assert work(found) == pytest.approx(energies[-1] - energies[0], abs=1e-4 * energies[-1])


@pytest.mark.full
@pytest.mark.parametrize("share", [0.25, 1.0])
def test_the_force_is_minus_the_gradient_of_the_energy_while_sliding(solver, slid, share):
    here = slid[round(share * (len(slid) - 1))]
    slope = [
        (solver.solve(here.inputs + e).potential_energy - solver.solve(here.inputs - e).potential_energy)
        / (2 * STEP)
        for e in STEP * np.eye(3)
    ]
    np.testing.assert_allclose(here.response, np.negative(slope), atol=1e-5 * np.linalg.norm(here.response))


def pressure_force(solver, found):
    """∫ φ'(p) n dA in N over the top of the deformed body: the force on the sphere from its pad's pressure."""
    solver._model.field.show(found.state)
    away = ngs.CF(tuple(found.inputs)) - ngs.CF((ngs.x, ngs.y, ngs.z)) - solver._model.field.displacement
    distance = ngs.Norm(away)
    p = RADIUS - distance
    pressure = PAD * p * (1 - p / (2 * STOP)) / (1 - p / STOP) ** 2  # of φ = ½ k p²/(1 - p/p_m)
    mesh, where = solver._model.field.mesh, solver._model.field.surface("top")
    parts = [ngs.IfPos(p, pressure * n, 0) for n in away / distance]
    return np.array([ngs.Integrate(part, mesh, order=ORDER, definedon=where) for part in parts])


def test_the_force_is_the_pads_pressure_and_the_reaction_of_the_support(solver, pressed, slid):
    model = solver._model
    moves = [model.field.interpolate(ngs.CF(tuple(e))) for e in np.eye(3)]
    for found in (pressed[0], slid[0], slid[5], slid[-1]):
        scale = np.linalg.norm(found.response)
        model.set(found.inputs)
        gradient = model.system.gradient(found.state)
        np.testing.assert_allclose(found.response, pressure_force(solver, found), atol=1e-8 * scale)
        np.testing.assert_allclose(found.response, [gradient @ e for e in moves], atol=1e-8 * scale)


@pytest.mark.full
def test_the_state_does_not_depend_on_the_way(solver, slid):
    """By sliding, straight from outside, back from 6 mm, and from the other side."""
    by_sliding = slid[5]
    centre = by_sliding.inputs
    foot = centre[:2]
    deeper, aside = above(foot, 0.006), above(np.add(foot, (0.001, -0.001)), 0.0045)
    for way in ([], [deeper], [aside]):
        other = solved(solver, [*way, centre])[-1]
        assert other.potential_energy == pytest.approx(by_sliding.potential_energy, rel=1e-10)
        scale = np.abs(other.displacement).max()
        np.testing.assert_allclose(other.displacement, by_sliding.displacement, atol=1e-7 * scale)
        np.testing.assert_allclose(
            other.response, by_sliding.response, atol=1e-7 * np.linalg.norm(other.response)
        )
