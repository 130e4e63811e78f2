"""Quantities of a test by the names that testing machines and loggers give their columns.

A name is split into words. One of them names the quantity; all others must be known to change nothing, or to state a
measure or a direction. So "Tensile strain (Strain 1)" is a strain, and "strain rate" is none.
"""

from __future__ import annotations

import functools
import re
from dataclasses import dataclass

__all__ = ["NamedQuantity", "named_quantity"]

_QUANTITIES = {
    "time": "time t zeit prüfzeit temps tiempo",
    "force": "force load f kraft standardkraft prüfkraft last charge fuerza carga",
    "depth": "depth indentation penetration eindringtiefe eindringung tiefe profondeur profundidad",
    "extension": "extension ext displacement displ disp elongation crosshead position travel deflection stroke way weg "
    "standardweg traversenweg prüfweg kolbenweg verformung verlängerung längenänderung allongement déplacement "
    "desplazamiento",
    "strain": "strain eps ε e dehnung stauchung déformation deformación",
    "stretch": "stretch lambda λ streckung étirement",
    "stress": "stress s spannung contrainte esfuerzo tensión sigma σ p pk1",
}
_BASES = {word: kind for kind, words in _QUANTITIES.items() for word in words.split()}
_COMPOUNDS = {  # a quantity and a direction in one word
    "druckkraft": "compressive force",
    "druckspannung": "compressive stress",
    "druckdehnung": "compressive strain",
    "stauchung": "compressive strain",
    "stauchweg": "compressive extension",
    "zugkraft": "tensile force",
    "zugspannung": "tensile stress",
    "zugdehnung": "tensile strain",
    "nennspannung": "nominal stress",
    "nenndehnung": "nominal strain",
    "sigma": "true stress",
    "σ": "true stress",
    "p": "nominal stress",
    "pk1": "nominal stress",
}
_DIRECTIONS = {"compressive": {"compressive", "compression", "compr"}, "tensile": {"tensile", "tension"}}
_MEASURES = {
    "nominal": {"nominal", "engineering", "eng", "technische", "piola"},
    "true": {"true", "cauchy", "wahre", "log", "logarithmic", "hencky", "logarithmische"},
}
_UNITS = {"n", "mn", "kn", "mm", "µm", "um", "m", "s", "ms", "sec", "pa", "kpa", "mpa", "pct", "percent", "%"}
_CHANGE_NOTHING = (
    "axial measured corrected machine cell channel sensor transducer standard actual elapsed test total uniaxial "
    "normal gauge extensometer crosshead traverse grip running run"
)
_KNOWN = frozenset(_CHANGE_NOTHING.split()).union(*_MEASURES.values(), *_DIRECTIONS.values())


@dataclass(frozen=True)
class NamedQuantity:
    """A quantity as a name states it.

    Attributes
    ----------
    kind : str
        time, force, depth, extension, strain, stretch or stress.
    measure : str
        "nominal" or "true" where the name states it, else "".
    direction : str
        "compressive" or "tensile" where the name states it, else "".
    """

    kind: str
    measure: str = ""
    direction: str = ""


@functools.cache
def named_quantity(name: str) -> NamedQuantity | None:
    """Return the quantity that a column's name states.

    Parameters
    ----------
    name : str
        Name without its unit, such as "Tensile strain (Strain 1)" or "Standardkraft".

    Returns
    -------
    NamedQuantity or None
        None where the name states none, or has words that are not known: "strain rate" is no strain.
    """
    text, inside = re.sub(r"[\s_\-–.,:/#]+", " ", name.casefold()), ""
    while match := re.search(r"\(([^()]*)\)", text):
        text, inside = text.replace(match[0], " "), f"{inside} {match[1]}"
    words = text.split()
    if len(words) > 1 and words[-1] in _UNITS:  # Force_N
        words.pop()
    if words == ["compression"]:
        words = ["compressive", "extension"]
    words = [part for word in words for part in _COMPOUNDS.get(word, word).split()]
    return _quantity_of(words, inside.split())


def _quantity_of(words: list[str], bracketed: list[str]) -> NamedQuantity | None:
    """Return the quantity of words; those in brackets tell a measure, such as (log), or a channel."""
    words = [word for word in words if not word.isdigit()]
    if "ratio" in words and {"stretch", "extension"} & set(words):
        words = ["stretch" if word == "extension" else word for word in words if word != "ratio"]
    for word in ("indentation", "crosshead"):  # indentation depth, crosshead travel
        if word in words and len(set(words) & _BASES.keys()) > 1:
            words = [other for other in words if other != word]
    bases = {_BASES[word] for word in words if word in _BASES}
    states = {word for word in words if word not in _BASES}
    measures, directions = (
        [name for name, synonyms in table.items() if synonyms & {*states, *bracketed}]
        for table in (_MEASURES, _DIRECTIONS)
    )
    if len(bases) != 1 or not states <= _KNOWN or len(measures) > 1 or len(directions) > 1:
        return None
    return NamedQuantity(bases.pop(), "".join(measures), "".join(directions))
