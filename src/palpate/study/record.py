"""What the records of all studies are made of: frozen tables, quantities that may carry units, the runtime's part."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from palpate.errors import UsageError
from palpate.units import to_si

__all__ = [
    "Densities",
    "Metres",
    "Newtons",
    "PadStiffness",
    "Pascals",
    "QuarticMetres",
    "Record",
    "RuntimeRecord",
    "SquareMetres",
    "Stiffness",
    "Unit",
    "in_si",
]


@dataclass(frozen=True)
class Unit:
    """Makes a float field a quantity: a number in this unit, or text with a unit of the same dimension.

    Attributes
    ----------
    name : str
        SI unit.
    """

    name: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(partial(in_si, unit=self.name), handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, _: GetJsonSchemaHandler) -> dict[str, Any]:
        text = f"a number in {self.name}, or a quantity with its unit, such as '1 {self.name}'"
        return {"anyOf": [{"type": "number"}, {"type": "string"}], "description": text}


def in_si(value: Any, unit: str) -> float:
    """A quantity of a study file as a number in this unit.

    Raises
    ------
    ValueError
        If it is none: pydantic collects these.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise ValueError(f"{value!r} is not a quantity in {unit}")  # noqa: TRY004 - pydantic collects ValueError
    try:
        return to_si(value, unit)
    except UsageError as error:
        raise ValueError(str(error).replace("\n", " ")) from error


Metres = Annotated[float, Unit("m")]
SquareMetres = Annotated[float, Unit("m^2")]
QuarticMetres = Annotated[float, Unit("m^4")]
Newtons = Annotated[float, Unit("N")]
Pascals = Annotated[float, Unit("Pa")]
Densities = Annotated[float, Unit("kg/m^3")]
Stiffness = Annotated[float, Unit("N/m")]
PadStiffness = Annotated[float, Unit("N/m^3")]


class Record(BaseModel):
    """Base of all parts of a study: frozen, and unknown keys are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class RuntimeRecord(Record):
    """The 1 kHz loop and the page: what `palpate view` and `palpate run` do unless told otherwise."""

    rate: float = Field(1000.0, ge=10, le=10000, description="Hz")
    max_force: Newtons = Field(12.0, gt=0, description="the force is clamped to this")
    port: int = Field(8080, ge=0, le=65535, description="of the page; a busy one moves on to the next")
