"""Checks that a network can be evaluated: parts that fit, finite numbers, real scales, none that overflows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.errors import UsageError
from palpate.units import bounds

if TYPE_CHECKING:
    from palpate.network.network import Network, Scaling

__all__ = ["check_shapes", "flaw", "unreal"]

LARGEST = 1e100  # its square, times any sensible number of terms, is still far below the largest double


def check_shapes(network: Network) -> None:
    """Refuse parts whose shapes are not what a network's units, inputs and outputs ask for."""
    if network.factors.ndim != 3 or not network.inputs or not network.outputs:
        raise UsageError(
            f"A network of {len(network.inputs)} inputs, {len(network.outputs)} outputs and factors of shape "
            f"{network.factors.shape} can't be.",
            fix="Give at least one input and output, and factors (units, rank, inputs).",
        )
    (h, r, n), m, s = network.factors.shape, len(network.outputs), network.scaling
    latent = m if network.basis is None else len(np.atleast_1d(network.weights))
    shapes = {
        "inputs": ((len(network.inputs),), (n,)),
        "factors": (network.factors.shape, (h, min(max(r, 1), n), n)),
        "shifts": (network.shifts.shape, (h, r)),
        "weights": (network.weights.shape, (latent, h)),
        "tail": (network.tail.shape, (latent, 1 + n)),
        "basis": ((m, latent) if network.basis is None else network.basis.shape, (m, max(latent, 1))),
        "input scales": (
            tuple(map(np.shape, (s.input_centre, s.input_half, s.input_bend))),
            ((n,), (n,), (n,)),
        ),
        "output scales": ((np.shape(s.output_centre), np.shape(s.output_scale)), ((m,), (m,))),
    }
    for name, (found, wanted) in shapes.items():
        if found != wanted:
            raise UsageError(
                f"A network's {name} have shape {found}; its units and outputs ask for {wanted}."
            )


def flaw(network: Network) -> str:
    """The reason why a network can't be used over its trained ranges; "" if there is none."""
    for name, array in network.extras.items():
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            return f"its extra array {name!r} holds numbers that are not finite"
    with np.errstate(all="ignore"):  # what overflows is not below the bound
        return "" if _largest(network) < LARGEST else "its numbers are so large that they overflow"


def unreal(network: Network) -> str:
    """The parts of a network whose numbers are not finite, or scale by nothing; "" if none."""
    s = network.scaling
    numbers = {
        "factors": network.factors,
        "shifts": network.shifts,
        "weights": network.weights,
        "tail": network.tail,
        "input centres": s.input_centre,
        "input half widths": s.input_half,
        "input bends": s.input_bend,
        "output centres": s.output_centre,
        "output scales": s.output_scale,
        "basis": np.zeros(0) if network.basis is None else network.basis,
    }
    for name, array in numbers.items():
        if not np.isfinite(array).all():
            return f"its {name} are not all finite numbers"
    if not (np.greater(s.input_half, 0).all() and np.greater(s.output_scale, 0).all()):
        return "its scales are not all positive"
    if not (np.abs(s.input_bend) < 1.0).all():
        return "its inputs are bent by one or more, so that their scale has an end in their range"
    return ""


def _largest(network: Network) -> float:
    """A bound on every number met on the way to an output or its derivative, inside the trained ranges."""
    s = network.scaling
    reach = np.max(np.abs(s.scale_inputs(np.array(bounds(network.inputs)))), axis=0)
    distance = np.abs(network.factors) @ reach + np.abs(network.shifts)
    one = np.concatenate([[1.0], reach])
    latent = np.abs(network.tail) @ one + np.abs(network.weights).sum(axis=1)
    outputs = latent if network.basis is None else np.abs(network.basis) @ latent
    steep = max(1.0, float(np.abs(network.factors).max(initial=0.0))) / _least_step(s)
    found = [
        distance.max(initial=0.0),
        (latent * steep).max(),
        steep,
        (np.abs(s.output_centre) + s.output_scale * outputs * max(1.0, steep)).max(),
    ]
    return float(np.max(found))  # not-a-number where one is


def _least_step(scaling: Scaling) -> float:
    """Return a bound on the change of an input by its scaled one, inside the range: h / (1 + |b|)²."""
    return float((scaling.input_half / (1.0 + np.abs(scaling.input_bend)) ** 2).min())
