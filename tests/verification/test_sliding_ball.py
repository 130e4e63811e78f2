"""A ball that is pressed and slid: friction on the energy without it, beside CalculiX with friction."""

from __future__ import annotations

import math

import calculix
import calculix_slide
import numpy as np
import pytest

from palpate import tools
from palpate.physics.interactions import GluedPad, SurfaceTool
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block
from palpate.physics.solid import Body
from palpate.surrogates.memories import Friction

YOUNG, RADIUS, SIZE, DEPTH, MU = 9e3, 0.010, 0.040, 0.002, 0.3
HEIGHT, MIDDLE = 0.020, 0.020
SLIDES = (0.0002, 0.0004, 0.0006, 0.0008)  # m, to 90 % of full slip


def sideways_ratio(body: Body) -> float:
    """Return sideways over normal stiffness of what sticks: a pad as wide as the contact, moved a little."""
    pad = GluedPad(
        radius=math.sqrt(RADIUS * DEPTH), at=(MIDDLE, MIDDLE, HEIGHT), pad=3e7, element=0.0015,
        displacement=((-5e-4, 5e-4),) * 3,
    )  # fmt: skip
    solver = body.problem(pad).open()
    down, aside = (solver.solve(move).force for move in ((0.0, 0.0, -2e-4), (2e-4, 0.0, 0.0)))
    return abs(float(aside[0] / down[2]))


@pytest.mark.full
@pytest.mark.timeout(600)
def test_a_ball_that_slides_feels_the_force_of_calculix(ccx, tmp_path) -> None:
    """Within 3 % of the whole force; ρ is that of one solve, and nothing is taken from CalculiX."""
    gel = NeoHookean(YOUNG, 0.45, form="isochoric")
    body = Body(Block((SIZE, SIZE, HEIGHT)), gel, fixed="bottom")
    over = ((0.0195, 0.0195), (0.0215, 0.0205))
    solver = body.problem(
        SurfaceTool(tools.Sphere(RADIUS), pad="rigid", depth=(0.0, 0.0025), over=over)
    ).open()
    pressed = solver.solve((MIDDLE, MIDDLE, HEIGHT - DEPTH))
    energy, normal = pressed.potential_energy, pressed.force[2]
    q = math.sqrt(2 * energy)
    slope = np.array([0.0, 0.0, -normal / q])
    exponent = normal * DEPTH / energy - 1  # of F over the depth
    state = Friction.over(1.2 * DEPTH, MU, exponent=exponent, ratio=sideways_ratio(body)).start()
    felt = []
    for slide in (0.0, *SLIDES):
        assert state.step(np.array([slide, 0.0, 0.0]), q, slope, 0.0)
        felt.append(state.force.copy())
    text = calculix_slide.deck(
        calculix.neo_hookean(gel), YOUNG, (SIZE, HEIGHT), RADIUS, DEPTH, SLIDES, MU, fine=0.0016
    )
    wanted = calculix_slide.forces(calculix.kept_output(ccx, tmp_path, text))
    np.testing.assert_allclose(felt, wanted, atol=0.03 * np.linalg.norm(wanted[-1]))
