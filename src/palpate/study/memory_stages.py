"""Stages of a study of a body with memory: load histories to learn from, and learning from them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from palpate.learning.plastic import LoadHistories, learn_with_memory, solve_elastic, solve_histories
from palpate.physics import Cantilever, LinearElastic, TipLoad
from palpate.physics.materials.plastic import Plastic
from palpate.physics.materials.viscous import Viscoelastic
from palpate.study.interaction_records import LoadRecord, LoadsRecord
from palpate.study.study import Study

__all__ = ["learn_histories", "sweep_histories"]

TEST_SEED = 1000  # distance of the seeds for testing from those of the histories to learn from
BEYOND = 1.05  # reach of the elastic body over that of the learnt histories, for those that go farther


def sweep_histories(study: Study, problem: Any) -> tuple[LoadHistories, LoadHistories]:
    """Return histories to learn from, drawn to the ends of the load, and even ones for testing."""
    assert study.memory is not None
    load, creeps = _load_of(study), isinstance(study.body.build().material, Viscoelastic)
    common: dict[str, Any] = {
        "low": load.low,
        "high": load.high,
        "relaxes": creeps,
        "step": study.memory.step,
    }
    seed = study.memory.seed
    train = solve_histories(problem, count=study.memory.histories, seed=seed, **common)
    test = solve_histories(problem, count=study.memory.unseen, seed=seed + TEST_SEED, outward=0.0, **common)
    return train, test


def learn_histories(study: Study, train: LoadHistories) -> tuple[Any, Any]:
    """Learn a body with memory; the same body without its memory is solved here."""
    body: Any = study.body.build()
    load = _load_of(study)
    elastic = _elastic(body).problem(TipLoad(0.0, load.high, direction=load.direction, name=load.name))
    reach = BEYOND * max(float(np.abs(path.place).max()) for path in train.paths)
    same = solve_elastic(elastic, reach=reach, load=load.high)
    return learn_with_memory(train, same, relaxes=isinstance(body.material, Viscoelastic), name=study.name)


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
