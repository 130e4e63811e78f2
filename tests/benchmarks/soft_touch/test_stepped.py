"""A simulator is led to rest for its forces, and by its own steps through strokes."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from benchmarks.soft_touch.methods.stepped import SteppedBall, free_triangles, outward

MESH = {
    "points": np.array([[0.0, 0, -1], [1, 0, -1], [0, 1, -1], [0, 0, 0]]),
    "tetrahedra": np.array([[0, 1, 2, 3]]),
    "label": np.array([0]),
    "fixed": np.array([True, True, True, False]),
}


class Relaxing:
    """A spring along z whose force goes a share of the way to its rest in each step."""

    seconds = 5e-3

    def __init__(self, share=0.4):
        self.share, self.steps = share, 0
        self.reset()

    def reset(self):
        self.now = np.zeros(3)

    def advance(self, place):
        self.steps += 1
        self.now = self.now + self.share * (np.array([0, 0, 100.0 * max(0.01 - place[2], 0.0)]) - self.now)
        return self.now


def ball(simulator):
    return SteppedBall(simulator, SimpleNamespace(mesh=MESH, radius=0.01), "spring")


def test_forces_are_those_at_rest():
    places = np.array([[0.0, 0, 0.008], [0, 0, 0.007], [0.5, 0, 0.006]])
    method = ball(Relaxing())
    assert method.force(places)[:, 2] == pytest.approx([0.2, 0.3, 0.4], rel=1e-2)
    assert method.seconds_step >= 0.0


def test_a_simulator_that_fails_has_no_answer():
    class Failing(Relaxing):
        def advance(self, place):
            return super().advance(place) if place[2] > 0.007 else np.full(3, np.nan)

    forces = ball(Failing()).force(np.array([[0.0, 0, 0.008], [0, 0, 0.006], [0, 0, 0.008]]))
    assert np.isnan(forces).all(axis=1).tolist() == [False, True, False]
    assert forces[2, 2] == pytest.approx(0.2, rel=1e-2)


def test_longer_steps_hold_the_force_in_between():
    simulator = Relaxing(share=1.0)
    method = ball(simulator)
    method.start(np.array([0.0, 0, 0.02]))
    forces = [method.step(np.array([0.0, 0, 0.01 - 1e-3 * k]), 1e-3)[2] for k in range(1, 11)]
    assert simulator.steps == 3
    assert forces == pytest.approx([0.0] * 4 + [0.5] * 5 + [1.0])


def test_free_triangles_point_outwards():
    triangles = free_triangles(MESH)
    assert len(triangles) == 3  # the held one is left out
    a, b, c = MESH["points"][triangles].transpose(1, 0, 2)
    middle = MESH["points"].mean(axis=0)
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a - middle) > 0.0).all()
    assert outward(MESH)(np.array([1.0, 1.0, 0.0])) == pytest.approx(np.array([1.0, 1.0, 1.0]) / 3**0.5)
