"""The outlook of a plan before anyone sits down: how well one person is measured, and the power of the group's test."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.experiments.experiment_plan import Plan
from palpate.experiments.groups import power_curve
from palpate.experiments.simulation import Simulated, simulate_course

__all__ = ["Outlook", "foresee"]

_SIZES = (6, 8, 10, 12, 16, 20, 24, 32, 48, 64)
_LOW, _HIGH = 0.93, 0.97  # coverage of a 95 % interval that is fair


@dataclass(frozen=True)
class Outlook:
    """The outlook of a plan: one person, simulated many times, the same with fatigue and learning, and the power."""

    plan: Plan
    person: Simulated
    tired: Simulated | None  # with the plan's fatigue and learning; None where it expects none
    power: dict[int, float]  # by number of people, of the equivalence test where bodies are the same

    @property
    def reaches(self) -> bool:
        """True where the plan's people reach the power that is wanted; plans without that test do."""
        return not self.power or self.power[self.plan.wanted.people] >= self.plan.wanted.power

    @property
    def enough(self) -> int | None:
        """The least number of people, of those tried, that reach the power; None where none does."""
        return next((n for n, share in sorted(self.power.items()) if share >= self.plan.wanted.power), None)

    def __str__(self) -> str:
        lines = [str(self.person)]
        chance = 2.0 * math.sqrt(0.05 * 0.95 / self.person.people)  # of a share that is 95 %
        shares = (self.person.location_coverage, self.person.spread_coverage)
        if not all(_LOW - chance <= share <= _HIGH + chance for share in shares):
            lines.append(
                "  these intervals don't hold the truth in 93 to 97 %: see the levels, or give more trials"
            )
        if self.tired is not None:
            lines.append("with the fatigue and the learning that are expected, against the JND at rest:")
            lines.append(str(self.tired).partition("\n")[2])
        if self.power:
            w = self.plan.wanted
            lines.append(
                f"power to show equivalence within {w.margin:g} JND at {w.level:g}, where it is true:"
            )
            lines.append(
                "  " + ", ".join(f"{n} people {share:.0%}" for n, share in sorted(self.power.items()))
            )
        return "\n".join(lines)

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as data for a program."""
        return {
            "person": self.person.as_dict(),
            "tired": None if self.tired is None else self.tired.as_dict(),
            "power": {str(n): share for n, share in self.power.items()},
            "reaches": self.reaches,
            "enough": self.enough,
        }


def foresee(
    plan: Plan, people: int = 1000, seed: int = 0, progress: Callable[[str], None] = lambda _: None
) -> Outlook:
    """Return the outlook of a plan, by so many simulated people."""
    course, observer = plan.course(), plan.observer()
    steady = replace(observer, fatigue=0.0, learning=0.0)
    person = simulate_course(course, steady, people, seed, progress)
    tired = None if steady == observer else simulate_course(course, observer, people, seed + 1, progress)
    power: dict[int, float] = {}
    if plan.question == "discrimination":
        progress("The power of the group's test is simulated …")
        sizes = np.array(sorted({*_SIZES, plan.wanted.people}))
        shares = power_curve(
            course,
            plan.population(),
            sizes,
            margin=plan.wanted.margin,
            level=plan.wanted.level,
            people=max(people // 2, 50),
            seed=seed,
        )
        power = dict(zip(sizes.tolist(), shares.tolist(), strict=True))
    return Outlook(plan, person, tired, power)
