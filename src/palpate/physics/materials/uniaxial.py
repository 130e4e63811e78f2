"""Fibres: stress and strain along one direction, for many fibres at once.

Plastic fibres flow by the return mapping of Simo & Hughes 1998 (Computational Inelasticity, section 1.4);
viscoelastic ones follow a Prony series whose update is exact for a strain that grows evenly during the step (Taylor,
Pister & Goudreau 1970, Int. J. Numer. Methods Eng. 2, 45-59). A fibre's answer to a strain is (stress, tangent, energy,
new state): the stress is the derivative of the energy and the tangent that of the stress, at the end of a step that
starts from `state`; nothing changes until the new state is kept.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from palpate import checks
from palpate.physics.materials.hardening import Hardening
from palpate.physics.materials.prony import PronySeries

__all__ = ["PlasticFibres", "UniaxialPlastic", "UniaxialViscoelastic", "ViscousFibres"]


class PlasticFibres(NamedTuple):
    """Internal variables of plastic fibres: plastic strain and accumulated plastic strain, pure numbers."""

    strain: np.ndarray
    accumulated: np.ndarray


class ViscousFibres(NamedTuple):
    """Internal variables of viscoelastic fibres.

    `stress` is the instantaneous law's stress at the end of the last step in Pa, of the fibres' shape; `overstress`
    (term, ...) is what each Prony term still carries, in Pa.
    """

    stress: np.ndarray
    overstress: np.ndarray


@dataclass(frozen=True)
class UniaxialPlastic:
    """Elastoplastic fibres of Young's modulus in Pa, with isotropic hardening."""

    young: float
    hardening: Hardening

    def __post_init__(self) -> None:
        checks.positive("Young's modulus", self.young, "Pa")

    def rest(self, shape: int | tuple[int, ...] = ()) -> PlasticFibres:
        """Return virgin fibres."""
        return PlasticFibres(np.zeros(shape), np.zeros(shape))

    def stress(
        self, strain: np.ndarray, state: PlasticFibres
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, PlasticFibres]:
        """Return stress in Pa, tangent in Pa, energy in J/m³ and new state at a total strain (...).

        The energy is elastic energy plus all plastic work since the virgin state.
        """
        trial = self.young * (strain - state.strain)
        excess = np.abs(trial) - self.hardening.flow_stress(state.accumulated)
        flow = self.hardening.increment(excess, self.young, state.accumulated)
        accumulated = state.accumulated + flow
        slope = self.hardening.slope(accumulated)
        tangent = np.where(excess > 0, self.young * slope / (self.young + slope), self.young)
        size = np.abs(trial) - self.young * flow
        energy = size**2 / (2 * self.young) + self.hardening.work(accumulated)
        direction = np.sign(trial)
        return direction * size, tangent, energy, PlasticFibres(state.strain + direction * flow, accumulated)


@dataclass(frozen=True)
class UniaxialViscoelastic:
    """Linear viscoelastic fibres of an instantaneous Young's modulus in Pa, which relaxes."""

    young: float
    prony: PronySeries

    def __post_init__(self) -> None:
        checks.positive("Young's modulus", self.young, "Pa")

    @property
    def equilibrium_young(self) -> float:
        """Modulus in Pa that is left in the end."""
        return self.young * self.prony.equilibrium

    def rest(self, shape: int | tuple[int, ...] = ()) -> ViscousFibres:
        """Return relaxed, unstrained fibres."""
        fibres = (shape,) if isinstance(shape, int) else tuple(shape)
        return ViscousFibres(np.zeros(fibres), np.zeros((len(self.prony.terms), *fibres)))

    def stress(
        self, strain: np.ndarray, state: ViscousFibres, dt: float | None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, ViscousFibres]:
        """Return stress in Pa, tangent in Pa, energy in J/m³ and new state at a total strain (...) that grew evenly.

        `dt` is the length of the step in s; None is an instant, infinity is for ever. The energy is the potential of
        the step's stress and no stored energy.
        """
        decay = _column(self.prony.decay(dt), state.stress)
        weight = _column(self.prony.shares, state.stress) * _column(self.prony.gain(dt), state.stress)
        instantaneous = self.young * np.asarray(strain)
        overstress = decay * state.overstress + weight * (instantaneous - state.stress)
        tangent = self.young * (self.prony.equilibrium + weight.sum(axis=0))
        memory = (decay * state.overstress - weight * state.stress).sum(axis=0)
        energy = (0.5 * tangent * strain + memory) * strain
        stress = self.prony.equilibrium * instantaneous + overstress.sum(axis=0)
        return (
            stress,
            np.broadcast_to(tangent, stress.shape),
            energy,
            ViscousFibres(instantaneous, overstress),
        )


def _column(values: tuple[float, ...], like: np.ndarray) -> np.ndarray:
    """Return values (term,) as an array that broadcasts over fibres, (term, 1, ...)."""
    return np.reshape(values, (len(values),) + (1,) * np.ndim(like))
