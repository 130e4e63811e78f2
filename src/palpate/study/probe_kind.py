"""A ball that presses a surface: its tables in a study file."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import Field, field_validator, model_validator

from palpate.physics import SphereProbe
from palpate.physics.shapes.naming import members
from palpate.physics.solid.body_symmetry import fundamental_part
from palpate.records import Count, Metres, PadStiffness, Pair, Record, Triple
from palpate.study.body_records import BodyRecord
from palpate.study.interaction_records import OnSurface, require_corners, require_depth, stiffness_or_rigid
from palpate.study.stage_records import SECTIONS, EnergyLearningRecord, PressSweepRecord, TouchTargetRecord

__all__ = ["ProbeLearningRecord", "ProbeRecord", "ProbeSweepRecord", "ProbeTestRecord"]


class ProbeRecord(OnSurface):
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

    _stiffness = field_validator("pad", mode="before")(stiffness_or_rigid)

    @model_validator(mode="after")
    def _in_order(self) -> ProbeRecord:
        require_depth(self.depth)
        require_corners(self.over)
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


class ProbeSweepRecord(PressSweepRecord):
    """Touches that are solved: depth series, each from shallow to deep."""

    symmetric: bool = Field(True, description="solve a part only, where mirror images give the rest")


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


class ProbeLearningRecord(EnergyLearningRecord):
    """The search for the networks of the energy and of the shape."""

    shape: bool = Field(True, description="whether to learn the displacement for the eye")


SECTIONS["probe"] = {
    "sweep": ProbeSweepRecord,
    "test": ProbeTestRecord,
    "learning": ProbeLearningRecord,
    "target": TouchTargetRecord,
}
