"""Sections of a linear viscoelastic material.

Stretching, shear and bending relax by one Prony series, so Poisson's ratio stays what it is. The section forces are
those of `UniaxialViscoelastic` with EA, kGA and EI in the modulus' place: exact for strains that grow evenly over a
step, and so for held ones whatever the step.
"""

from __future__ import annotations

import math

import numpy as np

from palpate.physics.beam.reissner import Stiffness
from palpate.physics.beam.resultants import SectionAnswer
from palpate.physics.materials.prony import PronySeries
from palpate.physics.materials.uniaxial import UniaxialViscoelastic, ViscousFibres

__all__ = ["ViscousSection"]

SHORT = 1e-3  # steps below this share of a relaxation time: the overstress changes as good as evenly


class ViscousSection:
    """A section whose stiffnesses relax together (a `resultants.SectionLaw`).

    Parameters
    ----------
    stiffness : Stiffness
        The instantaneous ones.
    prony : PronySeries
    """

    quadratic = True

    def __init__(self, stiffness: Stiffness, prony: PronySeries) -> None:
        self.elastic = np.array([stiffness.axial, stiffness.shear, stiffness.bending])
        self._prony = prony
        # of unit modulus: its "stresses" are strains, its "overstresses" shares of strains
        self._law = UniaxialViscoelastic(1.0, prony)

    def rest(self, shape: tuple[int, ...]) -> ViscousFibres:
        """Relaxed sections of the given shape, without strain."""
        return self._law.rest((*shape, 3))

    def answer(self, strain: np.ndarray, internal: ViscousFibres, dt: float | None) -> SectionAnswer:
        """Answer to strains (..., 3) that grew evenly over the step."""
        share, modulus, energy, after = self._law.stress(strain, internal, dt)
        tangent = np.zeros((*strain.shape, 3))
        diagonal = np.arange(3)
        tangent[..., diagonal, diagonal] = modulus * self.elastic
        # a constant: the scale by which the search judges what is small must not vanish where the load does
        begun = self.stored(internal.stress, internal)
        return SectionAnswer(energy @ self.elastic + begun, share * self.elastic, tangent, after)

    def stored(self, strain: np.ndarray, internal: ViscousFibres) -> np.ndarray:
        """Energy of the springs in J/m."""
        shares = np.array(self._prony.shares).reshape(-1, *[1] * strain.ndim)
        springs = self._prony.equilibrium * strain**2 + (internal.overstress**2 / shares).sum(axis=0)
        result: np.ndarray = springs @ self.elastic / 2
        return result

    def dissipated(self, before: ViscousFibres, after: ViscousFibres, dt: float | None) -> np.ndarray:
        """What the dashpots took in a step of dt seconds, in J/m: ∫ q²/(γ τ) dt for each term."""
        spent = np.zeros(before.stress.shape)
        grown = after.stress - before.stress
        for (share, time), start, end in zip(
            self._prony.terms, before.overstress, after.overstress, strict=True
        ):
            spent += _squared_decay(start, end, share * grown, (dt or 0.0) / time) / share
        result: np.ndarray = spent @ self.elastic
        return result


def _squared_decay(start: np.ndarray, end: np.ndarray, grown: np.ndarray, ratio: float) -> np.ndarray:
    """∫ q² ds over 0 … ratio, for q' = grown/ratio - q from `start` to `end`."""
    if ratio < SHORT:
        even: np.ndarray = ratio * (start**2 + start * end + end**2) / 3
        return even
    if math.isinf(ratio):
        # the strain grows so slowly that only what was there is lost
        faded: np.ndarray = start**2 / 2
        return faded
    steady = grown / ratio
    fading = start - steady
    decay = math.exp(-ratio)
    lost: np.ndarray = fading**2 * (1 - decay**2) / 2 + 2 * fading * steady * (1 - decay) + steady**2 * ratio
    return lost
