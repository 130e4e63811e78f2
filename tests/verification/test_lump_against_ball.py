"""A lump as a field against a sharp ball on a mesh that follows it, with and without the ball's modulus."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

import palpate as pp
from palpate.physics.shapes.block import name_upright_faces
from palpate.physics.shapes.naming import INTERFACE
from palpate.physics.shapes.shape import Solid
from palpate.physics.solid.lump_problem import LumpProblem

SIZE, PROBE, ELEMENT, UNDER = (0.04, 0.04, 0.03), 0.008, 0.010, 0.006
LUMP = pp.Lump((0.02, 0.02, 0.017), 0.006, 5.0)
PRESS = (0.021, 0.0195, 0.03 + PROBE - 0.004)


@dataclass(frozen=True)
class Nodule(Solid):
    """A block with a sharp ball in it as a region of its own, whose elements are curved."""

    curved: ClassVar[bool] = True
    surfaces: ClassVar[tuple[str, ...]] = ("top", "bottom", "side")
    regions: ClassVar[tuple[str, ...]] = ("body", "lump")
    size: ClassVar[tuple[float, float, float]] = SIZE

    inside: float = 0.0022  # largest element in the ball, m
    element: float = ELEMENT

    def solid(self):
        from netgen.occ import Box, Glue, Pnt, Sphere

        box = Box(Pnt(0, 0, 0), Pnt(*SIZE))
        name_upright_faces(box, SIZE[2])
        ball = Sphere(Pnt(*LUMP.place), LUMP.radius)
        ball.faces.name = INTERFACE
        ball.mat("lump")
        ball.solids.maxh = self.inside
        rest = box - ball
        rest.mat("body")
        return Glue([rest, ball])


def _press(geometry, material):
    probe = pp.SphereProbe(
        radius=PROBE, touches="top", depth=(0.0005, 0.005), over=((0.018, 0.018), (0.022, 0.022))
    )
    return pp.Body(geometry, material, fixed="bottom").problem(probe, element=UNDER)


def _of_ball(inside: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the force (3,) without the ball's modulus and what it adds, on one mesh."""
    soft = pp.materials.NeoHookean(young=9e3, poisson=0.45)
    laws = {"body": soft, "lump": replace(soft, young=LUMP.ratio * soft.young)}
    plain, hard = (_press(Nodule(inside), law).solve(PRESS) for law in (dict.fromkeys(laws, soft), laws))
    return plain.response, hard.response - plain.response


@pytest.mark.full
def test_a_lump_changes_the_force_as_a_sharp_ball_does():
    rough, fine = _of_ball(0.0022)[1], _of_ball(0.0018)
    assert np.linalg.norm(rough - fine[1]) < 0.03 * np.linalg.norm(fine[1])
    block = pp.shapes.Block(size=SIZE, element=ELEMENT)
    problem = LumpProblem(
        _press(block, pp.materials.NeoHookean(young=9e3, poisson=0.45)),
        room=((0.018, 0.018, 0.015), (0.022, 0.022, 0.018)),
        radius=(0.006, 0.007),
        lookups=1,
        compliances=1,
    )
    solver = problem.open()
    free = solver.press(PRESS)
    change = solver.press_with(free, LUMP).force
    force = np.linalg.norm(fine[0])
    assert np.linalg.norm(change) > 0.01 * force
    assert np.linalg.norm(change - fine[1]) < 0.10 * np.linalg.norm(fine[1])
    assert np.linalg.norm(free.response + change - fine[0] - fine[1]) < 0.01 * force
