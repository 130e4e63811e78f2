"""How far a point is from a touched surface: a smooth signed distance, made once and asked within a microsecond.

::

    skin      the triangles, checked: neighbours, borders, creases
    normals   at their corners
    curved    the curved surface that they stand for, in small triangles
    nearest   the nearest of them
    exact     signed distance, measured point by point
    grid      a spline on a grid of such distances
    spline    its compiled evaluation
    touched   TouchedSurface, what the others make
"""

from palpate.surrogates.surface.spline import distance_into, distances_into
from palpate.surrogates.surface.touched import TouchedSurface

__all__ = ["TouchedSurface", "distance_into", "distances_into"]
