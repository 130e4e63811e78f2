"""Sections cut into fibres that yield.

Plane sections stay plane: the fibre at the height y above the centre line is strained by ε - y κ. Its stress follows
one-dimensional plasticity; the shear force stays elastic, as a slender beam's shear stresses are far below yield.
"""

from __future__ import annotations

import numpy as np

from palpate.physics.beam.resultants import SectionAnswer
from palpate.physics.beam.section import FibreSection
from palpate.physics.materials.uniaxial import PlasticFibres, UniaxialPlastic

__all__ = ["PlasticSection"]


class PlasticSection:
    """A section of elastoplastic fibres (a `resultants.SectionLaw`).

    Parameters
    ----------
    section : FibreSection
    law : UniaxialPlastic
        Of each fibre.
    shear_stiffness : float
        kGA in N.
    fibres : int
        Layers across the height.
    """

    quadratic = False

    def __init__(
        self, section: FibreSection, law: UniaxialPlastic, shear_stiffness: float, fibres: int
    ) -> None:
        self._heights, self._areas = section.fibres(fibres)
        self._law, self._shear = law, shear_stiffness
        self.elastic = np.array(
            [law.young * section.area, shear_stiffness, law.young * section.second_moment]
        )
        # N, M and their tangents are sums over fibres of stress and modulus times these
        heights, areas = self._heights, self._areas
        self._moments = np.stack([areas, -areas * heights, areas * heights**2], axis=-1)

    @property
    def plastic_moment(self) -> float:
        """Moment in N·m at which all fibres have just reached the first yield stress."""
        return float(self._law.hardening.yield_stress * (self._areas * np.abs(self._heights)).sum())

    def rest(self, shape: tuple[int, ...]) -> PlasticFibres:
        """Virgin fibres of sections of the given shape."""
        return self._law.rest((*shape, self._heights.size))

    def answer(self, strain: np.ndarray, internal: PlasticFibres, dt: float | None) -> SectionAnswer:
        """Answer to strains (..., 3); yielding knows no time."""
        axial, shear, curvature = np.moveaxis(strain, -1, 0)
        fibre = axial[..., None] - curvature[..., None] * self._heights
        stress, modulus, energy, after = self._law.stress(fibre, internal)
        normal, moment, _ = np.moveaxis(stress @ self._moments, -1, 0)
        stretch, coupling, bend = np.moveaxis(modulus @ self._moments, -1, 0)
        force = np.stack([normal, self._shear * shear, moment], axis=-1)
        tangent = np.zeros((*strain.shape, 3))
        tangent[..., 0, 0], tangent[..., 2, 2], tangent[..., 1, 1] = stretch, bend, self._shear
        tangent[..., 0, 2] = tangent[..., 2, 0] = coupling
        return SectionAnswer(energy @ self._areas + self._shear * shear**2 / 2, force, tangent, after)

    def stored(self, strain: np.ndarray, internal: PlasticFibres) -> np.ndarray:
        """Elastic energy in J/m."""
        axial, shear, curvature = np.moveaxis(strain, -1, 0)
        fibre = axial[..., None] - curvature[..., None] * self._heights - internal.strain
        stored: np.ndarray = (self._law.young * fibre**2 @ self._areas + self._shear * shear**2) / 2
        return stored

    def dissipated(self, before: PlasticFibres, after: PlasticFibres, dt: float | None) -> np.ndarray:
        """Plastic work of the step in J/m."""
        work = self._law.hardening.work
        spent: np.ndarray = (work(after.accumulated) - work(before.accumulated)) @ self._areas
        return spent
