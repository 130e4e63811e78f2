"""Strains and stresses of a state at the quadrature points and at the nodes."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.physics.solid.solid_energy import cauchy_stress, deformation_gradient, mixed_density, volume_rule
from palpate.physics.solid.solid_field import CORNERS, MIDDLES

if TYPE_CHECKING:
    from palpate.physics.materials.material import Material
    from palpate.physics.solid.solid_energy import History
    from palpate.physics.solid.solid_field import SolidField

__all__ = ["Measures"]


class Measures:
    """Strains and stresses of the state that a field shows, with materials and internal variables by region."""

    def __init__(
        self, field: SolidField, materials: Mapping[str, Material], histories: Mapping[str, History]
    ) -> None:
        self._field, self._materials, self._histories = field, dict(materials), dict(histories)
        self.volume = field.rest.volume
        self.shear_modulus = min(material.shear_modulus for material in materials.values())
        self._gradient = deformation_gradient(field.displacement)

    def least_volume_ratio(self) -> float:
        """Return the least det F at the quadrature points, corners and middles of edges of all elements."""
        gradients = [self._gradients(large=large) for large in (True, False)]
        # F varies linearly over an element of second order: its corners turn over first
        gradients.append(self._at(self._field.mesh.Materials(".*"), _corners_and_middles()))
        return float(min(np.linalg.det(each).min(initial=np.inf) for each in gradients))

    def largest_small_strain(self) -> float:
        """Largest |ε| of a principal strain at the quadrature points of regions of small strain; 0 without any."""
        strains = _principal_strains(self._gradients(large=False))
        return float(np.abs(strains).max(initial=0.0))

    def largest_strain(self) -> float:
        """Largest |λ - 1| of a principal stretch λ at the quadrature points; at small strain, of a principal strain."""
        large, small = self._gradients(large=True), self._gradients(large=False)
        squares = np.linalg.eigvalsh(np.swapaxes(large, 1, 2) @ large)
        both = np.concatenate([np.sqrt(np.maximum(squares, 0)) - 1, _principal_strains(small)])
        return float(np.abs(both).max())

    def stored_energy(self) -> float:
        """Return the free energy in J, with the internal variables as they are; every history must know its density."""
        import ngsolve

        total = 0.0
        for region, material in self._materials.items():
            history = self._histories.get(region)
            rules = {ngsolve.ET.TET: volume_rule(self._field, material)}
            if history is None:
                density = self._density(region, material)
            else:
                density, rules = history.stored, history.rules
            symbol = ngsolve.dx(definedon=self._field.region(region), intrules=rules)
            total += ngsolve.Integrate(density * symbol, self._field.mesh)
        return float(total)

    def _density(self, region: str, material: Material) -> Any:
        """Return the energy density in J/m³ of the state under inspection, of a material without a history."""
        pressure = self._field.pressure.get(region)
        if pressure is None:
            return material.energy(self._gradient)
        return mixed_density(material, self._gradient, pressure)

    def at_nodes(self) -> dict[str, np.ndarray]:
        """Return all fields at the nodes, by their names in a solution."""
        return {
            "stress": self.stress(),
            "von_mises": self.von_mises(),
            "largest_stretch": self.largest_stretch(),
        }

    def von_mises(self) -> np.ndarray:
        """Return von Mises' equivalent of the Cauchy stress in Pa at the nodes, shape (node,)."""
        import ngsolve

        def equivalent(stress: Any) -> Any:
            deviator = stress - ngsolve.Trace(stress) / 3 * ngsolve.Id(3)
            return ngsolve.sqrt(1.5 * ngsolve.InnerProduct(deviator, deviator))

        stresses = self._stresses()
        projected = self._at_nodes(
            {region: equivalent(stress).Compile() for region, stress in stresses.items()}
        )
        # a projection undershoots beside a steep peak; an equivalent stress is not negative
        return np.asarray(np.maximum(projected, 0.0))

    def stress(self) -> np.ndarray:
        """Return the Cauchy stress in Pa at the nodes, shape (node, 3, 3)."""
        stresses = self._stresses()
        result = np.empty((len(self._field.rest.points), 3, 3))
        for i, j in itertools.combinations_with_replacement(range(3), 2):
            component = {region: stress[i, j].Compile() for region, stress in stresses.items()}
            result[:, i, j] = result[:, j, i] = self._at_nodes(component)
        return result

    def _stresses(self) -> dict[str, Any]:
        """Return the Cauchy stress of each region, a coefficient function (3, 3)."""
        return {
            region: cauchy_stress(self._field, region, material, self._histories.get(region))
            for region, material in self._materials.items()
        }

    def largest_stretch(self) -> np.ndarray:
        """Return the largest principal stretch at the nodes, shape (node,)."""
        gradients = np.stack(
            [
                self._at_nodes(dict.fromkeys(self._materials, self._gradient[i, j]))
                for i in range(3)
                for j in range(3)
            ],
            axis=1,
        ).reshape(-1, 3, 3)
        squares = np.linalg.eigvalsh(np.swapaxes(gradients, 1, 2) @ gradients)
        return np.asarray(np.sqrt(squares[:, -1]))

    def _gradients(self, *, large: bool) -> np.ndarray:
        """Return F at the quadrature points of all regions of large or of small strain, shape (N, 3, 3)."""
        gradients = [np.empty((0, 3, 3))]
        for region, material in self._materials.items():
            if (material.kinematics == "large") == large:
                gradients.append(self._at(self._field.region(region), volume_rule(self._field, material)))
        return np.concatenate(gradients)

    def _at(self, region: Any, rule: Any) -> np.ndarray:
        """Return F at the points of a rule in all elements of a region, shape (N, 3, 3)."""
        return np.asarray(self._gradient(self._field.mesh.MapToAllElements(rule, region))).reshape(-1, 3, 3)

    def _at_nodes(self, values: Mapping[str, Any]) -> np.ndarray:
        """Return a field given by region, averaged over the elements around each node, shape (node,)."""
        import ngsolve

        image = ngsolve.GridFunction(ngsolve.H1(self._field.mesh, order=1))
        image.Set(self._field.mesh.MaterialCF(dict(values)))
        return np.array(image.vec.FV().NumPy())


def _corners_and_middles() -> Any:
    """Return the nodes of a tetrahedron of second order as points to look at."""
    import ngsolve

    points = [tuple(point) for point in np.vstack([CORNERS, MIDDLES]).tolist()]
    return ngsolve.IntegrationRule(points, [1.0] * len(points))


def _principal_strains(gradients: np.ndarray) -> np.ndarray:
    """Return eigenvalues (N, 3) of ε = sym(F - I) for F (N, 3, 3)."""
    return np.linalg.eigvalsh((gradients + np.swapaxes(gradients, 1, 2)) / 2) - 1
