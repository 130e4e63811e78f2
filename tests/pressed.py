"""A flat body whose energy under a probe is known in closed form, with the surrogate that is exactly it.

U = A s³ exp(b x),   s = R − z,   F = −∇U = (−b U, 0, 3 U/s),   K = −∇∇U
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from models import linear_network
from palpate.dataset import Dataset, Layout, assemble, solid_fields
from palpate.network import TrainedRegion
from palpate.surrogates import (
    ContactBaseline,
    ContactLaw,
    Continuation,
    LearntEnergy,
    Surrogate,
    TouchedSurface,
)
from palpate.units import Quantity, Range
from palpate.validation import TouchSolves

RADIUS = 0.010
DEEPEST = 0.006
A, B = 1.0e4, 8.0  # J/m³, 1/m: 1 N at 6 mm, and 17 % more or less at the sides
INPUTS = (
    Range("c_x", -0.02, 0.02, "m"),
    Range("c_y", -0.02, 0.02, "m"),
    Range("c_z", RADIUS - DEEPEST, RADIUS, "m"),
)


CORNERS = (
    0.06 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]),
    np.array([[0, 1, 2], [0, 2, 3]]),
)


@functools.cache
def face() -> TouchedSurface:
    """The plane z = 0, far beyond where anything is tested."""
    return TouchedSurface.of(*CORNERS, radius=RADIUS, spacing=0.003)


def surrogate(
    *,
    factor: float = 1.0,
    root: np.ndarray | None = None,
    region: TrainedRegion | None = None,
    memory: Any = None,
    meta: Any = None,
) -> Surrogate:
    """The closed form as a learnt body, its energy times `factor`, with where it was trained, a memory and a record."""
    tail = np.array([[np.log(factor * A), B * 0.02, 0.0, 0.0]])
    network = linear_network(list(INPUTS), [Quantity("ln U/U0")], tail)
    baseline, going = (
        ContactBaseline(ContactLaw("pad"), face(), RADIUS),
        Continuation.of(INPUTS, deepest=DEEPEST),
    )
    energy = LearntEnergy(network, baseline, region=region, continuation=going, root=root)
    return Surrogate(energy, memory=memory, meta={"name": "slab"} | (meta or {}))


def steady(deviation: float) -> np.ndarray:
    """A posterior by which the force is off by a common factor 1 ± deviation."""
    root = np.zeros((6, 1))
    root[0] = deviation
    return root


def places(count: int = 200, seed: int = 5) -> np.ndarray:
    """Centres (N, 3) in contact."""
    low, high = np.array([-0.02, -0.02, RADIUS - DEEPEST]), np.array([0.02, 0.02, RADIUS - 1e-4])
    return np.random.default_rng(seed).uniform(low, high, (count, 3))


def energy(X: np.ndarray) -> np.ndarray:
    """U (N,), J."""
    return np.asarray(A * np.maximum(RADIUS - X[:, 2], 0.0) ** 3 * np.exp(B * X[:, 0]))


def force(X: np.ndarray) -> np.ndarray:
    """F (N, 3), N."""
    s = np.maximum(RADIUS - X[:, 2], 0.0)
    F = np.zeros((len(X), 3))
    F[:, 0], F[:, 2] = -B * energy(X), 3 * A * s**2 * np.exp(B * X[:, 0])
    return F


def stiffness(X: np.ndarray) -> np.ndarray:
    """∂F/∂c (N, 3, 3), N/m."""
    s, K = np.maximum(RADIUS - X[:, 2], 0.0), np.zeros((len(X), 3, 3))
    grown = A * np.exp(B * X[:, 0])
    K[:, 0, 0] = -(B**2) * grown * s**3
    K[:, 0, 2] = K[:, 2, 0] = 3 * B * grown * s**2
    K[:, 2, 2] = -6 * grown * s
    return K


def solves(X: np.ndarray | None = None) -> TouchSolves:
    """What finite elements without any error would say."""
    X = places() if X is None else X
    return TouchSolves(X, force(X), energy(X), stiffness(X))


def dataset(
    test: TouchSolves,
    *,
    radius: float = RADIUS,
    acting: Any = None,
    inputs: tuple[Range, ...] = INPUTS,
    torque: np.ndarray | None = None,
) -> Dataset:
    """The same solves as a sweep would store them, by default those of a ball; `acting` describes another tool."""
    rest = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, -1]])
    triangles = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    layout = Layout(rest, triangles=triangles, surfaces=("top", "side"), surface_of=[0, 1, 1, 1])
    count, schema = len(test), solid_fields(len(rest), inputs, torque=torque is not None)
    answers = {field.name: np.zeros((count, *field.shape)) for field in schema}
    answers |= {
        "response": test.force,
        "potential_energy": test.energy,
        "response_gradient": test.stiffness,
    }
    answers |= {} if torque is None else {"torque": torque}
    said = {"converged": True, "iterations": 3, "residual": 0.0, "message": "", "solve_seconds": 1.0}
    answers |= {name: np.full(count, value) for name, value in said.items()}
    origin = {"problem": {"interactions": [acting or {"type": "SphereProbe", "radius": radius}]}}
    return assemble(inputs, layout, test.X, answers, origin, schema=schema)
