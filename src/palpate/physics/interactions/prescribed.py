"""Displacements that are prescribed on a surface, and supports on which it slides.

The prescribed unknowns are u = u_base + Σ qᵢ eᵢ, so the response -∂U/∂qᵢ is a sum of reactions.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.physics.interactions.interaction import Attached, Fixed, PlainInteraction
from palpate.physics.interactions.interaction_checks import AXES, along, direction_of, interval, tag
from palpate.physics.shapes.naming import require_known
from palpate.units import Range

if TYPE_CHECKING:
    from palpate.physics.shapes.meshing import FineMesh

__all__ = ["PrescribedDisplacement", "roller"]

Point = tuple[float, float, float]
Ends = tuple[float, float]
SLACK = 1e-6  # share of the body's size by which a node may miss the box that tells a part of a surface


@dataclass(frozen=True)
class PrescribedDisplacement(PlainInteraction):
    """Points of a surface moved by u = Σ qᵢ eᵢ from where they are under the constant loads alone.

    The response is the force with which the body resists, -∂U/∂qᵢ: the sum of the reactions along eᵢ.

    Attributes
    ----------
    surface : str
        Name of the surface.
    directions : direction, or tuple of directions
        The eᵢ, each an axis such as ``"-z"`` or three numbers, taken to length 1.
    displacement : range, or tuple of ranges
        (low, high) in m of each qᵢ.
    sliding : bool
        True leaves displacements across all eᵢ, which must then be axes, free; False keeps them at zero.
    within : pair of points, optional
        Corners in m of an upright box: only elements of the surface that lie in it are moved.
    element : float, optional
        Size in m of the elements on the part that is moved. With it the mesh follows the edges of the box on plane
        upright faces; without it the edge of the part is where the elements happen to end.
    name : str
        Put before the names of the inputs.

    Raises
    ------
    UsageError
        For an empty range, a direction without length, directions that depend on each other, or a sliding
        direction that is no axis.
    """

    surface: str
    directions: Any = "z"
    displacement: Any = (-0.005, 0.005)
    sliding: bool = False
    within: tuple[Point, Point] | None = None
    element: float | None = None
    name: str = ""

    def __post_init__(self) -> None:
        directions = _directions(self.directions)
        object.__setattr__(self, "directions", directions)
        object.__setattr__(self, "displacement", _ends(self.displacement, len(directions)))
        if np.linalg.matrix_rank(np.array(directions), tol=1e-9) < len(directions):
            raise UsageError(
                f"The directions {directions} depend on each other.",
                why="The same displacement could be had in several ways, so forces along them are not defined.",
                fix="Give at most three directions, none a combination of the others.",
            )
        if self.sliding and any(max(map(abs, e)) < 1.0 for e in directions):
            raise UsageError(
                f"The surface {self.surface!r} can't slide across {directions}.",
                why="Free sliding is a matter of single displacement components, so directions must be axes.",
                fix="Give axes such as 'z', or sliding=False to keep the displacement across at zero.",
            )
        if self.within is not None:
            object.__setattr__(self, "within", _box(self.within))
        if self.element is not None:
            checks.positive("The element on a moved surface", self.element, "m")

    def ranges(self, geometry: Any) -> tuple[Range, ...]:
        """Return one input for each direction, in m.

        Raises
        ------
        UsageError
            If the body has no such surface.
        """
        require_known("surface", self.surface, geometry.surfaces)
        names = [_word(e, i, len(self.directions)) for i, e in enumerate(self.directions)]
        pairs = zip(names, self.displacement, strict=True)
        return tuple(Range(tag(self.name, name), low, high, "m") for name, (low, high) in pairs)

    def __str__(self) -> str:
        axes = ", ".join(map(along, self.directions))
        part = " in a box" if self.within is not None else ""
        return f"{self.surface!r}{part} moved along {axes}{', free across' if self.sliding else ''}"

    def refinements(self, geometry: Any) -> tuple[FineMesh, ...]:
        """Return fine elements on the moved part, if their size is given."""
        from palpate.physics.shapes.meshing import FineMesh

        if self.element is None:
            return ()
        lower, upper = self.within or (None, None)
        require_known("surface", self.surface, geometry.surfaces)
        return (FineMesh(self.surface, self.element, lower, upper),)

    def attach(self, field: Any) -> Attached:
        """Return its constraints on an opened body.

        Raises
        ------
        UsageError
            If no element of the surface lies in the box.
        """
        import ngsolve as ng

        constrained = self._constrained(field)
        lifts = np.array([field.interpolate(ng.CF(e)) * constrained for e in self.directions])
        inputs = tuple(ng.Parameter(0.0) for _ in self.directions)
        return Attached(parameters=inputs, lifts=lifts, constrained=constrained)

    def _constrained(self, field: Any) -> np.ndarray:
        """Return a mask of the constrained unknowns, bool of shape (dof,)."""
        mask = field.surface_dofs(self.surface) if self.within is None else self._in_box(field)
        if self.sliding:
            space, across = field.displacement.space, np.zeros(field.size, dtype=bool)
            for axis in np.argmax(np.abs(np.array(self.directions)), axis=1).tolist():
                component = space.Range(axis)
                across[component.start : component.stop] = True
            mask = mask & across
        return np.asarray(mask)

    def _in_box(self, field: Any) -> np.ndarray:
        mesh, space = field.rest, field.displacement.space
        lower, upper = (np.asarray(corner) for corner in self.within or mesh.corners)
        slack = SLACK * float(np.linalg.norm(mesh.corners[1] - mesh.corners[0]))
        inside = ((mesh.points >= lower - slack) & (mesh.points <= upper + slack)).all(axis=1)
        mask = np.zeros(field.size, dtype=bool)
        for element in field.surface(self.surface).Elements():
            if all(inside[vertex.nr] for vertex in element.vertices):
                mask[list(space.GetDofNrs(element))] = True
        if not mask.any():
            raise UsageError(
                f"No element of the surface {self.surface!r} lies in the box {self.within} m.",
                why="Only elements whose corners are all in the box are moved.",
                fix="Give `element`, so that the mesh follows the box, or make the box larger.",
            )
        return mask


def _word(direction: Point, index: int, count: int) -> str:
    if max(direction) == 1.0:
        return f"d_{AXES[direction.index(1.0)]}"
    return f"d_{index + 1}" if count > 1 else "d"


def _directions(value: Any) -> tuple[Point, ...]:
    parts = (value,) if isinstance(value, str) else tuple(value) if isinstance(value, Iterable) else ()
    single = len(parts) == 3 and not any(isinstance(part, str | Iterable) for part in parts)
    several = (parts,) if single else parts
    if not several:
        raise UsageError(
            f"The directions of a prescribed displacement are {value!r}.",
            why="At least one is needed.",
            fix="For example 'z', or ('x', 'z'), or (0, 0, -1).",
        )
    return tuple(direction_of("The direction of a prescribed displacement", part) for part in several)


def _ends(value: Any, count: int) -> tuple[Ends, ...]:
    parts = tuple(value) if isinstance(value, Iterable) else ()
    several = parts if parts and all(isinstance(part, Iterable) for part in parts) else (parts,)
    if len(several) != count:
        raise UsageError(
            f"There are {count} directions and {len(several)} ranges of a prescribed displacement.",
            why="Each direction needs a range of its own.",
            fix="Give one pair (low, high) in m for each direction.",
        )
    ranges = tuple(interval("A prescribed displacement", part, "m") for part in several)
    return tuple(ends for ends in ranges if isinstance(ends, tuple))


def _box(value: Any) -> tuple[Point, Point]:
    try:
        low, high = value
    except (TypeError, ValueError):
        raise UsageError(
            f"The box of a prescribed displacement is {value!r}.",
            why="It needs a lower and an upper corner.",
            fix="For example within=((0, 0, 0.05), (0.02, 0.02, 0.05)), in m.",
        ) from None
    lower = checks.triple("The lower corner of a box", low, "m")
    upper = checks.triple("The upper corner of a box", high, "m")
    if any(a > b for a, b in zip(lower, upper, strict=True)):
        raise UsageError(
            f"The box {lower} … {upper} m is empty.",
            why="Each coordinate of the lower corner must be at most that of the upper one.",
            fix="Swap the coordinates that are in the wrong order.",
        )
    return lower, upper


def roller(surface: str, axis: str, within: tuple[Point, Point] | None = None) -> Fixed:
    """Return a support that keeps one component of the displacement at zero and leaves the others free.

    A plane of symmetry is a roller whose axis is the plane's normal, so a half, a quarter or an eighth of a body can
    stand for the whole of it.

    Parameters
    ----------
    surface : str
        Name of the surface.
    axis : {"x", "y", "z"}
        The component that stays at zero.
    within : pair of points, optional
        Corners in m of an upright box: only elements of the surface that lie in it are supported.

    Returns
    -------
    Fixed
        Support for ``Body(..., held=(...))``.

    Raises
    ------
    UsageError
        If the axis is none.
    """
    # a range is asked for, and never used: the support stays where it is
    slide = PrescribedDisplacement(surface, axis, (-1.0, 1.0), sliding=True, within=within)
    return Fixed(slide, (0.0,))
