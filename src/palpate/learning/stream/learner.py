"""Learning at sensor rate: a small object around the pure `step`, with bounded refinement on retained samples.

learner = Learner(inputs, outputs)
event = learner.observe(x, y)           # SI units, as often as the sensor speaks
learner.publish(publisher)              # a reader in another process evaluates the newest network
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import ThreadpoolController

from palpate.errors import UsageError
from palpate.learning.learning_history import History
from palpate.learning.stream.following import Follower, Following
from palpate.learning.stream.output_scaling import OutputScaling, declared_scaling, settled_scaling, spikes
from palpate.learning.stream.refining import Progress, Refining, refined_state
from palpate.learning.stream.reservoir import Reservoir
from palpate.network import Network, Publisher, Scaling
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.settings import Settings, default
from palpate.rbf.filter.state import State, initial
from palpate.rbf.filter.step import Event, observe
from palpate.rbf.freezing import freeze
from palpate.rbf.output_modes import output_modes
from palpate.units import Quantity, Range, bounds

__all__ = ["Learner"]

# beyond these a scaled number is a broken sensor's: its square would swamp what double precision keeps
_FARTHEST_INPUT, _FARTHEST_OUTPUT = 2.0, 1e6
_MOVED = 0.1  # share of an input's range over which a sensor must have moved to show how large outputs are
_REFINING = Refining()
_PATIENCE = 10  # times the observations asked for, after which less movement has to do


class Learner:
    """A network that follows a stream of observations.

    As it comes, it follows a map that may rest, drift or jump, passes over outliers and learns the noise by place: a
    bank of linear filters over Gaussian units (see `palpate.learning.stream.tracker`) whose scales are looked for in
    the readings. An event says `outlier` and `changed`; `state.changed_at` is the observation that began the latest
    jump, `state.drifts` the probability of a drift.

    With `settings`, or another `refining`, it is one of the sequential filters. Every observation goes through the
    filter's `step`. Besides, R samples are retained, and every k-th observation also pays for one Levenberg–Marquardt
    iteration on them, from which the filter goes on with the Gauss–Newton posterior. Without refinement the object is
    the fold of `step`, bit by bit. These take noise-free samples farther, and trust every one of them.

    Outputs are scaled by what is declared: a `Scaling`, or ranges for the outputs. Without either the first
    `settle` observations decide (their mean, and their largest deviation from it, without a few spikes); they are then
    learnt in the order in which they came, and until then the network is their mean.

    Cost of an observation, h units of p numbers, d unknowns, q observed numbers. Following: 72 (h + n + 1)² operations
    and as many for each of three retained readings while a tracker is taught anew, or one Cholesky factor of a hundred
    readings while scales are looked for. A sequential filter: about 2 q d² operations for the full rule and
    (p_t + h)² + (h p)² r for the shared one, and for every k-th one R (h p)² +
    tries · ((h p)³/3 + 2 R (h + p_t)²), and that posterior's (h p)³ (shared) or R q d² (full).

    Memory: 14 (h + n + 1)² numbers of following, d² or (p_t + h)² + (h p)² of a filter's covariance, R (n + m + 2) of
    samples, M (n + m + 1) of the window, `remember` events; none of it grows with the stream. With `basis`, m counts
    the modes.

    Parameters
    ----------
    inputs : sequence of n ranges
        Names, units and ranges of the inputs; the ranges scale them.
    outputs : sequence of m quantities or ranges
        If all of them are ranges, these scale them.
    settings : Following or Settings, optional
        `Following()` if left out. `default()` is a sequential filter; `shared()` costs less for many outputs or units.
    refining : Refining, optional
        Refinement of a sequential filter; `None` for the filter alone. Given without settings, it asks for `default()`.
    scaling : Scaling, optional
        Between SI and scaled quantities.
    settle : int
        Observations from which scaling and modes come where they are not declared; more while the outputs do
        not change, or the inputs keep to a tenth of their ranges (ten times as many at most, then the newest).
    basis : int, optional
        Learn in at most so many output modes, found from the first `settle` observations.
    seed : int
        Of the reservoir.
    remember : int
        Events kept for `history`.

    Raises
    ------
    UsageError
        If the declarations do not fit together.
    """

    def __init__(
        self,
        inputs: Sequence[Range],
        outputs: Sequence[Quantity | Range],
        *,
        settings: Settings | Following | None = None,
        refining: Refining | None = _REFINING,
        scaling: Scaling | None = None,
        settle: int = 50,
        basis: int | None = None,
        seed: int = 0,
        remember: int = 10_000,
    ) -> None:
        if not inputs or not outputs or settle < 1 or remember < 1 or (basis is not None and basis < 1):
            raise UsageError(
                "A learner needs inputs, outputs, and positive counts.",
                fix="Name every column, and settle on one observation at least.",
            )
        if settings is None:
            settings = Following() if refining is _REFINING else default()
        settings = _check_declarations(inputs, outputs, settings)
        self.following = settings if isinstance(settings, Following) else None
        self.settings = settings.settings if isinstance(settings, Following) else settings
        self.inputs = tuple(inputs)
        self.outputs = tuple(o if isinstance(o, Quantity) else Quantity(o.name, o.unit) for o in outputs)
        self.refining = refining if refining is not None and refining.every and not self.following else None
        self.count = 0
        # two rules that both add units would add too many
        grows = self.refining is not None and self.refining.grows
        self._filter = replace(self.settings, units_max=0) if grows else self.settings
        self._scaling = scaling or declared_scaling(inputs, outputs)
        self._output_scaling: OutputScaling | None = None
        self._settle, self._basis, self._seed = settle, basis, seed
        self._early: deque[Observation] = deque(maxlen=_PATIENCE * settle)
        self._state: State | None = None
        self._follower: Follower | None = None
        self._reservoir: Reservoir | None = None
        self._progress = Progress()
        self._events: deque[tuple[Event, float]] = deque(maxlen=remember)
        self._threads = ThreadpoolController()
        by_modes = (
            not self.following and self.settings.update == "shared" and len(outputs) > self.settings.modes
        )
        if self._scaling is not None and basis is None and not by_modes:
            self._start(OutputScaling(self._scaling))

    def __repr__(self) -> str:
        return str(self)

    def __str__(self) -> str:
        state = "settling the scaling" if self._output_scaling is None else f"{self._units} units"
        sizes = f"{len(self.inputs)} inputs → {len(self.outputs)} outputs"
        return f"Learner: {sizes}, {state} after {self.count} observations"

    def observe(
        self,
        x: np.ndarray,
        y: np.ndarray,
        *,
        weight: float = 1.0,
        slopes: np.ndarray | None = None,
        slope_weight: float | np.ndarray = 1.0,
        curvatures: np.ndarray | None = None,
        curvature_weight: float | np.ndarray = 1.0,
    ) -> Event:
        """Learn one observation.

        Numbers that are not finite, or far outside of what a sensor could mean, are skipped, and the event says so.

        Parameters
        ----------
        x : (n,)
            Inputs in SI units.
        y : (m,)
            Outputs in SI units.
        weight : float
            How many ordinary observations this one counts as.
        slopes : (m, n), optional
            ∂y/∂x in SI units.
        slope_weight : float or (n,)
            How many ordinary values a scaled slope counts as; one of no weight may be not-a-number.
        curvatures : (m, n(n+1)/2), optional
            ∂²y/∂x_i∂x_j in SI units, i ≤ j.
        curvature_weight : float or (n(n+1)/2,)
            How many ordinary values a scaled curvature counts as.

        Returns
        -------
        Event
            In scaled quantities.

        Raises
        ------
        UsageError
            If an array has the wrong shape.
        """
        # copies: a loop may hand over the same buffers each time
        x, y = np.array(x, np.float64), np.array(y, np.float64)
        slopes = None if slopes is None else np.array(slopes, np.float64)
        curvatures = None if curvatures is None else np.array(curvatures, np.float64)
        n, m = len(self.inputs), len(self.outputs)
        observation = Observation(x, y, weight, slopes, slope_weight, curvatures, curvature_weight)
        if not _fits(observation, n, m):
            raise UsageError(
                f"An observation of shapes {x.shape} and {y.shape} came to a learner of {n} inputs and {m} outputs.",
                why="Every array has a row for each output, and weights one number, or one for each column.",
                fix=f"Pass x ({n},), y ({m},) and, where they are known, slopes ({m}, {n}) and curvatures "
                f"({m}, {n * (n + 1) // 2}).",
            )
        self.count += 1
        with self._threads.limit(limits=1), np.errstate(all="ignore"):
            event = (
                self._settle_scaling(observation)
                if self._output_scaling is None
                else self._learn(self._output_scaling.scale(observation))
            )
        self._events.append((event, self._innovation))
        return event

    @property
    def _innovation(self) -> float:
        if self._follower is not None:
            return self._follower.noise
        return np.nan if self._state is None else self._state.innovation

    @property
    def state(self) -> State:
        """The filter's state, in scaled quantities.

        Raises
        ------
        UsageError
            While scaling is still being settled.
        """
        if self._follower is not None:
            return self._follower.state()
        if self._state is None:
            raise UsageError(
                f"Nothing is learnt before {self._settle} observations have settled the scaling.",
                fix="Observe more, or declare the scaling.",
            )
        return self._state

    @property
    def network(self) -> Network:
        """The network learnt so far, frozen.

        Raises
        ------
        UsageError
            Before the first observation, unless the scaling is declared.
        """
        if self._output_scaling is not None:
            return self._output_scaling.freeze(self.state, self.settings, self.inputs, self.outputs)
        if not self._early:
            raise UsageError("Nothing has been observed yet.", fix="Observe, or declare the scaling.")
        scaling = self._scaling or Scaling.of(self.inputs, np.array([o.y for o in self._early]))
        mean = initial(len(self.inputs), len(self.outputs), self.settings)
        return freeze(mean, self.settings, self.inputs, self.outputs, scaling)

    def publish(self, publisher: Publisher) -> int:
        """Publish the network to readers in other processes, atomically; returns its serial number.

        Raises
        ------
        UsageError
            If it is not the publisher's kind of network.
        """
        return publisher.publish(self.network)

    @property
    def expected(self) -> float:
        """RMS error per scaled output on the samples that judge; not-a-number before the first refinement.

        A learner that follows has none; the noise's deviation stands for it.
        """
        return self._progress.expected if self._follower is None else float(np.sqrt(self._follower.noise))

    @property
    def numbers(self) -> int:
        """Count of the numbers kept, but for events: parameters, covariance, memory and retained samples."""
        if self._follower is not None:
            return self._follower.numbers
        s = self.state
        own = s.coefficients.size + s.theta.size + s.covariance.numbers + s.memory.size + s.errors.size
        return own + (0 if self._reservoir is None else self._reservoir.numbers)

    @property
    def history(self) -> History:
        """The record of the last observations."""
        events, innovation = zip(*self._events, strict=True) if self._events else ((), ())
        return History.of(events, innovation, (), 1)

    def _settle_scaling(self, observation: Observation) -> Event:
        """Before the scaling is known: collect; with the last one, learn all."""
        if observation.flaw:
            return _skip(0, observation.flaw)
        self._early.append(observation)
        if not self._settled():
            return _skip(0, "settling the scaling")
        Y = np.array([o.y for o in self._early])
        scaling = self._scaling or settled_scaling(self.inputs, Y)
        directions = output_modes(scaling.scale_outputs(Y), self._basis) if self._basis else None
        output_scaling = self._start(OutputScaling(scaling, directions), Y)
        early = list(self._early)
        self._early.clear()
        return [self._learn(output_scaling.scale(o)) for o in early][-1]

    def _settled(self) -> bool:
        """True once the observations say something of the outputs' size.

        An idle sensor does not; rare large readings are spikes or the beginning of a touch, which more readings tell.
        """
        if len(self._early) < self._settle:
            return False
        rare = spikes(np.array([o.y for o in self._early])).any()
        if self._scaling is None and rare and len(self._early) < 2 * self._settle:
            return False
        X = np.array([o.x for o in self._early])
        low, high = bounds(self.inputs)
        moved = float((np.ptp(X, axis=0) / (high - low)).max()) >= _MOVED
        varied = any(not np.array_equal(o.y, self._early[0].y) for o in self._early)
        return self._scaling is not None or (varied and (moved or len(self._early) == self._early.maxlen))

    def _start(self, output_scaling: OutputScaling, Y: np.ndarray | None = None) -> OutputScaling:
        self._output_scaling = output_scaling
        if self.following is not None:
            self._follower = Follower(self.following, *output_scaling.size)
            return output_scaling
        self._state = output_scaling.initial_state(self.settings, Y)
        if self.refining is not None:
            size = self._state.inputs, self._state.outputs
            keeping, samples = self.refining.keeping, self.refining.samples
            self._reservoir = Reservoir(samples, *size, keeping=keeping, seed=self._seed)
        return output_scaling

    def _learn(self, observation: Observation) -> Event:
        if why := _unusable(observation):
            return _skip(self._units, why)
        if self._follower is not None:
            return self._follower.observe(observation)
        state, event = observe(self.state, observation, self._filter, donate=True)
        if event.why:
            return event
        if self._reservoir is not None and self.refining is not None:
            self._reservoir.add(observation)
            if self._reservoir.seen % self.refining.every == 0:
                before, state = state.units, self._refine(state, self._reservoir, self.refining)
                event = replace(
                    event, grew=event.grew or state.units > before, units=state.units, refined=True
                )
        self._state = state
        return event

    @property
    def _units(self) -> int:
        return self._follower.units if self._follower is not None else self.state.units

    def _refine(self, state: State, reservoir: Reservoir, refining: Refining) -> State:
        try:
            refined, progress = refined_state(state, reservoir, self.settings, refining, self._progress)
        except ValueError:  # LAPACK's, for a matrix that is singular or not finite: the filter goes on alone
            self._progress = Progress()
            return state
        sound = np.isfinite(refined.coefficients).all() and np.isfinite(refined.theta).all()
        self._progress = progress if sound else Progress()
        return refined if sound else state


def _check_declarations(
    inputs: Sequence[Range], outputs: Sequence[Quantity | Range], settings: Settings | Following
) -> Settings | Following:
    """The settings, once the declarations are what they are taken for."""
    if not all(isinstance(i, Range) for i in inputs):
        raise UsageError("Inputs must be ranges.", fix='Declare them: Range("force", 0.0, 5.0, "N").')
    if not all(isinstance(o, (Quantity, Range)) for o in outputs):
        raise UsageError("Outputs must be quantities or ranges.", fix='Declare them: Quantity("tip", "m").')
    if not isinstance(settings, (Settings, Following)):
        raise UsageError(
            f"Settings are {settings!r}, not a Settings record.",
            fix='Take a preset, such as PRESETS["shared"](), or Settings(…).',
        )
    return settings


def _unusable(observation: Observation) -> str:
    """The reason why nothing is learnt from an observation in scaled quantities; empty if something can be."""
    if observation.flaw:
        return observation.flaw
    far = (
        np.abs(observation.x).max() > _FARTHEST_INPUT
        or np.abs(observation.targets()).max() > _FARTHEST_OUTPUT
    )
    return "far outside the declared scales" if far else ""


def _skip(units: int, why: str) -> Event:
    return Event(np.nan, np.nan, False, False, 0, units, why)


def _fits(observation: Observation, n: int, m: int) -> bool:
    """True where an observation's arrays are those of n inputs and m outputs."""
    fits = observation.x.shape == (n,) and observation.y.shape == (m,)
    for derivative, weight, q in (
        (observation.slopes, observation.slope_weight, n),
        (observation.curvatures, observation.curvature_weight, n * (n + 1) // 2),
    ):
        fits = fits and (derivative is None or derivative.shape == (m, q)) and np.shape(weight) in {(), (q,)}
    return fits
