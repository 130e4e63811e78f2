"""The pad's share of a press, and the force that a rigid ball would feel as deep.

A ball of radius R with a pad of k (N/m³) at depth s presses a half-space of plane modulus E*. Let the pressure be that
of Hertz, p₀ √(1 − r²/c²) within a radius c. Of all p₀ and c, equilibrium has those that make the complementary work

    W = p₀ B − p₀² A        B = 2πc²s/3 − 2πc⁴/15R        A = 2π²c³/15E* + πc²/4k

largest: the work of the ball's shape, less the energies of body and pad. So p₀ = B/2A, and F = ∂W/∂s = 2πc²p₀/3.
Without a pad this is Hertz exactly, F = 4/3 E* √R s^{3/2}; without a body it is 1.2 % below the pad's own πkRs².

A learnt body gives F at s. The modulus that explains it with the pad gives the force without one; layers and supports
beneath count as they do at this depth. The pad's stop is left out: it stiffens the pad, while a deep ball has less area
than is taken here. On a block of 9 kPa under a ball of 10 mm the two cancel up to half a radius: the share of the force
that is missing comes out as 0.40, 0.32, 0.27 and 0.23 at 2, 4, 6 and 8 mm, and by solves with a pad of 50 k as 0.37,
0.32, 0.31 and 0.32. So it is asked no deeper than half a radius.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.format import length, plain, share
from palpate.surrogates.energy import LearntEnergy

__all__ = ["PadPart", "pad_part", "pad_part_of"]

DEEP = 0.5  # of the radius, and of the deepest trained depth: where the pad's share is stated
ROWS = 5  # of about this depth, of which the one of middle force counts
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True)
class PadPart:
    """The pad's part in one press."""

    depth: float  # of the press, m
    force: float  # with the pad, N
    rigid_force: float  # of a rigid ball at the same depth, N
    depth_share: float  # of the depth, the pad's

    @property
    def force_share(self) -> float:
        """Share of a rigid ball's force that is missing."""
        return 1.0 - self.force / self.rigid_force

    def __str__(self) -> str:
        return (
            "The probe is a rigid ball with a soft pad around it. "
            f"At a depth of {length(self.depth)} the pad takes about {share(self.depth_share)} of the depth; "
            f"a rigid ball would feel about {plain(self.rigid_force)} N instead of {plain(self.force)} N."
        )


def pad_part(force: float, depth: float, radius: float, pad: float) -> PadPart:
    """Return the part that a pad of `pad` (N/m³) has in a `force` (N) of a ball at a depth (m); all are positive.

    A force beyond the pad's own counts as that of a body far stiffer than the pad.
    """
    hertz = force / (4 / 3 * math.sqrt(radius) * depth**1.5)  # E* without a pad: the least that it can be
    low, high = math.log(hertz), math.log(1e4 * max(hertz, pad * radius))
    for _ in range(50):  # the force grows with the modulus
        middle = (low + high) / 2
        low, high = (middle, high) if _force(math.exp(middle), depth, radius, pad) < force else (low, middle)
    modulus = math.exp(low)
    rigid = 4 / 3 * modulus * math.sqrt(radius) * depth**1.5
    return PadPart(depth, force, rigid, 1.0 - (force / rigid) ** (2 / 3))


def _force(modulus: float, depth: float, radius: float, pad: float) -> float:
    """Return the force with the pad, N, of the contact radius that makes W = B²/4A largest."""

    def sizes(area: float) -> tuple[float, float]:
        work = 2 * math.pi * area * (depth / 3 - area / (15 * radius))
        energies = 2 * math.pi**2 * area**1.5 / (15 * modulus) + math.pi * area / (4 * pad)
        return work**2 / energies, work / (2 * energies)

    low, high = 0.0, 5 * radius * depth  # c², between which B is positive
    for _ in range(60):
        less, more = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        low, high = (low, more) if sizes(less)[0] > sizes(more)[0] else (less, high)
    area = (low + high) / 2
    return 2 * math.pi * area * sizes(area)[1] / 3


def pad_part_of(energy: LearntEnergy, meta: Mapping[str, Any]) -> PadPart | None:
    """Return the pad's part in a usual press of a learnt body; None without a ball, or where its file says of no pad.

    The press is half as deep as the deepest trained, at most half a radius, and of middle force among its like.
    """
    probe = _probe_of(meta)
    if probe is None or energy.baseline.holds:
        return None
    X = energy.trained_rows()
    depth, force = energy.depth(X), np.linalg.norm(energy.force(X), axis=1)
    own = energy.baseline.radius_input
    radius = np.full(len(X), float(probe["radius"])) if own is None else X[:, own]
    known = np.flatnonzero(energy.inside(X) & (depth > 0.0) & (force > 0.0))
    if not len(known):
        return None
    wanted = DEEP * np.minimum(radius[known], depth[known].max())
    near = known[np.argsort(np.abs(depth[known] - wanted), kind="stable")[:ROWS]]
    row = near[np.argsort(force[near], kind="stable")[len(near) // 2]]
    return pad_part(float(force[row]), float(depth[row]), float(radius[row]), float(probe["pad"]))


def _probe_of(meta: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Return the ball with a pad that made the solves, as their provenance says it."""
    here: Any = meta
    for name in ("dataset", "provenance", "problem"):
        here = here.get(name) if isinstance(here, Mapping) else None
    acting = here.get("interactions") if isinstance(here, Mapping) else None
    for item in acting if isinstance(acting, list | tuple) else ():
        if isinstance(item, Mapping) and item.get("type") == "SphereProbe":
            numbers = [item.get(name) for name in ("pad", "radius")]
            if all(isinstance(n, int | float) and math.isfinite(n) and n > 0 for n in numbers):
                return item
    return None
