"""Words for inputs whose names are symbols of the mathematics, as pages, cards and reports show them."""

from __future__ import annotations

import re

__all__ = ["input_in_words"]

_PLACE = re.compile(r"(?:(?P<owner>.+) )?(?P<symbol>[cdp])_(?P<axis>[xyz])(?:_\d+)?")
# what moves along an axis, by the symbol of its coordinate
_MOVING = {"c": "ball's centre along {}", "d": "pad moved along {}", "p": "pad's place along {}"}
_ALONG = "h along "  # displacement of what is held, in the direction of a load
_PROPERTIES = {"young": "Young's modulus", "poisson": "Poisson's ratio"}


def input_in_words(name: str, unit: str = "") -> str:
    """Return an input in words that a person reads; a name that is no symbol is its own words.

    Parameters
    ----------
    name : str
        Name of the input, such as ``"p_x"``, ``"h along P"``, ``"probe.radius"`` or ``"tip load"``.
    unit : str
        SI unit of the input.

    Returns
    -------
    str
        For example ``"pad's place along x"``.
    """
    if name == "h":
        return "displacement"
    if place := _PLACE.fullmatch(name):
        words = _MOVING[place["symbol"]].format(place["axis"])
        return f"{words} ({place['owner']})" if place["owner"] else words
    if name.startswith(_ALONG):
        return f"displacement along the {input_in_words(name.removeprefix(_ALONG), 'N')}"
    if "." in name:
        owner, _, quantity = name.rpartition(".")
        return f"{_PROPERTIES.get(quantity, quantity)} of the {owner.replace('.', ' ')}"
    return f"force {name}" if unit == "N" and len(name.partition("_")[0]) == 1 else name
