"""A ball that is led through a simulator: forces at rest for `force`, forces of each step for `step`."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, Protocol

import numpy as np

__all__ = ["NEAR", "Simulator", "SteppedBall", "free_triangles", "outward", "with_mesh"]

NEAR = 0.3  # of the ball's radius: to a place so near the ball goes on, to others it comes from outside
WAY_STEPS = 8  # most steps of a way, in which the ball moves evenly
WAY_STEP = 5e-4  # m, that the ball moves in one of them on a shorter way
STEADY = 1e-3  # relative change of the force over the last steps below which the ball is at rest
LOOK = 6  # steps over which this change is taken
REST_STEPS = 120  # steps after which a force that still changes counts as it is


class Simulator(Protocol):
    """A simulator of one soft body and one ball whose place is prescribed."""

    seconds: float

    def reset(self) -> None:
        """Put the body at rest."""

    def advance(self, place: np.ndarray) -> np.ndarray:
        """Put the ball (3,) m somewhere, make one step, and return the force (3,) on the ball, N."""


class SteppedBall:
    """The method that a simulator is; `case` says from where the ball comes, `settings` are for the table."""

    solves = 0

    def __init__(self, simulator: Simulator, case: Any, settings: str) -> None:
        self.simulator, self.settings, self._radius = simulator, settings, case.radius
        self._outward = outward(case.mesh)
        self._place: np.ndarray | None = None
        self._times: list[float] = []

    @property
    def seconds_step(self) -> float | None:
        """Time of the processor for a step, s, the median; other work on the machine lengthens it little."""
        return float(np.median(self._times)) if self._times else None

    def force(self, places: np.ndarray) -> np.ndarray:
        """Return the forces (n, 3) at which the body comes to rest, nan where the simulator fails."""
        self._place = None
        return np.array([self._at_rest(place) for place in places])

    def _at_rest(self, place: np.ndarray) -> np.ndarray:
        if self._place is None or np.linalg.norm(place - self._place) > NEAR * self._radius:
            self.simulator.reset()
            self._place = place + self._radius * self._outward(place)
        way = place - self._place
        steps = min(WAY_STEPS, int(np.ceil(np.linalg.norm(way) / WAY_STEP)))
        for share in np.linspace(0.0, 1.0, steps + 1)[1:]:
            self._advance(self._place + share * way)
        forces: list[np.ndarray] = []
        while len(forces) < REST_STEPS:
            forces.append(self._advance(place))
            last = np.array(forces[-LOOK:])
            if not np.isfinite(last).all():
                self._place = None
                return np.full(3, np.nan)
            spread = float(np.linalg.norm(np.ptp(last, axis=0)))
            if len(last) == LOOK and spread <= STEADY * float(np.linalg.norm(last[-1])):
                break
        self._place = place
        return np.asarray(np.mean(forces[-LOOK:], axis=0))

    def _advance(self, place: np.ndarray) -> np.ndarray:
        begin = time.process_time()
        force = self.simulator.advance(place)
        self._times.append(time.process_time() - begin)
        return force

    def start(self, place: np.ndarray) -> None:
        """Put the body at rest, and the ball at a place outside."""
        self.simulator.reset()
        self._left, self._last = 0.0, self._advance(place)
        self._place = None

    def step(self, place: np.ndarray, seconds: float) -> np.ndarray:
        """Return the force (3,) after some time; a simulator with longer steps holds the last one in between."""
        self._left += seconds
        while self._left >= self.simulator.seconds * (1.0 - 1e-9):
            self._last = self._advance(place)
            self._left -= self.simulator.seconds
        return self._last


def with_mesh(case: Any, surface: float | None) -> Any:
    """Return a case's body with elements of so many metres on its touched surface; None keeps those of its mesh."""
    if surface is None:
        return case
    from ..bodies import held_points, mesh_of  # palpate's mesher: a finer mesh of the same shape is allowed

    mesh = mesh_of(case.name, surface)
    arrays = {
        "points": mesh.points,
        "tetrahedra": mesh.tetrahedra,
        "label": mesh.region_of,
        "fixed": held_points(case.name, mesh),
    }
    return SimpleNamespace(name=case.name, radius=case.radius, materials=case.materials, mesh=arrays)


def free_triangles(mesh: dict[str, np.ndarray]) -> np.ndarray:
    """Return the triangles (n, 3) of the mesh's surface, wound outwards, less those that are held at all corners."""
    corners = mesh["tetrahedra"]
    faces = np.concatenate([corners[:, order] for order in ([1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1])])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    faces = faces[first[count == 1]]
    return np.asarray(faces[~mesh["fixed"][faces].all(axis=1)])


def outward(mesh: dict[str, np.ndarray]) -> Callable[[np.ndarray], np.ndarray]:
    """Return a function of a place (3,): the outward normal (3,) of the surface's nearest free triangle."""
    a, b, c = mesh["points"][free_triangles(mesh)].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    middles = (a + b + c) / 3.0

    def normal(place: np.ndarray) -> np.ndarray:
        return np.asarray(normals[np.argmin(np.linalg.norm(middles - place, axis=1))])

    return normal
