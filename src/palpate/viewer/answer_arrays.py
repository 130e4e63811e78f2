"""The arrays of a page that computes by itself: networks, their deviations and regions, in blocks of bytes."""

from __future__ import annotations

from statistics import NormalDist
from typing import Any, Literal

import numpy as np

from palpate.network import Network
from palpate.network.uncertainty import Uncertainty
from palpate.surrogates import LearntQuantities
from palpate.viewer.file_document import shuffle_words

__all__ = ["ArrayBlock", "quantities_facts"]

MOST_DEVIATION = 100_000  # numbers by which a network's deviation is told; with more it is left out


class ArrayBlock:
    """Arrays one after the other, and for each the facts by which the page reads it."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._parts: list[bytes] = []
        self._size = 0

    def add(self, values: np.ndarray, kind: Literal["f4", "f8", "i4"] = "f8") -> dict[str, Any]:
        """Append an array and return where it stands, of which kind and shape it is."""
        data = shuffle_words(np.ascontiguousarray(values, f"<{kind}").tobytes(), int(kind[1]))
        facts = {"part": self.name, "at": self._size, "kind": kind, "shape": list(np.shape(values))}
        self._parts.append(data)
        self._size += len(data)
        return facts

    def to_bytes(self) -> bytes:
        """Return all of them."""
        return b"".join(self._parts)


def quantities_facts(group: LearntQuantities, block: ArrayBlock) -> dict[str, Any]:
    """Return what the page must know of numbers that were learnt together."""
    sure, influence, region = group.uncertainty, group.influence, group.region
    large = sure is not None and sure.root.size + sure.through.size > MOST_DEVIATION
    return {
        "outputs": [{"name": q.name, "unit": q.unit} for q in group.outputs],
        "network": _network(group.network, block),
        "members": [_network(member, block) for member in group.members],
        "region": None
        if region is None
        else {"points": block.add(region.points), "radius": float(region.radius)},
        "deviation": None if sure is None or large else _uncertainty(sure, block),
        "influence": None
        if influence is None
        else {"shares": block.add(influence.coefficients), "missed": block.add(influence.missed)},
        "level": group.level,
        "factor": NormalDist().inv_cdf((1.0 + group.level) / 2.0),
    }


def _network(network: Network, block: ArrayBlock) -> dict[str, Any]:
    """Return the arrays of a network."""
    s = network.scaling
    return {
        "radial": network.radial,
        "inputs": block.add(np.array([s.input_centre, s.input_half, s.input_bend])),
        "outputs": block.add(np.array([s.output_centre, s.output_scale])),
        "factors": block.add(network.factors),
        "shifts": block.add(network.shifts),
        "weights": block.add(network.weights),
        "tail": block.add(network.tail),
        "basis": None if network.basis is None else block.add(network.basis),
    }


def _uncertainty(sure: Uncertainty, block: ArrayBlock) -> dict[str, Any]:
    """Return the arrays of a network's deviation."""
    return {
        "network": _network(sure.network, block),
        "noise": block.add(sure.noise),
        "coefficients": block.add(sure.coefficients),
        "root": block.add(sure.root),
        "through": block.add(sure.through),
        "pattern": block.add(sure.pattern, "i4"),
        "factor": block.add(np.broadcast_to(sure.factor, sure.noise.shape)),
    }
