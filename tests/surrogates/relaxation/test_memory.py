"""The memory: exact where it claims to be, passive always."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from relaxing import KINDS, RADIUS, TERMS, TOUCH, along, bed, elastic, remembering, touching

from palpate.errors import UsageError
from palpate.learning.relaxation import Drive, ramp, random_drive, step_hold
from palpate.surrogates.memories import Relaxation, course
from remembering import press


@pytest.fixture(scope="module", params=KINDS)
def memory(request):
    return remembering(request.param)


def led(memory, drive):
    return course(memory, drive.times, drive.positions, *along(drive))


def test_an_instant_is_elastic(memory):
    memory.reset()
    place = touching(-0.001, -0.002, -0.004)
    energy, slope = elastic(place)
    press(memory, place, energy, slope, 0.0)
    np.testing.assert_allclose(memory.force, -slope, rtol=1e-12, atol=1e-15)
    assert memory.stored == pytest.approx(energy, rel=1e-12)
    assert memory.lost == pytest.approx(0.0, abs=1e-15 * energy)


@pytest.mark.parametrize("patches", [None, bed()], ids=["scalar", "patches"])
def test_a_held_force_relaxes_by_the_series_in_steps_of_any_length(patches):
    drive = step_hold(TOUCH, 0.004, [0.003, 0.1, 0.11, 1.0, 30.0])
    force = led(Relaxation(TERMS, patches=patches).start(), drive).force
    left = Relaxation(TERMS).relaxation(drive.times - drive.times[0])
    np.testing.assert_allclose(force[:, 2] / -elastic(drive.positions[0])[1][2], left, rtol=1e-5)


def test_behind_a_pad_a_held_force_falls_as_the_branches_say():
    """To first order in the step over τ; half the step, half the deviation."""
    branches, place = Relaxation(TERMS, pad=2e-4), touching(0, 0, -0.003)
    energy, slope = elastic(place)
    worst = []
    for dt in (0.002, 0.001):
        times = dt * np.arange(1, 1 + round(0.4 / dt))
        memory = branches.start()
        press(memory, place, energy, slope, 0.0)
        held = course(
            memory,
            times - dt,
            *(np.tile(a, (len(times), *np.ones(np.ndim(a), int))) for a in (place, energy, slope)),
        )
        worst.append(np.abs(held.force[:, 2] / -slope[2] - branches.relaxation(times - dt, energy)).max())
    assert worst[1] < 1e-3
    assert worst[0] / worst[1] == pytest.approx(2.0, abs=0.15)


def test_an_even_press_in_q_is_exact_in_one_step():
    """Taylor, Pister & Goudreau 1970: overstress γ a q after an even rise of q; here τ is 10 steps and one step."""
    energy, slope = elastic(touching(0, 0, -0.004))
    for terms in (((0.4, 1.0),), ((0.4, 10.0),)):
        memory = Relaxation(terms).start()
        press(memory, touching(0, 0, -0.004), energy, slope, 1.0)
        x = 1.0 / terms[0][1]
        assert memory.force[2] / -slope[2] == pytest.approx(0.6 + 0.4 * (1 - np.exp(-x)) / x, rel=1e-12)


def test_work_is_stored_or_lost_and_nothing_is_created(memory):
    drive = random_drive(TOUCH, 0.005, 0.008, seconds=20, dt=0.01, seed=2)
    found = led(memory, drive)
    np.testing.assert_allclose(found.work, found.stored + found.lost, atol=1e-13 * found.work.max())
    assert (np.diff(found.lost) >= 0).all()
    assert (found.stored >= 0).all()
    assert found.lost[-1] > 0.1 * found.work.max()


steps = st.lists(
    st.tuples(
        st.floats(-0.012, 0.012),
        st.floats(-0.002, 0.006),
        st.sampled_from([0.0, 1e-6, 1e-3, 0.05, 1.0, 1e3, 1e9]),
    ),
    max_size=25,
)


@pytest.mark.grid
@settings(max_examples=60)
@given(motion=steps)
def test_no_motion_and_no_step_gains_energy(memory, motion):
    memory.reset()
    for sideways, depth, dt in motion:
        place = touching(sideways, 0.5 * sideways, -depth)
        assert press(memory, place, *elastic(place), dt)
        assert memory.lost_in_step >= 0
        assert memory.stored >= -1e-18
        assert memory.work >= -1e-15
        assert memory.force[2] >= 0
        assert np.isfinite(memory.force).all()
    assert memory.work == pytest.approx(memory.stored + memory.lost, abs=1e-15)


def test_the_force_is_minus_the_slope_of_the_stored_energy(memory):
    """After a history, by central differences of instants; O(h²) of a step of 1 µm."""
    drive = random_drive(TOUCH, 0.005, 0.006, seconds=2.1, dt=0.01, seed=5, lifted=0.0)
    place, h = touching(0.002, -0.001, -0.0035), 1e-6

    def stored(position):
        led(memory, drive)
        press(memory, position, *elastic(position), 0.0)
        return memory.stored

    slope = [(stored(place + h * d) - stored(place - h * d)) / (2 * h) for d in np.eye(3)]
    stored(place)
    assert np.linalg.norm(memory.force) > 0.01
    np.testing.assert_allclose(memory.force, -np.array(slope), atol=2e-6 * np.linalg.norm(memory.force))


def test_work_of_the_samples_comes_to_the_work_booked_with_the_square_of_the_step(memory):
    """Trapezoid of F·dc over a drive without lift-off, where the force is smooth."""
    misses = []
    for dt in (0.01, 0.005):
        drive = random_drive(TOUCH, 0.004, 0.004, seconds=4, dt=dt, seed=8, lifted=0.0, band=0.3)
        pressed = Drive("deep", drive.times, drive.positions - (0, 0, 0.002))
        found = led(memory, pressed)
        moves, force = np.diff(pressed.positions, axis=0), found.force
        hand = -np.sum(0.5 * (force[1:] + force[:-1]) * moves)
        misses.append(abs(hand - (found.work[-1] - found.work[0])))
        scale = found.work.max()
    assert misses[1] < 2e-3 * scale
    assert misses[0] / misses[1] > 1.7


def test_tissue_does_not_stick_and_comes_back(memory):
    """Withdrawn in no time after a long hold: no force where the relaxed body stays behind; later it's there again."""
    drive = step_hold(TOUCH, 0.005, [5.0])
    led(memory, drive)
    shallow = touching(0, 0, -0.0015)
    press(memory, shallow, *elastic(shallow), 0.0)
    assert (memory.force == 0).all()
    assert memory.stored > 0
    for _ in range(1000):
        press(memory, shallow, *elastic(shallow), 0.05)
    relaxed = Relaxation(TERMS, memory.relaxation.pad).relaxation(1e9, elastic(shallow)[0])
    assert memory.force[2] == pytest.approx(float(relaxed) * -elastic(shallow)[1][2], rel=1e-3)


def test_fresh_material_comes_under_a_sliding_probe():
    """Far from where it was held for long, a probe that arrives at once feels the elastic force, and drag before.

    Patterns Δ = 31 mm apart of width w = 3.5 mm overlap by exp(−Δ²/8w²) = 7e-5, of which half is remembered; the slope
    of that along x is Δ/4w² times as much, 1e-4 of the force.
    """
    memory = Relaxation(TERMS, patches=bed()).start()
    led(memory, step_hold(touching(-0.012, 0, 0), 0.004, [20.0]))
    near, far = touching(-0.009, 0, -0.004), touching(0.019, 0, -0.004)
    press(memory, near, *elastic(near), 0.0)
    assert memory.force[0] < -0.02 * memory.force[2]
    press(memory, far, *elastic(far), 0.0)
    fresh = -elastic(far)[1]
    assert np.linalg.norm(memory.force - fresh) < 1e-3 * np.linalg.norm(fresh)


def test_a_relaxed_slide_does_not_feel_the_patches():
    """Ripple of the normal force during a steady slide at 1 mm, patches 2.5 mm apart on a uniform body: below 1 %."""
    memory = Relaxation(TERMS, patches=bed(0.0025)).start()
    place = touching(-0.015, -0.0007, -0.001)
    energy, slope = elastic(touching(0, 0, -0.001))
    slope = slope * (0, 0, 1)
    ahead, force = np.array([1e-5, 0, 0]), []
    for k in range(3000):
        assert press(memory, place + k * ahead, energy, slope, 0.001)
        force.append(memory.force[2])
    steady = np.array(force[1500:])
    assert np.ptp(steady) < 0.02 * steady.mean()


def test_faults_are_values():
    memory = Relaxation(TERMS).start()
    place = touching(0, 0, -0.004)
    energy, slope = elastic(place)
    press(memory, place, energy, slope, 0.1)
    before = memory.stored, memory.lost
    for bad in ((place * np.nan, energy, slope, 0.1), (place, np.inf, slope, 0.1), (place, -1.0, slope, 0.1)):
        assert not press(memory, *bad)
        assert (memory.force == 0).all()
        assert (memory.stored, memory.lost) == before
    assert press(memory, place, energy, slope, 0.1)


def test_a_motion_that_is_none_is_refused():
    drive = ramp(TOUCH, 0.003, 1.0, 0.1)
    energies, slopes = along(drive)
    memory = Relaxation(TERMS).start()
    with pytest.raises(UsageError):
        course(memory, drive.times[::-1], drive.positions, energies, slopes)
    with pytest.raises(UsageError):
        course(memory, drive.times, drive.positions[:, :2], energies, slopes)
    with pytest.raises(UsageError, match="Sample 0"):
        course(memory, drive.times, drive.positions, energies - 1.0, slopes)


def test_a_lifted_probe_feels_nothing():
    memory = Relaxation(TERMS, patches=bed()).start()
    led(memory, step_hold(TOUCH, 0.005, [5.0]))
    away = touching(0, 0, 0.5 * RADIUS)
    press(memory, away, 0.0, np.zeros(3), 0.01)
    assert (memory.force == 0).all()
    kept = memory.stored
    press(memory, away, 0.0, np.zeros(3), 5.0)
    assert 0 < memory.stored < 0.2 * kept


def test_lists_are_refused_with_what_is_taken(memory):
    with pytest.raises(UsageError, match=r"arrays of float64"):
        memory.step([0, 0, 0.046], 0.0, [0.0, 0, 0], 1e-3)
