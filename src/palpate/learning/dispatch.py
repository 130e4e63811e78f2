"""`pp.learn`: whatever a sweep is of, made into something that can be touched."""

from __future__ import annotations

from typing import Any

from palpate.dataset import Dataset
from palpate.learning.bodies import TouchHistory, is_touched, learn_body
from palpate.learning.grasp import HeldSolves, LearntGrasp, learn_grasp
from palpate.learning.learning_history import History
from palpate.learning.touch import learn_touch
from palpate.surrogates import TouchedBody, TouchModel
from palpate.surrogates.grasp import GraspSurrogate

__all__ = ["learn"]


Learnt = tuple[TouchModel, History] | tuple[TouchedBody, TouchHistory] | tuple[GraspSurrogate, LearntGrasp]


def learn(train: Dataset, **options: Any) -> Learnt:
    """Learn a dataset of solves by the kind of its body.

    Parameters
    ----------
    train : Dataset
        Of a beam under loads, or of a body pressed by a probe or held by a glued pad.
    **options
        Those of `palpate.learning.learn_touch` for a beam, of `palpate.learning.learn_body` for a pressed body, of
        `palpate.learning.grasp.learn_grasp` for a held one.

    Returns
    -------
    TouchModel, History
        Of a beam: a body held at one node, and what its filter did.
    TouchedBody, TouchHistory
        Of a pressed body: touched anywhere, and how it was found.
    GraspSurrogate, LearntGrasp
        Of a body held by a pad.

    Raises
    ------
    UsageError
        If the data is of neither, or too small.
    """
    if isinstance(train, Dataset) and is_touched(train):
        return learn_body(train, **options)
    if isinstance(train, Dataset) and _is_held(train):
        solves = HeldSolves.of(train)
        told = {"symmetry": solves.matrices, "about": solves.about} if len(solves.matrices) > 1 else {}
        found = learn_grasp(
            solves.X,
            solves.energy,
            solves.force,
            solves.stiffness,
            inputs=solves.inputs,
            axes=solves.axes,
            **(told | options),
        )
        return found.surrogate, found
    return learn_touch(train, **options)


def _is_held(data: Dataset) -> bool:
    """Whether a dataset is of a body under one glued pad and nothing else."""
    acting = data.provenance.get("problem", {}).get("interactions", [])
    return [one.get("type") for one in acting] == ["GluedPad"]
