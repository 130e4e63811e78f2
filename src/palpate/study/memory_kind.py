"""A body with memory under histories of its load: its tables in a study file, and its stages."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from pydantic import Field

from palpate.dataset import Dataset
from palpate.dataset.histories import elastic_of, histories_of, history_dataset, is_history
from palpate.physics import Cantilever, LinearElastic, TipLoad
from palpate.physics.materials.plastic import Plastic
from palpate.physics.materials.viscous import Viscoelastic
from palpate.records import Count, Number, Record
from palpate.study.loads_kind import LoadRecord, LoadsRecord
from palpate.study.stage_records import SECTIONS
from palpate.sweeps import solve_histories
from palpate.sweeps.solve_histories import solve_elastic

if TYPE_CHECKING:
    from palpate.study.study import Study
    from palpate.validation import Limits

__all__ = ["HistoryTargetRecord", "MemoryRecord", "sweep_histories", "with_elastic"]

TEST_SEED = 1000  # distance of the seeds for testing from those of the histories to learn from


class MemoryRecord(Record):
    """Histories of the load from which the memory of a body that yields or creeps is learnt."""

    histories: Count = Field(10, ge=1, description="histories to learn from")
    unseen: Count = Field(14, ge=1, description="further histories, for testing only")
    seed: Count = Field(1, ge=0, description="decides the histories; those for testing have another seed")
    step: Number = Field(0.05, gt=0, description="time between two samples in s, where time counts")


class HistoryTargetRecord(Record):
    """Limits of `palpate validate` on unseen histories, over the largest force."""

    force_median: Number = Field(0.01, gt=0, description="force error, median")
    force_p95: Number = Field(0.035, gt=0, description="force error, 95th percentile")

    def limits(self) -> Limits:
        """Return the limits."""
        from palpate.validation import Limits

        return Limits(history_force_median=self.force_median, history_force_p95=self.force_p95)


SECTIONS["memory"] = {"target": HistoryTargetRecord}


def sweep_histories(study: Study, problem: Any) -> tuple[Dataset, Dataset]:
    """Return histories to learn from, drawn to the ends of the load, and even ones for testing."""
    assert study.memory is not None
    creeps = isinstance(study.body.build().material, Viscoelastic)
    common: dict[str, Any] = {"relaxes": creeps, "step": study.memory.step}
    seed = study.memory.seed
    train = solve_histories(
        problem, elastic=_elastic_problem(study), count=study.memory.histories, seed=seed, **common
    )
    test = solve_histories(problem, count=study.memory.unseen, seed=seed + TEST_SEED, outward=0.0, **common)
    return train, test


def with_elastic(study: Study, train: Dataset) -> Dataset:
    """Return histories with that of the body without its memory, which files of an earlier version lack; else as is."""
    if not is_history(train) or elastic_of(train) is not None:
        return train
    problem, paths = study.problem(), histories_of(train)
    same = solve_elastic(_elastic_problem(study), paths)
    return history_dataset(paths, train.ranges[0], problem.layout, train.provenance, elastic=same)


def _elastic_problem(study: Study) -> Any:
    """Return the body without its memory under its load, from nothing."""
    load = _load_of(study)
    body: Any = study.body.build()
    return _elastic(body).problem(TipLoad(0.0, load.high, direction=load.direction, name=load.name))


def _load_of(study: Study) -> LoadRecord:
    assert isinstance(study.interaction, LoadsRecord)  # the study's own check
    return study.interaction.loads[0]


def _elastic(body: Cantilever) -> Cantilever:
    """Return the body without its memory: as it is below yield, or at once after a load."""
    material = body.material
    if isinstance(material, Plastic):
        return replace(body, material=material.elastic, fibres=None, tolerance=None)
    assert isinstance(material, Viscoelastic)
    assert isinstance(material.base, LinearElastic)
    return replace(body, material=material.base, tolerance=None)
