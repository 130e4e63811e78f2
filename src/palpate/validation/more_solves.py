"""Advice after a miss: how many solves would keep the limits, by how the errors fell with the solves so far."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from palpate.format import criterion_figure
from palpate.validation.validate import Validation

__all__ = ["advice_on_solves", "learning_curve"]

FALLING = ("force_median", "force_p95", "light_force_p95", "stiffness_p95", "direction_p95")
"""Limits whose figures fall with the number of solves."""

USUAL = 1.0  # exponent of the fall where one number of solves alone is known: errors go as one over it
SLOWEST, FASTEST = 0.5, 2.0  # exponents that two points of a curve may give: they scatter
MOST = 20  # factor of the number of solves, beyond which the curve says nothing
MARGIN = 1.1  # factor on the number of solves, since errors scatter

Curve = Sequence[Mapping[str, Any]]
"""Points of a learning curve: ``{"solves": n, "force_p95": …}``."""


def learning_curve(earlier: Curve, solves: int, validation: Validation) -> list[dict[str, Any]]:
    """Return the curve of earlier surrogates with a validation's point added; one of as many solves is replaced."""
    falling = [c for c in validation.checks if c.criterion.key in FALLING and math.isfinite(c.measured)]
    point: dict[str, Any] = {c.criterion.key: float(c.measured) for c in falling}
    kept = [dict(p) for p in earlier if p["solves"] != solves]
    return sorted([*kept, {"solves": solves} | point], key=lambda p: int(p["solves"]))


def advice_on_solves(validation: Validation, solves: int, curve: Curve, command: str) -> str:
    """Return a sentence on the number of solves that would keep all limits; empty where more solves help nothing.

    It has no full stop, since it may go on with what follows the command; the number follows the command, too.
    """
    missed = [c for c in validation.failures if c.criterion.key in FALLING and math.isfinite(c.measured)]
    if not missed:
        return ""
    needs = {c.criterion.key: _needed(c.criterion.key, c.measured, c.most, solves, curve) for c in missed}
    worst = max(missed, key=lambda c: needs[c.criterion.key][0])
    number, exponent, is_measured = needs[worst.criterion.key]
    kind = worst.criterion.kind
    now, asked = criterion_figure(worst.measured, kind), criterion_figure(worst.limit, kind)
    label = worst.criterion.label.partition(",")[0]
    text = f"{label} from {solves} solves is {now}, {asked} is asked"
    if number > MOST * solves:
        return (
            f"{text}: by the curve so far more than {MOST} times as many solves would be needed. Touch a smaller part "
            "(`over`), press less deep (`depth`), or ask for less (`[target]`)"
        )
    number = _rounded_up(number)
    then = criterion_figure(worst.measured * (solves / number) ** exponent, kind)
    how = "by the curve so far" if is_measured else "if errors fall as one over the number of solves"
    return f"{text}: {number} solves reach about {then} {how}; {command} {number}"


def _needed(key: str, measured: float, limit: float, solves: int, curve: Curve) -> tuple[float, float, bool]:
    """Return the number of solves that keep a limit, the exponent of the fall, and whether that was measured."""
    exponent, is_measured = USUAL, False
    fewer = [p for p in curve if int(p["solves"]) < solves and (p.get(key) or 0.0) > 0.0]
    if fewer and measured > 0:
        first = min(fewer, key=lambda p: int(p["solves"]))
        slope = math.log(float(first[key]) / measured) / math.log(solves / int(first["solves"]))
        exponent, is_measured = min(max(slope, SLOWEST), FASTEST), True
    return MARGIN * solves * (measured / limit) ** (1 / exponent), exponent, is_measured


def _rounded_up(number: float) -> int:
    """Return a number of solves that reads well: the next multiple of 5, 10 or 50."""
    step = 5 if number < 50 else 10 if number < 300 else 50
    return step * math.ceil(number / step)
