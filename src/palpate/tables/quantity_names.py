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
    "extension": "extension displacement elongation crosshead position travel deflection stroke way weg standardweg "
    "traversenweg prüfweg kolbenweg verformung verlängerung längenänderung allongement déplacement desplazamiento",
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
    "compression": "compressive extension",
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
_COMPRESSIVE = {"compressive", "compression", "compr"}
_TENSILE = {"tensile", "tension"}
_NOMINAL = {"nominal", "engineering", "eng", "technische", "piola"}
_TRUE = {"true", "cauchy", "wahre", "log", "logarithmic", "hencky", "logarithmische"}
_NEUTRAL = {
    "axial",
    "measured",
    "corrected",
    "machine",
    "cell",
    "channel",
    "sensor",
    "transducer",
    "standard",
    "actual",
}
_NEUTRAL |= {
    "ratio",
    "elapsed",
    "test",
    "total",
    "uniaxial",
    "normal",
    "gauge",
    "extensometer",
    "crosshead",
    "value",
}
_NEUTRAL |= {"traverse", "grip", "running", "run", "x", "of", "the"}


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
    text = re.sub(r"[\s_\-–.,:/#]+", " ", name.casefold())
    inside = re.findall(r"\(([^()]*)\)", text)
    words = re.sub(r"\([^()]*\)", " ", text).split()
    words = [part for word in words for part in _COMPOUNDS.get(word, word).split()] if words else []
    return _quantity_of(words, [word for part in inside for word in part.split()])


def _quantity_of(words: list[str], bracketed: list[str]) -> NamedQuantity | None:
    """Return the quantity of words; those in brackets tell a measure, such as (log), or a channel."""
    words = [word for word in words if not word.isdigit()]
    if words[:1] and words[0] == "extension" and "ratio" in words:
        words = ["stretch", *(word for word in words[1:] if word != "ratio")]
    if "indentation" in words and len(set(words) & _BASES.keys()) > 1:  # indentation depth, indentation force
        words = [word for word in words if word != "indentation"]
    if "crosshead" in words and len(set(words) & _BASES.keys()) > 1:
        words = [word for word in words if word != "crosshead"]
    bases = [_BASES[word] for word in words if word in _BASES]
    states = {word for word in words if word not in _BASES}
    measures = [m for m, known in (("nominal", _NOMINAL), ("true", _TRUE)) if known & {*states, *bracketed}]
    directions = [d for d, known in (("compressive", _COMPRESSIVE), ("tensile", _TENSILE)) if known & states]
    known = _COMPRESSIVE | _TENSILE | _NOMINAL | _TRUE | _NEUTRAL
    if len(set(bases)) != 1 or not states <= known or len(measures) > 1 or len(directions) > 1:
        return None
    return NamedQuantity(bases[0], "".join(measures), "".join(directions))
