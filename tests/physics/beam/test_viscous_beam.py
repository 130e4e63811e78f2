"""Beams that creep, against the closed forms of linear viscoelasticity and the elastic limits."""

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.physics.beam import Cantilever, Circle, LoadAndUnload, StepAndHold, TipLoad, preset
from palpate.physics.beam.beam_energy import BeamEnergy
from palpate.physics.beam.section_laws import ViscousSection
from palpate.physics.materials.linear import LinearElastic
from palpate.physics.materials.prony import PronySeries
from palpate.physics.materials.viscous import Viscoelastic

NYLON = LinearElastic(2e9, 0.43, 1150.0)
TWO = ((0.3, 0.1), (0.2, 2.0))
ONE = ((0.4, 1.0),)
SMALL = 1e-3  # N: the beam bends by 7e-4 of its length


def beam(terms=TWO, **changes):
    return Cantilever(1.0, Circle(0.005), Viscoelastic(NYLON, terms, part="all"), **changes)


def elastic(share=1.0, **changes):
    return Cantilever(1.0, Circle(0.005), LinearElastic(share * 2e9, 0.43, 1150.0), **changes)


def march(body, loads, times):
    return body.problem(TipLoad(-5, 5)).solve_path(loads, times)


def tip(solution):
    return -solution.displacement[-1, 1]


def creep(terms, time):
    """J(t) E_0 by partial fractions: the poles of 1/(s g̃(s)) with s g̃(s) = γ_∞ + Σ γ_i s τ_i/(1 + s τ_i)."""
    rest = 1 - sum(share for share, _ in terms)
    factors = [np.poly1d([tau, 1.0]) for _, tau in terms]
    whole = np.poly1d([1.0])
    for factor in factors:
        whole *= factor
    modulus = rest * whole
    for (share, tau), factor in zip(terms, factors, strict=True):
        modulus += np.poly1d([share * tau, 0.0]) * (whole / factor)[0]
    poles = modulus.roots
    residues = [whole(p) / (p * modulus.deriv()(p)) for p in poles]
    return 1 / rest + sum(
        r * np.exp(p * np.asarray(time)) for r, p in zip(residues, poles, strict=True)
    ), poles


# sections


def section(terms=TWO):
    return ViscousSection(np.array([3.0, 5.0, 7.0]), PronySeries(terms))


@pytest.mark.parametrize("steps", [1, 2, 7])
def test_a_held_strain_relaxes_exactly_whatever_the_step(steps):
    law, strain = section(), np.array([[0.01, -0.02, 0.3]])
    internal = law.answer(strain, law.rest((1,)), None).internal
    for _ in range(steps):
        answer = law.answer(strain, internal, 3.0 / steps)
        internal = answer.internal
    expected = strain * (3.0, 5.0, 7.0) * PronySeries(TWO).relaxation(3.0)
    np.testing.assert_allclose(answer.force, expected, rtol=1e-14)


@pytest.mark.parametrize("dt", [1e-9, 1e-5, 1e-3, 0.1, 4.0, 1e4])
def test_a_sections_energies_balance(dt):
    """Work of a strain that grows evenly = change of the springs' energy + what the dashpots took."""
    rng = np.random.default_rng(4)
    law, before, after = section(), *(rng.normal(size=(2, 1, 3)))
    internal = law.answer(before, law.rest((1,)), 0.05).internal
    # the force on the way, by the same law at Gauss points in between: exact for each of these shorter times
    points, weights = np.polynomial.legendre.leggauss(60)
    shares = (points + 1) / 2
    forces = [law.answer(before + s * (after - before), internal, s * dt).force[0] for s in shares]
    work = sum(w / 2 * force @ (after - before)[0] for w, force in zip(weights, forces, strict=True))
    end = law.answer(after, internal, dt).internal
    stored = law.stored_energy(after, end)[0] - law.stored_energy(before, internal)[0]
    lost = law.dissipated_energy(internal, end, dt)[0]
    assert lost >= 0
    if dt <= 4.0:  # beyond, the force falls too fast for the Gauss points
        assert stored + lost == pytest.approx(work, rel=1e-6)


def test_forever_is_the_limit_of_long():
    law, strain = section(), np.array([[0.01, -0.02, 0.3]])
    internal = law.answer(strain, law.rest((1,)), None).internal
    ever = law.answer(2 * strain, internal, np.inf)
    np.testing.assert_allclose(ever.force, strain * (3.0, 5.0, 7.0), rtol=1e-14)  # half of twice
    long = law.answer(2 * strain, internal, 1e9)
    np.testing.assert_allclose(long.force, ever.force, rtol=1e-8)
    assert law.dissipated_energy(internal, ever.internal, np.inf)[0] == pytest.approx(
        law.dissipated_energy(internal, long.internal, 1e9)[0], rel=1e-7
    )


@pytest.mark.parametrize("large", [True, False])
def test_forces_and_tangents_of_a_step_are_derivatives(large):
    law = section()
    model = BeamEnergy(np.array([0.0, 0.3, 0.5, 1.0]), 3, law, large=large)
    rng = np.random.default_rng(5)
    internal = model.step(model.rest(), None).outcome(0.3 * rng.normal(size=model.size))
    step, z, d, h = model.step(internal, 0.2), *(0.3 * rng.normal(size=(2, model.size))), 1e-5
    slope = (step.energy(z + h * d) - step.energy(z - h * d)) / (2 * h)
    assert slope == pytest.approx(step.force(z) @ d, rel=1e-7)
    curve = (step.force(z + h * d) - step.force(z - h * d)) / (2 * h)
    again = step.tangent(z)
    back = again.solve(curve, 0.0)
    if back is not None:  # a tangent that is not positive definite is told apart by None
        np.testing.assert_allclose(back, d, atol=1e-6 * np.abs(d).max())
    else:
        assert large


# beams


@pytest.mark.full
@pytest.mark.parametrize("terms", [ONE, TWO])
def test_a_small_load_creeps_by_the_compliance(terms):
    times = np.array([0.0, 0.01, 0.1, 0.5, 1.0, 3.0, 10.0, 40.0])
    found = np.array([tip(s) for s in march(beam(terms), np.full(8, SMALL), times)])
    expected, _ = creep(terms, times)
    # the beam's deflection is not quite linear: its relative error goes with its square, 1e-6
    np.testing.assert_allclose(found / found[0], expected, rtol=3e-5)
    if terms is ONE:
        np.testing.assert_allclose(expected, (1 - 0.4 * np.exp(-0.6 * times)) / 0.6, rtol=1e-12)


@pytest.mark.full
def test_a_held_tip_relaxes():
    """The load that keeps a small deflection is P g(t): between its samples it errs with their distance squared."""

    def drift(count):
        times = np.concatenate([[0.0], np.geomspace(1e-3, 10.0, count)])
        found = [
            tip(s) for s in march(beam(tolerance=1e-3), SMALL * PronySeries(TWO).relaxation(times), times)
        ]
        return max(abs(np.array(found) / found[0] - 1))

    coarse, fine = drift(16), drift(32)
    assert fine < 2e-3
    assert fine < coarse / 3


@pytest.mark.parametrize("load", [1.0, 5.0])
def test_the_limits_in_time_are_elastic_beams(load):
    first, last = march(beam(tolerance=1e-4), [load, load], [0.0, 1e4])
    for found, share in ((first, 1.0), (last, 0.5)):
        wanted = elastic(share).problem(TipLoad(0, 5)).solve(load)
        np.testing.assert_allclose(found.displacement, wanted.displacement, atol=1e-8)
        np.testing.assert_allclose(found.root_reaction, wanted.root_reaction, atol=1e-8)
        assert found.strain_energy == pytest.approx(wanted.strain_energy, rel=1e-7)
    assert first.dissipated == 0.0


def test_slow_and_fast_ramps_are_elastic_too():
    slow, fast = (march(beam(), [5.0], [time])[0] for time in (1e5, 1e-6))
    np.testing.assert_allclose(
        slow.displacement, elastic(0.5).problem(TipLoad(0, 5)).solve(5.0).displacement, atol=1e-4
    )
    np.testing.assert_allclose(
        fast.displacement, elastic().problem(TipLoad(0, 5)).solve(5.0).displacement, atol=1e-4
    )
    assert slow.dissipated < 1e-4 * slow.strain_energy
    assert fast.dissipated < 1e-4 * fast.strain_energy


@pytest.mark.full
def test_work_is_stored_or_dissipated_at_large_deflections():
    """Under a dead load the work after it was put on is P Δu; it is put on at once, and so stored in full."""
    path = march(beam(), [4.0] * 4, [0.0, 0.2, 1.0, 20.0])
    for solution in path[1:]:
        work = path[0].strain_energy + 4.0 * (tip(solution) - tip(path[0]))
        assert solution.strain_energy + solution.dissipated == pytest.approx(work, rel=1e-4)
    assert np.all(np.diff([s.dissipated for s in path]) > 0)


@pytest.mark.full
def test_the_load_goes_and_the_bend_fades():
    """At the rate of the slowest pole of the compliance, by the fading memory of the series."""
    times = [0.0, 1.0, 1.0, 9.0, 12.0, 60.0]
    path = march(beam(), [SMALL, SMALL, 0, 0, 0, 0], times)
    slowest = creep(TWO, 0.0)[1].max()
    assert tip(path[4]) / tip(path[3]) == pytest.approx(np.exp(3.0 * slowest), rel=3e-3)
    assert abs(tip(path[5])) < 1e-6 * tip(path[0])


@pytest.mark.full
def test_what_came_before_is_forgotten():
    body = beam(tolerance=1e-4)
    quiet = march(body, [0.0, 2.0, 2.0], [5.0, 6.0, 60.0])
    wild = march(body, [4.0, -4.0, 2.0, 2.0], [2.0, 5.0, 6.0, 60.0])
    assert abs(tip(quiet[1]) - tip(wild[2])) > 0.02
    assert tip(quiet[2]) == pytest.approx(tip(wild[3]), rel=2e-4)  # of what each is off by itself


@pytest.mark.full
def test_a_cycles_loss_is_that_of_the_loss_compliance():
    """π P² J''(ω) u_0/P a cycle, with J* = 1/g*, for a small sine made of straight pieces."""
    frequency, prony = 1.5, PronySeries(ONE)
    first = tip(march(beam(ONE), [SMALL], [0.0])[0])
    modulus = prony.storage(frequency) + 1j * prony.loss(frequency)
    exact = np.pi * SMALL * first * -(1 / modulus).imag

    def loss(count):
        phase = 2 * np.pi * np.arange(1, 3 * count + 1) / count
        loads = SMALL * np.sin(phase)
        path = march(beam(ONE, tolerance=1e-2), loads, phase / frequency)
        work = np.trapezoid(loads[-count - 1 :], [tip(s) for s in path[-count - 1 :]])
        return path[-1].dissipated - path[-count - 1].dissipated, work

    (coarse, _), (fine, work) = loss(12), loss(24)
    # straight pieces: the amplitude of the sine that they hold is too small by (2π/N)²/12, its square by twice that
    assert fine == pytest.approx(exact, rel=2 * (2 * np.pi / 24) ** 2 / 6)
    assert abs(fine / exact - 1) < abs(coarse / exact - 1) / 3
    assert work == pytest.approx(fine, rel=2 * (2 * np.pi / 24) ** 2 / 6)


@pytest.mark.full
def test_the_tolerance_is_kept():
    times, loads = [0.0, 0.3, 3.0], [5.0, 5.0, 5.0]
    best = march(beam(tolerance=1e-7), loads, times)
    errors = []
    for tolerance in (1e-3, 1e-5):
        path = march(beam(tolerance=tolerance), loads, times)
        errors.append(
            max(np.abs(a.displacement - b.displacement).max() for a, b in zip(path, best, strict=True))
        )
        assert errors[-1] < 3 * tolerance * tip(best[-1])
    assert errors[1] < errors[0] / 10


@pytest.mark.full
def test_a_step_that_is_held_for_no_time_is_the_elastic_answer():
    problem = preset("beam-viscoelastic").problem()
    assert [(r.name, r.unit) for r in problem.ranges] == [("P", "N"), ("P_held", "s")]
    at_once = problem.solve((3.0, 0.0))
    wanted = elastic().problem(TipLoad(0, 5)).solve(3.0)
    np.testing.assert_allclose(at_once.displacement, wanted.displacement, atol=1e-10)
    held = problem.solve((3.0, 2.0))
    path = problem.solve_path([3.0, 3.0], times=[0.0, 2.0])
    np.testing.assert_array_equal(held.state, path[-1].state)
    assert tip(held) > tip(at_once)


def test_a_load_without_a_history_is_put_on_at_once():
    solution = beam(self_weight=True).problem(TipLoad(0, 5)).solve(3.0)
    wanted = elastic(self_weight=True).problem(TipLoad(0, 5)).solve(3.0)
    np.testing.assert_allclose(solution.displacement, wanted.displacement, atol=1e-9)
    np.testing.assert_allclose(solution.root_reaction, wanted.root_reaction, atol=1e-8)


@pytest.mark.full
def test_a_column_that_creeps_buckles_in_time():
    """π²EI/4L² = 2.42 N at once and half of that in the end (Euler 1744): 1.8 N stands at first only.

    A perfectly straight one stays straight; a breath across tells which way to fall.
    """
    loads = (TipLoad(0, 5, direction=(-1, 0), name="H"), TipLoad(-1, 1))
    stands, falls = beam(tolerance=1e-4).problem(loads).solve_path([[1.8, 2e-3]] * 2, times=[0.0, 1e3])
    assert abs(tip(stands)) < 0.01
    wanted = elastic(0.5).problem(loads).solve((1.8, 2e-3))
    assert tip(wanted) > 0.5
    np.testing.assert_allclose(falls.displacement, wanted.displacement, atol=1e-6)


@pytest.mark.full
def test_answers_do_not_depend_on_what_was_asked_before():
    problem = preset("beam-viscoelastic").problem()
    solver = problem.open()
    solver.solve((5.0, 1.0))
    np.testing.assert_array_equal(solver.solve((2.0, 0.5)).state, problem.solve((2.0, 0.5)).state)


def test_a_history_can_be_taken_up_again():
    problem = beam(tolerance=1e-3).problem(TipLoad(0, 5))
    whole = problem.solve_path([3.0, 1.0, 2.0], times=[0.0, 0.5, 1.5])
    solver = problem.open()
    again = solver.march([2.0], [1.5], start=whole[1])[0]
    np.testing.assert_array_equal(again.state, whole[2].state)
    assert again.time == 1.5


@pytest.mark.parametrize(
    "make",
    [
        lambda: PronySeries(((0.6, 1.0), (0.6, 2.0))),
        lambda: PronySeries(((0.3, 0.0),)),
        lambda: beam(((0.6, 1.0), (0.4, 2.0))),
        lambda: beam(fibres=24),
        lambda: Cantilever(1.0, Circle(0.005), Viscoelastic(NYLON, TWO)),
        lambda: beam().problem(LoadAndUnload("P", peak=(0, 5))),
        lambda: beam().problem([StepAndHold("P", 0, 5, held=(0, 1)), StepAndHold("Q", 0, 5, held=(0, 1))]),
        lambda: elastic().problem(StepAndHold("P", 0, 5, held=(0, 1))),
        lambda: StepAndHold("P", 0, 5, held=(-1, 1)),
        lambda: StepAndHold("P", 0, 5, held=(0, 1), rise=-1.0),
        lambda: StepAndHold("P", 0, 5, held=3.0),
        lambda: StepAndHold("P", "0 N", 5, held=(0, 1)),
        lambda: march(beam(), [1.0, 2.0], None),
        lambda: march(beam(), [1.0, 2.0], [1.0, 0.5]),
        lambda: march(beam(), [1.0, 2.0], [-1.0, 0.5]),
        lambda: march(beam(), [1.0, 2.0], [1.0, np.inf]),
        lambda: march(elastic(), [1.0, 2.0], [1.0]),
    ],
)
def test_what_makes_no_sense_is_refused_with_reason_and_remedy(make):
    with pytest.raises(UsageError) as caught:
        make()
    assert caught.value.why
    assert caught.value.fix
