"""Figures of a body that loads bend: a beam that the hand holds at a node.

Its shape and its nodes are networks of their own, so that each is judged by itself, beside the force of its energy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palpate.dataset import Dataset
from palpate.errors import UsageError
from palpate.format import count, length, plain, scientific
from palpate.learning import node_outputs
from palpate.network import Network
from palpate.surrogates import NodeField, Surrogate
from palpate.validation.figures.displayed_shape import ShapeErrors
from palpate.validation.figures.figure import Figure, Measured
from palpate.validation.figures.loop_work import LoopWork, function_work
from palpate.validation.figures.stiffness import METHOD, StiffnessErrors, curve_slope
from palpate.validation.subject import Subject, hand_inputs
from palpate.validation.unseen_solves import TouchFunction, TouchSolves
from palpate.validation.worst import Worst, outer_part

__all__ = [
    "NETWORKS",
    "NetworkErrors",
    "OutputError",
    "OutputErrors",
    "network_outputs",
    "node_truth",
    "output_errors",
    "predicted_field",
    "shape_by_load",
    "stiffness_by_load",
    "stiffness_errors",
    "work_by_load",
    "worse_than_filter",
]

NETWORKS = {"refined": "nodes", "filter": "filter"}
"""Networks for the nodes' displacements: what they are called here and among a body's fields."""


@dataclass(frozen=True)
class OutputError:
    """One output: its name, root mean square error and largest error, in the output's unit."""

    name: str
    rmse: float
    max: float


@dataclass(frozen=True)
class OutputErrors:
    """Errors over N samples of m outputs that share a unit."""

    units: int  # units of the network
    full_scale: float  # largest magnitude of any output in the test set; of a beam tip deflection, m
    rmse: float  # over all outputs, in their unit
    max: float  # over all outputs, in their unit
    relative: float  # RMSE over full scale
    relative_max: float  # max over full scale
    per_output: tuple[OutputError, ...]
    outer_count: int  # samples with any input within 5 % of an end of its range
    outer: float | None  # RMSE there; None without samples
    rest: float | None  # RMSE elsewhere; None without samples
    outer_ratio: float | None  # outer / rest
    worst: Worst  # where the largest error is


def output_errors(network: Network, X: np.ndarray, truth: np.ndarray) -> OutputErrors:
    """Return the errors of a network at X (N, n) against truth (N, m), of which not every output may be zero."""
    full = float(np.abs(truth).max())
    if not full > 0:
        raise UsageError(
            "In the test set nothing moves, so errors have no scale.",
            fix="Test under loads that bend the body.",
        )
    error = network.predict(X) - truth
    sample, output = (int(i) for i in np.unravel_index(np.argmax(np.abs(error)), error.shape))
    outside = outer_part(X, network.inputs)
    outer, rest = _rms(error[outside]), _rms(error[~outside])
    rmse, largest = float(_rms(error) or 0.0), float(np.abs(error).max())
    return OutputErrors(
        units=network.units,
        full_scale=full,
        rmse=rmse,
        max=largest,
        relative=rmse / full,
        relative_max=largest / full,
        per_output=tuple(
            OutputError(q.name, float(_rms(e) or 0.0), float(np.abs(e).max()))
            for q, e in zip(network.outputs, error.T, strict=True)
        ),
        outer_count=int(outside.sum()),
        outer=outer,
        rest=rest,
        outer_ratio=outer / rest if outer is not None and rest else None,
        worst=Worst.of(error[sample, output], X[sample], network.inputs, network.outputs[output].name),
    )


def _rms(error: np.ndarray) -> float | None:
    return float(np.sqrt(np.mean(error**2))) if error.size else None


@dataclass(frozen=True)
class NetworkErrors(Figure):
    """Errors of the networks for the displacements of the nodes."""

    refined: OutputErrors
    filter: OutputErrors | None  # of the sequential filter's own network, if the model holds it
    regression: float | None  # largest ratio of the filter's held-out error to its best so far

    def measured(self) -> Measured:
        """Return the values that are compared with limits."""
        values: dict[str, tuple[float | None, Worst | str | None]] = {
            "rmse": (self.refined.relative, self.refined.worst),
            "filter_regression": (self.regression, None),
        }
        if self.filter is not None:
            values["filter_rmse"] = (self.filter.relative, self.filter.worst)
            values["filter_outer_ratio"] = (self.filter.outer_ratio, self.filter.worst)
        return values

    def lines(self) -> list[str]:
        """Return one line per network."""
        return [_line(label, errors) for label, errors in self.named().items()]

    def notes(self) -> list[str]:
        """Return a sentence where refinement did no good."""
        worse = worse_than_filter(self)
        return [] if worse is None else [worse]

    def named(self) -> dict[str, OutputErrors]:
        """Return the errors of the networks by their names."""
        both = {"refined": self.refined, "filter": self.filter}
        return {name: errors for name, errors in both.items() if errors is not None}


def network_outputs(subject: Subject) -> NetworkErrors | None:
    """Return the errors of the networks for the nodes' displacements, where the model has them."""
    model, test = subject.loads, subject.data
    if model is None or test is None:
        return None
    truth = node_truth(model, test)
    errors = {
        label: output_errors(model.fields[key].network, test.X, truth)
        for label, key in NETWORKS.items()
        if key in model.fields
    }
    watched = subject.history
    regression = watched.regression if watched is not None and math.isfinite(watched.regression) else None
    return NetworkErrors(errors["refined"], errors.get("filter"), regression)


def shape_by_load(subject: Subject) -> ShapeErrors | None:
    """Return the errors of the shape, where a network answers it by load."""
    model, test = subject.loads, subject.data
    if model is None or test is None:
        return None
    shown, solved = predicted_field(model, test.X), test.displacement[:, :, :2]
    return ShapeErrors.of(shown, solved, test, lambda node: f"the node at {test.rest[node, 0]:g} m")


def stiffness_by_load(subject: Subject) -> StiffnessErrors | str | None:
    """Return the errors of the stiffness along a curve of loads, or the reason why there are none."""
    if subject.loads is None or subject.data is None:
        return None
    return stiffness_errors(subject.loads, subject.data)


def work_by_load(subject: Subject) -> LoopWork | str | None:
    """Return the work around closed paths between places of the test, or the reason why there is none."""
    model, test, samples = subject.loads, subject.data, subject.samples
    if model is None or test is None or samples is None:
        return None
    D, energy = model.hand_energy.baseline.directions, model.hand_energy
    if len(D) == 1:
        return "Work around closed paths is zero by construction: the hand moves along one coordinate."

    def force(X: np.ndarray) -> np.ndarray:
        """Return the force (N, 3) at places in space (m) and loads elsewhere (N)."""
        return np.asarray(energy.force(np.hstack([X[:, :3] @ D.T, X[:, 3:]])))

    inputs = hand_inputs(model, _line_of(model), test)
    solves = TouchSolves(np.hstack([samples.hand @ D, inputs[:, len(D) :]]), samples.truth)
    return function_work(TouchFunction(model.name, energy.inputs, force), solves, seed=subject.seed)


def worse_than_filter(networks: NetworkErrors) -> str | None:
    """Return a sentence for a refined network that is worse than the filter it should improve; else None."""
    refined, own = networks.refined, networks.filter
    if own is None or not refined.rmse > own.rmse:
        return None
    return (
        f"The refined network is worse than the sequential filter: RMSE {length(refined.rmse)} against "
        f"{length(own.rmse)}. Allow it more units (`units_max` in [learning]) or more solves (`samples` there)."
    )


def node_truth(model: Surrogate, data: Dataset) -> np.ndarray:
    """Return what the network of the nodes should answer for a dataset, (N, m) in m."""
    quantities, columns = node_outputs(data)
    found, wanted = [q.name for q in quantities], [q.name for q in model.fields["nodes"].network.outputs]
    if found != wanted:
        raise UsageError(
            f"The dataset moves {', '.join(found) or 'nothing'}; {model.name} answers {', '.join(wanted)}.",
            why="Its nodes of interest or the directions of its loads are others.",
            fix="Test with solves of the study that the model was learnt from.",
        )
    return np.stack([data.displacement[:, node, axis] for node, axis in columns], axis=1)


def predicted_field(model: Surrogate, X: np.ndarray) -> np.ndarray:
    """Return the displacement (N, nodes, 2) of the mesh nodes under loads X (N, n), m."""
    return _line_of(model).values(X)[:, :, :2]


def stiffness_errors(model: Surrogate, test: Dataset) -> StiffnessErrors | str:
    """Return the errors of the stiffness on converged unseen solves, or the reason why none can be derived."""
    if len(test.ranges) > 1:
        return (
            "Stiffness is not judged: solves scattered over several loads have no curve to take a slope of."
        )
    X = hand_inputs(model, _line_of(model), test)
    curve = curve_slope(test.X[:, 0], X[:, 0])
    if curve is None:
        return "Stiffness is not judged: the test loads lie too far apart to take a slope from."
    rows, slope = curve
    truth, D = 1.0 / slope, model.hand_energy.baseline.directions[0]
    answer = -np.einsum("nij,i,j->n", model.hand_energy.stiffness(X[rows]), D, D)
    return StiffnessErrors.of(np.abs(answer - truth) / np.abs(truth), test.X[rows], test.ranges, METHOD)


def _line_of(model: Surrogate) -> NodeField:
    assert model.line is not None  # the subject's own check
    return model.line


def _line(label: str, e: OutputErrors) -> str:
    """Return one network in a line."""
    text = (
        f"{label}: {count(e.units, 'unit')}, RMSE {length(e.rmse)} ({scientific(e.relative)} of full scale)"
    )
    text += f", largest {length(e.max)}"
    return text if e.outer_ratio is None else f"{text}, ends of the range {plain(e.outer_ratio)} × the rest"
