"""A body in tension before anything touches it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.physics.interactions import Fixed, PrescribedDisplacement, SphereProbe, roller
from palpate.physics.materials import NeoHookean, PreStretched
from palpate.physics.materials.tensors import gradient
from palpate.physics.shapes import Block
from palpate.physics.solid import Body, BodyFamily, Varied
from palpate.physics.solid.body_symmetry import symmetry_of

SIDE, HEIGHT, RADIUS = 0.06, 0.03, 0.01
HELD = ("bottom", "side")
GEL = NeoHookean(9e3, 0.3)


def body(stretch_x, stretch_y=None, fixed=HELD):
    return Body(
        Block((SIDE, SIDE, HEIGHT), element=0.02), PreStretched(GEL, stretch_x, stretch_y), fixed=fixed
    )


def probe(**options):
    return SphereProbe(RADIUS, over=((0.028, 0.028), (0.032, 0.032)), depth=(0.0005, 0.004), **options)


def compliance(material):
    """Normal displacement of a half-space's surface under a unit traction wave of unit wave number (Stroh 1962).

    u = v exp(ikx + skz) with [s² T + i s (R + Rᵀ) − Q] v = 0; two roots decay into the body. T, R, Q are parts of the
    law's second derivatives, so this knows nothing of finite elements.
    """
    h, eye, A = 1e-5, np.eye(3), np.empty((3, 3, 3, 3))
    for q in range(3):
        for k in range(3):
            E = np.zeros((1, 3, 3))
            E[0, k, q] = h
            slope = gradient(material.energy, eye + E) - gradient(material.energy, eye - E)
            A[:, :, q, k] = slope[0].T / (2 * h)  # ∂P_jp/∂F_kq as [p, j, q, k]

    def part(p, q):
        return A[p, :, q][np.ix_([0, 2], [0, 2])]

    Q, R, T = part(0, 0), part(0, 2), part(2, 2)
    half = np.linalg.solve(T, np.hstack([Q, -1j * (R + R.T)]))
    roots, V = np.linalg.eig(np.block([[np.zeros((2, 2)), np.eye(2)], [half]]))
    down = roots.real > 0
    s, v = roots[down], V[:2, down]
    traction = np.stack([(1j * part(2, 0) + one * T) @ w for one, w in zip(s, v.T, strict=True)], axis=1)
    return float(np.linalg.inv(traction @ np.linalg.inv(v))[1, 1].real)


def test_a_stretched_half_space_gives_way_as_theory_says():
    """Of the nearly incompressible neo-Hookean law, Green, Rivlin & Shield (1952): λ = 1 gives 2 μ."""
    stretch = 1.25
    law = NeoHookean(9e3, 0.4999)
    t = stretch**3
    grown = (t**3 + t**2 + 3 * t - 1) / (stretch**4 * (t + 1)) / 2
    found = compliance(PreStretched(law, 1.000001)) / compliance(PreStretched(law, stretch))
    assert found == pytest.approx(grown, rel=2e-3)  # ν is not quite 1/2
    # at rest E/(2(1 - ν²))
    assert 1 / compliance(PreStretched(GEL, 1.000001)) == pytest.approx(9e3 / (1 - 0.3**2) / 2, rel=1e-4)


def drawn_out(stretch, thinning, planes):
    """A smaller and thicker block whose sides are moved until it has the size of the others, on a smooth ground."""
    side, height = SIDE / stretch, HEIGHT / thinning
    moved = tuple(
        Fixed(PrescribedDisplacement(face, axis, (-SIDE, SIDE), sliding=True), (SIDE - side,))
        for face, axis in (("x_max", "x"), ("y_max", "y"))
    )
    return Body(Block((side, side, height)), GEL, fixed=(), held=(*planes, *moved))


@pytest.mark.full
def test_a_ball_feels_the_same_as_on_a_body_that_was_really_stretched():
    """What stretching by 1.3 takes from the force is found to a tenth, which is what the two meshes differ by."""
    stretch, planes = 1.3, (roller("x_min", "x"), roller("y_min", "y"), roller("bottom", "z"))
    law = PreStretched(GEL, stretch)
    walls = (roller("x_max", "x"), roller("y_max", "y"))
    tense = Body(Block((SIDE, SIDE, HEIGHT), element=0.02), law, fixed=(), held=(*planes, *walls))
    real = drawn_out(stretch, law.stretches[2], planes)
    middle = SIDE / stretch / 2
    # the pad's stiffness counts by area of the undeformed surface
    smaller = SphereProbe(
        RADIUS,
        pad=stretch**2 * probe().pad,
        over=((middle - 0.003, middle - 0.003), (middle + 0.003, middle + 0.003)),
        depth=(0.0005, 0.004),
    )
    where = (0.03, 0.03, HEIGHT + RADIUS - 0.004)
    found = tense.problem(probe(), element=0.006).solve(where)
    truth = real.problem(smaller, element=0.006 / stretch).solve(where)
    plain = dataclasses.replace(tense, material=GEL).problem(probe(), element=0.006).solve(where)
    softer = plain.response[2] - truth.response[2]
    assert softer > 0.1 * plain.response[2]
    assert abs(found.response[2] - truth.response[2]) < 0.1 * softer
    assert found.potential_energy == pytest.approx(truth.potential_energy, rel=0.02)


@pytest.mark.full
def test_a_stretch_of_one_is_none():
    where = (0.031, 0.03, HEIGHT + RADIUS - 0.003)
    plain = (
        Body(Block((SIDE, SIDE, HEIGHT), element=0.02), GEL, fixed=HELD)
        .problem(probe(), element=0.012)
        .solve(where)
    )
    found = body(1.0).problem(probe(), element=0.012).solve(where)
    np.testing.assert_allclose(found.response, plain.response, rtol=1e-6, atol=1e-9)
    assert found.potential_energy == pytest.approx(plain.potential_energy, rel=1e-8)


def test_tension_must_be_held():
    with pytest.raises(UsageError, match="not in balance") as refused:
        body(1.1, fixed="bottom").problem(probe(), element=0.012).open()
    assert 'fixed=("bottom", "side")' in str(refused.value)


@pytest.mark.full
def test_a_stretch_can_vary_and_its_slope_is_that_of_the_energy():
    family = BodyFamily(body(1.1), Varied("stretch_x", 1.0, 1.3))
    solver = family.problem(probe(), element=0.012).open()
    x = np.array([0.031, 0.03, HEIGHT + RADIUS - 0.003, 1.15])
    slope = -solver.solve(x).response[3]
    ends = []
    for sign in (-1, 1):
        solver.reset()
        ends.append(solver.solve(x + sign * np.array([0, 0, 0, 1e-3])).potential_energy)
    assert slope == pytest.approx((ends[1] - ends[0]) / 2e-3, rel=1e-4)


def test_unequal_stretches_leave_only_the_turns_that_keep_them():
    assert len(symmetry_of(body(1.2), "top").matrices) == 8
    assert len(symmetry_of(body(1.2, 1.0), "top").matrices) == 4
