"""A touch model against unseen solves, and the value that says how it did."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.format import count, length, plain, scientific, share
from palpate.learning import History
from palpate.learning.touch import node_outputs
from palpate.surrogates import TouchModel
from palpate.surrogates.touch import SLACK
from palpate.units import bounds
from palpate.validation.field import FieldErrors, field_errors
from palpate.validation.force import ForceErrors, force_errors, force_samples
from palpate.validation.judge import checks, figures
from palpate.validation.judgement import Judgement
from palpate.validation.limits import Limits
from palpate.validation.loops import LoopWork, loop_work
from palpate.validation.outputs import OutputErrors, output_errors
from palpate.validation.stiffness import StiffnessErrors, stiffness_errors

__all__ = ["Validation", "node_truth", "validate_model", "worse_than_filter"]

NETWORKS = {"refined": "nodes", "filter": "filter"}
"""Networks for the nodes' displacements: what they are called here and in a `TouchModel`."""


@dataclass(frozen=True)
class Validation(Judgement):
    """How a touch model did on solves that it has never seen.

    Attributes
    ----------
    name, samples, checks, notes
        See `Judgement`.
    networks : mapping of str to OutputErrors
        ``refined`` and, if the model holds it, ``filter``.
    field : FieldErrors
    force : ForceErrors
    stiffness : StiffnessErrors or None
    loops : LoopWork or None
    relapse : float or None
        Largest ratio of the filter's held-out error to its best so far.
    """

    networks: Mapping[str, OutputErrors]
    field: FieldErrors
    force: ForceErrors
    stiffness: StiffnessErrors | None
    loops: LoopWork | None
    relapse: float | None

    def details(self) -> list[str]:
        """One line per network."""
        return list(map(_line, self.networks.items()))


def validate_model(
    touch: TouchModel, test: Dataset, *, history: History | None = None, limits: Limits | None = None
) -> Validation:
    """Judge a touch model by solves that it has never seen.

    Parameters
    ----------
    touch : TouchModel
    test : Dataset
        Rows that did not converge are left out.
    history : History, optional
        Of the filter; its held-out error tells whether it was stable.
    limits : Limits, optional
        By default what a person can notice, and 1e-3 of full scale for the refined network.

    Returns
    -------
    Validation

    Raises
    ------
    UsageError
        If the dataset is of another body or of other loads, or has no converged solve in which the body moves.
    """
    test = test.ok
    truth = node_truth(touch, test)
    networks = {
        label: output_errors(touch.networks[key], test.X, truth)
        for label, key in NETWORKS.items()
        if key in touch.networks
    }
    forces = force_samples(touch, test)
    field = field_errors(touch, test)
    units, turning = touch.networks["force"].units, len(touch.touched) > 1
    force = force_errors(forces, test.X, test.ranges, units=units, turning=turning)
    stiffness, loops = stiffness_errors(touch, test, forces.hand), loop_work(touch, test, forces.hand)
    relapse = history.relapse if history is not None and math.isfinite(history.relapse) else None
    notes = [text for text in (stiffness, loops) if isinstance(text, str)]
    if len(touch.touched) == 1:
        notes.append("Direction is not judged: the hand feels one direction only.")
    if force.outside:
        notes.append(_outside(touch, test, force.outside))
    if (worse := worse_than_filter(networks)) is not None:
        notes.append(worse)
    curve = None if isinstance(stiffness, str) else stiffness
    work = None if isinstance(loops, str) else loops
    judged = checks(figures(networks, field, force, curve, work, relapse), limits or Limits())
    return Validation(
        name=touch.name,
        samples=len(test),
        checks=judged,
        notes=tuple(notes),
        networks=networks,
        field=field,
        force=force,
        stiffness=curve,
        loops=work,
        relapse=relapse,
    )


def worse_than_filter(networks: Mapping[str, OutputErrors]) -> str | None:
    """A sentence for a refined network that is worse than the filter it should improve; None if it isn't."""
    if "filter" not in networks or not networks["refined"].rmse > networks["filter"].rmse:
        return None
    refined, own = networks["refined"], networks["filter"]
    return (
        f"The refined network is worse than the sequential filter: RMSE {length(refined.rmse)} against "
        f"{length(own.rmse)}. Allow it more units (`units_max` in [learning]) or more solves (`samples` there)."
    )


def node_truth(touch: TouchModel, data: Dataset) -> np.ndarray:
    """What the model's nodes network should have said about a dataset, (N, m) in m.

    Raises
    ------
    UsageError
        If the dataset does not fit the model, or is empty.
    """
    _check_fits(touch, data)
    quantities, columns = node_outputs(data)
    found, wanted = [q.name for q in quantities], [q.name for q in touch.networks["nodes"].outputs]
    if found != wanted:
        raise UsageError(
            f"The dataset moves {', '.join(found) or 'nothing'}; {touch.name} answers {', '.join(wanted)}.",
            why="Its nodes of interest or the directions of its loads are others.",
            fix="Test with solves of the study that the model was learnt from.",
        )
    return np.stack([data.displacement[:, node, axis] for node, axis in columns], axis=1)


def _outside(touch: TouchModel, test: Dataset, number: int) -> str:
    """How many hand positions count as outside, and why they do where their loads are inside."""
    text = f"{number} of {len(test)} hand positions count as outside the trained range"
    low, high = bounds(touch.inputs)
    if not np.array_equal(np.clip(test.X, low, high), test.X):
        return f"{text}."
    slack = f"{share(SLACK)} of a load's range"
    if touch.compliance > 0:
        slack += ", or the hand by more than 1 % of the reach"
    return (
        f"{text} although their loads are inside: at the border of the trained travel, or where the answer misses "
        f"the load by more than {slack}."
    )


def _check_fits(touch: TouchModel, data: Dataset) -> None:
    if not len(data):
        raise UsageError(
            "There is no converged solve to test with.",
            why="The test set is empty, or each of its solves failed.",
            fix="Sweep some samples that training leaves out.",
        )
    theirs, own = [(r.name, r.unit) for r in data.ranges], [(r.name, r.unit) for r in touch.inputs]
    if theirs != own:
        raise UsageError(
            f"The dataset's inputs are {', '.join(n for n, _ in theirs)}; "
            f"{touch.name} takes {', '.join(n for n, _ in own)}.",
            fix="Test with solves of the study that the model was learnt from.",
        )
    if data.rest.shape != touch.rest[:, :2].shape or not np.allclose(data.rest, touch.rest[:, :2]):
        raise UsageError(
            f"The dataset's {len(data.rest)} nodes are not the {len(touch.rest)} nodes of {touch.name}.",
            fix="Test with solves of the study that the model was learnt from.",
        )


def _line(named: tuple[str, OutputErrors]) -> str:
    """One network in a line."""
    label, e = named
    text = (
        f"{label}: {count(e.units, 'unit')}, RMSE {length(e.rmse)} ({scientific(e.relative)} of full scale)"
    )
    text += f", largest {length(e.max)}"
    return text if e.outer_ratio is None else f"{text}, ends of the range {plain(e.outer_ratio)} × the rest"
