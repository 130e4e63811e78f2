"""Motions of a probe, sampled: what a transient solve and a surrogate are both driven with.

All of them start from `touch`, the probe's centre where it just meets the body at rest, and press along the unit
vector `inward`. A negative depth is a lifted probe.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError

__all__ = ["Drive", "ramp", "random_drive", "sinusoid", "step_hold"]

DOWN = (0.0, 0.0, -1.0)
BAND = 1.0  # Hz: palpation is slower, tremor (8–12 Hz) would need shorter samples
TONES = 12  # sinusoids in a random motion
LIFTED = 0.15  # share of a random drive's time without contact
INSTANT = 1e-6  # s: of a step that counts as sudden

Vector = Sequence[float] | np.ndarray


@dataclass(frozen=True, eq=False)
class Drive:
    """A sampled motion.

    Attributes
    ----------
    name : str
        Name of the motion, for tables and pictures.
    times : (N,)
        Ascending, s; the probe comes to its first position from outside.
    positions : (N, 3)
        Centre of the probe, m.
    """

    name: str
    times: np.ndarray
    positions: np.ndarray

    def __len__(self) -> int:
        return len(self.times)


def step_hold(
    touch: Vector, depth: float, times: Vector, *, inward: Vector = DOWN, name: str = "step and hold"
) -> Drive:
    """A sudden press that is held.

    Parameters
    ----------
    touch : (3,)
        Centre of the probe at first touch, m.
    depth : float
        Depth that is held, m.
    times : (N,)
        Times after the press at which it is looked at, s, positive and ascending. The press itself is put first,
        a microsecond after the start.
    inward : (3,)
        Direction of the press.
    name : str
        Name of the drive.

    Raises
    ------
    UsageError
        If the times don't ascend or the vectors are none.
    """
    after = np.asarray(times, dtype=float)
    clock = _ascending(np.concatenate([[INSTANT], after]))
    return _along(name, clock, np.full(len(clock), depth), touch, inward)


def ramp(
    touch: Vector,
    depth: float,
    rise: float,
    dt: float,
    *,
    hold: float = 0.0,
    fall: float = 0.0,
    inward: Vector = DOWN,
) -> Drive:
    """An even press that is held and drawn back.

    Parameters
    ----------
    touch : (3,)
        Centre of the probe at first touch, m.
    depth : float
        Depth that is reached, m.
    rise, hold, fall : float
        Times of the press, the hold and the way back, s.
    dt : float
        Sampling step, s.
    inward : (3,)
        Direction of the press.

    Raises
    ------
    UsageError
        For times that are negative, or a step that isn't positive.
    """
    clock = _clock(rise + hold + fall, dt)
    corners = np.cumsum([0.0, rise, hold, fall])
    depths = np.interp(clock, corners, [0.0, depth, depth, 0.0 if fall else depth])
    return _along("ramp", clock, depths, touch, inward)


def sinusoid(
    touch: Vector,
    depth: float,
    amplitude: float,
    frequency: float,
    dt: float,
    *,
    cycles: float = 3.0,
    inward: Vector = DOWN,
) -> Drive:
    """Depth that swings about a mean; it starts from the mean.

    Parameters
    ----------
    touch : (3,)
        Centre of the probe at first touch, m.
    depth, amplitude : float
        Mean of the depth and how far it swings, m.
    frequency : float
        In Hz.
    dt : float
        Sampling step, s.
    cycles : float
        Number of periods.
    inward : (3,)
        Direction of the press.

    Raises
    ------
    UsageError
        If frequency or step isn't positive.
    """
    if not frequency > 0:
        raise UsageError(f"A sinusoid can't have {frequency} Hz.", fix="Give a positive frequency in Hz.")
    clock = _clock(cycles / frequency, dt)
    depths = depth + amplitude * np.sin(2 * np.pi * frequency * clock)
    return _along("sinusoid", clock, depths, touch, inward)


def random_drive(
    touch: Vector,
    depth: float,
    slide: float,
    *,
    seconds: float = 20.0,
    dt: float = 0.01,
    seed: int = 0,
    band: float = BAND,
    lifted: float = LIFTED,
    inward: Vector = DOWN,
) -> Drive:
    """Pressing, sliding and lifting off at random.

    Depth and both coordinates along the surface are sums of sinusoids with random phases and frequencies below `band`,
    so the motion doesn't depend on `dt`.

    Parameters
    ----------
    touch : (3,)
        Centre of the probe at first touch, m.
    depth : float
        Largest depth, m.
    slide : float
        Largest distance from `touch` along the surface, m, each way.
    seconds, dt : float
        Length and sampling step, s.
    seed : int
        Decides phases and frequencies.
    band : float
        Highest frequency, Hz.
    lifted : float
        Share of the time without contact, in [0, 1).
    inward : (3,)
        Direction of the press.

    Raises
    ------
    UsageError
        If a length, time or share is not as above.
    """
    if not (0 <= lifted < 1 and depth > 0 and slide >= 0 and band > 0):
        raise UsageError(
            "A random drive needs a depth, a distance, a band and a share of time lifted.",
            why=f"It got depth {depth}, slide {slide}, band {band}, lifted {lifted}.",
            fix="Give depth > 0 m, slide ≥ 0 m, band > 0 Hz and 0 ≤ lifted < 1.",
        )
    clock, fine = _clock(seconds, dt), np.linspace(0.0, seconds, 2001)
    rng = np.random.default_rng(seed)
    press, first, second = (_Noise.drawn(rng, band) for _ in range(3))
    level = np.quantile(press.at(fine), lifted)
    depths = depth * (press.at(clock) - level) / (press.at(fine).max() - level)
    axes = _tangents(_unit(inward))
    sideways = sum(
        np.outer(slide * noise.at(clock) / np.abs(noise.at(fine)).max(), axis)
        for noise, axis in zip((first, second), axes, strict=True)
    )
    pressed = _along("random", clock, depths, touch, inward)
    return Drive("random", clock, pressed.positions + sideways)


@dataclass(frozen=True, eq=False)
class _Noise:
    """A sum of sinusoids."""

    frequencies: np.ndarray
    phases: np.ndarray

    @classmethod
    def drawn(cls, rng: np.random.Generator, band: float) -> _Noise:
        return cls(rng.uniform(0.05 * band, band, TONES), rng.uniform(0.0, 2 * np.pi, TONES))

    def at(self, times: np.ndarray) -> np.ndarray:
        return np.asarray(np.sin(2 * np.pi * np.outer(times, self.frequencies) + self.phases).sum(axis=1))


def _along(name: str, times: np.ndarray, depths: np.ndarray, touch: Vector, inward: Vector) -> Drive:
    start = np.asarray(touch, dtype=float)
    if start.shape != (3,) or not np.isfinite(start).all():
        raise UsageError(
            f"A probe can't start from {touch!r}.", fix="Give its centre at first touch, (3,) in m."
        )
    return Drive(name, times, start + np.outer(depths, _unit(inward)))


def _unit(vector: Vector) -> np.ndarray:
    direction = np.asarray(vector, dtype=float)
    length = np.linalg.norm(direction)
    if direction.shape != (3,) or not 0 < length < np.inf:
        raise UsageError(f"{vector!r} is no direction.", fix="Give a vector (3,) that isn't zero.")
    return np.asarray(direction / length)


def _tangents(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors across a unit vector; along x and y for one along z."""
    other = np.array([0.0, 1.0, 0.0]) if abs(normal[1]) < 0.9 else np.array([0.0, 0.0, 1.0])
    first = np.cross(other, -normal)
    first /= np.linalg.norm(first)
    return first, np.cross(-normal, first)


def _clock(seconds: float, dt: float) -> np.ndarray:
    if not (dt > 0 and np.isfinite(seconds) and seconds >= dt):
        raise UsageError(
            f"{seconds} s can't be sampled every {dt} s.", fix="Give dt > 0 and at least one step of it."
        )
    return dt * np.arange(1, int(seconds / dt + 1e-9) + 1)


def _ascending(times: np.ndarray) -> np.ndarray:
    if times.ndim != 1 or not np.isfinite(times).all() or not (np.diff(times) > 0).all():
        raise UsageError(
            "The times of a hold must ascend.",
            why=f"They are {times[1:]}.",
            fix="Sort them; all above 1e-6 s.",
        )
    return times
