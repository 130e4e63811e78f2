"""A sphere on a block: force and stiffness against differences, reactions, other paths and other forms."""

from __future__ import annotations

import ngsolve
import numpy as np
import pytest
from solids import PROBE, RADIUS, above, gel, pressed

from palpate.errors import UsageError
from palpate.physics.interactions import SphereProbe
from palpate.physics.stop import Stop

STEP = 1e-6  # m; so short that hardly a quadrature point comes into contact, where stiffness jumps


@pytest.fixture(scope="module", params=[0.45, 0.499], ids=["displacement", "mixed"])
def solver(request):
    return pressed(request.param).open()


@pytest.fixture(scope="module")
def pressed_in(solver):
    """Solution at 5 mm, first of its chain."""
    solver.reset()
    found = solver.solve(above(0.005))
    assert found.converged, found.message
    return found


@pytest.mark.full
def test_the_force_is_minus_the_gradient_of_the_energy(solver, pressed_in):
    differences = []
    for axis in np.eye(3) * STEP:
        ahead, behind = (solver.solve(pressed_in.inputs + sign * axis) for sign in (1, -1))
        differences.append((ahead.potential_energy - behind.potential_energy) / (2 * STEP))
    error = np.abs(pressed_in.response + differences).max() / np.linalg.norm(pressed_in.response)
    assert error < 1e-5


@pytest.mark.full
def test_the_stiffness_is_the_gradient_of_the_force(solver, pressed_in):
    # a tenth of the step: the stiffness has a kink wherever a quadrature point comes into contact
    h = STEP / 10
    columns = []
    for axis in np.eye(3) * h:
        ahead, behind = (solver.solve(pressed_in.inputs + sign * axis) for sign in (1, -1))
        columns.append((ahead.response - behind.response) / (2 * h))
    stiffness = pressed_in.response_gradient
    assert np.abs(np.array(columns).T - stiffness).max() < 1e-5 * np.abs(stiffness).max()


def test_the_stiffness_is_symmetric_before_it_is_made_so(solver, pressed_in):
    """A term that is missing in the coupling or the tangent would show."""
    model = solver._model
    model.set(pressed_in.inputs)
    model.system.factorise(pressed_in.state)
    raw, _ = model.inputs.raw_hessian(model.system, pressed_in.state)
    assert np.abs(raw - raw.T).max() < 1e-10 * np.abs(raw).max()
    np.testing.assert_allclose(-raw, pressed_in.response_gradient, atol=1e-7 * np.abs(raw).max())


def test_the_force_is_the_sum_of_the_reactions(solver, pressed_in):
    """∂Π/∂z at the fixed unknowns is the support's force; all together it balances the probe's."""
    model = solver._model
    model.set(pressed_in.inputs)
    gradient = model.system.gradient(pressed_in.state)
    moves = [model.field.interpolate(ngsolve.CF(tuple(e))) for e in np.eye(3)]
    support = np.array([gradient @ move for move in moves])
    np.testing.assert_allclose(pressed_in.response, support, atol=1e-8 * np.linalg.norm(support))
    residual = np.where(model.field.free, gradient, 0.0)
    assert np.linalg.norm(residual) < 1e-8 * np.linalg.norm(support)


@pytest.mark.full
def test_the_same_answer_is_found_warm_cold_and_by_another_path(solver, pressed_in):
    aside = above(0.004, (0.033, 0.029))
    solver.reset()
    assert solver.solve(aside).converged
    warm = solver.solve(above(0.0045))
    around = solver.solve(pressed_in.inputs)
    assert warm.converged
    assert around.iterations < pressed_in.iterations
    np.testing.assert_allclose(around.response, pressed_in.response, rtol=1e-7, atol=1e-9)
    assert around.potential_energy == pytest.approx(pressed_in.potential_energy, rel=1e-10)


@pytest.mark.full
def test_a_chain_has_the_same_bits_each_time(solver):
    chain = [above(depth) for depth in (0.001, 0.003)]

    def answers():
        solver.reset()
        return [solver.solve(centre) for centre in chain]

    for first, second in zip(answers(), answers(), strict=True):
        assert first.potential_energy == second.potential_energy
        np.testing.assert_array_equal(first.response, second.response)
        np.testing.assert_array_equal(first.displacement, second.displacement)


def test_without_contact_there_is_nothing(solver):
    found = solver.solve(above(-0.001))
    assert found.converged
    assert found.potential_energy == 0
    assert not found.response.any()
    assert not found.response_gradient.any()
    assert not found.displacement.any()


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_inputs_that_are_no_numbers_are_refused_by_name(solver, wrong):
    with pytest.raises(UsageError, match=f"The input c_z is {wrong}") as caught:
        solver.solve([0.03, 0.03, wrong])
    assert "0.032" in caught.value.fix  # its range: the tip is 8 mm deep at most
    assert "load" not in str(caught.value)


def test_positions_where_the_probe_would_meet_the_fixed_bottom_are_refused_at_once(solver):
    """The tip may come within the pad's stop of a fixed surface, and no nearer."""
    for height in (RADIUS - 0.0041, -0.02):  # between bottom and top; below the body, through it
        found = solver.solve([*above(0.0)[:2], height])
        assert found.stop is Stop.NO_APPROACH
        assert not found.log
        assert "what is held" in found.message
    assert solver._model.approach(np.array([*above(0.0)[:2], RADIUS - 0.0039])) is not None
    assert solver._model.approach(above(0.008)) is not None


def test_inputs_beyond_their_ranges_are_told(solver):
    there, deeper = solver.solve(above(0.008)), solver.solve(above(0.0085))
    assert there.converged
    assert there.inside
    assert "beyond" not in str(there)
    assert not deeper.inside
    assert "beyond range c_z = 0.0315 is not in 0.032 … 0.04 m" in str(deeper)


@pytest.mark.full
def test_a_column_extrapolates_from_depth_to_depth():
    """Four Newton iterations a sample at the median is what the whole sweep must reach."""
    solver = pressed().open()
    found = [solver.solve(above(depth)) for depth in np.linspace(0.0005, 0.008, 8)]
    assert all(one.converged for one in found)
    assert np.median([one.iterations for one in found]) <= 2
    forces = [one.response[2] for one in found]
    assert (np.diff(forces) > 0).all()
    assert all(0 < one.penetration < 0.98 * PROBE.stop for one in found)


@pytest.mark.full
def test_forms_agree_as_the_mesh_gets_finer():
    """At ν = 0.45 both have the same limit: their difference falls at least as fast as the element size."""

    def difference(element):
        forms = (pressed(0.45, element=element, formulation=form) for form in ("displacement", "mixed"))
        stiff, soft = (problem.solve(above(0.003)).response[2] for problem in forms)
        return stiff - soft

    assert 0 < difference(0.006) < 0.5 * difference(0.012)


@pytest.mark.full
def test_the_mixed_form_is_chosen_and_does_not_lock():
    """From ν = 0.499 to 0.4999 displacements alone stiffen with the mesh's locking; the mixed form hardly."""
    assert pressed(0.47).body.mixed_regions == ()
    assert pressed(0.49).body.mixed_regions == ("body",)
    assert "0.48" in pressed(0.49).body.formulation_of("body")[1]

    def force(poisson, form):
        return pressed(poisson, formulation=form).solve(above(0.003)).response[2]

    mixed, stiff = (force(0.4999, form) / force(0.499, form) for form in ("mixed", "displacement"))
    assert mixed == pytest.approx(1, abs=0.01)
    assert stiff > mixed
    assert force(0.4999, "displacement") > 1.01 * force(0.4999, "mixed")


@pytest.mark.full
def test_an_incompressible_body_is_solved():
    """ν = 0.5 is the limit of ν → 0.5."""
    assert np.isinf(gel(0.5).bulk_modulus)
    limit = pressed(0.5).solve(above(0.003))
    near = pressed(0.49999).solve(above(0.003))
    assert limit.converged
    np.testing.assert_allclose(limit.response, near.response, rtol=1e-3, atol=1e-5)


def test_sparse_solvers_are_known_by_name():
    from ngsolve.la import BaseMatrix

    with pytest.raises(UsageError, match="sparsecholesky"):
        pressed().open(solver="lu")
    if BaseMatrix.GetDefaultInverseType() != "pardiso":
        with pytest.raises(UsageError, match="mkl"):
            pressed().open(solver="pardiso")


def test_a_probe_on_a_surface_that_is_not_there_is_refused_before_meshing():
    with pytest.raises(UsageError, match="upper"):
        pressed(probe=SphereProbe(radius=0.01, touches="upper"))


def test_the_force_is_the_response_to_lengths(pressed_in):
    np.testing.assert_array_equal(pressed_in.force, pressed_in.response)


def test_an_equivalent_stress_is_never_negative(solver):
    assert solver.solve(above(0.004), fields=True).von_mises.min() >= 0.0
