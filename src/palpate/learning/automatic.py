"""Thresholds from the data: the user says how accurate, the samples say the rest.

=====================  ==============================================================================
form                   rotated up to three inputs; above that axis-aligned, whose state is smaller
update                 full up to 5 outputs and 1,000 unknowns, where an observation costs about 2 ms; the
                       shared-weight filter for more outputs, unit by unit for more unknowns
R                      the noise that neighbouring samples show, at least a tenth of the target
edge_weight            1 with noise or several inputs: there a sample at the edge must not count 200 times
M, S_w                 50 samples, fewer where there are few; two passes
units_max              one datum per unknown at least, and 60
ε_max, γ               √n, half the range's diagonal; ε_min is reached after a third of the first pass
κ, P₀                  the form's own: distances and outputs are scaled
e_min, e'_min, ε_min   a rung of a ladder from few units to many, chosen by trial
=====================  ==============================================================================

The last three can't be read off the data: a threshold far below what the filter reaches makes it grow for its
own transient, and the network gets worse, not better. So the filter is run on four fifths of the data, rung by
rung, judged on the last fifth, and stops at the first rung that meets the target, or where two rungs in a row
were no better than one before. The rungs do not depend on the target. A tighter target can therefore only lead
to the same rung or a better one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.learning.scatter import noise_variance, spacing
from palpate.network import Scaling
from palpate.rbf.filter.settings import Settings
from palpate.rbf.sample_checks import numbers, relative_error, samples, spread_of
from palpate.units import Quantity, Range

__all__ = ["UNITS_MAX", "automatic", "check_target", "ranges_of", "relative_error", "spread_of"]

RUNGS = ((0.5, 0.3), (0.35, 0.1), (0.25, 0.03), (0.18, 0.01), (0.13, 3e-3), (0.09, 1e-3))
"""ε_min/√n, and e'_min over the outputs' spread."""

UNITS_MAX = 60
"""Beyond this an observation costs more than it brings; a refinement is the better way there."""

_FEWEST = 20  # samples from which a fifth of them can judge
_MARGIN = 0.5  # of the target: runs on other samples, in another order, differ by about a factor of two
_LARGEST = 1000  # unknowns of a full covariance


def automatic(
    X: np.ndarray,
    Y: np.ndarray,
    inputs: Sequence[Range] | None = None,
    *,
    target: float,
    passes: int = 5,
    seed: int = 0,
    weights: np.ndarray | None = None,
    **given: Any,
) -> Settings:
    """Return settings with which the filter reaches a target on these data, or comes as near as it can.

    Parameters
    ----------
    X : (N, n)
        Inputs of the samples, SI units.
    Y : (N, m)
        Outputs of the samples, SI units.
    inputs : n ranges, optional
        Of the data if left out.
    target : float
        Root mean square error wanted, relative to the outputs' root mean square deviation from their means;
        1e-2 is a coefficient of determination of 1 − 1e-4.
    passes : int
        How often the filter will see each sample.
    seed : int
        Decides which samples judge, and the order of the others.
    weights : (N,), optional
        As in `learn`.
    **given
        Settings that stay as they are given.

    Returns
    -------
    Settings

    Raises
    ------
    UsageError
        If the target is not positive, a given setting is unknown, or the arrays do not fit together.
    """
    check_target(target)
    n = None if inputs is None else len(inputs)
    X, Y, w, _, _ = samples(X, Y, weights, inputs=n)
    X, Y, weights = X[w > 0], Y[w > 0], None if weights is None else w[w > 0]
    inputs = ranges_of(X) if inputs is None else inputs
    scaling = Scaling.of(inputs, Y)
    xs, ys = scaling.scale_inputs(X), scaling.scale_outputs(Y)
    rungs = list(_ladder(xs, ys, target, seed, given))
    if len(X) < _FEWEST or not np.ptp(ys):
        return rungs[len(rungs) // 2]
    return _tried(rungs, X, Y, inputs, target * _MARGIN, passes, seed, weights)


def check_target(target: float) -> None:
    """Refuse a target that is no positive number."""
    if isinstance(target, bool) or not isinstance(target, (int, float, np.number)) or not 0 < target < np.inf:
        raise UsageError(
            f"A target of {target!r} can't be reached or missed.",
            why="It is a root mean square error relative to the outputs' spread.",
            fix="Give a positive number, such as 1e-2.",
        )


def ranges_of(X: np.ndarray, names: Sequence[str] | None = None) -> tuple[Range, ...]:
    """Return ranges that samples X (N, n) span; an input that doesn't vary gets one of length 1 or more about it."""
    X = numbers("Inputs X", X, (None, None))
    low, high = X.min(axis=0), X.max(axis=0)
    size = np.maximum(np.abs(low), np.abs(high))
    flat = high - low <= 1e-12 * size
    half = np.where(flat, 0.5 * np.maximum(1.0, size), 0.0)
    names = names if names is not None else [f"x{i}" for i in range(X.shape[1])]
    ends = zip(names, low - half, high + half, strict=True)
    return tuple(Range(str(name), float(a), float(b)) for name, a, b in ends)


def _ladder(
    xs: np.ndarray, ys: np.ndarray, target: float, seed: int, given: dict[str, Any]
) -> Iterator[Settings]:
    """Yield settings from few units to many."""
    (N, n), m = xs.shape, ys.shape[1]
    spread = float(np.sqrt((ys**2).mean())) or 1.0
    noise = noise_variance(xs, ys, seed)
    base = replace(_base(N, n, m, noise > 0.0), noise=max(noise, min(1e-8, (0.1 * target * spread) ** 2)))
    nearest, whole = spacing(xs), float(np.sqrt(n))
    for distance, error in RUNGS:
        least = min(max(distance * whole, nearest), whole)
        settings = replace(
            base,
            error_rms_min=error * spread * float(np.sqrt(m)),
            error_min=error * spread * float(np.sqrt(m)),
            distance_max=whole,
            distance_min=least,
            distance_decay=float((least / whole) ** (3.0 / N)),
        )
        yield _changed(settings, given)


def _base(N: int, n: int, m: int, noisy: bool) -> Settings:
    """Return the settings that the data's shape decides."""
    form = "axis-aligned" if n == 1 or n > 3 else "rotated"
    p = Settings(form=form).regressors(n).form.size
    units = int(np.clip((N * m - m * (1 + n)) / (m + p), 0, UNITS_MAX))
    unknowns = m * (1 + n) + units * (m + p)
    update = "shared" if m > 5 else ("full" if unknowns <= _LARGEST else "decoupled")
    return Settings(
        form=form,
        update=update,  # type: ignore[arg-type]
        edge_weight=1.0 if noisy or n > 1 else Settings.edge_weight,
        window=int(np.clip(N // 2, 5, 50)),
        prune_after=2 * N,
        units_max=units,
    )


def _changed(settings: Settings, given: dict[str, Any]) -> Settings:
    try:
        return replace(settings, **given)
    except TypeError as error:
        raise UsageError(
            f"There is no such setting of the filter among {', '.join(given)}.", why=str(error)
        ) from error


def _tried(
    rungs: Sequence[Settings],
    X: np.ndarray,
    Y: np.ndarray,
    inputs: Sequence[Range],
    target: float,
    passes: int,
    seed: int,
    weights: np.ndarray | None,
) -> Settings:
    """Return the first rung that meets the target on samples it hasn't seen, or the best of those tried."""
    from palpate.learning.learn import learn  # which asks this module for settings

    judging = np.zeros(len(X), dtype=bool)
    judging[np.random.default_rng(seed).permutation(len(X))[: max(4, len(X) // 5)]] = True
    w = None if weights is None else np.asarray(weights)[~judging]
    outputs = [Quantity(f"y{i}") for i in range(Y.shape[1])]
    spread = spread_of(Y)
    best, least, worse = rungs[0], np.inf, 0
    for rung in dict.fromkeys(rungs):
        network = learn(
            X[~judging], Y[~judging], inputs, outputs, settings=rung, passes=passes, seed=seed, weights=w
        ).network
        error = relative_error(network.predict(X[judging]), Y[judging], spread)
        worse = 0 if error < least else worse + 1
        if error < least:
            best, least = rung, error
        if least <= target or worse == 2:
            break
    return best
