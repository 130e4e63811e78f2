"""Bodies that differ in a few numbers, as one problem: positions and these numbers are its inputs.

The body's energy U(c, p) at the equilibrium has the slope ∂U/∂p that its energy has at the same displacement: what the
equilibrium adds is of second order (envelope theorem). So each solve also gives the change of its energy with every
number of a material, for two evaluations of an integral. All members have the same elements: layers move their nodes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cached_property
from numbers import Real
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from palpate.dataset import Field, solid_fields
from palpate.errors import UsageError
from palpate.physics.apart import is_foreign, solve_apart
from palpate.physics.interactions.interaction import Interaction
from palpate.physics.interactions.sphere import SphereProbe
from palpate.physics.shapes.block import LayeredBlock
from palpate.physics.shapes.meshing import FineMesh
from palpate.physics.solid.solid_energy import material_energies
from palpate.physics.solid.solid_system import System
from palpate.units import Range

if TYPE_CHECKING:
    from palpate.dataset import Layout
    from palpate.physics.solid.solid_body import Body
    from palpate.physics.solid.solid_problem import SolidProblem
    from palpate.physics.solid.solid_solution import SolidSolution
    from palpate.physics.solid.solid_solver import SolidSolver

__all__ = ["RADIUS", "BodyFamily", "FamilyProblem", "FamilySolver", "Varied", "with_values"]

RADIUS = "probe.radius"
THICKNESS = "thickness"
UNITS = {
    **dict.fromkeys(("young", "bulk", "mu", "c10", "c01"), "Pa"),
    **dict.fromkeys(("poisson", "alpha"), ""),
    **dict.fromkeys(("radius", THICKNESS, "x", "y", "z"), "m"),
}
# share of a property in the central difference of the energy: most laws are linear in it, so exact
STEP = 1e-4
BESIDE = frozenset({"density"})  # acts through gravity, not through the energy


@dataclass(frozen=True)
class Varied:
    """A number of a material, the thickness of a layer or the radius of the probe, which is an input.

    Attributes
    ----------
    path : str
        ``"REGION.PROPERTY"``, for example ``"fat.young"``; of a body of one region the property alone will do.
        A material inside another is one more step: ``"fat.base.young"``. ``"LAYER.thickness"`` of a `LayeredBlock`:
        what a layer takes, the deepest one gives, so the touched surface stays. ``"probe.radius"``: contact points and
        depths stay.
    low, high : float
        Ends of its range, in SI units.
    name : str
        Name of the input, by default the path.
    unit : str
        Unit of the input, by default that of the property, where it is known.

    Raises
    ------
    UsageError
        If an end is no number.
    """

    path: str
    low: float
    high: float
    name: str = ""
    unit: str = ""

    def __post_init__(self) -> None:
        ends: tuple[object, ...] = (self.low, self.high)
        for end in ends:
            if not isinstance(end, Real):
                raise UsageError(
                    f"An end of the range of {self.path!r} is {end!r}, of type {type(end).__name__}.",
                    why="Ends are numbers in SI units.",
                    fix='For example Varied("fat.young", 2e3, 8e3) for 2 to 8 kPa.',
                )

    @property
    def range(self) -> Range:
        """The input.

        Raises
        ------
        UsageError
            If the ends are not finite or not in order.
        """
        unit = self.unit or UNITS.get(self.path.rpartition(".")[2], "")
        return Range(self.name or self.path, self.low, self.high, unit)

    @property
    def is_material(self) -> bool:
        """True for a number of a material, whose slope of the energy is one of an integral."""
        return self.path != RADIUS and not self.path.endswith(f".{THICKNESS}")

    def apply(self, body: Body, value: float) -> Body:
        """Return the body with this property at a value; as it is for the probe's radius.

        Raises
        ------
        UsageError
            If the body has no such number, or its material does not allow the value.
        """
        if self.path == RADIUS:
            return body
        if not self.is_material:
            return replace(
                body,
                geometry=_layered_block(body, self.path).with_thickness(self.path.partition(".")[0], value),
            )
        materials = body.materials
        region, steps = self._steps(materials)
        materials[region] = _with_property(materials[region], steps, value, self.path)
        return replace(body, material=materials)

    def scale(self, body: Body, value: float) -> float:
        """Return what a small step of this number of a material is measured by: its law's word, or the value's size."""
        region, steps = self._steps(body.materials)
        material: Any = body.materials[region]
        for step in steps[:-1]:
            material = getattr(material, step)
        return float(getattr(material, "scales", {}).get(steps[-1], abs(value)) or 1.0)

    def _steps(self, materials: Mapping[str, Any]) -> tuple[str, list[str]]:
        """Return the region, and the steps from its material to the number."""
        region, _, rest = self.path.partition(".")
        if region not in materials and len(materials) == 1:
            region, rest = next(iter(materials)), self.path
        if region not in materials or not rest:
            raise UsageError(
                f"{self.path!r} names no property of this body.",
                why=f"Its regions are {', '.join(materials)}.",
                fix=f'Write region and property, for example "{next(iter(materials))}.young".',
            )
        return region, rest.split(".")


def with_values(body: Body, varied: tuple[Varied, ...], values: tuple[float, ...]) -> Body:
    """Return the member of the family with these values."""
    for entry, value in zip(varied, values, strict=True):
        body = entry.apply(body, value)
    return body


def _layered_block(body: Body, path: str) -> LayeredBlock:
    if isinstance(body.geometry, LayeredBlock):
        return body.geometry
    raise UsageError(
        f"{path!r} can't vary: {body.geometry} has no layers.",
        why="The mesh of a layered block is moved with its layers; other shapes would need one for each value.",
        fix="Use a LayeredBlock, or make one sweep for each value.",
    )


def _with_property(material: Any, path: list[str], value: float, whole: str) -> Any:
    name, rest = path[0], path[1:]
    known = [f.name for f in fields(material)] if is_dataclass(material) else []
    inner = getattr(material, name) if name in known else None
    if rest and is_dataclass(inner):
        return replace(material, **{name: _with_property(inner, rest, value, whole)})
    if rest or name in BESIDE or isinstance(inner, bool) or not isinstance(inner, int | float):
        numbers = [n for n in known if isinstance(getattr(material, n), float) and n not in BESIDE]
        raise UsageError(
            f"{whole!r} can't vary: {name!r} is no number in the energy of {material.name}.",
            why=f"Its numbers are {', '.join(numbers) or 'none'}.",
            fix="Name one of these, or make one sweep for each value.",
        )
    if not math.isfinite(value):
        raise UsageError(f"The value {value} of {whole!r} is not finite.", fix="Give a finite number.")
    return replace(material, **{name: float(value)})


@dataclass(frozen=True)
class BodyFamily:
    """A body some of whose numbers are inputs.

    Attributes
    ----------
    body : Body
        The common body; its own values of what varies do not matter.
    varied : tuple of Varied
        Numbers of materials, thicknesses of layers, the probe's radius.

    Raises
    ------
    UsageError
        If nothing varies, a property occurs twice or does not exist, a range is empty, or the body has a history.
    """

    body: Body
    varied: tuple[Varied, ...]

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "varied", (self.varied,) if isinstance(self.varied, Varied) else tuple(self.varied)
        )
        paths = [entry.path for entry in self.varied]
        if not paths or len(set(paths)) < len(paths):
            raise UsageError(
                "A family needs properties that vary, each once.",
                why=f"It has {', '.join(map(repr, paths)) or 'none'}.",
                fix='Give for example Varied("fat.young", 2e3, 8e3).',
            )
        if self.body.has_history:
            raise UsageError(
                "A body with a history makes no family.",
                why="Its answers depend on what was before, not on inputs alone.",
                fix="Use elastic materials; time comes afterwards, as branches on the learnt energy.",
            )
        for ends in ([v.low for v in self.varied], [v.high for v in self.varied]):
            with_values(self.body, self.varied, tuple(ends))
        for entry in self.varied:
            _ = entry.range

    def problem(
        self, *interactions: Interaction, element: float | None = None, stress: bool = False
    ) -> FamilyProblem:
        """Put the family under interactions; see `Body.problem`."""
        return FamilyProblem(self.body.problem(*interactions, element=element, stress=stress), self.varied)

    def member(self, values: Sequence[float]) -> Body:
        """Return the body of these values."""
        return with_values(self.body, self.varied, tuple(float(v) for v in values))

    def __str__(self) -> str:
        return f"{self.body}\n  varied   {', '.join(str(entry.range) for entry in self.varied)}"


@dataclass(frozen=True)
class FamilyProblem:
    """A family under interactions: inputs are theirs, n of them, and then the k numbers that vary.

    The response to a number of a material is −∂U/∂p as well; that to a thickness or a radius is NaN, which says that it
    is not known. Of the stiffness only what belongs to the interactions is.

    Attributes
    ----------
    base : SolidProblem
        Problem of the common body.
    varied : tuple of Varied
        The k numbers that vary.
    """

    base: SolidProblem
    varied: tuple[Varied, ...]

    def __post_init__(self) -> None:
        # the same pad under all members, or its energies were of different functions
        object.__setattr__(self, "base", replace(self.base, interactions=self.base.acting))
        if self._radius is None:
            return
        probe = self._probe
        ends = (self.varied[self._radius].low, self.varied[self._radius].high)
        probes = [probe.with_radius(self.base.body.geometry, radius) for radius in ends]
        wanted = [replace(self.base, interactions=(interaction,)).refinements for interaction in probes]
        object.__setattr__(self, "base", replace(self.base, fine=_both(*wanted)))

    @property
    def _radius(self) -> int | None:
        """Index of the probe's radius in `varied`, if it varies."""
        paths = [entry.path for entry in self.varied]
        return paths.index(RADIUS) if RADIUS in paths else None

    @property
    def _probe(self) -> SphereProbe:
        """The only interaction, whose radius varies."""
        acting = self.base.interactions
        if len(acting) == 1 and isinstance(acting[0], SphereProbe):
            return acting[0]
        raise UsageError(
            "There is no one probe whose radius could vary.",
            why=f"What acts is {', '.join(map(str, acting))}.",
            fix="Press the family with one SphereProbe.",
        )

    @cached_property
    def ranges(self) -> tuple[Range, ...]:
        """Name, range and unit of each input."""
        return (*self._places, *(entry.range for entry in self.varied))

    @property
    def _places(self) -> tuple[Range, ...]:
        """Ranges of the interactions' inputs, for all radii of a probe."""
        if self._radius is None:
            return self.base.ranges
        radii, body = self.varied[self._radius], self.base.body
        ends = [
            self._probe.with_radius(body.geometry, radius).ranges(body.geometry)
            for radius in (radii.low, radii.high)
        ]
        return tuple(
            replace(a, low=min(a.low, b.low), high=max(a.high, b.high)) for a, b in zip(*ends, strict=True)
        )

    @property
    def layout(self) -> Layout:
        """Nodes and axes of all members: their shape is the same."""
        return self.base.layout

    @property
    def schema(self) -> tuple[Field, ...]:
        """Fields of each answer."""
        return solid_fields(len(self.base.mesh.points), self.ranges, stress=self.base.stress)

    @property
    def design_name(self) -> str | None:
        """Name of the problem's own design, None where it has none."""
        return self.base.design_name

    @property
    def symmetry(self) -> dict[str, Any] | None:
        """Isometries of every member."""
        return self.base.symmetry

    @property
    def words(self) -> str:
        """The family in a few words."""
        return f"{self.base.words}, {', '.join(entry.range.name for entry in self.varied)} varied"

    @property
    def mesh(self) -> Any:
        """Mesh of all members at rest."""
        return self.base.mesh

    def member(self, values: Sequence[float]) -> SolidProblem:
        """Return the problem of the body with these values."""
        values = tuple(float(v) for v in values)
        body = with_values(self.base.body, self.varied, values)
        if self._radius is None:
            return replace(self.base, body=body)
        probe = self._probe.with_radius(self.base.body.geometry, values[self._radius])
        return replace(self.base, body=body, interactions=(probe,))

    def describe(self) -> dict[str, Any]:
        """Return everything that decides the answers, as plain data for a JSON file."""
        varied = [{"path": entry.path, "range": [entry.low, entry.high]} for entry in self.varied]
        low = self.member([entry.low for entry in self.varied])
        return low.describe() | {"varied": varied}

    def open(self) -> FamilySolver:
        """Get ready to solve; a member's finite elements are built when it is first asked."""
        return FamilySolver(self)

    def solve(self, x: Any) -> SolidSolution:
        """Solve for inputs x (n + k,), from the body without interaction."""
        if is_foreign(self.base.body.geometry):
            return cast("SolidSolution", solve_apart(self, x, {}))
        return self.open().solve(x)

    def design(self, samples: int, seed: int = 0, **options: Any) -> np.ndarray:
        """Return inputs (samples, n + k): chains of the interaction's own design, each of one member.

        Members are a scrambled Sobol sequence (Owen 1998) of their own.
        """
        from scipy.stats import qmc

        points = self.base.design(samples, seed, **options)
        chains = self.base.chains(points)
        k = len(self.varied)
        engine = qmc.Sobol(k, scramble=True, rng=np.random.default_rng([seed, k]))
        unit = engine.random(1 << int(np.ceil(np.log2(max(len(chains), 2)))))
        low = np.array([entry.low for entry in self.varied])
        high = np.array([entry.high for entry in self.varied])
        values = np.empty((len(points), k))
        for rows, u in zip(chains, unit, strict=False):
            values[rows] = low + u * (high - low)
            if self._radius is not None:
                radius, geometry = values[rows[0], self._radius], self.base.body.geometry
                points[rows] = self._probe.shift_centres(geometry, points[rows], radius)
        return np.hstack([points, values])

    def chains(self, points: Any) -> list[np.ndarray]:
        """Return rows of `points` (N, n + k) in chains, each of one member."""
        points = np.asarray(points, dtype=float)
        n, chains = len(self.base.ranges), []
        _, which = np.unique(points[:, n:], axis=0, return_inverse=True)
        for member in range(which.max() + 1 if len(points) else 0):
            rows = np.flatnonzero(which.ravel() == member)
            chains += [rows[chain] for chain in self.base.chains(points[rows, :n])]
        return chains

    def check_points(self, points: np.ndarray) -> None:
        """Refuse positions far from the body, and properties that its materials do not allow."""
        points = np.asarray(points, dtype=float)
        n = len(self.base.ranges)
        self.base.check_points(points[:, :n])
        for values in np.unique(points[:, n:], axis=0):
            self.member(values)

    def __str__(self) -> str:
        return f"{self.base}\n  varied   {', '.join(str(entry.range) for entry in self.varied)}"


class FamilySolver:
    """The finite elements of that member of a family which was asked last."""

    def __init__(self, problem: FamilyProblem) -> None:
        self._problem = problem
        self._values: tuple[float, ...] | None = None
        self._solver: SolidSolver | None = None
        self._slopes: list[_EnergySlope | None] = []

    def reset(self) -> None:
        """Forget all earlier solves."""
        if self._solver is not None:
            self._solver.reset()

    def solve(self, x: Any) -> SolidSolution:
        """Find the equilibrium under inputs x (n + k,): the n interactions' and the k values of the family."""
        x = np.asarray(x, dtype=float)
        n, k = len(self._problem.base.ranges), len(self._problem.varied)
        if x.shape != (n + k,) or not np.isfinite(x).all():
            raise UsageError(
                f"The inputs {x} do not fit.",
                why=f"The problem has the inputs {', '.join(r.name for r in self._problem.ranges)}.",
                fix=f"Give {n + k} finite numbers.",
            )
        solver = self._solver_for(tuple(x[n:].tolist()))
        solution = solver.solve(x[:n])
        gradient = np.full((n + k, n + k), np.nan)
        gradient[:n, :n] = solution.response_gradient
        slopes = [
            s.evaluate(solution.state) if s is not None and solution.converged else np.nan
            for s in self._slopes
        ]
        return replace(
            solution,
            ranges=self._problem.ranges,
            inputs=x,
            response=np.concatenate([solution.response, -np.asarray(slopes)]),
            response_gradient=gradient,
            reached=np.concatenate([solution.reached, x[n:]]),
        )

    def _solver_for(self, values: tuple[float, ...]) -> SolidSolver:
        if self._solver is None or values != self._values:
            self._solver = None  # at most one is open: each takes hundreds of megabytes
            member = self._problem.member(values)
            solver = member.open()
            self._slopes = [
                _EnergySlope(solver, member.body, entry, value) if entry.is_material else None
                for entry, value in zip(self._problem.varied, values, strict=True)
            ]
            self._solver, self._values = solver, values
        return self._solver


def _both(first: tuple[FineMesh, ...], second: tuple[FineMesh, ...]) -> tuple[FineMesh, ...]:
    """Return meshes that satisfy two wishes for each surface: the smaller elements, in a box around both."""
    fine = []
    for a, b in zip(first, second, strict=True):
        if a == b:  # wanted by what holds the body
            fine.append(a)
            continue
        # a probe wants it in a box around its contact points
        lower = np.minimum(np.array(a.lower), np.array(b.lower)).tolist()
        upper = np.maximum(np.array(a.upper), np.array(b.upper)).tolist()
        fine.append(FineMesh(a.surface, min(a.element, b.element), tuple(lower), tuple(upper)))
    return tuple(fine)


class _EnergySlope:
    """∂U/∂p at an equilibrium: the difference of the body's energy at one displacement."""

    def __init__(self, solver: SolidSolver, body: Body, varied: Varied, value: float) -> None:
        model = solver.model
        self._step = STEP * varied.scale(body, value)
        free = np.zeros(model.field.size, dtype=bool)
        ends = (varied.apply(body, value - self._step), varied.apply(body, value + self._step))
        self._low, self._high = (
            System(model.field, material_energies(model.field, end.materials, {}), free, "") for end in ends
        )
        self._base = self._difference(model.base)

    def evaluate(self, z: np.ndarray) -> float:
        """Return ∂U/∂p at the unknowns z (dof,) of an equilibrium."""
        return self._difference(z) - self._base

    def _difference(self, z: np.ndarray) -> float:
        return (self._high.potential(z) - self._low.potential(z)) / (2 * self._step)
