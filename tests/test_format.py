"""Figures as text: nothing of them is lost but digits."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.format import (
    bind_units,
    bound,
    count,
    criterion_figure,
    duration,
    interval,
    length,
    plain,
    power_of_ten,
    pressure,
    scientific,
    script_json,
    share,
    summary_figure,
    with_interval,
)
from palpate.units import Range

LOWERED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
UNITS = {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "nm": 1e-9}


def number(text: str) -> float:
    mantissa, _, exponent = text.partition(" × 10")
    return float(mantissa) * 10.0 ** int(exponent.translate(LOWERED) or 0)


@given(st.floats(1e-9, 1e9), st.floats(1e-9, 1.0))
def test_the_ends_of_an_interval_are_told_apart(value: float, share_of_it: float) -> None:
    low, high = value * (1 - share_of_it / 2), value * (1 + share_of_it / 2)
    middle, ends = with_interval(value, low, high).removesuffix(")").split(" (")
    for text, end in zip(ends.split(" to "), (low, high), strict=True):
        assert abs(float(text) - end) <= 0.06 * (high - low)
    assert float(middle) == pytest.approx(value, abs=0.06 * (high - low))
    if value < 1e5:
        assert "e+" not in middle + ends


def test_an_interval_without_ends_is_told_too() -> None:
    assert with_interval(10e3, 10e3, 10e3) == "10000 (10000 to 10000)"
    assert "inf" in with_interval(2.0, 0.0, float("inf"))


@given(st.floats(1e-12, 1e12), st.sampled_from([-1.0, 1.0]))
def test_numbers_read_back_within_their_digits(size: float, sign: float) -> None:
    value = sign * size
    assert number(plain(value)) == pytest.approx(value, rel=0.0501)
    assert number(scientific(value)) == pytest.approx(value, rel=0.0501)


@given(st.floats(1.0, 1e13))
def test_moduli_read_back_and_stay_short(pascals: float) -> None:
    text, unit = pressure(pascals).rsplit(" ", 1)
    assert number(text) * {"GPa": 1e9, "MPa": 1e6, "kPa": 1e3, "Pa": 1.0}[unit] == pytest.approx(
        pascals, rel=0.00501
    )


@given(st.floats(1e-9, 1e3))
def test_lengths_read_back_and_stay_short(metres: float) -> None:
    text, unit = length(metres).rsplit(" ", 1)
    assert number(text) * UNITS[unit] == pytest.approx(metres, rel=0.00501)
    assert len(text) <= 5


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (interval(Range("c_z", 0.0426531, 0.0498, "m")), "c_z 42.7 … 49.8 mm"),
        (interval(Range("x", 0.5, 2.0, "m")), "x 0.5 … 2 m"),
        (interval(Range("young", 4e3, 12e3, "Pa")), "young 4000 … 12000 Pa"),
        (length(0.0), "0 m"),
        (length(9.9999e-4), "1 mm"),
        (length(3.5e-4), "350 µm"),
        (length(1e-12), "0.001 nm"),
        (share(0.07), "7 %"),
        (duration(0.05), "50 ms"),
        (duration(7.55), "7.5 s"),
        (duration(240), "4 min"),
        (plain(float("nan")), "not a number"),
        (plain(float("-inf")), "infinite"),
        (count(1, "unit"), "1 unit"),
        (count(1255, "unit"), "1,255 units"),
        (count(2, "pass", "passes"), "2 passes"),
        (criterion_figure(2e-7, "scale"), "2.0 × 10⁻⁷"),
        (criterion_figure(4.5e-3, "degrees"), "0.0045°"),
        (criterion_figure(2.0, "times"), "2 ×"),
    ],
)
def test_examples(text: str, wanted: str) -> None:
    assert text == wanted


def test_powers_of_ten_on_an_axis() -> None:
    assert [power_of_ten(10.0**k) for k in (-12, -1, 0, 1, 2)] == ["10⁻¹²", "10⁻¹", "1", "10", "10²"]


def test_numbers_stay_with_their_units() -> None:
    space = "\N{NO-BREAK SPACE}"
    assert bind_units("P = -1.5 N at 0.4 m") == f"P{space}={space}−1.5{space}N at 0.4{space}m"
    assert bind_units("3.4 × 10⁻⁷ %") == f"3.4{space}×{space}10⁻⁷{space}%"
    assert bind_units("beam-3 and 5 men") == "beam-3 and 5 men"


def test_figures_of_a_record_are_written_as_the_table_of_limits_writes_them() -> None:
    assert summary_figure("displacement RMSE / full scale", 3.69e-7) == "3.7 × 10⁻⁷"
    assert summary_figure("force error, 95th percentile", 0.0123) == "1.2 %"
    assert summary_figure("unseen solves", 101) == 101
    assert summary_figure("limits kept", True) is True


@pytest.mark.full
@given(
    st.recursive(st.none() | st.floats(allow_nan=False) | st.text(), lambda v: st.dictionaries(st.text(), v))
)
def test_json_in_a_script_is_the_same_value_without_marks(value):
    text = script_json(json.dumps(value, ensure_ascii=False))
    assert json.loads(text) == value
    assert not set("<>&\u2028\u2029") & set(text)


@given(st.floats(1e-9, 1e9), st.integers(1, 5))
def test_a_bound_keeps_to_its_side_and_near(value, digits):
    most, least = bound(value, digits), bound(value, digits, least=True)
    assert most <= value * (1 + 1e-8)
    assert least >= value * (1 - 1e-8)
    assert least - most <= 1.1 * 10.0 ** (1 - digits) * value


def test_a_bound_that_has_few_digits_stays():
    assert [bound(v) for v in (0.0005, 0.02, 1.5, 1.544)] == [0.0005, 0.02, 1.5, 1.5]
    assert [bound(v, least=True) for v in (0.0015, 1.544)] == [0.0015, 1.6]
