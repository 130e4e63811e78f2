"""Records that people write as text, in a study or a mapping, and the numbers and quantities in them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from palpate.errors import UsageError
from palpate.units import parse_quantity

__all__ = [
    "Count",
    "Densities",
    "Metres",
    "NewtonMetres",
    "Newtons",
    "Number",
    "PadStiffness",
    "Pair",
    "Pascals",
    "QuarticMetres",
    "Radians",
    "Record",
    "SquareMetres",
    "Stiffness",
    "Triple",
    "Unit",
    "in_si",
]


@dataclass(frozen=True)
class Unit:
    """Annotation of a float field that takes a number in this unit, or text with a unit of the same dimension."""

    name: str  # SI unit, such as "m"; "" for a pure number

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(partial(in_si, unit=self.name), handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        if not self.name:
            return handler(schema)
        text = f"a number in {self.name}, or a quantity with its unit, such as '1 {self.name}'"
        return {"anyOf": [{"type": "number"}, {"type": "string"}], "description": text}


class _Whole:
    """Annotation of an int field that takes no text: Pydantic by itself reads "1_0" as 10, and true as 1."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(_whole, handler(source))


def _whole(value: Any) -> Any:
    if isinstance(value, (bool, str)):
        shown = repr(value) if isinstance(value, str) else str(value).lower()
        raise ValueError(f"{shown} is no whole number; write it with digits alone, without quotes")  # noqa: TRY004
    return value


def in_si(value: Any, unit: str | None) -> float:
    """Return a quantity of a record as a number in this unit; None: a text of any dimension, in SI base units.

    It raises `ValueError`, which Pydantic collects.
    """
    try:
        return parse_quantity(value, unit)
    except UsageError as error:
        bare = f" A number without quotes is in {unit}." if error.what.endswith("has no unit.") else ""
        raise ValueError(str(error).replace("\n", " ") + bare) from error


Count = Annotated[int, _Whole()]
Number = Annotated[float, Unit("")]
Metres = Annotated[float, Unit("m")]
Radians = Annotated[float, Unit("rad")]
SquareMetres = Annotated[float, Unit("m^2")]
QuarticMetres = Annotated[float, Unit("m^4")]
Newtons = Annotated[float, Unit("N")]
NewtonMetres = Annotated[float, Unit("N*m")]
Pascals = Annotated[float, Unit("Pa")]
Densities = Annotated[float, Unit("kg/m^3")]
Stiffness = Annotated[float, Unit("N/m")]
PadStiffness = Annotated[float, Unit("N/m^3")]
Pair = tuple[Metres, Metres]
Triple = tuple[Metres, Metres, Metres]


_BOUNDS = {"ge": "minimum", "gt": "exclusiveMinimum", "le": "maximum", "lt": "exclusiveMaximum"}


def _name_bounds(schema: dict[str, Any]) -> None:
    """Give the bounds of numbers that may be left out their names in JSON Schema: Pydantic writes "ge" for these."""
    for key in schema.get("properties", {}).values():
        for form in key.get("anyOf", ()):
            form |= {_BOUNDS[name]: form.pop(name) for name in list(form) if name in _BOUNDS}


class Record(BaseModel):
    """Base of all parts of a study: frozen, and unknown keys are errors."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, json_schema_extra=_name_bounds
    )
