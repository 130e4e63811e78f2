"""`validate`: a touch model against unseen solves, and the value that says how it did."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.dataset import Dataset
from palpate.errors import AccuracyError, UsageError
from palpate.learning import History
from palpate.learning.touch import node_outputs
from palpate.surrogates import TouchModel
from palpate.surrogates.touch import SLACK
from palpate.units import bounds
from palpate.validation.field import FieldErrors, field_errors
from palpate.validation.force import ForceErrors, force_errors, force_samples
from palpate.validation.judge import checks, figures
from palpate.validation.limits import Check, Limits
from palpate.validation.loops import LoopWork, loop_work
from palpate.validation.outputs import OutputErrors, output_errors
from palpate.validation.stiffness import StiffnessErrors, stiffness_errors
from palpate.validation.words import count, length, plain, scientific, share, shown

__all__ = ["Validation", "node_truth", "validate", "worse_than_filter"]

NETWORKS = {"refined": "nodes", "filter": "filter"}
"""Networks for the nodes' displacements: what they are called here and in a `TouchModel`."""


@dataclass(frozen=True)
class Validation:
    """How a touch model did on solves that it has never seen.

    Attributes
    ----------
    name : str
        Of the model.
    samples : int
        Unseen solves.
    networks : mapping of str to OutputErrors
        ``refined`` and, if the model holds it, ``filter``.
    field : FieldErrors
    force : ForceErrors
    stiffness : StiffnessErrors or None
    loops : LoopWork or None
    relapse : float or None
        Largest ratio of the filter's held-out error to its best so far.
    checks : tuple of Check
        What was judged.
    notes : tuple of str
        What was not judged, and why.
    """

    name: str
    samples: int
    networks: Mapping[str, OutputErrors]
    field: FieldErrors
    force: ForceErrors
    stiffness: StiffnessErrors | None
    loops: LoopWork | None
    relapse: float | None
    checks: tuple[Check, ...]
    notes: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether every limit is kept."""
        return not self.failures

    @property
    def failures(self) -> tuple[Check, ...]:
        """The checks that failed."""
        return tuple(c for c in self.checks if not c.passed)

    def raise_if_failed(self) -> None:
        """Do nothing if every limit is kept.

        Raises
        ------
        AccuracyError
            What was measured, what was asked and where the worst case is, for every limit missed.
        """
        if self.passed:
            return
        count = f"{len(self.failures)} of {len(self.checks)} limits"
        raise AccuracyError(
            f"{self.name} misses {count} on {self.samples} solves that it has never seen.",
            why="\n".join(_without_fix(c) for c in self.failures),
            fix=" ".join(dict.fromkeys(c.criterion.fix for c in self.failures)),
        )

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain data for a JSON file; figures that are not finite become null."""
        judged = [
            {
                "name": c.criterion.key,
                "measured": c.measured,
                "limit": c.limit,
                "good": c.criterion.good,
                "grade": c.grade,
                "passed": c.passed,
                "where": c.where,
            }
            for c in self.checks
        ]
        data = {f.name: getattr(self, f.name) for f in dataclasses.fields(self) if f.name != "checks"}
        plain: dict[str, Any] = _plain({"passed": self.passed, **data, "checks": judged})
        return plain

    def __str__(self) -> str:
        rows = [("", "measured", "asked", "good", "")]
        for c in self.checks:
            kind, good = c.criterion.kind, c.criterion.good
            rows.append(
                (
                    c.criterion.label,
                    shown(c.measured, kind),
                    shown(c.limit, kind),
                    "" if good is None else shown(good, kind),
                    c.grade.upper() if c.grade == "fail" else c.grade,
                )
            )
        widths = [max(len(r[i]) for r in rows) for i in range(5)]
        table = [
            "  " + "  ".join(cell.ljust(w) for cell, w in zip(r, widths, strict=True)).rstrip() for r in rows
        ]
        verdict = (
            "every limit kept" if self.passed else f"{len(self.failures)} of {len(self.checks)} limits missed"
        )
        lines = [
            f"{self.name} on {self.samples} unseen solves: {verdict}",
            *table,
            *map(_line, self.networks.items()),
        ]
        return "\n".join(lines + [f"  {note}" for note in self.notes])


def validate(
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
    field, force = field_errors(touch, test), force_errors(touch, test, forces)
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
        touch.name, len(test), networks, field, force, curve, work, relapse, judged, tuple(notes)
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
        f"  {label}: {count(e.units, 'unit')}, RMSE {length(e.rmse)} ({scientific(e.relative)} of full scale)"
    )
    text += f", largest {length(e.max)}"
    return text if e.outer_ratio is None else f"{text}, ends of the range {plain(e.outer_ratio)} × the rest"


def _without_fix(check: Check) -> str:
    return str(check).removesuffix(check.criterion.fix).rstrip()


def _plain(value: Any) -> Any:
    """Dataclasses, arrays and mappings as JSON-able data."""
    if dataclasses.is_dataclass(value):
        return {f.name: _plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value
