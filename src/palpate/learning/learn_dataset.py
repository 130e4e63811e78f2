"""`palpate.learn`: a dataset of solves made into a body that is felt and seen.

What a dataset is of is asked once, here: of the recognisers of palpate, and of all registered baselines.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from palpate.dataset import Dataset, Layout
from palpate.errors import UsageError
from palpate.format import count, share
from palpate.learning.bent_body import learn_bent
from palpate.learning.energy import EnergyHistory, learn_energy
from palpate.learning.fields import LearntField, learn_snapshots, lumped_mass
from palpate.learning.learning_history import History
from palpate.learning.pad_fit import fit_pad
from palpate.learning.pad_solves import is_padded, pad_solves
from palpate.learning.pressed_solves import PressedSolves, is_pressed
from palpate.learning.search import Budget
from palpate.surrogates import Baseline, ContactLaw, Solves, Surrogate
from palpate.surrogates.baselines import registered_baselines

__all__ = ["LearningHistory", "filter_record", "learn"]

_SHOWN = {
    "displacement": ("displacement", "m"),
    "von_mises": ("von Mises stress", "Pa"),
}  # fields that are learnt where a dataset has them, with what they are called and their units
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
        return words

    __repr__ = __str__


def filter_record(history: Any) -> History | None:
    """Return the record of the sequential filter in what a learner returned beside the model, where one ran."""
    own = history.filter if isinstance(history, LearningHistory) else history
    return own if isinstance(own, History) else None


@dataclass(frozen=True, eq=False)
class _Recognised:
    """A dataset's baseline and solves, what learning its energy is asked for, and how its fields are learnt."""

    baseline: Baseline
    solves: Solves
    options: Mapping[str, Any]
    learn_field: Callable[[str, str, dict[str, Any]], LearntField] | None = None


def learn(
    train: Dataset,
    *,
    name: str = "body",
    layout: Layout | None = None,
    shape: bool = True,
    effort: float = 1.0,
    seconds: float | None = None,
    workers: int | None = None,
    seed: int = 0,
    log: Log = lambda _: None,
    **options: Any,
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
    effort : float
        Multiplies the counts of candidates and iterations of the searches; 0.1 gives a quick look.
    seconds : float, optional
        Limit on time for all searches; by default none.
    workers : int, optional
        Processes that search at a time; one for each core by default. The result is the same with any number.
    seed : int
        Decides all starts, and with them the result.
    log : callable
        Told what begins, as one line.
    **options
        Further ones of `palpate.learning.energy.learn_energy`, such as ``units_max``, ``target`` and ``networks``. Of a
        pressed body also ``law``, a contact law that is taken as it is, or ``length``, a guess of the depth at which
        pad and body cross, m; of a held one those of `palpate.learning.fit_pad`; of one that loads
        bend those of `palpate.learning.learn_bent`.

    Returns
    -------
    Surrogate
        The learnt body.
    LearningHistory
        How it was found.

    Raises
    ------
    UsageError
        If no baseline recognises the data, it lacks energies, or has too few solves or none in contact.
    """
    if not isinstance(train, Dataset):
        raise UsageError(
            f"A body is learnt from a Dataset of solves; a {type(train).__name__} came.",
            why="What acts on the body stands in the dataset.",
            fix="Pass what `palpate.sweep` returns; for arrays X and Y use `palpate.fit`.",
        )
    if "input_node" in train:
        began = time.monotonic()
        log(f"energy and shape of {count(len(train.ok), 'solve')}")
        bent = learn_bent(
            train, name=name, effort=effort, seconds=seconds, workers=workers, seed=seed, **options
        )
        spent = time.monotonic() - began
        return bent.surrogate, LearningHistory(bent.energy, len(train.ok), spent, filter=bent.filter.history)
    budget, began = Budget.of(effort, seconds), time.monotonic()
    known = _recognise(train, layout, options)
    common: dict[str, Any] = {"effort": effort, "workers": workers, "seed": seed}
    fields = [name for name in _SHOWN if shape and name in train and known.learn_field is not None]

    def limit(share: float) -> float | None:
        """Return a share of the time that is left; nothing where it is not limited."""
        return None if seconds is None else max(share * budget.left, 0.1)

    solves = len(known.solves.X)
    log(f"energy of {solves} solves")
    first = limit(1.0 / (1.0 + _FIELD_SHARE * len(fields)))
    energy, found = learn_energy(
        known.solves, known.baseline, **(common | {"seconds": first} | dict(known.options))
    )
    learnt: dict[str, LearntField] = {}
    for i, shown in enumerate(fields):
        assert known.learn_field is not None
        log("shape" if shown == "displacement" else "stress")
        left = limit(1.0 / (len(fields) - i))
        learnt[shown] = known.learn_field(shown, _SHOWN[shown][1], common | {"seconds": left})
    meta = {**found.meta, "name": name, "dataset": {"hash": train.ok.hash, "provenance": train.provenance}}
    surrogate = Surrogate(energy, {k: v.field for k, v in learnt.items()}, meta=meta)
    return surrogate, LearningHistory(found, solves, time.monotonic() - began, learnt)


def _recognise(train: Dataset, layout: Layout | None, options: Mapping[str, Any]) -> _Recognised:
    if is_pressed(train):
        return _pressed(PressedSolves.of(train, layout), options)
    if is_padded(train):
        return _held(train, dict(options))
    for cls in registered_baselines():
        pair = cls.recognise(train)
        if pair is not None:
            baseline, solves = pair
            return _Recognised(baseline, solves, {**solves.options, **options})
    acting = train.provenance.get("problem", {}).get("interactions", [])
    raise UsageError(
        "This dataset is of no kind that can be learnt.",
        why=f"On its body act {acting or 'no interactions that its provenance tells'}; no baseline recognises that.",
        fix="Sweep a body under one probe or one glued pad, or register a baseline with `recognise`.",
    )


def _pressed(pressed: PressedSolves, options: Mapping[str, Any]) -> _Recognised:
    def learn_field(name: str, unit: str, searches: dict[str, Any]) -> LearntField:
        return learn_snapshots(
            pressed.snapshots(name, seed=searches["seed"]),
            inputs=pressed.inputs,
            points=pressed.points,
            triangles=pressed.triangles,
            mass=lumped_mass(pressed.points, pressed.triangles),
            surface=pressed.surface,
            radius=pressed.radius,
            radius_input=pressed.radius_input,
            name=name,
            unit=unit,
            **searches,
        )

    given, baseline = dict(options), pressed.baseline
    law, length = given.pop("law", "auto"), given.pop("length", None)
    if isinstance(law, ContactLaw):
        baseline, given["choose"] = replace(baseline, law=law), False
    elif length is not None:
        baseline = replace(baseline, law=ContactLaw("series", length))
    known = {"deepest": pressed.deepest or None}
    return _Recognised(baseline, pressed.solves, known | given, learn_field)


def _held(train: Dataset, options: dict[str, Any]) -> _Recognised:
    solves = pad_solves(train)
    of_fit = {k: options.pop(k) for k in ("degree", "stiffening") if k in options}
    known = {"units_max": _PAD_UNITS, "networks": _PAD_NETWORKS}
    return _Recognised(fit_pad(solves, **of_fit)[0], solves, known | options)
