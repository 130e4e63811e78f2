"""Materials of a study: a name of the library, or a table with a law and its constants.

BeamMaterial    of a cantilever: linear elastic, with Prony terms
SolidMaterial   of a solid body: every law, with fibres, hardening, Prony terms or pre-stretch, or one's own module
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, Field, field_validator, model_validator

from palpate.errors import PalpateError, UsageError
from palpate.physics import (
    FibreFamily,
    FibreReinforced,
    LinearElastic,
    LinearHardening,
    MooneyRivlin,
    NeoHookean,
    Ogden,
    Plastic,
    PreStretched,
    StVenantKirchhoff,
    UserMaterial,
    Viscoelastic,
    VoceHardening,
    Yeoh,
    named_material,
)
from palpate.records import Densities, Number, Pascals, Record, in_si

__all__ = [
    "BeamMaterial",
    "FibreRecord",
    "HardeningRecord",
    "MaterialRecord",
    "SolidMaterial",
    "SolidMaterialRecord",
    "build_material",
]

_DENSITY = "only matters with self-weight"
_NEEDED = {
    "neo-hookean": {"young"},
    "mooney-rivlin": {"c10", "c01"},
    "yeoh": {"c10", "c20", "c30"},
    "ogden": {"mu", "alpha"},
    "st-venant-kirchhoff": {"young"},
    "linear-elastic": {"young"},
    "user": {"module", "function"},
}
_ALSO = {"user": {"constants", "bulk"}} | {law: {"bulk"} for law in ("mooney-rivlin", "yeoh", "ogden")}
_POISSON = 0.45  # Poisson's ratio where neither it nor a bulk modulus is given
_CONSTANTS = set().union(*_NEEDED.values(), *_ALSO.values())
_LARGE = {
    "mooney-rivlin": MooneyRivlin,
    "yeoh": Yeoh,
    "ogden": Ogden,
    "neo-hookean": NeoHookean,
    "st-venant-kirchhoff": StVenantKirchhoff,
    "linear-elastic": LinearElastic,
}


class MaterialRecord(Record):
    """A linear elastic material, which creeps if it has Prony terms."""

    name: str = Field("own material", description="for the report")
    young: Pascals = Field(description="Young's modulus; of a material that creeps, at once after a load")
    poisson: Number = Field(0.3, description="Poisson's ratio")
    density: Densities = Field(0.0, description=_DENSITY)
    prony: tuple[tuple[Number, Number], ...] = Field(
        (), description="terms of creep: share of the stiffness that relaxes, and its time in s"
    )

    def build(self) -> Any:
        """Return the material."""
        elastic = LinearElastic(self.young, self.poisson, self.density, self.name)
        if not self.prony:
            return elastic
        return Viscoelastic(elastic, self.prony, part="all", name=self.name)


class FibreRecord(Record):
    """A family of fibres (Holzapfel, Gasser & Ogden 2000; Gasser, Ogden & Holzapfel 2006)."""

    direction: tuple[Number, Number, Number] = Field(description="mean direction in the undeformed body")
    k1: Pascals = Field(gt=0, description="modulus of the fibres", examples=["20 kPa"])
    k2: Number = Field(gt=0, description="exponent of the fibres, a pure number", examples=[5.0])
    dispersion: Number = Field(0.0, ge=0, le=1 / 3, description="0: aligned, 1/3: in all directions")


class HardeningRecord(Record):
    """Hardening of a metal: its stress is yield_stress + saturation (1 − exp(−rate α)) + modulus α at a strain α."""

    yield_stress: Pascals = Field(gt=0, description="stress of the first yield", examples=["125 MPa"])
    modulus: Pascals = Field(0.0, ge=0, description="linear part")
    saturation: Pascals = Field(0.0, ge=0, description="gain of the stress in the end")
    rate: Number | None = Field(
        None, gt=0, description="of the gain; needed with saturation", examples=[50.0]
    )

    @model_validator(mode="after")
    def _saturation_with_its_rate(self) -> HardeningRecord:
        if bool(self.saturation) != (self.rate is not None):
            raise ValueError("saturation and rate go together: give both or none")
        return self

    def build(self) -> LinearHardening | VoceHardening:
        """Return the law of hardening."""
        if self.rate is None:
            return LinearHardening(self.yield_stress, self.modulus)
        return VoceHardening(self.yield_stress, self.saturation, self.rate, self.modulus)


class SolidMaterialRecord(Record):
    """A material of a solid body: neo-Hookean, unless `law` says otherwise."""

    law: Literal[
        "neo-hookean",
        "mooney-rivlin",
        "yeoh",
        "ogden",
        "st-venant-kirchhoff",
        "linear-elastic",
        "user",
    ] = Field(
        "neo-hookean",
        description="or mooney-rivlin, yeoh, ogden, st-venant-kirchhoff, linear-elastic, user, by their constants",
    )
    name: str = Field("own material", description="for the report")
    young: Pascals | None = Field(
        None,
        gt=0,
        description="Young's modulus at small strains",
        examples=["9 kPa"],
    )
    poisson: Number = Field(_POISSON, ge=0, lt=0.5, description="Poisson's ratio at small strains")
    bulk: Pascals | None = Field(
        None,
        gt=0,
        description="bulk modulus, in place of Poisson's ratio; mooney-rivlin, yeoh, ogden, user",
        examples=["1 MPa"],
    )
    c10: Pascals | None = Field(None, description="mooney-rivlin and yeoh", examples=["2 kPa"])
    c01: Pascals | None = Field(None, description="mooney-rivlin", examples=["0.5 kPa"])
    c20: Pascals | None = Field(None, description="yeoh", examples=["0.1 kPa"])
    c30: Pascals | None = Field(None, description="yeoh", examples=["0.01 kPa"])
    mu: Pascals | tuple[Pascals, ...] | None = Field(
        None, description="ogden: of each term; ½ Σ μα is the shear modulus", examples=[["3 kPa", "0.1 kPa"]]
    )
    alpha: Number | tuple[Number, ...] | None = Field(
        None, description="ogden: exponent of each term", examples=[[1.3, 5.0]]
    )
    density: Densities = Field(0.0, ge=0, description="for the record")
    fibres: tuple[FibreRecord, ...] = Field((), description="families of fibres in a matrix of this law")
    stretch: tuple[Number, Number] | None = Field(
        None, description="pre-stretch along x and y, with no stress along z", examples=[(1.1, 1.0)]
    )
    hardening: HardeningRecord | None = Field(None, description="linear-elastic only: beyond it, it yields")
    prony: tuple[tuple[Number, Number], ...] = Field(
        (), description="terms of relaxation: share of the shear stiffness, and its time in s"
    )
    module: str | None = Field(
        None,
        description="user: Python file beside the study, or name of a module, in which the function stands",
        examples=["my_laws.py"],
    )
    function: str | None = Field(
        None, description="user: energy density as a function of F, or a UserMaterial", examples=["tissue"]
    )
    constants: dict[str, float | str] = Field(
        default_factory=dict, description="user: arguments of the function, by name"
    )

    @property
    def unused_keys(self) -> frozenset[str]:
        """Keys that a file of this material need not show: constants of other laws, and a Poisson's ratio of no use."""
        unused = _CONSTANTS - _NEEDED[self.law] - _ALSO.get(self.law, set())
        return frozenset(unused | {"poisson"} if self.bulk is not None or self.law == "user" else unused)

    @field_validator("constants")
    @classmethod
    def _constants_in_si(cls, constants: dict[str, float | str]) -> dict[str, float]:
        """Return the constants as numbers: of text with a unit, in SI units."""
        return {name: in_si(value, None) for name, value in constants.items()}

    @model_validator(mode="after")
    def _constants_of_its_law(self) -> SolidMaterialRecord:
        given = {name for name in _CONSTANTS if getattr(self, name) not in (None, {})}
        needed = _NEEDED[self.law]
        if missing := sorted(needed - given):
            raise ValueError(f"the law {self.law} needs {' and '.join(missing)}")
        if foreign := sorted(given - needed - _ALSO.get(self.law, set())):
            laws = [law for law in _NEEDED if foreign[0] in _NEEDED[law] | _ALSO.get(law, set())]
            raise ValueError(
                f"the law {self.law} has no constant {foreign[0]}; it belongs to {', '.join(laws)}"
            )
        if self.bulk is not None and self.poisson != _POISSON:
            raise ValueError("bulk and poisson say the same: give one of them")
        if self.law == "user" and self.poisson != _POISSON:
            raise ValueError("the law user has its Poisson's ratio in its function: leave out poisson")
        if self.hardening is not None and self.law != "linear-elastic":
            raise ValueError("hardening is for the law linear-elastic: plastic flow is a law of small strain")
        if self.hardening is not None and self.prony:
            raise ValueError("a material that yields has no Prony terms: leave out hardening or prony")
        try:
            self.build()
        except PalpateError as error:
            raise ValueError(" ".join(str(error).split("\n"))) from error
        return self

    def build(self) -> Any:
        """Return the material: the law, in fibres, stretched, yielding or relaxing as the table says."""
        law = self._law()
        if self.fibres:
            families = tuple(FibreFamily(f.direction, f.k1, f.k2, f.dispersion) for f in self.fibres)
            law = FibreReinforced(law, families, name=self.name)
        if self.stretch is not None:
            law = PreStretched(law, *self.stretch)
        if self.hardening is not None:
            law = Plastic(law, self.hardening.build(), name=self.name)
        return Viscoelastic(law, self.prony, name=self.name) if self.prony else law

    def _law(self) -> Any:
        """Return the law alone."""
        if self.law == "user":
            return _user_material(self)
        rest: dict[str, Any] = {"density": self.density, "name": self.name}
        constants = {name: getattr(self, name) for name in _NEEDED[self.law]}
        law: Any = _LARGE[self.law]
        if "young" in constants:
            return law(self.young, self.poisson, **rest)
        if self.bulk is not None:
            return law(**constants, bulk=self.bulk, **rest)
        return law.with_poisson(self.poisson, **constants, **rest)


def _user_material(record: SolidMaterialRecord) -> UserMaterial:
    """Return a material of the user's own from its module.

    The module is imported, so its code runs: a study file with a module is as trusted as a program.
    """
    assert record.module is not None
    assert record.function is not None
    name = record.module
    if name.endswith(".py"):
        path = Path(name).absolute()
        if not path.is_file():
            raise UsageError(
                f"The module {record.module} does not exist.",
                why=f"There is no file {path}; a path starts from the folder of the study file.",
                fix="Correct `module` of the material.",
            )
        if not path.stem.isidentifier():
            raise UsageError(
                f"The module {record.module} can't be imported.",
                why=f"{path.stem!r} is no name in Python.",
                fix="Use letters, digits and underscores in the name of the file.",
            )
        if str(path.parent) not in sys.path:  # processes that solve import it from there too
            sys.path.append(str(path.parent))
        name = path.stem
    try:
        module = importlib.import_module(name)
        found = getattr(module, record.function)
    except (ImportError, AttributeError, SyntaxError) as error:
        raise UsageError(
            f"The function {record.function!r} of {record.module} can't be loaded.",
            why=f"{error}.",
            fix="Define it at the top of that module: def tissue(F, mu=3e3): return …",
        ) from error
    if record.module.endswith(".py") and not Path(record.module).samefile(module.__file__ or "."):
        raise UsageError(
            f"The module {record.module} has the name of another module.",
            why=f"{name!r} is {module.__file__}.",
            fix="Give the file another name.",
        )
    extra: dict[str, Any] = {"density": record.density} | ({"bulk": record.bulk} if record.bulk else {})
    if isinstance(found, UserMaterial):
        if record.constants or record.bulk:
            raise UsageError(
                f"{record.function!r} of {record.module} is a whole material.",
                why="Its constants stand in the module.",
                fix="Leave out `constants` and `bulk`, or name a plain function of F.",
            )
        return found
    return UserMaterial(found, constants=record.constants, name=record.name, **extra)


def _require_known(value: Any) -> Any:
    """Return a material record, or the name of a material, unchanged; refuse a name that is not known."""
    if isinstance(value, str):
        try:
            named_material(value)
        except UsageError as error:
            raise ValueError(" ".join(str(error).split("\n"))) from error
    return value


BeamMaterial: TypeAlias = Annotated[str | MaterialRecord, AfterValidator(_require_known)]
SolidMaterial: TypeAlias = Annotated[str | SolidMaterialRecord, AfterValidator(_require_known)]


def build_material(value: str | MaterialRecord | SolidMaterialRecord) -> Any:
    """Return the material of a name or of a table."""
    return named_material(value) if isinstance(value, str) else value.build()
