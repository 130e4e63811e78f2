"""Frozen tables with quantities that may carry units: the base of all parts of a study."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from palpate.errors import UsageError
from palpate.units import to_si

__all__ = [
    "Densities",
    "Metres",
    "Newtons",
    "PadStiffness",
    "Pair",
    "Pascals",
    "QuarticMetres",
    "Record",
    "SquareMetres",
    "Stiffness",
    "Triple",
    "Unit",
    "in_si",
]


@dataclass(frozen=True)
class Unit:
    """Annotation of a float field that takes a number in this unit, or text with a unit of the same dimension.

    Attributes
    ----------
    name : str
        SI unit, such as "m".
    """

    name: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(partial(in_si, unit=self.name), handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, _: GetJsonSchemaHandler) -> dict[str, Any]:
        text = f"a number in {self.name}, or a quantity with its unit, such as '1 {self.name}'"
        return {"anyOf": [{"type": "number"}, {"type": "string"}], "description": text}


def in_si(value: Any, unit: str) -> float:
    """Return a quantity of a study file as a number in this unit.

    Raises
    ------
    ValueError
        If it is not a quantity, or has another dimension. Pydantic collects these errors.
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
Pair = tuple[Metres, Metres]
Triple = tuple[Metres, Metres, Metres]


class Record(BaseModel):
    """Base of all parts of a study: frozen, and unknown keys are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
