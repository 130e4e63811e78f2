"""Loads on a beam: their tables in a study file."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import Field, model_validator

from palpate.errors import UsageError
from palpate.learning import PRESETS, Settings, recommended
from palpate.options import EnergyOptions, Refinement
from palpate.physics import PointLoad
from palpate.records import Count, Metres, Newtons, Number, Record, Stiffness
from palpate.study.body_records import BodyRecord
from palpate.study.stage_records import SECTIONS, SweepRecord, option_key

if TYPE_CHECKING:
    from palpate.validation import Limits

__all__ = [
    "FilterRecord",
    "LoadLearningRecord",
    "LoadRecord",
    "LoadSweepRecord",
    "LoadTargetRecord",
    "LoadTestRecord",
    "LoadsRecord",
]


class LoadRecord(Record):
    """A point load: one input of the study."""

    name: str = Field(min_length=1, description="name of the input")
    at: Metres | None = Field(
        None, description="position along the beam; left out: the tip", examples=["0.4 m"]
    )
    low: Newtons = Field(description="smallest load")
    high: Newtons = Field(description="largest load")
    direction: tuple[Number, Number] = Field((0.0, -1.0), description="(x, y); (0, -1) pushes down")

    @model_validator(mode="after")
    def _a_range_and_a_direction(self) -> LoadRecord:
        if not self.low < self.high:
            raise ValueError(
                f"its range is empty: low {self.low:g} N is not below high {self.high:g} N; for example "
                'low = "0 N" and high = "5 N"'
            )
        if not any(self.direction):
            raise ValueError("its direction (0, 0) points nowhere")
        return self


class LoadsRecord(Record):
    """Point loads on a beam."""

    kind: Literal["loads"] = "loads"
    loads: tuple[LoadRecord, ...] = Field((LoadRecord(name="P", low=0.0, high=5.0),), min_length=1)

    @model_validator(mode="after")
    def _names_differ(self) -> LoadsRecord:
        if len({load.name for load in self.loads}) < len(self.loads):
            raise ValueError("two loads share a name")
        return self

    def fault(self, body: BodyRecord) -> str:
        """Return what does not fit between the loads and the body; empty if all fits."""
        length = getattr(body, "length", 0.0)
        for load in self.loads:
            if load.at is not None and not 0.0 < load.at <= length:
                return f"the load {load.name!r} at {load.at:g} m is not on the beam, 0 … {length:g} m"
        return ""

    def build(self, body: Any, *, whole: bool = True) -> tuple[PointLoad, ...]:
        """Return the loads."""
        return tuple(PointLoad(p.name, p.at, p.low, p.high, p.direction) for p in self.loads)


class LoadSweepRecord(SweepRecord):
    """Loads that are solved."""

    grows: ClassVar[bool] = False
    element: ClassVar[float | None] = None
    symmetric: ClassVar[bool] = False

    design: Literal["grid", "sobol", "random"] = Field("grid", description="how the ranges are sampled")
    samples: Count = Field(501, ge=4, description="number of solves")

    def arguments(self, problem: Any) -> dict[str, Any]:
        """Return the arguments of `palpate.sweep` that say where to solve."""
        return {"samples": self.samples, "seed": self.seed, "design": self.design}


class LoadTestRecord(Record):
    """Solves that the network never sees."""

    every: Count = Field(2, ge=0, description="one row in so many of the sweep is kept for testing; 0: none")
    random: Count = Field(100, ge=0, description="further solves at random loads")
    seed: Count = Field(7, ge=0, description="decides what is random here")

    def arguments(self, problem: Any) -> dict[str, Any] | None:
        """Return the arguments of `palpate.sweep` that say where to test; None where nothing more is solved."""
        return {"samples": self.random, "seed": self.seed, "design": "random"} if self.random else None


class FilterRecord(Record):
    """The sequential filter (MRAN with an extended Kalman filter)."""

    passes: Count | None = Field(
        None,
        ge=1,
        description="shuffled presentations of the data; left out: 5, or enough for 1,250 observations",
    )
    seed: Count = Field(0, ge=0, description="decides the order")
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

    def build(self, inputs: int) -> Settings:
        """Return the filter's settings for a number of inputs: a named form with single settings changed."""
        form = PRESETS[self.form]() if self.form else recommended(inputs)
        return replace(form, **self.settings)  # type: ignore[arg-type]


class LoadLearningRecord(Record):
    """The refinement, and the coupling at the held node."""

    samples: Count = option_key(Refinement, "samples")
    units_max: Count = option_key(Refinement, "units_max")
    target: Number = option_key(Refinement, "target")
    starts: Count = option_key(Refinement, "starts")
    coupling: Stiffness | None = Field(
        None, description="between hand and node; left out: chosen from the data"
    )
    effort: Number = option_key(EnergyOptions, "effort")

    def options(self) -> dict[str, Any]:
        """Return the options of `palpate.learn`."""
        refinement = Refinement(self.samples, self.units_max, self.target, self.starts)
        return {"refinement": refinement, "coupling": self.coupling, "effort": self.effort}


class LoadTargetRecord(Record):
    """Limits of `palpate validate` for the networks on unseen loads."""

    rmse: Number = Field(5e-6, gt=0, description="refined network, relative to full scale")
    filter_rmse: Number = Field(1e-3, ge=0, description="sequential filter alone; 0: not asked")
    filter_outer_ratio: Number = Field(
        2.0, ge=0, description="its error at the ends over the rest; 0: not asked"
    )
    filter_regression: Number = Field(2.0, ge=0, description="its error over its best so far; 0: not asked")
    force_median: Number = Field(0.01, gt=0, description="relative force error, median")
    force_p95: Number = Field(0.035, gt=0, description="relative force error, 95th percentile")

    def limits(self) -> Limits:
        """Return the limits; a key that is 0 asks nothing."""
        from palpate.validation import Limits

        return Limits(**{name: value or None for name, value in self.model_dump().items()})


SECTIONS["loads"] = {
    "sweep": LoadSweepRecord,
    "test": LoadTestRecord,
    "filter": FilterRecord,
    "learning": LoadLearningRecord,
    "target": LoadTargetRecord,
}
