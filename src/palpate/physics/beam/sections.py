"""Which law a beam's sections follow: decided by its material."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, Protocol

from palpate.physics.materials.linear import LinearElastic

if TYPE_CHECKING:
    from palpate.physics.beam.cantilever import Cantilever
    from palpate.physics.beam.reissner import Stiffness
    from palpate.physics.beam.resultants import SectionLaw

__all__ = ["BeamMaterial", "Kind", "kind_of", "law_of", "stiffness_of"]

Kind = Literal["elastic", "plastic", "viscous"]


class BeamMaterial(Protocol):
    """What a beam asks of its material; one that yields has a `hardening` too, one that creeps a `prony`."""

    @property
    def name(self) -> str:
        """What it is called."""

    @property
    def young(self) -> float:
        """Young's modulus in Pa, the instantaneous one."""

    @property
    def poisson(self) -> float:
        """Poisson's ratio."""

    @property
    def shear_modulus(self) -> float:
        """G in Pa, the instantaneous one."""

    @property
    def density(self) -> float:
        """In kg/m³."""


def kind_of(material: Any) -> Kind | None:
    """How a beam of this material answers; None for what is no beam's material."""
    if isinstance(material, LinearElastic):
        return "elastic"
    if not all(hasattr(material, name) for name in ("young", "poisson", "shear_modulus", "density")):
        return None
    if hasattr(material, "hardening"):
        return "plastic"
    creeps = hasattr(material, "prony") and isinstance(getattr(material, "base", None), LinearElastic)
    return "viscous" if creeps else None


def stiffness_of(body: Cantilever) -> Stiffness:
    """Elastic (instantaneous) stiffnesses of the section."""
    from palpate.physics.beam.reissner import Stiffness  # brings SciPy: only for those who solve

    material, section = body.material, body.section
    return Stiffness(
        axial=material.young * section.area,
        shear=section.shear_factor(material.poisson) * material.shear_modulus * section.area,
        bending=material.young * section.second_moment,
    )


def law_of(body: Cantilever) -> SectionLaw:
    """The section law of a beam that remembers."""
    from palpate.physics.beam.plastic_section import PlasticSection
    from palpate.physics.beam.viscous_section import ViscousSection
    from palpate.physics.materials.uniaxial import UniaxialPlastic

    stiffness, material = stiffness_of(body), body.material
    if body.kind == "plastic":
        fibre = UniaxialPlastic(material.young, material.hardening)  # type: ignore[attr-defined]
        return PlasticSection(body.section, fibre, stiffness.shear, body.fibre_count)  # type: ignore[arg-type]
    return ViscousSection(stiffness, material.prony)  # type: ignore[attr-defined]
