"""The number of units that a refined network needs: forward growth and backward pruning by the leave-one-out error."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from palpate.learning.search import Candidate, Search, Trial, sizes
from palpate.learning.starts import spread, units_at_residuals
from palpate.network import Network, Scaling
from palpate.network.radial import RadialFunction
from palpate.rbf.forms import unit_form
from palpate.rbf.freezing import freeze_refined, training_record
from palpate.rbf.refinement.refine import Refined, refine
from palpate.rbf.regressors import Regressors, Tail
from palpate.rbf.sample_checks import samples
from palpate.units import Quantity, Range

__all__ = ["grow", "prune", "refined_network"]

Refine = Callable[[np.ndarray, np.ndarray, np.ndarray, Regressors], Refined]


@dataclass(frozen=True, eq=False)
class _Scaled:
    """Scaled samples X (N, n), Y (N, m) whose networks are compared by the leave-one-out error."""

    X: np.ndarray
    Y: np.ndarray
    fit: Refine = refine

    def evaluate(self, candidate: Candidate, iterations: int, seconds: float | None = None) -> Candidate:
        """Refine a candidate as `fit` does."""
        network = self.fit(self.X, self.Y, candidate.theta, candidate.regressors)
        return replace(candidate, error=network.loo, network=network, iterations=network.iterations)


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
    filter_units: np.ndarray | None = None,
    form: str = "axis-aligned",
    radial: RadialFunction = "gaussian",
    tail: Tail = "affine",
) -> tuple[Network, Refined, tuple[Trial, ...]]:
    """Return the smallest refined network whose leave-one-out error is under the target, or the best there is.

    Sizes are tried upwards, each from several starts; a size that meets the target after a leap is pruned back.

    Parameters
    ----------
    X : (N, n)
        Inputs in SI units.
    Y : (N, m)
        Outputs in SI units.
    inputs, outputs : sequences of n ranges and m quantities
        Names, units and ranges of the columns of X, names and units of those of Y.
    target : float
        Leave-one-out error wanted, relative to the largest deviation of any output from its mean.
    units_max : int
        Largest number of units.
    starts : int
        Starts per size; the cost has many minima.
    seed : int
        Decides the starts.
    filter_units : (h, p), optional
        Scaled units of this form that the sequential filter found; they are one of the starts.
    form : str
        Of a unit: isotropic, axis-aligned, rotated, rank-1, … (see `palpate.rbf.forms`).
    radial : {"gaussian", "inverse-multiquadric", "matern-5/2"}
        Radial function of the units.
    tail : {"affine", "constant", "none"}
        Polynomial part beside the units.

    Returns
    -------
    Network, Refined, tuple of Trial
        The records are of the best start of each size.

    Raises
    ------
    UsageError
        If there is no such form, or shapes disagree.
    """
    X, Y, _, _, _ = samples(X, Y, inputs=len(inputs), outputs=len(outputs))
    scaling = Scaling.of(inputs, Y)
    xs, ys = scaling.scale_inputs(X), scaling.scale_outputs(Y)
    regressors = Regressors(unit_form(form, len(inputs)), radial, tail)
    search, winners = Search(_Scaled(xs, ys)), list[Candidate]()

    def judge(winner: Candidate) -> Candidate:
        winners.append(winner)
        return winner

    def begin(h: int, best: Candidate | None) -> Iterator[Candidate]:
        network = None if best is None else best.network
        for theta in _starts(xs, ys, h, starts, seed, filter_units, regressors, network):
            yield Candidate(regressors, theta, "spread")

    none = search.grow(lambda *_: [Candidate(regressors, _none(regressors), "tail")], [0], 0, judge=judge)
    most = min(units_max, _room(none))
    search.grow(begin, sizes(1, most), 0, begin=none, target=target, judge=judge)
    best = search.best.network
    assert best is not None
    trials = [winner.trial for winner in winners]
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
    """Grow a network: refine, add units where the error is, and again, to the target or `units_max`.

    There are never more than the samples can decide on, 1 + p unknowns each.

    Parameters
    ----------
    X, Y : (N, n), (N, m)
        Scaled.
    regressors : Regressors
        Form and radial function of the units, and the tail.
    theta : (h, p), optional
        Units to begin with.
    target : float
        Leave-one-out error per scaled output.
    units_max : int
        Largest number of units.
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
    search = Search(_Scaled(X, Y, fit))
    first = Candidate(regressors, _none(regressors) if theta is None else theta, "first")
    begun = search.try_all([first], 0)[0]
    most, ladder, h = min(units_max, _room(begun)), [], len(first.theta)
    while h < most:
        h = min(h + max(1, round(share * h)), most)
        ladder.append(h)

    def more(units: int, _: Candidate | None) -> Iterator[Candidate]:
        last = search.tried[
            -1
        ].network  # not the best: a size without a gain may be on the way to one that has one
        assert last is not None
        new = units_at_residuals(X, Y, last, units - len(last.theta), seed)
        yield Candidate(regressors, np.vstack([last.theta, new]), "grown")

    search.grow(more, ladder, 0, begin=begun, target=target)
    assert search.best.network is not None
    return search.best.network, search.trials


def prune(
    X: np.ndarray, Y: np.ndarray, network: Refined, *, target: float, fit: Refine = refine
) -> tuple[Refined, tuple[Trial, ...]]:
    """Prune a network: while the leave-one-out error stays under the target, drop the unit that it misses least.

    Which one that is follows in closed form for all units at once; the others are refined after each removal.
    """
    search, kept = Search(_Scaled(X, Y, fit)), network
    while len(kept.theta):
        theta = np.delete(kept.theta, int(np.argmin(kept.without)), axis=0)
        fewer = search.try_all([Candidate(kept.regressors, theta, "pruned")], 0)[0]
        if fewer.network is None or not fewer.error <= target:
            break
        kept = fewer.network
    return kept, search.trials


def _none(regressors: Regressors) -> np.ndarray:
    return np.zeros((0, regressors.form.size))


def _room(candidate: Candidate | None) -> int:
    """Return how many units the samples can decide on: as many unknowns would interpolate anything."""
    assert candidate is not None
    assert candidate.network is not None
    r = candidate.regressors
    return max(0, (candidate.network.rows - r.tail_size) // (1 + r.form.size))


def _starts(
    xs: np.ndarray,
    ys: np.ndarray,
    h: int,
    count: int,
    seed: int,
    filter_units: np.ndarray | None,
    regressors: Regressors,
    best: Refined | None,
) -> Iterator[np.ndarray]:
    """Yield the filter's units, the best network's with some more, and spread-out and random ones of several widths."""
    f = regressors.form
    rng = np.random.default_rng((seed, h))
    spacing = 2.0 / h ** (1.0 / f.inputs)
    if filter_units is not None and len(filter_units) >= h:
        yield filter_units[spread(f.centres(filter_units), h)]
    if best is not None and 0 < len(best.theta) < h:
        yield np.vstack([best.theta, units_at_residuals(xs, ys, best, h - len(best.theta), seed)])
    for i in range(count):
        rows = spread(xs, h) if i % 2 == 0 else rng.choice(len(xs), h, replace=False)
        width = spacing * (0.75, 1.0, 1.5, 0.5, 2.0, 1.25)[i % 6]
        widths = width * np.exp(rng.normal(0.0, 0.2, h))
        yield np.array(
            [f.unit(x, w, seed=1000 * i + k) for k, (x, w) in enumerate(zip(xs[rows], widths, strict=True))]
        )
