"""How far laws of small strain are asked, and what the length of load steps does to bodies with a history."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from solids import SIZE, Stretched, above, gel

from palpate.errors import UsageError
from palpate.physics.interactions import SphereProbe
from palpate.physics.materials import LinearElastic, LinearHardening, Plastic
from palpate.physics.shapes import Block
from palpate.physics.solid import Body
from palpate.physics.solid.solid_system import sparse_solver
from palpate.physics.stop import Stop

METAL = Plastic(LinearElastic(1e6, 0.35), LinearHardening(1e4, 2e4))
HARD = SphereProbe(radius=0.01, pad=1e8, stop=0.001, depth=(0.0, 0.0015))
ELEMENT = 0.015


def squeezed(limit, share):
    shorter = Stretched(((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
    body = Body(Block((0.02, 0.02, 0.02)), LinearElastic(9e3, 0.3), fixed=(), strain_limit=limit)
    return body.problem(shorter).solve(share)


def test_a_law_of_small_strain_is_not_asked_beyond_its_reach():
    assert squeezed(0.3, 0.29).converged
    found = squeezed(0.3, 0.31)
    assert found.stop is Stop.STRAIN_LIMIT
    assert "against 0.3" in found.message


def test_det_f_is_that_of_all_regions():
    """At F = diag(1, 1, 1 - q) it is 1 - q, whatever the law."""
    assert squeezed(0.5, 0.4).least_volume_ratio == pytest.approx(0.6, rel=1e-9)


def test_nothing_is_turned_inside_out_however_far_a_law_of_small_strain_may_go():
    found = squeezed(10.0, 1.1)
    assert found.stop is Stop.ELEMENT_INVERTED


def test_a_linear_block_pressed_far_too_deep_is_refused():
    problem = Body(Block(SIZE, element=0.03), LinearElastic(9e3, 0.45)).problem(
        SphereProbe(radius=0.01), element=0.011
    )
    assert problem.solve(above(0.001)).converged
    found = problem.solve(above(0.012))
    assert found.stop is Stop.STRAIN_LIMIT
    assert found.last_good.largest_strain <= problem.body.strain_limit


@pytest.mark.parametrize("wrong", [0.0, -1.0, math.nan])
def test_limits_must_be_positive(wrong):
    for name in ("strain_limit", "step_error"):
        with pytest.raises(UsageError):
            Body(Block(SIZE), gel(), **{name: wrong})


@pytest.fixture(scope="module")
def metal():
    return Body(Block(SIZE, element=0.03), METAL).problem(HARD, element=ELEMENT)


def pressed(solver, depths):
    solver.reset()
    return solver.march(np.arange(1.0, len(depths) + 1), [above(d) for d in depths])


@pytest.mark.full
def test_the_force_on_a_plastic_body_does_not_depend_on_the_steps_asked_for(metal):
    """A march in one step, in four, and a solve from rest agree within a few errors of a step."""
    solver, deep = metal.open(), 0.0012
    forces = [pressed(solver, np.linspace(0, deep, n + 1)[1:])[-1].response[2] for n in (1, 4)]
    forces.append(solver.solve(above(deep)).response[2])
    assert np.ptp(forces) < 2 * metal.body.step_error * forces[0]


@pytest.mark.full
def test_a_smaller_error_of_a_step_comes_closer_to_many_steps(metal):
    deep = 0.0012
    free = dataclasses.replace(metal, body=dataclasses.replace(metal.body, step_error=math.inf)).open()
    truth = pressed(free, np.linspace(0, deep, 17)[1:])[-1].response[2]
    errors = []
    for tolerated in (math.inf, 1e-2, 3e-4):
        body = dataclasses.replace(metal.body, step_error=tolerated)
        solver = dataclasses.replace(metal, body=body).open()
        errors.append(abs(pressed(solver, [deep])[-1].response[2] / truth - 1))
    assert errors[2] < errors[1] <= errors[0]
    assert errors[2] < 3 * 3e-4


@pytest.mark.full
def test_an_instant_of_a_plastic_body_is_the_same_whatever_was_before(metal):
    solver = metal.open()
    first = solver.solve(above(0.0008))
    solver.solve(above(0.0012))
    solver.solve(above(0.0005), dt=1.0)
    again = solver.solve(above(0.0008))
    np.testing.assert_array_equal(first.state, again.state)


def test_a_plastic_body_let_go_answers_elastically_and_at_once(metal):
    """Only elastic strain goes back: the way back is steeper, and costs no more than the way there."""
    there, back = pressed(metal.open(), [0.0010, 0.00095])
    assert back.converged
    assert 0 < back.response[2] < there.response[2]
    steepness = (there.response[2] - back.response[2]) / 0.00005
    assert steepness > 1.5 * there.response[2] / 0.0010
    assert back.iterations <= 8


def test_a_large_sphere_comes_in_several_steps():
    """Its radius says nothing of the way that it goes."""
    large = SphereProbe(radius=0.5, stop=0.004, depth=(0.0, 0.002))
    step = large._first_step()
    assert step <= 0.0005
    small = SphereProbe(radius=0.004, stop=None, depth=(0.0, 0.015))
    assert small._first_step() == pytest.approx(0.001)


def test_cholesky_is_what_one_gets_unless_one_asks():
    """Also where PARDISO is installed."""
    from ngsolve.la import BaseMatrix

    assert sparse_solver() == "sparsecholesky"
    if BaseMatrix.GetDefaultInverseType() != "pardiso":
        with pytest.raises(UsageError, match="mkl"):
            sparse_solver("pardiso")
