"""Lumps in a pressed body: lookups, slopes and compliance against differences of whole solves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import palpate as pp
from palpate.errors import UsageError
from palpate.physics.shapes.meshing import INSIDE, FineMesh
from palpate.physics.solid.lump_problem import LumpProblem
from palpate.physics.stop import Stop
from palpate.surrogates.lumps.lump import EDGE, MIX, Lump, modulus_factor, share_of_lump

PLACE, RADIUS = (0.021, 0.019, 0.013), 0.005
PRESS = np.array([0.0202, 0.0191, 0.0297])  # no point of the contact's quadrature is just at its edge


def _problem(poisson: float = 0.45) -> LumpProblem:
    block = pp.shapes.Block(size=(0.04, 0.04, 0.025), element=0.012)
    body = pp.Body(block, pp.materials.NeoHookean(young=9e3, poisson=poisson), fixed="bottom")
    ball = pp.SphereProbe(
        radius=0.007, touches="top", depth=(0.0005, 0.004), over=((0.018, 0.018), (0.022, 0.022))
    )
    return LumpProblem(
        body.problem(ball, element=0.008),
        room=((0.016, 0.016, 0.010), (0.024, 0.024, 0.014)),
        radius=(0.004, 0.006),
        element=0.009,
        lookups=6,
        compliances=2,
        solved=1.0,
    )


@pytest.fixture(scope="module", params=[0.45, 0.49], ids=["displacement", "mixed"])
def opened(request):
    solver = _problem(request.param).open()
    return solver, solver.press(PRESS)


def test_a_lump_has_the_volume_of_its_sharp_ball():
    d = np.linspace(0.0, EDGE, 200_001)
    volume = np.trapezoid(4 * np.pi * d**2 * share_of_lump(d), d)
    assert volume == pytest.approx(4 / 3 * np.pi, rel=1e-7)
    assert share_of_lump(np.array([0.0, 0.6, EDGE, 2.0])).tolist() == pytest.approx([1, 1, 0, 0], abs=1e-12)


def test_the_factor_is_that_of_the_tissue_and_of_the_lump_at_its_ends():
    assert modulus_factor(0.0, 7.0) == 1.0
    assert modulus_factor(1.0, 7.0) == 7.0
    step = 1e-4
    first, second = (modulus_factor(0.3, 1 + h) for h in (step, -step))
    assert (first - second) / (2 * step) == pytest.approx(0.3, rel=1e-6)
    assert (first + second - 2) / step**2 == pytest.approx(-2 * MIX * 0.3 * 0.7, rel=1e-4)


def test_the_energy_looked_up_is_the_slope_of_solves_by_the_ratio(opened):
    solver, free = opened
    D, _ = solver.energies(free, np.array([PLACE]), np.array([RADIUS]))
    h = 0.02
    more, less = (solver.press_with(free, Lump(PLACE, RADIUS, 1 + x)).added for x in (h, -h))
    beta = solver.compliance(free, np.array(PLACE), RADIUS)
    third = (more - less) / (2 * h) / D[0]
    assert third == pytest.approx(1.0, abs=2 * (beta * h) ** 2)
    assert -(more + less) / (2 * h**2) / D[0] == pytest.approx(beta, rel=2e-3)


def test_slopes_of_a_lookup_are_differences_of_presses(opened):
    solver, free = opened
    places, radii = np.array([PLACE, (0.018, 0.022, 0.012)]), np.array([RADIUS, 0.004])
    _, slopes = solver.energies(free, places, radii)
    step = 1e-5
    for i in range(3):
        moved = np.eye(3)[i] * step
        ends = [solver.energies(solver.press(PRESS + s * moved), places, radii)[0] for s in (1, -1)]
        assert (ends[0] - ends[1]) / (2 * step) == pytest.approx(
            slopes[:, i], rel=2e-4, abs=2e-6 * np.abs(slopes).max()
        )


def test_slopes_of_a_lumped_press_are_differences_of_solves(opened):
    solver, free = opened
    numbers = np.array([*PLACE, RADIUS, 4.0])
    press = solver.press_with(free, Lump(tuple(numbers[:3]), numbers[3], numbers[4]))
    assert press.stop is Stop.CONVERGED
    for i, step in enumerate((2e-5, 2e-5, 2e-5, 2e-5, 0.02)):
        ends = []
        for many in (-2, -1, 1, 2):
            moved = numbers.copy()
            moved[i] += many * step
            ends.append(solver.press_with(free, Lump(tuple(moved[:3]), moved[3], moved[4])).added)
        difference = (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * step)
        assert press.slopes[i] == pytest.approx(
            difference, rel=1e-5, abs=1e-5 * np.abs(press.slopes[: 4 if i < 4 else 5]).max()
        )


def test_a_family_of_lumps_has_the_energy_and_slopes_of_a_lumped_press():
    problem = _problem()
    law = pp.materials.Lumped.of(problem.base.body.materials["body"], Lump(PLACE, RADIUS, 4.0))
    varied = (pp.Varied("body.x", -0.01, 0.03), pp.Varied("body.ratio", 1.0, 8.0))
    # about an origin on the lump, where a step relative to the place would be none
    family = pp.BodyFamily(replace(problem.base.body, material=law), varied)
    member = replace(family.problem(*problem.base.interactions), base=replace(problem.base, body=family.body))
    answer = member.solve([*PRESS, PLACE[0], 4.0])
    solver = problem.open()
    press = solver.press_with(solver.press(PRESS), Lump(PLACE, RADIUS, 4.0))
    assert answer.potential_energy == pytest.approx(
        solver.press(PRESS).potential_energy + press.added, rel=1e-9
    )
    assert -answer.response[3:] == pytest.approx(press.slopes[[0, 4]], rel=1e-5)


def test_a_step_of_a_place_is_measured_by_the_radius():
    law = pp.materials.Lumped.of(
        pp.materials.NeoHookean(young=9e3, poisson=0.45), Lump((0.0, 0.0, 0.0), 0.005, 2.0)
    )
    body = pp.Body(pp.shapes.Dome(radius=0.05), law)
    assert pp.Varied("x", -0.01, 0.01).scale(body, 0.0) == 0.005
    assert pp.Varied("ratio", 1.0, 4.0).scale(body, 2.0) == 2.0


def test_an_answer_depends_on_the_press_alone(opened):
    solver, _ = opened
    first = solver.solve(PRESS)
    solver.solve(PRESS + 3e-4)
    again = solver.solve(PRESS)
    assert np.array_equal(first.lump_place, again.lump_place)
    assert first.lump_added == pytest.approx(again.lump_added, rel=1e-6)
    assert (first.lump_energy > 0).all()
    assert (first.lump_compliance > 0).all()
    assert first.lump_added > 0


def test_a_fine_box_inside_a_body_has_small_elements_and_leaves_the_rest():
    block = pp.shapes.Block(size=(0.04, 0.04, 0.04), element=0.012)
    box = FineMesh(INSIDE, 0.003, (0.014, 0.014, 0.014), (0.026, 0.026, 0.026))
    coarse, fine = block.rest(), block.rest((box,))

    def sizes(mesh, near):
        corners = mesh.points[mesh.tetrahedra]
        middles = corners.mean(axis=1)
        inside = (np.abs(middles - 0.02) < 0.006).all(axis=1)
        chosen = corners[inside] if near else corners[(np.abs(middles - 0.02) > 0.015).any(axis=1)]
        return np.cbrt(6 * np.sqrt(2) * np.abs(np.linalg.det(chosen[:, 1:] - chosen[:, :1])) / 6)

    assert np.median(sizes(fine, near=True)) < 0.0036
    assert np.median(sizes(fine, near=False)) > 0.5 * np.median(sizes(coarse, near=False))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"room": ((0.0, 0.0, 0.0), (0.0, 0.01, 0.01))}, "no room for lumps"),
        ({"solved": 2.0}, "share of presses"),
        ({"radius": (0.005, 0.002)}, "radius"),
        ({"compliances": 9}, "compliances"),
    ],
)
def test_what_makes_no_sense_is_refused(change, words):
    with pytest.raises(UsageError, match=words):
        replace(_problem(), **change)


def test_a_lump_that_leaves_the_body_is_refused(opened):
    solver, free = opened
    with pytest.raises(UsageError, match="leaves the skin"):
        solver.press_with(free, Lump((0.02, 0.02, 0.024), 0.005, 3.0))


def test_a_box_inside_needs_corners_and_a_law_with_a_history_takes_no_lump():
    with pytest.raises(UsageError, match="no box"):
        FineMesh(INSIDE, 0.003)
    viscous = pp.materials.Viscoelastic(
        pp.materials.NeoHookean(young=9e3, poisson=0.45), pp.materials.PronySeries(((0.3, 1.0),))
    )
    with pytest.raises(UsageError, match="can't have a lump"):
        pp.materials.Lumped.of(viscous, Lump(PLACE, RADIUS, 2.0))
