"""Supports on which a surface slides."""

from __future__ import annotations

from palpate.physics.interactions.interaction import Held
from palpate.physics.interactions.prescribed import PrescribedDisplacement

__all__ = ["roller"]

Point = tuple[float, float, float]


def roller(surface: str, axis: str, within: tuple[Point, Point] | None = None) -> Held:
    """A support that holds one component of the displacement at zero and lets the others go.

    A plane of symmetry is a roller whose axis is the plane's normal, so a half, a quarter or an eighth of a body can
    stand for the whole of it.

    Parameters
    ----------
    surface : str
    axis : {"x", "y", "z"}
        The component that is held.
    within : pair of points, optional
        Corners in m of an upright box: only elements of the surface that lie in it are held.

    Returns
    -------
    Held
        To be handed to ``Body(..., held=(...))``.

    Raises
    ------
    UsageError
        If the axis is none.
    """
    # a range is asked for, and never used: the support stays where it is
    slide = PrescribedDisplacement(surface, axis, (-1.0, 1.0), sliding=True, within=within)
    return Held(slide, (0.0,))
