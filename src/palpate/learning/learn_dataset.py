"""`palpate.learn`: a dataset of solves made into a body that is felt and seen.

What a dataset is of is asked once, here: of the recognisers of palpate, and of all registered baselines.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from palpate import checks
from palpate.dataset import Dataset, Layout
from palpate.errors import UsageError
from palpate.format import count, share
from palpate.learning.bent_body import BentSolves
from palpate.learning.energy import EnergyHistory, SuspectSolve, learn_energy
from palpate.learning.fields import LearntField, learn_snapshots, lumped_mass
from palpate.learning.learning_history import History
from palpate.learning.pad_fit import fit_pad
from palpate.learning.pad_solves import is_padded, pad_solves
from palpate.learning.painted_region import PaintedRegion
from palpate.learning.pressed_solves import PressedSolves, is_pressed
from palpate.learning.search import Budget
from palpate.options import FieldOptions, SearchOptions, takes
from palpate.surrogates import Baseline, ContactLaw, LearntEnergy, Solves, Surrogate
from palpate.surrogates.baselines import registered_baselines
from palpate.surrogates.model_card import suspect_sentences

__all__ = ["LearningHistory", "filter_record", "learn"]

# fields that are learnt where a dataset has them, with what they are called and their units
_SHOWN = {"displacement": ("displacement", "m"), "von_mises": ("von Mises stress", "Pa")}
_FIELD_SHARE = 0.25  # of the energy's limit on time, for each field: most of a shape is found at once
_PAD_UNITS, _PAD_NETWORKS = 192, 4  # of one network and of a mean, for a pad in five dimensions

Log = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class LearningHistory:
    """Record of the learning of a body.

    Attributes
    ----------
    energy : EnergyHistory
        Every network that was tried for the energy, and the error of each solve when it is left out.
    fields : mapping of name to LearntField
        The same of each field.
    solves : int
        Number of solves that were learnt from.
    seconds : float
        How long it took, s.
    filter : History, optional
        Record of the sequential filter, of a body that loads bend.
    """

    energy: EnergyHistory
    solves: int
    seconds: float
    fields: Mapping[str, LearntField] = field(default_factory=dict)
    filter: History | None = None

    @property
    def suspects(self) -> tuple[SuspectSolve, ...]:
        """Solves that contradict their neighbours, by their rows of the dataset."""
        return self.energy.suspects

    def __str__(self) -> str:
        tried = len(self.energy.trials)
        words = f"{self.solves} solves, {tried} networks of the energy tried in {self.seconds:.0f} s"
        left = self.energy.meta.get("left_out", {})
        if left:
            words += (
                f"; a solve left out is missed by {share(left['median'])} of its force (median), "
                f"{share(left['p95'])} (95th percentile)"
            )
        for name, learnt in self.fields.items():
            missed = learnt.truncation
            size = (
                f"{1e3 * missed:.2g} mm" if learnt.field.unit == "m" else f"{missed:.2g} {learnt.field.unit}"
            )
            words += f"; {_SHOWN[name][0]}: {learnt.field.meta['modes']} modes, which miss {size}"
        return "\n".join([words, *suspect_sentences(self.suspects)])

    __repr__ = __str__


def filter_record(history: Any) -> History | None:
    """Return the record of the sequential filter in what a learner returned beside the model, where one ran."""
    own = history.filter if isinstance(history, LearningHistory) else history
    return own if isinstance(own, History) else None


@dataclass(frozen=True, eq=False)
class _Recognised:
    """A dataset's baseline and solves, and what else is known of the body."""

    baseline: Baseline
    solves: Solves
    options: Mapping[str, Any]  # of learning its energy
    learn_field: Callable[[FieldOptions], LearntField] | None = None
    region: Callable[[LearntEnergy], PaintedRegion | None] | None = None  # in place of that around the solves
    fields: Mapping[str, Any] = field(default_factory=dict)  # that are learnt already
    meta: Mapping[str, Any] = field(default_factory=dict)
    filter: History | None = None
    rows: np.ndarray | None = (
        None  # converged solve that each of `solves` is, negative for none; None: in order
    )


@takes(SearchOptions)
def learn(
    train: Dataset,
    *,
    name: str = "body",
    layout: Layout | None = None,
    shape: bool = True,
    leave_out: Sequence[int] = (),
    log: Log = lambda _: None,
    options: SearchOptions,
    **further: Any,
) -> tuple[Surrogate, LearningHistory]:
    """Learn a body that can be felt and seen from a dataset of solves.

    Parameters
    ----------
    train : Dataset
        Of ``palpate.sweep(body, …)``; rows that did not converge are left out. The body's symmetry stands in it.
    name : str
        The body's name, for its record and its page.
    layout : Layout, optional
        Of a mesh that is fine wherever the body shall be touched, where the sweep's is fine in a part only.
    shape : bool
        Whether to learn the displacement of the surface too, and the stress there if it is in the dataset.
    leave_out : sequence of int
        Rows of the dataset, from 0, that are not learnt from: solves which the history names as contradicting their
        neighbours, for example.
    log : callable
        Told what begins, as one line.
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
        If no baseline recognises the data, it lacks energies, has too few solves or none in contact, or lacks a row
        that is to be left out.
    """
    if not isinstance(train, Dataset):
        raise UsageError(
            f"A body is learnt from a Dataset of solves; a {type(train).__name__} came.",
            why="What acts on the body stands in the dataset.",
            fix="Pass what `palpate.sweep` returns; for arrays X and Y use `palpate.fit`.",
        )
    budget, began = Budget.of(options.effort, options.seconds), time.monotonic()
    origin = {"hash": train.ok.hash, "provenance": train.provenance}
    numbers, excluded = _kept_rows(train, leave_out)
    train, solves = train.take(numbers), len(numbers)
    log(f"learning the energy of {count(solves, 'solve')}")
    known = _recognise(train, layout, options, further)
    fields = [name for name in _SHOWN if shape and name in train and known.learn_field is not None]

    def limit(share: float) -> float | None:
        """Return a share of the time that is left; nothing where it is not limited."""
        return None if options.seconds is None else max(share * budget.left, 0.1)

    first = limit(1.0 / (1.0 + _FIELD_SHARE * len(fields)))
    searches = vars(options) | {"seconds": first} | dict(known.options)
    energy, found = learn_energy(known.solves, known.baseline, **searches)
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
    found = found.numbered(np.where(rows < 0, -1, numbers[rows]))
    meta = {**found.meta, **known.meta, **areas, "name": name, "dataset": origin}
    if found.suspects:
        meta["suspects"] = [vars(one) for one in found.suspects]
    if excluded:
        meta["excluded"] = excluded
    surrogate = Surrogate(energy, {**known.fields, **{k: v.field for k, v in learnt.items()}}, meta=meta)
    spent = time.monotonic() - began
    return surrogate, LearningHistory(found, solves, spent, learnt, known.filter)


def _kept_rows(train: Dataset, leave_out: Sequence[int]) -> tuple[np.ndarray, list[int]]:
    """Return the converged rows of a dataset without those to be left out, and the numbers of the latter."""
    for row in leave_out:
        checks.fits("The number of a solve that is left out", row, least=0, most=len(train) - 1, whole=True)
    excluded = sorted({int(row) for row in leave_out})
    return np.setdiff1d(np.flatnonzero(train.converged), excluded), excluded


def _recognise(
    train: Dataset, layout: Layout | None, search: SearchOptions, options: Mapping[str, Any]
) -> _Recognised:
    """Return the first kind of body that a dataset is of; registered baselines are asked last."""
    for kind in (_recognise_bent, _recognise_pressed, _recognise_held, _recognise_registered):
        known = kind(train, layout, search, dict(options))
        if known is not None:
            return known
    acting = train.provenance.get("problem", {}).get("interactions", [])
    raise UsageError(
        "This dataset is of no kind that can be learnt.",
        why=f"On its body act {acting or 'no interactions that its provenance tells'}; no baseline recognises that.",
        fix="Sweep a body under one probe or one glued pad, or register a baseline with `recognise`.",
    )


def _take(options: dict[str, Any], *names: str) -> dict[str, Any]:
    """Return options of these names, and take them out of all."""
    return {name: options.pop(name) for name in names if name in options}


def _recognise_bent(
    train: Dataset, layout: Layout | None, search: SearchOptions, options: dict[str, Any]
) -> _Recognised | None:
    del layout
    if "input_node" not in train:
        return None
    own = _take(options, "heldout", "settings", "refinement", "passes", "coupling", "progress", "watch")
    bent = BentSolves.of(train, search, **own)
    context: dict[str, Any] = {"fields": bent.fields, "meta": bent.meta, "filter": bent.filter.history}
    return _Recognised(bent.baseline, bent.solves, bent.options | options, rows=bent.rows, **context)


def _recognise_registered(
    train: Dataset, layout: Layout | None, search: SearchOptions, options: dict[str, Any]
) -> _Recognised | None:
    del layout, search
    pairs = (cls.recognise(train) for cls in registered_baselines())
    baseline, solves = next((pair for pair in pairs if pair is not None), (None, None))
    if baseline is None or solves is None:
        return None
    return _Recognised(baseline, solves, {**solves.options, **options})


def _recognise_pressed(
    train: Dataset, layout: Layout | None, search: SearchOptions, options: dict[str, Any]
) -> _Recognised | None:
    if not is_pressed(train):
        return None
    pressed = PressedSolves.of(train, layout)

    def learn_field(field: FieldOptions) -> LearntField:
        return learn_snapshots(
            pressed.snapshots(field.name, seed=search.seed),
            inputs=pressed.inputs,
            points=pressed.points,
            triangles=pressed.triangles,
            mass=lumped_mass(pressed.points, pressed.triangles),
            surface=pressed.surface,
            radius=pressed.radius,
            radius_input=pressed.radius_input,
            options=field,
            drawn=pressed.drawn,
        )

    baseline = pressed.baseline
    law, length = options.pop("law", "auto"), options.pop("length", None)
    if isinstance(law, ContactLaw):
        baseline, options["choose"] = replace(baseline, law=law), False
    elif length is not None:
        baseline = replace(baseline, law=ContactLaw("series", length))
    known = {"deepest": pressed.deepest or None}
    region = partial(pressed.painted_region, deviation=options.pop("deviation", None))
    return _Recognised(baseline, pressed.solves, known | options, learn_field, region)


def _recognise_held(
    train: Dataset, layout: Layout | None, search: SearchOptions, options: dict[str, Any]
) -> _Recognised | None:
    del layout, search
    if not is_padded(train):
        return None
    solves = pad_solves(train)
    baseline = fit_pad(solves, **_take(options, "degree", "stiffening"))[0]
    known = {"units_max": _PAD_UNITS, "networks": _PAD_NETWORKS}
    return _Recognised(baseline, solves, known | options)
