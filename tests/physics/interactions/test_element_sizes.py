"""Elements are as small under a probe as the body there asks for, unless the problem says otherwise."""

from __future__ import annotations

from dataclasses import replace

import pytest

from palpate.physics.interactions import SphereProbe
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block, Dome, LayeredBlock
from palpate.physics.solid import Body

GEL = NeoHookean(young=9e3, poisson=0.4)
RADIUS = 0.008


@pytest.mark.grid
@pytest.mark.parametrize(
    ("shape", "share"),
    [
        (Block((0.06, 0.06, 0.03)), 0.5),
        (Dome(0.06, 0.045), 0.4),
        (LayeredBlock((0.06, 0.06), (("skin", 0.003), ("fat", 0.012))), 0.25),
        (Dome(0.06, 0.045, layer=0.003), 0.25),
    ],
    ids=["one material", "round", "layers", "round with a skin"],
)
def test_a_share_of_the_radius(shape, share):
    body = Body(shape, dict.fromkeys(shape.regions, GEL))
    problem = body.problem(SphereProbe(radius=RADIUS, touches="top", depth=(0.0, 0.004)))
    assert [fine.element for fine in problem.refinements] == [pytest.approx(share * RADIUS)]
    assert [fine.element for fine in replace(problem, element=0.003).refinements] == [0.003]
