"""The bodies of a study: the table `[body]` with a kind, and the keys that this kind needs.

Each record builds the body that it describes.
"""

from __future__ import annotations

from typing import ClassVar, Literal, TypeAlias

from pydantic import Field, model_validator

from palpate.physics import (
    Block,
    Body,
    Cantilever,
    Circle,
    Cylinder,
    Dome,
    Inclusion,
    LayeredBlock,
    LinearElastic,
    Organ,
    Rectangle,
    Section,
)
from palpate.records import Count, Metres, Number, Pair, QuarticMetres, Record, SquareMetres
from palpate.study.material_records import BeamMaterial, SolidMaterial, SolidMaterialRecord, build_material
from palpate.study.part_records import PartRecord

__all__ = [
    "BODIES",
    "BlockRecord",
    "BodyRecord",
    "CantileverRecord",
    "CylinderRecord",
    "DomeRecord",
    "InclusionRecord",
    "LayerRecord",
    "LayeredRecord",
    "OrganRecord",
    "SectionRecord",
    "SkinRecord",
]


_SOFT_MATERIAL = 'a name, or { young = "9 kPa", poisson = 0.45 }'
_SOFT = SolidMaterialRecord(young=9e3)


class SectionRecord(Record):
    """A cross-section: a radius; or a width and a height; or area, second moment and shear factor."""

    radius: Metres | None = Field(None, description="of a circular section", examples=["5 mm"])
    width: Metres | None = Field(
        None, description="of a rectangular section, out of the plane", examples=["25 mm"]
    )
    height: Metres | None = Field(
        None, description="of a rectangular section, in the plane of bending", examples=["1 mm"]
    )
    area: SquareMetres | None = Field(None, description="of any section", examples=["25 mm^2"])
    second_moment: QuarticMetres | None = Field(
        None, description="about the axis of bending", examples=["2 mm^4"]
    )
    shear_factor: Number | None = Field(
        None, description="share of the area that carries shear", examples=[0.85]
    )

    @model_validator(mode="after")
    def _one_form(self) -> SectionRecord:
        forms = ({"radius"}, {"width", "height"}, {"area", "second_moment", "shear_factor"})
        given = {k for k, v in self if v is not None}
        if given not in forms:
            raise ValueError(
                f"a section is given by radius, or by width and height, or by area, second_moment and "
                f"shear_factor; found {', '.join(sorted(given)) or 'nothing'}"
            )
        return self

    def build(self) -> Circle | Rectangle | Section:
        """Return the cross-section."""
        if self.radius is not None:
            return Circle(self.radius)
        if self.width is not None and self.height is not None:
            return Rectangle(self.width, self.height)
        # the record's own check leaves only this form
        assert self.area is not None
        assert self.second_moment is not None
        assert self.shear_factor is not None
        return Section(self.area, self.second_moment, self.shear_factor)


class CantileverRecord(Record):
    """A plane cantilever, clamped at x = 0."""

    INTERACTIONS: ClassVar[tuple[str, ...]] = ("loads",)

    kind: Literal["cantilever"] = "cantilever"
    length: Metres = Field(1.0, description="from clamp to tip")
    section: SectionRecord = SectionRecord(radius=0.005)
    material: BeamMaterial = Field(
        "nylon", description='a name, or { young = "70 GPa", poisson = 0.33, density = "2700 kg/m^3" }'
    )
    kinematics: Literal["large", "small"] = Field("large", description="'small' is linear: for checks")
    self_weight: bool = Field(False, description="gravity, 9.80665 m/s² downwards")
    elements: Count = Field(20, ge=1, description="finite elements along the beam")
    order: Count = Field(3, ge=2, le=8, description="polynomial order of the elements")
    nodes: tuple[Metres, ...] = Field((), description="positions of interest; empty: six, evenly spaced")
    fibres: Count | None = Field(None, ge=4, description="layers of a section that yields", examples=[48])
    tolerance: Number | None = Field(
        None,
        gt=0,
        description="largest relative error of a step, where the beam has a memory",
        examples=[1e-5],
    )

    @model_validator(mode="after")
    def _nodes_on_the_beam(self) -> CantileverRecord:
        for x in self.nodes:
            if not 0.0 <= x <= self.length:
                raise ValueError(f"the node of interest at {x:g} m is not on the beam, 0 … {self.length:g} m")
        return self

    @property
    def has_memory(self) -> bool:
        """True if the material yields or creeps, so that the answer depends on the history."""
        return not isinstance(build_material(self.material), LinearElastic)

    def surface_names(self) -> tuple[str, ...]:
        """Return the names of the surfaces that can be touched: none."""
        return ()

    def fixed_names(self) -> tuple[str, ...]:
        """Return the names of the surfaces that are fixed: none."""
        return ()

    def build(self) -> Cantilever:
        """Return the body."""
        return Cantilever(
            length=self.length,
            section=self.section.build(),
            material=build_material(self.material),
            elements=self.elements,
            order=self.order,
            kinematics=self.kinematics,
            self_weight=self.self_weight,
            nodes=self.nodes,
            fibres=self.fibres,
            tolerance=self.tolerance,
        )


class _SolidRecord(Record):
    """Base of the solid bodies."""

    INTERACTIONS: ClassVar[tuple[str, ...]] = ("probe", "tool", "pinch", "pad")
    SURFACES: ClassVar[tuple[str, ...]] = ("top", "bottom")

    element: Metres | None = Field(
        None, gt=0, description="largest element, where none touches", examples=["15 mm"]
    )

    @property
    def has_memory(self) -> bool:
        """True if the answer depends on the history: not for the materials that a study file can name."""
        return False

    def surface_names(self) -> tuple[str, ...]:
        """Return the names of the body's surfaces."""
        return self.SURFACES

    def fixed_names(self) -> tuple[str, ...]:
        """Return the names of the surfaces that are fixed."""
        fixed = getattr(self, "fixed", "bottom")
        return (fixed,) if isinstance(fixed, str) else tuple(fixed)


_BOX = ("top", "bottom", "x_min", "x_max", "y_min", "y_max")
_FIXED = "surfaces that don't move"


class BlockRecord(_SolidRecord):
    """A block."""

    SURFACES: ClassVar[tuple[str, ...]] = _BOX
    kind: Literal["block"] = "block"
    size: tuple[Metres, Metres, Metres] = Field((0.10, 0.10, 0.05), description="along x, y and z, m")
    material: SolidMaterial = Field(_SOFT, description=_SOFT_MATERIAL)
    fixed: str | tuple[str, ...] = Field("bottom", description=_FIXED)

    def build(self) -> Body:
        """Return the body."""
        return Body(Block(self.size, element=self.element), build_material(self.material), fixed=self.fixed)


class LayerRecord(Record):
    """A layer of tissue, from the surface down."""

    name: str = Field(min_length=1, description="of the layer")
    thickness: Metres = Field(gt=0, description="in the direction of z")
    material: SolidMaterial = Field(description=_SOFT_MATERIAL)


class LayeredRecord(_SolidRecord):
    """A block of layers."""

    SURFACES: ClassVar[tuple[str, ...]] = _BOX
    kind: Literal["layered"] = "layered"
    extent: Pair = Field((0.10, 0.10), description="along x and y, m")
    layers: tuple[LayerRecord, ...] = Field(min_length=1)
    fixed: str | tuple[str, ...] = Field("bottom", description=_FIXED)

    def build(self) -> Body:
        """Return the body."""
        layers = tuple((layer.name, layer.thickness) for layer in self.layers)
        materials = {layer.name: build_material(layer.material) for layer in self.layers}
        return Body(LayeredBlock(self.extent, layers, element=self.element), materials, fixed=self.fixed)


class SkinRecord(Record):
    """A skin over a dome."""

    thickness: Metres = Field(gt=0, description="at the top and at the base")
    material: SolidMaterial = Field(description=_SOFT_MATERIAL)


class InclusionRecord(Record):
    """A ball of another material inside."""

    centre: tuple[Metres, Metres, Metres] = Field(description="x, y and z, m")
    radius: Metres = Field(gt=0, description="of the ball")
    material: SolidMaterial = Field(description=_SOFT_MATERIAL)


class DomeRecord(_SolidRecord):
    """A dome on its flat base: half an ellipsoid."""

    kind: Literal["dome"] = "dome"
    radius: Metres = Field(0.06, gt=0, description="of the base")
    height: Metres = Field(0.045, gt=0, description="of the top")
    material: SolidMaterial = Field(_SOFT, description=_SOFT_MATERIAL)
    fixed: str | tuple[str, ...] = Field("bottom", description=_FIXED)
    skin: SkinRecord | None = Field(None)
    inclusion: InclusionRecord | None = Field(None)

    def build(self) -> Body:
        """Return the body."""
        materials, thickness, ball = {"body": build_material(self.material)}, 0.0, None
        if self.skin:
            materials["skin"], thickness = build_material(self.skin.material), self.skin.thickness
        if self.inclusion:
            materials["inclusion"] = build_material(self.inclusion.material)
            ball = Inclusion(self.inclusion.centre, self.inclusion.radius)
        shape = Dome(self.radius, self.height, thickness, ball, element=self.element)
        return Body(shape, materials, fixed=self.fixed)


class CylinderRecord(_SolidRecord):
    """An upright round cylinder."""

    SURFACES: ClassVar[tuple[str, ...]] = ("top", "bottom", "side")
    kind: Literal["cylinder"] = "cylinder"
    radius: Metres = Field(0.05, gt=0, description="of the cylinder")
    height: Metres = Field(0.05, gt=0, description="along z")
    material: SolidMaterial = Field(_SOFT, description=_SOFT_MATERIAL)
    fixed: str | tuple[str, ...] = Field("bottom", description=_FIXED)

    def build(self) -> Body:
        """Return the body."""
        shape = Cylinder(self.radius, self.height, element=self.element)
        return Body(shape, build_material(self.material), fixed=self.fixed)


class OrganRecord(_SolidRecord):
    """A liver-like organ of two lobes, from a formula and a seed."""

    SURFACES: ClassVar[tuple[str, ...]] = ("front", "attached", "side")
    kind: Literal["organ"] = "organ"
    length: Metres = Field(0.20, gt=0, description="along x")
    seed: Count = Field(0, ge=0, description="which of the similar organs")
    material: SolidMaterial = Field(_SOFT, description=_SOFT_MATERIAL)
    fixed: str | tuple[str, ...] = Field("attached", description=_FIXED)

    def build(self) -> Body:
        """Return the body."""
        shape = Organ(self.length, self.seed, element=self.element)
        return Body(shape, build_material(self.material), fixed=self.fixed)


BodyRecord: TypeAlias = (
    CantileverRecord | BlockRecord | LayeredRecord | DomeRecord | CylinderRecord | OrganRecord | PartRecord
)
BODIES = ("cantilever", "block", "layered", "dome", "cylinder", "organ", "part")
"""Kinds of bodies that a study file can describe."""
