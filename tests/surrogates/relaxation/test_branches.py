"""Shares and times: what is sound, what they say of a held force."""

from __future__ import annotations

import numpy as np
import pytest
from relaxing import TERMS

from palpate.errors import UsageError
from palpate.surrogates.memories import Relaxation


def test_a_held_force_falls_by_the_series():
    time = np.array([0.0, 0.05, 1.0, 1e9])
    expected = 0.5 + 0.3 * np.exp(-time / 0.1) + 0.2 * np.exp(-time / 2.0)
    np.testing.assert_allclose(Relaxation(TERMS).relaxation(time), expected, rtol=1e-14)


def test_without_branches_nothing_relaxes():
    assert (Relaxation(()).relaxation([0.0, 1.0, 1e9]) == 1).all()


def test_a_pad_takes_the_larger_share_of_light_touches():
    shares = Relaxation(TERMS, pad=1e-4).body_share([0.0, 1e-6, 1e-4, 1e-2, 1e40])
    assert (np.diff(shares) > 0).all()
    assert shares[0] == 0
    assert shares[2] == pytest.approx(0.5)
    assert shares[4] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(
    "terms", [((0.6, 1.0), (0.4, 2.0)), ((-0.1, 1.0),), ((0.1, 0.0),), ((np.nan, 1.0),), (0.1,), ("ab",)]
)
def test_unsound_branches_are_refused(terms):
    with pytest.raises(UsageError):
        Relaxation(terms)


def test_a_negative_pad_is_refused():
    with pytest.raises(UsageError, match="pad"):
        Relaxation(TERMS, pad=-1.0)
