"""Springs beside finite elements on one mesh: they speak of one body. How far apart they are is no law."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.massspring import MassSpringBody
from palpate.physics.interactions import SphereProbe
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block
from palpate.physics.solid import Body


@pytest.mark.full
def test_force_of_springs_beside_finite_elements():
    tissue = NeoHookean(young=9e3, poisson=0.45)
    body = Body(Block((0.06, 0.06, 0.03)), tissue, fixed="bottom")
    probe = SphereProbe(radius=0.010, over=((0.029, 0.029), (0.031, 0.031)))
    solver = body.problem(probe).open()
    at = (0.03, 0.03, 0.037)  # 3 mm deep
    wanted = solver.solve(at)
    assert wanted.converged
    ratio = {}
    for volume in (True, False):
        rival = MassSpringBody(wanted.mesh, tissue, volume=volume).open(probe).solve(at, gradient=True)
        assert rival.converged
        ratio[volume] = float(rival.response[2] / wanted.response[2])
        apart = np.linalg.norm(rival.displacement - wanted.displacement, axis=1).max()
        assert apart < 0.3 * np.abs(wanted.displacement).max()
    # without volumes springs behave like ν = 1/4, and a layer of ν = 0.45 on a base is stiffer than that
    assert ratio[False] < ratio[True]
    assert 0.7 < ratio[True] < 1.4
