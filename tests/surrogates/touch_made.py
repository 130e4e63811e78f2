"""Energies of touch made by formula, for tests that need one but no solver."""

from __future__ import annotations

import functools

import numpy as np

from palpate.network import Network, Scaling, TrainedRegion
from palpate.surrogates import ContactBaseline, ContactLaw, Continuation, LearntEnergy, TouchedSurface
from palpate.surrogates.baselines import OverlapBaseline
from palpate.surrogates.surface import Overlap
from palpate.units import Quantity, Range, bounds

RADIUS = 0.010
DEEPEST = 0.012
BOX = [
    Range("c_x", -0.02, 0.02, "m"),
    Range("c_y", -0.02, 0.02, "m"),
    Range("c_z", RADIUS - DEEPEST, RADIUS, "m"),
]
SOFT = Range("modulus", 4e3, 12e3, "Pa")
PROBE = Range("radius", 0.006, 0.012, "m")


def network(inputs, *, units: int = 40, seed: int = 1, size: float = 0.02) -> Network:
    """ℓ with rotated units of random place and width, each of weight about `size`, and a gentle slope."""
    rng, n = np.random.default_rng(seed), len(inputs)
    low, high = bounds(inputs)
    factors = np.tril(rng.normal(0.0, 0.3, (units, n, n)))
    factors[:, np.arange(n), np.arange(n)] = rng.uniform(0.5, 1.5, (units, n))
    centres = rng.uniform(-1.2, 1.2, (units, n))
    tail = np.concatenate([[0.0], rng.uniform(-0.1, 0.1, n)])[None]
    tail[0, 3] = -0.3  # stiffer with depth
    return Network(
        inputs=tuple(inputs),
        outputs=(Quantity("ln of U over U0"),),
        factors=factors,
        shifts=np.einsum("kij,kj->ki", factors, centres),
        weights=rng.normal(0.0, size, (1, units)),
        tail=tail,
        scaling=Scaling((low + high) / 2, (high - low) / 2, np.array([10.0]), np.array([1.0])),
    )


@functools.cache
def plane() -> TouchedSurface:
    """The face z = 0 of a body below it, 100 mm wide."""
    corners = 0.05 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    return TouchedSurface.of(
        corners, np.array([[0, 1, 2], [0, 2, 3]]), radius=0.006, reach=0.02, spacing=0.002
    )


@functools.cache
def ball() -> TouchedSurface:
    """The cap of a ball of 30 mm, its top the origin, as triangles of 3 mm."""
    rings, sides = 9, 36
    polar = np.linspace(0.0, 0.9, rings + 1)[1:]
    turn = 2 * np.pi * np.arange(sides) / sides
    ring = [[np.sin(a) * np.cos(t), np.sin(a) * np.sin(t), np.cos(a)] for a in polar for t in turn]
    points = 0.03 * (np.array([[0.0, 0.0, 1.0], *ring]) - [0.0, 0.0, 1.0])
    triangles = [[0, 1 + k, 1 + (k + 1) % sides] for k in range(sides)]
    for r in range(rings - 1):
        for k in range(sides):
            a, b = 1 + r * sides + k, 1 + r * sides + (k + 1) % sides
            triangles += [[a, a + sides, b + sides], [a, b + sides, b]]
    return TouchedSurface.of(points, np.array(triangles), radius=0.006, reach=0.013, spacing=0.002)


@functools.cache
def slab() -> TouchedSurface:
    """Two faces x = ±10 mm of a slab, 60 mm wide."""
    y, z = np.meshgrid([-0.03, 0.03], [-0.03, 0.03])
    face = np.stack([np.full(4, 0.01), y.ravel(), z.ravel()], axis=1)
    points = np.vstack([face, face * [-1.0, 1.0, 1.0]])
    front = np.array([[0, 1, 3], [0, 3, 2]])
    return TouchedSurface.of(points, np.vstack([front, front[:, ::-1] + 4]), radius=0.005, spacing=0.0015)


def ridges() -> tuple[np.ndarray, np.ndarray]:
    """Points (P, 3) and triangles of a face of 80 mm with a groove along y, 4 mm wide and 1.5 mm deep."""
    x, y = np.arange(-40.0, 41.0), np.linspace(-40.0, 40.0, 9)
    points = np.stack([*np.meshgrid(x, y, indexing="ij"), np.zeros((81, 9))], axis=-1).reshape(-1, 3)
    # not as high as the plane: there the deepest trained place would be on the edge of the range, to rounding
    points[:, 2] = -0.3 - 1.5 * np.exp(-((points[:, 0] / 1.5) ** 2))
    first = (9 * np.arange(80)[:, None] + np.arange(8)).ravel()
    triangles = np.vstack(
        [np.column_stack([first, first + 9, first + 10]), np.column_stack([first, first + 10, first + 1])]
    )
    return 1e-3 * points, triangles


@functools.cache
def overlap_baseline(weight: float = 1.0) -> OverlapBaseline:
    """A ball over the groove of `ridges`, by its overlap."""
    surface = TouchedSurface.of(*ridges(), radius=RADIUS, spacing=0.0025, shoulder=RADIUS / 3)
    overlap = Overlap.of(surface, *ridges())
    return OverlapBaseline(
        ContactLaw("series", 1e-3), surface, RADIUS, overlap=overlap.change(weight), weight=weight
    )


def touch_energy(
    *, box=BOX, extra=(), surface=None, law=None, seed=1, deep=True, radius_at=None, **more
) -> LearntEnergy:
    """A touched body with the inputs of a box and `extra`, trained at random points of them."""
    inputs = [*box, *extra]
    net = network(inputs, seed=seed, **{k: more.pop(k) for k in ("units", "size") if k in more})
    rng = np.random.default_rng(seed)
    parts = {
        "region": TrainedRegion.of(rng.uniform(-1.0, 1.0, (400, len(inputs)))),
        "continuation": Continuation.of(inputs, deepest=DEEPEST if deep else np.inf),
        "root": 0.002 * rng.normal(size=(1 + len(inputs) + net.units, 20)),
    }
    law = law or ContactLaw("series", 1e-3)
    baseline = ContactBaseline(law, surface or plane(), more.pop("radius", RADIUS), radius_at)
    baseline = more.pop("baseline", baseline)
    return LearntEnergy(net, baseline, **(parts | more))


def inside_points(count: int, extra=(), seed: int = 3) -> np.ndarray:
    """Inputs of the trained box, most of them in contact."""
    low, high = bounds([*BOX, *extra])
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))


def around_points(count: int, extra=(), seed: int = 4) -> np.ndarray:
    """Inputs in and about the trained box: up to its size beyond it in position, deep ones too."""
    low, high = bounds([*BOX, *extra])
    wide = np.array([0.02, 0.02, 0.008, *(0.2 * (high - low)[3:])])
    return np.random.default_rng(seed).uniform(low - wide, high + wide, (count, len(low)))


def differences(function, X: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """∂function/∂x_i (N, …, k) by central differences of sixth order, one step for each of the first k inputs."""
    columns = []
    for i, h in enumerate(steps):
        total = 0.0
        for m, weight in ((1, 45.0), (2, -9.0), (3, 1.0)):
            up, down = X.copy(), X.copy()
            up[:, i] += m * h
            down[:, i] -= m * h
            total = total + weight * (function(up) - function(down))
        columns.append(total / (60.0 * h))
    return np.stack(columns, axis=-1)


def undisturbed(S: LearntEnergy, X: np.ndarray, reach: float) -> np.ndarray:
    """Rows of X in contact, farther than `reach` (m) from wherever a third derivative of the energy jumps.

    That is at the deepest trained depth, where the place at which ℓ is taken crosses the end of a range, and at the
    nodes of the surface; and 20 times as far from first touch, where derivatives by s grow as powers of 1/s.
    """
    going = S.continuation
    _, slope, _ = S.baseline.surface.at(X[:, :3])
    s = S.depth(X)
    over = np.maximum(s - going.deepest, 0.0)
    taken = X[:, :3] + (over - going.depth_width * np.tanh(over / going.depth_width))[:, None] * slope
    keep = (s > 20 * reach) & (np.abs(s - going.deepest) > reach)
    for end in bounds(S.inputs[:3]):
        keep &= (np.abs(taken - end) > reach).all(axis=1)
    cell = (X[:, :3] - S.baseline.surface.frame[:3]) / S.baseline.surface.frame[3]
    return X[keep & ((np.abs(cell - np.round(cell)) * S.baseline.surface.frame[3]) > reach).all(axis=1)]
