"""Choices for the regions of a part as they are typed: labels of a scan, and the material of each region.

read_labels       fat=1,gland=2
region_materials  fat=fat,gland=12 kPa,lump=5 kPa..30 kPa
RegionMaterial    a material by name, a Young's modulus, or a range of it that is set while the part is touched
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from palpate.errors import UsageError
from palpate.format import pressure
from palpate.number_text import whole_number
from palpate.physics.materials.library import MATERIALS, material_kind
from palpate.study.material_records import SolidMaterialRecord
from palpate.units import parse_quantity

__all__ = ["RegionMaterial", "material_texts", "read_labels", "region_materials"]

TO = ".."  # between the ends of a range
LAW = "neo-hookean"


@dataclass(frozen=True)
class RegionMaterial:
    """The material of a region as a study's tables have it, and the range in which its Young's modulus varies."""

    table: str | dict[str, Any]
    varied: dict[str, Any] | None = None

    @classmethod
    def of_text(cls, region: str, text: str, poisson: float) -> RegionMaterial:
        """Return the material of a text: a name of the library, ``12 kPa``, or ``5 kPa..30 kPa``.

        The latter two are neo-Hookean, with this Poisson's ratio.
        """
        text = text.strip()
        if text.lower() in MATERIALS:
            return cls(text.lower())
        if not text[:1].isdigit():
            raise UsageError(
                f"The material of {region!r} is {text!r}, which is neither a name nor a Young's modulus.",
                why=f"Materials are {', '.join(MATERIALS)}.",
                fix="Give one of these, a number such as 12 kPa, or a range such as 5 kPa..30 kPa.",
            )
        ends = [
            parse_quantity(end, "Pa", f"The Young's modulus of {region!r}", bare=False)
            for end in text.split(TO)
        ]
        if len(ends) > 2 or not all(end > 0 for end in ends) or ends != sorted(set(ends)):
            raise UsageError(
                f"The Young's modulus of {region!r} is {text!r}.",
                why="It is above 0, and the end of a range above its beginning.",
                fix="Give a number such as 12 kPa, or a range such as 5 kPa..30 kPa.",
            )
        young = float(f"{math.sqrt(ends[0] * ends[-1]):.3g}")
        varied = {"path": f"{region}.young", "low": ends[0], "high": ends[1]} if len(ends) == 2 else None
        return cls({"law": LAW, "young": young, "poisson": poisson, "name": region}, varied)


def read_labels(text: str | None) -> dict[str, int]:
    """Return the names and numbers of labels of a text such as ``fat=1,gland=2``; none of None."""
    labels: dict[str, int] = {}
    for name, value in _pairs(text, "--labels", "fat=1,gland=2"):
        try:
            labels[name] = whole_number(value)
        except UsageError as error:
            raise UsageError(f"--labels: {error.what}", why=error.why, fix="Write fat=1,gland=2.") from error
    return labels


def region_materials(text: str | None, regions: Iterable[str], poisson: float) -> dict[str, RegionMaterial]:
    """Return the materials of a text such as ``fat=fat,gland=12 kPa,lump=5 kPa..30 kPa``, by region.

    A region that the text does not name, and that is called like a tissue of the library, is made of that tissue.
    """
    known = tuple(regions)
    materials = {
        name: RegionMaterial(name.lower())
        for name in known
        if name.lower() in MATERIALS and material_kind(name.lower()) == "tissue"
    }
    for name, value in _pairs(text, "--materials", "fat=fat,gland=12 kPa"):
        if name not in known:
            raise UsageError(
                f"--materials: there is no region {name!r}.",
                why=f"The part's regions are {', '.join(known)}.",
                fix="Name one of these.",
            )
        materials[name] = RegionMaterial.of_text(name, value, poisson)
    return materials


def material_texts(
    materials: Mapping[str, Any], varied: Iterable[Any], regions: Iterable[str]
) -> dict[str, str]:
    """Return the texts that say the materials of a study's regions; "" of one that has no material of its own."""
    ranges = {entry.path: f"{pressure(entry.low)}{TO}{pressure(entry.high)}" for entry in varied}
    texts = {}
    for region in regions:
        own = materials.get(region, "")
        if isinstance(own, SolidMaterialRecord):
            plain = own.law == LAW and own.young is not None
            own = pressure(own.young) if plain and own.young is not None else own.name
        texts[region] = ranges.get(f"{region}.young", own)
    return texts


def _pairs(text: str | None, flag: str, example: str) -> Iterator[tuple[str, str]]:
    """Yield name and value of each part of a text of ``name=value`` between commas."""
    seen: set[str] = set()
    for part in filter(None, (part.strip() for part in (text or "").split(","))):
        name, equals, value = (side.strip() for side in part.partition("="))
        if not (name and equals and value) or name in seen:
            why = f"{name!r} is named twice." if name in seen else f"{part!r} is no name with a value."
            raise UsageError(f"{flag} can't be read.", why=why, fix=f"Write {flag} '{example}'.")
        seen.add(name)
        yield name, value
