"""The registry of kinds of datasets that a hand feels: each kind says in its own file how its data is recognised.

A recogniser is a function (dataset, `Request`) → `Recognised`, or None where the dataset is of another kind. Those of
palpate are entered by `recogniser` where they stand: `plastic`, `bent_body`, `pressed_solves`, `pad_solves`. A
baseline that `palpate.register_baseline` was given is asked after them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.dataset import Dataset, Layout
from palpate.learning.arrays.fitted import Fitted
from palpate.learning.fields import LearntField
from palpate.learning.learning_history import History
from palpate.learning.painted_region import PaintedRegion
from palpate.options import FieldOptions, FitOptions, SearchOptions
from palpate.surrogates import Baseline, LearntEnergy, NodeField, Solves
from palpate.surrogates.baselines import registered_baselines
from palpate.surrogates.memories import Memory

if TYPE_CHECKING:
    from palpate.learning.plastic import MemoryFit

__all__ = ["Recognised", "Request", "recognise", "recogniser"]


@dataclass(frozen=True, eq=False)
class Request:
    """The wishes of whoever learns a dataset."""

    search: SearchOptions
    layout: Layout | None  # of a mesh that is fine wherever the body shall be touched
    options: Mapping[str, Any]  # of the kind, and of learning its energy
    log: Callable[[str], None] = lambda _: None  # told what begins

    def split(self, *names: str) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return the options of these names, and all others."""
        own = {name: self.options[name] for name in names if name in self.options}
        return own, {name: value for name, value in self.options.items() if name not in own}


@dataclass(frozen=True, eq=False)
class Recognised:
    """A dataset's baseline and solves, and what else is known of the body."""

    baseline: Baseline
    solves: Solves
    options: Mapping[str, Any]  # of learning its energy
    learn_field: Callable[[FieldOptions], LearntField] | None = None
    fields: Mapping[str, NodeField] = field(default_factory=dict)  # that are learnt already
    meta: Mapping[str, Any] = field(default_factory=dict)
    filter: History | None = None
    # gives other forms of the baseline
    rivals: Callable[[], Sequence[Baseline]] | None = None
    # the trained region in place of that around the solves, of an energy that was learnt
    region: Callable[[LearntEnergy], PaintedRegion | None] | None = None
    rows: np.ndarray | None = (
        None  # converged solve that each of `solves` is, negative for none; None: in order
    )
    # the memory beside an energy that was learnt, and how well it fits
    memory: Callable[[LearntEnergy], tuple[Memory, MemoryFit]] | None = None
    # numbers beside the energy, by the names of their groups
    numbers: Mapping[str, Callable[[FitOptions], Fitted | None]] = field(default_factory=dict)


Recogniser = Callable[[Dataset, Request], Recognised | None]
_recognisers: list[Recogniser] = []


def recogniser(function: Recogniser) -> Recogniser:
    """Enter a recogniser of datasets, to be asked after those that are entered already; as a decorator."""
    _recognisers.append(function)
    return function


def recognise(data: Dataset, request: Request) -> Recognised | None:
    """Return the first kind of body that a dataset is of, registered baselines last; None where no hand feels it."""
    for function in (*_recognisers, _by_registered_baseline):
        known = function(data, request)
        if known is not None:
            return known
    return None


def _by_registered_baseline(data: Dataset, request: Request) -> Recognised | None:
    pairs = (cls.recognise(data) for cls in registered_baselines())
    baseline, solves = next((pair for pair in pairs if pair is not None), (None, None))
    if baseline is None or solves is None:
        return None
    return Recognised(baseline, solves, {**solves.options, **request.options})
