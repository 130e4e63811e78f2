"""The bodies of a study: `[body]` with a kind and what that kind needs."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field

from palpate.errors import UsageError
from palpate.physics import named_material
from palpate.study.record import Densities, Metres, Pascals, Record

__all__ = [
    "KINDS",
    "BlockRecord",
    "CylinderRecord",
    "DomeRecord",
    "InclusionRecord",
    "LayerRecord",
    "LayeredRecord",
    "OrganRecord",
    "ShapeRecord",
    "SkinRecord",
    "SoftRecord",
    "known_material",
]


class SoftRecord(Record):
    """A neo-Hookean material."""

    name: str = Field("own material", description="for the report")
    young: Pascals = Field(gt=0, description="Young's modulus at small strains")
    poisson: float = Field(0.45, ge=0, lt=0.5, description="Poisson's ratio")
    density: Densities = Field(0.0, ge=0, description="for the record")


def known_material(value: str | SoftRecord) -> str | SoftRecord:
    """The same, if it is a record or the name of a material.

    Raises
    ------
    ValueError
        If there is no material of that name.
    """
    if isinstance(value, str):
        try:
            named_material(value)
        except UsageError as error:
            raise ValueError(" ".join(str(error).split("\n"))) from error
    return value


Material = Annotated[str | SoftRecord, AfterValidator(known_material)]
_MATERIAL = 'a name, or { young = "9 kPa", poisson = 0.45 }'
SOFT = SoftRecord(young=9e3)


class _ShapeRecord(Record):
    """What all bodies have."""

    SURFACES: ClassVar[tuple[str, ...]] = ("top", "bottom")

    element: Metres | None = Field(
        None, gt=0, description="largest element, where none touches", examples=["15 mm"]
    )

    def surface_names(self) -> tuple[str, ...]:
        """Its surfaces."""
        return self.SURFACES

    def fixed_names(self) -> tuple[str, ...]:
        """Its fixed surfaces."""
        fixed = getattr(self, "fixed", "bottom")
        return (fixed,) if isinstance(fixed, str) else tuple(fixed)


_BOX = ("top", "bottom", "x_min", "x_max", "y_min", "y_max")


class BlockRecord(_ShapeRecord):
    """A block."""

    SURFACES: ClassVar[tuple[str, ...]] = _BOX
    kind: Literal["block"] = "block"
    size: tuple[Metres, Metres, Metres] = Field((0.10, 0.10, 0.05), description="along x, y and z, m")
    material: Material = Field(SOFT, description=_MATERIAL)
    fixed: str | tuple[str, ...] = Field("bottom", description="surfaces that don't move")


class LayerRecord(Record):
    """A layer of tissue, from the surface down."""

    name: str = Field(min_length=1, description="of the layer")
    thickness: Metres = Field(gt=0, description="in the direction of z")
    material: Material = Field(description=_MATERIAL)


class LayeredRecord(_ShapeRecord):
    """A block of layers."""

    SURFACES: ClassVar[tuple[str, ...]] = _BOX
    kind: Literal["layered"] = "layered"
    extent: tuple[Metres, Metres] = Field((0.10, 0.10), description="along x and y, m")
    layers: tuple[LayerRecord, ...] = Field(min_length=1)
    fixed: str | tuple[str, ...] = Field("bottom", description="surfaces that don't move")


class SkinRecord(Record):
    """A skin over a dome."""

    thickness: Metres = Field(gt=0, description="at the top and at the base")
    material: Material = Field(description=_MATERIAL)


class InclusionRecord(Record):
    """A ball of another material inside."""

    centre: tuple[Metres, Metres, Metres] = Field(description="x, y and z, m")
    radius: Metres = Field(gt=0, description="of the ball")
    material: Material = Field(description=_MATERIAL)


class DomeRecord(_ShapeRecord):
    """A dome on its flat base: half an ellipsoid."""

    kind: Literal["dome"] = "dome"
    radius: Metres = Field(0.06, gt=0, description="of the base")
    height: Metres = Field(0.045, gt=0, description="of the top")
    material: Material = Field(SOFT, description=_MATERIAL)
    fixed: str | tuple[str, ...] = Field("bottom", description="surfaces that don't move")
    skin: SkinRecord | None = Field(None)
    inclusion: InclusionRecord | None = Field(None)


class CylinderRecord(_ShapeRecord):
    """An upright round cylinder."""

    SURFACES: ClassVar[tuple[str, ...]] = ("top", "bottom", "side")
    kind: Literal["cylinder"] = "cylinder"
    radius: Metres = Field(0.05, gt=0, description="of the cylinder")
    height: Metres = Field(0.05, gt=0, description="along z")
    material: Material = Field(SOFT, description=_MATERIAL)
    fixed: str | tuple[str, ...] = Field("bottom", description="surfaces that don't move")


class OrganRecord(_ShapeRecord):
    """A liver-like organ of two lobes, from a formula and a seed."""

    SURFACES: ClassVar[tuple[str, ...]] = ("front", "attached", "side")
    kind: Literal["organ"] = "organ"
    length: Metres = Field(0.20, gt=0, description="along x")
    seed: int = Field(0, ge=0, description="which of the similar organs")
    material: Material = Field(SOFT, description=_MATERIAL)
    fixed: str | tuple[str, ...] = Field("attached", description="surfaces that don't move")


ShapeRecord = BlockRecord | LayeredRecord | DomeRecord | CylinderRecord | OrganRecord
KINDS = ("block", "layered", "dome", "cylinder", "organ")
