"""Section laws: the section forces that belong to the strains of a beam.

A section law turns axial strain ε, shear strain γ and curvature κ at the end of a step into the forces N, Q and the
moment M. They are the derivative of an incremental energy per length, so that the equilibrium is a minimum whatever
the law. There are three:

elastic   EA, kGA and EI; no memory
plastic   plane sections stay plane: the fibre at the height y above the centre line is strained by ε - y κ and follows
          one-dimensional plasticity. The shear force stays elastic, as a slender beam's shear stresses are far below
          yield.
viscous   stretching, shear and bending relax by one Prony series, so Poisson's ratio stays what it is. The section
          forces are those of `UniaxialViscoelastic` with EA, kGA and EI in the modulus' place: exact for strains that
          grow evenly over a step, and so for constant ones whatever the step.

The material decides which law a beam follows.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol

import numpy as np

from palpate.physics.beam.cross_section import FibreSection
from palpate.physics.materials.linear import LinearElastic
from palpate.physics.materials.prony import PronySeries
from palpate.physics.materials.uniaxial import (
    PlasticFibres,
    UniaxialPlastic,
    UniaxialViscoelastic,
    ViscousFibres,
)

if TYPE_CHECKING:
    from palpate.physics.beam.cantilever import Cantilever

__all__ = [
    "ElasticSection",
    "Kind",
    "PlasticSection",
    "SectionAnswer",
    "SectionLaw",
    "ViscousSection",
    "elastic_stiffness",
    "material_kind",
    "section_law",
]

Kind = Literal["elastic", "plastic", "viscous"]
SHORT = 1e-3  # steps below this share of a relaxation time: the overstress changes as good as evenly


class SectionAnswer(NamedTuple):
    """Answer of sections to strains at the end of a step."""

    energy: np.ndarray  # (...) incremental energy, J/m
    force: np.ndarray  # (..., 3) N and Q in N, M in N·m
    tangent: np.ndarray  # (..., 3, 3) derivatives of the force by the strains, or one (3, 3) for all
    internal: Any  # internal variables at the end of the step; None without memory


class SectionLaw(Protocol):
    """The methods that the beam element needs of a section law."""

    elastic: np.ndarray
    """Elastic (instantaneous) stiffnesses EA and kGA in N, EI in N·m²: shape (3,)."""

    shift: np.ndarray
    """Stiffnesses (3,) that are added, times a factor, where a tangent is indefinite: those that the beam may lack."""

    quadratic: bool
    """Whether the incremental energy is quadratic in the strains."""

    def rest(self, shape: tuple[int, ...]) -> Any:
        """Return the internal variables of virgin sections."""

    def answer(self, strain: np.ndarray, internal: Any, dt: float | None) -> SectionAnswer:
        """Return the answer to strains (..., 3) after a step of dt seconds from `internal`; None is an instant."""

    def stored_energy(self, strain: np.ndarray, internal: Any) -> np.ndarray:
        """Return the energy in J/m that can be had back."""

    def dissipated_energy(self, before: Any, after: Any, dt: float | None) -> np.ndarray:
        """Return the energy in J/m that a step took for good, not negative."""


class ElasticSection:
    """A section of constant stiffnesses (3,): EA and kGA in N, EI in N·m² (a `SectionLaw`)."""

    quadratic = True

    def __init__(self, stiffness: np.ndarray) -> None:
        self.elastic = np.asarray(stiffness, dtype=float)
        # a buckled beam is short of bending stiffness only
        self.shift = self.elastic * (0.0, 0.0, 1.0)
        self._tangent = np.diag(self.elastic)

    def rest(self, shape: tuple[int, ...]) -> None:
        """Return None: the section has no internal variables."""

    def answer(self, strain: np.ndarray, internal: None, dt: float | None) -> SectionAnswer:
        """Return the answer to strains (..., 3), whatever came before."""
        return SectionAnswer(self.stored_energy(strain, internal), strain * self.elastic, self._tangent, None)

    def stored_energy(self, strain: np.ndarray, internal: None) -> np.ndarray:
        """Return the elastic energy in J/m."""
        energy: np.ndarray = strain**2 @ self.elastic / 2
        return energy

    def dissipated_energy(self, before: None, after: None, dt: float | None) -> np.ndarray:
        """Return zero: nothing is lost."""
        return np.zeros(())


class PlasticSection:
    """A section that is cut into layers of elastoplastic fibres across its height (a `SectionLaw`).

    The law gives the stress of each fibre; the shear stiffness kGA in N stays elastic.
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
        # a section that has yielded is short of axial and bending stiffness
        self.shift = self.elastic
        # N, M and their tangents are sums over fibres of stress and modulus times these
        heights, areas = self._heights, self._areas
        self._moments = np.stack([areas, -areas * heights, areas * heights**2], axis=-1)

    @property
    def plastic_moment(self) -> float:
        """Moment in N·m at which all fibres have just reached the first yield stress."""
        return float(self._law.hardening.yield_stress * (self._areas * np.abs(self._heights)).sum())

    def rest(self, shape: tuple[int, ...]) -> PlasticFibres:
        """Return virgin fibres of sections of the given shape."""
        return self._law.rest((*shape, self._heights.size))

    def answer(self, strain: np.ndarray, internal: PlasticFibres, dt: float | None) -> SectionAnswer:
        """Return the answer to strains (..., 3); yielding knows no time."""
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

    def stored_energy(self, strain: np.ndarray, internal: PlasticFibres) -> np.ndarray:
        """Return the elastic energy in J/m."""
        axial, shear, curvature = np.moveaxis(strain, -1, 0)
        fibre = axial[..., None] - curvature[..., None] * self._heights - internal.strain
        stored: np.ndarray = (self._law.young * fibre**2 @ self._areas + self._shear * shear**2) / 2
        return stored

    def dissipated_energy(self, before: PlasticFibres, after: PlasticFibres, dt: float | None) -> np.ndarray:
        """Return the plastic work of the step in J/m."""
        work = self._law.hardening.work
        spent: np.ndarray = (work(after.accumulated) - work(before.accumulated)) @ self._areas
        return spent


class ViscousSection:
    """A section whose instantaneous stiffnesses (3,), EA and kGA in N, EI in N·m², relax together (a `SectionLaw`)."""

    quadratic = True

    def __init__(self, stiffness: np.ndarray, prony: PronySeries) -> None:
        self.elastic = self.shift = np.asarray(stiffness, dtype=float)
        self._prony = prony
        # of unit modulus: its "stresses" are strains, its "overstresses" shares of strains
        self._law = UniaxialViscoelastic(1.0, prony)

    def rest(self, shape: tuple[int, ...]) -> ViscousFibres:
        """Return relaxed sections of the given shape, without strain."""
        return self._law.rest((*shape, 3))

    def answer(self, strain: np.ndarray, internal: ViscousFibres, dt: float | None) -> SectionAnswer:
        """Return the answer to strains (..., 3) that grew evenly over the step."""
        share, modulus, energy, after = self._law.stress(strain, internal, dt)
        tangent = np.zeros((*strain.shape, 3))
        diagonal = np.arange(3)
        tangent[..., diagonal, diagonal] = modulus * self.elastic
        # a constant: the scale by which the search judges what is small must not vanish where the load does
        begun = self.stored_energy(internal.stress, internal)
        return SectionAnswer(energy @ self.elastic + begun, share * self.elastic, tangent, after)

    def stored_energy(self, strain: np.ndarray, internal: ViscousFibres) -> np.ndarray:
        """Return the energy of the springs in J/m."""
        shares = np.array(self._prony.shares).reshape(-1, *[1] * strain.ndim)
        springs = self._prony.equilibrium * strain**2 + (internal.overstress**2 / shares).sum(axis=0)
        result: np.ndarray = springs @ self.elastic / 2
        return result

    def dissipated_energy(self, before: ViscousFibres, after: ViscousFibres, dt: float | None) -> np.ndarray:
        """Return the loss of the dashpots in a step of dt seconds, in J/m: ∫ q²/(γ τ) dt for each term."""
        spent = np.zeros(before.stress.shape)
        grown = after.stress - before.stress
        for (share, time), start, end in zip(
            self._prony.terms, before.overstress, after.overstress, strict=True
        ):
            spent += _squared_decay(start, end, share * grown, (dt or 0.0) / time) / share
        result: np.ndarray = spent @ self.elastic
        return result


def material_kind(material: Any) -> Kind | None:
    """Return the kind of section law that a beam of this material follows; None for what is no beam's material."""
    if isinstance(material, LinearElastic):
        return "elastic"
    if not all(hasattr(material, name) for name in ("young", "poisson", "shear_modulus", "density")):
        return None
    if hasattr(material, "hardening"):
        return "plastic"
    creeps = hasattr(material, "prony") and isinstance(getattr(material, "base", None), LinearElastic)
    return "viscous" if creeps else None


def elastic_stiffness(body: Cantilever) -> np.ndarray:
    """Return the elastic (instantaneous) EA and kGA in N and EI in N·m² of a beam's section, shape (3,)."""
    material, section = body.material, body.section
    shear_factor = section.shear_factor(material.poisson)
    return np.array(
        [
            material.young * section.area,
            shear_factor * material.shear_modulus * section.area,
            material.young * section.second_moment,
        ]
    )


def section_law(body: Cantilever) -> SectionLaw:
    """Return the section law of a beam, which its material decides."""
    stiffness, material = elastic_stiffness(body), body.material
    if body.kind == "elastic":
        return ElasticSection(stiffness)
    if body.kind == "plastic":
        fibre = UniaxialPlastic(material.young, material.hardening)  # type: ignore[attr-defined]
        return PlasticSection(body.section, fibre, float(stiffness[1]), body.fibre_count)  # type: ignore[arg-type]
    return ViscousSection(stiffness, material.prony)  # type: ignore[attr-defined]


def _squared_decay(start: np.ndarray, end: np.ndarray, grown: np.ndarray, ratio: float) -> np.ndarray:
    """Return ∫ q² ds over 0 … ratio, for q' = grown/ratio - q from `start` to `end`."""
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
