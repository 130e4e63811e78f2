"""Units of files and tables become SI units by one conversion."""

from __future__ import annotations

import math

import pytest

from palpate.errors import UsageError
from palpate.tables.unit_names import si_unit
from palpate.unit_text import si_conversion

TURN = 2 * math.pi


@pytest.mark.parametrize(
    ("unit", "expected"),
    [
        ("mm", (1e-3, 0.0, "m")),
        ("µm", (1e-6, 0.0, "m")),
        ("μm", (1e-6, 0.0, "m")),
        ("N/m^2", (1.0, 0.0, "Pa")),
        ("N/mm²", (1e6, 0.0, "Pa")),
        ("mJ", (1e-3, 0.0, "J")),
        ("degC", (1.0, 273.15, "K")),
        ("°C", (1.0, 273.15, "K")),
        ("°F", (5 / 9, 273.15 - 32 * 5 / 9, "K")),
        ("rpm", (TURN / 60, 0.0, "rad/s")),
        ("rev", (TURN, 0.0, "rad")),
        ("cycles", (TURN, 0.0, "rad")),
        ("°", (TURN / 360, 0.0, "rad")),
        ("kN", (1e3, 0.0, "N")),
        ("mPa·s", (1e-3, 0.0, "Pa s")),
        ("1/mm", (1e3, 0.0, "1/m")),
        ("%", (0.01, 0.0, "")),
        ("1", (1.0, 0.0, "")),
        ("", (1.0, 0.0, "")),
    ],
)
def test_units_become_si(unit, expected):
    for convert in (si_conversion, si_unit):  # of any text, and of what stands in the head of a table
        factor, offset, name = convert(unit)
        assert (factor, offset) == (pytest.approx(expected[0], rel=1e-12), pytest.approx(expected[1]))
        if convert is si_conversion or (factor, offset) != (1.0, 0.0):
            assert name == expected[2]


@pytest.mark.parametrize(("unit", "name"), [("N m", "N m"), ("N·mm", "N m"), ("J", "J"), ("1/s", "1/s")])
def test_the_head_of_a_table_keeps_moments_apart_from_energies(unit, name):
    assert si_unit(unit)[2] == name


def test_what_is_no_unit_is_refused():
    for convert in (si_conversion, si_unit):
        for text in ("furlong/", "m/0", "(m"):
            with pytest.raises(UsageError, match="is no unit that is known"):
                convert(text)
    with pytest.raises(UsageError, match="Celsius or coulombs"):
        si_unit("C")
