"""What is believed of a specimen, written into a touch surrogate of the same kind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.learning.correction.belief import Belief
from palpate.learning.correction.prior import Opened
from palpate.network import Network
from palpate.surrogates import ContactBaseline, Continuation, LearntEnergy, Surrogate, TouchedSurface

__all__ = ["corrected", "raised"]


def corrected(
    body: Surrogate, energy: LearntEnergy, may: Opened, belief: Belief, counts: Mapping[str, int]
) -> Surrogate:
    """Return the body with the most probable weights and height, and the root of the weights' covariance.

    Its law, units, region and inputs are those of before. Where the height is still unsure, the deviation does not
    tell of it.
    """
    height, sure = may.offset * float(belief.mean[-1]), may.offset * belief.spread(-1)
    root = may.root @ belief.root[:-1]
    if root.shape[1] > root.shape[0]:
        root = np.linalg.qr(root.T)[1].T
    meta: dict[str, Any] = dict(body.meta)
    meta["correction"] = {"counts": dict(counts), "offset": height, "offset_deviation": sure}
    going, baseline = energy.going, energy.baseline
    moved = replace(energy, network=_moved(energy.network, may.root @ belief.mean[:-1]), root=root)
    if not height:
        return body.with_energy(moved, meta)
    assert isinstance(baseline, ContactBaseline)
    # ℓ is to be taken where it was: the deepest trained place stays, and is `height` deeper now
    deeper = Continuation(going.widths, going.deepest + height, going.depth_width)
    higher = replace(baseline, touched=raised(baseline.touched, height, _largest(energy)))
    return body.with_energy(replace(moved, baseline=higher, continuation=deeper), meta)


def raised(surface: TouchedSurface, height: float, radius: float) -> TouchedSurface:
    """The surface of distance d − height (m): higher everywhere along its normal.

    Raises
    ------
    UsageError
        If a probe of that radius (m) would then be in touch before the distance begins.
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
