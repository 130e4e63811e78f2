"""A lump as a field against a sharp ball on a mesh that follows it, with and without the ball's modulus."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import calculix
import numpy as np
import pytest

import palpate as pp
from palpate.physics.interactions import PrescribedDisplacement
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


@pytest.mark.full
@pytest.mark.timeout(400)
def test_a_lump_changes_the_force_on_a_patch_as_a_ball_of_other_elements_in_calculix(ccx, tmp_path):
    """The patch goes down by a tenth of the height; in CalculiX the ball is elements of five times the modulus.

    Its straight-sided elements have a little less than the ball's volume: the field has the radius of that volume.
    """
    soft = pp.materials.NeoHookean(young=9e3, poisson=0.45, form="isochoric")
    patch = ((0.014, 0.014, SIZE[2]), (0.026, 0.026, SIZE[2]))
    push = PrescribedDisplacement(
        "top", ("x", "z"), ((-0.01, 0.01), (-0.01, 0.01)), within=patch, element=0.004
    )
    mesh = pp.Body(Nodule(), dict.fromkeys(Nodule.regions, soft), fixed="bottom").problem(push).mesh
    triangles = mesh.triangles_of("top")
    low, high = np.array(patch[0]) - 1e-7, np.array(patch[1]) + 1e-7
    corners = mesh.points[triangles]
    moved = calculix.nodes_of(mesh, triangles[((corners >= low) & (corners <= high)).all(axis=(1, 2))])
    fixed, step = calculix.nodes_of(mesh, mesh.triangles_of("bottom")), calculix.Step((0.0, 0.0, -0.003))
    ball = np.flatnonzero(mesh.region_of == mesh.regions.index("lump"))
    stiff = replace(soft, young=LUMP.ratio * soft.young)
    free, hard = (
        calculix.run(
            ccx,
            tmp_path,
            calculix.deck(
                mesh,
                calculix.neo_hookean(soft),
                fixed,
                moved,
                [step],
                large=True,
                other=(ball, calculix.neo_hookean(law)),
            ),
        )[0].force[2]
        for law in (soft, stiff)
    )
    edges = np.diff(mesh.points[mesh.tetrahedra[ball]], axis=1)
    radius = float(np.cbrt(np.abs(np.linalg.det(edges)).sum() / 6 * 3 / (4 * np.pi)))
    assert 0.97 * LUMP.radius < radius < LUMP.radius
    around = pp.physics.FineMesh("inside", 0.0036, (0.011, 0.011, 0.008), (0.029, 0.029, 0.026))
    block = pp.shapes.Block(size=SIZE, element=ELEMENT)
    laws = (soft, pp.materials.Lumped.of(soft, replace(LUMP, radius=radius)))
    problems = [pp.Body(block, law, fixed="bottom").problem(push) for law in laws]
    plain, lumped = (
        -replace(problem, fine=(*problem.refinements, around)).solve((0.0, -0.003)).response[1]
        for problem in problems
    )
    assert abs(hard - free) > 0.01 * abs(free)
    assert lumped - plain == pytest.approx(hard - free, rel=0.10)
    assert lumped == pytest.approx(hard, rel=0.015)
