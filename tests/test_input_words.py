"""Inputs in words: what a page, a card and a report call a symbol of the mathematics."""

from __future__ import annotations

import pytest

from palpate.input_words import input_in_words


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("p_x", "pad's place along x"),
        ("tip_z", "tool's foremost point along z"),
        ("d_z", "pad moved along z"),
        ("finger d_z", "pad moved along z (finger)"),
        ("c_y_2", "ball's centre along y"),
        ("P", "force"),
        ("P_y", "force along y"),
        ("P_0.4m", "force at 0.4\N{NO-BREAK SPACE}m"),
        ("P_max", "largest force so far"),
        ("h", "displacement"),
        ("h along P", "displacement along the force"),
        ("h along tip load", "displacement along the tip load"),
        ("probe.radius", "radius of the ball"),
        ("skin.young", "Young's modulus of skin"),
        ("firmness", "firmness"),
        ("tip load", "tip load"),
    ],
)
def test_a_symbol_has_words_and_words_stay(name, words):
    assert input_in_words(name) == words
