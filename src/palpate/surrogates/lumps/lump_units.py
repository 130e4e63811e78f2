"""Lumps as further units of a body's network: the body with them is a learnt body like any other.

With ΔU/U of the lumps known in closed form, U (1 + Σ ΔU/U) = U₀ exp(ℓ + f), f = ln(1 + Σ ΔU/U). Over the places of a
hand f is smooth, and nothing but near the lumps. So f and its slopes are taken at trained places, and units of one
width about some of them, of the network's own radial function, are fitted to both by least squares. They join those of
ℓ: loop, page and every export evaluate the body with lumps by what they have, in the time of some more units.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from palpate.errors import UsageError
from palpate.network.radial import RadialFunction, radial
from palpate.surrogates.energy import LearntEnergy
from palpate.surrogates.lumps.lump import Lump
from palpate.surrogates.lumps.lump_contrast import LumpContrast
from palpate.units import bounds

__all__ = ["energy_with_lumps"]

PLACES = 2400  # of the hand about the lumps, at which f is taken
UNITS, MOST_UNITS = 240, 600  # for each lump, and for all
WIDTHS = (
    0.008,
    0.012,
    0.018,
    0.03,
    0.05,
)  # m, of which the best is taken: a press is felt over about a contact's width
REACH = 0.003  # m over which a slope of f is felt beside f: U/F of a press of some mm
RIDGE = 1e-10  # on squared weights, over the mean square of a unit
RATIO = 0.02  # share of the largest f below which a place is not about a lump


def energy_with_lumps(energy: LearntEnergy, contrast: LumpContrast, lumps: Sequence[Lump]) -> LearntEnergy:
    """Return the energy of the body with lumps; without any, and at ratio 1, the energy as it is.

    A lump that leaves its room or the skin, lumps that meet, and a body with inputs beside the place of a probe are
    UsageErrors.
    """
    if len(energy.inputs) != 3 or energy.baseline.holds:
        raise UsageError(
            "Lumps are of bodies that a probe presses, without further inputs.",
            why=f"The inputs of this one are {', '.join(r.name for r in energy.inputs)}.",
            fix="Learn the body with fixed numbers.",
        )
    contrast.require(lumps)
    felt = [lump for lump in lumps if lump.ratio != 1.0]
    if not felt:
        return energy
    X = _places(energy)
    f, slopes = _log_factor(contrast, felt, X)
    about = np.abs(f) > RATIO * np.abs(f).max()
    return _with_units(energy, X, f, slopes, X[about], min(UNITS * len(felt), MOST_UNITS))


def _places(energy: LearntEnergy) -> np.ndarray:
    """Return places (N, 3) of the hand in the trained region, where it touches."""
    low, high = bounds(energy.inputs)
    drawn, rng = np.zeros((0, 3)), np.random.default_rng(0)
    for _ in range(8):
        X = rng.uniform(low, high, (PLACES, 3))
        depth = energy.depth(X)
        kept = X[energy.inside(X) & (depth > 0.02 * depth.max())]
        drawn = np.vstack([drawn, kept])
        if len(drawn) >= PLACES:
            break
    return drawn[:PLACES]


def _log_factor(
    contrast: LumpContrast, lumps: Sequence[Lump], X: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return f = ln(1 + Σ ΔU/U) (N,) and its slopes (N, 3) in 1/m at places X (N, 3)."""
    parts = [contrast.added(lump, X) for lump in lumps]
    total, slopes = sum(value for value, _ in parts), sum(slope for _, slope in parts)
    return np.log1p(total), np.asarray(slopes / (1.0 + np.asarray(total))[:, None])


def _with_units(
    energy: LearntEnergy, X: np.ndarray, f: np.ndarray, slopes: np.ndarray, about: np.ndarray, units: int
) -> LearntEnergy:
    """Return the energy whose ℓ has Gaussians more, which are f (N,) and its slopes (N, 3) at X (N, 3)."""
    centres = _spread(about, min(units, len(about)))
    fits = [_fit(X, f, slopes, centres, width, energy.network.radial) for width in WIDTHS]
    weights, _, width = min(fits, key=lambda fit: fit[1])
    network, half = energy.network, energy.network.scaling.input_half
    rank = network.factors.shape[1]
    factor = np.zeros((rank, 3))
    factor[:3] = np.diag(half / width)
    shifts = np.zeros((len(centres), rank))
    shifts[:, :3] = (centres - network.scaling.input_centre) / width
    more = replace(
        network,
        factors=np.concatenate([network.factors, np.broadcast_to(factor, (len(centres), rank, 3))]),
        shifts=np.concatenate([network.shifts, shifts]),
        weights=np.hstack([network.weights, weights[None] / network.scaling.output_scale[0]]),
    )
    root = energy.root
    if root is not None:  # what is known of ℓ's weights stays; those of the lumps are given
        root = np.vstack([root, np.zeros((len(centres), root.shape[1]))])
    return replace(energy, network=more, root=root)


def _fit(
    X: np.ndarray, f: np.ndarray, slopes: np.ndarray, centres: np.ndarray, width: float, form: RadialFunction
) -> tuple[np.ndarray, float, float]:
    """Return weights of units about centres, the mean square of what they miss, and their width in m."""
    far = (X[:, None] - centres[None]) / width
    phi, slope, _ = radial(form, (far**2).sum(axis=2))
    rows = np.concatenate([phi, *(2.0 * far[:, :, i] * slope for i in range(3))])
    target = np.concatenate([f, *(width * slopes.T)])
    normal = rows.T @ rows
    normal[np.diag_indices_from(normal)] += RIDGE * np.trace(normal) / len(normal)
    weights = np.linalg.solve(normal, rows.T @ target)
    missed = rows @ weights - target
    missed[len(f) :] *= REACH / width
    return weights, float(np.mean(missed**2)), width


def _spread(points: np.ndarray, count: int) -> np.ndarray:
    """Return so many of the points (N, 3), each the farthest from those before it (Gonzalez 1985)."""
    chosen = [int(np.argmin(((points - points.mean(axis=0)) ** 2).sum(axis=1)))]
    nearest = ((points - points[chosen[0]]) ** 2).sum(axis=1)
    while len(chosen) < count:
        chosen.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, ((points - points[chosen[-1]]) ** 2).sum(axis=1))
    return points[chosen]
