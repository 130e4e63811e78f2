"""Contact laws: limits, crossing, derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.surrogates.contact_law import ContactLaw, choices, crossing_length

LAWS = [ContactLaw("square"), ContactLaw("hertz"), ContactLaw("pad"), ContactLaw("series", 1e-3)]
DEPTHS = np.geomspace(1e-9, 0.05, 60)


def formula(law: ContactLaw, s):
    """U₀ as it stands in the docstring, for complex depths too."""
    if law.name == "series":
        return s**3 / np.sqrt(1 + s / law.length)
    return {"square": 0.5 * s**2, "hertz": s**2.5, "pad": s**3}[law.name]


def test_all_laws_are_here():
    assert sorted(law.name for law in LAWS) == sorted(choices())


@pytest.mark.parametrize("law", LAWS, ids=choices())
def test_values_and_derivatives_are_those_of_the_formula(law):
    value, slope, curvature = law.energy(DEPTHS)
    h = 1e-30
    np.testing.assert_allclose(value, formula(law, DEPTHS), rtol=1e-14)
    np.testing.assert_allclose(slope, formula(law, DEPTHS + 1j * h).imag / h, rtol=1e-13)
    # the second by a complex step on the first, ½ s² (1 + …) at relative steps that leave no square behind
    up, down = law.energy(DEPTHS * (1 + 1e-4))[1], law.energy(DEPTHS * (1 - 1e-4))[1]
    np.testing.assert_allclose(curvature, (up - down) / (2e-4 * DEPTHS), rtol=1e-7)


@pytest.mark.parametrize("law", LAWS, ids=choices())
def test_the_logarithm_is_that_of_the_energy(law):
    value, slope, curvature = law.energy(DEPTHS)
    log, first, second = law.log(DEPTHS)
    np.testing.assert_allclose(np.exp(log), value, rtol=1e-13)
    np.testing.assert_allclose(first * value, slope, rtol=1e-13)
    np.testing.assert_allclose((second + first**2) * value, curvature, rtol=1e-12)


@pytest.mark.parametrize("law", LAWS, ids=choices())
def test_without_contact_there_is_exactly_nothing_and_first_touch_is_finite(law):
    for part in law.energy(np.array([[-1.0, -1e-300, 0.0]])):
        np.testing.assert_array_equal(part, np.zeros((1, 3)))
    tiny = np.array(law.energy(np.array([5e-324, 1e-300, 1e-150])))
    assert np.isfinite(tiny).all()
    assert (tiny[1] <= 1e-100).all()


def test_series_is_the_pad_first_and_the_half_space_in_the_end():
    a = 1e-3
    law = ContactLaw("series", a)
    shallow, deep = 1e-6 * a, 1e6 * a
    assert law.energy(np.array(shallow))[0] == pytest.approx(shallow**3, rel=1e-6)
    assert law.energy(np.array(deep))[0] == pytest.approx(np.sqrt(a) * deep**2.5, rel=1e-6)


def test_at_the_crossing_length_pad_and_half_space_store_the_same():
    E, k, R = 9e3 / (1 - 0.45**2), 2e6, 0.01
    a = crossing_length(E, k, R)
    # the pad's energy, ½ k p² over the disc that the sphere's paraboloid wets, by Gauss–Legendre in r²
    t, weights = np.polynomial.legendre.leggauss(4)
    q = R * a * (1 + t)  # r² from 0 to 2 R a
    pad = np.sum(weights * R * a * np.pi * 0.5 * k * (a - q / (2 * R)) ** 2)
    assert pad == pytest.approx(np.pi * k * R * a**3 / 3, rel=1e-12)
    assert pad == pytest.approx(8 / 15 * E * np.sqrt(R) * a**2.5, rel=1e-12)


def test_not_a_number_is_not_hidden():
    assert np.isnan(ContactLaw("pad").energy(np.array([np.nan]))).all()


@pytest.mark.parametrize(
    ("name", "length"),
    [("cube", np.inf), ("series", np.inf), ("series", 0.0), ("series", np.nan), ("pad", 1e-3), ("pad", -1.0)],
)
def test_laws_that_are_none_are_refused(name, length):
    with pytest.raises(UsageError, match=name):
        ContactLaw(name, length)


def test_there_is_no_logarithm_without_contact():
    with pytest.raises(UsageError, match="depth"):
        ContactLaw("pad").log(np.array([1e-3, 0.0]))


@pytest.mark.parametrize("values", [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, np.nan)])
def test_crossing_lengths_need_positive_numbers(values):
    with pytest.raises(UsageError, match="crossing"):
        crossing_length(*values)
