"""Two balls that pinch a block beside hard contact in CalculiX, which shares no code."""

from __future__ import annotations

import calculix
import calculix_pinch
import numpy as np
import pytest

from palpate import tools
from palpate.physics import Body, Pinch
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block

HEIGHT, WIDTH, THICK, RADIUS, DEPTH = 0.024, 0.030, 0.030, 0.008, 0.002  # m


@pytest.mark.full
@pytest.mark.timeout(600)
def test_a_pinch_feels_the_forces_of_hard_contact_in_calculix(ccx, tmp_path) -> None:
    """Effort and the force away from the fixed end, within 3 % of the force on a jaw."""
    gel = NeoHookean(9e3, 0.45, form="isochoric")
    pinch = Pinch(
        tools.Sphere(RADIUS),
        touches="x_min + x_max",
        pad=1e8,
        depth=(0.0, 0.003),
        over=((0.0145, 0.0115), (0.0155, 0.0125)),
        element=0.003,
    )
    solver = Body(Block((THICK, WIDTH, HEIGHT)), gel).problem(pinch).open()
    solution = solver.solve((THICK / 2, WIDTH / 2, HEIGHT / 2, THICK - 2 * DEPTH))
    size = (HEIGHT, WIDTH, THICK)
    text = calculix_pinch.deck(calculix.neo_hookean(gel), 9e3, size, RADIUS, DEPTH, fine=0.0025)
    effort, up = calculix_pinch.answer(calculix.kept_output(ccx, tmp_path, text))
    np.testing.assert_allclose(solution.response[[3, 2]], [effort, up], atol=0.03 * effort)
