"""Tables of the stages of a study: what is solved, what is kept for testing, how it is learnt and what is asked.

The keys of a table depend on what acts on the body (`SECTIONS`). A table says by itself how its stage is called.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import Field, model_validator

from palpate.errors import UsageError
from palpate.learning import PRESETS, Settings, recommended
from palpate.learning.pressed_solves import FEWEST
from palpate.options import EnergyOptions, Options, Refinement, declarations
from palpate.records import Count, Metres, Newtons, Number, Record, Stiffness

if TYPE_CHECKING:
    from palpate.validation import Limits

__all__ = [
    "SECTIONS",
    "FilterRecord",
    "HistoryTargetRecord",
    "LoadLearningRecord",
    "LoadSweepRecord",
    "LoadTargetRecord",
    "LoadTestRecord",
    "PadLearningRecord",
    "PadSweepRecord",
    "PadTestRecord",
    "ProbeLearningRecord",
    "ProbeSweepRecord",
    "ProbeTestRecord",
    "RuntimeRecord",
    "TouchTargetRecord",
]


def _key(record: type[Options], name: str, **more: Any) -> Any:
    """Return the key of a table that an option of a record is: its default, bounds and text."""
    declaration = declarations(record)[name]
    ends = {"ge": declaration.least, "gt": declaration.above, "le": declaration.most, "lt": declaration.below}
    return Field(declaration.default, description=declaration.text, **{**ends, **more})


class _SweepRecord(Record):
    """Base of the tables `[sweep]`."""

    samples: Count = Field(40, ge=4, description="number of solves")
    seed: Count = Field(0, ge=0, description="decides the design")
    workers: Count | None = Field(None, ge=1, description="processes; left out: one per core", examples=[2])
    scheduler: str | None = Field(
        None, description="a running Dask scheduler", examples=["tcp://127.0.0.1:8786"]
    )

    def arguments(self, problem: Any) -> dict[str, Any]:
        """Return the arguments of `palpate.sweep` that say where to solve."""
        return {"samples": self.samples, "seed": self.seed}


class LoadSweepRecord(_SweepRecord):
    """Loads that are solved."""

    element: ClassVar[float | None] = None
    symmetric: ClassVar[bool] = False

    design: Literal["grid", "sobol", "random"] = Field("grid", description="how the ranges are sampled")
    samples: Count = Field(501, ge=4, description="number of solves")

    def arguments(self, problem: Any) -> dict[str, Any]:
        """Return the arguments of `palpate.sweep` that say where to solve."""
        return {"samples": self.samples, "seed": self.seed, "design": self.design}


class PadSweepRecord(_SweepRecord):
    """Displacements and places of the pad that are solved."""

    symmetric: ClassVar[bool] = False
    element: Metres | None = Field(
        None,
        gt=0,
        description="size of elements under the pad; left out: a third of its radius",
        examples=["4 mm"],
    )


class ProbeSweepRecord(_SweepRecord):
    """Touches that are solved: depth series, each from shallow to deep."""

    samples: Count = Field(40, ge=FEWEST, description="number of solves")
    depths: Count = Field(5, ge=1, description="solves in a depth series")
    symmetric: bool = Field(True, description="solve a part only, where mirror images give the rest")
    element: Metres | None = Field(
        None,
        gt=0,
        description="size of elements under the ball; left out: half its radius, less on round and layered bodies",
        examples=["4 mm"],
    )

    @model_validator(mode="after")
    def _whole_series(self) -> ProbeSweepRecord:
        if self.depths > self.samples:
            raise ValueError(f"{self.samples} solves make no depth series of {self.depths}")
        return self

    def arguments(self, problem: Any) -> dict[str, Any]:
        """Return the arguments of `palpate.sweep` that say where to solve."""
        return {"points": problem.design(self.samples, self.seed, depths=self.depths), "seed": self.seed}


class LoadTestRecord(Record):
    """Solves that the network never sees."""

    every: Count = Field(2, ge=0, description="one row in so many of the sweep is kept for testing; 0: none")
    random: Count = Field(100, ge=0, description="further solves at random loads")
    seed: Count = Field(7, ge=0, description="decides what is random here")

    def arguments(self, problem: Any) -> dict[str, Any] | None:
        """Return the arguments of `palpate.sweep` that say where to test; None where nothing more is solved."""
        return {"samples": self.random, "seed": self.seed, "design": "random"} if self.random else None


class PadTestRecord(Record):
    """Displacements and places of the pad that the network never sees."""

    every: ClassVar[int] = 0
    samples: Count = Field(40, ge=1, description="number of solves")
    seed: Count = Field(7, ge=0, description="decides the design")

    def arguments(self, problem: Any) -> dict[str, Any] | None:
        """Return the arguments of `palpate.sweep` that say where to test."""
        return {"samples": self.samples, "seed": self.seed}


class ProbeTestRecord(Record):
    """Touches that the network never sees, in depth series of their own."""

    every: ClassVar[int] = 0
    samples: Count = Field(200, ge=1, description="number of solves")
    depths: Count = Field(4, ge=1, description="solves in a depth series")
    seed: Count = Field(7, ge=0, description="decides where the series are")
    finer: Count = Field(
        3,
        ge=0,
        description="of these, how many are solved again on elements half as large, for the mesh's part in the error; "
        "0: none, and that part stays unknown",
    )

    def arguments(self, problem: Any) -> dict[str, Any] | None:
        """Return the arguments of `palpate.sweep` that say where to test."""
        return {"points": problem.design(self.samples, self.seed, depths=self.depths), "seed": self.seed}


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

    samples: Count = _key(Refinement, "samples")
    units_max: Count = _key(Refinement, "units_max")
    target: Number = _key(Refinement, "target")
    starts: Count = _key(Refinement, "starts")
    coupling: Stiffness | None = Field(
        None, description="between hand and node; left out: chosen from the data"
    )
    effort: Number = _key(EnergyOptions, "effort")

    def options(self) -> dict[str, Any]:
        """Return the options of `palpate.learn`."""
        refinement = Refinement(self.samples, self.units_max, self.target, self.starts)
        return {"refinement": refinement, "coupling": self.coupling, "effort": self.effort}


class PadLearningRecord(Record):
    """The search for the network of the energy."""

    effort: Number = _key(EnergyOptions, "effort")
    seconds: Number | None = _key(EnergyOptions, "seconds", examples=[60.0])
    workers: Count | None = _key(EnergyOptions, "workers", examples=[2])
    units_max: Count = _key(EnergyOptions, "units_max")
    target: Number = _key(EnergyOptions, "target")
    seed: Count = _key(EnergyOptions, "seed")

    def options(self) -> dict[str, Any]:
        """Return the options of `palpate.learn`."""
        return self.model_dump()


class ProbeLearningRecord(PadLearningRecord):
    """The search for the networks of the energy and of the shape."""

    shape: bool = Field(True, description="whether to learn the displacement for the eye")


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


class TouchTargetRecord(Record):
    """Limits of `palpate validate` on unseen solves; 0: not asked."""

    force_median: Number = Field(0.01, ge=0, description="relative force error, median")
    force_p95: Number = Field(0.035, ge=0, description="relative force error, 95th percentile")
    light_force_p95: Number = Field(0.035, ge=0, description="of light touches, over f₀")
    mesh_force: Number = Field(
        0.035, ge=0, description="the mesh's part in the force error, by finer elements"
    )
    stiffness_p95: Number = Field(0.08, ge=0, description="relative stiffness error, 95th percentile")
    direction_p95: Number = Field(5.0, ge=0, description="angle between the forces, degrees")
    displacement_mean: Metres = Field(1e-4, ge=0, description="mean distance of the shown shape's nodes")
    displacement_max: Metres = Field(3e-4, ge=0, description="largest distance of a node")
    smoothness: Number = Field(1.5, ge=0, description="second difference of the force over the reference's")
    loop_work: Number = Field(1e-9, ge=0, description="work around closed paths over the stroke's energy")
    coverage: tuple[Number, Number] = Field(
        (0.80, 0.97),
        description="share of the errors that the 90 % interval holds, least and most; [0, 1]: not asked",
    )

    def limits(self) -> Limits:
        """Return the limits; a key that is 0 asks nothing."""
        from palpate.validation import Limits

        asked = self.model_dump()
        band = asked.pop("coverage")
        values: dict[str, Any] = {name: value or None for name, value in asked.items()}
        values["border_loop_work"] = values["loop_work"]
        return Limits(**values, interval_coverage=None if band == (0.0, 1.0) else band)


class HistoryTargetRecord(Record):
    """Limits of `palpate validate` on unseen histories, over the largest force."""

    force_median: Number = Field(0.01, gt=0, description="force error, median")
    force_p95: Number = Field(0.035, gt=0, description="force error, 95th percentile")

    def limits(self) -> Limits:
        """Return the limits."""
        from palpate.validation import Limits

        return Limits(history_force_median=self.force_median, history_force_p95=self.force_p95)


class RuntimeRecord(Record):
    """The 1 kHz loop and the page: what `palpate view` and `palpate run` do unless they are given options."""

    rate: Number = Field(1000.0, ge=10, le=10000, description="Hz")
    max_force: Newtons = Field(12.0, gt=0, description="largest force; the force is limited to this")
    port: Count = Field(8080, ge=0, le=65535, description="of the page; a busy port moves on to the next")


SECTIONS: dict[str, dict[str, type[Any]]] = {
    "loads": {
        "sweep": LoadSweepRecord,
        "test": LoadTestRecord,
        "filter": FilterRecord,
        "learning": LoadLearningRecord,
        "target": LoadTargetRecord,
    },
    "probe": {
        "sweep": ProbeSweepRecord,
        "test": ProbeTestRecord,
        "learning": ProbeLearningRecord,
        "target": TouchTargetRecord,
    },
    "pad": {
        "sweep": PadSweepRecord,
        "test": PadTestRecord,
        "learning": PadLearningRecord,
        "target": TouchTargetRecord,
    },
    "memory": {"target": HistoryTargetRecord},
}
"""Records of the tables of each kind of interaction, and of studies of bodies with memory."""
