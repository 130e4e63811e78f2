"""Stages of a study of a body with memory: load histories to learn from, and those that judge."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from palpate.dataset import Dataset
from palpate.dataset.histories import elastic_of, histories_of, history_dataset, is_history
from palpate.physics import Cantilever, LinearElastic, TipLoad
from palpate.physics.materials.plastic import Plastic
from palpate.physics.materials.viscous import Viscoelastic
from palpate.study.interaction_records import LoadRecord, LoadsRecord
from palpate.study.study import Study
from palpate.sweeps import solve_histories
from palpate.sweeps.solve_histories import solve_elastic

__all__ = ["sweep_histories", "with_elastic"]

TEST_SEED = 1000  # distance of the seeds for testing from those of the histories to learn from


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
