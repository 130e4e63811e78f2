"""`palpate.learn`: a dataset of solves made into a surrogate: what a hand feels where there is one, fields, numbers.

What a dataset is of is asked once, of the registry in `recognised`. Where nothing that a hand feels is recognised, its
numbers, fields and curves are learnt as they are.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from palpate import checks
from palpate.dataset import Dataset, Layout
from palpate.errors import UsageError
from palpate.format import share
from palpate.learning import bent_body, pad_solves, plastic, pressed_solves  # noqa: F401  # which enter the kinds that they recognise
from palpate.learning.arrays.fit import fit
from palpate.learning.arrays.fitted import Fitted
from palpate.learning.arrays.input_bends import choose_bends
from palpate.learning.dataset_answers import DatasetAnswers
from palpate.learning.energy import SuspectSolve, learn_energy
from palpate.learning.energy.learn_energy import EnergyHistory
from palpate.learning.fields import LearntField, LearntModes, learn_modes
from palpate.learning.learning_history import History
from palpate.learning.lumps import LumpPresses, learn_lumps
from palpate.learning.plastic import MemoryFit
from palpate.learning.recognised import Recognised, Request, recognise
from palpate.learning.search import Budget
from palpate.options import FieldOptions, FitOptions, SearchOptions, takes
from palpate.surrogates import LearntQuantities, Surrogate
from palpate.surrogates.model_card import suspect_sentences

__all__ = ["LearningHistory", "filter_record", "learn"]

# fields that are learnt where a dataset has them, with what they are called and their units
_SHOWN = {"displacement": ("displacement", "m"), "von_mises": ("von Mises stress", "Pa")}
_FIELD_SHARE = 0.25  # of the energy's limit on time, for each field: most of a shape is found at once

_LEAST_EFFORT = 0.5  # of a fit's own: numbers beside an energy take a second

Log = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class LearningHistory:
    """Record of the learning of a body.

    Attributes
    ----------
    energy : EnergyHistory, optional
        Every network that was tried for the energy, and the error of each solve when it is left out; None where no
        hand feels anything.
    fields : mapping of name to LearntField or LearntModes
        The same of each field.
    quantities : mapping of name to Fitted
        The same of each group of numbers.
    notes : tuple of str
        What was left out of the dataset, and why.
    solves : int
        Number of solves that were learnt from.
    seconds : float
        How long it took, s.
    filter : History, optional
        Record of the sequential filter, of a body that loads bend.
    memory : MemoryFit, optional
        How well the memory of a body fits the histories.
    """

    energy: EnergyHistory | None
    solves: int
    seconds: float
    fields: Mapping[str, LearntField | LearntModes] = field(default_factory=dict)
    filter: History | None = None
    quantities: Mapping[str, Fitted] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    memory: MemoryFit | None = None

    @property
    def suspects(self) -> tuple[SuspectSolve, ...]:
        """Solves that contradict their neighbours, by their rows of the dataset."""
        return () if self.energy is None else self.energy.suspects

    def __str__(self) -> str:
        if self.energy is None:
            lines = [f"{self.solves} solves, learnt in {self.seconds:.0f} s", *self.notes]
            lines += [
                f"{name}: error {share(one.heldout)} of its spread on solves left out"
                for name, one in self.quantities.items()
            ]
            return "\n  ".join([*lines, *map(str, self.fields.values())])
        tried = len(self.energy.trials)
        noun = "solves" if self.memory is None else "samples of histories"
        words = f"{self.solves} {noun}, {tried} networks of the energy tried in {self.seconds:.0f} s"
        left = self.energy.meta.get("left_out", {})
        if left:
            words += (
                f"; a solve left out is missed by {share(left['median'])} of its force (median), "
                f"{share(left['p95'])} (95th percentile)"
            )
        for name, learnt in self.fields.items():
            if isinstance(learnt, LearntModes):
                continue
            missed = learnt.truncation
            size = (
                f"{1e3 * missed:.2g} mm" if learnt.field.unit == "m" else f"{missed:.2g} {learnt.field.unit}"
            )
            words += f"; {_SHOWN[name][0]}: {learnt.field.meta['modes']} modes, which miss {size}"
        memory = [] if self.memory is None else [str(self.memory)]
        return "\n".join([words, *memory, *suspect_sentences(self.suspects)])

    __repr__ = __str__


def filter_record(history: Any) -> History | None:
    """Return the record of the sequential filter in what a learner returned beside the model, where one ran."""
    own = history.filter if isinstance(history, LearningHistory) else history
    return own if isinstance(own, History) else None


@takes(SearchOptions)
def learn(
    train: Dataset,
    *,
    name: str = "body",
    layout: Layout | None = None,
    shape: bool = True,
    leave_out: Sequence[int] = (),
    log: Log = lambda _: None,
    on_step: Log = lambda _: None,
    options: SearchOptions,
    **further: Any,
) -> tuple[Surrogate, LearningHistory]:
    """Learn a surrogate from a dataset of solves.

    Of a body under a probe, a pad or loads it is what a hand feels and an eye sees; of any other dataset its numbers,
    its fields over nodes or cells, and its curves along an axis such as time.

    Parameters
    ----------
    train : Dataset
        Of ``palpate.sweep(body, …)`` or `palpate.import_results`; rows that did not converge are left out. The body's
        symmetry stands in it.
    name : str
        The surrogate's name, for its record and its page.
    layout : Layout, optional
        Of a mesh that is fine wherever the body shall be touched, where the sweep's is fine in a part only.
    shape : bool
        Whether to learn the displacement of the surface too, and the stress there if it is in the dataset.
    leave_out : sequence of int
        Rows of the dataset, from 0, that are not learnt from: solves which the history names as contradicting their
        neighbours, for example.
    log : callable
        Told what begins, as one line.
    on_step : callable
        Told each step of the search for the energy that begins, in words.
    **further
        Options of `palpate.learning.energy.learn_energy`, such as ``units_max``, ``target`` and ``networks``. Of a
        pressed body also ``law``, a contact law that is taken as it is, ``length``, a guess of the depth at which pad
        and body cross, m, or ``deviation``, the largest relative deviation of the force that counts as trained where a
        surface was pressed all over; of a held one those of `palpate.learning.fit_pad`. Of one that loads bend
        ``settings`` of the sequential filter and its ``passes`` over the data, five or as many as make 1,250
        observations;
        ``refinement``, by default of 26 solves and 6 units for one load, of all solves and more units for several; the
        stiffness ``coupling`` between hand and node, N/m, by default none for one touched load and four times the mean
        lateral stiffness for several; ``heldout``, unseen solves on which the filter's error is recorded; ``progress``,
        called with (done, total) observations; and ``watch``, a recorder of the filter's growth.

    Returns
    -------
    Surrogate
        The learnt body.
    LearningHistory
        How it was found.

    Raises
    ------
    UsageError
        If the data lack energies where a hand touches, have too few solves or none in contact, nothing to learn, or
        lack a row that is to be left out.
    """
    if not isinstance(train, Dataset):
        raise UsageError(
            f"A body is learnt from a Dataset of solves; a {type(train).__name__} came.",
            why="What acts on the body stands in the dataset.",
            fix="Pass what `palpate.sweep` returns; for arrays X and Y use `palpate.fit`.",
        )
    budget, began = Budget.of(options.effort, options.seconds), time.monotonic()
    numbers, excluded = _kept_rows(train, leave_out)
    train, solves = train.take(numbers), len(numbers)
    origin = {"hash": train.ok.hash, "provenance": train.provenance}
    known = recognise(train, Request(options, layout, further, log))
    if known is None:
        _refuse_options(further)
        return _learn_answers(train, name, options, log)
    log(f"learning the energy of {train.size_in_words}")
    fields = [name for name in _SHOWN if shape and name in train and known.learn_field is not None]

    def limit(share: float) -> float | None:
        """Return a share of the time that is left; nothing where it is not limited."""
        return None if options.seconds is None else max(share * budget.left, 0.1)

    first = limit(1.0 / (1.0 + _FIELD_SHARE * len(fields)))
    searches = vars(options) | {"seconds": first} | dict(known.options)
    asked: dict[str, Any] = {"rivals": known.rivals, "on_step": on_step}
    energy, found = learn_energy(known.solves, known.baseline, **asked, **searches)
    painted = None if known.region is None else known.region(energy)
    energy = energy if painted is None else replace(energy, region=painted.region)
    learnt: dict[str, LearntField] = {}
    for i, shown in enumerate(fields):
        assert known.learn_field is not None
        log("learning the shape" if shown == "displacement" else "learning the stress")
        searches = vars(options) | {"seconds": limit(1.0 / (len(fields) - i))}
        learnt[shown] = known.learn_field(FieldOptions(name=shown, unit=_SHOWN[shown][1], **searches))
    # a region by the paint does not remember where it was solved; a validation asks for it
    areas = {} if painted is None else {"painted": painted.record(), "solved_at": train.ok.X.tolist()}
    rows = np.arange(solves) if known.rows is None else known.rows
    found = found.renumber(np.where(rows < 0, -1, numbers[rows]))
    meta = {**found.meta, **known.meta, **areas, "name": name, "dataset": origin, **_doubts(found, excluded)}
    beside = _learn_beside(known, options, limit(1.0), log)
    memory, fit = (None, None) if known.memory is None else known.memory(energy)
    if memory is not None:
        del meta["solves"]  # a history is none
    lumps = learn_lumps(LumpPresses.of(train), log) if "lump_energy" in train else None
    drawn = {**known.fields, **{k: v.field for k, v in learnt.items()}}
    surrogate = Surrogate(energy, drawn, memory, meta, _quantities(beside), lumps=lumps)
    spent = time.monotonic() - began
    return surrogate, LearningHistory(
        found, solves, spent, learnt, known.filter, quantities=beside, memory=fit
    )


def _doubts(found: EnergyHistory, excluded: list[int]) -> dict[str, Any]:
    """Return what the record says of solves that contradict their neighbours or were left out; nothing without."""
    suspects = {"suspects": [vars(one) for one in found.suspects]} if found.suspects else {}
    return suspects | ({"excluded": excluded} if excluded else {})


def _learn_beside(
    known: Recognised, options: SearchOptions, seconds: float | None, log: Log
) -> dict[str, Fitted]:
    """Return the numbers that are learnt beside an energy, by the names of their groups."""
    fitted: dict[str, Fitted] = {}
    for name, learn_numbers in known.numbers.items():
        log(f"learning the {name}")
        effort = FitOptions().effort * max(options.effort, _LEAST_EFFORT)
        part = learn_numbers(FitOptions(effort=effort, seconds=seconds, seed=options.seed))
        if part is not None:
            fitted[name] = part
    return fitted


def _quantities(numbers: Mapping[str, Fitted]) -> dict[str, LearntQuantities]:
    return {group: part for group, one in numbers.items() for part in one.surrogate().quantities.values()}


def _kept_rows(train: Dataset, leave_out: Sequence[int]) -> tuple[np.ndarray, list[int]]:
    """Return the converged rows of a dataset without those to be left out, and the numbers of the latter."""
    for row in leave_out:
        checks.fits("The number of a solve that is left out", row, least=0, most=len(train) - 1, whole=True)
    excluded = sorted({int(row) for row in leave_out})
    return np.setdiff1d(np.flatnonzero(train.converged), excluded), excluded


def _refuse_options(options: Mapping[str, Any]) -> None:
    if options:
        raise UsageError(
            f"The option {next(iter(options))!r} is of bodies that a hand feels.",
            why="No baseline recognises this dataset, so its numbers and fields are learnt.",
            fix="Leave it out, or register a baseline with `recognise`.",
        )


def _learn_answers(
    train: Dataset, name: str, options: SearchOptions, log: Log
) -> tuple[Surrogate, LearningHistory]:
    """Learn the numbers, fields and curves of a dataset that no hand feels."""
    budget, began = Budget.of(options.effort, options.seconds), time.monotonic()
    answers = DatasetAnswers.of(train)
    numbers: dict[str, Fitted] = {}
    fields: dict[str, LearntModes] = {}
    with threadpool_limits(1):  # one choice: the parts leave together, as networks of the same inputs
        bends = choose_bends(answers.X, answers.tables(), answers.inputs)
    for group, part in answers.numbers.items():
        log(group)
        search = _fit_options(options, budget, len(answers.numbers) + len(answers.fields) - len(numbers))
        numbers[group] = fit(
            *(answers.X, part.values, list(answers.inputs), list(part.outputs)), bends=bends, options=search
        )
    for shown, one in answers.fields.items():
        log(f"{shown} at {one.places}")
        search = _fit_options(options, budget, len(answers.fields) - len(fields))
        fields[shown] = learn_modes(
            answers.X,
            one.values,
            inputs=answers.inputs,
            places=one.places,
            name=shown,
            unit=one.unit,
            components=one.components,
            bends=bends,
            options=search,
        )
    meta = {
        "name": name,
        "solves": len(answers.X),
        "dataset": {"hash": train.ok.hash, "provenance": train.provenance},
        "left_out": {
            **{f"{group}, error of its spread": one.heldout for group, one in numbers.items()},
            **{
                f"{shown}, error of its range, 95th percentile": one.relative for shown, one in fields.items()
            },
        },
    }
    surrogate = Surrogate(
        fields={shown: one.field for shown, one in fields.items()},
        meta=meta,
        quantities=_quantities(numbers),
    )
    spent = time.monotonic() - began
    return surrogate, LearningHistory(
        None, len(answers.X), spent, fields, quantities=numbers, notes=answers.notes
    )


def _fit_options(options: SearchOptions, budget: Budget, left: int) -> FitOptions:
    """Return the options of a fit that takes its share of the time, so many fits being left."""
    seconds = None if options.seconds is None else max(budget.left / left, 0.1)
    workers = 1 if options.workers is None else options.workers
    effort = FitOptions().effort * options.effort
    return FitOptions(effort=effort, seconds=seconds, workers=workers, seed=options.seed)
