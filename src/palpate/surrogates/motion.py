"""The speed limit of a body: how quickly it may be moved so that its static answers hold.

Driven at a frequency f, a body's lowest mode of frequency f₀ answers by a(f) = 1/(1 − (f/f₀)²) of its static answer.
Higher modes answer less, so the error of a static answer is at most a − 1.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from palpate.format import millimetres, number

__all__ = ["amplification", "motion_sentence", "quickest"]

ERROR = 0.05  # relative, of a static answer: what a hand hardly tells apart
HAND = 10.0  # Hz; voluntary movements of a hand have hardly anything above it


def amplification(frequency: float, lowest: float) -> float:
    """Return the answer of a mode over its static one, driven at a frequency below its own, `lowest`, both in Hz."""
    return 1.0 / (1.0 - (frequency / lowest) ** 2)


def quickest(lowest: float, error: float = ERROR) -> float:
    """Return the frequency in Hz at which a static answer errs by a relative `error`, of a lowest mode in Hz."""
    return lowest * math.sqrt(1.0 - 1.0 / (1.0 + error))


def motion_sentence(motion: Mapping[str, Any], deepest: float) -> str:
    """Return in a sentence how quickly a body may be pressed `deepest` m deep.

    `motion` holds its lowest natural `frequency` in Hz, and a `density` in kg/m³ where that was assumed. A press in and
    out to a depth d at a frequency f has a largest speed of π f d.
    """
    lowest = float(motion["frequency"])
    limit = quickest(lowest)
    assumed = f" (density {motion['density']:g} kg/m³ assumed)" if motion.get("density") else ""
    speed = f", or {number(1e3 * math.pi * limit * deepest, 2)} mm/s in strokes of {millimetres(deepest)}"
    slow = "covers what a hand does" if limit >= HAND else f"a hand moves at up to about {HAND:g} Hz"
    return (
        f"Its lowest natural frequency is {number(lowest, 3)} Hz{assumed}: a static answer errs by up to {ERROR:.0%} "
        f"at {number(limit, 2)} Hz{speed if math.isfinite(deepest) and deepest > 0 else ''}; {slow}."
    )
