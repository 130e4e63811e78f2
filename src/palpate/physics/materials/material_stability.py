"""Stability of a material: Drucker's criterion over a range of strains, by which more strain needs more stress.

At each state the Kirchhoff stress must grow with every further stretch and shear: dτ : D > 0 for the Jaumann rate of τ
and each rate of strain D (Drucker 1959, J. Appl. Mech. 26, 101-106; Hill 1968, J. Mech. Phys. Solids 16, 229-242). That
is the positive definiteness of the symmetric 6 × 6 matrix of second derivatives of W(exp(H) F) at H = 0, whose least
eigenvalue is reported as the least incremental modulus. At F = I it is twice the shear modulus, or 3K if that is less.
An incompressible material is asked for the rates that keep its volume.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.physics.materials.homogeneous import (
    Response,
    energy_of,
    equibiaxial,
    is_incompressible,
    planar,
    simple_shear,
    uniaxial,
    unit_tensors,
    volumetric,
)
from palpate.physics.materials.material import NO_STATE, Material, initial_state
from palpate.physics.materials.tensors import gradient

__all__ = ["ModeStability", "Stability", "stability"]

_DIFFERENCE = 1e-5  # of the rates of strain: the moduli are good to 1e-9
_STATES = 61  # per mode
_SIGNED = (" compression", " tension")
_SENSE = {"simple shear": ("", ""), "volumetric": (" compression", " expansion")}
_MODES: tuple[tuple[str, Callable[..., Response], float], ...] = (
    ("uniaxial", uniaxial, 1.0),
    ("equibiaxial", equibiaxial, 1.0),
    ("planar", planar, 1.0),
    ("simple shear", simple_shear, 0.0),
    ("volumetric", volumetric, 1.0),
)

# two orthonormal stretches of constant volume
_TRACELESS = np.array([[2.0, -1.0, -1.0], [0.0, np.sqrt(3), -np.sqrt(3)]]) / np.sqrt(6)


@dataclass(frozen=True)
class ModeStability:
    """The verdict on one mode.

    Attributes
    ----------
    mode : str
        ``"uniaxial"``, ``"equibiaxial"``, ``"planar"``, ``"simple shear"`` or ``"volumetric"``.
    asked : tuple of float
        Range of strains asked: λ − 1, the shear strain γ, or J − 1.
    stable : tuple of float
        The part of it around zero where the material is stable, to the spacing of the states looked at.
    least_modulus : float
        Least incremental modulus over the range asked, in Pa; NaN if a state had no equilibrium.
    at : float
        The strain at which it occurs.
    """

    mode: str
    asked: tuple[float, float]
    stable: tuple[float, float]
    least_modulus: float
    at: float

    def __bool__(self) -> bool:
        """Return True where the material is stable over all of the range."""
        return self.least_modulus > 0

    def __str__(self) -> str:
        """Return the verdict in words."""
        low, high = self.asked
        if self:
            return f"stable in {self.mode} strain {low:+.3g} to {high:+.3g}"
        ends = [
            f"{self.mode}{_SENSE.get(self.mode, _SIGNED)[side]} beyond {end:+.3g}"
            for side, (end, limit) in enumerate(zip(self.stable, self.asked, strict=True))
            if end != limit
        ]
        how = (
            f"least incremental modulus {self.least_modulus:.4g} Pa at {self.at:+.3g}"
            if np.isfinite(self.least_modulus)
            else f"no equilibrium at {self.at:+.3g}"
        )
        return f"unstable in {' and in '.join(ends) or self.mode} ({how})"


@dataclass(frozen=True)
class Stability:
    """The verdicts on all modes; true if the material is stable in each.

    Attributes
    ----------
    material : str
        Name of the material.
    modes : tuple of ModeStability
        One verdict for each mode.
    """

    material: str
    modes: tuple[ModeStability, ...]

    def __bool__(self) -> bool:
        """Return True where the material is stable over all of the ranges."""
        return all(self.modes)

    def __str__(self) -> str:
        """Return the verdict in words, what is unstable first."""
        verdicts = sorted(self.modes, key=bool)
        return f"{self.material}: " + "; ".join(str(mode) for mode in verdicts) + "."

    def describe(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {
            "material": self.material,
            "stable": bool(self),
            "modes": {
                m.mode: {"asked": list(m.asked), "stable": list(m.stable), "least_modulus": m.least_modulus}
                for m in self.modes
            },
        }


def stability(
    material: Material,
    strain: tuple[float, float] | Mapping[str, tuple[float, float]] = (-0.5, 1.0),
    volume: tuple[float, float] = (-0.2, 0.2),
    *,
    dt: Any = None,
) -> Stability:
    """Test a material over ranges of strain; a material with a history, in its first step of `dt` seconds.

    `strain` is the range of λ − 1 in uniaxial, equibiaxial and planar tests, and of γ in simple shear, from above −1; a
    mapping gives each of these four modes a range of its own. `volume` is the range of J − 1. Each holds 0.
    """
    ranges = strain if isinstance(strain, Mapping) else {mode: strain for mode, _, _ in _MODES}
    ranges = {**ranges, "volumetric": volume}
    for limits in ranges.values():
        _check(limits)
    verdicts = []
    for mode, test, undeformed in _MODES:
        if mode == "volumetric" and is_incompressible(material):
            continue
        strains = _spaced(ranges[mode])
        state = initial_state(material, unit_tensors(len(strains))) if material.states else NO_STATE
        moduli = _least_moduli(material, test(material, undeformed + strains, state=state, dt=dt), state, dt)
        verdicts.append(_verdict(mode, strains, moduli))
    return Stability(material.name, tuple(verdicts))


def _least_moduli(material: Material, response: Response, state: Any, dt: Any) -> np.ndarray:
    """Return the least eigenvalue of the incremental moduli at each state, in Pa; NaN where there is no state."""
    energy = energy_of(material, state, dt)
    converged = response.converged
    F = np.where(converged[:, None, None], response.deformation, np.eye(3))
    P = gradient(energy, F)
    H = _symmetric_basis()
    if is_incompressible(material):
        # rates of strain that keep the volume, on which the pressure does no work
        H = np.concatenate([np.einsum("ab,bij->aij", _TRACELESS, H[:3]), H[3:]])
    small = material.kinematics == "small"
    moved = np.broadcast_to(H, (len(F), *H.shape)) if small else np.einsum("aij,njk->naik", H, F)
    step = _DIFFERENCE * np.moveaxis(moved, 1, 0)
    slopes = (gradient(energy, F + step) - gradient(energy, F - step)) / (2 * _DIFFERENCE)
    moduli = np.einsum("naij,bnij->nab", moved, slopes)
    if not small:
        twice = np.einsum("aij,bjk->abik", H, H)
        twice = (twice + np.swapaxes(twice, 0, 1)) / 2
        moduli = moduli + np.einsum("nij,abik,nkj->nab", P, twice, F)
    return np.where(converged, np.linalg.eigvalsh((moduli + np.swapaxes(moduli, 1, 2)) / 2)[:, 0], np.nan)


def _verdict(mode: str, strains: np.ndarray, moduli: np.ndarray) -> ModeStability:
    positive = moduli > 0  # false for NaN
    zero = int(np.argmin(np.abs(strains)))
    low = high = zero
    while low > 0 and positive[low - 1]:
        low -= 1
    while high < len(strains) - 1 and positive[high + 1]:
        high += 1
    worst = int(np.argmin(np.where(np.isnan(moduli), -np.inf, moduli)))
    asked, stable = (float(strains[0]), float(strains[-1])), (float(strains[low]), float(strains[high]))
    return ModeStability(mode, asked, stable, float(moduli[worst]), float(strains[worst]))


def _symmetric_basis() -> np.ndarray:
    """Return six orthonormal symmetric tensors (6, 3, 3)."""
    basis = [np.diag(row) for row in np.eye(3)]
    for i, j in ((0, 1), (0, 2), (1, 2)):
        shear = np.zeros((3, 3))
        shear[i, j] = shear[j, i] = np.sqrt(0.5)
        basis.append(shear)
    return np.array(basis)


def _spaced(limits: tuple[float, float]) -> np.ndarray:
    """Return evenly spaced strains with 0 among them."""
    return np.unique(np.append(np.linspace(*limits, _STATES), 0.0))


def _check(limits: tuple[float, float]) -> None:
    low, high = limits
    if not -1 < low <= 0 <= high < np.inf or low == high:
        raise UsageError(
            f"The range of strains {low} to {high} can't be tested.",
            why="It holds 0, the undeformed state, and begins above -1, where nothing is left of the body.",
            fix="Pass, for example, strain=(-0.3, 0.5).",
        )
