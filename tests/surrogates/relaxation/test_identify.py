"""Shares and times are found again, with honest errors, and bad records are refused in words."""

from __future__ import annotations

import numpy as np
import pytest
from relaxing import TERMS

from palpate.errors import UsageError
from palpate.learning.relaxation import Record, identify, identify_behind_pad
from palpate.surrogates.memories import Relaxation

TRUE = Relaxation(TERMS)
TIMES = np.arange(0.0, 10.0, 0.02)


def noisy(times=TIMES, noise=0.01, seed=0, branches=TRUE):
    rng = np.random.default_rng(seed)
    return Record(times, 2.5 * (branches.relaxation(times) + noise * rng.standard_normal(len(times))))


def test_clean_data_give_the_branches_back():
    found = identify(Record(TIMES, 2.5 * TRUE.relaxation(TIMES)))
    np.testing.assert_allclose(np.array(found.relaxation.terms), TERMS, rtol=1e-6)


@pytest.mark.parametrize("terms", [((0.4, 0.7),), ((0.2, 0.05), (0.2, 0.5), (0.2, 5.0))])
def test_the_number_of_branches_is_found(terms):
    times = np.geomspace(1e-3, 40.0, 400)
    found = identify(noisy(times, 1e-4, branches=Relaxation(terms)))
    assert len(found.relaxation.terms) == len(terms)
    np.testing.assert_allclose(np.array(found.relaxation.terms), terms, rtol=0.02)


@pytest.mark.parametrize("seed", range(6))
def test_noise_of_one_per_cent_is_borne(seed):
    """Deviations within four standard errors, which are themselves below 2 % of the force and 6 % of the times."""
    found = identify(noisy(seed=seed))
    deviation = np.abs(np.array(found.relaxation.terms) - TERMS)
    assert (deviation[:, 0] < 4 * found.shares_error).all()
    assert (deviation[:, 1] < 4 * found.times_error).all()
    assert (found.shares_error < 0.02).all()
    assert (found.times_error < 0.06 * np.array(TRUE.times)).all()
    assert found.noise == pytest.approx(0.01, rel=0.15)


@pytest.mark.full
def test_standard_errors_are_those_of_repetition():
    """Spread over 30 records and mean standard error agree within four of the spread's own, 4/√(2·29) = 53 %."""
    fits = [identify(noisy(seed=100 + k), most=2) for k in range(30)]
    spread = np.std([[t for _, t in f.relaxation.terms] for f in fits], axis=0)
    np.testing.assert_allclose(spread, np.mean([f.times_error for f in fits], axis=0), rtol=0.53)


def test_a_press_that_took_time_is_allowed_for():
    """Even rise of the force in 0.2 s: each branch has lost (1 − exp(−x))/x of its share by its end."""
    rise = 0.2
    left = [g * t / rise * (1 - np.exp(-rise / t)) for g, t in TERMS]
    force = 0.5 + sum(a * np.exp(-TIMES / t) for a, (_, t) in zip(left, TERMS, strict=True))
    found = identify(Record(TIMES, force, rise=rise))
    np.testing.assert_allclose(np.array(found.relaxation.terms), TERMS, rtol=1e-6)


def test_a_pad_is_told_from_two_depths():
    true = Relaxation(TERMS, pad=2e-4)
    records = [Record(TIMES, true.relaxation(TIMES, u), energy=u) for u in (2e-5, 1e-3)]
    found = identify_behind_pad(records, most=2)
    np.testing.assert_allclose(np.array(found.relaxation.terms), TERMS, rtol=1e-4)
    assert found.relaxation.pad == pytest.approx(2e-4, rel=1e-3)


def test_a_pad_needs_two_depths():
    record = Record(TIMES, TRUE.relaxation(TIMES), energy=1e-3)
    with pytest.raises(UsageError, match="depths"):
        identify_behind_pad([record, record])


def test_too_short_a_record_says_which_time_it_cannot_tell():
    """Within 0.5 s a branch of 2 s is a straight line, and its curvature is lost in 1 % noise."""
    times = np.linspace(0.0, 0.5, 400)
    slow = Relaxation(((0.35, 2.0),))
    with pytest.raises(UsageError, match="can't be told") as caught:
        identify(noisy(times, branches=slow))
    assert "longer" in caught.value.fix


@pytest.mark.parametrize(
    ("times", "forces", "words"),
    [
        (TIMES[::-1], TRUE.relaxation(TIMES), "ascend"),
        (TIMES - 1.0, TRUE.relaxation(TIMES), "ascend"),
        (TIMES, 1 + 0.1 * TIMES, "grows"),
        (TIMES, np.ones(len(TIMES)), "hides"),
        (TIMES, -TRUE.relaxation(TIMES), "mean force"),
        (TIMES, np.where(TIMES == 0, np.nan, 1.0), "finite"),
        (TIMES[:5], TRUE.relaxation(TIMES[:5]), "no record"),
        (TIMES, TRUE.relaxation(TIMES[:-1]), "no record"),
    ],
)
def test_bad_records_are_refused(times, forces, words):
    with pytest.raises(UsageError, match=words):
        Record(times, forces)


def test_noise_without_relaxation_is_no_relaxation():
    rng = np.random.default_rng(3)
    with pytest.raises(UsageError, match="noise"):
        Record(TIMES, 1 + 0.01 * rng.standard_normal(len(TIMES)))
