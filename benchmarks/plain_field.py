"""A field under a touch in plain NumPy, inside its trained region: the rival of its compiled evaluator.

python -m benchmarks.plain_field        time of force and field of 4,293 nodes, both ways

Written as one would by hand from the formulas, in double precision, vectorised over units, modes and nodes.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from benchmarks.plain_query import PlainQuery
from palpate.network import Network, Scaling, TrainedRegion
from palpate.surrogates import ContactBaseline, ContactLaw, FieldSurrogate, LearntEnergy, TouchedSurface
from palpate.surrogates.fields import DepthAmplitude, LocalMode, Variation
from palpate.units import Quantity, Range, bounds

__all__ = ["PlainField", "made"]

NODES, MODES, UNITS, RADIUS, DEEPEST = 4293, 20, 20, 0.010, 0.012


class PlainField:
    """The field of a surrogate of Gaussian units and fixed radius, on a plane face z = 0, one touch at a time."""

    def __init__(self, field: FieldSurrogate) -> None:
        assert field.local_mode is not None
        net, self.field, self.local_mode = field.network, field, field.local_mode
        s = net.scaling
        self.rows = np.hstack([net.tail, net.weights]) * s.output_scale[:, None]
        self.modes = field.modes.reshape(len(field.modes), -1)
        self.nodes = np.flatnonzero(field.touched)
        self.points = field.points[self.nodes]

    def __call__(self, c: np.ndarray) -> np.ndarray:
        """The field (nodes, 3) of a probe with its centre at c (3,), in contact."""
        net, table, reach = self.field.network, self.local_mode.table, self.local_mode.reach
        s = self.field.radius - c[2]
        x = (c - net.scaling.input_centre) / net.scaling.input_half
        v = net.factors @ x - net.shifts
        b = self.rows @ np.concatenate([[1.0], x, np.exp(-(v * v).sum(axis=1))])
        f = float(self.field.amplitude.at(np.array(s)))
        out = ((f * b) @ self.modes).reshape(-1, 3) + self.field.rest
        foot, r = np.array([c[0], c[1], 0.0]), table.shape[1]
        offset = (self.points - foot) / reach
        distance = np.sqrt((offset**2).sum(axis=1))
        near = np.flatnonzero(distance < 1.0)
        j, of_depth = _splines(
            np.array([s / self.field.amplitude.deepest]) * (table.shape[2] - 3), table.shape[2]
        )
        profile = self.varied(foot, s / self.field.amplitude.deepest)
        along, across = table[:, :, j[0] : j[0] + 4] @ of_depth[:, 0]
        profile[:, 0, 2] += along
        profile[:, 1, 0] += across
        profile[:, 2, 1] += across
        first, four = _splines(distance[near] * (r - 3), r)
        rows = profile[first + np.arange(4)[:, None]]  # (4, near, 4, 3)
        around = np.column_stack([np.ones(len(near)), offset[near]])
        out[self.nodes[near]] += f * np.einsum("nh,kn,knhc->nc", around, four, rows, optimize=True)
        return np.asarray(out)

    def varied(self, foot: np.ndarray, share: float) -> np.ndarray:
        """The variation's profile (r, 4, 3) at a foot (3,) and a share of the deepest depth."""
        own = self.local_mode.variation
        assert own is not None
        q, m = own.table.shape[:2]
        j, of_depth = _splines(np.array([share]) * (q - 3), q)
        place = np.clip((own.axes @ foot - own.scales[0]) / own.scales[1], -1.0, 1.0)
        T = chebvander(place, own.powers.max())
        of_place = T[np.arange(len(place)), own.powers].prod(axis=1)
        weights = (of_depth[:, 0][:, None] * of_place).ravel()
        table = own.table[j[0] : j[0] + 4].reshape(4 * m, -1)
        return (weights @ table).reshape(own.table.shape[2:])


def _splines(t: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    first = np.minimum(t.astype(np.int64), count - 4)
    u = t - first
    v = 1.0 - u
    return first, np.array([v**3, 3 * u**3 - 6 * u**2 + 4, 3 * v**3 - 6 * v**2 + 4, u**3]) / 6.0


def made(nodes: int = NODES, modes: int = MODES) -> tuple[LearntEnergy, FieldSurrogate]:
    """An energy and a field by formula, of random numbers, on a plane face of 100 mm."""
    rng = np.random.default_rng(0)
    inputs = (
        Range("c_x", -0.02, 0.02, "m"),
        Range("c_y", -0.02, 0.02, "m"),
        Range("c_z", RADIUS - DEEPEST, RADIUS, "m"),
    )
    side = np.linspace(-0.05, 0.05, int(np.ceil(np.sqrt(nodes))))
    points = np.array([(x, y, 0.0) for x in side for y in side])[:nodes]
    corners = 0.05 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    face = TouchedSurface.of(
        corners, np.array([[0, 1, 2], [0, 2, 3]]), radius=0.006, reach=0.02, spacing=0.002
    )
    basis = np.linalg.qr(rng.normal(size=(3 * nodes, modes)))[0].T * np.sqrt(nodes)
    table = np.zeros((2, 17, 5))
    table[:, :-3] = rng.normal(0.0, 1e-3, (2, 14, 5))
    powers = np.array([(i, j) for i in range(11) for j in range(11 - i)])
    varied = np.zeros((4, len(powers), 17, 4, 3))
    varied[:, :, :-3] = rng.normal(0.0, 1e-4, (4, len(powers), 14, 4, 3))
    variation = Variation(varied, powers, np.eye(3)[:2], np.array([[0.0, 0.0], [0.02, 0.02]]))
    field = FieldSurrogate(
        "displacement",
        "m",
        _network(inputs, modes, 1e-3, rng),
        basis.reshape(modes, nodes, 3),
        np.zeros((nodes, 3)),
        points,
        np.zeros((0, 3), np.int64),
        np.full(nodes, 1.0 / nodes),
        amplitude=DepthAmplitude("series", DEEPEST, 1e-3),
        surface=face,
        radius=RADIUS,
        local_mode=LocalMode(table, 5 * RADIUS, 1e-4, variation),
    )
    region = TrainedRegion.of(rng.uniform(-1.0, 1.0, (400, 3)))
    root = 1e-3 * rng.normal(size=(4 + UNITS, 20))
    baseline = ContactBaseline(ContactLaw("series", 1e-3), face, RADIUS)
    energy = LearntEnergy(_network(inputs, 1, 0.01, rng), baseline, region=region, root=root)
    return energy, field


def _network(inputs: tuple[Range, ...], outputs: int, size: float, rng: np.random.Generator) -> Network:
    low, high = bounds(inputs)
    n = len(inputs)
    scaling = Scaling((low + high) / 2, (high - low) / 2, np.zeros(outputs), np.full(outputs, size))
    return Network.axis_aligned(
        inputs,
        [Quantity(f"b{i}", "") for i in range(outputs)],
        centres=rng.uniform(-1.0, 1.0, (UNITS, n)),
        widths=rng.uniform(0.5, 2.0, (UNITS, n)),
        weights=rng.normal(size=(outputs, UNITS)),
        tail=rng.normal(size=(outputs, 1 + n)),
        scaling=scaling,
    )


def _time(of: Callable[[], object], repeats: int) -> float:
    """Median over seven runs, in µs."""
    of()
    found = []
    for _ in range(7):
        begun = time.perf_counter()
        for _ in range(repeats):
            of()
        found.append((time.perf_counter() - begun) / repeats)
    return 1e6 * float(np.median(found))


def main() -> None:
    """Print both."""
    energy, field = made()
    force, eye, plain_force, plain = (
        energy.evaluator(),
        field.evaluator(),
        PlainQuery(energy),
        PlainField(field),
    )
    c = np.array([0.003, 0.001, 0.004])

    def both() -> None:
        force(c)
        eye(c)
        eye.field()

    def by_hand() -> None:
        plain_force(c)
        plain(c)

    ours, theirs = _time(both, 500), _time(by_hand, 100)
    print(f"coefficients of {MODES} modes: {_time(lambda: eye(c), 2000):.1f} µs")
    print(f"force, stiffness and field of {NODES} nodes: {ours:.0f} µs; in plain NumPy {theirs:.0f} µs")
    print(f"ratio {ours / theirs:.2f} (aim ≤ 0.7)")


if __name__ == "__main__":
    main()
