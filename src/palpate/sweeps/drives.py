"""Loads to learn from and to be judged by: random turning points, loading and unloading, holds."""

from __future__ import annotations

import itertools

import numpy as np

__all__ = ["even_steps", "held_loads", "load_unload_reload", "random_times", "random_turns"]


def random_turns(
    rng: np.random.Generator, low: float, high: float, *, turns: int = 6, step: float, outward: float = 0.0
) -> np.ndarray:
    """Return loads (N,) in N that go to and fro between random turning points, and back to 0.

    Parameters
    ----------
    rng : numpy.random.Generator
        Decides the turning points, which are even over the range.
    low, high : float
        Range of the loads, N.
    turns : int
        Number of turning points.
    step : float
        Largest step from load to load, N.
    outward : float
        Above 0 it draws the points to the ends of the range, where a body yields most.
    """
    share = rng.uniform(-1.0, 1.0, turns)
    share = np.sign(share) * np.abs(share) ** (1.0 / (1.0 + outward))
    return even_steps(np.append((low + high + share * (high - low)) / 2, 0.0), step)


def load_unload_reload(rng: np.random.Generator, low: float, high: float, *, step: float) -> np.ndarray:
    """Return loads (N,) in N: to a peak, back a part of the way, further than before, and off.

    Parameters
    ----------
    rng : numpy.random.Generator
        Decides the peak and the ways.
    low, high : float
        Range of the loads, N.
    step : float
        Largest step from load to load, N.
    """
    end = high if low >= 0 or rng.random() < 0.5 else low
    peak = end * rng.uniform(0.5, 1.0)
    back, further = peak * rng.uniform(0.0, 0.8), peak + (end - peak) * rng.random()
    return even_steps(np.array([peak, back, further, 0.0]), step)


def even_steps(knots: np.ndarray, step: float) -> np.ndarray:
    """Return the way from 0 through the knots (k,) in even steps no longer than `step`."""
    ends = np.concatenate([[0.0], knots])
    legs = [
        np.linspace(a, b, max(2, int(np.ceil(abs(b - a) / step))) + 1)[1:]
        for a, b in itertools.pairwise(ends)
    ]
    return np.concatenate(legs)


def random_times(
    rng: np.random.Generator, low: float, high: float, *, span: float, step: float, slowest: float = 3.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return times (N,) in s and loads (N,) in N: even ramps between random loads, every third one a hold.

    Parameters
    ----------
    rng : numpy.random.Generator
        Decides loads and times.
    low, high : float
        Range of the loads, N.
    span, step : float
        Length and step of the times, s.
    slowest : float
        Longest time of a ramp, s; the shortest is 0.05 s.
    """
    times = np.arange(1, round(span / step) + 1) * step
    knots_t, knots_p = [0.0], [0.0]
    while knots_t[-1] < span:
        hold = len(knots_t) % 3 == 2
        knots_t.append(knots_t[-1] + float(np.exp(rng.uniform(np.log(0.05), np.log(slowest)))))
        knots_p.append(knots_p[-1] if hold else float(rng.uniform(low, high)))
    return times, np.interp(times, knots_t, knots_p)


def held_loads(size: float, *, ramp: float, span: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return times (N,) in s, which grow geometrically, and loads (N,) in N that are put on and held.

    Parameters
    ----------
    size : float
        The load that is held, N.
    ramp, span : float
        Times at which it is all there and at which the hold ends, s.
    count : int
        Number of times during the hold.
    """
    on = np.linspace(0.0, ramp, 6)[1:]
    times = np.concatenate([on, ramp + np.geomspace(ramp / 2, span - ramp, count)])
    return times, size * np.minimum(times / ramp, 1.0)
