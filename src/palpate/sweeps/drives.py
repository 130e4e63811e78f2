"""Loads to learn from and to be judged by: random turning points, loading and unloading, holds."""

from __future__ import annotations

import itertools

import numpy as np

__all__ = ["even_steps", "held_loads", "load_unload_reload", "random_times", "random_turns"]


def random_turns(
    rng: np.random.Generator, low: float, high: float, *, turns: int = 6, step: float, outward: float = 0.0
) -> np.ndarray:
    """Return loads (N,) in N to and fro between random turning points, and back to 0, in steps of `step` at most.

    The points are even over the range; `outward` above 0 draws them to its ends, where a body yields most.
    """
    share = rng.uniform(-1.0, 1.0, turns)
    share = np.sign(share) * np.abs(share) ** (1.0 / (1.0 + outward))
    return even_steps(np.append((low + high + share * (high - low)) / 2, 0.0), step)


def load_unload_reload(rng: np.random.Generator, low: float, high: float, *, step: float) -> np.ndarray:
    """Return loads (N,) in N: to a random peak, back a part of the way, further than before, and off."""
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

    The times go to `span` in steps of `step`, s; a ramp takes from 0.05 s to `slowest`.
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

    The load `size`, N, is all there after `ramp`, s, and held until `span`; the hold has `count` times.
    """
    on = np.linspace(0.0, ramp, 6)[1:]
    times = np.concatenate([on, ramp + np.geomspace(ramp / 2, span - ramp, count)])
    return times, size * np.minimum(times / ramp, 1.0)
