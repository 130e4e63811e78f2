"""From histories to a held body that remembers.

The elastic twin of the body (the same one of a material without a memory) gives the stretch h(w): with K its stiffness
at rest, ℓ = ½ ln(2U/K w²). Along a history the elongation of any one element is then known, and the force

    P_t = h'(w_t) Σ k_i e_i(t)

is linear in the stiffnesses. So a dictionary is laid out, of limits and rises or of relaxation times on a grid, and the
k_i are its non-negative least squares (Lawson & Hanson 1974): a convex problem with one answer, which is sparse. No
start, no iteration count and no seed decide it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from palpate.errors import UsageError
from palpate.format import share
from palpate.learning.plastic.paths import HeldPath, HeldPaths
from palpate.learning.structure import refined_network
from palpate.network import Network
from palpate.surrogates.memories import IwanElements
from palpate.surrogates.plastic import HeldBody
from palpate.units import Quantity, Range

__all__ = ["Fit", "learn_held"]

LIMITS = 32  # of the grid, geometric: neighbours differ by a tenth
LOWEST, HIGHEST = 0.04, 1.0  # its ends over the largest stretch
RISES = (0.0, 0.03, 0.1, 0.3, 1.0)  # none, and half-decades: a metal's section hardens by a few per cent of K
PER_DECADE = 6  # relaxation times; neighbours a factor of 1.5 apart can hardly be told from one
NEGLIGIBLE = 1e-5  # of the stiffness: less can't be felt
SHAPES = 240  # samples that the displacement is learnt from
FEWEST = 8  # samples of the elastic twin


@dataclass(frozen=True)
class Fit:
    """What was reached on the histories learnt from.

    Attributes
    ----------
    error : float
        Root mean square error of the force, of the largest force.
    elements : int
        How many of the dictionary are used.
    candidates : int
        How many it has.
    stretch_error : float
        Largest error of the elastic twin's force, of its largest force.
    shape_error : float
        Root mean square error of the displacement, leave-one-out, of its largest deviation.
    """

    error: float
    elements: int
    candidates: int
    stretch_error: float
    shape_error: float

    def __str__(self) -> str:
        return (
            f"force to {share(self.error)} of the largest with {self.elements} of {self.candidates} elements, "
            f"elastic twin to {share(self.stretch_error)}, shape to {share(self.shape_error)}"
        )


def learn_held(
    train: HeldPaths,
    twin: HeldPath,
    *,
    relaxes: bool = False,
    mirrors: bool = True,
    name: str = "held body",
    seed: int = 0,
) -> tuple[HeldBody, Fit]:
    """Learn a held body that yields or creeps.

    Parameters
    ----------
    train : HeldPaths
        With turning points; a body that yields shows its hardening only when it is turned back.
    twin : HeldPath
        Of the same body without a memory: its elastic, instantaneous answer, as far as the histories reach.
    relaxes : bool
        Whether it creeps with time; else it yields.
    mirrors : bool
        Whether both sides answer alike.
    name : str
    seed : int
        Decides the starts of the networks' refinement.

    Returns
    -------
    HeldBody, Fit

    Raises
    ------
    UsageError
        If there are no histories, the twin doesn't reach as far, or no stiffness explains the forces.
    """
    with threadpool_limits(1):
        return _learn(train, twin, relaxes, mirrors, name, seed)


def _learn(
    train: HeldPaths, twin: HeldPath, relaxes: bool, mirrors: bool, name: str, seed: int
) -> tuple[HeldBody, Fit]:
    _check(train, twin, mirrors)
    stretch, stretch_error = _stretch(twin, mirrors, seed)
    shape, shape_error = _shape(train, mirrors, seed)
    rest = np.zeros((len(train.rest), 3))
    rest[:, :2] = train.rest
    places = np.concatenate([path.place for path in train.paths])

    def body(elements: IwanElements) -> HeldBody:
        return HeldBody(
            name=name,
            stretch=stretch,
            shape=shape,
            elements=elements,
            mirrors=mirrors,
            rest=rest,
            nodes_of_interest=np.array(train.nodes_of_interest, dtype=np.int64),
            touch_node=train.node,
            directions=np.append(train.direction, 0.0)[None],
            reach=float(np.abs(places).max()),
            radius=train.radius,
            meta={"histories": len(train), "samples": len(places), "relaxes": relaxes},
        )

    # the elements are fitted along the stretch as it is evaluated
    bare = body(IwanElements.sliders(np.ones(1), np.full(1, np.inf), np.zeros(1)))
    stretches = [bare.stretches(path.place) for path in train.paths]
    candidates = _times(train) if relaxes else _limits(max(float(np.abs(h).max()) for h, _ in stretches))
    elements, error = _fitted(train, stretches, candidates, relaxes)
    return body(elements), Fit(error, len(elements), len(candidates), stretch_error, shape_error)


def _check(train: HeldPaths, twin: HeldPath, mirrors: bool) -> None:
    if not train.paths or len(twin) < FEWEST:
        raise UsageError(
            f"{len(train)} histories and a twin of {len(twin)} samples are too few to learn from.",
            fix=f"Give one history at least, better ten, and {FEWEST} samples of the elastic twin.",
        )
    places = np.concatenate([path.place for path in train.paths])
    low, high = float(places.min()), float(places.max())
    a, b = float(min(twin.place.min(), 0.0)), float(max(twin.place.max(), 0.0))
    if mirrors:
        low, high, a, b = 0.0, max(-low, high), 0.0, max(-a, b)
    if low < a or high > b:
        raise UsageError(
            f"The elastic twin was led to {a:.4g} … {b:.4g} m, the histories to {low:.4g} … {high:.4g} m.",
            why="The stretch has to be known wherever they go.",
            fix="Load the twin more.",
        )


def _stretch(twin: HeldPath, mirrors: bool, seed: int) -> tuple[Network, float]:
    """ℓ of the elastic twin, and the largest error of its slope as a force."""
    w, P, U = (
        a[np.abs(twin.place) > 1e-3 * np.abs(twin.place).max()] for a in (twin.place, twin.force, twin.stored)
    )
    least = int(np.argmin(np.abs(w)))
    K = float(P[least] / w[least])
    log = 0.5 * np.log(2 * U / (K * w**2))
    x = w**2 if mirrors else w
    low = 0.0 if mirrors else float(x.min())
    inputs = [Range("w²" if mirrors else "w", low, float(x.max()), "m²" if mirrors else "m")]
    network, _, _ = refined_network(
        x[:, None], log[:, None], inputs, [Quantity("ℓ", "")], target=1e-5, units_max=3, starts=3, seed=seed
    )
    slope = np.array([network.jacobian(np.array([one]))[0, 0] for one in x])
    value = network.predict(x[:, None])[:, 0]
    found = K * w * np.exp(2 * value) * (1 + (2 if mirrors else 1) * x * slope)
    return network, float(np.abs(found - P).max() / np.abs(P).max())


def _shape(train: HeldPaths, mirrors: bool, seed: int) -> tuple[Network, float]:
    """Displacement of all nodes over (w, P); histories that kept to one side tell of the other too."""
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
    return network, float(refined.loo)


def _limits(reach: float) -> np.ndarray:
    """(y, c, τ) of each candidate (n, 3): a spring, and all limits with all rises."""
    limits = np.geomspace(LOWEST, HIGHEST, LIMITS) * reach
    grid = [(limit, rise, np.inf) for limit in limits for rise in RISES]
    return np.array([(np.inf, 0.0, np.inf), *grid])


def _times(train: HeldPaths) -> np.ndarray:
    """(y, c, τ) of each candidate (n, 3): a spring, and times from a third of a step to three times the longest."""
    steps = np.concatenate([np.diff(path.times, prepend=0.0) for path in train.paths])
    low, high = (
        np.log10(steps[steps > 0].min() / 3),
        np.log10(3 * max(path.times[-1] for path in train.paths)),
    )
    times = np.logspace(low, high, 2 + int(PER_DECADE * (high - low)))
    return np.array([(np.inf, 0.0, np.inf), *((np.inf, 0.0, t) for t in times)])


def _fitted(
    train: HeldPaths, stretches: list[tuple[np.ndarray, np.ndarray]], candidates: np.ndarray, relaxes: bool
) -> tuple[IwanElements, float]:
    from scipy.optimize import nnls

    limit, rise, time = candidates.T
    all_of_them = IwanElements(np.ones(len(limit)), limit, rise, time)
    columns = [
        slope[:, None] * all_of_them.elongations(h, path.times if relaxes else None)
        for (h, slope), path in zip(stretches, train.paths, strict=True)
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
    elements = IwanElements(k[used], limit[used], rise[used], time[used])
    return elements, float(rest / np.sqrt(len(P)) / largest)
