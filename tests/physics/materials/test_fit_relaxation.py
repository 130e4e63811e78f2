"""Prony series from records: exact ones to the digit, noisy ones within their intervals, and used in a material."""

from __future__ import annotations

import numpy as np
import pytest

import palpate as pp
from palpate.errors import UsageError
from palpate.physics.materials import PronySeries, Viscoelastic, fit_relaxation
from palpate.study.material_records import SolidMaterialRecord

TERMS = ((0.3, 0.1), (0.2, 2.0), (0.1, 20.0))
TIME = np.geomspace(1e-2, 100, 150)


def record(time, terms=TERMS, ramp=0.0):
    """9 kPa at once; the response to an even rise is the mean of the responses to its steps."""
    series = PronySeries(terms)
    if not ramp:
        return 9e3 * series.relaxation(time)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    ago = ramp * (nodes + 1) / 2
    return 9e3 * series.relaxation(time[:, None] + ago) @ weights / 2


@pytest.mark.parametrize("ramp", [0.0, 0.05])
@pytest.mark.parametrize("terms", [TERMS[:1], TERMS[:2], TERMS])
def test_an_exact_record_gives_its_terms_back(terms, ramp):
    found = fit_relaxation(TIME, record(TIME, terms, ramp), ramp=ramp)
    np.testing.assert_allclose(found.prony.terms, terms, rtol=1e-5)
    assert found.instantaneous == pytest.approx(9e3, rel=1e-6)
    assert found.equilibrium == pytest.approx(9e3 * (1 - sum(g for g, _ in terms)), rel=1e-6)
    np.testing.assert_allclose(found.model(TIME), record(TIME, terms, ramp), rtol=1e-7)


@pytest.mark.full
def test_a_noisy_record_gives_them_within_their_intervals():
    rng = np.random.default_rng(1)
    inside = []
    for _ in range(40):
        noisy = record(TIME, TERMS[:2]) * (1 + 0.01 * rng.standard_normal(len(TIME)))
        found = fit_relaxation(TIME, noisy, confidence=0.9)
        assert len(found.prony.terms) == 2
        for entries, truths in ((found.shares, (0.3, 0.2)), (found.times, (0.1, 2.0))):
            inside += [low < truth < high for (_, low, high), truth in zip(entries, truths, strict=True)]
    assert np.mean(inside) > 0.8  # 0.9 expected of 160, not all independent
    assert all(share > 0 for share in found.prony.shares)


def test_a_force_of_any_sign_and_unit_and_order_will_do():
    order = np.random.default_rng(2).permutation(len(TIME))
    found = fit_relaxation(TIME[order], -1e-6 * record(TIME)[order])
    np.testing.assert_allclose(found.prony.terms, TERMS, rtol=1e-5)
    assert found.instantaneous == pytest.approx(-9e-3, rel=1e-6)


def test_a_flowing_material_and_a_short_record_are_told():
    flowing = fit_relaxation(TIME, 5.0 * np.exp(-TIME / 3))
    assert flowing.equilibrium == pytest.approx(0, abs=1e-6)
    assert "would flow" in " ".join(flowing.notes)
    short = TIME[TIME < 3]
    assert "not finished" in " ".join(fit_relaxation(short, record(short, ((0.5, 4.0),))).notes)


def test_the_terms_go_into_a_material_and_a_study():
    found = fit_relaxation(TIME, record(TIME, TERMS[:2]))
    base = pp.materials.NeoHookean(9e3, 0.45)
    assert Viscoelastic(base, found.prony.terms).states
    made = SolidMaterialRecord.model_validate({"young": 9e3, "prony": found.prony.terms}).build()
    assert isinstance(made, Viscoelastic)
    assert found.toml().splitlines()[-1].startswith("prony = [[0.3, 0.1], [0.2, 2")


@pytest.mark.parametrize(
    ("time", "response", "words"),
    [
        (TIME, np.linspace(1, 2, len(TIME)), "does not relax"),
        (TIME - 1, record(TIME), "end of the rise"),
        (TIME[:2], record(TIME[:2]), "at least 3"),
        (TIME, 0 * TIME, "not 0"),
    ],
)
def test_what_is_no_relaxation_is_refused(time, response, words):
    with pytest.raises(UsageError, match=words):
        fit_relaxation(time, response)


def machine_record(rate, ramp, noise=0.0, start=2.0):
    """Time on a clock whose rise begins at 2 s, and the response with a preload of 200 Pa."""
    t = np.arange(start, 60.0, 1 / rate)
    rising = np.clip((t - 2.0) / ramp, 1e-9, 1.0)
    past = np.maximum(t - 2.0 - ramp, 0.0)
    series = PronySeries(TERMS[1:])
    nodes, weights = np.polynomial.legendre.leggauss(40)
    ago = past[:, None] + ramp * rising[:, None] * (nodes + 1) / 2
    y = 200 + np.where(t > 2.0, 9e3 * rising * (series.relaxation(ago) @ weights) / 2, 0.0)
    return t, y + noise * 9e3 * np.random.default_rng(0).normal(size=len(t))


@pytest.mark.parametrize(("rate", "ramp"), [(50, 0.5), (50, 2.0), (200, 0.1), (20, 1.0)])
@pytest.mark.parametrize("noise", [0.0, 0.002])
def test_rise_and_preload_are_found_in_a_whole_record(rate, ramp, noise):
    t, y = machine_record(rate, ramp, noise, start=0.0)
    found = fit_relaxation(t, y)
    assert found.ramp == pytest.approx(ramp, abs=0.1 * ramp)
    assert found.instantaneous == pytest.approx(9e3, rel=0.03)
    assert found.equilibrium == pytest.approx(6.3e3, rel=0.03)
    begin = float(found.notes[0].partition("begins at ")[2].split()[0])
    assert begin == pytest.approx(2.0 + ramp, abs=1 / rate + 0.02 * ramp)
    assert any("a preload" in note for note in found.notes)


def test_a_record_that_starts_with_the_rise_has_no_preload_that_is_known():
    t, y = machine_record(100, 0.5, start=2.0)
    found = fit_relaxation(t, y - 200)
    assert found.instantaneous == pytest.approx(9e3, rel=0.01)
    assert not any("a preload:" in note for note in found.notes)


@pytest.mark.parametrize(
    "time", [np.geomspace(1e-3, 100, 900), np.linspace(0.0, 100, 2000), np.arange(0.01, 60, 0.01)]
)
def test_times_that_count_from_the_rise_need_no_begin(time):
    found = fit_relaxation(time, record(time, TERMS[1:]))
    np.testing.assert_allclose(found.prony.terms, TERMS[1:], rtol=1e-3)
    assert not any("begin" in note for note in found.notes)


@pytest.mark.parametrize("spacing", [np.linspace(0.01, 100, 3000), np.geomspace(0.01, 100, 300)])
def test_a_clock_that_runs_before_the_record_is_asked_for(spacing):
    with pytest.raises(UsageError, match="when the hold began is not known"):
        fit_relaxation(5.0 + spacing, record(spacing))
    found = fit_relaxation(5.0 + spacing, record(spacing, TERMS[1:]), begin=5.0)
    np.testing.assert_allclose(found.prony.terms, TERMS[1:], rtol=1e-3)
    late = fit_relaxation(
        5.0 + spacing, record(5.0 + spacing, TERMS[1:]), begin=0.0
    )  # it says: from the rise on
    assert late.instantaneous == pytest.approx(9e3, rel=0.05)


@pytest.mark.parametrize(
    ("rows", "noise", "sign"), [(1, 0.0, 1), (5, 0.002, -1), (20, 0.0, 1), (20, 0.002, 1)]
)
def test_a_hold_ends_where_the_specimen_is_let_go_or_stretched_again(rows, noise, sign):
    t, y = machine_record(20, 0.5, noise, start=0.0)
    share = np.clip((t - 50.0) * 20 / rows, 0.0, 1.0)
    for end, said in ((y * (1 - share), "falls off"), (y * (1 + share), "rises again")):
        found = fit_relaxation(t, sign * end)
        assert found.equilibrium == pytest.approx(sign * 6.3e3, rel=0.01)
        assert found.time[-1] == pytest.approx(47.5, abs=1.0)
        note = next(note for note in found.notes if said in note)
        assert f"{len(t) - np.searchsorted(t, 2.5 + found.time[-1] + 0.01)} rows" in note


def test_a_record_of_two_steps_tells_that_the_second_has_the_first_beneath():
    t, y = machine_record(20, 0.5, start=0.0)
    second = y + np.interp(t - 30.0, t, y - 200, left=0.0)
    first = fit_relaxation(t, second)
    assert first.instantaneous == pytest.approx(9e3, rel=0.01)
    later = fit_relaxation(t, second, begin=32.5)
    assert later.ramp == pytest.approx(0.5, rel=0.1)
    assert any("which goes on relaxing beneath it" in note for note in later.notes)
