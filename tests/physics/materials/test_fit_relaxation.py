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
