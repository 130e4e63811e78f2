"""The same bodies in an independent program: CalculiX with the same mesh, law and constraints.

Both have straight-sided tetrahedra of second order. With CalculiX's quadrature of four points their discrete equations
are the same, and what is left is round-off, the seven digits that CalculiX prints and the end of its iteration. At
large strain palpate takes more points, so as to see where an element turns over; that shows in the third digit.
"""

from __future__ import annotations

import math

import calculix
import numpy as np
import pytest

from palpate.physics.interactions import PrescribedDisplacement
from palpate.physics.materials import LinearElastic, LinearHardening, NeoHookean, Plastic
from palpate.physics.shapes import Block
from palpate.physics.solid import Body, solid_energy

PRINTED = 2e-6  # some units in the seventh digit, which sums and differences of forces may lose
SIZE = (0.06, 0.05, 0.03)
PATCH = ((0.02, 0.015, 0.03), (0.04, 0.035, 0.03))
PUSH = PrescribedDisplacement("top", ("x", "z"), ((-0.01, 0.01), (-0.01, 0.01)), within=PATCH, element=0.005)


def inside(mesh, box):
    """Triangles of the top that lie in a box."""
    triangles = mesh.triangles_of("top")
    corners = mesh.points[triangles]
    low, high = np.array(box[0]) - 1e-7, np.array(box[1]) + 1e-7
    return triangles[((corners >= low) & (corners <= high)).all(axis=(1, 2))]


def assert_same(solution, answer, moved, fixed, within=PRINTED):
    """Displacements of all vertices, and the resistance against the largest force."""
    scale = np.abs(answer.displacement).max()
    vertices = answer.displacement[: len(solution.mesh.points)]
    np.testing.assert_allclose(solution.displacement, vertices, atol=within * scale)
    np.testing.assert_allclose(
        -solution.response, moved @ answer.force, atol=within * np.abs(answer.force).max()
    )
    assert not answer.displacement[fixed].any()


@pytest.mark.full
@pytest.mark.parametrize(
    ("law", "write", "push", "strain"),
    [
        pytest.param(LinearElastic(9e3, 0.4), calculix.linear, (0.0004, -0.001), 0.05, id="linear"),
        pytest.param(
            NeoHookean(9e3, 0.45, form="isochoric"),
            calculix.neo_hookean,
            (0.002, -0.006),
            0.5,
            id="neo-Hookean",
        ),
    ],
)
@pytest.mark.parametrize(
    ("points", "within"), [pytest.param(4, PRINTED, id="its points"), pytest.param(None, 0.01, id="ours")]
)
def test_a_pushed_patch_resists_as_in_calculix(
    ccx, tmp_path, monkeypatch, law, write, push, strain, points, within
):
    """A patch of 20 × 20 mm of the top is pushed down by a fifth of the height and aside; the bottom is fixed."""
    if points == 4:
        monkeypatch.setattr(solid_energy, "_rule_order", lambda *_: 2)
    problem = Body(Block(SIZE, element=0.012), law, formulation="displacement").problem(PUSH)
    solution, mesh = problem.solve(push), problem.mesh
    assert solution.converged, solution.message
    assert solution.largest_strain > strain
    fixed = calculix.nodes_of(mesh, mesh.triangles_of("bottom"))
    moved = calculix.nodes_of(mesh, inside(mesh, PATCH))
    step = calculix.Step((push[0], 0.0, push[1]))
    text = calculix.deck(mesh, write(law), fixed, moved, [step], large=law.kinematics == "large")
    [answer] = calculix.run(ccx, tmp_path, text)
    assert_same(solution, answer, np.eye(3)[[0, 2]], fixed, within)


@pytest.mark.full
def test_a_bar_beyond_yield_resists_as_in_calculix(ccx, tmp_path):
    """Between two bonded ends, stretched by one per cent in four steps and let back by half: it yields both ways."""
    law = Plastic(LinearElastic(110e9, 0.35), LinearHardening(125e6, 2e9))
    pull = PrescribedDisplacement("top", "z", (-0.001, 0.001))
    block = Block((0.03, 0.02, 0.04), element=0.01)
    problem = Body(block, law, formulation="displacement", step_error=math.inf).problem(pull)
    peak, back = 0.0004, 0.0002
    found = problem.open().march(range(1, 6), np.array([*np.arange(1, 5) * peak / 4, back])[:, None])
    assert [len(one.log) for one in found] == [1] * 5  # one increment each, as in the deck
    elastic = law.young * 0.03 * 0.02 * peak / 0.04
    assert abs(found[3].response.item()) < 0.2 * elastic
    mesh = problem.mesh
    fixed, moved = (calculix.nodes_of(mesh, mesh.triangles_of(name)) for name in ("bottom", "top"))
    steps = [calculix.Step((0.0, 0.0, peak), 4), calculix.Step((0.0, 0.0, back))]
    text = calculix.deck(mesh, calculix.plastic(law, (0.0, 1.0)), fixed, moved, steps, large=False)
    for solution, answer in zip(found[3:], calculix.run(ccx, tmp_path, text), strict=True):
        assert_same(solution, answer, np.eye(3)[[2]], fixed)
