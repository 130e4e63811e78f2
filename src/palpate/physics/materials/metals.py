"""Metals that yield, with their sources."""

from __future__ import annotations

from palpate.physics.materials.hardening import VoceHardening
from palpate.physics.materials.linear import LinearElastic
from palpate.physics.materials.plastic import Plastic

__all__ = ["METALS"]

_COPPER = Plastic(
    LinearElastic(110e9, 0.35, 8700.0, "copper", "Narayanan, Singla, Garimella, Waz & Krovi 2011, ASME DSCC"),
    # least squares of relative deviation from 90 + 292 α^0.31 MPa over 0 < α ≤ 0.2
    VoceHardening(yield_stress=125.5e6, saturation=67.2e6, rate=52.2, modulus=390.8e6),
    "annealed copper",
    "flow stress 90 + 292 α^0.31 MPa of oxygen-free copper (Johnson & Cook 1983, 7th Int. Symp. Ballistics, "
    "541-547), met within 3 % for 0.002 ≤ α ≤ 0.2; elastic constants of the founding case",
)

METALS: dict[str, Plastic] = {_COPPER.name: _COPPER}
"""Metals that can be asked for by name."""
