"""A model by formula, of a plane face and a probe of 10 mm, and touches of it."""

from __future__ import annotations

import functools

import numpy as np

from palpate.learning.correction import Corrector
from palpate.network import Network, Scaling, TrainedRegion
from palpate.surrogates import (
    ContactBaseline,
    ContactLaw,
    Continuation,
    LearntEnergy,
    Surrogate,
    TouchedSurface,
)
from palpate.units import Quantity, Range, bounds

RADIUS, DEEPEST = 0.010, 0.012
BOX = [Range("c_x", -0.02, 0.02, "m"), Range("c_y", -0.02, 0.02, "m"), Range("c_z", -0.002, 0.010, "m")]
MODULUS = Range("modulus", 4e3, 12e3, "Pa")


@functools.cache
def face() -> TouchedSurface:
    corners = 0.05 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    return TouchedSurface.of(
        corners, np.array([[0, 1, 2], [0, 2, 3]]), radius=RADIUS, reach=0.014, spacing=0.002
    )


def model(*, extra=(), certain: bool = False, units: int = 30, **more) -> LearntEnergy:
    """Units of random place and width; weights known to a thousandth of ln κ, or exactly."""
    inputs, rng = [*BOX, *extra], np.random.default_rng(1)
    n = len(inputs)
    low, high = bounds(inputs)
    factors = np.tril(rng.normal(0.0, 0.3, (units, n, n)))
    factors[:, np.arange(n), np.arange(n)] = rng.uniform(0.5, 1.2, (units, n))
    tail = np.concatenate([[0.0], rng.uniform(-0.1, 0.1, n)])[None]
    tail[0, 3] = -0.3  # stiffer with depth
    net = Network(
        inputs=tuple(inputs),
        outputs=(Quantity("ln U/U0"),),
        factors=factors,
        shifts=np.einsum("kij,kj->ki", factors, rng.uniform(-1.2, 1.2, (units, n))),
        weights=rng.normal(0.0, 0.02, (1, units)),
        tail=tail,
        scaling=Scaling((low + high) / 2, (high - low) / 2, np.array([10.0]), np.array([0.5])),
    )
    parts = {
        "region": TrainedRegion.of(rng.uniform(-1.0, 1.0, (200, n))),
        "continuation": Continuation.of(inputs, deepest=DEEPEST),
        "root": None if certain else 1e-3 * rng.normal(size=(1 + n + units, 12)),
    }
    return LearntEnergy(net, ContactBaseline(ContactLaw("series", 1e-3), face(), RADIUS), **(parts | more))


def touches(count: int, seed: int = 0, *, shallowest: float = 0.0005, extra=()) -> np.ndarray:
    """Inputs in contact."""
    low, high = bounds([*BOX, *extra])
    high[2] = RADIUS - shallowest
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))


def scaled(energy: LearntEnergy, factor: float) -> LearntEnergy:
    """The body of `factor` times the energy."""
    from dataclasses import replace

    net = energy.network
    tail = net.tail.copy()
    tail[0, 0] += np.log(factor) / net.scaling.output_scale[0]
    return replace(energy, network=replace(net, tail=tail))


def corrector_of(energy: LearntEnergy, **options) -> Corrector:
    """A corrector of a body that has this energy and nothing else."""
    return Corrector(Surrogate(energy), **options)
