"""The energy of the material, region by region, and what is measured of it.

Displacement form: ∫ W(F) dV. Mixed form, where the volumetric part of W is ½ κ θ(F)²: that part is replaced by

    ∫ p θ(F) - p²/(2κ) dV,

stationary in p at p = κ θ(F); between displacements of second and pressures of first order it does not lock as
κ grows, and it has a limit for κ → ∞ (Herrmann 1965, AIAA J. 3, 1896-1900; Sussman & Bathe 1987, Comput. Struct.
26, 357-409).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from palpate.physics.interactions.interaction import BEYOND, Energy

if TYPE_CHECKING:
    from palpate.physics.materials.material import Material
    from palpate.physics.solid.field import SolidField
    from palpate.physics.solid.history import History

__all__ = [
    "cauchy_stress",
    "deformation_gradient",
    "material_energies",
    "mixed_density",
    "stored_density",
]


def deformation_gradient(displacement: Any) -> Any:
    """F = I + ∂u/∂X as a coefficient function."""
    import ngsolve

    return ngsolve.Id(3) + ngsolve.Grad(displacement)


def material_energies(
    field: SolidField, materials: Mapping[str, Material], histories: Mapping[str, History]
) -> list[Energy]:
    """Energy of each region; beyond all bounds where an element is turned inside out."""
    return [
        _region_energy(field, region, material, histories.get(region))
        for region, material in materials.items()
    ]


def _region_energy(field: SolidField, region: str, material: Material, history: History | None) -> Energy:
    import ngsolve

    F = deformation_gradient(field.trial)
    past = history.arguments if history else ()
    if region in field.pressure_trial:
        density = mixed_density(material, F, field.pressure_trial[region], past)
    else:
        density = material.energy(F, *past)
    if material.kinematics == "large":
        density = density + ngsolve.IfPos(ngsolve.Det(F), 0, BEYOND)
    rules = history.rules if history else {ngsolve.ET.TET: volume_rule(field, material)}
    return Energy(density, ngsolve.dx(definedon=field.region(region), intrules=rules))


def rule_order(field: SolidField, material: Material) -> int:
    """Order to which a material's energy is integrated.

    Small strain: exact for products of two strains. Large strain: two orders more, as under a probe an element may turn
    over in a corner while det F stays well above zero at the few points of the lower rule.
    """
    return 2 * field.order if material.kinematics == "large" else 2 * (field.order - 1)


def volume_rule(field: SolidField, material: Material) -> Any:
    """Quadrature of a material's energy in a tetrahedron."""
    import ngsolve

    return ngsolve.IntegrationRule(ngsolve.ET.TET, rule_order(field, material))


def mixed_density(material: Material, F: Any, pressure: Any, past: tuple[Any, ...] = ()) -> Any:
    """Distortion and p θ(F) - p²/(2κ), in J/m³."""
    return material.distortion(F, *past) + _volumetric_density(material, F, pressure)


def stored_density(field: SolidField, region: str, material: Material, state: Mapping[str, Any]) -> Any:
    """Free energy in J/m³ of the state under inspection with internal variables, None where the law tells none."""
    F = deformation_gradient(field.displacement)
    pressure = field.pressure.get(region)
    stored = getattr(material, "stored" if pressure is None else "stored_distortion", None)
    if stored is None or pressure is None:
        return stored and stored(F, state)
    return stored(F, state) + _volumetric_density(material, F, pressure)


def _volumetric_density(material: Material, F: Any, pressure: Any) -> Any:
    """p θ(F) - p²/(2κ) in J/m³; at p = κ θ(F) it is ½ κ θ(F)²."""
    volumetric = material.volumetric
    assert volumetric is not None  # `Body` lets no other material go mixed
    density = pressure * volumetric.measure(F)
    return density if math.isinf(volumetric.modulus) else density - pressure**2 / (2 * volumetric.modulus)


def cauchy_stress(field: SolidField, region: str, material: Material, history: History | None) -> Any:
    """σ = P Fᵀ / det F in Pa of the state under inspection; at small strain σ = P."""
    import ngsolve

    F = deformation_gradient(field.displacement).MakeVariable()
    past = history.arguments if history else ()
    if region in field.pressure:
        density = mixed_density(material, F, field.pressure[region], past)
    else:
        density = material.energy(F, *past)
    nominal = density.Diff(F)
    if material.kinematics == "small":
        return nominal
    return nominal * F.trans / ngsolve.Det(F)
