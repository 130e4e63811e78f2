"""Subject of a validation: a model as functions that can be asked, and solves that it has never seen.

`Subject.of` is the one place that knows how each kind of model is asked; figures see only what a subject can answer.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from palpate.dataset import Dataset, is_history
from palpate.errors import UsageError
from palpate.format import count
from palpate.learning import History
from palpate.learning.bent_body import hand_coordinates
from palpate.learning.learn_dataset import LearningHistory, filter_record
from palpate.network import TrainedRegion
from palpate.surrogates import (
    Field,
    FieldSurrogate,
    LearntEnergy,
    LearntQuantities,
    LumpContrast,
    NodeField,
    Surrogate,
)
from palpate.tools import Gripper, PosedTool
from palpate.units import Range, bounds
from palpate.validation.unseen_solves import ForceSamples, TouchFunction, TouchSolves

__all__ = ["Subject", "hand_inputs"]

SEEN = 1e-9  # distance in scaled inputs, within which a solve was trained on and is no test
RADIUS = 1e-9  # relative difference of radii that are the same


@dataclass(frozen=True, eq=False)
class Subject:
    """A model and the solves that it has never seen; what is missing is None and can't be judged."""

    name: str
    count: int  # unseen solves, or samples of unseen histories
    X: np.ndarray  # (N, n), inputs of the solves
    ranges: tuple[Range, ...]
    samples: ForceSamples | None = None  # forces of the model and of finite elements at each solve
    units: int = 0  # units of the network that answers the force
    turning: bool = True  # whether the force can point in more than one direction
    function: TouchFunction | None = None  # the force as a function of place
    solves: TouchSolves | None = None
    data: Dataset | None = None  # unseen rows, with displacements
    field: FieldSurrogate | None = None  # the displacement that is shown
    lumps: LumpContrast | None = None  # what hidden lumps add
    loads: Surrogate | None = None  # networks that answer by load
    body: Surrogate | None = None  # a body with memory
    histories: Dataset | None = None  # unseen, of that body
    tool: Surrogate | None = None  # a body under a tool, of which it tells the torque
    answering: Surrogate | None = None  # a surrogate that no hand feels, judged by its numbers and fields
    history: History | None = None  # record of the sequential filter
    refined: TouchSolves | None = None  # on a refined mesh
    strokes: Sequence[TouchSolves] = ()
    seed: int = 0  # of random strokes and loops
    notes: tuple[str, ...] = ()  # what must be known of the test

    @classmethod
    def of(
        cls,
        model: Surrogate | TouchFunction,
        test: Dataset | TouchSolves,
        *,
        history: History | LearningHistory | None = None,
        refined: Dataset | TouchSolves | None = None,
        strokes: Sequence[TouchSolves] = (),
        seed: int = 0,
    ) -> Subject:
        """Return a model with the rows of a test that it has not seen; for the parameters see `validate`."""
        surrogate = model if isinstance(model, Surrogate) else None
        if surrogate is not None and not surrogate.can_be_touched:
            return _by_answers(surrogate, _required(test, surrogate.name))
        line = None if surrogate is None else surrogate.line
        if surrogate is not None and line is not None:
            data = _required(test, surrogate.name)
            remembers = surrogate.memory is not None and surrogate.memory.of_body is not None
            if is_history(data) != remembers:
                raise UsageError(
                    f"{surrogate.name} is judged by {'solves' if is_history(data) else 'load histories'}.",
                    why="A body with memory answers to what was done to it before, any other to its loads alone.",
                    fix="Give the test set of its study.",
                )
            if surrogate.memory is not None:
                return cls(model.name, 0, np.empty((0, 1)), (), body=surrogate, histories=data)
            if refined is not None or strokes:
                raise UsageError(
                    "A body that loads bend is judged by a dataset of its study alone.",
                    fix="Give a Dataset, without `refined` and `strokes`.",
                )
            return _by_load(surrogate, line, data.ok, filter_record(history), seed)
        if filter_record(history) is not None:
            raise UsageError("The model of an energy has no history of a filter.", fix="Leave `history` out.")
        return _by_place(model, surrogate, test, refined, strokes, seed)


def _required(test: Dataset | TouchSolves, name: str) -> Dataset:
    """Return the dataset that judges a surrogate; an error for anything else."""
    if not hasattr(test, "provenance"):
        raise UsageError(
            f"{name} is judged by a dataset, not by {type(test).__name__} {test!r:.60}.",
            fix="Give what `palpate.sweep` or `palpate.import_results` returned, or `Dataset.open(path)`.",
        )
    return cast("Dataset", test)


def _by_answers(model: Surrogate, test: Dataset) -> Subject:
    """Return a surrogate that answers numbers and fields, with the solves that it was not learnt from."""
    good = test.ok
    theirs, own = [(r.name, r.unit) for r in good.ranges], [(r.name, r.unit) for r in model.inputs]
    if theirs != own:
        raise UsageError(
            f"The dataset's inputs are {', '.join(n for n, _ in theirs)}; "
            f"{model.name} takes {', '.join(n for n, _ in own)}.",
            fix="Test with solves of the same inputs, in the same order and units.",
        )
    if not len(good):
        raise UsageError(
            "There is no converged solve to test with.",
            why=f"None of {count(len(test), 'solve')} converged.",
            fix="Look at the reasons that the rows give, and sweep others.",
        )
    seen = np.zeros(len(good), dtype=bool)
    parts: list[LearntQuantities | Field] = [*model.quantities.values(), *model.fields.values()]
    for part in parts:
        if part.region is not None:
            seen |= part.region.distances(part.network.scaling.scale_inputs(good.X)) < SEEN
    if seen.all():
        raise UsageError(
            f"{model.name} was learnt from all {len(good)} solves of the test.",
            fix="Test with solves that learning left out.",
        )
    unseen = good.take(np.flatnonzero(~seen))
    notes = [f"{count(int(seen.sum()), 'solve')} left out: learnt from."] if seen.any() else []
    if far := int((~model.trusted(unseen.X)).sum()):
        notes.append(f"{far} of {len(unseen)} are in no training solve's neighbourhood, and not trusted.")
    units = sum(part.network.units for part in parts)
    return Subject(
        model.name,
        len(unseen),
        unseen.X,
        model.inputs,
        units=units,
        data=unseen,
        answering=model,
        notes=tuple(notes),
    )


def _by_place(
    model: Surrogate | TouchFunction,
    surrogate: Surrogate | None,
    test: Dataset | TouchSolves,
    refined: Dataset | TouchSolves | None,
    strokes: Sequence[TouchSolves],
    seed: int,
) -> Subject:
    """Return a model whose force is a function of place."""
    field = None if surrogate is None else surrogate.surface_fields.get("displacement")
    energy = None if surrogate is None else surrogate.energy
    function = TouchFunction.of(model)
    solves = _solves(test, function, energy)
    seen = _seen(surrogate, solves.X)
    if seen.all():
        raise UsageError(
            f"The surrogate was trained on all {len(solves)} solves, or on mirror images of them.",
            fix="Test with solves that training left out.",
        )
    if seen.any():
        solves = solves.take(~seen)
    samples = ForceSamples(solves.X[:, :3], solves.force, function.force(solves.X), function.within(solves.X))
    return Subject(
        function.name,
        len(solves),
        solves.X,
        function.inputs,
        samples=samples,
        units=function.units,
        function=function,
        solves=solves,
        data=solves.data,
        field=field,
        lumps=None if surrogate is None else surrogate.lumps,
        tool=None if surrogate is None or surrogate.torque_evaluator is None else surrogate,
        refined=None if refined is None else _solves(refined, function, energy),
        strokes=strokes,
        seed=seed,
        notes=(*_places(energy, solves), *_notes(samples, int(seen.sum()))),
    )


def _solves(test: Dataset | TouchSolves, function: TouchFunction, energy: LearntEnergy | None) -> TouchSolves:
    """Return solves of a function's body and of its probe; an error for anything else."""
    if not hasattr(test, "take"):
        raise UsageError(
            f"A model is judged by solves, not by {type(test).__name__} {test!r:.60}.",
            fix="Give what `palpate.sweep` returned, `Dataset.open(path)`, or TouchSolves of arrays.",
        )
    solves = TouchSolves.of(test, function.inputs)
    _refuse_radius(energy, solves.data)
    return solves


def _seen(model: Surrogate | None, X: np.ndarray) -> np.ndarray:
    """Return which of the inputs (N, n) a model was trained on.

    A surrogate remembers its training inputs and their images under the body's symmetry, up to 512 of them; one that
    was learnt all over a painted surface has them in its record.
    """
    energy = None if model is None else model.energy
    if model is None or energy is None or energy.region is None:
        return np.zeros(len(X), dtype=bool)
    low, high = bounds(energy.inputs)

    def scale(places: np.ndarray) -> np.ndarray:
        return np.asarray(2 * (places - low) / (high - low) - 1)

    solved_at = model.meta.get("solved_at")
    region = energy.region if solved_at is None else TrainedRegion(scale(np.array(solved_at)), 0.0)
    return np.asarray(region.distances(scale(X)) < SEEN)


def _refuse_radius(energy: LearntEnergy | None, data: Dataset | None) -> None:
    """Refuse solves with another probe than the surrogate's."""
    if energy is None or data is None or not math.isfinite(energy.baseline.radius):
        return
    own = energy.baseline.radius
    acting = data.provenance.get("problem", {}).get("interactions", [])
    tool = getattr(energy.baseline, "posed_tool", None)
    plain = [a for a in acting if isinstance(a, dict)]
    tools: list[PosedTool | Gripper] = [PosedTool.of(a) for a in plain if a.get("type") == "SurfaceTool"]
    if isinstance(tool, Gripper):
        tools = [replace(Gripper.of(a), trained=tool.trained) for a in plain if a.get("type") == "Pinch"]
    if any(one != tool for one in tools) or (tool is not None and not tools):
        raise UsageError(
            f"The solves were made with {tools[0] if tools else 'another probe'}, the surrogate with "
            f"{energy.baseline.probe_words}.",
            fix="Test with solves of the tool that the surrogate was learnt with.",
        )
    radii = [a["radius"] for a in acting if isinstance(a, dict) and "radius" in a]
    if any(abs(r - own) > RADIUS * own for r in radii):
        raise UsageError(
            f"The solves' probe has a radius of {1e3 * radii[0]:g} mm, the surrogate's {1e3 * own:g} mm.",
            fix="Test with solves of the probe that the surrogate was learnt with.",
        )


def _places(energy: LearntEnergy | None, solves: TouchSolves) -> list[str]:
    """Return a sentence where several depths over one place were solved: these tell less than as many places."""
    if energy is None or energy.baseline.surface is None:
        return []
    places = int(energy.baseline.groups(solves.X).max()) + 1
    if places == len(solves):
        return []
    return [
        f"The {count(len(solves), 'solve')} lie over {count(places, 'place')}, at several depths of each."
    ]


def _notes(samples: ForceSamples, seen: int) -> list[str]:
    found = [
        f"f₀ = {samples.light:.3g} N, the smaller of 0.5 N and 5 % of the largest force: errors of fainter ones are "
        "shares of it."
    ]
    if seen:
        found.append(f"{count(seen, 'solve')} left out: trained on, or the mirror image of one that was.")
    if outside := int((~samples.inside).sum()):
        found.append(
            f"{outside} of {len(samples.inside)} count as outside what was trained, in no training "
            "solve's neighbourhood; more solves bring them nearer."
        )
    return found


def _by_load(
    model: Surrogate, field: NodeField, test: Dataset, history: History | None, seed: int
) -> Subject:
    """Return a body that loads bend: the hand is put where each solve has it."""
    _refuse_other_body(model, field, test)
    X = hand_inputs(model, field, test)
    directions, touched = model.hand_energy.baseline.directions, list(field.touched)
    inside = model.hand_energy.inside(X)
    samples = ForceSamples(
        X[:, : len(touched)], -test.X[:, touched] @ directions, model.hand_energy.force(X), inside
    )
    turning = len(touched) > 1
    notes = [] if turning else ["Direction is not judged: the hand feels one direction only."]
    if outside := int((~inside).sum()):
        notes.append(_outside(field, test, outside))
    return Subject(
        model.name,
        len(test),
        test.X,
        test.ranges,
        samples=samples,
        units=model.hand_energy.network.units,
        turning=turning,
        data=test,
        loads=model,
        history=history,
        seed=seed,
        notes=tuple(notes),
    )


def hand_inputs(model: Surrogate, field: NodeField, data: Dataset) -> np.ndarray:
    """Return the energy's inputs (N, n) where each solve has the hand: its place (m), then the loads elsewhere (N)."""
    compliance = getattr(model.hand_energy.baseline, "compliance", 0.0)
    hand = hand_coordinates(data, field.held, tuple(field.touched.tolist()), compliance)
    return np.hstack([hand, data.X[:, list(field.further)]])


def _outside(field: NodeField, test: Dataset, number: int) -> str:
    """Return how many hand positions count as outside, and why they do where their loads are inside."""
    text = f"{number} of {len(test)} hand positions count as outside the trained range"
    low, high = bounds(field.inputs)
    if not np.array_equal(np.clip(test.X, low, high), test.X):
        return f"{text}."
    return f"{text} although their loads are inside: they are at its border, or in no training solve's neighbourhood."


def _refuse_other_body(model: Surrogate, field: NodeField, data: Dataset) -> None:
    if not len(data):
        raise UsageError(
            "There is no converged solve to test with.",
            why="The test set is empty, or each of its solves failed.",
            fix="Sweep some samples that training leaves out.",
        )
    theirs, own = [(r.name, r.unit) for r in data.ranges], [(r.name, r.unit) for r in field.inputs]
    if theirs != own:
        raise UsageError(
            f"The dataset's inputs are {', '.join(n for n, _ in theirs)}; "
            f"{model.name} takes {', '.join(n for n, _ in own)}.",
            fix="Test with solves of the study that the model was learnt from.",
        )
    if data.rest.shape != field.points[:, :2].shape or not np.allclose(data.rest, field.points[:, :2]):
        raise UsageError(
            f"The dataset's {len(data.rest)} nodes are not the {len(field.points)} nodes of {model.name}.",
            fix="Test with solves of the study that the model was learnt from.",
        )
