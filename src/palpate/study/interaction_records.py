"""Interactions of a study: the table `[interaction]` with a kind, numbers that vary beside it, and memory."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

from pydantic import Field, ValidationInfo, field_validator, model_validator

from palpate.physics import GluedPad, PointLoad, SphereProbe
from palpate.physics.interactions.glued import NO_RIGID_GRIP
from palpate.physics.interactions.sphere import RIGID
from palpate.physics.shapes.naming import members
from palpate.physics.solid.body_family import BESIDE, UNITS
from palpate.physics.solid.body_symmetry import fundamental_part
from palpate.records import Count, Metres, Newtons, Number, PadStiffness, Pair, Record, Triple, in_si
from palpate.study.body_records import BodyRecord

__all__ = [
    "INTERACTIONS",
    "InteractionRecord",
    "LoadRecord",
    "LoadsRecord",
    "MemoryRecord",
    "PadRecord",
    "ProbeRecord",
    "VariedRecord",
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


class _OnSurface(Record):
    """Base of the interactions with a surface of a solid body."""

    touches: str = Field("top", description="surface that it acts on")

    def fault(self, body: BodyRecord) -> str:
        """Return what does not fit between the interaction and the body; empty if all fits."""
        known = body.surface_names()
        for name in (self.touches, *body.fixed_names()):
            if not members(name, known):
                return f"a {body.kind} has no surface {name!r}; it has {', '.join(known)}"
        return ""


class ProbeRecord(_OnSurface):
    """A rigid ball with a soft pad as its skin that presses a surface; the position of its centre is the input."""

    kind: Literal["probe"] = "probe"
    radius: Metres = Field(0.010, gt=0, description="of the ball")
    pad: PadStiffness | Literal["rigid"] = Field(
        2e6, description='stiffness of the pad; "rigid" for a ball without one that is felt'
    )
    stop: Metres = Field(
        0.004, gt=0, description="penetration at which the pad is fully pressed; a rigid ball has none"
    )
    depth: Pair = Field((2e-4, 0.012), description="least and largest depth of the ball's tip, m")
    over: tuple[Pair, Pair] | tuple[Triple, Triple] | None = Field(
        None,
        description="lower and upper corner of the touched part, x and y or x, y and z, m; left out: the surface less "
        "a margin of 3 radii",
        examples=[((0.03, 0.03), (0.07, 0.07))],
    )
    rim: str | None = Field(
        None,
        description="surface around the touched one that the ball may meet too: with it all of the touched one is "
        "pressed, without a margin",
        examples=["rim"],
    )

    def fault(self, body: BodyRecord) -> str:
        """Return what does not fit between the ball and the body; empty if all fits."""
        if (fault := super().fault(body)) or self.rim is None:
            return fault
        known = body.surface_names()
        if not members(self.rim, known):
            return f"a {body.kind} has no surface {self.rim!r} to be the rim; it has {', '.join(known)}"
        return f"the rim {self.rim!r} is held" if self.rim in body.fixed_names() else ""

    @field_validator("pad", mode="before")
    @classmethod
    def _stiffness_or_rigid(cls, pad: Any) -> Any:
        """Return the word of a rigid ball, or a positive stiffness in N/m³."""
        if isinstance(pad, str) and pad.strip().lower() == RIGID:
            return RIGID
        stiffness = in_si(pad, "N/m^3")
        if not stiffness > 0:
            raise ValueError(f'{stiffness:g} is no stiffness of a pad: give one above 0, or "rigid"')
        return stiffness

    @model_validator(mode="after")
    def _in_order(self) -> ProbeRecord:
        if not 0 <= self.depth[0] < self.depth[1]:
            raise ValueError(
                f"the depth {self.depth[0]:g} … {self.depth[1]:g} m is no range from 0 on; it is measured into the "
                'body, the least one first; for example depth = ["0.2 mm", "8 mm"]'
            )
        _require_corners(self.over)
        return self

    def build(self, body: Any, *, whole: bool = True) -> SphereProbe:
        """Return the probe: over all that it shall touch, or over the part that symmetry leaves to be solved."""
        probe = SphereProbe(
            self.radius,
            touches=self.touches,
            pad=self.pad,
            stop=self.stop,
            depth=self.depth,
            over=self.over,
            rim=self.rim,
        )
        return probe if whole else fundamental_part(body, probe)


class PadRecord(_OnSurface):
    """A soft pad that is glued to a surface and displaced; its displacement and its place are the inputs."""

    kind: Literal["pad"] = "pad"
    radius: Metres = Field(0.012, gt=0, description="of the pad")
    pad: PadStiffness = Field(2e6, gt=0, description="stiffness of the pad")
    over: tuple[Pair, Pair] = Field(
        ((0.03, 0.03), (0.07, 0.07)),
        description="lower and upper corner of the places of the pad's middle, m",
    )
    facing: Literal["+x", "-x", "+y", "-y", "+z", "-z"] | None = Field(
        None,
        description="axis along which a surface is seen that faces all ways; left out: the nearest to its normals",
        examples=["+z"],
    )
    displacement: tuple[Pair, Pair, Pair] = Field(
        ((-0.004, 0.004), (-0.004, 0.004), (-0.004, 0.004)), description="ranges along x, y and z, m"
    )

    @field_validator("pad", mode="before")
    @classmethod
    def _no_rigid_grip(cls, pad: Any) -> Any:
        if isinstance(pad, str) and pad.strip().lower() == RIGID:
            raise ValueError(f"a glued pad can't be rigid. {NO_RIGID_GRIP} Give a stiffness such as 2e7")
        return pad

    @model_validator(mode="after")
    def _in_order(self) -> PadRecord:
        _require_corners(self.over)
        for low, high in self.displacement:
            if not low < high:
                raise ValueError(
                    f"the displacement {low:g} … {high:g} m is no range: the lower end comes first; for example "
                    '["-4 mm", "4 mm"] for each of x, y and z'
                )
        return self

    def build(self, body: Any, *, whole: bool = True) -> GluedPad:
        """Return the pad, over all of its places."""
        return GluedPad(
            touches=self.touches,
            radius=self.radius,
            over=self.over,
            pad=self.pad,
            displacement=self.displacement,
            facing=self.facing,
        )


def _require_corners(over: tuple[Any, Any] | None) -> None:
    if over and not all(a < b for a, b in zip(*over, strict=True)):
        raise ValueError(
            "the corners of `over` are not in order: the lower one comes first; for example "
            '[["30 mm", "30 mm"], ["70 mm", "70 mm"]]'
        )


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


class MemoryRecord(Record):
    """Histories of the load from which the memory of a body that yields or creeps is learnt."""

    histories: Count = Field(10, ge=1, description="histories to learn from")
    unseen: Count = Field(14, ge=1, description="further histories, for testing only")
    seed: Count = Field(1, ge=0, description="decides the histories; those for testing have another seed")
    step: Number = Field(0.05, gt=0, description="time between two samples in s, where time counts")


InteractionRecord: TypeAlias = LoadsRecord | ProbeRecord | PadRecord
INTERACTIONS = ("loads", "probe", "pad")
"""Kinds of interactions that a study file can describe."""
