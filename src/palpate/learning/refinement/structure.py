"""How many units a refined network needs: forward growth and backward pruning by the leave-one-out error."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.network import Network, Scaling
from palpate.network.radial import RadialFunction
from palpate.rbf.forms import unit_form
from palpate.rbf.freezing import freeze_refined, training_record
from palpate.rbf.refinement.refine import Refined, refine
from palpate.rbf.regressors import Regressors, Tail
from palpate.rbf.sample_checks import samples
from palpate.units import Quantity, Range

__all__ = ["Trial", "freeze_refined", "grow", "placed", "prune", "refined_network", "spread"]

Refine = Callable[[np.ndarray, np.ndarray, np.ndarray, Regressors], Refined]


@dataclass(frozen=True)
class Trial:
    """One size that was tried: number of units, leave-one-out error per scaled output, condition number."""

    units: int
    loo: float
    condition: float

    @classmethod
    def of(cls, found: Refined) -> Trial:
        """What is kept of a refinement."""
        return cls(len(found.theta), found.loo, found.condition)


def refined_network(
    X: np.ndarray,
    Y: np.ndarray,
    inputs: Sequence[Range],
    outputs: Sequence[Quantity],
    *,
    target: float = 5e-7,
    units_max: int = 6,
    starts: int = 6,
    seed: int = 0,
    known: np.ndarray | None = None,
    form: str = "axis-aligned",
    radial: RadialFunction = "gaussian",
    tail: Tail = "affine",
) -> tuple[Network, Refined, tuple[Trial, ...]]:
    """The smallest refined network whose leave-one-out error is under the target, or the best up to `units_max`.

    Sizes are tried upwards, each from several starts; a size that meets the target after a leap is pruned back.

    Parameters
    ----------
    X : (N, n)
        Inputs in SI units.
    Y : (N, m)
        Outputs in SI units.
    inputs, outputs : sequences of n ranges and m quantities
    target : float
        Leave-one-out error wanted, relative to the largest deviation of any output from its mean.
    units_max : int
    starts : int
        Starts per size; the cost has many minima.
    seed : int
    known : (h, p), optional
        Scaled units of this form that the sequential filter found; they are one of the starts.
    form : str
        Of a unit: isotropic, axis-aligned, rotated, rank-1, … (see `palpate.rbf.forms`).
    radial : {"gaussian", "inverse-multiquadric", "matern-5/2"}
    tail : {"affine", "constant", "none"}

    Returns
    -------
    Network, Refined, tuple of Trial

    Raises
    ------
    UsageError
        If there is no such form, or shapes disagree.
    """
    X, Y, _, _, _ = samples(X, Y, inputs=len(inputs), outputs=len(outputs))
    scaling = Scaling.of(inputs, Y)
    xs, ys = scaling.scale_inputs(X), scaling.scale_outputs(Y)
    regressors = Regressors(unit_form(form, len(inputs)), radial, tail)
    best = refine(xs, ys, _none(regressors), regressors)
    trials = [Trial.of(best)]
    for h in _sizes(min(units_max, _room(best))):
        if best.loo <= target:
            break
        found = [refine(xs, ys, s, regressors) for s in _starts(xs, ys, h, starts, seed, known, best)]
        winner = min(found, key=lambda r: r.loo)
        trials.append(Trial.of(winner))
        best = min(best, winner, key=lambda r: r.loo)
    if best.loo <= target and len(trials) > 1 and trials[-1].units > trials[-2].units + 1:
        best, pruned = prune(xs, ys, best, target=target)
        trials += pruned
    network = freeze_refined(best, inputs, outputs, scaling, meta=training_record(X, Y, inputs))
    return network, best, tuple(trials)


def grow(
    X: np.ndarray,
    Y: np.ndarray,
    regressors: Regressors,
    *,
    theta: np.ndarray | None = None,
    target: float,
    units_max: int,
    share: float = 0.25,
    seed: int = 0,
    fit: Refine = refine,
) -> tuple[Refined, tuple[Trial, ...]]:
    """Forward growth: refine, add units where the error is, and again, to the target or `units_max`.

    There are never more than the samples can decide on, 1 + p unknowns each.

    Parameters
    ----------
    X, Y : (N, n), (N, m)
        Scaled.
    regressors : Regressors
    theta : (h, p), optional
        Units to begin with.
    target : float
        Leave-one-out error per scaled output.
    units_max : int
    share : float
        New units at a time, relative to those there are; one at least.
    seed : int
        Decides directions where the form has them.
    fit : callable
        `refine`, with its options bound.

    Returns
    -------
    Refined, tuple of Trial
        The best by leave-one-out error, and what was tried.
    """
    best = now = fit(X, Y, _none(regressors) if theta is None else theta, regressors)
    trials = [Trial.of(now)]
    units_max = min(units_max, _room(now))
    while best.loo > target and len(now.theta) < units_max:
        h = len(now.theta)
        new = min(max(1, round(share * h)), units_max - h)
        now = fit(X, Y, np.vstack([now.theta, placed(X, Y, now, new, seed)]), regressors)
        trials.append(Trial.of(now))
        best = min(best, now, key=lambda r: r.loo)
    return best, tuple(trials)


def prune(
    X: np.ndarray, Y: np.ndarray, found: Refined, *, target: float, fit: Refine = refine
) -> tuple[Refined, tuple[Trial, ...]]:
    """Backward pruning: while the leave-one-out error stays under the target, drop the unit it misses least.

    Which one that is follows in closed form for all units at once; the others are refined after each removal.

    Parameters
    ----------
    X, Y : (N, n), (N, m)
        Scaled.
    found : Refined
    target : float
        Leave-one-out error per scaled output that must be kept.
    fit : callable
        `refine`, with the options bound that `found` was made with.

    Returns
    -------
    Refined, tuple of Trial
        The smallest that meets the target, or `found`.
    """
    trials = []
    while len(found.theta):
        fewer = fit(X, Y, np.delete(found.theta, int(np.argmin(found.without)), axis=0), found.regressors)
        trials.append(Trial.of(fewer))
        if not fewer.loo <= target:
            break
        found = fewer
    return found, tuple(trials)


def placed(X: np.ndarray, Y: np.ndarray, found: Refined, count: int, seed: int = 0) -> np.ndarray:
    """New units (count, p) where the error is large and other units are far, as wide as their spacing."""
    f, h = found.regressors.form, len(found.theta) + count
    error = ((Y - found.predict(X)) ** 2).sum(axis=1)
    width = 2.0 / h ** (1.0 / f.inputs)
    distance = np.full(len(X), width**2)
    units = []
    for k in range(count):
        i = int(np.argmax(error * distance))
        units.append(f.unit(X[i], width, seed=1000 * seed + h + k))
        distance = np.minimum(distance, ((X - X[i]) ** 2).sum(axis=1))
    return np.array(units)


def spread(points: np.ndarray, count: int) -> np.ndarray:
    """Indices of `count` points far from each other, by farthest-point selection (Gonzalez 1985)."""
    chosen = [int(np.argmin(points.sum(axis=1)))]
    distance = np.full(len(points), np.inf)
    while len(chosen) < count:
        distance = np.minimum(distance, ((points - points[chosen[-1]]) ** 2).sum(axis=1))
        chosen.append(int(np.argmax(distance)))
    return np.array(chosen)


def _none(regressors: Regressors) -> np.ndarray:
    return np.zeros((0, regressors.form.size))


def _room(found: Refined) -> int:
    """How many units its samples can decide on: as many unknowns would interpolate anything and judge nothing."""
    r = found.regressors
    return max(0, (found.rows - r.tail_size) // (1 + r.form.size))


def _sizes(largest: int) -> list[int]:
    """Every size up to six, then by about a third more each time."""
    sizes = [h for h in (1, 2, 3, 4, 5, 6, 8, 11, 15, 20, 27, 36, 48, 64) if h <= largest]
    return sizes if not sizes or sizes[-1] == largest else [*sizes, largest]


def _starts(
    xs: np.ndarray,
    ys: np.ndarray,
    h: int,
    count: int,
    seed: int,
    known: np.ndarray | None,
    best: Refined,
) -> Iterator[np.ndarray]:
    """Spread-out units of several widths, random ones, the filter's units, and the last size's and some more."""
    f = best.regressors.form
    rng = np.random.default_rng((seed, h))
    spacing = 2.0 / h ** (1.0 / f.inputs)
    if known is not None and len(known) >= h:
        yield known[spread(f.centres(known), h)]
    if 0 < len(best.theta) < h:
        yield np.vstack([best.theta, placed(xs, ys, best, h - len(best.theta), seed)])
    for i in range(count):
        rows = spread(xs, h) if i % 2 == 0 else rng.choice(len(xs), h, replace=False)
        width = spacing * (0.75, 1.0, 1.5, 0.5, 2.0, 1.25)[i % 6]
        widths = width * np.exp(rng.normal(0.0, 0.2, h))
        yield np.array(
            [f.unit(x, w, seed=1000 * i + k) for k, (x, w) in enumerate(zip(xs[rows], widths, strict=True))]
        )
