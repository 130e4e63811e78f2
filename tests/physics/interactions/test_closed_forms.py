"""Interactions on bodies whose equilibrium is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq, fsolve

from palpate.physics.interactions import (
    BodyForce,
    Fixed,
    GluedPad,
    PointForce,
    PrescribedDisplacement,
    Pressure,
    SurfaceTraction,
    pad_share,
)
from palpate.physics.materials import LinearElastic, NeoHookean
from palpate.physics.shapes import Block
from palpate.physics.solid import Body

SIZE = (0.04, 0.03, 0.02)
AREA, HEIGHT = SIZE[0] * SIZE[1], SIZE[2]
BLOCK = Block(SIZE, element=0.02)
CORK = LinearElastic(young=9e3, poisson=0.0, density=1000.0)  # the sides of a bar of it stay where they are
GEL = NeoHookean(young=9e3, poisson=0.3)
MU, LAME = GEL.young / 2 / 1.3, GEL.young * 0.3 / 1.3 / 0.4
FAR = 1.0  # m, beyond the block


def roller(axis, surface="side"):
    """The face at 0 of an axis slides in its plane."""
    upper = [FAR, FAR, FAR]
    upper["xyz".index(axis)] = 0.0
    box = ((-FAR, -FAR, -FAR), tuple(upper))
    return Fixed(PrescribedDisplacement(surface, axis, (-FAR, FAR), sliding=True, within=box), (0.0,))


ROLLERS = (roller("x"), roller("y"), roller("z", "bottom"))


def principal(stretches):
    """Nominal principal stresses of the neo-Hookean law at given stretches, in Pa."""
    stretches = np.asarray(stretches)
    return MU * (stretches - 1 / stretches) + LAME * np.log(stretches.prod()) / stretches


def test_a_bar_under_prescribed_stretch_resists_as_the_homogeneous_state():
    pull = PrescribedDisplacement("top", "z", (-0.01, 0.01), sliding=True)
    solver = Body(BLOCK, GEL, fixed=(), held=ROLLERS).problem(pull).open()
    for d in (-0.004, 0.006):
        z = 1 + d / HEIGHT
        side = brentq(lambda s, z=z: principal((s, s, z))[0], 0.5, 2.0, xtol=1e-15)
        solution = solver.solve(d)
        assert solution.converged
        assert solution.response == pytest.approx(-AREA * principal((side, side, z))[2], rel=1e-8)
        energy = (
            MU / 2 * (2 * side**2 + z**2 - 3) - MU * np.log(side**2 * z) + LAME / 2 * np.log(side**2 * z) ** 2
        )
        assert solution.potential_energy == pytest.approx(energy * AREA * HEIGHT, rel=1e-8)


def test_pre_stretch_changes_the_stiffness_as_the_homogeneous_state():
    """Stretched by half along x and held there, pulled along z; y is free."""
    x = 1.5
    ends = ((SIZE[0], -FAR, -FAR), (FAR, FAR, FAR))
    stretch = Fixed(
        PrescribedDisplacement("side", "x", (0, 0.1), sliding=True, within=ends), ((x - 1) * SIZE[0],)
    )
    pull = PrescribedDisplacement("top", "z", (-0.01, 0.01), sliding=True)
    body = Body(BLOCK, GEL, fixed=(), held=(*ROLLERS, stretch))

    def force(z):
        y = brentq(lambda y: principal((x, y, z))[1], 0.3, 2.0, xtol=1e-15)
        return AREA * principal((x, y, z))[2]

    _, start = fsolve(lambda s: principal((x, s[0], s[1]))[1:], (0.8, 0.8), xtol=1e-12)
    solution = body.problem(pull).open().solve(0.001)
    assert solution.converged
    # u counts from the pre-stretched body, whose top has come down
    z, step = start + 0.001 / HEIGHT, 1e-5
    assert solution.response == pytest.approx(-force(z), rel=1e-7)
    slope = (force(z + step) - force(z - step)) / (2 * step) / HEIGHT
    assert solution.response_gradient.item() == pytest.approx(-slope, rel=1e-6)


def test_a_bar_under_its_weight_stretches_quadratically():
    weight = CORK.density * 9.80665
    hung = Body(BLOCK, CORK, fixed="top")
    solution = hung.problem(BodyForce((0.0, 2 * weight))).solve(weight)
    depth = HEIGHT - solution.mesh.points[:, 2]
    expected = -weight / CORK.young * (HEIGHT * depth - depth**2 / 2)
    np.testing.assert_allclose(solution.displacement[:, 2], expected, atol=1e-9 * HEIGHT)
    # the same from the density, with a load that does nothing
    heavy = Body(BLOCK, CORK, fixed="top", gravity=(0, 0, -9.80665))
    same = heavy.problem(SurfaceTraction("bottom", "x", (0.0, 1.0))).solve(0.0)
    np.testing.assert_allclose(same.displacement, solution.displacement, atol=1e-9 * HEIGHT)


def test_uniform_traction_stretches_a_bar_evenly():
    for direction, sign in (("z", 1.0), ("normal", 1.0), ((0, 0, -2), -1.0)):
        solution = Body(BLOCK, CORK).problem(SurfaceTraction("top", direction, (0.0, 100.0))).solve(50.0)
        rise = 50.0 / CORK.young * HEIGHT
        np.testing.assert_allclose(
            solution.displacement[:, 2], sign * rise * solution.mesh.points[:, 2] / HEIGHT, atol=1e-9 * rise
        )
        assert solution.response.item() == pytest.approx(rise * AREA, rel=1e-9)
        assert solution.potential_energy == pytest.approx(-50.0 * rise * AREA / 2, rel=1e-9)


def test_a_pad_over_the_whole_face_is_a_spring_in_series():
    pad = GluedPad("top", pad=1e6, displacement=(0.0, 0.0, (-0.005, 0.005)))
    solution = Body(BLOCK, CORK).problem(pad).solve(-0.002)
    stiffness = AREA / (1 / 1e6 + HEIGHT / CORK.young)
    assert solution.response.item() == pytest.approx(0.002 * stiffness, rel=1e-9)
    assert solution.response_gradient.item() == pytest.approx(-stiffness, rel=1e-9)
    assert solution.potential_energy == pytest.approx(stiffness * 0.002**2 / 2, rel=1e-9)


def test_a_pad_takes_its_share_of_the_compliance():
    pad = GluedPad("top", pad=1e6, displacement=(0.0, 0.0, (-0.005, 0.005)))
    share = pad_share(Body(BLOCK, CORK).problem(pad), (-0.002,))
    expected = (1 / 1e6) / (1 / 1e6 + HEIGHT / CORK.young)
    assert (share.energy, share.force, share.stiffness) == pytest.approx((expected,) * 3, rel=1e-3)


def test_a_pad_glued_to_a_settled_body_pulls_only_when_it_moves():
    """Under gravity and beside a pad that was glued before; both keep the state in which they were glued."""
    before = Fixed(GluedPad("top", pad=5e5, displacement=(0.0, 0.0, (-0.01, 0.01))), (0.001,))
    body = Body(BLOCK, CORK, gravity=(0, 0, -9.80665), held=before)
    pad = GluedPad("top", pad=1e6, displacement=(0.0, 0.0, (-0.005, 0.005)))
    solver = body.problem(pad).open()
    idle = solver.solve(0.0)
    column = CORK.young * AREA / HEIGHT
    weight = CORK.density * 9.80665 * AREA * HEIGHT
    rise = (5e5 * AREA * 0.001 - weight / 2) / (column + 5e5 * AREA)  # of the top, half of the weight counts
    top = idle.mesh.points[:, 2] > HEIGHT - 1e-9
    assert idle.displacement[top, 2] == pytest.approx(rise, rel=1e-7)
    assert idle.response.item() == pytest.approx(0.0, abs=1e-9 * weight)
    # moving, it works against column and other pad
    expected = 0.001 / (1 / (1e6 * AREA) + 1 / (column + 5e5 * AREA))
    assert solver.solve(0.001).response.item() == pytest.approx(-expected, rel=1e-7)


def test_pressure_on_all_sides_shrinks_evenly():
    """Three planes of symmetry; what the pressure does on them, their rollers bear."""
    parts = [Pressure(s, (0.0, 5e3), symmetry=(0, 0, 0), name=f"p {s}") for s in ("top", "side")]
    solution = Body(BLOCK, GEL, fixed=(), held=ROLLERS).problem(*parts).solve((3e3, 3e3))
    assert solution.converged
    # Cauchy stress -q: nominal stress over the area factor s²
    s = brentq(lambda s: principal((s, s, s))[0] + 3e3 * s**2, 0.3, 1.0, xtol=1e-15)
    np.testing.assert_allclose(solution.displacement, (s - 1) * solution.mesh.points, atol=1e-8 * HEIGHT)
    swept = SIZE[0] * SIZE[1] * SIZE[2] * (1 - s**3)  # two thirds of the volume's change belong to the side
    assert solution.response == pytest.approx([swept / 3, swept * 2 / 3], rel=1e-7)


def test_effects_of_small_loads_add_up():
    force = PointForce((0.02, 0.015, 0.02), 0.006, (0.0, 1.0), element=0.006)
    shear = SurfaceTraction("top", "x", (0.0, 1.0))
    solver = Body(BLOCK, GEL).problem(force, shear).open()
    alone, other, both = (solver.solve(q) for q in ((1e-6, 0), (0, 1e-3), (1e-6, 1e-3)))
    largest = np.abs(both.displacement).max()
    np.testing.assert_allclose(
        both.displacement, alone.displacement + other.displacement, atol=1e-4 * largest
    )
    assert both.response == pytest.approx(alone.response + other.response, rel=1e-4)
    # Maxwell and Betti: what each does at the other's place is equal
    gradient = both.response_gradient
    assert gradient[0, 1] == pytest.approx(gradient[1, 0], rel=1e-9)
    assert both.response == pytest.approx(gradient @ (1e-6, 1e-3), rel=1e-4)


@pytest.mark.full
def test_a_point_force_is_the_same_on_any_mesh():
    """Its spread size decides the displacement under it, not the elements."""
    found = [
        Body(BLOCK, GEL)
        .problem(PointForce((0.02, 0.015, 0.02), 0.01, (0.0, 1.0), element=element))
        .solve(0.02)
        for element in (0.009, 0.005, None)
    ]
    coarse, middle, fine = (solution.response.item() for solution in found)
    assert abs(middle - fine) < abs(coarse - fine)
    assert abs(middle - fine) < 0.02 * fine
