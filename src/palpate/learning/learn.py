"""The sequential run: samples in shuffled passes, folded through `step`; and its thresholds from the data.

Of `automatic` settings the user says how accurate, the samples say the rest:

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

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from palpate import checks
from palpate.errors import UsageError
from palpate.learning.growth_frames import GrowthRecorder
from palpate.learning.learning_history import History
from palpate.learning.scatter import noise_variance, spacing
from palpate.network import Network, Scaling
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.prediction import value
from palpate.rbf.filter.settings import Settings, default
from palpate.rbf.filter.state import State, initial
from palpate.rbf.filter.step import Event, observe
from palpate.rbf.freezing import freeze, training_record
from palpate.rbf.output_modes import output_modes
from palpate.rbf.sample_checks import numbers, relative_error, samples, spread_of
from palpate.units import Quantity, Range

__all__ = ["UNITS_MAX", "Learned", "automatic", "check_target", "freeze", "learn", "ranges_of"]

RUNGS = ((0.5, 0.3), (0.35, 0.1), (0.25, 0.03), (0.18, 0.01), (0.13, 3e-3), (0.09, 1e-3))
"""ε_min/√n, and e'_min over the outputs' spread."""

UNITS_MAX = 60
"""Beyond this an observation costs more than it brings; a refinement is the better way there."""

_FEWEST = 20  # samples from which a fifth of them can judge
_MARGIN = 0.5  # of the target: runs on other samples, in another order, differ by about a factor of two
_LARGEST = 1000  # unknowns of a full covariance


@dataclass(frozen=True, eq=False)
class Learned:
    """Outcome of a sequential run.

    Attributes
    ----------
    network : Network
        The state, frozen.
    state : State
        From which learning can go on.
    scaling : Scaling
        Between the state's scaled quantities and physical ones.
    history : History
        Errors and units after every observation.
    settings : Settings
        Those that were used.
    target : float, optional
        Error that was asked for, relative to the outputs' spread.
    error : float
        Root mean square error that was reached, relative to the outputs' spread: on held-out samples where there
        were some, else on all samples.
    """

    network: Network
    state: State
    scaling: Scaling
    history: History
    settings: Settings
    target: float | None = None
    error: float = float("nan")

    @property
    def reached(self) -> bool:
        """True where the error is within the target; True where none was set."""
        return self.target is None or self.error <= self.target

    def __repr__(self) -> str:
        return str(self)

    def __str__(self) -> str:
        text = f"{self.history}\nError {self.error:.1e} of the outputs' spread"
        if not self.error < 1.0:
            text += (
                "\nThat is no better than the outputs' means. The papers' forms have no guards, and thresholds for "
                "their own experiments; `default` and `shared` are guarded."
            )
        if self.target is None:
            return text
        if self.reached:
            return f"{text}: within the target of {self.target:.1e}."
        return (
            f"{text}: the target of {self.target:.1e} is not reached.\n{_limit(self)}\n"
            "Refinement goes further than the filter; else give more samples or passes, or a looser target."
        )


def learn(
    X: np.ndarray,
    Y: np.ndarray,
    inputs: Sequence[Range],
    outputs: Sequence[Quantity],
    *,
    settings: Settings | None = None,
    target: float | None = None,
    passes: int = 5,
    seed: int = 0,
    weights: np.ndarray | None = None,
    slopes: np.ndarray | None = None,
    slope_weight: float = 1.0,
    heldout: tuple[np.ndarray, np.ndarray] | None = None,
    progress: Callable[[int, int], None] | None = None,
    watch: GrowthRecorder | None = None,
) -> Learned:
    """Learn a network sample by sample.

    Sweeps are ordered by load path, and load-ordered data can wreck a sequential run, so every pass is shuffled.

    Parameters
    ----------
    X : (N, n)
        Inputs in SI units.
    Y : (N, m)
        Outputs in SI units.
    inputs, outputs : sequences of n ranges and m quantities
        Names and units of the columns of X and Y, and the trained interval of each input.
    settings : Settings, optional
        `default()` if left out, or `automatic` ones if a target is given.
    target : float, optional
        Root mean square error wanted, relative to the outputs' root mean square deviation from their means. What
        was reached is in the outcome; a target that was missed raises nothing.
    passes : int
        How often each sample is presented.
    seed : int
        Decides the order of presentation.
    weights : (N,), optional
        How many ordinary samples each one counts as; one of no weight is left out.
    slopes : (N, m, n), optional
        ∂Y/∂X in SI units; the filter learns them as well.
    slope_weight : float
        How many ordinary values a scaled slope counts as.
    heldout : (X, Y), optional
        Unseen samples on which the error is recorded after every observation.
    progress : callable, optional
        Called with (done, total) observations.
    watch : GrowthRecorder, optional
        Keeps frames of the growth, and changes nothing of it.

    Returns
    -------
    Learned

    Raises
    ------
    UsageError
        If the arrays do not fit together or hold values that are not finite, or the target is not positive.
    """
    X, Y, w, slopes, s = samples(
        X, Y, weights, slopes, slope_weight=slope_weight, inputs=len(inputs), outputs=len(outputs)
    )
    slopes = None if slopes is None else slopes[w > 0]
    X, Y, s, w = X[w > 0], Y[w > 0], s[w > 0], w[w > 0]
    _check_run(inputs, outputs, settings, passes, seed)
    if target is not None:
        check_target(target)
        settings = (
            settings
            if settings is not None
            else automatic(X, Y, inputs, target=target, passes=passes, seed=seed, weights=w)
        )
    settings = default() if settings is None else settings
    scaling = Scaling.of(inputs, Y)
    xs, ys = scaling.scale_inputs(X), scaling.scale_outputs(Y)
    if heldout is not None:
        heldout = samples(*heldout, inputs=len(inputs), outputs=len(outputs))[:2]
    judge = _judge(heldout, scaling, settings)
    shown = _observations(xs, ys, scaling, w, slopes, s)
    modes = output_modes(ys, settings.modes) if settings.update == "shared" else None
    state = initial(len(inputs), len(outputs), settings, modes)
    if watch is not None:
        total = passes * len(xs)
        watch.begin((X, Y), (inputs, outputs), scaling, settings, total, heldout=judge is not None)
    rng = np.random.default_rng(seed)
    events: list[Event] = []
    innovation: list[float] = []
    errors: list[float] = []
    with threadpool_limits(1):  # small matrices: more BLAS threads cost time, and the bits of the result
        for _ in range(passes):
            for i in rng.permutation(len(xs)):
                state, event = observe(state, shown[i], settings, donate=True)
                events.append(event)
                innovation.append(state.innovation)
                if judge:
                    errors.append(judge(state))
                if watch is not None:
                    watch.observe(state, event, xs[i], errors[-1] if judge else np.sqrt(state.innovation))
            if progress:
                progress(len(events), passes * len(xs))
    network = freeze(state, settings, inputs, outputs, scaling, meta=training_record(X, Y, inputs))
    places, truth = (X, Y) if heldout is None else heldout
    error = relative_error(network.predict(places), truth, spread_of(Y))
    history = History.of(events, innovation, errors, passes)
    return Learned(network, state, scaling, history, settings, target, error)


def _limit(learned: Learned) -> str:
    """The reason why the filter missed its target, as far as its own records tell."""
    settings, innovation = learned.settings, learned.history.innovation
    if learned.state.units >= settings.units_max:
        return f"The network is at its limit of {settings.units_max} units (units_max)."
    if innovation.size and innovation[-1] ** 2 <= 4.0 * settings.noise:
        return "What is left is about the noise that neighbouring samples show; nothing can predict it."
    passes = np.array_split(innovation, max(learned.history.passes, 1))
    if len(passes) > 1 and passes[-1].mean() < 0.7 * passes[-2].mean():
        return "The error was still falling: more passes would help."
    return "The error has settled: this is as far as one observation at a time goes here."


def _observations(
    xs: np.ndarray,
    ys: np.ndarray,
    scaling: Scaling,
    weights: np.ndarray,
    slopes: np.ndarray | None,
    slope_weights: np.ndarray,
) -> list[Observation]:
    """The samples as the filter takes them."""
    if slopes is None:
        return [Observation(*one) for one in zip(xs, ys, weights, strict=True)]
    scaled = slopes * scaling.input_half / scaling.output_scale[:, None]
    return [
        Observation(x, y, w, slope, s) if s > 0 else Observation(x, y, w)
        for x, y, w, slope, s in zip(xs, ys, weights, scaled, slope_weights, strict=True)
    ]


def _judge(
    heldout: tuple[np.ndarray, np.ndarray] | None, scaling: Scaling, settings: Settings
) -> Callable[[State], float] | None:
    """A function from a state to its held-out RMSE over the largest held-out output."""
    if heldout is None:
        return None
    X, Y = heldout
    xs, full = scaling.scale_inputs(X), float(np.abs(Y).max()) or 1.0

    def judge(state: State) -> float:
        predicted = value(state, xs, settings) * scaling.output_scale + scaling.output_centre
        return float(np.sqrt(((predicted - Y) ** 2).mean())) / full

    return judge


def _check_run(
    inputs: Sequence[Range], outputs: Sequence[Quantity], settings: Settings | None, passes: int, seed: int
) -> None:
    if not all(isinstance(i, Range) for i in inputs) or not all(isinstance(o, Quantity) for o in outputs):
        raise UsageError(
            "Inputs must be declared as ranges, outputs as quantities.",
            fix='Pass Range("force", 0.0, 5.0, "N") and Quantity("tip", "m"); `palpate.fit` takes arrays alone.',
        )
    if settings is not None and not isinstance(settings, Settings):
        raise UsageError(
            f"Settings are {settings!r}, not a Settings record.",
            fix='Take a preset, such as PRESETS["default"](), or Settings(…).',
        )
    checks.fits("The number of passes", passes, least=1, whole=True)
    checks.fits("The seed", seed, least=0, whole=True)


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
    return _best_rung(rungs, X, Y, inputs, target * _MARGIN, passes, seed, weights)


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
        yield _change_settings(settings, given)


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


def _change_settings(settings: Settings, given: dict[str, Any]) -> Settings:
    try:
        return replace(settings, **given)
    except TypeError as error:
        raise UsageError(
            f"There is no such setting of the filter among {', '.join(given)}.", why=str(error)
        ) from error


def _best_rung(
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
