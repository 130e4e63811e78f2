"""What a study of a beam that remembers says."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from palpate.study.record import Newtons, Record

__all__ = ["HeldStudy", "HeldTargetRecord"]


class HeldTargetRecord(Record):
    """What is asked on unseen histories, over the largest force."""

    force_median: float = Field(0.01, gt=0, description="force error, median")
    force_p95: float = Field(0.035, gt=0, description="force error, 95th percentile")


class HeldStudy(Record):
    """A beam that yields or creeps, held at its tip and led through histories of loads."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", description="files are named after it")
    preset: Literal["beam-plastic", "beam-viscoelastic"] = Field(description="the body")
    load: Newtons = Field(gt=0, description="the load goes from minus to plus this")
    train: int = Field(ge=1, description="histories to learn from")
    test: int = Field(ge=1, description="further histories, for testing only")
    seed: int = Field(1, ge=0, description="decides the histories; those for testing have another")
    step: float = Field(0.05, gt=0, description="time between two samples in s, where time counts")
    elements: int = Field(20, ge=2, description="finite elements")
    fibres: int = Field(48, ge=4, description="layers of a section that yields")
    tolerance: float = Field(1e-5, gt=0, description="largest relative error of a step")
    target: HeldTargetRecord = HeldTargetRecord()

    @property
    def relaxes(self) -> bool:
        """Whether the body creeps with time; else it yields."""
        return self.preset == "beam-viscoelastic"
