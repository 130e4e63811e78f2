"""What a search has found, as the parts of a surrogate: network, root of its posterior, trained region, record."""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np

from palpate.learning.energy.energy_search import EnergyEnsemble
from palpate.network import Network, Scaling, TrainedRegion
from palpate.rbf.freezing import training_record
from palpate.rbf.symmetric_units import Images, SymmetricRegressors
from palpate.units import Quantity, Range, bounds

__all__ = ["Solves", "trained_region", "training_meta", "written_out"]

_COPIES = 512  # points of a region are kept at most; more images would only be thinned again


class Solves(Protocol):
    """What is asked of N samples of an energy."""

    @property
    def X(self) -> np.ndarray:
        """Inputs (N, n), the first three in m."""

    @property
    def energy(self) -> np.ndarray:
        """U (N,), J."""

    @property
    def force(self) -> np.ndarray:
        """−∂U by the inputs (N, n)."""

    @property
    def inputs(self) -> tuple[Range, ...]:
        """Names and ranges of the n inputs."""

    @property
    def scaled(self) -> np.ndarray:
        """Inputs (N, n) in [−1, 1] over their ranges."""

    @property
    def half(self) -> np.ndarray:
        """Half (n,) of each input's range."""

    def __len__(self) -> int: ...


def written_out(
    found: EnergyEnsemble, root: np.ndarray, samples: Solves, meta: dict[str, Any]
) -> tuple[Network, np.ndarray]:
    """The network with every unit's images as units of their own, and the root of its weights' covariance."""
    of, n = found.regressors, len(samples.inputs)
    if isinstance(of, SymmetricRegressors):
        factors, shifts, coefficients = of.expanded(found.theta, found.coefficients)
        root = of.expanded(found.theta, root)[2]
    else:
        factors, shifts = of.form.factors(found.theta)
        coefficients = found.coefficients
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
        radial=of.radial,
    )
    return network, root


def trained_region(samples: Solves, images: Images | None, groups: np.ndarray | None = None) -> TrainedRegion:
    """Around the solves' scaled inputs and their images.

    A solve is left out with its images, and with all of its number in `groups` (N,) where there are such.
    """
    points = samples.scaled[None] if images is None else images.of(samples.scaled)
    together = np.tile(np.arange(len(samples.X)) if groups is None else groups, len(points))
    return TrainedRegion.of(points.reshape(-1, len(samples.inputs)), groups=together, most=_COPIES)


def training_meta(samples: Solves, found: EnergyEnsemble, errors: np.ndarray) -> dict[str, Any]:
    """What a surrogate's file tells of its training; errors (N,) of solves left out, relative."""
    return {
        **training_record(samples.X, samples.energy[:, None], samples.inputs),
        "solves": len(samples),
        "samples": found.regressors.copies * len(samples),
        "form": found.regressors.form.name,
        "radial": found.regressors.radial,
        "networks": found.networks,
        "loo": found.error if math.isfinite(found.error) else None,
        "left_out": {"median": float(np.median(errors)), "p95": float(np.quantile(errors, 0.95))},
    }
