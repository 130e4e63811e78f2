r"""Answers that no hand feels, as one network: numbers, and values of fields and curves at chosen places.

A field is affine in its coefficients, u = ū + Σ a_k φ_k, and its coefficients are outputs of a network. Values at
places and means over places are so outputs of one network through modes, whose units are those of all parts:

    y = c + B [latent outputs of part 1, of part 2, …]

Parts whose radial functions differ make networks of their own, and their outputs are summed up.

The largest and the least value of a field are no outputs of a network: they are runs over hidden outputs of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from palpate.errors import UsageError
from palpate.export.answer_doubt import Doubt, doubt_of
from palpate.format import count as count_of
from palpate.network import Network, Scaling, TrainedRegion
from palpate.surrogates import LearntQuantities, ModalField, Surrogate
from palpate.units import Quantity, Range, bounds

__all__ = ["MOST_DOUBTS", "AnswerNetwork", "Choice", "answer_network", "answers_of"]


_TOLD = 100  # places at which deviations are compared before they leave
_CLOSE = 0.05  # of a deviation: how far its form may be off
MOST_DOUBTS = 4
"""Parts of whose deviations there is room in a block of weights."""


@dataclass(frozen=True)
class Choice:
    """The values of fields that go out; curves go out whole, and numbers all.

    Without any choice, the mean, the largest and the least value of each field go out.

    Attributes
    ----------
    nodes : tuple of int
        Places of every field, by their numbers from 0.
    means, extremes : tuple of str
        Fields whose mean over the places, and whose largest and least value, go out.
    """

    nodes: tuple[int, ...] = ()
    means: tuple[str, ...] = ()
    extremes: tuple[str, ...] = ()

    @property
    def is_default(self) -> bool:
        """True where nothing was chosen."""
        return not (self.nodes or self.means or self.extremes)


@dataclass(frozen=True)
class _Run:
    """The largest or least of so many outputs that follow each other."""

    quantity: Quantity
    first: int
    count: int
    largest: bool


@dataclass(frozen=True, eq=False)
class AnswerNetwork:
    """Networks whose sum gives all answers of a surrogate, one for each radial function, at most three.

    `regions` are the trained regions of its parts, each once. `groups` says how many of the first outputs are of one
    quantity or field; the outputs after these are values that `runs` need.
    """

    name: str
    networks: tuple[Network, ...]
    runs: tuple[_Run, ...]
    regions: tuple[TrainedRegion, ...]
    groups: tuple[int, ...]
    # how sure each part is, and of each of the networks' outputs the part and the row in it, (outputs, 2); nothing
    # where a part can't say
    doubts: tuple[Doubt, ...] = ()
    rows: np.ndarray | None = None

    def __str__(self) -> str:
        names = ", ".join(str(r) for r in self.inputs)
        return f"{self.name}: {names} → {count_of(len(self.outputs), 'output')}"

    @property
    def inputs(self) -> tuple[Range, ...]:
        """Names, units and trained ranges of the inputs."""
        return self.networks[0].inputs

    def without_doubts(self) -> AnswerNetwork:
        """Return the same answers without deviations, trusted wherever they are near what was learnt from."""
        return replace(self, doubts=(), rows=None)

    @property
    def count(self) -> int:
        """Number of the networks' outputs that are answers themselves."""
        return sum(self.groups)

    @property
    def outputs(self) -> tuple[Quantity, ...]:
        """Names and units of what is answered: the outputs, then the extremes."""
        return (*self.networks[0].outputs[: self.count], *(run.quantity for run in self.runs))

    def predict(self, X: np.ndarray) -> np.ndarray:
        """Return the answers (N, m) at inputs X (N, n)."""
        Y = np.sum([network.predict(X) for network in self.networks], axis=0)
        parts = [Y[:, run.first : run.first + run.count] for run in self.runs]
        columns = [
            part.max(axis=1) if run.largest else part.min(axis=1)
            for run, part in zip(self.runs, parts, strict=True)
        ]
        return np.column_stack([Y[:, : self.count], *columns])

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Return the derivatives (m, n) of the networks' outputs at x (n,)."""
        return np.asarray(np.sum([network.jacobian(x) for network in self.networks], axis=0))

    def deviation(self, X: np.ndarray) -> np.ndarray:
        """Return the standard deviations (N, m) of the answers at X (N, n); not-a-number where a part can't say."""
        if self.rows is None:
            return np.full((len(X), len(self.outputs)), np.nan)
        each = [doubt.deviation(X) for doubt in self.doubts]
        of_outputs = np.stack([each[part][:, row] for part, row in self.rows], axis=1)
        Y = np.sum([network.predict(X) for network in self.networks], axis=0)
        columns = [of_outputs[:, : self.count]]
        for run in self.runs:
            some = Y[:, run.first : run.first + run.count]
            best = run.first + (some.argmax(axis=1) if run.largest else some.argmin(axis=1))
            columns.append(of_outputs[np.arange(len(X)), best][:, None])
        return np.hstack(columns)

    def inside(self, X: np.ndarray) -> np.ndarray:
        """Return which of X (N, n) are in the trained regions of all parts, whose networks agree there, (N,) bool."""
        xi = self.networks[0].scaling.scale_inputs(X)
        agree = np.all([doubt.agrees(X) for doubt in self.doubts], axis=0) if self.doubts else True
        if not self.regions:
            return np.asarray((np.abs(xi) <= 1.0 + 1e-9).all(axis=1) & agree)
        near = np.all([region.distances(xi) <= region.radius for region in self.regions], axis=0)
        return np.asarray(near & agree)


@dataclass(frozen=True)
class _Rows:
    """Outputs that are affine in a network's outputs y: offset (m,) + matrix (m, k) · y."""

    part: LearntQuantities
    outputs: tuple[Quantity, ...]
    offset: np.ndarray
    matrix: np.ndarray
    scatter: np.ndarray  # (m,), standard deviation that comes on top
    widening: float = 1.0  # of all deviations


def answers_of(surrogate: Surrogate) -> AnswerNetwork | None:
    """Return all numbers, fields and curves of a surrogate that no hand feels; None of a touched body."""
    if surrogate.can_be_touched:
        return None
    rows = [*_numbers(surrogate)]
    rows += [_values(shown, range(len(shown.places))) for shown in surrogate.modal_fields.values()]
    return _assemble(surrogate, rows, ())


def answer_network(surrogate: Surrogate, choice: Choice) -> AnswerNetwork:
    """Return all numbers and curves, and the chosen values of fields; an error where a field or place is not there."""
    fields = {shown.name: shown for shown in surrogate.modal_fields.values()}
    flat = {name: shown for name, shown in fields.items() if not shown.is_curve}
    _require_fields(surrogate, flat, choice)
    means = tuple(flat) if choice.is_default else choice.means
    extremes = tuple(flat) if choice.is_default else choice.extremes
    rows = [*_numbers(surrogate)]
    rows += [_values(shown, range(len(shown.places))) for shown in fields.values() if shown.is_curve]
    rows += [_values(shown, choice.nodes) for shown in flat.values() if choice.nodes]
    rows += [_mean(flat[name]) for name in means]
    runs: list[_Run] = []
    hidden_rows, first = [], sum(len(row.outputs) for row in rows)
    for name in extremes:
        for component in range(flat[name].mean.shape[1]):
            hidden = _values(flat[name], range(len(flat[name].places)), component)
            label = _label(flat[name], component)
            runs += [
                _Run(Quantity(f"{label}_{word}", flat[name].unit), first, len(hidden.outputs), largest)
                for word, largest in (("max", True), ("min", False))
            ]
            hidden_rows.append(hidden)
            first += len(hidden.outputs)
    return _assemble(surrogate, rows, tuple(runs), hidden_rows)


def _assemble(
    surrogate: Surrogate, rows: list[_Rows], runs: tuple[_Run, ...], hidden: Sequence[_Rows] = ()
) -> AnswerNetwork:
    networks = _join([*rows, *hidden])
    groups = tuple(len(row.outputs) for row in rows)
    doubts, places = _doubts([*rows, *hidden])
    return AnswerNetwork(surrogate.name, networks, runs, _regions([*rows, *hidden]), groups, doubts, places)


def _doubts(rows: Sequence[_Rows]) -> tuple[tuple[Doubt, ...], np.ndarray | None]:
    """Return how sure the parts are, and the part and row of each output; nothing where a part can't say."""
    parts = list({id(row.part): row.part for row in rows}.values())
    made: list[Doubt] = []
    places = [np.zeros((len(row.outputs), 2), dtype=np.int64) for row in rows]
    for i, part in enumerate(parts):
        own = [k for k, row in enumerate(rows) if row.part is part]
        doubt = doubt_of(
            part,
            [rows[k].matrix for k in own],
            [rows[k].scatter ** 2 for k in own],
            rows[own[0]].widening,
        )
        if doubt is None or len(made) >= MOST_DOUBTS or not _has_form(doubt, part):
            return (), None
        first = 0
        for k in own:
            places[k][:, 0], places[k][:, 1] = i, np.arange(first, first + len(places[k]))
            first += len(places[k])
        made.append(doubt)
    return tuple(made), np.vstack(places)


def _has_form(doubt: Doubt, part: LearntQuantities) -> bool:
    """Return whether the deviations of a part survive their form, whose terms nearly cancel where units are alike."""
    X = np.random.default_rng(0).uniform(*bounds(part.inputs), (_TOLD, len(part.inputs)))
    own, apart = doubt.parts(X)
    return bool(np.allclose(np.sqrt(np.maximum(own, apart[:, 0])), part.deviation(X), rtol=_CLOSE))


def _require_fields(surrogate: Surrogate, flat: dict[str, ModalField], choice: Choice) -> None:
    """Refuse fields and places that are not there."""
    for name in (*choice.means, *choice.extremes):
        if name not in flat:
            raise UsageError(
                f"{surrogate.name!r} has no field {name!r} over a mesh.",
                why=f"Its fields are: {', '.join(flat) or 'none'}; curves go out whole.",
                fix="Name one of these, or leave the option out.",
            )
    for shown in flat.values():
        for node in choice.nodes:
            if not 0 <= node < len(shown.places):
                raise UsageError(
                    f"The field {shown.name!r} has no place {node}.",
                    why=f"Its places are numbered from 0 to {len(shown.places) - 1}.",
                    fix="Choose other places: --at-nodes 12,40",
                )
    if choice.nodes and not flat:
        raise UsageError(
            f"{surrogate.name!r} has no field at whose places there are values.",
            why="It answers numbers and curves, which go out whole.",
            fix="Leave --at-nodes out.",
        )


def _numbers(surrogate: Surrogate) -> Iterator[_Rows]:
    for part in surrogate.quantities.values():
        m = len(part.outputs)
        yield _Rows(part, part.outputs, np.zeros(m), np.eye(m), np.zeros(m))


def _label(shown: ModalField, component: int) -> str:
    return f"{shown.name}_{shown.components[component]}" if shown.components else shown.name


def _values(shown: ModalField, places: Sequence[int], component: int | None = None) -> _Rows:
    """Return values of a field at places, place by place: of one component or of all."""
    chosen = list(range(shown.mean.shape[1])) if component is None else [component]
    names = tuple(Quantity(f"{_label(shown, c)}_{place}", shown.unit) for place in places for c in chosen)
    index = np.ix_(list(places), chosen)
    modes = np.stack([mode[index].ravel() for mode in shown.modes], axis=1)
    return _Rows(
        *(shown.coefficients, names, shown.mean[index].ravel(), modes),
        scatter=shown.scatter[index].ravel(),
        widening=shown.widening,
    )


def _mean(shown: ModalField) -> _Rows:
    """Return the mean of a field over its places, by components."""
    names = [_label(shown, c) for c in range(shown.mean.shape[1])]
    modes = shown.modes.mean(axis=1).T
    return _Rows(
        shown.coefficients,
        tuple(Quantity(f"{name}_mean", shown.unit) for name in names),
        shown.mean.mean(axis=0),
        modes,
        shown.scatter.mean(axis=0),  # as if what the modes miss were missed everywhere at once
        shown.widening,
    )


def _regions(rows: Sequence[_Rows]) -> tuple[TrainedRegion, ...]:
    """Return the trained regions of the parts, each once."""
    regions: list[TrainedRegion] = []
    for row in rows:
        region = row.part.region
        if region is not None and not any(
            region.radius == other.radius and np.array_equal(region.points, other.points) for other in regions
        ):
            regions.append(region)
    return tuple(regions)


def _join(rows: Sequence[_Rows]) -> tuple[Network, ...]:
    """Return networks whose sum gives all these outputs: one for each radial function of the parts."""
    if not rows:
        raise UsageError(
            "There is nothing that this way out could answer.",
            why="The surrogate has no numbers, and none of its fields is a field of modes.",
            fix="Learn it with `palpate learn`, from data with numbers, fields or curves.",
        )
    parts = list({id(row.part): row.part for row in rows}.values())
    scalings = [part.network.scaling for part in parts]
    if any(
        not np.array_equal(getattr(other, ends), getattr(scalings[0], ends))
        for other in scalings
        for ends in ("input_centre", "input_half", "input_bend")
    ):
        raise UsageError(
            "The parts of this surrogate can't go out together.",
            why="They have other ranges or scales of the inputs.",
            fix="Learn all parts together, from one dataset.",
        )
    kinds = list(dict.fromkeys(part.network.radial for part in parts))
    return tuple(_of_one_kind(rows, [p for p in parts if p.network.radial == kind]) for kind in kinds)


def _of_one_kind(rows: Sequence[_Rows], parts: Sequence[LearntQuantities]) -> Network:
    """Return the network of what these parts, of one radial function, give to the outputs; zero for all others."""
    first = parts[0].network
    starts = np.cumsum([0, *(part.network.weights.shape[0] for part in parts)])
    count = sum(len(row.outputs) for row in rows)
    centre, basis, at = np.zeros(count), np.zeros((count, starts[-1])), 0
    place = {id(part): i for i, part in enumerate(parts)}
    for row in rows:
        some, i = slice(at, at + len(row.outputs)), place.get(id(row.part))
        at += len(row.outputs)
        if i is None:
            continue
        net = row.part.network
        modes = np.eye(net.weights.shape[0]) if net.basis is None else net.basis
        basis[some, starts[i] : starts[i + 1]] = row.matrix @ (net.scaling.output_scale[:, None] * modes)
        centre[some] = row.offset + row.matrix @ net.scaling.output_centre
    factors, shifts, weights, tail = _side_by_side([part.network for part in parts])
    modes_of_outputs: np.ndarray | None = basis
    if count <= starts[-1]:  # sums of latent outputs are less work than these themselves
        weights, tail, modes_of_outputs = basis @ weights, basis @ tail, None
    outer = first.scaling
    scaling = Scaling(outer.input_centre, outer.input_half, centre, np.ones(count), outer.input_bend)
    names = tuple(quantity for row in rows for quantity in row.outputs)
    return Network(
        first.inputs, names, factors, shifts, weights, tail, scaling, {}, first.radial, modes_of_outputs
    )


def _side_by_side(networks: Sequence[Network]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return factors, shifts, weights and tail of networks in one, whose latent outputs follow each other."""
    starts = np.cumsum([0, *(net.weights.shape[0] for net in networks)])
    units = np.cumsum([0, *(net.units for net in networks)])
    r, n = max(net.factors.shape[1] for net in networks), len(networks[0].inputs)
    factors, shifts = np.zeros((units[-1], r, n)), np.zeros((units[-1], r))
    weights, tail = np.zeros((starts[-1], units[-1])), np.zeros((starts[-1], 1 + n))
    for i, net in enumerate(networks):
        some, lines = slice(units[i], units[i + 1]), slice(starts[i], starts[i + 1])
        factors[some, : net.factors.shape[1]], shifts[some, : net.shifts.shape[1]] = net.factors, net.shifts
        weights[lines, some], tail[lines] = net.weights, net.tail
    return factors, shifts, weights, tail
