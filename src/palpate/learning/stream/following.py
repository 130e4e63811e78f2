"""Following a stream whose map may rest, drift or jump, with outliers and uneven noise among its readings.

A `Tracker` learns every reading at once. Its scales are looked for in the readings themselves: after 25, 50, 100, …
of them and as many after a jump, one density of the search at each observation. Where other scales are much likelier,
another tracker is taught the retained readings with them, a few at each observation, and takes the place of the first
once it has seen all. So no observation costs more than a few updates and one density.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from palpate import checks
from palpate.learning.stream.scales import Scales, search_scales
from palpate.learning.stream.tracker import Tracker
from palpate.rbf.filter.covariance import Shared
from palpate.rbf.filter.observation import Observation
from palpate.rbf.filter.settings import Settings
from palpate.rbf.filter.state import State
from palpate.rbf.filter.step import Event

__all__ = ["Follower", "Following"]

_FIRST = 25  # readings from which scales are looked for first
_MOST = 100  # readings that a search looks at
_MOVED = 0.2  # of scaled inputs: what is read at one place says nothing of the scales
_BETTER = 3.0  # gain of the log density for which a tracker is taught anew
_AT_ONCE = 3  # retained readings that it is shown at each observation
_WINDOW = 50  # readings of the windowed error


@dataclass(frozen=True)
class Following:
    """Settings of a learner that follows a stream: the default of `Learner`.

    Attributes
    ----------
    units_max : int
        Units at most.
    retained : int
        Newest readings that are retained, from which scales are looked for and units placed anew.
    """

    units_max: int = 50
    retained: int = 1000

    def __post_init__(self) -> None:
        for name in ("units_max", "retained"):
            checks.fits(f"The {name} of a learner that follows", getattr(self, name), least=1, whole=True)

    @property
    def settings(self) -> Settings:
        """The filter's settings that describe the network: its units' form, tail and number."""
        return Settings(form="axis-aligned", update="shared", units_max=self.units_max)


class Follower:
    """A tracker of n inputs and m outputs, scaled, the readings it saw last, and the search for better scales."""

    def __init__(self, following: Following, inputs: int, outputs: int) -> None:
        self.following = following
        self._size = inputs, outputs
        self._tracker = self._new(Scales.vague(inputs, outputs))
        _compile(self._new(Scales.vague(inputs, outputs)))
        self._retained: deque[tuple[Observation, float]] = deque(maxlen=following.retained)
        self._errors: deque[float] = deque(maxlen=_WINDOW)
        self._work: Generator[None, None, Tracker | None] | None = None
        self._due = _FIRST
        self.changed_at = 0

    @property
    def count(self) -> int:
        """Readings so far."""
        return self._tracker.count

    @property
    def units(self) -> int:
        """Units of the network."""
        return self._tracker.units

    @property
    def noise(self) -> float:
        """Mean variance of a reading, per scaled output."""
        return self._tracker.noise.mean

    @property
    def numbers(self) -> int:
        """Count of the numbers kept."""
        n, m = self._size
        return self._tracker.numbers + len(self._retained) * (n + m + 2)

    def observe(self, observation: Observation) -> Event:
        """Learn one reading, and do a portion of what else is to be done."""
        tracker = self._tracker
        before = tracker.units
        error = tracker.update(observation)
        self._retained.append((observation, tracker.weight))
        size = float(np.sqrt(error @ error))
        self._errors.append(size * size)
        jumped = tracker.changed_at > self.changed_at
        if jumped:
            self.changed_at, self._due, self._work = tracker.changed_at, tracker.count + _FIRST, None
        renewed = self._continue()
        units = self._tracker.units
        return Event(
            error=size,
            window_rms=float(np.sqrt(np.mean(self._errors))),
            grew=units > before,
            updated=tracker.weight > 0.5,
            pruned=max(before - units, 0),
            units=units,
            refined=renewed,
            outlier=tracker.weight <= 0.5,
            changed=jumped,
        )

    def _continue(self) -> bool:
        """Do the next portion of the search or of the teaching; True where another tracker took over."""
        if self._work is None:
            if self.count < self._due:
                return False
            self._due = self.changed_at + 2 * (self.count - self.changed_at)
            self._work = self._renewed()
        try:
            next(self._work)
        except StopIteration as done:
            self._work = None
            if done.value is not None:
                self._tracker = done.value
                # what it saw while it was taught was told by the other one, or not
                self._tracker.changed_at = self.changed_at
                return True
        return False

    def _renewed(self) -> Generator[None, None, Tracker | None]:
        """A tracker of likelier scales, taught what is retained; none where the present ones will do."""
        tracker = self._tracker
        since = max(self.changed_at - 1, 0)
        newest = list(self._retained)[since - self.count :][-_MOST:]
        right = [o for o, chance in newest if chance > 0.5]
        # readings that are mostly strange are not strange
        recent = right if 2 * len(right) > len(newest) else [o for o, _ in newest]
        X, Y = np.array([o.x for o in recent]), np.array([o.y for o in recent])
        if len(recent) < _FIRST // 2 or np.ptp(X, axis=0).max() < _MOVED:
            return None
        noise = np.array([tracker.noise_at(o.x) / o.weight for o in recent])
        scales, gain = yield from search_scales(X, Y, noise / noise.mean(), tracker.scales)
        if gain < _BETTER:
            return None
        new = self._new(scales, self.count - len(self._retained))
        while True:
            for _ in range(_AT_ONCE):
                if new.count == self.count:
                    return new
                new.update(self._retained[new.count - self.count][0])
            yield

    def _new(self, scales: Scales, count: int = 0) -> Tracker:
        return Tracker(scales, *self._size, self.following.units_max, count)

    def state(self) -> State:
        """The mixture of the bank as a state of the filter, in scaled quantities."""
        tracker = self._tracker
        n, m = self._size
        theta = tracker.theta
        size = theta.size
        return State(
            coefficients=tracker.mean,
            theta=theta,
            covariance=Shared(np.asfortranarray(tracker.covariance), np.zeros((size, size), order="F")),
            places=tracker.centres,
            errors=np.array(self._errors),
            memory=np.zeros((0, n + m)),
            memory_times=np.zeros(0, np.int64),
            silent=np.zeros(tracker.units, np.int64),
            count=tracker.count,
            innovation=tracker.noise.mean,
            changed_at=self.changed_at,
            drifts=tracker.drifts,
        )


def _compile(tracker: Tracker) -> None:
    """Have the kernels compiled before the first reading comes."""
    n, m = tracker.centres.shape[1], tracker.means.shape[2]
    tracker.update(Observation(np.zeros(n), np.zeros(m)))
