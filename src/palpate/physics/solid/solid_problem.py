"""A solid and what acts on it: the question that a sweep asks many times."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from palpate import checks
from palpate.dataset import Field, Layout, solid_fields
from palpate.errors import SolverError, UsageError
from palpate.physics.apart import is_foreign, solve_apart
from palpate.physics.interactions.glued import GluedPad
from palpate.physics.interactions.interaction import Interaction, Planned
from palpate.physics.interactions.pads import advise_on_pad
from palpate.physics.interactions.pinch import Pinch
from palpate.physics.interactions.pressing import PressingTool
from palpate.physics.interactions.rigid_limit import with_rigid_pad
from palpate.physics.interactions.sphere import RIGID, SphereProbe
from palpate.physics.interactions.surface_tool import SurfaceTool
from palpate.physics.shapes.divided_surface import MOST_DRAWN, divide_large
from palpate.physics.shapes.naming import require_known
from palpate.physics.solid.body_symmetry import symmetry_of
from palpate.physics.solid.natural_frequency import DENSITY, natural_frequency
from palpate.physics.solid.solid_checks import (
    advise_on_sizes,
    longest_side,
    require_element,
    require_finite,
    require_lengths,
    require_near,
    require_no_loose_part,
)
from palpate.processes import CASE_LIMIT
from palpate.supervised import run_in_child
from palpate.tools import Gripper, PosedTool
from palpate.units import Range

if TYPE_CHECKING:
    from palpate.physics.shapes.mesh import BodyMesh
    from palpate.physics.shapes.meshing import FineMesh
    from palpate.physics.solid.solid_body import Body
    from palpate.physics.solid.solid_solution import SolidSolution
    from palpate.physics.solid.solid_solver import SolidSolver

__all__ = ["SolidProblem"]


_FREQUENCIES: dict[str, float | None] = {}  # in Hz, by the description of a body: each is found once

FINE = 0.1  # quantile of the sides of the surface's elements: they are fine where the body is touched


@dataclass(frozen=True)
class SolidProblem:
    """A body under interactions, whose inputs q (n,) vary from solve to solve.

    A plain value: it can be compared, hashed, pickled and sent to another process.

    Attributes
    ----------
    body : Body
        The body.
    interactions : tuple of Interaction
        The actions on it whose inputs vary.
    element : float or None
        Element size in m where the interactions need a fine mesh, in place of their own.
    stress : bool
        True for von Mises stress at the nodes in every answer, and so in every row of a sweep.
    fine : tuple of FineMesh, optional
        Fine parts of the mesh, in place of those that the interactions want, so that several problems share a mesh.
    """

    body: Body
    interactions: tuple[Interaction, ...]
    element: float | None = None
    stress: bool = False
    fine: tuple[FineMesh, ...] | None = None

    def __post_init__(self) -> None:
        if not self.interactions:
            raise UsageError(
                "The problem has no interaction.",
                why="Without one there is nothing to vary.",
                fix='Give one, for example body.problem(SphereProbe(radius=0.01, touches="top")).',
            )
        for interaction in self.interactions:
            if not isinstance(interaction, Interaction):
                raise UsageError(
                    f"{interaction!r} is no interaction.",
                    why="An interaction has ranges, describe, refinements and attach.",
                    fix="Pass for example a SphereProbe.",
                )
            self._require_surface(interaction)
            require_lengths(interaction, self.longest)
        if self.element is not None:
            require_element(self.element, self.longest)
        require_no_loose_part(self.body, self.interactions)
        for interaction in self.interactions:
            advise_on_sizes(interaction, self.element, self.longest)
            if isinstance(interaction, SurfaceTool | Pinch) and self.element is not None:
                interaction.require_fine_elements(self.element)
            if isinstance(interaction, SphereProbe) and interaction.pad != RIGID:
                advise_on_pad(interaction, self.body.materials)

    def _require_surface(self, interaction: Any) -> None:
        """Refuse a touched surface that the body does not have, before anything is meshed."""
        named = getattr(interaction, "touches", getattr(interaction, "surface", None))
        if isinstance(named, str):
            require_known("surface", named, self.body.geometry.surfaces)

    @cached_property
    def longest(self) -> float:
        """The body's longest side in m."""
        return longest_side(self.body.geometry)

    @cached_property
    def ranges(self) -> tuple[Range, ...]:
        """Name, range and unit of each input; names that occur twice are numbered."""
        ranges = [r for interaction in self.interactions for r in interaction.ranges(self.body.geometry)]
        names = [r.name for r in ranges]
        numbered = [
            f"{name}_{names[:i].count(name) + 1}" if names.count(name) > 1 else name
            for i, name in enumerate(names)
        ]
        return tuple(replace(r, name=name) for r, name in zip(ranges, numbered, strict=True))

    @cached_property
    def refinements(self) -> tuple[FineMesh, ...]:
        """Parts of surfaces on which the mesh is fine."""
        if self.fine is not None:
            return self.fine
        parts = (*self.interactions, *(held.interaction for held in self.body.held))
        wanted = [r for part in parts for r in part.refinements(self.body.geometry)]
        if self.element is not None:
            wanted = [replace(r, element=self.element) for r in wanted]
        return tuple(wanted)

    @property
    def acting(self) -> tuple[Interaction, ...]:
        """The interactions with a number for the pad of a rigid sphere: the same one at all inputs."""
        return tuple(with_rigid_pad(part, self.body.materials) for part in self.interactions)

    @property
    def mesh(self) -> BodyMesh:
        """The body at rest as plain arrays."""
        return self.body.geometry.rest(self.refinements)

    @property
    def layout(self) -> Layout:
        """Nodes at rest and the surface's triangles; a sweep asks for it."""
        mesh = self.mesh
        return Layout(
            mesh.points,
            triangles=mesh.triangles,
            surfaces=mesh.surfaces,
            surface_of=mesh.surface_of,
            drawn=self._drawn_surface(),
        )

    def _drawn_surface(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the surface that pictures show, as fine as the finest elements; None for that of the mesh."""
        own = getattr(self.body.geometry, "drawn", None)
        if own is None:
            return None
        mesh = self.mesh
        sides = mesh.points[mesh.triangles] - np.roll(mesh.points[mesh.triangles], 1, axis=1)
        fine = float(np.quantile(np.linalg.norm(sides, axis=2), FINE))
        return divide_large(own[0], own[1], fine, MOST_DRAWN)

    @property
    def schema(self) -> tuple[Field, ...]:
        """Fields of each answer; a sweep asks for it."""
        edges = len(self.mesh.edges) if getattr(self.body.geometry, "drawn_apart", False) else 0
        torque = any(isinstance(one, SurfaceTool | Pinch) for one in self.interactions)
        size = len(self.mesh.points)
        return solid_fields(size, self.ranges, stress=self.stress, edges=edges, torque=torque)

    @property
    def design_name(self) -> str | None:
        """Name of the problem's own design, None where it has none."""
        return None if self._planned_interaction() is None else "columns"

    def describe(self) -> dict[str, Any]:
        """Return everything that decides the answers, as plain data for a JSON file."""
        return {
            "type": "SolidProblem",
            "body": self.body.describe(),
            "interactions": [
                {**wanted.describe(), **({} if acts is wanted else {"stiffness": getattr(acts, "pad", None)})}
                for wanted, acts in zip(self.interactions, self.acting, strict=True)
            ],
            "element": self.element,
            **({"stress": True} if self.stress else {}),
            **({} if self.fine is None else {"fine": [asdict(one) for one in self.fine]}),
        }

    @property
    def symmetry(self) -> dict[str, Any] | None:
        """Isometries of body, supports, touched surface and tool as plain data; None but for one tool or glued pad."""
        acting = self.interactions[0]
        if len(self.interactions) > 1 or not isinstance(acting, PressingTool | GluedPad | Pinch):
            return None
        symmetry = symmetry_of(self.body, acting.touches)
        if isinstance(acting, GluedPad):
            symmetry = symmetry.part(
                acting.keeps(matrix, symmetry.about, self.body.geometry) for matrix in symmetry.matrices
            )
        if isinstance(acting, SurfaceTool):
            symmetry = symmetry.part(acting.posed_tool.keeps(matrix) for matrix in symmetry.matrices)
        if isinstance(acting, Pinch):
            symmetry = symmetry.part(acting.gripper.keeps(matrix) for matrix in symmetry.matrices)
        return symmetry.describe()

    @cached_property
    def motion(self) -> dict[str, float] | None:
        """Lowest natural frequency in Hz of the body alone, and the density in kg/m³ where one had to be assumed.

        None where it could not be found: of a body that nothing holds, or whose mesh ends the child process.
        """
        key = json.dumps(self.body.describe(), sort_keys=True)
        if key not in _FREQUENCIES:
            apart = partial(run_in_child, natural_frequency, limit=CASE_LIMIT)
            find = apart if is_foreign(self.body.geometry) else natural_frequency
            try:
                found = find(replace(self, fine=()))
            except (SolverError, RuntimeError):  # what ARPACK and NGSolve raise, too
                found = None
            _FREQUENCIES[key] = found
        lowest = _FREQUENCIES[key]
        if lowest is None:
            return None
        assumed = not all(material.density for material in self.body.materials.values())
        return {"frequency": float(f"{lowest:.4g}"), **({"density": DENSITY} if assumed else {})}

    @property
    def words(self) -> str:
        """The body in a few words, for the title of its answers."""
        materials = dict.fromkeys(material.name for material in self.body.materials.values())
        return f"{self.body.geometry} ({', '.join(materials)})"

    @property
    def hash(self) -> str:
        """SHA-256 of the description: equal for equal problems, in any process."""
        text = json.dumps(self.describe(), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def open(self, *, solver: str = "auto", tolerance: float = 1e-9) -> SolidSolver:
        """Build the finite elements; the solver that comes back is good for many solves.

        Parameters
        ----------
        solver : str
            ``"auto"``, or NGSolve's name of a sparse solver.
        tolerance : float
            Relative error in the energy norm at which an iteration ends.

        Raises
        ------
        UsageError
            For an unknown solver, or a tolerance that is not between 0 and 1.
        SolverError
            If the body has no equilibrium under its constant loads.
        """
        checks.positive("The tolerance of a solver", tolerance, "")
        if tolerance >= 1:
            raise UsageError(
                f"The tolerance of a solver is {tolerance:g}.",
                why="It is a relative error: at 1 anything would do.",
                fix="Leave it out for 1e-9, or pass a number such as 1e-6.",
            )
        from palpate.physics.solid.solid_solver import SolidSolver

        return SolidSolver(self, solver=solver, tolerance=tolerance)

    def solve(self, x: Any, *, dt: float | None = None, fields: bool = False) -> SolidSolution:
        """Solve for inputs x (n,), from the body without interaction.

        Inputs a little beyond their ranges are solved too; `SolidSolution.inside` tells, and so does its print.
        A body from a file of another program is solved in a child process, which it may crash.

        Parameters
        ----------
        x : (n,) array
            One number per input, in SI units.
        dt : float, optional
            Duration of the step in s, for materials with a history; by default an instant.
        fields : bool
            True for stress and stretch at the nodes.

        Raises
        ------
        UsageError
            If `x` has not one finite number per input, or `dt` is not positive.
        """
        if is_foreign(self.body.geometry):
            return cast("SolidSolution", solve_apart(self, x, {"dt": dt, "fields": fields}))
        return self.open().solve(x, dt=dt, fields=fields)

    def design(self, samples: int, seed: int = 0, **options: Any) -> np.ndarray:
        """Return inputs (samples, n) that this problem solves well, in the order of its chains.

        `options` are those of the interaction's own design, such as a probe's `depths`.

        Raises
        ------
        UsageError
            If the interactions leave the design to the caller.
        """
        planned = self._planned_interaction()
        if planned is None:
            raise UsageError(
                "This problem has no design of its own.",
                why="Only a single interaction such as a probe knows the order in which it is solved well.",
                fix="Choose a design such as sobol over its ranges.",
            )
        return np.asarray(planned.design(self.body.geometry, samples, seed, **options))

    def chains(self, points: Any) -> list[np.ndarray]:
        """Return rows of `points` (N, n) to be solved one after the other by one solver, chain by chain."""
        points = np.asarray(points, dtype=float)
        self.check_points(points)
        planned = self._planned_interaction()
        if planned is None:
            return [np.arange(len(points))]
        return list(planned.chains(self.body.geometry, points))

    def check_points(self, points: np.ndarray) -> None:
        """Refuse positions (N, n) far from the body, which tell of mistaken units; a sweep asks for it.

        Raises
        ------
        UsageError
            If one is farther from its range than the body is long.
        """
        require_near(np.asarray(points, dtype=float), self.ranges, self.longest)

    def probe_at(self, x: np.ndarray) -> tuple[SphereProbe | None, np.ndarray | None]:
        """Return the first sphere among the interactions, and where inputs x (n,) put its centre, (3,) in m."""
        first = 0
        for interaction in self.interactions:
            if isinstance(interaction, SphereProbe):
                return interaction, np.asarray(x[first : first + 3])
            first += len(interaction.ranges(self.body.geometry))
        return None, None

    def tool_at(self, x: np.ndarray) -> tuple[PosedTool | Gripper | None, np.ndarray | None]:
        """Return the first tool or gripper among the interactions, and its own inputs (3 + k,) among x (n,)."""
        first = 0
        for interaction in self.interactions:
            count = len(interaction.ranges(self.body.geometry))
            if isinstance(interaction, SurfaceTool):
                return interaction.posed_tool, np.asarray(x[first : first + count])
            if isinstance(interaction, Pinch):
                return interaction.gripper, np.asarray(x[first : first + count])
            first += count
        return None, None

    def __str__(self) -> str:
        acting = ", ".join(str(interaction) for interaction in self.interactions)
        try:
            inputs = ", ".join(map(str, self.ranges))
        except UsageError as error:  # what prints a value must not fail
            inputs = f"none: {error.what}"
        return f"{self.body}\n  under    {acting}\n  inputs   {inputs}"

    def inputs(self, x: Any) -> np.ndarray:
        """Return inputs as an array (n,).

        Raises
        ------
        UsageError
            If `x` has not one finite number per input, or is a position in m far from the body.
        """
        try:
            values = np.atleast_1d(np.asarray(x, dtype=float))
        except (TypeError, ValueError):
            values = np.empty(0)
        if values.shape != (len(self.ranges),):
            raise UsageError(
                f"The inputs given are {x!r}.",
                why=f"This problem has {len(self.ranges)}: {', '.join(r.name for r in self.ranges)}.",
                fix="Give one number per input, in this order.",
            )
        require_finite(values, self.ranges)
        require_near(values[None, :], self.ranges, self.longest)
        return values

    def _planned_interaction(self) -> Any:
        only = self.interactions[0]
        return only if len(self.interactions) == 1 and isinstance(only, Planned) else None
