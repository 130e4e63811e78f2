"""A text that means a quantity gives the number that it says, or is refused with a sentence."""

from __future__ import annotations

import math
import re
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.errors import UsageError
from palpate.number_text import number_list, whole_number
from palpate.units import parse_quantity

TO_SI = {
    "m": Fraction(1),
    "mm": Fraction(1, 1000),
    "µm": Fraction(1, 10**6),
    "μm": Fraction(1, 10**6),
    "cm": Fraction(1, 100),
    "km": Fraction(1000),
    "in": Fraction(254, 10000),
    "ft": Fraction(3048, 10000),
}


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("10,5kPa", "Pa", 10.5e3),
        ("3,5mm", "m", 3.5e-3),
        ("2,5 N", "N", 2.5),
        ("0,5 mm", "m", 0.5e-3),
        ("0,125 mm", "m", 0.125e-3),
        ("1 000 mm", "m", 1.0),
        ("1\u202f000\u00a0mm", "m", 1.0),
        ("1'000 mm", "m", 1.0),
        ("1.000,5 mm", "m", 1.0005),
        ("1,000.5 mm", "m", 1.0005),
        ("1.234 mm", "m", 1.234e-3),
        ("1,234e3 mm", "m", 1.234),
        ("−5 mm", "m", -5e-3),
        ("- 5 mm", "m", -5e-3),
        ("+5 mm", "m", 5e-3),
        (".5 mm", "m", 0.5e-3),
        ("5. mm", "m", 5e-3),
        ("1e-3 m", "m", 1e-3),
        ("1E3 Pa", "Pa", 1e3),
        ("2.50\u00a0×\u00a010⁻⁸ m", "m", 2.5e-8),  # as palpate prints it
        ("0.12 mm", "m", 0.00012),
        ("10 kpa", "Pa", 1e4),
        ("10 KPA", "Pa", 1e4),
        ("10 mPa", "Pa", 0.01),
        ("10 MPa", "Pa", 1e7),
        ("5 CM", "m", 0.05),
        ("5mm2", "m^2", 5e-6),
        ("5 mm²", "m^2", 5e-6),
        ("5 mm**2", "m^2", 5e-6),
        ("5 N/mm2", "Pa", 5e6),
        ("5 N·mm⁻²", "Pa", 5e6),
        ("5 g/cm³", "kg/m^3", 5e3),
        ("2 N/mm^3", "N/m^3", 2e9),
        ("7 s-1", None, 7.0),
        ("7 1/s", None, 7.0),
        ("5 J/(kg K)", None, 5.0),
        ("2 kPa", None, 2e3),
        ("20 °C", None, 293.15),
        (" 0.3 ", None, 0.3),
        ("50 %", None, 0.5),
        ("50 %", "", 0.5),
        ("0,45", "", 0.45),
        ("0e999999999 m", "m", 0.0),
        (3, "m", 3.0),
    ],
)
def test_a_text_gives_the_number_that_it_says(text, unit, value):
    assert parse_quantity(text, unit) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("10", "'10' has no unit"),
        ("1,234 mm", "1,234 may be 1.234 or 1234"),
        ("1 00 mm", "make no number"),
        ("1.2.3 mm", "make no number"),
        ("∞ m", "infinity"),
        ("５ mm", "fullwidth digit five"),
        ("٥ mm", "arabic-indic digit five"),
        ("½ mm", "one half"),
        ("–5 mm", "en dash"),
        ("1_000 mm", "'_000 mm' does not belong to a unit"),
        ("0x10 mm", "no unit 'x10 mm'"),
        ("5, mm", "does not belong to a unit"),
        ("5 mm 3", "'3' does not belong to a unit"),
        ("5-6 mm", "does not belong to a unit"),
        ("5 mm or so", "There is no unit"),
        ("5 mm\u200b", "does not belong to a unit"),
        ("5 mm/s", "is a unit of something else"),
        ("5 rad", "is a unit of something else"),
        ("5 MM", '\'MM\' may mean "Mm" or "mm"'),
        ("5 N m/kg m", "not clear"),
        ("5 (mm", "There is no unit"),
        ("5 %%", "in % once"),
        ("5 mm" + "m" * 100, "too many characters"),
        ("9" * 5000 + " mm", "5003 characters"),
        ("1e400 m", "too large"),
        ("1e999999999 m", "too large"),
        ("1e-400 m", "too small"),
        ("1e308 km", "beyond"),
        ("nan m", "finite"),
        ("-inf m", "finite"),
        ("", "missing"),
        ("mm", "no number"),
        (math.nan, "no finite number"),
        (True, "no finite number"),
        (None, "no finite number"),
        ("m ²", "no number"),
        ("5 N/0", "does not belong"),
        ("5 m**1e9**1e9", "There is no unit"),
        ("5 " + "(" * 50, "There is no unit"),
    ],
)
def test_what_says_no_number_is_refused_by_name(text, words):
    with pytest.raises(UsageError) as refusal:
        parse_quantity(text, "m", "--depth")
    assert words in str(refusal.value)
    assert str(refusal.value).startswith("--depth: ")


@pytest.mark.parametrize("text", ["10 mpa", "10 MPA", "10 Mpa"])
def test_the_case_of_a_prefix_is_never_guessed(text):
    with pytest.raises(UsageError, match=r"may mean .*mPa.*MPa|may mean .*MPa.*mPa"):
        parse_quantity(text, "Pa")


def test_a_missing_unit_is_asked_for_with_an_example():
    with pytest.raises(UsageError) as refusal:
        parse_quantity("10", "Pa", "--young")
    assert str(refusal.value) == "--young: '10' has no unit.\nWrite it with its unit, for example \"10 kPa\"."
    assert parse_quantity("10", "Pa", bare=True) == 10.0
    assert parse_quantity("10 kPa", "Pa", bare=True) == 1e4


def test_of_any_dimension_the_spelling_is_told_and_not_guessed():
    with pytest.raises(UsageError, match='Did you mean "kPa"'):
        parse_quantity("2 KPA", None)


def test_whole_numbers_and_lists_of_numbers():
    assert whole_number("1'000") == 1000
    assert whole_number("12345678901234567891") == 12345678901234567891
    for text in ("1_0", "1,5", "40 mm", "1,000", ""):
        with pytest.raises(UsageError):
            whole_number(text)
    assert number_list("0.1,0.2,0.3") == ["0.1", "0.2", "0.3"]
    assert number_list("0,5 0,3") == number_list("0,5, 0,3") == ["0,5", "0,3"]
    assert number_list("1  2") == ["1", "2"]


def read(text: str) -> float | UsageError:
    """Return a length, or why the text is none."""
    try:
        return parse_quantity(text, "m")
    except UsageError as refusal:
        return refusal


MARKS = st.sampled_from(["", "-", "−", "+", "- "])
DIGITS = st.text("0123456789", min_size=1, max_size=9)
DECIMAL = st.sampled_from([".", ","])
POWERS = st.sampled_from(["", "e3", "E-2", "e+05", " × 10⁻⁶"])


@given(
    MARKS,
    DIGITS,
    DECIMAL,
    DIGITS,
    POWERS,
    st.sampled_from(["", " ", "\u00a0"]),
    st.sampled_from(sorted(TO_SI)),
)
def test_digits_in_any_spelling_are_that_number(sign, whole, mark, fraction, power, blank, unit):
    text = f"{sign}{whole}{mark}{fraction}{power}{blank}{unit}"
    exponent = int(power.strip("eE ").replace("× 10⁻⁶", "-6") or 0)
    number = Fraction(f"{whole}.{fraction}") * Fraction(10) ** exponent
    expected = number * TO_SI[unit] * (-1 if "-" in sign or "−" in sign else 1)
    is_unclear = mark == "," and len(fraction) == 3 and len(whole) <= 3 and whole[0] != "0" and not power
    value = read(text)
    if is_unclear:
        assert "may be" in str(value), text
    else:
        assert value == pytest.approx(float(expected), rel=1e-15), text


@given(
    st.lists(DIGITS, min_size=1, max_size=4),
    st.sampled_from([" ", "'", ",", ".", "\u202f"]),
    st.sampled_from(sorted(TO_SI)),
)
def test_groups_are_thousands_or_refused(groups, mark, unit):
    value = read(f"{mark.join(groups)} {unit}")
    if isinstance(value, UsageError):
        assert len(groups) > 1
        return
    is_decimal = len(groups) == 2 and mark in ".,"
    said = Fraction(".".join(groups)) if is_decimal else Fraction("".join(groups))
    assert value == pytest.approx(float(said * TO_SI[unit]), rel=1e-15)


LETTERS = st.text("0123456789.,' -+−eE_x∞½５²mkMKµNPas/*^()%°\u00a0\t", max_size=12)


@given(LETTERS)
def test_no_text_gives_a_number_that_differs_from_what_it_says(text):
    value = read(text)
    plain = re.fullmatch(r"(-?[0-9]+(?:\.[0-9]*)?) (m|mm|km)", text)
    if isinstance(value, UsageError):
        assert value.what
        assert plain is None
        return
    assert math.isfinite(value)
    assert (value < 0) <= (text.strip()[0] in "-−")
    if plain:
        assert value == pytest.approx(float(Fraction(plain[1]) * TO_SI[plain[2]]), rel=1e-15)
    # without powers, the number has the digits that stand there, in their order, and no others
    simple = re.fullmatch(r"[-+−0-9.,' \u00a0\t]+([a-zµ]+)\s*", text)
    if simple and simple[1] in TO_SI:
        digits = f"{float(Fraction(abs(value)) / TO_SI[simple[1]]):.14e}".partition("e")[0]
        assert re.sub("[^0-9]", "", digits).strip("0") == re.sub("[^0-9]", "", text).strip("0")
