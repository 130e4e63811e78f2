"""The verdict of a validation: the few sentences that a person reads first; table and worst cases are in its text."""

from __future__ import annotations

import math

from palpate.format import criterion_figure, share
from palpate.validation.limits import FORCE_JND
from palpate.validation.report.summary import felt
from palpate.validation.validate import Validation

__all__ = ["verdict", "whole_error_in_words"]

NAMED = 2  # missed limits that are named; the report has all of them


def verdict(validation: Validation) -> list[str]:
    """Return the outcome, the error of the force in per cent and in what a hand notices, and the caution if any."""
    error = _force_error(validation)
    if words := whole_error_in_words(validation.whole_force_error, validation.mesh_part):
        error += f"; {words}"
    elif validation.mesh is not None:  # who gives refined solves asks for it
        error += f"; {validation.mesh.lines()[0]}"
    return [_outcome(validation), error, *([f"caution: {validation.caution}"] if validation.caution else [])]


def whole_error_in_words(whole: float | None, part: float | None) -> str:
    """Return the force error of surrogate and mesh, and the mesh's part in it, in words; "" where it is not known."""
    if whole is None or part is None or math.isnan(part):
        return ""
    return f"force ± {share(whole)} in all, of it the mesh {share(part)}"


def _outcome(validation: Validation) -> str:
    """Return what was judged, and which limits were missed by how much."""
    head = f"{validation.name} on {validation.samples} unseen solves"
    missed = validation.failures
    if not missed:
        return f"{head}: every limit kept"
    named = [
        f"{check.criterion.label}: {criterion_figure(check.measured, check.criterion.kind)} "
        f"({criterion_figure(check.limit, check.criterion.kind)} asked)"
        for check in missed[:NAMED]
    ]
    if len(missed) > NAMED:
        named.append(f"and {len(missed) - NAMED} more")
    return f"{head}: {len(missed)} of {len(validation.checks)} limits missed; {'; '.join(named)}"


def _force_error(validation: Validation) -> str:
    """Return the error of the force on the hand at the median and the 95th percentile, in words too."""
    force, along = validation.force, validation.histories
    if validation.answers is not None:
        worst = max(validation.answers, key=lambda one: one.p95)
        return f"{worst.name} off by at most {share(worst.p95)} of its range for 95 of 100 values"
    if along is not None:
        noticed = felt(along.p95 / FORCE_JND)
        return (
            f"force off by {share(along.median)} of the largest at the median, by at most {share(along.p95)} for 95 of "
            f"100 samples: {noticed}"
        )
    if force is None or force.p95 is None:
        return "no touch in the test was strong enough to judge its force in relative terms"
    return (
        f"force off by {share(force.median)} at the median, by at most {share(force.p95)} for 95 of 100 solves: "
        f"{felt(force.p95_jnd)}"
    )
