"""A problem whose answers are a formula: a slab under a probe, harder towards one side, as a sweep asks for it."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from models import linear_network
from palpate.dataset import Dataset, Layout, solid_fields
from palpate.surrogates import (
    ContactBaseline,
    ContactLaw,
    Continuation,
    LearntEnergy,
    Surrogate,
    TouchedSurface,
)
from palpate.sweeps import Space, sobol
from palpate.units import Quantity, Range, bounds

RADIUS, DEEPEST, SIDE = 0.010, 0.006, 0.02
HEIGHT = 1.0e4  # J/m³


def _depth(X: np.ndarray) -> np.ndarray:
    """Depth (N,), m, of a probe whose radius is the fourth input, where there is one."""
    return np.asarray((X[:, 3] if X.shape[1] == 4 else RADIUS) - X[:, 2])


def truth(X: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """U (N,), F (N, 3) and ∂F/∂c (N, 3, 3) of U = A s³ exp(b + 0.3 x), b a bump beside the middle of the slab."""
    x, y, s = X[:, 0] / SIDE - 0.4, X[:, 1] / SIDE, _depth(X)
    b = 0.8 * np.exp(-3.0 * (x**2 + y**2))
    U = HEIGHT * s**3 * np.exp(b + 0.3 * (x + 0.4))
    g = np.stack([(0.3 - 6.0 * x * b) / SIDE, -6.0 * y * b / SIDE, -3.0 / s], axis=1)
    H = np.zeros((len(X), 3, 3))
    H[:, 0, 0], H[:, 1, 1] = b * (36.0 * x**2 - 6.0) / SIDE**2, b * (36.0 * y**2 - 6.0) / SIDE**2
    H[:, 0, 1] = H[:, 1, 0] = 36.0 * x * y * b / SIDE**2
    H[:, 2, 2] = -3.0 / s**2
    return U, -U[:, None] * g, -U[:, None, None] * (g[:, :, None] * g[:, None] + H)


@dataclass(frozen=True)
class PressedSlab:
    """The slab and its probe; `failing` solves nothing beyond x = failing."""

    failing: float = np.inf

    @property
    def ranges(self) -> tuple[Range, ...]:
        return (
            Range("c_x", -SIDE, SIDE, "m"),
            Range("c_y", -SIDE, SIDE, "m"),
            Range("c_z", RADIUS - DEEPEST, RADIUS, "m"),
        )

    @property
    def layout(self) -> Layout:
        corners = 0.06 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
        return Layout(
            corners,
            triangles=np.array([[0, 1, 2], [0, 2, 3]]),
            surfaces=("top",),
            surface_of=np.zeros(2, dtype=int),
        )

    @property
    def schema(self) -> Any:
        return solid_fields(4, self.ranges)

    def describe(self) -> dict[str, Any]:
        probe = {"type": "SphereProbe", "radius": RADIUS, "touches": "top", "depth": [0.0, DEEPEST]}
        return {"body": {"material": {}}, "interactions": [probe], "failing": str(self.failing)}

    def open(self) -> _Solver:
        return _Solver(self)

    def design(self, samples: int, seed: int = 0, *, depths: int = 1) -> np.ndarray:
        number = -(-samples // depths)
        points = sobol(Space(self.ranges), number, seed)
        shift = (RADIUS - points[:, 2]) / DEEPEST
        depth = DEEPEST * (np.arange(depths) + np.clip(shift, 0.02, 1.0)[:, None]) / depths
        series = np.repeat(points[:, None], depths, axis=1)
        series[:, :, 2] = RADIUS - depth
        return series.reshape(-1, 3)[:samples]


@dataclass(frozen=True)
class PressedByAnySize(PressedSlab):
    """The slab under probes of several radii: how the energy varies with the radius is not stated."""

    radii: tuple[float, float] = (0.008, 0.012)

    @property
    def ranges(self) -> tuple[Range, ...]:
        x, y, _ = super().ranges
        low, high = self.radii
        return (x, y, Range("c_z", low - DEEPEST, high, "m"), Range("probe.radius", low, high, "m"))

    def describe(self) -> dict[str, Any]:
        return super().describe() | {"varied": [{"path": "probe.radius", "range": list(self.radii)}]}

    def design(self, samples: int, seed: int = 0, *, depths: int = 1) -> np.ndarray:
        points = PressedSlab().design(samples, seed, depths=depths)
        low, high = self.radii
        share = np.random.default_rng(seed).random(-(-samples // depths))  # the same of a longer design
        radii = np.repeat(low + (high - low) * share, depths)[:samples]
        points[:, 2] += radii - RADIUS
        return np.column_stack([points, radii])


def learn_affine(data: Dataset, effort: float, problem: PressedSlab | None = None) -> tuple[Surrogate, Any]:
    """A learner that takes no time: ln(U/s³) as an affine function of the inputs, by least squares.

    Its record has the error of each solve as those of a search have it, here of solves that were not left out.
    """
    problem = problem or PressedSlab()
    low, high = bounds(problem.ranges)
    scaled = (2.0 * data.X - low - high) / (high - low)
    target = np.log(data.potential_energy / _depth(data.X) ** 3)
    tail = np.linalg.lstsq(np.column_stack([np.ones(len(data)), scaled]), target)[0]
    layout = problem.layout
    surface = TouchedSurface.of(layout.rest, layout.triangles, radius=high[2], spacing=0.003)
    baseline = ContactBaseline(ContactLaw("pad"), surface, RADIUS, 3 if len(low) == 4 else None)
    network = linear_network(list(problem.ranges), [Quantity("ln U/U0")], tail[None])
    going = Continuation.of(problem.ranges, deepest=DEEPEST)
    energy = LearntEnergy(network, baseline, continuation=going)
    force = data.response[:, :3]
    missed = np.linalg.norm(energy.force(data.X) - force, axis=1) / np.linalg.norm(force, axis=1)
    return Surrogate(energy, meta={"name": "slab"}), SimpleNamespace(energy=SimpleNamespace(errors=missed))


@dataclass(frozen=True)
class _Solver:
    problem: PressedSlab

    def solve(self, x: np.ndarray) -> Any:
        U, F, K = truth(x[None])
        n = len(x)
        response, gradient = np.full(n, np.nan), np.full((n, n), np.nan)
        response[:3], gradient[:3, :3] = F[0], K[0]
        converged = bool(x[0] <= self.problem.failing)
        return SimpleNamespace(
            converged=converged,
            message="converged" if converged else "beyond",
            iterations=1,
            residual=0.0,
            displacement=np.zeros((4, 3)),
            potential_energy=float(U[0]),
            strain_energy=float(U[0]),
            response=response,
            response_gradient=gradient,
            penetration=0.0,
            least_volume_ratio=1.0,
        )
