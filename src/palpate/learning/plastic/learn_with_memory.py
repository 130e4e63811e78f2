"""From load histories to a held body that remembers.

The same body of a material without a memory gives the elastic energy ½ q(w)² along the load, a pad baseline of one
direction with a network. Along a history of q the elongation of any one element is then known, and the force

    P_t = q'(w_t) Σ k_i e_i(t)

is linear in the unit stiffnesses. So a dictionary of limits and hardenings, or of relaxation times, is laid out on a
grid, and the k_i are its non-negative least squares (Lawson & Hanson 1974): a convex problem with one answer, which is
sparse. No start, no iteration count and no seed decide it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from threadpoolctl import threadpool_limits

from palpate.dataset import Dataset, LoadHistory, histories_of, is_history
from palpate.dataset.histories import ELASTIC, elastic_of
from palpate.errors import UsageError
from palpate.format import share
from palpate.learning.recognised import Recognised, Request, recogniser
from palpate.learning.structure import refined_network
from palpate.surrogates import LearntEnergy, NodeField, PadBaseline, RestStiffness, Solves, Stiffening
from palpate.surrogates.memories import IwanElements, Memory
from palpate.units import Quantity, Range

__all__ = ["MemoryFit", "recognise_histories"]

LIMITS = 32  # of the grid, geometric: neighbours differ by a tenth
LOWEST, HIGHEST = 0.04, 1.0  # its ends over the largest amplitude
# none, and half-decades: a metal's section hardens by a few per cent of K
HARDENINGS = (0.0, 0.03, 0.1, 0.3, 1.0)
PER_DECADE = 6  # relaxation times; neighbours a factor of 1.5 apart can hardly be told from one
NEGLIGIBLE = 1e-5  # of the stiffness: less can't be felt
SHAPES = 240  # samples that the displacement is learnt from
FEWEST = 8  # samples of the elastic body
_STILL = 1e-3  # of its largest place: nearer to rest round-off decides
_EFFORT = 0.3  # of its energy
# what is solved bears no noise, and the baseline has no rivals
_EXACT = {"choose": False, "units_max": 6, "networks": 1, "target": 1e-7, "ridge": 1e-13, "tolerance": 1e-9}

Paths: TypeAlias = Sequence[LoadHistory]


@dataclass(frozen=True)
class MemoryFit:
    """Errors on the histories learnt from.

    Attributes
    ----------
    error : float
        Root mean square error of the force, of the largest force.
    elements : int
        Number of elements that are used.
    candidates : int
        Number of elements in the dictionary.
    elastic_error : float
        Largest error of the elastic body's force, of its largest force.
    shape_error : float
        Root mean square error of the displacement, leave-one-out, of its largest deviation.
    """

    error: float
    elements: int
    candidates: int
    elastic_error: float
    shape_error: float

    def __str__(self) -> str:
        return (
            f"force to {share(self.error)} of the largest with {self.elements} of {self.candidates} elements, "
            f"elastic force to {share(self.elastic_error)}, shape to {share(self.shape_error)}"
        )


@recogniser
def recognise_histories(data: Dataset, request: Request) -> Recognised | None:
    """Return the body of load histories, which yields or creeps; None of any other dataset.

    The options ``mirrors`` (whether both sides answer alike, True by default) and ``relaxes`` (whether it creeps, by
    default as the dataset says) are its own.
    """
    if not is_history(data):
        return None
    own, further = request.split("mirrors", "relaxes")
    relaxes = bool(own.get("relaxes", data.provenance.get("relaxes", False)))
    mirrors, paths = bool(own.get("mirrors", True)), histories_of(data)
    elastic = _require_elastic(paths, elastic_of(data), mirrors)
    baseline, solves, kept = _energy(data, paths, elastic, mirrors)
    with threadpool_limits(1):
        shape, shape_error = _shape(data, paths, mirrors, request.search.seed)

    def memory(energy: LearntEnergy) -> tuple[Memory, MemoryFit]:
        return _memory(energy, paths, elastic, shape_error, relaxes=relaxes)

    return Recognised(
        baseline,
        solves,
        {**_EXACT, "effort": _EFFORT * request.search.effort, **further},
        fields={"displacement": shape},
        meta={"histories": len(paths), "samples": sum(map(len, paths)), "relaxes": relaxes},
        rows=np.flatnonzero(data["history"] == ELASTIC)[kept],
        memory=memory,
    )


def _memory(
    energy: LearntEnergy, paths: Paths, elastic: LoadHistory, shape_error: float, *, relaxes: bool
) -> tuple[Memory, MemoryFit]:
    """Return the elements that explain the forces along the histories, beside the energy without a memory."""
    with threadpool_limits(1):
        amplitudes = [_amplitudes(energy, history.place) for history in paths]
        reach = max(float(np.abs(q).max()) for q, _ in amplitudes)
        candidates = _times(paths) if relaxes else _limits(reach)
        elements, error = _fitted(paths, amplitudes, candidates, relaxes)
    near = np.abs(elastic.place) <= energy.inputs[0].high
    answer = -energy.force(elastic.place[near][:, None]) @ energy.baseline.directions[0]
    miss = float(np.abs(answer - elastic.force[near]).max() / np.abs(elastic.force[near]).max())
    return elements, MemoryFit(error, len(elements), len(candidates), miss, shape_error)


def _require_elastic(paths: Paths, elastic: LoadHistory | None, mirrors: bool) -> LoadHistory:
    """Return the history of the elastic body; an error where it does not reach as far as the others."""
    if not paths or elastic is None or len(elastic) < FEWEST:
        known = 0 if elastic is None else len(elastic)
        raise UsageError(
            f"{len(paths)} histories and an elastic one of {known} samples are too few to learn from.",
            why="The energy of the body without its memory is learnt first.",
            fix=f"Give one history at least, better ten, and {FEWEST} samples of the elastic body: "
            "solve_histories(problem, elastic=…).",
        )
    places = np.concatenate([path.place for path in paths])
    low, high = float(places.min()), float(places.max())
    a, b = float(min(elastic.place.min(), 0.0)), float(max(elastic.place.max(), 0.0))
    if mirrors:
        low, high, a, b = 0.0, max(-low, high), 0.0, max(-a, b)
    if low < a or high > b:
        raise UsageError(
            f"The elastic body was led to {a:.4g} … {b:.4g} m, the histories to {low:.4g} … {high:.4g} m.",
            why="Its energy has to be known wherever they go.",
            fix="Load the elastic body more.",
        )
    return elastic


def _energy(
    data: Dataset, paths: Paths, elastic: LoadHistory, mirrors: bool
) -> tuple[PadBaseline, Solves, np.ndarray]:
    """Return baseline and solves of the body without its memory, along the load, and which samples these are."""
    D = np.append(data.load_directions[0], 0.0)
    far = np.abs(elastic.place)
    reach = max(float(np.abs(path.place).max()) for path in paths)
    last = float(far[far >= reach].min(initial=far.max()))  # what lies beyond the histories is not trained
    kept = (far > _STILL * far.max()) & (far <= last)
    w, P, U = (a[kept] for a in (elastic.place, elastic.force, elastic.stored))
    least = int(np.argmin(np.abs(w)))
    K = np.array([[P[least] / w[least]]])
    baseline = PadBaseline(RestStiffness.even(K), Stiffening.none(1), axes=D[None])
    low, high = float(min(w.min(), 0.0)), float(max(w.max(), 0.0))
    symmetry = np.zeros((0, 3, 3))
    if mirrors:
        high = max(-low, high)
        low, symmetry = -high, np.stack([np.eye(3), np.eye(3) - 2.0 * np.outer(D, D)])
    solves = Solves(w[:, None], U, -P[:, None], None, (Range("w", low, high, "m"),), symmetry=symmetry)
    return baseline, solves, kept


def _amplitudes(energy: LearntEnergy, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the signed amplitude q (N,), √J, and its slope (N,), √J/m, at places (N,), m."""
    evaluator, direction = energy.evaluator(), energy.baseline.directions[0]
    out, none = np.zeros((2, len(places))), np.zeros(0)
    for i, w in enumerate(places):
        evaluator(w * direction, none)
        out[:, i] = evaluator.amplitude, evaluator.slope @ direction
    return out[0], out[1]


def _shape(data: Dataset, paths: Paths, mirrors: bool, seed: int) -> tuple[NodeField, float]:
    """Return the displacement of all nodes over (w, P); histories that kept to one side tell of the other too."""
    X = np.concatenate([np.stack([path.place, path.force], axis=1) for path in paths])
    moved = np.concatenate([path.displacement for path in paths])
    along, rest = np.asarray(data.load_directions[0], dtype=float), data.rest
    if mirrors and np.allclose(rest @ along, rest[0] @ along):  # a straight body across the load
        mirrored = moved - 2 * (moved @ along)[..., None] * along
        X, moved = np.concatenate([X, -X]), np.concatenate([moved, mirrored])
    Y = moved.reshape(len(moved), -1)
    rows = np.unique(np.linspace(0, len(X) - 1, SHAPES).round().astype(int))
    names = ("w", "m"), ("P", "N")
    ranges = [
        Range(name, float(column.min()), float(column.max()), unit)
        for (name, unit), column in zip(names, X.T, strict=True)
    ]
    outputs = [Quantity(f"u_{c} at node {i}", "m") for i in range(len(rest)) for c in "xy"]
    network, refined, _ = refined_network(
        X[rows], Y[rows], ranges, outputs, target=2e-3, units_max=8, starts=2, seed=seed
    )
    columns = np.array([(node, component) for node in range(len(rest)) for component in range(2)])
    body = data.provenance.get("problem", {}).get("body", {})
    field = NodeField(
        "displacement",
        "m",
        network,
        columns,
        np.pad(rest, ((0, 0), (0, 1))),
        int(data.load_nodes[0]),
        np.ones(1, np.int64),
        "place and load",
        radius=float(body.get("half_height", 0.005)),
        of_interest=data.nodes_of_interest,
    )
    return field, float(refined.loo)


def _limits(reach: float) -> np.ndarray:
    """Return (y, c, τ) of each candidate (n, 3): a spring, and all limits with all hardenings."""
    limits = np.geomspace(LOWEST, HIGHEST, LIMITS) * reach
    grid = [(limit, hardening, np.inf) for limit in limits for hardening in HARDENINGS]
    return np.array([(np.inf, 0.0, np.inf), *grid])


def _times(paths: Paths) -> np.ndarray:
    """Return (y, c, τ) of each candidate (n, 3): a spring, and times from a third of a step to thrice the longest."""
    steps = np.concatenate([np.diff(path.times, prepend=0.0) for path in paths])
    low, high = (
        np.log10(steps[steps > 0].min() / 3),
        np.log10(3 * max(path.times[-1] for path in paths)),
    )
    times = np.logspace(low, high, 2 + int(PER_DECADE * (high - low)))
    return np.array([(np.inf, 0.0, np.inf), *((np.inf, 0.0, t) for t in times)])


def _fitted(
    paths: Paths,
    amplitudes: list[tuple[np.ndarray, np.ndarray]],
    candidates: np.ndarray,
    relaxes: bool,
) -> tuple[IwanElements, float]:
    from scipy.optimize import nnls

    limit, hardening, time = candidates.T
    all_of_them = IwanElements(np.ones(len(limit)), limit, hardening, time)
    columns = [
        slope[:, None] * all_of_them.elongations(q, path.times if relaxes else None)
        for (q, slope), path in zip(amplitudes, paths, strict=True)
    ]
    A, P = np.concatenate(columns), np.concatenate([path.force for path in paths])
    largest = float(np.abs(P).max())
    k, rest = nnls(A, P)
    used = k > NEGLIGIBLE * k.sum()
    if not used.any():
        raise UsageError(
            "No stiffness explains these forces.",
            why="A body pulls back where it is led.",
            fix="Check the sign of the force: it is the load that holds the body there.",
        )
    elements = IwanElements(k[used], limit[used], hardening[used], time[used])
    return elements, float(rest / np.sqrt(len(P)) / largest)
