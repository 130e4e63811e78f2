"""Multiples of SI units in which numbers read well."""

from __future__ import annotations

import math

__all__ = ["round125", "scaled"]

_MULTIPLES = {
    "m": ((1.0, "m"), (1e-3, "mm"), (1e-6, "µm"), (1e-9, "nm")),
    "Pa": ((1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa"), (1.0, "Pa")),
    "N": ((1e3, "kN"), (1.0, "N"), (1e-3, "mN"), (1e-6, "µN")),
    "J": ((1.0, "J"), (1e-3, "mJ"), (1e-6, "µJ")),
    "": ((1e-2, "%"),),
}


def scaled(largest: float, unit: str) -> tuple[float, str]:
    """The multiple of `unit` for values up to `largest`: its size in `unit`, and its name.

    The largest multiple is taken of which `largest` is at least a tenth: 0.05 m reads 50 mm, 0.5 m stays 0.5 m.
    Pure numbers are in per cent.
    """
    multiples = _MULTIPLES.get(unit, ((1.0, unit),))
    for size, name in multiples:
        if abs(largest) >= 0.1 * size:
            return size, name
    return multiples[0] if largest == 0.0 else multiples[-1]


def round125(x: float) -> float:
    """1, 2 or 5 times a power of ten, at most `x` > 0."""
    power = 10.0 ** math.floor(math.log10(x) + 1e-9)
    return max(step * power for step in (1, 2, 5) if step * power <= x * (1 + 1e-9))
