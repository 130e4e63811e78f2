"""Interactions of a study with a surface, and numbers that vary beside them."""

from __future__ import annotations

from typing import Any

from pydantic import Field, ValidationInfo, field_validator, model_validator

from palpate.physics.interactions.sphere import RIGID
from palpate.physics.shapes.naming import members
from palpate.physics.solid.body_family import BESIDE, UNITS
from palpate.records import Number, Record, in_si
from palpate.study.body_records import BodyRecord

__all__ = ["OnSurface", "VariedRecord", "require_corners", "require_depth", "stiffness_or_rigid"]


class OnSurface(Record):
    """Base of the interactions with a surface of a solid body."""

    touches: str = Field("top", description="surface that it acts on")

    def fault(self, body: BodyRecord) -> str:
        """Return what does not fit between the interaction and the body; empty if all fits."""
        known = body.surface_names()
        for name in (self.touches, *body.fixed_names()):
            if not members(name, known):
                return f"a {body.kind} has no surface {name!r}; it has {', '.join(known)}"
        return ""


def require_corners(over: tuple[Any, Any] | None) -> None:
    """Refuse corners of a part that are not in order."""
    if over and not all(a < b for a, b in zip(*over, strict=True)):
        raise ValueError(
            "the corners of `over` are not in order: the lower one comes first; for example "
            '[["30 mm", "30 mm"], ["70 mm", "70 mm"]]'
        )


def require_depth(depth: tuple[float, float]) -> None:
    """Refuse a least and a largest depth in m that are no range from 0 on."""
    if not 0 <= depth[0] < depth[1]:
        raise ValueError(
            f"the depth {depth[0]:g} … {depth[1]:g} m is no range from 0 on; it is measured into the "
            'body, the least one first; for example depth = ["0.2 mm", "5 mm"]'
        )


def stiffness_or_rigid(pad: Any) -> Any:
    """Return the word of a rigid ball or tool, or a positive stiffness of its pad in N/m³."""
    if isinstance(pad, str) and pad.strip().lower() == RIGID:
        return RIGID
    stiffness = in_si(pad, "N/m^3")
    if not stiffness > 0:
        raise ValueError(f'{stiffness:g} is no stiffness of a pad: give one above 0, or "rigid"')
    return stiffness


class VariedRecord(Record):
    """A number of the body or of the ball that is an input beside the position: one model of a family of bodies."""

    path: str = Field(
        min_length=1,
        description="REGION.young or another number of its material, LAYER.thickness, or probe.radius",
        examples=["fat.young"],
    )
    low: Number = Field(description='its least value, in SI units or such as "2 kPa"', examples=["2 kPa"])
    high: Number = Field(description="its largest value, likewise", examples=["8 kPa"])

    @field_validator("path")
    @classmethod
    def _can_vary(cls, path: str) -> str:
        if path.rpartition(".")[2] in BESIDE:
            raise ValueError(
                "a density can't vary: it acts through the body's weight, not through its strain energy"
            )
        return path

    @field_validator("low", "high", mode="before")
    @classmethod
    def _in_si(cls, value: Any, info: ValidationInfo) -> Any:
        """Return a quantity in the unit of what varies."""
        if "path" not in info.data:  # the path has its own complaint already
            return 0.0
        return in_si(value, UNITS.get(str(info.data.get("path", "")).rpartition(".")[2], ""))

    @model_validator(mode="after")
    def _in_order(self) -> VariedRecord:
        if not self.low < self.high:
            raise ValueError(f"{self.low:g} … {self.high:g} is no range: low is less than high")
        return self
