"""What a study of a pressed body says. Unknown keys are errors, and quantities may carry units."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, ValidationInfo, field_validator, model_validator

from palpate.learning.bodies.touches import FEWEST
from palpate.physics.shapes.naming import members
from palpate.physics.solid.body_family import BESIDE, UNITS
from palpate.study.record import Metres, PadStiffness, Record, RuntimeRecord, in_si
from palpate.study.touching.shapes import ShapeRecord, known_material

__all__ = [
    "ProbeRecord",
    "TouchLearningRecord",
    "TouchStudy",
    "TouchSweepRecord",
    "TouchTargetRecord",
    "TouchTestRecord",
    "VariedRecord",
    "known_material",
]

Pair = tuple[Metres, Metres]


class ProbeRecord(Record):
    """A rigid ball with a soft skin, its pad; where its centre is, is the input."""

    radius: Metres = Field(0.010, gt=0, description="of the ball")
    touches: str = Field("top", description="surface that it presses")
    pad: PadStiffness = Field(2e6, gt=0, description="stiffness of the pad")
    stop: Metres = Field(0.004, gt=0, description="penetration at which the pad is fully pressed")
    depth: Pair = Field((2e-4, 0.012), description="least and largest depth of the ball's tip, m")
    over: tuple[Pair, Pair] | None = Field(
        None,
        description="lower and upper corner of the touched part, m; left out: the surface less a margin of 3 radii",
        examples=[((0.03, 0.03), (0.07, 0.07))],
    )

    @model_validator(mode="after")
    def _in_order(self) -> ProbeRecord:
        if not 0 <= self.depth[0] < self.depth[1]:
            raise ValueError(f"the depth {self.depth[0]:g} … {self.depth[1]:g} m is no range from 0 on")
        if self.over and not all(a < b for a, b in zip(*self.over, strict=True)):
            raise ValueError("the corners of `over` are not in order: the lower one comes first")
        return self


class VariedRecord(Record):
    """A number of the body or of the ball that is an input beside the position: one model of a family of bodies."""

    path: str = Field(
        min_length=1,
        description="REGION.young or another number of its material, LAYER.thickness, or probe.radius",
        examples=["fat.young"],
    )
    low: float = Field(description='its least value, in SI units or such as "2 kPa"', examples=["2 kPa"])
    high: float = Field(description="its largest value, likewise", examples=["8 kPa"])

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
        """A quantity in the unit of what varies."""
        if "path" not in info.data:  # that has been told already
            return 0.0
        return in_si(value, UNITS.get(str(info.data.get("path", "")).rpartition(".")[2], ""))

    @model_validator(mode="after")
    def _in_order(self) -> VariedRecord:
        if not self.low < self.high:
            raise ValueError(f"{self.low:g} … {self.high:g} is no range: low is less than high")
        return self


class TouchSweepRecord(Record):
    """Which touches are solved: columns into the body, each from shallow to deep."""

    samples: int = Field(40, ge=FEWEST, description="number of solves")
    depths: int = Field(5, ge=1, description="solves in a column")
    seed: int = Field(0, ge=0, description="decides where the columns are")
    symmetric: bool = Field(True, description="solve a part only, where mirror images tell the rest")
    element: Metres | None = Field(
        None,
        gt=0,
        description="size of elements under the ball; left out: half its radius, less on round and layered bodies",
        examples=["4 mm"],
    )
    workers: int | None = Field(None, ge=1, description="processes; left out: one per core", examples=[2])
    scheduler: str | None = Field(
        None, description="a running Dask scheduler", examples=["tcp://127.0.0.1:8786"]
    )


class TouchTestRecord(Record):
    """Touches that the network never sees, in columns of their own."""

    samples: int = Field(200, ge=1, description="number of solves")
    depths: int = Field(4, ge=1, description="solves in a column")
    seed: int = Field(7, ge=0, description="decides where the columns are")


class TouchLearningRecord(Record):
    """The search for the energy's network, and for the shape's."""

    seconds: float | None = Field(
        None,
        gt=0,
        description="for the energy, a quarter as long for the shape; left out: one for each solve, at least 60",
        examples=[60.0],
    )
    workers: int | None = Field(
        None,
        ge=1,
        description="processes that search the energy; left out: one per core, eight at most",
        examples=[2],
    )
    units_max: int = Field(160, ge=0, description="most units of the energy, mirror images among them")
    target: float = Field(1e-3, ge=0.0, description="leave-one-out error at which growth stops")
    shape: bool = Field(True, description="whether to learn the displacement for the eye")
    seed: int = Field(0, ge=0, description="decides the starts")


class TouchTargetRecord(Record):
    """What `palpate validate` asks on unseen touches; 0: not asked."""

    force_median: float = Field(0.01, ge=0, description="relative force error, median")
    force_p95: float = Field(0.035, ge=0, description="the same, 95th percentile")
    light_force_p95: float = Field(0.035, ge=0, description="of light touches, over f₀")
    stiffness_p95: float = Field(0.08, ge=0, description="relative stiffness error, 95th percentile")
    direction_p95: float = Field(5.0, ge=0, description="angle between the forces, degrees")
    displacement_mean: Metres = Field(1e-4, ge=0, description="distance of the shown shape's nodes")
    displacement_max: Metres = Field(3e-4, ge=0, description="the same, largest")
    smoothness: float = Field(1.5, ge=0, description="second difference of the force over the reference's")
    loop_work: float = Field(1e-9, ge=0, description="work around closed paths over the stroke's energy")
    coverage: tuple[float, float] = Field(
        (0.80, 0.97),
        description="share of the errors that the 90 % interval holds, least and most; [0, 1]: not asked",
    )


class TouchStudy(Record):
    """A solid body, the probe that presses it, and everything that is done with them."""

    name: str = Field(
        "block", pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", description="files are named after it"
    )
    body: Annotated[ShapeRecord, Field(discriminator="kind")]
    probe: ProbeRecord = ProbeRecord()
    varied: tuple[VariedRecord, ...] = Field((), description="what makes a family of bodies, if anything")
    sweep: TouchSweepRecord = TouchSweepRecord()
    test: TouchTestRecord = TouchTestRecord()
    learning: TouchLearningRecord = TouchLearningRecord()
    target: TouchTargetRecord = TouchTargetRecord()
    runtime: RuntimeRecord = RuntimeRecord()

    @field_validator("sweep")
    @classmethod
    def _whole_columns(cls, value: TouchSweepRecord) -> TouchSweepRecord:
        if value.depths > value.samples:
            raise ValueError(f"{value.samples} solves make no column of {value.depths}")
        return value

    @model_validator(mode="after")
    def _parts_fit_together(self) -> TouchStudy:
        known = self.body.surface_names()
        for name in (self.probe.touches, *self.body.fixed_names()):
            if not members(name, known):
                raise ValueError(f"a {self.body.kind} has no surface {name!r}; it has {', '.join(known)}")
        paths = [one.path for one in self.varied]
        if len(set(paths)) < len(paths):
            raise ValueError(f"of {', '.join(paths)} one varies twice")
        return self
