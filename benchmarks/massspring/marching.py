"""Steps in time, as real-time simulators take them, and what a step costs."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.massspring.state import Tangent
from palpate.errors import UsageError

if TYPE_CHECKING:
    from benchmarks.massspring.solver import MassSpringSolver

__all__ = ["MassSpringMotion", "StepCosts"]

POWER = 60  # iterations for the highest frequency; it is then known to a few per cent, from below


@dataclass(frozen=True)
class StepCosts:
    """What a step in time costs, and how long it may be.

    Attributes
    ----------
    explicit_seconds, implicit_seconds : float
        Median computing time of one step, s.
    explicit_longest : float
        Longest stable explicit step 2/ω, with the network's highest frequency ω, s.
    implicit_step : float
        The implicit step that was timed, s.
    """

    explicit_seconds: float
    implicit_seconds: float
    explicit_longest: float
    implicit_step: float

    @property
    def explicit_ratio(self) -> float:
        """Computing time over simulated time, explicitly; below 1 it keeps up with real time."""
        return self.explicit_seconds / self.explicit_longest

    @property
    def implicit_ratio(self) -> float:
        """Computing time over simulated time, implicitly."""
        return self.implicit_seconds / self.implicit_step


class MassSpringMotion:
    """The network with its masses, moving.

    Parameters
    ----------
    solver : MassSpringSolver
        Gives network, pad and the state to start from.
    damping : float
        Force per momentum, 1/s.

    Raises
    ------
    UsageError
        If a material's density is zero.

    Attributes
    ----------
    x, v : (node, 3) array
        Positions in m and velocities in m/s.
    """

    def __init__(self, solver: MassSpringSolver, damping: float = 0.0) -> None:
        self.energy, self.damping = solver.energy, damping
        masses = solver.body.masses()
        if not np.all(masses[solver.energy.free] > 0):
            raise UsageError(
                "Points without mass can't be marched through time.",
                why="The material's density is zero.",
                fix="Give it one: NeoHookean(young=9e3, poisson=0.45, density=1000.0).",
            )
        self.masses = np.where(masses > 0, masses, 1.0)  # points of no tetrahedron don't move
        self.x, self.v = solver.x.copy(), np.zeros_like(solver.x)

    def explicit(self, centre: Any, dt: float) -> None:
        """One step of the symplectic Euler rule; stable below 2/ω."""
        g = self.energy.gradient(self.x, np.asarray(centre, dtype=float))
        self.v = (self.v - dt * g / self.masses[:, None]) * np.exp(-self.damping * dt)
        self.v[~self.energy.free] = 0.0
        self.x = self.x + dt * self.v

    def implicit(self, centre: Any, dt: float, tolerance: float = 1e-3) -> None:
        """One step of the backward Euler rule with one linear solve (Baraff & Witkin 1998, equation 6)."""
        c = np.asarray(centre, dtype=float)
        inertia = self.masses * (1 / dt**2 + self.damping / dt)
        tangent = Tangent(self.energy, self.x, self.energy.pad.blocks(self.x, c), inertia)
        b = (self.masses / dt)[:, None] * self.v - self.energy.gradient(self.x, c)
        b[~self.energy.free] = 0.0
        d, _ = tangent.solve(b, tolerance)
        self.x, self.v = self.x + d, d / dt

    def highest_frequency(self, centre: Any) -> float:
        """Highest angular frequency ω of the present state in rad/s, by power iteration; 60 of them."""
        c = np.asarray(centre, dtype=float)
        tangent = self.energy.tangent(self.x, c)
        root = np.sqrt(self.masses)[:, None]
        d = np.random.default_rng(0).standard_normal(self.x.shape)
        d[~self.energy.free] = 0.0
        size = 1.0
        for _ in range(POWER):
            d /= np.linalg.norm(d)
            d = tangent.apply(d / root) / root
            size = float(np.linalg.norm(d))
        return float(np.sqrt(size))

    def costs(self, centre: Any, dt: float = 1e-3, repeats: int = 20) -> StepCosts:
        """Time both kinds of step from the present state, which is kept; the implicit one is `dt` long."""
        longest = 2 / self.highest_frequency(centre)
        seconds: dict[str, float] = {}
        for name, step, length in (
            ("explicit", self.explicit, 0.5 * longest),
            ("implicit", self.implicit, dt),
        ):
            kept, spent = (self.x, self.v), []
            for _ in range(repeats):
                started = time.perf_counter()
                step(centre, length)
                spent.append(time.perf_counter() - started)
                self.x, self.v = kept
            seconds[name] = float(np.median(spent))
        return StepCosts(seconds["explicit"], seconds["implicit"], longest, dt)
