"""A pad that is glued to a surface: its tables in a study file."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import Field, field_validator, model_validator

from palpate.physics import GluedPad
from palpate.physics.interactions.glued import NO_RIGID_GRIP
from palpate.physics.interactions.sphere import RIGID
from palpate.records import Count, Metres, PadStiffness, Pair, Record
from palpate.study.interaction_records import OnSurface, require_corners
from palpate.study.stage_records import SECTIONS, EnergyLearningRecord, SweepRecord, TouchTargetRecord

__all__ = ["PadRecord", "PadSweepRecord", "PadTestRecord"]


class PadRecord(OnSurface):
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
    def _no_rigid_grip(cls, pad: object) -> object:
        if isinstance(pad, str) and pad.strip().lower() == RIGID:
            raise ValueError(f"a glued pad can't be rigid. {NO_RIGID_GRIP} Give a stiffness such as 2e7")
        return pad

    @model_validator(mode="after")
    def _in_order(self) -> PadRecord:
        require_corners(self.over)
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


class PadSweepRecord(SweepRecord):
    """Displacements and places of the pad that are solved."""

    symmetric: ClassVar[bool] = False
    element: Metres | None = Field(
        None,
        gt=0,
        description="size of elements under the pad; left out: a third of its radius",
        examples=["4 mm"],
    )


class PadTestRecord(Record):
    """Displacements and places of the pad that the network never sees."""

    every: ClassVar[int] = 0
    samples: Count = Field(40, ge=1, description="number of solves")
    seed: Count = Field(7, ge=0, description="decides the design")

    def arguments(self, problem: Any) -> dict[str, Any] | None:
        """Return the arguments of `palpate.sweep` that say where to test."""
        return {"samples": self.samples, "seed": self.seed}


SECTIONS["pad"] = {
    "sweep": PadSweepRecord,
    "test": PadTestRecord,
    "learning": EnergyLearningRecord,
    "target": TouchTargetRecord,
}
