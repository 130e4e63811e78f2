"""Tables of the stages of a study, as far as several kinds of interactions share them, and the registry of all.

The keys of a table depend on what acts on the body; each kind says its tables in its own file (`loads_kind`,
`probe_kind`, `tool_kind`, `pinch_kind`, `pad_kind`, `memory_kind`) and enters them in `SECTIONS`. A table says by
itself how its stage is called.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field, model_validator

from palpate.learning.pressed_solves import FEWEST
from palpate.options import EnergyOptions, Options, declarations
from palpate.records import Count, Metres, NewtonMetres, Newtons, Number, Record

if TYPE_CHECKING:
    from palpate.validation import Limits

__all__ = [
    "SECTIONS",
    "EnergyLearningRecord",
    "PressSweepRecord",
    "RuntimeRecord",
    "SweepRecord",
    "TouchTargetRecord",
    "option_key",
]

SECTIONS: dict[str, dict[str, type[Any]]] = {}
"""Records of the tables of each kind of interaction, and of studies of bodies with memory."""


def option_key(record: type[Options], name: str, **more: Any) -> Any:
    """Return the key of a table that an option of a record is: its default, bounds and text."""
    declaration = declarations(record)[name]
    ends = {"ge": declaration.least, "gt": declaration.above, "le": declaration.most, "lt": declaration.below}
    return Field(declaration.default, description=declaration.text, **{**ends, **more})


class SweepRecord(Record):
    """Base of the tables `[sweep]`."""

    grows: ClassVar[bool] = True  # whether more solves may be added and lower the error

    samples: Count = Field(40, ge=4, description="number of solves")
    seed: Count = Field(0, ge=0, description="decides the design")
    workers: Count | None = Field(None, ge=1, description="processes; left out: one per core", examples=[2])
    scheduler: str | None = Field(
        None, description="a running Dask scheduler", examples=["tcp://127.0.0.1:8786"]
    )

    def arguments(self, problem: Any) -> dict[str, Any]:
        """Return the arguments of `palpate.sweep` that say where to solve."""
        return {"samples": self.samples, "seed": self.seed}


class PressSweepRecord(SweepRecord):
    """Touches that are solved: depth series, each from shallow to deep."""

    samples: Count = Field(40, ge=FEWEST, description="number of solves")
    depths: Count = Field(5, ge=1, description="solves in a depth series")
    element: Metres | None = Field(
        None,
        gt=0,
        description="size of elements under what presses; left out: half its radius, less on round and layered bodies "
        "and under edges",
        examples=["4 mm"],
    )

    @model_validator(mode="after")
    def _whole_series(self) -> PressSweepRecord:
        if self.depths > self.samples:
            raise ValueError(f"{self.samples} solves make no depth series of {self.depths}")
        return self

    def arguments(self, problem: Any) -> dict[str, Any]:
        """Return the arguments of `palpate.sweep` that say where to solve."""
        return {"points": problem.design(self.samples, self.seed, depths=self.depths), "seed": self.seed}


class EnergyLearningRecord(Record):
    """The search for the network of the energy."""

    effort: Number = option_key(EnergyOptions, "effort")
    seconds: Number | None = option_key(EnergyOptions, "seconds", examples=[60.0])
    workers: Count | None = option_key(EnergyOptions, "workers", examples=[2])
    units_max: Count = option_key(EnergyOptions, "units_max")
    target: Number = option_key(EnergyOptions, "target")
    seed: Count = option_key(EnergyOptions, "seed")

    def options(self) -> dict[str, Any]:
        """Return the options of `palpate.learn`."""
        return self.model_dump()


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


class RuntimeRecord(Record):
    """The 1 kHz loop and the page: what `palpate view` and `palpate run` do unless they are given options."""

    rate: Number = Field(1000.0, ge=10, le=10000, description="Hz")
    max_force: Newtons = Field(12.0, gt=0, description="largest force; the force is limited to this")
    max_torque: NewtonMetres | None = Field(
        None,
        gt=0,
        description="largest torque on a device that renders one; left out: the device's own limit",
        examples=["50 mN m"],
    )
    friction: Number | None = Field(
        None,
        ge=0,
        description="coefficient of friction of the tool that slides on the body; left out: none",
        examples=[0.3],
    )
    static_friction: Number | None = Field(
        None,
        ge=0,
        description="the same of a tool at rest; left out: as that of one that slides",
        examples=[0.4],
    )
    port: Count = Field(8080, ge=0, le=65535, description="of the page; a busy port moves on to the next")

    @model_validator(mode="after")
    def _static_is_larger(self) -> RuntimeRecord:
        if self.static_friction is not None and (
            self.friction is None or self.static_friction < self.friction
        ):
            raise ValueError(
                "static_friction is the coefficient of a tool at rest: give it beside friction, and no less than that"
            )
        return self
