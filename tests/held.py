"""Held bodies with energies in closed form: a point on springs that are slack where it is glued, and a pad."""

from __future__ import annotations

import numpy as np

from models import linear_network
from palpate.surrogates import LearntEnergy, PadBaseline, RestStiffness, Stiffening, Surrogate
from palpate.surrogates.memories import IwanElements
from palpate.units import Quantity, Range

INPUTS = (
    *(Range(f"d_{axis}", -0.01, 0.01, "m") for axis in "xyz"),
    *(Range(f"p_{axis}", -0.02, 0.02, "m") for axis in "xy"),
)
SQUARE = tuple(
    np.array(m, dtype=float)
    for s in (1, -1)
    for t in (1, -1)
    for m in ([[s, 0, 0], [0, t, 0], [0, 0, 1]], [[0, s, 0], [t, 0, 0], [0, 0, 1]])
)
"""The eight isometries of a square about z."""

ANCHORS = np.array(
    [[0.1, 0.1, -0.1], [-0.1, 0.1, -0.1], [0.1, -0.1, -0.1], [-0.1, -0.1, -0.1], [0.0, 0.0, -0.1]]
)
SPRINGS = np.array([80.0, 80.0, 80.0, 80.0, 40.0])  # N/m


def held(X: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """U (N,), −∂U/∂x (N, 5) and its derivative (N, 5, 5) at x = (d, p): U = Σ ½ k (|p + d − b| − |p − b|)²."""
    d, p = X[:, None, :3], np.zeros((len(X), 1, 3))
    p[:, 0, :2] = X[:, 3:]
    (r, n, P), (r0, n0, P0) = _from(p + d - ANCHORS), _from(p - ANCHORS)
    e = r - r0
    slope = np.concatenate([n, (n - n0)[..., :2]], axis=2)
    bend = np.zeros((*e.shape, 5, 5))
    bend[..., :3, :3] = P
    bend[..., :3, 3:], bend[..., 3:, :3] = P[..., :2], P[..., :2, :]
    bend[..., 3:, 3:] = (P - P0)[..., :2, :2]
    force = -np.einsum("k,nk,nki->ni", SPRINGS, e, slope)
    gradient = np.einsum("k,nki,nkj->nij", SPRINGS, slope, slope) + np.einsum(
        "k,nk,nkij->nij", SPRINGS, e, bend
    )
    return (SPRINGS * e**2).sum(axis=1) / 2, force, -gradient


def _from(a: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lengths of vectors (N, k, 3), their directions and the derivatives of those."""
    r = np.linalg.norm(a, axis=2)
    n = a / r[..., None]
    return r, n, (np.eye(3) - n[..., :, None] * n[..., None, :]) / r[..., None, None]


def drawn(count: int, seed: int = 0) -> np.ndarray:
    """Inputs (count, 5) at random."""
    low, high = np.array([[r.low for r in INPUTS], [r.high for r in INPUTS]])
    return np.random.default_rng(seed).uniform(low, high, (count, 5))


PAD_SPRING = np.diag([80.0, 90.0, 110.0])  # N/m


def pad() -> Surrogate:
    """U = ½ d·K d exp(−10 p_x): softer the farther the pad is along x."""
    network = linear_network(list(INPUTS), [Quantity("ln U/U0")], np.array([[0.0, 0.0, 0.0, 0.0, -0.2, 0.0]]))
    baseline = PadBaseline(RestStiffness.even(PAD_SPRING, 2), Stiffening.none(5))
    return Surrogate(LearntEnergy(network, baseline), meta={"name": "pad"})


def pad_force(d: np.ndarray, p_x: float = 0.0) -> np.ndarray:
    """F of the pad displaced by d (3,), m, N."""
    return -np.exp(-10.0 * p_x) * PAD_SPRING @ d


ROD_SPRING = 100.0  # N/m
SLIP = 0.2  # √J, at which half of the rod's stiffness begins to slip


def yielding_rod() -> Surrogate:
    """A node that moves up and down on a spring, U = ½ K w²; half of the spring slips without hardening."""
    inputs = [Range("w", -0.05, 0.05, "m")]
    network = linear_network(inputs, [Quantity("ln U/U0")], np.zeros((1, 2)))
    rest = RestStiffness.even(np.array([[ROD_SPRING]]), 0)
    baseline = PadBaseline(rest, Stiffening.none(1), np.array([[0.0, -1.0, 0.0]]))
    memory = IwanElements.sliders(np.array([0.5, 0.5]), np.array([np.inf, SLIP]), np.zeros(2))
    return Surrogate(LearntEnergy(network, baseline), memory=memory, meta={"name": "yielding rod"})
