"""`validate`: a model against solves that it has never seen, one result for every kind of model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from palpate.dataset import Dataset
from palpate.errors import AccuracyError
from palpate.format import count, criterion_figure
from palpate.learning import History
from palpate.learning.learn_dataset import LearningHistory
from palpate.output_files import json_data
from palpate.surrogates import Surrogate
from palpate.surrogates.model_card import suspect_sentences
from palpate.validation.figures import FIGURES
from palpate.validation.figures.figure import Figure
from palpate.validation.limits import CRITERIA, Check, Limits
from palpate.validation.subject import Subject
from palpate.validation.unseen_solves import TouchFunction, TouchSolves

__all__ = ["ENOUGH", "Validation", "checks", "measure", "validate"]

_NAMES = frozenset(name for name, _ in FIGURES)
ENOUGH = 20
"""Unseen solves below which the 95th percentile of their errors is hardly less than the largest."""

_MORE = (
    "Learn from more solves, placed where the worst cases are, or let learning take longer: `samples` in [sweep], "
    "`seconds` and `units_max` in [learning], or options of palpate.learn."
)
_LEARNT = ("force_median", "force_p95", "light_force_p95", "stiffness_p95", "direction_p95")
_ENERGY_FIXES = dict.fromkeys((*_LEARNT, "displacement_mean", "displacement_max"), _MORE) | {
    "loop_work": "The force is not the gradient of an energy: learn the energy and take its gradient, as palpate.learn "
    "does."
}
"""Advice after a miss of a model whose force is a function of place, with a study file or without."""


@dataclass(frozen=True)
class Validation:
    """Figures of a model on solves that it has never seen, and how they compare with limits.

    Each figure is an attribute too, None where it does not apply or could not be measured: `validation.force.p95`.

    Attributes
    ----------
    name : str
        Of the model.
    samples : int
        Unseen solves.
    checks : tuple of Check
        Figures compared with limits.
    notes : tuple of str
        What was not judged, and why.
    figures : mapping of name to Figure
        ``force``, ``energy``, ``torque``, ``stiffness``, ``smoothness``, ``coverage``, ``contrast``, ``loops``,
        ``border_loops``, ``shape``, ``mesh``, ``networks``, ``histories``, ``parts``, ``worst``, ``answers``: see
        `palpate.validation.figures`.
    """

    name: str
    samples: int
    checks: tuple[Check, ...]
    notes: tuple[str, ...]
    figures: Mapping[str, Figure] = field(default_factory=dict)

    def __getattr__(self, name: str) -> Any:
        """Return a figure by its name, None where there is none."""
        if name in _NAMES:
            return self.figures.get(name)
        raise AttributeError(f"a Validation has no attribute {name!r}")

    @property
    def passed(self) -> bool:
        """True if every limit is kept."""
        return not self.failures

    @property
    def failures(self) -> tuple[Check, ...]:
        """Checks that failed."""
        return tuple(c for c in self.checks if not c.passed)

    @property
    def mesh_part(self) -> float | None:
        """Part of the mesh in the relative force error, estimated from finer elements; None where it is not known."""
        return None if self.mesh is None else self.mesh.part

    @property
    def whole_force_error(self) -> float | None:
        """Relative force error of surrogate and mesh, the sum of the former at the 95th percentile and the latter."""
        if self.mesh_part is None or self.force is None or self.force.p95 is None:
            return None
        return float(self.force.p95 + self.mesh_part)

    @property
    def caution(self) -> str:
        """A sentence where the unseen solves are too few to judge by; "" where they suffice, or histories judge."""
        if self.samples >= ENOUGH or self.force is None:
            return ""
        return (
            f"{count(self.samples, 'unseen solve')} can't judge much: of fewer than {ENOUGH} the 95th percentile is as "
            f"good as the largest error. Test with {ENOUGH} or more."
        )

    def raise_if_failed(self) -> None:
        """Do nothing if every limit is kept.

        Raises
        ------
        AccuracyError
            What was measured, what was asked and where the worst case is, for every limit missed.
        """
        if self.passed:
            return
        missed = f"{len(self.failures)} of {len(self.checks)} limits"
        raise AccuracyError(
            f"{self.name} misses {missed} on {self.samples} solves that it has never seen.",
            why="\n".join(str(c).removesuffix(c.criterion.fix).rstrip() for c in self.failures),
            fix=" ".join(dict.fromkeys(c.criterion.fix for c in self.failures)),
        )

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain data for a JSON file; values that are not finite become null."""
        checks = [
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
        data = {"passed": self.passed, "name": self.name, "samples": self.samples}
        data |= {"caution": self.caution, "notes": self.notes}
        plain: dict[str, Any] = json_data({**data, **self.figures, "checks": checks})
        return plain

    def summary(self) -> dict[str, Any]:
        """Return the few values that a file of the model keeps, for whoever opens it later."""
        found: dict[str, Any] = {"unseen solves": self.samples}
        if self.networks is not None:
            found["displacement RMSE / full scale"] = self.networks.refined.relative
        if self.answers is not None:
            for one in self.answers:
                found[f"{one.name}, error over its range, 95th percentile"] = one.p95
            return {**found, "limits kept": self.passed}
        force = self.histories if self.force is None else self.force
        if self.histories is not None:
            found["unseen histories"] = self.histories.count
        found["force error, median"] = force.median
        found["force error, 95th percentile"] = force.p95
        if self.torque is not None:
            found["torque error over force times the tool's size, 95th percentile"] = self.torque.p95
        if self.whole_force_error is not None:
            found["force error with the mesh's"] = self.whole_force_error
            found["force error, the mesh's part"] = self.mesh_part
        if self.contrast is not None:
            found["contrast error of lumps, median"] = self.contrast.median
            found["contrast error of lumps, 95th percentile"] = self.contrast.p95
        found["limits kept"] = self.passed
        return {**found, "caution": self.caution} if self.caution else found

    def details(self) -> list[str]:
        """Return the lines below the table of limits."""
        return [line for figure in self.figures.values() for line in figure.lines()]

    def __str__(self) -> str:
        rows = [("", "measured", "asked", "good", "")]
        for c in self.checks:
            kind, good = c.criterion.kind, c.criterion.good
            rows.append(
                (
                    c.criterion.label,
                    criterion_figure(c.measured, kind),
                    criterion_figure(c.limit, kind),
                    "" if good is None else criterion_figure(good, kind),
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
        head = f"{self.name} on {self.samples} unseen solves: {verdict}"
        caution = [f"  Caution: {self.caution}"] if self.caution else []
        return "\n".join([head, *caution, *table, *(f"  {line}" for line in (*self.details(), *self.notes))])


def validate(
    model: Surrogate | TouchFunction,
    test: Dataset | TouchSolves,
    *,
    history: History | LearningHistory | None = None,
    refined: Dataset | TouchSolves | None = None,
    strokes: Sequence[TouchSolves] = (),
    limits: Limits | None = None,
    seed: int = 0,
) -> Validation:
    """Judge a model by solves that it has never seen, in units that a person feels.

    Parameters
    ----------
    model : Surrogate or TouchFunction
        What `palpate.learn` made; or any force as a function of place.
    test : Dataset, TouchSolves or load histories
        Rows that did not converge, or that the model was trained on, are left out. `TouchSolves` holds arrays. A body
        with memory is judged by load histories.
    history : LearningHistory or History, optional
        What `palpate.learn` returned beside the model, or the record of a sequential filter alone: its held-out
        error tells whether the filter was stable.
    refined : Dataset or TouchSolves, optional
        Some of the places solved with half the element size: three give the mesh's part in the force error, 20 the
        error of surrogate and mesh together.
    strokes : sequence of TouchSolves, optional
        Solves along strokes, beside which smoothness is judged; by default random strokes beside the model itself.
    limits : Limits, optional
        By default what a person can notice.
    seed : int
        Of the random strokes and loops.

    Returns
    -------
    Validation
        Printed a table; `passed`, `checks`, `raise_if_failed()`, `as_dict()`.

    Raises
    ------
    UsageError
        If the solves are of another body, or of no use as a test.
    """
    result = measure(
        Subject.of(model, test, history=history, refined=refined, strokes=strokes, seed=seed), limits
    )
    suspects = suspect_sentences((getattr(model, "meta", None) or {}).get("suspects", ()))
    return replace(result, notes=(*result.notes, *suspects))


def measure(subject: Subject, limits: Limits | None = None) -> Validation:
    """Return all figures that can be measured of a subject, compared with limits."""
    figures: dict[str, Figure] = {}
    reasons: list[str] = []
    for name, function in FIGURES:
        result = function(subject)
        if isinstance(result, str):
            reasons.append(result)
        elif result is not None:
            figures[name] = result
    fixes = {} if subject.function is None else _ENERGY_FIXES
    own = [note for figure in figures.values() for note in figure.notes()]
    return Validation(
        name=subject.name,
        samples=subject.count or sum(len(getattr(f, "off", ())) for f in figures.values()),
        checks=checks(figures.values(), limits or Limits(), fixes),
        notes=(*reasons, *subject.notes, *own),
        figures=figures,
    )


def checks(figures: Any, limits: Limits, fixes: Mapping[str, str]) -> tuple[Check, ...]:
    """Compare figures with limits, in the order of `CRITERIA`; a limit of None asks nothing.

    `fixes` has advice after a miss by limit's name, where it differs from the criterion's.
    """
    measured = {key: value for figure in figures for key, value in figure.measured().items()}
    found = []
    for criterion in CRITERIA:
        limit = getattr(limits, criterion.key)
        value, worst = measured.get(criterion.key, (None, None))
        if limit is not None and value is not None:
            advised = replace(criterion, fix=fixes.get(criterion.key, criterion.fix))
            found.append(Check(advised, value, limit, str(worst) if worst else ""))
    return tuple(found)
