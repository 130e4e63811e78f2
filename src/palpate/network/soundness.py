"""Whether a network's numbers can be evaluated: finite, with real scales, and never so large as to overflow."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.units import bounds

if TYPE_CHECKING:
    from palpate.network.network import Network

__all__ = ["flaw"]

LARGEST = 1e100  # its square, times any sensible number of terms, is still far below the largest double


def flaw(network: Network) -> str:
    """What makes the network unusable over its trained ranges; "" if nothing does."""
    s = network.scaling
    numbers = {
        "factors": network.factors,
        "shifts": network.shifts,
        "weights": network.weights,
        "tail": network.tail,
        "input centres": s.input_centre,
        "input half widths": s.input_half,
        "output centres": s.output_centre,
        "output scales": s.output_scale,
        "basis": np.zeros(0) if network.basis is None else network.basis,
        **{f"extra array {k!r}": v for k, v in network.extras.items() if v.dtype.kind == "f"},
    }
    for name, array in numbers.items():
        if not np.isfinite(array).all():
            return f"its {name} are not all finite numbers"
    if not ((s.input_half > 0).all() and (s.output_scale > 0).all()):
        return "its scales are not all positive"
    with np.errstate(all="ignore"):  # what overflows is not below the bound
        return "" if _largest(network) < LARGEST else "its numbers are so large that they overflow"


def _largest(network: Network) -> float:
    """A bound on every number met on the way to an output or its derivative, inside the trained ranges."""
    s = network.scaling
    reach = np.max(np.abs(s.scale_inputs(np.array(bounds(network.inputs)))), axis=0)
    distance = np.abs(network.factors) @ reach + np.abs(network.shifts)
    one = np.concatenate([[1.0], reach])
    latent = np.abs(network.tail) @ one + np.abs(network.weights).sum(axis=1)
    outputs = latent if network.basis is None else np.abs(network.basis) @ latent
    steep = max(1.0, float(np.abs(network.factors).max(initial=0.0))) / s.input_half.min()
    found = [
        distance.max(initial=0.0),
        (latent * steep).max(),
        steep,
        (np.abs(s.output_centre) + s.output_scale * outputs * max(1.0, steep)).max(),
    ]
    return float(np.max(found))  # not-a-number where one is
