"""The surrogate of a specimen: the model with the posterior written into its weights and its surface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.learning.correction.prior import SpecimenPrior
from palpate.learning.correction.specimen_posterior import SpecimenPosterior
from palpate.network import Network
from palpate.surrogates import ContactBaseline, Continuation, LearntEnergy, Surrogate, TouchedSurface

__all__ = ["corrected_surrogate", "raise_surface"]


def corrected_surrogate(
    body: Surrogate,
    energy: LearntEnergy,
    prior: SpecimenPrior,
    posterior: SpecimenPosterior,
    counts: Mapping[str, int],
) -> Surrogate:
    """Return the body with the most probable weights and height, and the root of the weights' covariance.

    Its law, units, region and inputs are those of before. Where the height is still unsure, the deviation does not
    include that.
    """
    height, sure = prior.offset * float(posterior.mean[-1]), prior.offset * posterior.spread(-1)
    root = prior.root @ posterior.root[:-1]
    if root.shape[1] > root.shape[0]:
        root = np.linalg.qr(root.T)[1].T
    meta: dict[str, Any] = dict(body.meta)
    meta["correction"] = {"counts": dict(counts), "offset": height, "offset_deviation": sure}
    going, baseline = energy.going, energy.baseline
    moved = replace(energy, network=_moved(energy.network, prior.root @ posterior.mean[:-1]), root=root)
    if not height:
        return body.with_energy(moved, meta)
    assert isinstance(baseline, ContactBaseline)
    # ℓ is to be taken where it was: the deepest trained place stays, and is `height` deeper now
    deeper = Continuation(going.widths, going.deepest + height, going.depth_width)
    higher = baseline.raised(height, raise_surface(baseline.touched, height, _largest(energy)))
    return body.with_energy(replace(moved, baseline=higher, continuation=deeper), meta)


def raise_surface(surface: TouchedSurface, height: float, radius: float) -> TouchedSurface:
    """Return the surface of distance d − height (m): higher everywhere along its normal.

    It is refused if a probe of that radius (m) would then be in touch before the distance begins.
    """
    if surface.reach - height < radius or surface.inner + height <= 0:
        raise UsageError(
            f"A surface can't be raised by {1e3 * height:.3g} mm.",
            why=f"Its distance reaches {1e3 * surface.reach:.3g} mm outside, for a probe of {1e3 * radius:.3g} mm.",
            fix="Register the specimen more closely, give a smaller `offset`, or make the surface with more `reach`.",
        )
    return surface.raised(height)


def _largest(energy: LearntEnergy) -> float:
    own = energy.baseline.radius_input
    return energy.baseline.radius if own is None else energy.inputs[own].high


def _moved(net: Network, change: np.ndarray) -> Network:
    """The network with its tail and weights (c,) changed."""
    tail = 1 + len(net.inputs)
    return replace(net, tail=net.tail + change[:tail], weights=net.weights + change[tail:])
