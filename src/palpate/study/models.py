"""What a study of a beam says. Every record is frozen, unknown keys are errors, and quantities may carry units."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from pydantic import Field, field_validator, model_validator

from palpate.errors import UsageError
from palpate.learning import FEWEST, PRESETS, Refinement, Settings
from palpate.physics import named_material
from palpate.study.record import (
    Densities,
    Metres,
    Newtons,
    Pascals,
    QuarticMetres,
    Record,
    RuntimeRecord,
    SquareMetres,
    Stiffness,
    Unit,
)

__all__ = [
    "BodyRecord",
    "FilterRecord",
    "LearningRecord",
    "LoadRecord",
    "MaterialRecord",
    "RuntimeRecord",
    "SectionRecord",
    "Study",
    "SweepRecord",
    "TargetRecord",
    "TestRecord",
    "Unit",
]


class MaterialRecord(Record):
    """A linear elastic material."""

    name: str = Field("own material", description="for the report")
    young: Pascals = Field(description="Young's modulus")
    poisson: float = Field(0.3, description="Poisson's ratio")
    density: Densities = Field(0.0, description="only matters with self-weight")


class SectionRecord(Record):
    """A cross-section: a radius; or a width and a height; or area, second moment and shear factor."""

    radius: Metres | None = Field(None, description="of a circular section", examples=["5 mm"])
    width: Metres | None = Field(
        None, description="of a rectangular section, out of the plane", examples=["25 mm"]
    )
    height: Metres | None = Field(None, description="the same, in the plane of bending", examples=["1 mm"])
    area: SquareMetres | None = Field(None, description="of any section", examples=["25 mm^2"])
    second_moment: QuarticMetres | None = Field(
        None, description="about the axis of bending", examples=["2 mm^4"]
    )
    shear_factor: float | None = Field(
        None, description="share of the area that carries shear", examples=[0.85]
    )

    @model_validator(mode="after")
    def _one_kind(self) -> SectionRecord:
        kinds = ({"radius"}, {"width", "height"}, {"area", "second_moment", "shear_factor"})
        given = {k for k, v in self if v is not None}
        if given not in kinds:
            raise ValueError(
                f"a section is given by radius, or by width and height, or by area, second_moment and "
                f"shear_factor; found {', '.join(sorted(given)) or 'nothing'}"
            )
        return self


class BodyRecord(Record):
    """A plane cantilever, clamped at x = 0."""

    kind: Literal["cantilever"] = "cantilever"
    length: Metres = Field(1.0, description="from clamp to tip")
    section: SectionRecord = SectionRecord(radius=0.005)
    material: str | MaterialRecord = Field(
        "nylon", description='a name, or { young = "70 GPa", poisson = 0.33, density = "2700 kg/m^3" }'
    )
    kinematics: Literal["large", "small"] = Field("large", description="'small' is linear: for checks")
    self_weight: bool = Field(False, description="gravity, 9.80665 m/s² downwards")
    elements: int = Field(20, ge=1, description="finite elements along the beam")
    order: int = Field(3, ge=2, le=8, description="polynomial order of the elements")
    nodes: tuple[Metres, ...] = Field((), description="positions of interest; empty: six, evenly spaced")

    @field_validator("material")
    @classmethod
    def _known_material(cls, value: str | MaterialRecord) -> str | MaterialRecord:
        if isinstance(value, str):
            try:
                named_material(value)
            except UsageError as error:
                raise ValueError(" ".join(str(error).split("\n"))) from error
        return value

    @model_validator(mode="after")
    def _nodes_on_the_beam(self) -> BodyRecord:
        for x in self.nodes:
            if not 0.0 <= x <= self.length:
                raise ValueError(f"the node of interest at {x:g} m is not on the beam, 0 … {self.length:g} m")
        return self


class LoadRecord(Record):
    """A point load: one input of the study."""

    name: str = Field(min_length=1, description="name of the input")
    at: Metres | None = Field(
        None, description="position along the beam; left out: the tip", examples=["0.4 m"]
    )
    low: Newtons = Field(description="smallest load")
    high: Newtons = Field(description="largest load")
    direction: tuple[float, float] = Field((0.0, -1.0), description="(x, y); (0, -1) pushes down")

    @model_validator(mode="after")
    def _a_range_and_a_direction(self) -> LoadRecord:
        if not self.low < self.high:
            raise ValueError(f"its range is empty: low {self.low:g} N is not below high {self.high:g} N")
        if not any(self.direction):
            raise ValueError("its direction (0, 0) points nowhere")
        return self


class SweepRecord(Record):
    """Which loads are solved."""

    design: Literal["grid", "sobol", "random"] = Field("grid", description="how the ranges are sampled")
    samples: int = Field(501, ge=4, description="number of solves")
    seed: int = Field(0, ge=0, description="decides sobol and random designs")
    workers: int | None = Field(None, ge=1, description="processes; left out: one per core", examples=[2])
    scheduler: str | None = Field(
        None, description="a running Dask scheduler", examples=["tcp://127.0.0.1:8786"]
    )


class TestRecord(Record):
    """Which solves the network never sees."""

    every: int = Field(2, ge=0, description="one row in so many of the sweep is kept for testing; 0: none")
    random: int = Field(100, ge=0, description="further solves at random loads")
    seed: int = Field(7, ge=0, description="decides what is random here")


class FilterRecord(Record):
    """The sequential filter (MRAN with an extended Kalman filter)."""

    passes: int | None = Field(
        None,
        ge=1,
        description="shuffled presentations of the data; left out: 5, or enough for 1,250 observations",
    )
    seed: int = Field(0, ge=0, description="decides the order")
    form: str | None = Field(
        None,
        description="a named form, such as 'founding', which repeats the papers'; left out: 'default' for one load, "
        "'shared' for several",
    )
    settings: dict[str, float | int | str | bool] = Field(
        default_factory=dict, description="single settings of the filter, by name"
    )

    @model_validator(mode="after")
    def _known_settings(self) -> FilterRecord:
        if self.form is not None and self.form not in PRESETS:
            raise ValueError(f"there is no form {self.form!r} of the filter; there are {', '.join(PRESETS)}")
        unknown = sorted(set(self.settings) - set(Settings.__dataclass_fields__))
        if unknown:
            known = ", ".join(Settings.__dataclass_fields__)
            raise ValueError(f"the filter has no setting {unknown[0]!r}; it has {known}")
        try:
            replace(Settings(), **self.settings)  # type: ignore[arg-type]
        except UsageError as error:
            raise ValueError(str(error)) from error
        return self


class LearningRecord(Record):
    """The refinement, and the coupling at the held node."""

    samples: int = Field(26, ge=0, description="solves used for refinement; 0: all training solves")
    units_max: int = Field(6, ge=0, description="most units per network")
    target: float = Field(5e-7, ge=0.0, description="leave-one-out error at which growth stops")
    starts: int = Field(4, ge=1, description="starts per number of units")
    coupling: Stiffness | None = Field(
        None, description="between hand and node; left out: chosen from the data"
    )

    def refinement(self) -> Refinement:
        """The learner's own record."""
        return Refinement(self.samples, self.units_max, self.target, self.starts)


class TargetRecord(Record):
    """What `palpate validate` asks of the networks on unseen loads."""

    rmse: float = Field(5e-6, gt=0, description="refined network, relative to full scale")
    filter_rmse: float = Field(1e-3, ge=0, description="sequential filter alone; 0: not asked")
    filter_outer_ratio: float = Field(
        2.0, ge=0, description="its error at the ends over the rest; 0: not asked"
    )
    filter_relapse: float = Field(2.0, ge=0, description="its error over its best so far; 0: not asked")
    force_median: float = Field(0.01, gt=0, description="relative force error, median")
    force_p95: float = Field(0.035, gt=0, description="relative force error, 95th percentile")


class Study(Record):
    """A body, its loads, and everything that is done with them."""

    name: str = Field(
        "beam-nylon", pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", description="files are named after it"
    )
    body: BodyRecord = BodyRecord()
    loads: tuple[LoadRecord, ...] = Field((LoadRecord(name="P", low=0.0, high=5.0),), min_length=1)
    sweep: SweepRecord = SweepRecord()
    test: TestRecord = TestRecord()
    filter: FilterRecord = FilterRecord()
    learning: LearningRecord = LearningRecord()
    target: TargetRecord = TargetRecord()
    runtime: RuntimeRecord = RuntimeRecord()

    @model_validator(mode="after")
    def _parts_fit_together(self) -> Study:
        for load in self.loads:
            if load.at is not None and not 0.0 < load.at <= self.body.length:
                raise ValueError(
                    f"the load {load.name!r} at {load.at:g} m is not on the beam, 0 … {self.body.length:g} m"
                )
        if len({load.name for load in self.loads}) < len(self.loads):
            raise ValueError("two loads share a name")
        kept = self.sweep.samples // self.test.every if self.test.every else 0
        if self.sweep.samples - kept < FEWEST:
            raise ValueError(
                f"{self.sweep.samples - kept} solves are left for training; {FEWEST} are the fewest"
            )
        if not kept and not self.test.random:
            raise ValueError("test.every and test.random are both 0: nothing is kept for testing")
        return self
