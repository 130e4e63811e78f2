"""The mesh's part in a force, stated from a few touches on a mesh that is finer around them alone."""

from __future__ import annotations

import numpy as np
import pytest
from solids import RADIUS, above, pressed

from palpate.physics.interactions import SphereProbe
from palpate.physics.solid.finer_problem import FINER, finer_problem
from palpate.validation.figures.mesh_error import part_of_mesh

PROBE = SphereProbe(radius=RADIUS, depth=(3e-4, 0.006), over=((0.027, 0.027), (0.033, 0.033)))
COARSE = 0.010


def lengths(problem, centre, reach):
    """Lengths of the edges on the touched surface whose middles lie so near under a centre."""
    mesh = problem.mesh
    corners = mesh.points[mesh.triangles_of("top")]
    edges = corners - np.roll(corners, 1, axis=1)
    middles = corners - edges / 2
    near = np.linalg.norm((middles - centre)[..., :2], axis=2) < reach
    return np.linalg.norm(edges, axis=2)[near]


def test_elements_are_half_as_large_around_the_places_alone():
    problem = pressed(probe=SphereProbe(radius=0.005, depth=(3e-4, 0.003)), element=0.006)
    place = np.array([0.020, 0.022, 0.034])
    finer = finer_problem(problem, place[None])
    assert finer.ranges == problem.ranges
    assert finer.hash != problem.hash
    here, there = place, np.array([0.042, 0.042, 0.034])
    usual, small = (np.median(lengths(p, here, 0.004)) for p in (problem, finer))
    assert small == pytest.approx(FINER * usual, rel=0.3)
    usual, same = (np.median(lengths(p, there, 0.004)) for p in (problem, finer))
    assert same == pytest.approx(usual, rel=0.15)


def test_the_rim_around_the_paint_becomes_finer_too():
    """A ball that meets more than what is touched: elements follow the joint surface."""
    probe = SphereProbe(radius=0.005, depth=(3e-4, 0.003), rim="side")
    problem = pressed(probe=probe, element=0.006)
    finer = finer_problem(problem, np.array([[0.020, 0.022, 0.034]]))
    usual = {part.surface for part in problem.refinements}
    (box,) = (part for part in finer.refinements if part not in problem.refinements)
    assert box.surface in usual
    assert box.element == pytest.approx(FINER * min(part.element for part in problem.refinements))


def forces(problem, points):
    solver = problem.open()
    found = [solver.solve(point) for point in points]
    assert all(solution.converged for solution in found)
    return np.array([solution.response for solution in found])


@pytest.mark.full
@pytest.mark.timeout(240)
def test_three_touches_state_the_mesh_s_part_of_others_within_a_factor_of_two():
    """Elsewhere a mesh that is twice as fine everywhere shows it: not at the touches that stated it."""
    problem, fine = (pressed(probe=PROBE, element=size) for size in (COARSE, FINER * COARSE))
    asked = np.array(
        [
            above(d, foot)
            for d, foot in ((1e-3, (0.028, 0.029)), (2.5e-3, (0.031, 0.032)), (5e-3, (0.030, 0.028)))
        ]
    )
    usual, finer = forces(problem, asked), forces(finer_problem(problem, asked), asked)
    stated = part_of_mesh(np.linalg.norm(usual - finer, axis=1) / np.linalg.norm(finer, axis=1))
    others = np.array(
        [above(d, (0.0275 + 2e-4 * i, 0.0325 - 1e-4 * i)) for i, d in enumerate(np.linspace(8e-4, 5.5e-3, 7))]
    )
    usual, finer = forces(problem, others), forces(fine, others)
    off = np.linalg.norm(usual - finer, axis=1) / np.linalg.norm(finer, axis=1)
    assert 0.5 < stated / np.quantile(off, 0.95) < 2.0
