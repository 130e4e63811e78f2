"""Words for inputs whose names are symbols of the mathematics, as pages, cards and reports show them."""

from __future__ import annotations

import re

__all__ = ["input_in_words"]

_WORDS = (
    (r"c_([xyz])(_\d+)?", r"ball's centre along \1"),
    (r"d_([xyz])(_\d+)?", r"pad moved along \1"),
    (r"p_([xyz])(_\d+)?", r"pad's place along \1"),
    (r"tip_([xyz])(_\d+)?", r"tool's foremost point along \1"),
    (r"tip_r([xyz])(_\d+)?", r"tool's turn about \1"),
    (r"grip_([xyz])(_\d+)?", r"middle between the jaws along \1"),
    (r"grip_opening(_\d+)?", "opening of the jaws"),
    (r"P", "force"),
    (r"P_([xyz])", r"force along \1"),
    (r"P_([\d.]+)m", "force at \\1\N{NO-BREAK SPACE}m"),
    (r"P_max", "largest force so far"),
    (r"P_held", "time for which the force was held"),
    (r"[hw]", "displacement"),
    (r"probe\.radius", "radius of the ball"),
    (r"(.+)\.young", r"Young's modulus of \1"),
    (r"(.+)\.poisson", r"Poisson's ratio of \1"),
    (r"(.+)\.thickness", r"thickness of \1"),
)
"""Patterns of the names that palpate gives by itself, and their words."""
_ALONG = "h along "  # displacement of what is held, in the direction of a load


def input_in_words(name: str) -> str:
    """Return an input in words that a person reads, such as "pad's place along x" for ``p_x``.

    A name that is no symbol is its own words.
    """
    if name.startswith(_ALONG):
        return f"displacement along the {input_in_words(name.removeprefix(_ALONG))}"
    owner, _, own = name.rpartition(" ")  # of several pads each has its name before its inputs
    for pattern, words in _WORDS:
        if match := re.fullmatch(pattern, own):
            return match.expand(words) + (f" ({owner})" if owner else "")
    return name
