"""The pad between a sphere and a surface: one law for finite elements and for points on springs."""

from __future__ import annotations

from typing import Any

__all__ = ["REACH", "pressed_energy"]

REACH = 0.98  # share of the stop up to which states are admissible


def pressed_energy(penetration: Any, pad: float, stop: float | None) -> Any:
    """φ(p) = ½ k p²/(1 − p/p_m) in J/m² for 0 ≤ p < p_m.

    Parameters
    ----------
    penetration : number, array or ngsolve.CoefficientFunction
        p in m.
    pad : float
        k in N/m³.
    stop : float or None
        p_m in m; None, or infinity, for a pad without a stop.
    """
    spring = pad / 2 * penetration**2
    return spring if stop is None else spring / (1 - penetration / stop)
