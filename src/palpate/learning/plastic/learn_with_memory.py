"""From load histories to a held body that remembers.

The same body of a material without a memory gives the elastic energy ½ q(w)² along the load, a pad baseline of one
direction with a network. Along a history of q the elongation of any one element is then known, and the force

    P_t = q'(w_t) Σ k_i e_i(t)

is linear in the unit stiffnesses. So a dictionary of limits and hardenings, or of relaxation times, is laid out on a
grid, and the k_i are its non-negative least squares (Lawson & Hanson 1974): a convex problem with one answer, which is
sparse. No start, no iteration count and no seed decide it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from palpate.errors import UsageError
from palpate.format import share
from palpate.learning.energy import EnergyHistory, learn_energy
from palpate.learning.plastic.load_histories import LoadHistories, LoadHistory
from palpate.learning.structure import refined_network
from palpate.surrogates import (
    LearntEnergy,
    NodeField,
    PadBaseline,
    RestStiffness,
    Solves,
    Stiffening,
    Surrogate,
)
from palpate.surrogates.memories import IwanElements
from palpate.units import Quantity, Range

__all__ = ["MemoryFit", "learn_with_memory"]

LIMITS = 32  # of the grid, geometric: neighbours differ by a tenth
LOWEST, HIGHEST = 0.04, 1.0  # its ends over the largest amplitude
# none, and half-decades: a metal's section hardens by a few per cent of K
HARDENINGS = (0.0, 0.03, 0.1, 0.3, 1.0)
PER_DECADE = 6  # relaxation times; neighbours a factor of 1.5 apart can hardly be told from one
NEGLIGIBLE = 1e-5  # of the stiffness: less can't be felt
SHAPES = 240  # samples that the displacement is learnt from
FEWEST = 8  # samples of the elastic body
_STILL = 1e-3  # of its largest place: nearer to rest round-off decides
_UNITS, _EFFORT = 6, 0.3  # of its energy


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


def learn_with_memory(
    train: LoadHistories,
    elastic: LoadHistory,
    *,
    relaxes: bool = False,
    mirrors: bool = True,
    name: str = "held body",
    effort: float = 1.0,
    workers: int | None = None,
    seed: int = 0,
) -> tuple[Surrogate, MemoryFit]:
    """Learn a held body that yields or creeps.

    Parameters
    ----------
    train : LoadHistories
        With turning points; a body that yields shows its hardening only when it is turned back.
    elastic : LoadHistory
        Of the same body without a memory: its instantaneous answer, as far as the histories reach.
    relaxes : bool
        Whether it creeps with time; else it yields.
    mirrors : bool
        Whether both sides answer alike.
    name : str
        The body's name.
    effort : float
        Multiplies the counts of candidates and iterations of the search for the energy.
    workers : int, optional
        Processes that search at a time; the result is the same with any number.
    seed : int
        Decides the starts of the networks' refinement.

    Returns
    -------
    Surrogate
        With an energy along the load, a field at its nodes, and springs that slip or relax as its memory.
    MemoryFit
        How well it fits the histories.

    Raises
    ------
    UsageError
        If there are no histories, the elastic one doesn't reach as far, or no stiffness explains the forces.
    """
    _check(train, elastic, mirrors)
    searches = {"effort": _EFFORT * effort, "workers": workers, "seed": seed}
    energy, found = _energy(train, elastic, mirrors, searches)
    with threadpool_limits(1):
        shape, shape_error = _shape(train, mirrors, seed)
        amplitudes = [_amplitudes(energy, history.place) for history in train.paths]
        reach = max(float(np.abs(q).max()) for q, _ in amplitudes)
        candidates = _times(train) if relaxes else _limits(reach)
        elements, error = _fitted(train, amplitudes, candidates, relaxes)
    near = np.abs(elastic.place) <= energy.inputs[0].high
    answer = -energy.force(elastic.place[near][:, None]) @ energy.baseline.directions[0]
    miss = float(np.abs(answer - elastic.force[near]).max() / np.abs(elastic.force[near]).max())
    samples = sum(map(len, train.paths))
    fit = MemoryFit(error, len(elements), len(candidates), miss, shape_error)
    meta = {**found.meta, "name": name, "histories": len(train), "samples": samples, "relaxes": relaxes}
    meta = {k: v for k, v in meta.items() if k != "solves"}
    return Surrogate(energy, {"displacement": shape}, elements, meta), fit


def _check(train: LoadHistories, elastic: LoadHistory, mirrors: bool) -> None:
    if not train.paths or len(elastic) < FEWEST:
        raise UsageError(
            f"{len(train)} histories and an elastic one of {len(elastic)} samples are too few to learn from.",
            fix=f"Give one history at least, better ten, and {FEWEST} samples of the elastic body.",
        )
    places = np.concatenate([path.place for path in train.paths])
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


def _energy(
    train: LoadHistories, elastic: LoadHistory, mirrors: bool, searches: dict[str, Any]
) -> tuple[LearntEnergy, EnergyHistory]:
    """Return the energy of the body without its memory, along the load."""
    D = np.append(train.direction, 0.0)
    far = np.abs(elastic.place)
    reach = max(float(np.abs(path.place).max()) for path in train.paths)
    last = float(far[far >= reach].min(initial=far.max()))  # what lies beyond the histories is not trained
    w, P, U = (
        a[(far > _STILL * far.max()) & (far <= last)] for a in (elastic.place, elastic.force, elastic.stored)
    )
    least = int(np.argmin(np.abs(w)))
    K = np.array([[P[least] / w[least]]])
    baseline = PadBaseline(RestStiffness.even(K), Stiffening.none(1), axes=D[None])
    low, high = float(min(w.min(), 0.0)), float(max(w.max(), 0.0))
    symmetry = np.zeros((0, 3, 3))
    if mirrors:
        high = max(-low, high)
        low, symmetry = -high, np.stack([np.eye(3), np.eye(3) - 2.0 * np.outer(D, D)])
    solves = Solves(w[:, None], U, -P[:, None], None, (Range("w", low, high, "m"),), symmetry=symmetry)
    exact: dict[str, Any] = {
        "target": 1e-7,
        "ridge": 1e-13,
        "tolerance": 1e-9,
    }  # what is solved bears no noise
    return learn_energy(solves, baseline, choose=False, units_max=_UNITS, networks=1, **exact, **searches)


def _amplitudes(energy: LearntEnergy, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the signed amplitude q (N,), √J, and its slope (N,), √J/m, at places (N,), m."""
    evaluator, direction = energy.evaluator(), energy.baseline.directions[0]
    out, none = np.zeros((2, len(places))), np.zeros(0)
    for i, w in enumerate(places):
        evaluator(w * direction, none)
        out[:, i] = evaluator.amplitude, evaluator.slope @ direction
    return out[0], out[1]


def _shape(train: LoadHistories, mirrors: bool, seed: int) -> tuple[NodeField, float]:
    """Return the displacement of all nodes over (w, P); histories that kept to one side tell of the other too."""
    X = np.concatenate([np.stack([path.place, path.force], axis=1) for path in train.paths])
    moved = np.concatenate([path.displacement for path in train.paths])
    along = np.asarray(train.direction, dtype=float)
    if mirrors and np.allclose(train.rest @ along, train.rest[0] @ along):  # a straight body across the load
        mirrored = moved - 2 * (moved @ along)[..., None] * along
        X, moved = np.concatenate([X, -X]), np.concatenate([moved, mirrored])
    Y = moved.reshape(len(moved), -1)
    rows = np.unique(np.linspace(0, len(X) - 1, SHAPES).round().astype(int))
    names = ("w", "m"), ("P", "N")
    ranges = [
        Range(name, float(column.min()), float(column.max()), unit)
        for (name, unit), column in zip(names, X.T, strict=True)
    ]
    outputs = [Quantity(f"u_{c} at node {i}", "m") for i in range(len(train.rest)) for c in "xy"]
    network, refined, _ = refined_network(
        X[rows], Y[rows], ranges, outputs, target=2e-3, units_max=8, starts=2, seed=seed
    )
    columns = np.array([(node, component) for node in range(len(train.rest)) for component in range(2)])
    field = NodeField(
        "displacement",
        "m",
        network,
        columns,
        np.pad(train.rest, ((0, 0), (0, 1))),
        train.node,
        np.ones(1, np.int64),
        "place and load",
        radius=train.radius,
        of_interest=np.array(train.nodes_of_interest, dtype=np.int64),
    )
    return field, float(refined.loo)


def _limits(reach: float) -> np.ndarray:
    """Return (y, c, τ) of each candidate (n, 3): a spring, and all limits with all hardenings."""
    limits = np.geomspace(LOWEST, HIGHEST, LIMITS) * reach
    grid = [(limit, hardening, np.inf) for limit in limits for hardening in HARDENINGS]
    return np.array([(np.inf, 0.0, np.inf), *grid])


def _times(train: LoadHistories) -> np.ndarray:
    """Return (y, c, τ) of each candidate (n, 3): a spring, and times from a third of a step to thrice the longest."""
    steps = np.concatenate([np.diff(path.times, prepend=0.0) for path in train.paths])
    low, high = (
        np.log10(steps[steps > 0].min() / 3),
        np.log10(3 * max(path.times[-1] for path in train.paths)),
    )
    times = np.logspace(low, high, 2 + int(PER_DECADE * (high - low)))
    return np.array([(np.inf, 0.0, np.inf), *((np.inf, 0.0, t) for t in times)])


def _fitted(
    train: LoadHistories,
    amplitudes: list[tuple[np.ndarray, np.ndarray]],
    candidates: np.ndarray,
    relaxes: bool,
) -> tuple[IwanElements, float]:
    from scipy.optimize import nnls

    limit, hardening, time = candidates.T
    all_of_them = IwanElements(np.ones(len(limit)), limit, hardening, time)
    columns = [
        slope[:, None] * all_of_them.elongations(q, path.times if relaxes else None)
        for (q, slope), path in zip(amplitudes, train.paths, strict=True)
    ]
    A, P = np.concatenate(columns), np.concatenate([path.force for path in train.paths])
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
