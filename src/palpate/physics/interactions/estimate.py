"""How much of a probe's depth its pad takes, before anything is solved.

The body is taken as a half-space (Hertz 1882; Johnson 1985, Contact Mechanics, eq. 4.23), F = 4/3 E* √(R a³), the pad
as springs side by side under a flat sphere (Johnson 1985, section 4.3), F = 2πR φ(b); both in series share the depth
a + b. On a block of tissue of 9 kPa this gives 0.49, 0.33 and 0.25 of the depth at 1, 5 and 10 mm.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from palpate.physics.advice import advise
from palpate.physics.interactions.pad_law import REACH, pressed_energy
from palpate.physics.words import millimetres, number

__all__ = ["advise_on_pad", "pad_depth"]

LARGE = 0.5  # share of the depth: from here on more of it is the pad's than the body's
SMALL = 0.1  # share that the pad advised would take


def pad_depth(probe: Any, modulus: float, depth: float) -> float:
    """How far the pad of a sphere is pressed at a depth, in m.

    Parameters
    ----------
    probe : SphereProbe
    modulus : float
        E* = E/(1 − ν²) of the body in Pa.
    depth : float
        In m, positive.
    """
    low, high = 0.0, depth if probe.stop is None else min(depth, REACH * probe.stop)
    for _ in range(50):  # the pad's force grows with its share, the body's falls
        pressed = (low + high) / 2
        pad = 2 * math.pi * probe.radius * pressed_energy(pressed, probe.pad, probe.stop)
        body = 4 / 3 * modulus * math.sqrt(probe.radius * (depth - pressed) ** 3)
        low, high = (pressed, high) if pad < body else (low, pressed)
    return low


def advise_on_pad(probe: Any, materials: dict[str, Any]) -> None:
    """Warn of a pad that takes more than half of the largest depth, on a body of these materials by region.

    Of several materials the softest counts, so the warning comes late rather than falsely.
    """
    depth = probe.depth[1]
    modulus = min(2 * m.shear_modulus / (1 - m.poisson) for m in materials.values())
    if depth <= 0 or pad_depth(probe, modulus, depth) <= LARGE * depth:
        return
    share = pad_depth(probe, modulus, depth) / depth
    advise(
        f"The pad of the probe takes about {share:.0%} of the depth of {millimetres(depth)}.",
        why=f"Its stiffness of {number(probe.pad)} N/m³ is low for a body of E/(1 − ν²) = {number(modulus)} Pa: "
        "most of what is felt is the pad.",
        fix=f"Give the probe pad={_stiffer(probe, modulus, depth):.0e} or more, which takes less than {SMALL:.0%}, "
        "or ask pad_share and state the pad with the results.",
    )


def _stiffer(probe: Any, modulus: float, depth: float) -> float:
    """The least power of ten, or twice or five times one, in N/m³ whose pad takes little."""
    power = math.floor(math.log10(probe.pad))
    ladder = (digit * 10.0**p for p in range(power, power + 30) for digit in (1, 2, 5))
    return next(pad for pad in ladder if pad_depth(replace(probe, pad=pad), modulus, depth) <= SMALL * depth)
