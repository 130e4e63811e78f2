"""Inputs in words: what a page, a card and a report call a symbol of the mathematics."""

from __future__ import annotations

import pytest

from palpate.input_words import input_in_words


@pytest.mark.parametrize(
    ("name", "unit", "words"),
    [
        ("p_x", "m", "pad's place along x"),
        ("d_z", "m", "pad moved along z"),
        ("finger d_z", "m", "pad moved along z (finger)"),
        ("c_y", "m", "ball's centre along y"),
        ("c_y_2", "m", "ball's centre along y"),
        ("P", "N", "force P"),
        ("P_y", "N", "force P_y"),
        ("h", "m", "displacement"),
        ("h along P", "m", "displacement along the force P"),
        ("h along tip load", "m", "displacement along the tip load"),
        ("probe.radius", "m", "radius of the probe"),
        ("skin.young", "Pa", "Young's modulus of the skin"),
        ("firmness", "", "firmness"),
        ("tip load", "N", "tip load"),
    ],
)
def test_a_symbol_has_words_and_words_stay(name, unit, words):
    assert input_in_words(name, unit) == words
