"""A path that ends before its target is no answer, and says why it ended."""

from __future__ import annotations

import numpy as np
import pytest
from solids import above, pressed

from palpate.physics.interactions import Fixed, PrescribedDisplacement, SphereProbe
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block
from palpate.physics.solid import Body, solid_newton, solid_path, solid_solver
from palpate.physics.stop import Stop, Verdict

TOP = PrescribedDisplacement("top", "z", (-0.03, 0.03))


def column():
    return Body(Block((0.02, 0.02, 0.04)), NeoHookean(9e3, 0.45)).problem(TOP)


@pytest.fixture(scope="module")
def solver():
    return pressed().open()


@pytest.mark.grid
@pytest.mark.parametrize("limit", [1, 3, 5])
def test_a_path_without_iterations_left_never_converges_short_of_its_target(monkeypatch, solver, limit):
    solver.reset()
    monkeypatch.setattr(solid_path, "MOST_ITERATIONS", limit)
    found = solver.solve(above(0.006))
    if found.converged:
        np.testing.assert_array_equal(found.log[-1].position, 1.0)
        np.testing.assert_array_equal(found.reached, above(0.006))
    else:
        assert found.stop is Stop.ITERATION_LIMIT
        assert np.isnan(found.response).all()


def test_nor_does_one_whose_steps_get_too_short(monkeypatch, solver):
    solver.reset()
    monkeypatch.setattr(solid_path, "SMALLEST_STEP", 0.9)
    found = solver.solve(above(0.006))
    assert found.log[-1].stop is Stop.CONVERGED
    assert found.stop is Stop.STEP_TOO_SMALL
    assert found.reached[2] > above(0.006)[2]


def test_constant_loads_that_were_not_reached_are_refused(monkeypatch):
    from palpate.errors import SolverError

    hold = Fixed(
        PrescribedDisplacement("side", "x", (0, 0.01), within=((0.0599, -1, -1), (1, 1, 1))), (0.003,)
    )
    monkeypatch.setattr(solid_path, "MOST_ITERATIONS", 1)
    monkeypatch.setattr(solid_path, "_step_end", lambda position, step: position + step / 2)
    with pytest.raises(SolverError, match="constant loads"):
        pressed(held=hold).open()


def test_the_end_of_a_path_is_checked_anew(solver, monkeypatch):
    """Whatever a path says of itself, a state that is no equilibrium under the inputs asked is refused."""
    solver.reset()
    good = solver.solve(above(0.002))
    stale = solid_path.PathPoint(above(0.004), good.state)
    monkeypatch.setattr(
        solid_solver, "soften_and_follow", lambda *_: solid_path.PathResult(stale, Verdict(), good.log)
    )
    solver.reset()
    assert not solver.solve(above(0.004)).converged
    short = solid_path.PathPoint(above(0.002), good.state)
    monkeypatch.setattr(
        solid_solver, "soften_and_follow", lambda *_: solid_path.PathResult(short, Verdict(), good.log)
    )
    solver.reset()
    assert not solver.solve(above(0.004)).converged


def test_the_residual_told_is_that_of_the_answer(solver):
    solver.reset()
    found = solver.solve(above(0.003))
    assert found.residual < 1e-9
    model = solver._model
    model.set(found.inputs)
    assert found.residual == model.error(found.state)


def test_chord_steps_are_counted_and_told(solver):
    solver.reset()
    found = solver.solve(above(0.003))
    assert found.chords == sum(step.chords for step in found.log) > 0
    assert f"+ {found.chords} steps with a reused tangent" in str(found)


@pytest.mark.full
def test_a_chain_before_a_reset_does_not_change_a_bit():
    """Also where no interaction's energy brings its own tangent: prescribed displacements."""
    chain, other = ([-0.001], [-0.002]), ([0.004], [0.008])
    solver = column().open()
    first = [solver.solve(q) for q in chain]
    for q in other:
        solver.solve(q)
    solver.reset()
    again = [solver.solve(q) for q in chain]
    for a, b in zip(first, again, strict=True):
        np.testing.assert_array_equal(a.state, b.state)
        np.testing.assert_array_equal(a.response, b.response)
        assert a.iterations == b.iterations


@pytest.mark.full
def test_a_prescribed_displacement_takes_the_body_along_from_the_start():
    """With the body left behind, elements beside the moved surface turn over, and steps are wasted on them."""
    found = column().solve([-0.012])
    assert found.converged
    assert found.log[0].stop is Stop.CONVERGED
    assert found.iterations <= 12


@pytest.mark.full
def test_a_failed_solve_can_be_looked_at(solver):
    solver.reset()
    found = solver.solve((0.03, 0.03, 0.01))
    assert not found.converged
    last = found.last_good
    np.testing.assert_array_equal(last.inputs, found.reached)
    assert np.isfinite(last.displacement).all()
    assert last.least_volume_ratio > 0


def test_the_last_equilibrium_of_a_failed_solve_is_one(monkeypatch, solver, tmp_path):
    """Asked for by itself, it is found again."""
    solver.reset()
    monkeypatch.setattr(solid_path, "MOST_ITERATIONS", 1)
    failed = solver.solve(above(0.006))
    last = failed.last_good
    assert last.inputs[2] > above(0.006)[2]
    assert failed.to_vtu(tmp_path / "last.vtu", last=True).exists()
    monkeypatch.undo()
    solver.reset()
    again = solver.solve(last.inputs)
    np.testing.assert_allclose(last.response, again.response, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(last.displacement, again.displacement, atol=1e-9)
    assert again.last_good is None


def test_what_is_held_is_checked_too(solver):
    """A held sphere that has been swallowed is as inadmissible as one that moves."""
    swallowed = SphereProbe(radius=0.01, stop=None, over=((0.01, 0.01), (0.02, 0.02)))
    held = Fixed(swallowed, (0.015, 0.015, 0.034))
    model = pressed(held=held, probe=SphereProbe(radius=0.01)).open()._model
    inside = model._constants[0].values.copy()
    outside = above(-0.01)
    assert model.judge(model.base, outside).stop is Stop.CONVERGED
    model._constants[0].values[:] = (0.015, 0.015, 0.01)
    assert model.judge(model.base, outside).stop is Stop.THROUGH_SURFACE
    model._constants[0].values[:] = inside
    assert model.judge(model.base, outside).figures["penetration"] > 0


class OneSaddle:
    """A system of one unknown whose correction grows when it is followed: natural monotonicity refuses it."""

    saddle = True

    class field:
        moving = np.array([True])

    def potential(self, z):
        return np.nan if abs(z[0]) > 3 else 1.0

    def residual(self, z):
        return np.array([1.0 + 9.0 * abs(z[0] - 1.0)])

    def factorise(self, z):
        pass

    def solve(self, rhs):
        return rhs * 4.0


def test_a_state_refused_for_growing_corrections_clears_the_blame_of_an_earlier_one():
    """The first, longest trial is out of reach; the shorter ones are not, and are refused for another reason."""
    found = solid_newton.equilibrate(OneSaddle(), np.array([1.0]), solid_newton.Scale(0.0, 1.0), 1e-9, 5)
    assert found.stop is Stop.STEP_TOO_SMALL
    assert found.cuts > 0
    assert found.rejected is None


def test_a_path_of_ever_shorter_steps_is_given_up(monkeypatch, solver):
    solver.reset()
    monkeypatch.setattr(solid_path, "MOST_STEPS", 1)
    monkeypatch.setattr(solid_path, "_pace", lambda _: 0.1)
    found = solver.solve(above(0.006))
    assert found.stop is Stop.ITERATION_LIMIT
    assert "1 steps along the path" in found.message
    assert found.reached[2] > above(0.006)[2]
