"""Round, imported, layered and pre-loaded bodies under a probe, and bodies that remember.

Wherever a body is elastic: the force is the derivative of the energy, the reactions balance it, without contact there
is nothing, whatever came before, and on a smooth surface the probe is pushed along the outward normal.
"""

from __future__ import annotations

import ngsolve
import numpy as np
import pytest
from solids import gel

from palpate.physics.interactions import Fixed, PrescribedDisplacement, SphereProbe
from palpate.physics.interactions.surface_patch import surface_of
from palpate.physics.materials import (
    LinearElastic,
    LinearHardening,
    NeoHookean,
    Ogden,
    Plastic,
    Viscoelastic,
    Yeoh,
)
from palpate.physics.shapes import Block, Dome, ImportedSolid, LayeredBlock, Organ, Tube
from palpate.physics.solid import Body

STEP = 1e-6  # m
ASIDE = np.array([0.3, -0.2, 0.933])
ASIDE /= np.linalg.norm(ASIDE)
BALL, SMALL, SIZE = 0.03, 0.008, (0.04, 0.04, 0.02)


def half_ball(folder, kind):
    """Half a ball of 30 mm, in a file in mm; facets of 8 mm in an STL file."""
    from netgen.occ import Box, OCCGeometry, Pnt, Sphere

    solid = Sphere(Pnt(0, 0, 0), 1e3 * BALL) * Box(Pnt(-40, -40, 0), Pnt(40, 40, 40))
    path = folder / f"half.{kind}"
    if kind == "step":
        solid.WriteStep(str(path))
    else:
        OCCGeometry(solid).GenerateMesh(maxh=8).Export(str(path), "STL Format")
    return ImportedSolid(path, unit="mm" if kind == "stl" else None)


def imported(folder, kind):
    shape = half_ball(folder, kind)
    areas = shape.rest().areas
    top, bottom = max(areas, key=areas.get), min(areas, key=areas.get)
    probe = SphereProbe(SMALL, touches=top)
    return Body(shape, gel(), fixed=bottom).problem(probe, element=0.008), ASIDE * (BALL + SMALL), ASIDE


def layered(_):
    shape = LayeredBlock(extent=SIZE[:2], layers=(("skin", 0.003), ("fat", 0.007), ("muscle", 0.01)))
    laws = {
        "skin": Ogden.with_poisson(0.495, mu=(20e3,), alpha=(5.0,), density=1100.0),
        "fat": NeoHookean(3e3, 0.499, density=950.0),
        "muscle": NeoHookean.from_c10(2e3, poisson=0.49, form="isochoric", density=1060.0),
    }
    body = Body(shape, laws, gravity=(0.0, 0.0, -9.81))
    assert body.mixed_regions == ("skin", "fat", "muscle")
    return body.problem(SphereProbe(SMALL), element=0.01), np.array([0.021, 0.019, 0.02 + SMALL]), None


def dome(_):
    body = Body(Dome(radius=0.05, element=0.03), gel())
    probe = SphereProbe(0.015, over=((-0.02, -0.02), (0.02, 0.02)))
    return body.problem(probe, element=0.013), ASIDE * 0.065, ASIDE


def organ(_):
    shape = Organ(length=0.15, element=0.05)
    body = Body(shape, gel(), fixed="attached")
    problem = body.problem(SphereProbe(0.02, touches="front"), element=0.024)
    patch = surface_of(shape, "front", problem.refinements)
    foot, normal, _ = patch.nearest(patch.corners.mean(axis=(0, 1)) + 0.2 * patch.facing)
    return problem, foot + 0.02 * normal, normal


def tube(_):
    body = Body(Tube(inner_radius=0.01, outer_radius=0.02, height=0.03), gel())
    normal = np.array([0.8, 0.6, 0.0])
    problem = body.problem(SphereProbe(SMALL, touches="outside"), element=0.01)
    return problem, normal * (0.02 + SMALL) + [0, 0, 0.015], normal


def stretched(_):
    end = PrescribedDisplacement("side", "x", (0.0, 0.01), within=((SIZE[0] - 1e-4, -1, -1), (1, 1, 1)))
    body = Body(Block(SIZE), gel(), held=Fixed(end, (0.003,)))
    return body.problem(SphereProbe(SMALL), element=0.01), np.array([0.021, 0.019, 0.02 + SMALL]), None


BODIES = {
    "layered": layered,
    "dome": dome,
    "organ": organ,
    "tube": tube,
    "stretched": stretched,
    "step": lambda folder: imported(folder, "step"),
    "stl": lambda folder: imported(folder, "stl"),
}


SLOW = {"layered", "organ", "tube", "stl"}  # many elements
MARKED = {kind: pytest.param(kind, marks=pytest.mark.full) if kind in SLOW else kind for kind in BODIES}


@pytest.mark.grid
@pytest.mark.parametrize("kind", MARKED.values())
def test_force_energy_and_reactions_belong_together(kind, tmp_path):
    problem, touching, normal = BODIES[kind](tmp_path)
    solver = problem.open()
    inward = -np.array([0.0, 0.0, 1.0]) if normal is None else -normal
    place = touching + 0.002 * inward
    found = solver.solve(place)
    assert found.converged, found.message
    assert np.linalg.norm(found.response) > 1e-3

    # minus the derivative of the energy, in a direction that is nothing special
    way = inward + 0.3 * np.array([0.5, -0.7, 0.4])
    ahead, behind = (solver.solve(place + sign * STEP * way) for sign in (1, -1))
    slope = (ahead.potential_energy - behind.potential_energy) / (2 * STEP)
    assert abs(slope + found.response @ way) < 1e-5 * np.linalg.norm(found.response)

    # what supports and bonds carry is the probe's force and the weight
    model = solver._model
    model.set(place)
    reactions = model.system.gradient(found.state)
    moves = np.array([model.field.interpolate(ngsolve.CF(tuple(e))) for e in np.eye(3)])
    carried = moves @ (reactions + model.system.load)
    error = np.linalg.norm(carried - found.response)
    assert error < 1e-8 * max(np.linalg.norm(found.response), np.linalg.norm(moves @ model.system.load))

    if normal is not None:
        assert found.response @ normal > 0.97 * np.linalg.norm(found.response)
    far = solver.solve(touching - 0.01 * inward)
    assert abs(far.potential_energy) < 1e-9 * found.potential_energy
    assert np.linalg.norm(far.response) < 1e-9 * np.linalg.norm(found.response)


@pytest.mark.full
def test_the_energy_of_a_round_body_does_not_depend_on_the_chain(tmp_path):
    """The zero of U is the body without a probe, not the first place that a chain begins at."""
    problem, touching, normal = dome(tmp_path)
    solver, place = problem.open(), touching - 0.0005 * normal
    found = []
    for before in ((), (touching - 0.001 * normal + [0.002, 0.003, 0.0],)):
        solver.reset()
        for one in before:
            solver.solve(one)
        found.append(solver.solve(place).potential_energy)
        assert solver.solve(touching + 0.01 * normal).potential_energy == 0.0
        # the path begins where the contact has no energy at all
        outside = solver._model.approach(place)
        solver._model.set(outside)
        assert solver._model.system.potential(solver._model.base) == 0.0
    assert found[0] == pytest.approx(found[1], rel=1e-8)


def test_depths_on_a_dome_are_measured_to_the_round_surface():
    """At no depth the tip is on the sphere of 50 mm, where straight triangles are up to 0.4 mm inside."""
    probe = SphereProbe(0.015, depth=(0.0, 1e-9), over=((-0.01, -0.01), (0.01, 0.01)))
    shape = Dome(radius=0.05, element=0.03)
    straight, true = (shape.rest(probe.refinements(shape)), probe.design(shape, 16, 0))
    edge = np.ptp(straight.points[straight.triangles_of("top")], axis=1).max()
    distance = np.linalg.norm(true, axis=1) - 0.065
    # a quarter of an edge has a sixteenth of its sagitta
    assert np.abs(distance).max() < (edge / 4) ** 2 / (8 * 0.05) * 2


@pytest.mark.full
def test_a_viscoelastic_block_recovers_after_the_probe_has_gone():
    law = Viscoelastic(gel(), ((0.5, 1.0),))
    problem = Body(Block(SIZE, element=0.02), law).problem(SphereProbe(SMALL), element=0.01)
    here = np.array([0.021, 0.019, 0.02 + SMALL])
    heights = [-0.002] * 3 + [0.001] * 5
    found = problem.open().march(
        [0.01, 1.0, 3.0, 3.01, 6.0, 20.0, 40.0, 60.0], here + np.outer(heights, [0, 0, 1])
    )
    assert all(one.converged for one in found)
    force = np.array([one.response[2] for one in found])
    assert (np.diff(force[:3]) < 0).all()
    np.testing.assert_allclose(force[3:], 0.0, atol=1e-12)
    dent = np.array([-one.displacement[:, 2].min() for one in found])
    assert dent[3] > dent[4] > dent[5]
    # a step of Δ ≫ τ leaves about γτ/Δ of what recovers in it, here a fortieth at most
    assert dent[7] < 40.0**-3 * dent[4]
    assert all(one.potential_energy > 0 for one in found[:4])


@pytest.mark.full
def test_a_plastic_block_keeps_a_dent():
    law = Plastic(LinearElastic(1e6, 0.35), LinearHardening(1e4, 2e4))
    probe = SphereProbe(SMALL, pad=1e8, stop=0.001)
    problem = Body(Block(SIZE, element=0.02), law).problem(probe, element=0.01)
    here = np.array([0.021, 0.019, 0.02 + SMALL])
    depths = (5e-4, 1e-3, -1e-4)
    found = problem.open().march([1.0, 2.0, 3.0], [here - [0, 0, depth] for depth in depths])
    assert all(one.converged for one in found)
    assert found[2].response == pytest.approx(0.0, abs=1e-9)
    dent = -found[2].displacement[:, 2].min()
    assert 1e-5 < dent < depths[1]  # an elastic block would keep none
    # stresses that stay behind store something, less than the load had
    assert 0 < found[2].potential_energy < 0.5 * found[1].potential_energy


@pytest.mark.full
def test_layers_of_three_kinds_stand_on_each_other():
    """Elastic in mixed form, viscoelastic and plastic: the force relaxes, a dent stays, U is finite throughout."""
    shape = LayeredBlock(
        extent=SIZE[:2], element=0.02, layers=(("skin", 0.004), ("fat", 0.006), ("base", 0.01))
    )
    laws = {
        "skin": Yeoh.with_poisson(0.49, c10=1.5e3, c20=100.0, c30=0.0),
        "fat": Viscoelastic(gel(0.49), ((0.5, 1.0),)),
        "base": Plastic(LinearElastic(9e3, 0.45), LinearHardening(100.0, 1e3)),
    }
    problem = Body(shape, laws).problem(SphereProbe(SMALL), element=0.01)
    here = np.array([0.021, 0.019, 0.02 + SMALL])
    heights = [-0.001, -0.002, -0.002, 0.001, 0.001]
    found = problem.open().march([0.05, 0.1, 5.0, 5.1, 40.0], here + np.outer(heights, [0, 0, 1]))
    assert all(one.converged for one in found), [one.message for one in found]
    force = np.array([one.response[2] for one in found])
    assert force[1] > 1.1 * force[2] > 0
    np.testing.assert_allclose(force[3:], 0.0, atol=1e-12)
    energy = np.array([one.potential_energy for one in found])
    assert (energy > 0).all()
    assert energy[1] > energy[2] > energy[3] > energy[4]
    assert found[4].displacement[:, 2].min() < -1e-5
