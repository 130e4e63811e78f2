"""A solid made by formula, for tests of the sweep. Workers import this module."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from palpate.dataset import Layout, solid_fields
from palpate.units import Range

RADIUS, HEIGHT, STIFFNESS, WAVE = 0.01, 0.05, 2e6, 40.0  # m, m, N/m², 1/m
_AXIS = np.linspace(0.0, 0.1, 4)
REST = np.stack([*np.meshgrid(_AXIS, _AXIS, [HEIGHT], indexing="ij")], axis=-1).reshape(-1, 3)
_CORNERS = [4 * i + j for i in range(3) for j in range(3)]
TRIANGLES = np.array([t for a in _CORNERS for t in ((a, a + 4, a + 5), (a, a + 5, a + 1))])


def touch(c):
    """Depth s of the sphere in the wavy ground H + a sin(w x), its gradient and its second derivative in x."""
    a = 0.002
    s = RADIUS + HEIGHT + a * np.sin(WAVE * c[0]) - c[2]
    return s, np.array([a * WAVE * np.cos(WAVE * c[0]), 0.0, -1.0]), -a * WAVE**2 * np.sin(WAVE * c[0])


def answer(c):
    """Energy U = k s³/3 for s > 0, force −∂U/∂c and its gradient, in closed form."""
    s, slope, bend = touch(c)
    s = max(s, 0.0)
    curved = np.zeros((3, 3))
    curved[0, 0] = bend
    gradient = -STIFFNESS * (2 * s * np.outer(slope, slope) + s * s * curved)
    return STIFFNESS * s**3 / 3, -STIFFNESS * s * s * slope, gradient, s


@dataclass(frozen=True)
class Ground:
    """A wavy ground under a sphere, whose solver has a memory: its energy tells how many solves came before.

    raises, kills_once, fails_below: rows' x at which the solver raises, or takes its process down the first time;
    height of the centre below which there is no answer. log: a folder that gets a file per opening.
    """

    log: str = ""
    raises: tuple[float, ...] = ()
    kills_once: float = np.inf
    fails_below: float = HEIGHT
    seconds: float = 0.0
    ranges: tuple[Range, ...] = (
        Range("c_x", 0.03, 0.07, "m"),
        Range("c_y", 0.03, 0.07, "m"),
        Range("c_z", 0.055, 0.062, "m"),
    )
    design_name = "columns"

    @property
    def layout(self):
        return Layout(REST, triangles=TRIANGLES, surfaces=("top",), surface_of=np.zeros(len(TRIANGLES)))

    @property
    def schema(self):
        return solid_fields(len(REST), self.ranges)

    def describe(self):
        return {"body": {"type": "Ground", "fails_below": self.fails_below, "raises": self.raises}}

    def design(self, samples, seed):
        columns = np.random.default_rng(seed).uniform(0.03, 0.07, (samples // 4, 2))
        depths = np.linspace(0.062, 0.055, 4)
        return np.array([(*xy, z) for xy in columns for z in depths])

    def chains(self, points):
        _, column = np.unique(points[:, :2], axis=0, return_inverse=True)
        return [
            rows[np.argsort(-points[rows, 2])]
            for rows in (np.flatnonzero(column == i) for i in range(column.max() + 1))
        ]

    def open(self):
        if self.log:
            (Path(self.log) / f"open-{os.getpid()}-{time.time_ns()}").touch()
        return GroundSolver(self)


class GroundSolver:
    def __init__(self, problem):
        self.problem = problem
        self.reset()

    def reset(self):
        self.solves = 0

    def solve(self, c):
        problem = self.problem
        time.sleep(problem.seconds)
        if c[0] in problem.raises:
            raise ZeroDivisionError(f"no answer at {c[0]:g}")
        if c[0] == problem.kills_once and (mark := Path(problem.log) / "killed") and not mark.exists():
            mark.touch()
            os._exit(1)
        self.solves += 1
        through = c[2] < problem.fails_below
        energy, force, gradient, s = answer(c)
        spread = np.exp(-((REST[:, :2] - c[:2]) ** 2).sum(axis=1) / RADIUS**2)
        return SimpleNamespace(
            converged=not through,
            message="the probe is through the surface" if through else "converged",
            iterations=3,
            residual=1e-9,
            displacement=np.stack([0 * spread, 0 * spread, -s * spread], axis=1),
            potential_energy=energy + 1e-13 * self.solves,
            strain_energy=energy,
            response=force,
            response_gradient=gradient,
            penetration=s,
            least_volume_ratio=1.0,
        )


def outside(x):
    """Another program's answers, as a function: a spring of 100 N/m, gone beyond 8 mm."""
    if x[0] > 0.008:
        return {"converged": False, "message": "the spring is torn"}
    u, k = x[0], 100.0
    return {
        "displacement": [[0.0, 0.0, u]],
        "potential_energy": k * u * u / 2,
        "strain_energy": k * u * u / 2,
        "response": [-k * u],
        "response_gradient": [[-k]],
        "penetration": 0.0,
        "least_volume_ratio": 1.0,
    }
