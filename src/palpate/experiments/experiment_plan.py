"""The plan of an experiment: a TOML file of what is asked, of which bodies, by which trials, and what is expected.

Everything that chance decides follows from the plan's seed and the participant's label.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field, ValidationError, model_validator

from palpate.errors import StudyError
from palpate.experiments.course import Course
from palpate.experiments.groups import Population
from palpate.experiments.observers import Observer
from palpate.experiments.placement import Adaptive, Constant, Placement, Staircase
from palpate.experiments.psychometric import Psychometric
from palpate.input_files import read_toml
from palpate.record_complaints import complaints
from palpate.records import Count, Metres, Newtons, Number, Record, Triple

__all__ = [
    "Comparison",
    "DeviceRules",
    "Expected",
    "Placed",
    "Plan",
    "Rating",
    "SittingRules",
    "Varied",
    "Wanted",
    "read_plan",
]

_LABEL = r"^[A-Za-z0-9]+$"  # BIDS takes letters and digits alone in labels

Question = Literal["discrimination", "odd-one-out", "detection", "rating"]


class Comparison(Record):
    """A body that is compared with the reference: one condition of the experiment."""

    name: str = Field(pattern=_LABEL)
    file: str


class Varied(Record):
    """The quantity that varies between the intervals of a trial.

    `what` is "force", by whose factor the learnt body is made stiffer or softer, the name of an input of it, or "lump":
    a lump of that radius is hidden in the body. Of discrimination, `low` and `high` are ratios to the reference; of
    detection they are the radius or the input's own values, and `absent` is the input's value where there is no signal.
    """

    what: str = "force"
    low: Number = 0.55
    high: Number = 1.8
    count: Count = Field(default=25, ge=2, le=201)
    absent: Number | None = None
    place: Triple | None = None  # centre of the lump
    stiffer: Number = Field(default=5.0, gt=0.0)  # the lump's modulus over that of the tissue

    @model_validator(mode="after")
    def _in_order(self) -> Varied:
        if not 0.0 < self.low < self.high:
            raise ValueError(
                "low and high are positive, and low is the smaller one: levels are spaced by ratios"
            )
        return self


class Placed(Record):
    """The rule by which levels are chosen."""

    kind: Literal["adaptive", "constant", "staircase"] = "adaptive"
    trials: Count = Field(default=80, ge=2, le=2000)  # counted ones, of each condition
    down: Count = Field(default=2, ge=1, le=6)  # of a staircase: right answers in a row before it goes down
    step_up: Count = Field(default=1, ge=1, le=50)  # of a staircase, in levels
    step_down: Count = Field(default=1, ge=1, le=50)


class SittingRules(Record):
    """The rules of a sitting: practice, catch trials, breaks and times."""

    practice: Count = Field(default=4, ge=0, le=100)  # trials with feedback before the first
    catch: Count = Field(default=4, ge=0, le=200)  # obvious trials, of each condition
    break_every: Count = Field(default=40, ge=1)  # trials
    break_seconds: Number = Field(default=60.0, ge=0.0)
    interval_seconds: Number = Field(default=3.0, gt=0.0, le=120.0)  # from first contact
    pause_seconds: Number = Field(
        default=1.0, ge=0.5, le=30.0
    )  # before each interval; it hides a change of body
    depth: Metres | None = Field(default=None, gt=0.0)  # guided; by default half of the trained depth
    limit_minutes: Number = Field(default=45.0, gt=0.0)


class DeviceRules(Record):
    """The device, and the limits that protect a person."""

    name: str = "page"
    max_force: Newtons = Field(default=3.0, gt=0.0, le=20.0)
    dead_man: bool = False


class Wanted(Record):
    """The aim of the experiment: equivalence within a margin, with a power, by so many people."""

    people: Count = Field(default=12, ge=2, le=1000)
    margin: Number = Field(default=0.5, gt=0.0)  # of equivalence, in JNDs
    level: Number = Field(default=0.05, gt=0.0, lt=0.5)
    power: Number = Field(default=0.8, gt=0.0, lt=1.0)


class Expected(Record):
    """The people who are expected; logarithms of ratios, as the levels are."""

    spread: Number = Field(default=0.2, gt=0.0)  # σ of the middle person
    spread_between: Number = Field(default=0.3, ge=0.0)  # standard deviation of ln σ over people
    location: Number | None = None  # μ; by default 0 of discrimination, else the middle of the levels
    location_between: Number = Field(default=0.05, ge=0.0)
    lapse: Number = Field(default=0.02, ge=0.0, lt=0.5)
    side: Number = 0.0
    fatigue: Number = Field(default=0.0, ge=0.0)
    learning: Number = Field(default=0.0, ge=0.0)


class Rating(Record):
    """A statement that is rated from 1 to 7."""

    name: str = Field(pattern=_LABEL)
    text: str


class Plan(Record):
    """A plan of an experiment with people, as its file says it.

    Attributes
    ----------
    name : str
        Name of the experiment, letters and digits.
    question : str
        ``"discrimination"``, ``"odd-one-out"``, ``"detection"`` or ``"rating"``.
    seed : int
        From which all that chance decides follows, with the participant's label.
    consent : str
        Text to which a person agrees before the first trial, of at least 40 characters.
    ask : str
        Question after each trial; "" for the usual words.
    reference : str
        File of the learnt body with which others are compared.
    comparison : tuple of Comparison
        The bodies that are compared with it, at least one.
    vary : Varied
        The quantity that varies, and its levels.
    placement : Placed
        The rule by which levels are chosen, and the number of trials.
    sitting : SittingRules
        Practice, catch trials, breaks and times.
    device : DeviceRules
        The device, and the limits that protect a person.
    wanted : Wanted
        The aim: equivalence within a margin, with a power.
    expect : Expected
        The people who are expected, for simulation.
    rating : tuple of Rating
        Statements that are rated; none by default.
    """

    name: str = Field(pattern=_LABEL)
    question: Question = "discrimination"
    seed: Count = 0
    consent: str = Field(min_length=40)
    ask: str = ""  # what is asked after each trial; "" for the usual words
    reference: str
    comparison: tuple[Comparison, ...] = Field(min_length=1)
    vary: Varied = Varied()
    placement: Placed = Placed()
    sitting: SittingRules = SittingRules()
    device: DeviceRules = DeviceRules()
    wanted: Wanted = Wanted()
    expect: Expected = Expected()
    rating: tuple[Rating, ...] = ()

    @model_validator(mode="after")
    def _fits_together(self) -> Plan:
        names = [c.name for c in self.comparison]
        if len(set(names)) < len(names):
            raise ValueError("two comparisons have the same name")
        if self.question == "rating" and not self.rating:
            raise ValueError("a plan of ratings needs at least one [[rating]] with name and text")
        if self.question == "odd-one-out" and self.vary.low <= 1.0:
            raise ValueError(
                "of the odd one out, vary.low is a ratio above 1: its levels are how different it is"
            )
        if self.question == "discrimination" and not self.vary.low < 1.0 < self.vary.high:
            raise ValueError("of discrimination, vary.low is below 1 and vary.high above: softer and stiffer")
        if self.question == "detection" and self.vary.what == "force":
            raise ValueError('of detection, vary.what is "lump" or an input of the body')
        if self.vary.what == "lump" and (self.question != "detection" or self.vary.place is None):
            raise ValueError("a lump is for detection, and needs vary.place, its centre in m")
        return self

    @property
    def function(self) -> Psychometric:
        """The psychometric function that the task fixes."""
        if self.question == "discrimination":
            return Psychometric("signed")
        return Psychometric("correct", guess=1.0 / 3.0 if self.question == "odd-one-out" else 0.5)

    @property
    def levels(self) -> np.ndarray:
        """Levels x (L,), rising: ln of the ratio; of the odd one out ln ln of it, of detection ln of the value."""
        low, high, count = np.log(self.vary.low), np.log(self.vary.high), self.vary.count
        if self.question == "odd-one-out":
            low, high = np.log(low), np.log(high)
        return np.linspace(low, high, count)

    def value(self, level: float) -> float:
        """Return the ratio, or the input's value, of a level."""
        return float(np.exp(np.exp(level)) if self.question == "odd-one-out" else np.exp(level))

    def course(self) -> Course:
        """Return the course of trials of one condition."""
        levels, p = self.levels, self.placement
        placement: Placement
        if p.kind == "constant":
            placement = Constant(levels, p.trials)
        elif p.kind == "adaptive":
            placement = Adaptive(levels, self.function)
        else:
            if self.question == "discrimination":  # strengths, to which a sign is drawn
                largest = min(-levels[0], levels[-1])
                levels = np.geomspace(largest / 30.0, largest, max(self.vary.count, 3) // 2 + 1)
            placement = Staircase(levels, p.down, p.step_up, p.step_down)
        return Course(placement, self.function, p.trials, self.sitting.catch)

    def observer(self) -> Observer:
        """Return the middle person who is expected."""
        e = self.expect
        usual = 0.0 if self.question == "discrimination" else float(self.levels.mean())
        location = usual if e.location is None else e.location
        return Observer(location, e.spread, e.lapse, e.side, e.fatigue, e.learning)

    def population(self) -> Population:
        """Return the people who are expected."""
        return Population(self.observer(), self.expect.location_between, self.expect.spread_between)

    @property
    def question_words(self) -> str:
        """The question after each trial."""
        usual = {
            "discrimination": "Which one was stiffer?",
            "odd-one-out": "Which one was different?",
            "detection": "Which one had the lump?",
            "rating": "How was it?",
        }
        return self.ask or usual[self.question]

    @property
    def intervals(self) -> int:
        """Number of touches of a trial."""
        return {"odd-one-out": 3, "rating": 1}.get(self.question, 2)

    def seed_of(self, participant: str, purpose: str) -> np.random.Generator:
        """Return the generator of what chance decides for a participant, or for whatever the purpose names."""
        digest = hashlib.sha256(f"{self.seed}/{participant}/{purpose}".encode()).digest()
        return np.random.default_rng(list(digest))


def read_plan(path: str | os.PathLike[str]) -> Plan:
    """Read a plan.

    Raises
    ------
    StudyError
        If the file is missing, is no TOML, or says something that a plan can't mean: all such places are listed.
    """
    path = Path(path)
    if not path.exists():
        raise StudyError(f"{path} does not exist.", fix="Write a plan with `palpate experiment plan`.")
    try:
        return Plan.model_validate(read_toml(path))
    except ValidationError as error:
        raise StudyError(
            f"{path} does not describe an experiment:",
            why="\n".join(f"  {line}" for line in complaints(error, Plan, "plan")),
            fix="`palpate experiment plan --print` shows every key with its meaning.",
        ) from error
