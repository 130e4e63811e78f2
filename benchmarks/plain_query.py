"""A touched body's answer in plain NumPy, inside its trained region: the rival of its compiled evaluator.

python -m benchmarks.plain_query        time of one answer and of one trust figure, both ways

Written as one would by hand from the formulas, vectorised over units and over the 64 coefficients of the surface's
spline, with nothing prepared twice; where a continuation is needed it is not at home. The tests compare both.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np

from palpate.surrogates import LearntEnergy
from palpate.units import bounds

__all__ = ["PlainQuery"]


class PlainQuery:
    """Energy, force, stiffness and trust figure of Gaussian surrogates of fixed radius, one point at a time."""

    def __init__(self, energy: LearntEnergy) -> None:
        net, baseline = energy.network, energy.baseline
        s = net.scaling
        self.centre, self.half = s.input_centre, s.input_half
        self.A, self.b = net.factors, net.shifts
        self.offset, self.scale = s.output_centre[0], s.output_scale[0]
        self.tail, self.weights = net.tail[0], net.weights[0]
        self.gram = np.einsum("kri,krj->kij", self.A, self.A)
        self.radius, self.law = baseline.radius, baseline.law.numbers()
        self.frame, self.C = baseline.surface.frame, baseline.surface.coefficients
        self.flat = None
        if baseline.surface.profile.size:  # a flat one: its distance over the middle is that of its plane
            middle = self.centre[None, :3]
            d, n, _ = baseline.surface.at(middle)
            self.flat = n[0], d[0] - n[0] @ middle[0]
        self.root = np.zeros((0, 0)) if energy.root is None else self.scale * energy.root
        self.region = energy.region

    def distance(self, c: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        """Signed distance, gradient and Hessian of the surface's spline, or over the middle of its plane, at c (3,)."""
        if self.flat is not None:
            return float(self.flat[0] @ c + self.flat[1]), self.flat[0], np.zeros((3, 3))
        h = self.frame[3]
        u = (c - self.frame[:3]) / h
        i = u.astype(np.int64)
        t = u - i
        s = 1.0 - t
        B = np.array([s**3 / 6, 2 / 3 - t * t * (1 - t / 2), 2 / 3 - s * s * (1 - s / 2), t**3 / 6])
        P = np.array([-s * s / 2, -t * (2 - 1.5 * t), s * (2 - 1.5 * s), t * t / 2])
        Q = np.array([s, 1 - 3 * s, 1 - 3 * t, t])
        W = np.stack([B, P, Q])  # (order, node, axis)
        block = self.C[i[0] - 1 : i[0] + 3, i[1] - 1 : i[1] + 3, i[2] - 1 : i[2] + 3]
        T = np.tensordot(np.tensordot(block, W[:, :, 2], (2, 1)), W[:, :, 1], (1, 1))  # (a, z order, y order)
        T = np.tensordot(W[:, :, 0], T, (1, 0))  # (x order, z order, y order)
        g = np.array([T[1, 0, 0], T[0, 0, 1], T[0, 1, 0]]) / h
        H = np.array(
            [
                [T[2, 0, 0], T[1, 0, 1], T[1, 1, 0]],
                [T[1, 0, 1], T[0, 0, 2], T[0, 1, 1]],
                [T[1, 1, 0], T[0, 1, 1], T[0, 2, 0]],
            ]
        )
        return float(T[0, 0, 0]), g, H / h**2

    def __call__(self, x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray, bool]:
        """U, F (3,), ∂F/∂c (3, 3) and whether x (n,) is near a training input."""
        d, n, D = self.distance(x[:3])
        s = self.radius - d
        if s <= 0.0:
            return 0.0, np.zeros(3), np.zeros((3, 3)), True
        xi = (x - self.centre) / self.half
        v = self.A @ xi - self.b
        phi = self.scale * self.weights * np.exp(-(v * v).sum(axis=1))
        u = np.einsum("kri,kr->ki", self.A, v)
        g = (self.scale * self.tail[1:] - 2.0 * (phi @ u))[:3] / self.half[:3]
        H = (4.0 * (u.T * phi) @ u - 2.0 * np.tensordot(phi, self.gram, 1))[:3, :3]
        H = H / np.outer(self.half[:3], self.half[:3])
        ell = self.offset + self.scale * (self.tail[0] + self.tail[1:] @ xi) + phi.sum()
        twice, factor, a = self.law
        p, r = twice / 2, s / (a + s)
        U = factor * s**p / np.sqrt(1.0 + s / a) * np.exp(ell)
        first, second = U * (p - r / 2) / s, U * (p * (p - 1) - p * r + 0.75 * r * r) / s**2
        F = first * n - U * g
        cross = np.outer(n, g)
        K = first * (D + cross + cross.T) - second * np.outer(n, n) - U * (np.outer(g, g) + H)
        near = True
        if self.region is not None:
            gap = self.region.points - xi
            near = bool((gap * gap).sum(axis=1).min() <= self.region.radius**2)
        return U, F, K, near

    def trust(self, x: np.ndarray) -> float:
        """Standard deviation of the force relative to its size at x (n,)."""
        U, F, _, _ = self(x)
        xi = (x - self.centre) / self.half
        v = self.A @ xi - self.b
        phi = np.exp(-(v * v).sum(axis=1))
        u = np.einsum("kri,kr->ki", self.A, v)
        rows = np.zeros((4, 1 + len(x) + len(phi)))
        rows[0] = np.concatenate([[1.0], xi, phi])
        rows[1:, 1:4] = np.diag(1.0 / self.half[:3])
        rows[1:, 1 + len(x) :] = (-2.0 * phi[:, None] * u[:, :3] / self.half[:3]).T
        columns = rows @ self.root
        moved = np.outer(F, columns[0]) - U * columns[1:]
        return float(np.sqrt((moved * moved).sum()) / np.linalg.norm(F))


def _microseconds(
    function: Callable[..., object], points: Sequence[tuple[np.ndarray, ...]], rounds: int = 7
) -> float:
    """The best round's mean time of a call."""
    best = np.inf
    for _ in range(rounds):
        begin = time.perf_counter()
        for x in points:
            function(*x)
        best = min(best, (time.perf_counter() - begin) / len(points))
    return 1e6 * best


def example(units: int = 40, inputs: int = 3, rank: int | None = None, networks: int = 1) -> LearntEnergy:
    """A plane touched by a sphere of 10 mm, with random rotated units, 512 training inputs and a posterior.

    The units are of so many `networks`, of which the first has the posterior. Its `rank` is the number of weights by
    default; with a symmetry those of one orbit are one.
    """
    from palpate.network import Network, Scaling, TrainedRegion
    from palpate.surrogates import ContactBaseline, ContactLaw, TouchedSurface
    from palpate.units import Quantity, Range

    rng = np.random.default_rng(1)
    corners = 0.05 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    surface = TouchedSurface.of(corners, np.array([[0, 1, 2], [0, 2, 3]]), radius=0.01)
    places = [Range("c_x", -0.02, 0.02, "m"), Range("c_y", -0.02, 0.02, "m"), Range("c_z", -0.002, 0.01, "m")]
    ranges = [*places, *(Range(f"p{i}", -1.0, 1.0) for i in range(inputs - 3))]
    A = np.tril(rng.normal(0.0, 0.7, (units, inputs, inputs)))
    network = Network(
        inputs=tuple(ranges),
        outputs=(Quantity("ln of U over U0"),),
        factors=A,
        shifts=np.einsum("kij,kj->ki", A, rng.uniform(-1, 1, (units, inputs))),
        weights=rng.normal(0.0, 0.02, (1, units)),
        tail=np.zeros((1, 1 + inputs)),
        scaling=Scaling(
            np.array([(r.low + r.high) / 2 for r in ranges]),
            np.array([(r.high - r.low) / 2 for r in ranges]),
            np.array([10.0]),
            np.array([1.0]),
        ),
    )
    root = 0.01 * rng.normal(size=(1 + inputs + units, rank or 1 + inputs + units))
    root[1 + inputs + units // networks :] = 0.0
    return LearntEnergy(
        network,
        ContactBaseline(ContactLaw("series", 1e-3), surface, 0.01),
        region=TrainedRegion.of(rng.uniform(-1, 1, (512, inputs))),
        root=root,
    )


def main() -> None:
    """Print both, side by side."""
    names = ("units", "inputs", "answer µs", "plain", "ratio", "trust µs", "plain", "ratio")
    print("  ".join(f"{name:>9}" for name in names))
    for units, inputs in ((10, 3), (40, 3), (40, 6), (100, 3)):
        energy = example(units, inputs)
        low, high = bounds(energy.inputs)
        X = np.random.default_rng(2).uniform(low, high, (1000, inputs))
        X[:, 2] = np.linspace(0.009, -0.001, len(X))
        evaluator, plain = energy.evaluator(), PlainQuery(energy)
        halves, whole = [(x[:3].copy(), x[3:].copy()) for x in X], [(x,) for x in X]
        a, b = _microseconds(evaluator, halves), _microseconds(plain, whole)
        c, d = _microseconds(evaluator.trust, halves), _microseconds(plain.trust, whole)
        row = (units, inputs, f"{a:.1f}", f"{b:.0f}", f"{a / b:.2f}", f"{c:.1f}", f"{d:.0f}", f"{c / d:.2f}")
        print("  ".join(f"{value:>9}" for value in row))


if __name__ == "__main__":
    main()
