"""Where a mesh shall be fine, and how many elements that would take."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from palpate.errors import UsageError
from palpate.physics.arguments import require_positive
from palpate.physics.geometry.checks import require_triple
from palpate.physics.geometry.groups import GROUPS

__all__ = ["GRADING", "MOST_ELEMENTS", "THREADS", "FineMesh", "require_budget"]

GRADING = 0.4  # growth of the element size per distance from a fine surface
THREADS = 1  # of Netgen; its own four gain nothing, and spin: ten times slower where another process works
MOST_ELEMENTS = 400_000  # about half a million nodes of second order: beyond any direct solver on one machine
Point = tuple[float, float, float]


@dataclass(frozen=True)
class FineMesh:
    """A part of a surface that shall have small elements.

    Attributes
    ----------
    surface : str
        Name of a surface of the body.
    element : float
        Length of an element's edge in m.
    lower, upper : tuple of three floats, optional
        Corners in m of an upright box; the part of the surface within it becomes fine. Without a box, all of it.

    Raises
    ------
    UsageError
        If the size is not positive, or the box is empty or has only one corner.
    """

    surface: str
    element: float
    lower: Point | None = None
    upper: Point | None = None

    def __post_init__(self) -> None:
        require_positive("The element size of a refinement", self.element, "m")
        if (self.lower is None) != (self.upper is None):
            raise UsageError(
                f"The refinement of {self.surface!r} has one corner only.",
                why="A box needs its lower and its upper corner.",
                fix="Give both, or neither for the whole surface.",
            )
        if self.lower is None or self.upper is None:
            return
        lower = require_triple("The lower corner of a refinement", self.lower)
        upper = require_triple("The upper corner of a refinement", self.upper)
        object.__setattr__(self, "lower", lower)
        object.__setattr__(self, "upper", upper)
        if any(a > b for a, b in zip(lower, upper, strict=True)):
            raise UsageError(
                f"The box of the refinement of {self.surface!r} is empty: {lower} … {upper} m.",
                why="Each coordinate of the lower corner must be at most that of the upper one.",
                fix="Swap the coordinates that are in the wrong order.",
            )

    def is_on(self, name: str | None) -> bool:
        """Whether the named surface is the refined one, or one of those that its name stands for."""
        return name == self.surface or name in GROUPS.get(self.surface, ())


def require_budget(volumes: Iterable[tuple[float, float]], fine: Iterable[tuple[float, float]]) -> None:
    """Refuse a mesh of more than `MOST_ELEMENTS` elements before it is made.

    A size h grows with the distance d from a fine surface as h + grading · d, and a tetrahedron of edge h fills
    h³/6√2. Integrated over d, an area A takes 6√2 A / (2 grading h²) elements.

    Parameters
    ----------
    volumes : iterable of (float, float)
        Volume in m³ and element size in m of each region.
    fine : iterable of (float, float)
        Area in m² and element size in m of each refined part.

    Raises
    ------
    UsageError
        With the estimate.
    """
    per_volume = 6 * 2**0.5
    count = sum(per_volume * volume / h**3 for volume, h in volumes)
    count += sum(per_volume * area / (2 * GRADING * h**2) for area, h in fine)
    if count > MOST_ELEMENTS:
        raise UsageError(
            f"The mesh would have about {count:.2g} elements, more than {MOST_ELEMENTS}.",
            why="Halving the size takes 8 times the elements in a volume, 4 times at a surface.",
            fix="Choose larger elements, or refine a smaller part of the surface.",
        )
