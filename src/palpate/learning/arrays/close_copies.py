"""Close copies of each place, such as f(x − h), f(x), f(x + h): one row of each is learnt from, or all.

The likelihood of a Gaussian process takes the agreement of close copies for evidence of a smooth function, and a
comparison by rows counts each place several times. So copies spoil a search where they tell nothing. They may tell two
things. Where they differ by more than a smooth function does, they tell a noise, and the search takes all rows. Else
the search takes one row of each place; then a kernel layer of all rows, which knows slopes, competes with the result.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.learning.arrays.array_samples import FEWEST, ArrayProblem, Samples
from palpate.learning.arrays.calibration import Finish
from palpate.learning.arrays.few_rows import few_places
from palpate.learning.arrays.fitted import Fitted
from palpate.learning.arrays.members import CrossedLayers
from palpate.learning.folds import fold_masks, held_out, near_places
from palpate.learning.kernel_layer import CENTRES_MAX, KernelLayer, likely_metric
from palpate.learning.search import Trial
from palpate.network.radial import RADIAL_FUNCTIONS
from palpate.options import FitOptions

__all__ = ["better_with_copies", "problem_without_copies"]

_CLOSE = 1.5  # rows for each place; rows at random are 1.3 at most, those of a single input
_PLACES, _ROWS = 1000, 10_000  # most at which copies are looked at
_WIDER = 1.05  # times the distance of copies: nothing is lost to rounding
_METRIC_SAMPLES = 200  # for the likelihood
_SHARE = 0.2  # of the places to judge by
_FOLDS = 5  # of a layer of all rows
_NOISE = 0.1  # of the error at other places: copies that differ more tell a noise
_SLOPES = 0.5  # times the result's error: a layer of all rows that misses less knows slopes


def problem_without_copies(samples: Samples) -> tuple[Samples, ArrayProblem, np.ndarray]:
    """Return the samples to learn from, scaled, and their places; copies that tell no noise are left out."""
    problem = _problem_of(samples)
    places = near_places(problem.X)
    count = len(np.unique(places))
    if few_places(places) or count > _PLACES or not _CLOSE * count <= len(places) <= _ROWS:
        return samples, problem, places
    centres = _centres_of_copies(problem.X, places)
    rows = np.unique(centres)
    if len(rows) < FEWEST or _copies_tell_noise(problem.X, problem.Y, centres):
        return samples, problem, places
    some = replace(samples, X=samples.X[rows], Y=samples.Y[rows], rows=tuple(rows.tolist()))
    alone = replace(_problem_of(some), record=problem.record)
    return some, alone, near_places(alone.X)


def better_with_copies(fitted: Fitted, samples: Samples, some: Samples, options: FitOptions) -> Fitted:
    """Return the result of some samples, or a kernel layer of all where that misses far less at other places."""
    from scipy.spatial import KDTree

    if some.rows is None or len(samples.X) > CENTRES_MAX:
        return fitted
    problem = _problem_of(samples)
    X, Y, rows = problem.X, problem.Y, np.array(some.rows)
    # without copies places are farther apart: copies too far to be left out are at one place here
    places = near_places(X[rows])[KDTree(X[rows]).query(X)[1]]
    masks = fold_masks(places, _FOLDS, seed=options.seed)
    layers = [
        CrossedLayers.of(likely_metric(name, X[rows], Y[rows], samples=_METRIC_SAMPLES), X, Y, masks)
        for name in RADIAL_FUNCTIONS
    ]
    best = min(layers, key=lambda one: one.error)
    if best.error >= _SLOPES * fitted.heldout * problem.unit:
        return fitted
    error = best.error / problem.unit
    trial = Trial("kernel", "kernel layer", best.layer.metric.radial, len(X), error, 0.0)
    trials = (*fitted.trials, trial)
    finish = Finish(samples, problem, trials, 0.0, options.level, places, best.layer.metric.scales)
    return replace(finish.kernel_network(best), seconds=fitted.seconds)


def _problem_of(samples: Samples) -> ArrayProblem:
    return ArrayProblem.of(samples.X, samples.Y, samples.inputs, samples.outputs, samples.bends)


def _centres_of_copies(X: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return for each row of X (N, n) the row of which it is a copy, or itself.

    How far copies lie say those that share a place: of a star all arms are about as long. The row that has most
    others so near is the centre of these, and so on with the rows that are left.
    """
    from scipy.spatial import KDTree

    tree = KDTree(X)
    _, own, counts = np.unique(places, return_inverse=True, return_counts=True)
    distances = np.asarray(tree.query(X, 2)[0])
    reach = _WIDER * float(np.quantile(distances[counts[own] > 1, 1], 0.9))
    near = tree.query_ball_point(X, reach)
    centres = np.full(len(X), -1)
    for row in np.argsort([-len(others) for others in near], kind="stable"):
        if centres[row] < 0:
            others = np.array(near[row])
            centres[others[centres[others] < 0]] = row
    return centres


def _copies_tell_noise(X: np.ndarray, Y: np.ndarray, centres: np.ndarray) -> bool:
    """Return True where copies X (N, n), Y (N, k) differ from their centres (N,) by more than slopes."""
    rows = np.unique(centres)
    kept, held = held_out(near_places(X[rows]), _SHARE, seed=0)
    known, asked = rows[kept], rows[held]
    metrics = [likely_metric(name, X[known], Y[known], samples=_METRIC_SAMPLES) for name in RADIAL_FUNCTIONS]
    misses = [Y - KernelLayer.fit(metric, X[known], Y[known]).predict(X) for metric in metrics]
    missed = min(misses, key=lambda one: _size(one[asked]))
    copies = np.isin(centres, known) & (centres != np.arange(len(X)))
    return _size((missed - missed[centres])[copies]) > _NOISE * _size(missed[asked])


def _size(missed: np.ndarray) -> float:
    return float(np.sqrt((missed**2).mean()))
