"""Field surrogates made by formula, for tests that need one but no solver."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np
from touch_made import BOX, DEEPEST, RADIUS, ball, plane

from palpate.network import Network, Scaling
from palpate.surrogates import FieldSurrogate
from palpate.surrogates.fields import DepthAmplitude, LocalMode, Variation
from palpate.units import Quantity, Range, bounds


@functools.cache
def grid(side: int = 15) -> tuple[np.ndarray, np.ndarray]:
    """Points of the face z = 0, 100 mm wide, and of one below it; triangles of the face."""
    x = np.linspace(-0.05, 0.05, side)
    points = np.array([(a, b, 0.0) for a in x for b in x] + [(0.0, 0.0, -0.03)])
    k = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    lower = np.stack([k, k + side, k + 1], 1)
    upper = np.stack([k + 1, k + side, k + side + 1], 1)
    return points, np.vstack([lower, upper])


def variation(components: int, parameters: Sequence[Range], rng: np.random.Generator) -> Variation:
    """Random, of second degree in two directions of the face and all parameters; not all of the face in range."""
    axes = np.array([[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0]])
    v = 2 + len(parameters)
    powers = np.array([p for p in np.ndindex(*[3] * v) if sum(p) <= 2])
    table = np.zeros((5, len(powers), 11, 4, components))
    table[:, :, :-3] = rng.normal(0.0, 2e-4, (5, len(powers), 8, 4, components))
    middles, halves = [(r.low + r.high) / 2 for r in parameters], [0.4 * (r.high - r.low) for r in parameters]
    scales = np.array([[0.001, -0.002, *middles], [0.012, 0.03, *halves]])
    return Variation(table, powers, axes, scales)


def field(
    *,
    components: int = 3,
    modes: int = 5,
    extra=(),
    local_mode=True,
    varied=True,
    curved=False,
    seed=0,
    **more,
) -> FieldSurrogate:
    """A field of random modes, coefficients and local mode on the grid."""
    rng = np.random.default_rng(seed)
    points, triangles = grid()
    nodes, inputs = len(points), (*BOX, *extra)
    n, low, high = len(inputs), *bounds(inputs)
    mass = rng.uniform(0.5, 1.5, nodes)
    mass /= mass.sum()
    basis = np.linalg.qr(rng.normal(size=(nodes * components, modes)))[0].T.reshape(modes, nodes, components)
    table = np.zeros((1 if components == 1 else 2, 11, 5))
    table[:, :-3] = rng.normal(0.0, 1e-3, (len(table), 8, 5))
    own = variation(components, extra, rng) if varied else None
    net = Network.axis_aligned(
        inputs,
        [Quantity(f"b{k}", "") for k in range(modes)],
        centres=rng.uniform(-1, 1, (6, n)),
        widths=rng.uniform(0.5, 2.0, (6, n)),
        weights=rng.normal(size=(modes, 6)),
        tail=rng.normal(size=(modes, 1 + n)),
        scaling=Scaling((low + high) / 2, (high - low) / 2, np.zeros(modes), np.full(modes, 1e-3)),
    )
    parts = {
        "amplitude": DepthAmplitude("series", DEEPEST, 1e-3),
        "surface": ball() if curved else plane(),
        "radius": RADIUS,
        "local_mode": LocalMode(table, 0.02, 2e-3, own) if local_mode else None,
        "rest": rng.normal(0.0, 1e-3, (nodes, components)),
    } | more
    rest = parts.pop("rest")
    return FieldSurrogate(
        "displacement", "m", net, basis / np.sqrt(mass)[:, None], rest, points, triangles, mass, **parts
    )
