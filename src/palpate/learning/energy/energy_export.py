"""The parts of an energy from what a search has found: network, root of its posterior, trained region, record."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from palpate.learning.energy.energy_samples import EnergySamples
from palpate.learning.energy.energy_search import EnergyEnsemble
from palpate.network import Network, Scaling, TrainedRegion
from palpate.rbf.freezing import training_record
from palpate.rbf.symmetric_units import Images, SymmetricRegressors
from palpate.units import Quantity, bounds

__all__ = ["export_network", "trained_region", "training_meta"]

_COPIES = 512  # points of a region are kept at most; more images would only be thinned again


def export_network(
    ensemble: EnergyEnsemble, root: np.ndarray, samples: EnergySamples, meta: dict[str, Any]
) -> tuple[Network, np.ndarray]:
    """Return the network with every unit's images as units of their own, and the root of its weights' covariance."""
    units, n = ensemble.regressors, len(samples.inputs)
    if isinstance(units, SymmetricRegressors):
        factors, shifts, coefficients = units.expanded(ensemble.theta, ensemble.coefficients)
        root = units.expanded(ensemble.theta, root)[2]
    else:
        factors, shifts = units.form.factors(ensemble.theta)
        coefficients = ensemble.coefficients
    low, high = bounds(samples.inputs)
    scaling = Scaling((low + high) / 2, (high - low) / 2, np.zeros(1), np.ones(1))
    network = Network(
        samples.inputs,
        (Quantity("ln U/U0", ""),),
        factors,
        shifts,
        coefficients[1 + n :].T,
        coefficients[: 1 + n].T,
        scaling,
        meta={k: v for k, v in meta.items() if k == "training"},
        radial=units.radial,
    )
    return network, root


def trained_region(samples: EnergySamples, images: Images | None) -> TrainedRegion:
    """Return the region around the solves' scaled inputs and their images.

    A solve is left out with its images, and with all of its group.
    """
    points = samples.scaled[None] if images is None else images.of(samples.scaled)
    together = np.tile(samples.groups, len(points))
    return TrainedRegion.of(points.reshape(-1, len(samples.inputs)), groups=together, most=_COPIES)


def training_meta(samples: EnergySamples, ensemble: EnergyEnsemble, errors: np.ndarray) -> dict[str, Any]:
    """Return what a body's record tells of its training; errors (N,) of solves left out, relative."""
    return {
        **training_record(samples.X, samples.energy[:, None], samples.inputs),
        "solves": len(samples),
        "samples": ensemble.regressors.copies * len(samples),
        "form": ensemble.regressors.form.name,
        "radial": ensemble.regressors.radial,
        "networks": ensemble.networks,
        "loo": ensemble.error if math.isfinite(ensemble.error) else None,
        "left_out": {"median": float(np.median(errors)), "p95": float(np.quantile(errors, 0.95))},
    }
