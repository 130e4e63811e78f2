"""The energy of the materials, region by region, and their internal variables.

Displacement form: ∫ W(F) dV. Mixed form, where the volumetric part of W is ½ κ θ(F)²: that part is replaced by

    ∫ p θ(F) - p²/(2κ) dV,

stationary in p at p = κ θ(F); between displacements of second and pressures of first order it does not lock as
κ grows, and it has a limit for κ → ∞ (Herrmann 1965, AIAA J. 3, 1896-1900; Sussman & Bathe 1987, Comput. Struct.
26, 357-409). The internal variables of a material with a history are kept at the quadrature points.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.physics.interactions.interaction import BEYOND, Energy

if TYPE_CHECKING:
    from palpate.physics.materials.material import Material
    from palpate.physics.solid.solid_field import SolidField

__all__ = [
    "History",
    "cauchy_stress",
    "deformation_gradient",
    "material_energies",
    "mixed_density",
    "stored_density",
    "volume_rule",
]


def deformation_gradient(displacement: Any) -> Any:
    """Return F = I + ∂u/∂X as a coefficient function."""
    import ngsolve

    return ngsolve.Id(3) + ngsolve.Grad(displacement)


def material_energies(
    field: SolidField, materials: Mapping[str, Material], histories: Mapping[str, History]
) -> list[Energy]:
    """Return the energy of each region; beyond all bounds where an element is turned inside out."""
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


def _rule_order(field: SolidField, material: Material) -> int:
    """Return the order to which a material's energy is integrated.

    Small strain: exact for products of two strains. Large strain: two orders more, as under a probe an element may turn
    over in a corner while det F stays well above zero at the few points of the lower rule. A law that varies in space
    asks for more by its `quadrature`.
    """
    order = 2 * field.order if material.kinematics == "large" else 2 * (field.order - 1)
    return order + int(getattr(material, "quadrature", 0))


def volume_rule(field: SolidField, material: Material) -> Any:
    """Return the quadrature of a material's energy in a tetrahedron."""
    import ngsolve

    return ngsolve.IntegrationRule(ngsolve.ET.TET, _rule_order(field, material))


def mixed_density(material: Material, F: Any, pressure: Any, past: tuple[Any, ...] = ()) -> Any:
    """Return distortion and p θ(F) - p²/(2κ), in J/m³."""
    return material.distortion(F, *past) + _volumetric_density(material, F, pressure)


def stored_density(field: SolidField, region: str, material: Material, state: Mapping[str, Any]) -> Any:
    """Return the free energy in J/m³ of the state under inspection; None where the law does not know it."""
    F = deformation_gradient(field.displacement)
    pressure = field.pressure.get(region)
    stored = getattr(material, "stored_energy" if pressure is None else "stored_distortion", None)
    if stored is None or pressure is None:
        return stored and stored(F, state)
    return stored(F, state) + _volumetric_density(material, F, pressure)


def _volumetric_density(material: Material, F: Any, pressure: Any) -> Any:
    """Return p θ(F) - p²/(2κ) in J/m³; at p = κ θ(F) it is ½ κ θ(F)²."""
    volumetric = material.volumetric
    assert volumetric is not None  # `Body` lets no other material go mixed
    return volumetric.mixed(F, pressure)


def cauchy_stress(field: SolidField, region: str, material: Material, history: History | None) -> Any:
    """Return σ = P Fᵀ / det F in Pa of the state under inspection; at small strain σ = P."""
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


class History:
    """The state of a material with a history, at the points at which its energy is integrated.

    `step` is the length of the time step in s, an NGSolve parameter. `arguments` are the state and the time step as the
    material's energy takes them, `rules` the quadrature by element type, and `stored` is the free energy density in
    J/m³ with the present state, None where the law does not know it.
    """

    def __init__(self, field: SolidField, region: str, material: Material, step: Any) -> None:
        import ngsolve
        from ngsolve.comp import IntegrationRuleSpace

        # its rule is exact to twice the order given here
        points = IntegrationRuleSpace(field.mesh, order=_rule_order(field, material) // 2)
        self._region = field.region(region)
        self._variables = material.states
        spaces = {v.name: ngsolve.MatrixValued(points) if v.shape else points for v in self._variables}
        self._values = {name: ngsolve.GridFunction(space) for name, space in spaces.items()}
        self._next = {name: ngsolve.GridFunction(space) for name, space in spaces.items()}
        self.rules = points.GetIntegrationRules()
        before = (dict(self._values), step)
        self._advance = material.advance(deformation_gradient(field.displacement), *before)
        # what a law can make of its state before a step is kept too, instead of evaluated in each iteration
        prepare = getattr(material, "prepare", None)
        self._recipes = prepare(*before) if prepare is not None else {}
        self._prepared = {
            name: ngsolve.GridFunction(ngsolve.MatrixValued(points) if value.dim == 9 else points)
            for name, value in self._recipes.items()
        }
        self.arguments = (dict(self._prepared), step) if self._recipes else before
        self.stored = stored_density(field, region, material, dict(self._values))
        self.reset()

    def reset(self) -> None:
        """Go back to the undeformed body."""
        import ngsolve

        for variable in self._variables:
            initial = tuple(np.ravel(variable.initial).tolist())
            value = ngsolve.CF(initial, dims=variable.shape) if variable.shape else ngsolve.CF(initial[0])
            self._values[variable.name].Interpolate(value, definedon=self._region)

    def begin(self) -> None:
        """Get ready for a step of the present length."""
        for name, value in self._recipes.items():
            self._prepared[name].Interpolate(value, definedon=self._region)

    def advance(self) -> None:
        """Take over the internal variables at the end of the step that led to the field's displacement."""
        for name, value in self._advance.items():  # all from the old values, before any is replaced
            self._next[name].Interpolate(value, definedon=self._region)
        for name in self._advance:
            self._values[name].vec.data = self._next[name].vec

    def snapshot(self) -> dict[str, np.ndarray]:
        """Return copies of all values."""
        return {name: np.array(value.vec.FV().NumPy()) for name, value in self._values.items()}

    def restore(self, snapshot: dict[str, np.ndarray]) -> None:
        """Put former values back."""
        for name, values in snapshot.items():
            self._values[name].vec.FV().NumPy()[:] = values
