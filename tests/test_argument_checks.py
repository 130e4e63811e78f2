"""Checks of arguments: right values come back plain, wrong ones are refused with what, why and fix."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from palpate import checks
from palpate.errors import UsageError


def refusal(check, *args, **options) -> UsageError:
    with pytest.raises(UsageError) as caught:
        check(*args, **options)
    error = caught.value
    assert error.what.endswith(".")
    assert error.why.endswith(".")
    assert error.fix.endswith((".", "?"))
    return error


@pytest.mark.parametrize("value", [3, 3.0, np.float32(3), np.int64(3), Fraction(3)])
def test_numbers_of_every_kind_come_back_as_floats(value):
    for check in (checks.finite, checks.positive):
        assert type(check("The radius", value, "m")) is float
    assert checks.fits("The ratio", value, above=-1, most=3) == 3.0


@pytest.mark.parametrize("check", [checks.finite, checks.positive, checks.fits])
@pytest.mark.parametrize("value", ["5 N", None, 1j, [1.0]])
def test_what_is_no_number_is_refused_with_its_type_and_unit(check, value):
    error = refusal(check, "The force", value, "N")
    assert type(value).__name__ in error.what
    assert "number in N" in error.why


@pytest.mark.parametrize("value", [math.inf, -math.inf, math.nan])
def test_what_is_not_finite_is_refused(value):
    assert "must be finite" in refusal(checks.finite, "The force", value, "N").why
    assert "positive and finite" in refusal(checks.positive, "The force", value, "N").why
    refusal(checks.fits, "The force", value, "N", least=0)


def test_positive_takes_infinity_only_where_it_may():
    assert checks.positive("The stop", math.inf, "m", infinite=True) == math.inf
    assert refusal(checks.positive, "The stop", -0.5, "m", infinite=True).what == "The stop is -0.5 m."
    refusal(checks.positive, "The stop", 0.0, "m")
    refusal(checks.positive, "The stop", math.nan, "m", infinite=True)


def test_bounds_are_met_or_not():
    assert checks.fits("The ratio", 0.5, least=0.5, most=0.5) == 0.5
    error = refusal(checks.fits, "Poisson's ratio", -1, above=-1, most=0.5)
    assert error.what == "Poisson's ratio is -1."
    assert error.why == "It must be above -1 and at most 0.5."
    refusal(checks.fits, "The share", 1.0, below=1.0)
    refusal(checks.fits, "The share", -0.1, least=0.0)
    refusal(checks.fits, "The share", 0.1, most=0.0)


def test_whole_numbers():
    count = checks.fits("The seed", np.int64(4), least=0, whole=True)
    assert count == 4
    assert type(count) is int
    for value in (2.0, True, "2", None, -1):
        error = refusal(checks.fits, "The seed", value, least=0, whole=True)
        assert error.why == "It must be a whole number, at least 0."


def test_the_nearest_choice_is_offered():
    assert checks.one_of("The form", "mixed", ("mixed", "displacement")) == "mixed"
    assert (
        refusal(checks.one_of, "The form", "Mixt", ("mixed", "displacement")).fix == "Did you mean 'mixed'?"
    )
    assert "'mixed'" in refusal(checks.one_of, "The form", 7, ("mixed", "displacement")).why


def test_arrays_of_the_wanted_shape_come_back_in_double_precision():
    array = np.ones((4, 3))
    assert checks.shape("The table", array, (None, 3)) is array
    assert checks.shape("The point", (1, 2, 3), (3,)).dtype == np.float64
    assert np.isinf(checks.shape("The table", [[math.inf]], (1, 1), infinite=True))


@pytest.mark.parametrize("value", [np.ones(3), np.ones((0, 3)), np.ones((4, 2)), 1.0])
def test_other_shapes_are_refused(value):
    error = refusal(checks.shape, "The table", value, (None, 3), "m", why="Each row is a point.")
    assert "(any, 3) is needed" in error.what
    assert error.fix.endswith("in m.")


@pytest.mark.parametrize("value", ["abc", [[1, 2, "x"]], [[1, 2], [3]], np.array([[1j, 0, 0]]), [[None] * 3]])
def test_arrays_of_anything_but_numbers_are_refused(value):
    assert (
        "real numbers"
        in refusal(checks.shape, "The table", value, (None, 3), why="Each row is a point.").what
    )


def test_the_first_number_that_is_not_finite_is_named():
    table = np.ones((3, 3))
    table[1, 2] = math.nan
    assert "nan at index (1, 2)" in refusal(checks.shape, "The table", table, (3, 3)).what
    assert "inf at index 1" in refusal(checks.shape, "The point", [0, math.inf], (2,)).what


def test_three_numbers_come_back_as_a_tuple():
    assert checks.triple("The place", np.array([1, 2, 3]), "m") == (1.0, 2.0, 3.0)
    assert "three numbers" in refusal(checks.triple, "The place", (1, 2), "m").why
    assert "of type str" in refusal(checks.triple, "The place", ("100 mm", 0.1, 0.1), "m").why
    refusal(checks.triple, "The place", (0, 0, math.nan), "m")
    refusal(checks.triple, "The place", None, "m")
