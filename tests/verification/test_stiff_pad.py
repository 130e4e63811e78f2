"""A rigid ball and a rigid tilted punch beside hard contact in solvers that share no code."""

from __future__ import annotations

import math

import axisymmetric_ball
import calculix
import calculix_ball
import calculix_punch
import numpy as np
import pytest

from palpate import tools
from palpate.errors import UsageError
from palpate.physics.interactions import SphereProbe, SurfaceTool
from palpate.physics.interactions.rigid_limit import rigid_pad
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block, Cylinder
from palpate.physics.solid import Body

YOUNG, POISSON, RADIUS, SIZE = 9e3, 0.45, 0.010, 0.030
DEPTHS = (0.001, 0.003)


@pytest.mark.full
@pytest.mark.timeout(240)
def test_a_rigid_ball_feels_the_force_of_an_axisymmetric_solve() -> None:
    """Within 1 % from a sixth of the largest depth on."""
    gel = NeoHookean(YOUNG, POISSON)
    probe = SphereProbe(RADIUS, pad="rigid", depth=(3e-4, 0.006), over=((-1e-3, -1e-3), (1e-3, 1e-3)))
    solver = Body(Cylinder(SIZE, SIZE), gel, fixed="bottom").problem(probe).open()
    found = [solver.solve((0.0, 0.0, SIZE + RADIUS - depth)) for depth in DEPTHS]
    assert all(solution.converged for solution in found)
    wanted = axisymmetric_ball.forces(YOUNG, POISSON, RADIUS, SIZE, SIZE, list(DEPTHS))
    np.testing.assert_allclose([solution.response[2] for solution in found], wanted, rtol=0.01)


@pytest.mark.full
@pytest.mark.timeout(400)
def test_a_rigid_ball_feels_the_force_of_hard_contact_in_calculix(ccx, tmp_path) -> None:
    """On the README's block, within 2 %; the law is the one of two terms that CalculiX has too."""
    gel = NeoHookean(YOUNG, POISSON, form="isochoric")
    probe = SphereProbe(RADIUS, pad="rigid", depth=(0.0, 0.006), over=((0.049, 0.049), (0.051, 0.051)))
    solver = Body(Block((0.10, 0.10, 0.05)), gel, fixed="bottom").problem(probe).open()
    depth = DEPTHS[-1]  # at less CalculiX asks for finer elements, and minutes
    found = solver.solve((0.05, 0.05, 0.05 + RADIUS - depth))
    text = calculix_ball.deck(calculix.neo_hookean(gel), YOUNG, (0.10, 0.05), RADIUS, [depth], fine=0.003)
    wanted = calculix_ball.forces(calculix.kept_output(ccx, tmp_path, text))
    np.testing.assert_allclose(found.response[2], wanted, rtol=0.02)


@pytest.mark.full
@pytest.mark.timeout(600)
def test_a_tilted_punch_feels_the_force_and_torque_of_hard_contact_in_calculix(ccx, tmp_path) -> None:
    """The torque about the middle of the face, too, although its arm is a seventh of the punch's radius."""
    gel = NeoHookean(YOUNG, POISSON, form="isochoric")
    punch = calculix_punch.Tilted(radius=0.006, edge=0.0015, angle=math.radians(4), depth=0.0015)
    size, middle = (0.036, 0.036, 0.015), 0.018
    tool = SurfaceTool(
        tools.Punch(punch.radius, punch.edge),
        rotation=(0.0, punch.angle, 0.0),
        pad="rigid",
        depth=(0.0, 0.002),
        over=((0.0175, 0.0175), (0.0185, 0.0185)),
        element=0.0015,
    )
    solver = Body(Block(size), gel, fixed="bottom").problem(tool).open()
    found = solver.solve((middle, middle, size[2] - punch.depth + punch.height))
    text = calculix_punch.deck(calculix.neo_hookean(gel), YOUNG, size, punch, fine=0.0015)
    force, torque = calculix_punch.answer(calculix.kept_output(ccx, tmp_path, text), punch)
    np.testing.assert_allclose(found.force, force, atol=0.02 * np.linalg.norm(force))
    np.testing.assert_allclose(found.torque, torque, atol=0.02 * np.linalg.norm(torque))


def test_the_pad_of_a_rigid_ball_follows_from_the_body() -> None:
    """By the pressure of Hertz it yields 0.6 % of half the largest depth; it is in series, so it goes with E*."""
    probe = SphereProbe(RADIUS, pad="rigid", depth=(0.0, 0.008))
    gel = NeoHookean(YOUNG, POISSON)
    pad = rigid_pad(probe, {"body": gel})
    modulus, contact = YOUNG / (1 - POISSON**2), np.sqrt(RADIUS * 0.004)
    pressure = 4 / (3 * np.pi) * modulus * contact / RADIUS
    assert pressure / pad / 0.004 == pytest.approx(0.0057, rel=0.02)
    assert rigid_pad(probe, {"body": NeoHookean(2 * YOUNG, POISSON)}) == pytest.approx(2 * pad, rel=0.01)
    problem = Body(Block((0.06, 0.06, 0.03)), gel).problem(probe)
    assert problem.describe()["interactions"][0]["stiffness"] == pad
    assert "rigid sphere" in str(probe)
    with pytest.raises(UsageError, match="pad"):
        SphereProbe(RADIUS, pad="stiff")
