"""The sequential run: samples in shuffled passes, folded through `step`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from palpate import checks
from palpate.errors import UsageError
from palpate.learning.automatic import automatic, check_target
from palpate.learning.growth_frames import GrowthRecorder
from palpate.learning.learning_history import History
from palpate.network import Network, Scaling
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.prediction import value
from palpate.rbf.filter.settings import Settings, default
from palpate.rbf.filter.state import State, initial
from palpate.rbf.filter.step import Event, observe
from palpate.rbf.freezing import freeze, training_record
from palpate.rbf.output_modes import output_modes
from palpate.rbf.sample_checks import relative_error, samples, spread_of
from palpate.units import Quantity, Range

__all__ = ["Learned", "freeze", "learn"]


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
