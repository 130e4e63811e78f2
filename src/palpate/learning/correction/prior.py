"""The prior of a specimen: its differences from the model before it has been touched.

Its energy is U₀(s + o) exp(ℓ + δ): δ(x) a change of ln κ, o a height of its surface over the model's (m). A priori

    δ(x) = σ_c a + v(x)       a ~ N(0, 1), v a Gaussian process,   E v(x)v(x') = σ_v² exp(−‖ξ − ξ'‖²/2L²)
    o ~ N(0, σ_o²)

with ξ the scaled inputs: a constant factor, and one that varies slowly with place and depth (a random field for
what a model misses: Kennedy & O'Hagan 2001, section 4). v is written in the tail and units of the network, to which
broad units of weight zero are added, by least squares at the places of the training: a network of few units follows
its own body and no other. The model's own posterior is kept beside it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from palpate.errors import UsageError
from palpate.network import Network
from palpate.network.radial import radial
from palpate.options import Discrepancy
from palpate.surrogates import LearntEnergy

__all__ = ["SpecimenPrior", "add_broad_units", "regressors", "specimen_prior"]

_KEPT = 1e-5  # of the largest variance: directions of the slow change below it are left out
_MOST = 80  # such directions
_POINTS = 256  # places at least where the slow change is matched
_RIDGE = 1e-6  # of a regressor's mean square


@dataclass(frozen=True, eq=False)
class SpecimenPrior:
    """The changes that a specimen may show, as independent standard normal numbers."""

    # (1 + n + h, z) change of the network's tail and weights, in its scaled output, by each of z numbers
    root: np.ndarray
    offset: float  # change of the surface's height by a last number, m
    expressed: float  # share of the slow change's variance that tail and units can follow


def add_broad_units(energy: LearntEnergy, discrepancy: Discrepancy) -> LearntEnergy:
    """Return the same energy with broad units of weight zero, far from each other among the training inputs."""
    net, points = energy.network, _points(energy)
    k, n = min(discrepancy.units, len(points)), len(net.inputs)
    if not (k and discrepancy.varying):
        return energy
    own = np.zeros((net.units, n, n))
    own[:, : net.factors.shape[1]] = net.factors
    shifts = np.zeros((net.units, n))
    shifts[:, : net.factors.shape[1]] = net.shifts
    wide = 1.0 / (math.sqrt(2.0) * discrepancy.length)
    more = replace(
        net,
        factors=np.concatenate([own, np.broadcast_to(wide * np.eye(n), (k, n, n))]),
        shifts=np.concatenate([shifts, wide * points[:k]]),
        weights=np.hstack([net.weights, np.zeros((1, k))]),
    )
    root = energy.root
    if root is not None:
        root = np.vstack([root, np.zeros((k, root.shape[1]))])
    return replace(energy, network=more, root=root)


def specimen_prior(energy: LearntEnergy, discrepancy: Discrepancy) -> SpecimenPrior:
    """Return the posterior of the training with the discrepancy added: the prior of a specimen."""
    net = energy.network
    scale, rows = float(net.scaling.output_scale[0]), 1 + len(net.inputs) + net.units
    parts = [np.zeros((rows, 0)) if energy.root is None else energy.root]
    if discrepancy.constant:
        parts.append(np.eye(rows, 1) * discrepancy.constant / scale)
    expressed = 1.0
    if discrepancy.varying:
        root, expressed = _slow(energy, discrepancy)
        parts.append(root / scale)
    root = np.hstack(parts)
    if not root.any() and not discrepancy.offset:
        raise UsageError(
            "A surrogate without posterior and a discrepancy of zero leave nothing to correct.",
            fix="Give one of the discrepancy's deviations a positive size.",
        )
    return SpecimenPrior(root, discrepancy.offset, expressed)


def regressors(net: Network, scaled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """r = [1, ξ, φ] (N, c) and its slopes by ξ (N, n, c) at scaled inputs (N, n)."""
    N, n = scaled.shape
    A = net.factors
    v = np.einsum("kri,ni->nkr", A, scaled) - net.shifts
    g, first, _ = radial(net.radial, (v * v).sum(axis=2))
    by = 2.0 * first[:, None] * np.einsum("kri,nkr->nik", A, v)
    tail = np.broadcast_to(np.eye(n, 1 + n, 1), (N, n, 1 + n))
    return np.hstack([np.ones((N, 1)), scaled, g]), np.concatenate([tail, by], axis=2)


def _slow(energy: LearntEnergy, discrepancy: Discrepancy) -> tuple[np.ndarray, float]:
    """Root (c, r) of the slowly varying change in units of ℓ, and the share of it that the network can express."""
    points = _points(energy)
    square = ((points[:, None] - points) ** 2).sum(axis=2)
    values, V = np.linalg.eigh(discrepancy.varying**2 * np.exp(-square / (2.0 * discrepancy.length**2)))
    keep = np.flatnonzero(values > _KEPT * values[-1])[-_MOST:]
    wanted = V[:, keep] * np.sqrt(values[keep])
    R, _ = regressors(energy.network, points)
    gram = R.T @ R
    root = np.linalg.solve(gram + _RIDGE * np.trace(gram) / len(gram) * np.eye(len(gram)), R.T @ wanted)
    missed = wanted - R @ root
    return root, float(1.0 - (missed**2).sum() / (wanted**2).sum())


def _points(energy: LearntEnergy) -> np.ndarray:
    """Scaled inputs (k, n) of the training, the first far from each other, and random ones where few are known."""
    n, region = len(energy.inputs), energy.region
    trained = np.zeros((0, n)) if region is None else region.points
    more = np.random.default_rng(0).uniform(-1.0, 1.0, (max(_POINTS - len(trained), 0), n))
    return np.concatenate([trained, more])
