"""Internal variables of one region, kept at the quadrature points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.physics.solid.density import deformation_gradient, rule_order, stored_density

if TYPE_CHECKING:
    from palpate.physics.materials.material import Material
    from palpate.physics.solid.field import SolidField

__all__ = ["History"]


class History:
    """The state of a material with a history, at the points at which its energy is integrated.

    Parameters
    ----------
    field : SolidField
    region : str
    material : Material
    step : ngsolve.Parameter
        Length of the time step in s.

    Attributes
    ----------
    arguments : tuple
        State and time step, as the material's energy takes them.
    rules : mapping
        The quadrature, by element type.
    stored : ngsolve.CoefficientFunction or None
        Free energy density in J/m³ with the present state, where the law tells it.
    """

    def __init__(self, field: SolidField, region: str, material: Material, step: Any) -> None:
        import ngsolve
        from ngsolve.comp import IntegrationRuleSpace

        # its rule is exact to twice the order given here
        points = IntegrationRuleSpace(field.mesh, order=rule_order(field, material) // 2)
        self._region = field.region(region)
        self._variables = material.states
        spaces = {v.name: ngsolve.MatrixValued(points) if v.shape else points for v in self._variables}
        self._values = {name: ngsolve.GridFunction(space) for name, space in spaces.items()}
        self._next = {name: ngsolve.GridFunction(space) for name, space in spaces.items()}
        self.rules = points.GetIntegrationRules()
        known = (dict(self._values), step)
        self._advance = material.advance(deformation_gradient(field.displacement), *known)
        # what a law can make of its state before a step is kept too, instead of evaluated in each iteration
        prepare = getattr(material, "prepare", None)
        self._recipes = prepare(*known) if prepare is not None else {}
        self._prepared = {
            name: ngsolve.GridFunction(ngsolve.MatrixValued(points) if value.dim == 9 else points)
            for name, value in self._recipes.items()
        }
        self.arguments = (dict(self._prepared), step) if self._recipes else known
        self.stored = stored_density(field, region, material, dict(self._values))
        self.reset()

    def reset(self) -> None:
        """Back to the undeformed body."""
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
        """Copies of all values."""
        return {name: np.array(value.vec.FV().NumPy()) for name, value in self._values.items()}

    def restore(self, snapshot: dict[str, np.ndarray]) -> None:
        """Put former values back."""
        for name, values in snapshot.items():
            self._values[name].vec.FV().NumPy()[:] = values
