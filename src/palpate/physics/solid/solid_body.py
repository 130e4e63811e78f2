"""A solid body: its shape, materials, supports and constant loads."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args

from palpate import checks
from palpate.errors import UsageError
from palpate.format import number
from palpate.physics.advice import advise_on_modulus
from palpate.physics.interactions.interaction import Fixed, Interaction
from palpate.physics.solid.solid_checks import (
    by_region,
    require_geometry,
    require_held_values,
    require_order,
    require_weight,
    surfaces_of,
)

if TYPE_CHECKING:
    from palpate.physics.materials.material import Material
    from palpate.physics.shapes.shape import Geometry
    from palpate.physics.solid.solid_problem import SolidProblem

__all__ = ["Body", "Formulation"]

Formulation = Literal["auto", "displacement", "mixed"]
# From here on displacements of second order give a contact force more than 1 % too large on meshes of usual
# size; a region that goes mixed needlessly costs a tenth more unknowns and twice the assembly.
NEARLY_INCOMPRESSIBLE = 0.48
DEARER = 2  # times a solve of the mixed form takes, told beforehand: docs/method/solids.md has the figures


@dataclass(frozen=True)
class Body:
    """A solid body.

    A plain value: it can be compared, hashed, pickled and sent to another process.

    Attributes
    ----------
    geometry : Geometry
        Shape of the body at rest.
    material : Material or {region: Material}
        One material for all regions, or one for each; kept as a tuple of (region, material) in the order of the
        geometry's regions.
    fixed : str or tuple of str
        Surfaces whose displacement is zero.
    gravity : (3,) tuple
        Acceleration in m/s² that acts on the material's density.
    held : tuple of Fixed
        Constant interactions, with their inputs: pre-stress, and supports that slide (`roller`).
    formulation : {"auto", "displacement", "mixed"}
        ``"auto"`` takes the mixed form in regions whose initial Poisson's ratio is 0.48 or more and whose
        material has a separate volumetric energy; `describe` and `formulation_of` tell which.
    order : int
        Polynomial order of the displacement, at least 2.
    strain_limit : float
        Largest principal strain up to which laws of small strain (linear elastic, plastic) are asked; states beyond
        it are refused. Their own error is of the order of the strain.
    step_error : float
        For materials with a history: error in time of the response that a load step may make, over the largest
        response. Steps adapt to it; with ``math.inf`` each is taken as given.

    Raises
    ------
    UsageError
        For what is no geometry or no material, names that the geometry does not have, regions without a material,
        gravity on a material without a density, or a formulation that the material does not allow.
    """

    geometry: Geometry
    material: Any
    fixed: Any = "bottom"
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    held: tuple[Fixed, ...] = ()
    formulation: Formulation = "auto"
    order: int = 2
    strain_limit: float = 0.5
    step_error: float = 1e-3

    def __post_init__(self) -> None:
        require_geometry(self.geometry)
        object.__setattr__(self, "fixed", surfaces_of(self.fixed, self.geometry))
        object.__setattr__(self, "held", require_held_values(self.held))
        object.__setattr__(self, "gravity", checks.triple("Gravity", self.gravity, "m/s²"))
        object.__setattr__(self, "material", by_region(self.material, self.geometry.regions))
        if any(self.gravity):
            require_weight(self.materials)
        require_order(self.order)
        checks.one_of("The formulation of a body", self.formulation, get_args(Formulation))
        checks.positive("The strain limit of a body", self.strain_limit, "")
        checks.positive("The error of a step", self.step_error, "", infinite=True)
        for region, material in self.materials.items():
            self.formulation_of(region)
            advise_on_modulus(f"in the region {region!r}", material)

    @property
    def materials(self) -> dict[str, Material]:
        """Material of each region."""
        return dict(self.material)

    @property
    def has_history(self) -> bool:
        """True where the answer depends on what was before: some material has internal variables."""
        return any(material.states for material in self.materials.values())

    def formulation_of(self, region: str) -> tuple[Literal["displacement", "mixed"], str]:
        """Return the form of a region, and why.

        Raises
        ------
        UsageError
            If the form asked for does not exist for the material.
        """
        material = self.materials[region]
        nu, volumetric = material.poisson, material.volumetric
        if self.formulation == "mixed" and volumetric is None:
            raise _no_mixed_form(material)
        if volumetric is not None and math.isinf(volumetric.modulus):
            if self.formulation == "displacement":
                raise _incompressible(material)
            return "mixed", "the material is incompressible"
        if self.formulation != "auto":
            return self.formulation, "as asked for"
        if volumetric is None:
            return "displacement", "the material has no separate volumetric energy"
        if nu >= NEARLY_INCOMPRESSIBLE:
            return "mixed", f"Poisson's ratio {nu:.4g} is {NEARLY_INCOMPRESSIBLE} or more"
        return "displacement", f"Poisson's ratio {nu:.4g} is less than {NEARLY_INCOMPRESSIBLE}"

    @property
    def mixed_regions(self) -> tuple[str, ...]:
        """Regions of mixed form."""
        return tuple(region for region in self.materials if self.formulation_of(region)[0] == "mixed")

    def describe(self) -> dict[str, Any]:
        """Return everything that decides the answers, as plain data for a JSON file."""
        return {
            "type": "Body",
            "geometry": self.geometry.describe(),
            "material": {region: material.describe() for region, material in self.material},
            "fixed": list(self.fixed),
            "gravity": list(self.gravity),
            "held": [{**held.interaction.describe(), "values": list(held.values)} for held in self.held],
            "formulation": {region: list(self.formulation_of(region)) for region in self.materials},
            "order": self.order,
            "strain_limit": self.strain_limit,
            "step_error": self.step_error if math.isfinite(self.step_error) else None,
        }

    def __str__(self) -> str:
        lines = [f"Body of {self.geometry}, fixed at {', '.join(self.fixed) or 'nothing'}"]
        for region, material in self.material:
            form, why = self.formulation_of(region)
            slow = f" (about {DEARER} times the time of displacements alone)" if form == "mixed" else ""
            lines += [f"  {region:8s} {material}", f"           {form} form: {why}{slow}"]
        if any(self.gravity):
            lines.append(f"  gravity  {', '.join(map(number, self.gravity))} m/s²")
        lines += [f"  held     {held}" for held in self.held]
        return "\n".join(lines)

    def problem(
        self, *interactions: Interaction, element: float | None = None, stress: bool = False
    ) -> SolidProblem:
        """Put the body under interactions whose inputs vary.

        Parameters
        ----------
        *interactions : Interaction
            At least one; their inputs follow each other in this order.
        element : float, optional
            Element size in m where the interactions need a fine mesh, in place of their own.
        stress : bool
            True for von Mises stress at the nodes in every answer, and so in every row of a sweep.

        Raises
        ------
        UsageError
            For what is no interaction, or lengths that are larger than the body.
        """
        from palpate.physics.solid.solid_problem import SolidProblem

        return SolidProblem(self, _flat(interactions), element, stress)


def _flat(interactions: Sequence[Any]) -> tuple[Interaction, ...]:
    flat: list[Interaction] = []
    for entry in interactions:
        flat += entry if isinstance(entry, tuple | list) else [entry]
    return tuple(flat)


def _no_mixed_form(material: Material) -> UsageError:
    return UsageError(
        f"{material.name} has no mixed form.",
        why="Its energy does not part into distortion and ½ κ θ².",
        fix='Use formulation="displacement", or a law with a volumetric part.',
    )


def _incompressible(material: Material) -> UsageError:
    return UsageError(
        f"{material.name} is incompressible and has no displacement form.",
        why="Its bulk modulus is infinite.",
        fix='Use formulation="mixed" or "auto".',
    )
