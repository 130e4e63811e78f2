"""Numbers of a body, and of the probe that presses it, that are inputs: one sweep serves a family of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, is_dataclass, replace
from numbers import Real
from typing import TYPE_CHECKING, Any

from palpate.errors import UsageError
from palpate.physics.shapes.block import LayeredBlock
from palpate.units import Range

if TYPE_CHECKING:
    from palpate.physics.solid.body import Body

__all__ = ["RADIUS", "Varied", "with_values"]

RADIUS = "probe.radius"
THICKNESS = "thickness"
UNITS = {
    **dict.fromkeys(("young", "bulk", "mu", "c10", "c01"), "Pa"),
    **dict.fromkeys(("poisson", "alpha"), ""),
    **dict.fromkeys(("radius", THICKNESS), "m"),
}
BESIDE = frozenset({"density"})  # acts through gravity, not through the energy


@dataclass(frozen=True)
class Varied:
    """A number of a material, the thickness of a layer or the radius of the probe, which is an input.

    Attributes
    ----------
    path : str
        ``"REGION.PROPERTY"``, for example ``"fat.young"``; of a body of one region the property alone will do.
        A material inside another is one more step: ``"fat.base.young"``. ``"LAYER.thickness"`` of a `LayeredBlock`:
        what a layer takes, the deepest one gives, so the touched surface stays. ``"probe.radius"``: footprints and
        depths stay.
    low, high : float
        Ends of its range, in SI units.
    name : str
        Of the input, by default the path.
    unit : str
        By default that of the property, where it is known.

    Raises
    ------
    UsageError
        If an end is no number.
    """

    path: str
    low: float
    high: float
    name: str = ""
    unit: str = ""

    def __post_init__(self) -> None:
        ends: tuple[object, ...] = (self.low, self.high)
        for end in ends:
            if not isinstance(end, Real):
                raise UsageError(
                    f"An end of the range of {self.path!r} is {end!r}, of type {type(end).__name__}.",
                    why="Ends are numbers in SI units.",
                    fix='For example Varied("fat.young", 2e3, 8e3) for 2 to 8 kPa.',
                )

    @property
    def range(self) -> Range:
        """The input.

        Raises
        ------
        UsageError
            If the ends are not finite or not in order.
        """
        unit = self.unit or UNITS.get(self.path.rpartition(".")[2], "")
        return Range(self.name or self.path, self.low, self.high, unit)

    @property
    def is_material(self) -> bool:
        """Whether it is a number of a material, whose slope of the energy is one of an integral."""
        return self.path != RADIUS and not self.path.endswith(f".{THICKNESS}")

    def of(self, body: Body, value: float) -> Body:
        """The body with this property at a value; as it is for the probe's radius.

        Raises
        ------
        UsageError
            If the body has no such number, or its material does not allow the value.
        """
        if self.path == RADIUS:
            return body
        if not self.is_material:
            return replace(
                body, geometry=_layered(body, self.path).with_thickness(self.path.partition(".")[0], value)
            )
        materials = body.materials
        region, _, rest = self.path.partition(".")
        if region not in materials and len(materials) == 1:
            region, rest = next(iter(materials)), self.path
        if region not in materials or not rest:
            raise UsageError(
                f"{self.path!r} names no property of this body.",
                why=f"Its regions are {', '.join(materials)}.",
                fix=f'Write region and property, for example "{next(iter(materials))}.young".',
            )
        materials[region] = _replaced(materials[region], rest.split("."), value, self.path)
        return replace(body, material=materials)


def with_values(body: Body, varied: tuple[Varied, ...], values: tuple[float, ...]) -> Body:
    """The member of the family with these values."""
    for one, value in zip(varied, values, strict=True):
        body = one.of(body, value)
    return body


def _layered(body: Body, path: str) -> LayeredBlock:
    if isinstance(body.geometry, LayeredBlock):
        return body.geometry
    raise UsageError(
        f"{path!r} can't vary: {body.geometry} has no layers.",
        why="The mesh of a layered block is moved with its layers; other shapes would need one for each value.",
        fix="Use a LayeredBlock, or make one sweep for each value.",
    )


def _replaced(material: Any, path: list[str], value: float, whole: str) -> Any:
    name, rest = path[0], path[1:]
    known = [f.name for f in fields(material)] if is_dataclass(material) else []
    inner = getattr(material, name) if name in known else None
    if rest and is_dataclass(inner):
        return replace(material, **{name: _replaced(inner, rest, value, whole)})
    if rest or name in BESIDE or isinstance(inner, bool) or not isinstance(inner, int | float):
        numbers = [n for n in known if isinstance(getattr(material, n), float) and n not in BESIDE]
        raise UsageError(
            f"{whole!r} can't vary: {name!r} is no number in the energy of {material.name}.",
            why=f"Its numbers are {', '.join(numbers) or 'none'}.",
            fix="Name one of these, or make one sweep for each value.",
        )
    if not math.isfinite(value):
        raise UsageError(f"The value {value} of {whole!r} is not finite.", fix="Give a finite number.")
    return replace(material, **{name: float(value)})
