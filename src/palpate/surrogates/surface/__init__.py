"""The signed distance of a point from a touched surface: smooth, made once and asked within a microsecond.

::

    oriented_mesh      the triangles, checked: neighbours, borders, creases; normals at their corners
    curved_patches     the curved surface that they stand for, in small triangles
    nearest_triangle   the nearest of them
    measured_distance  the signed distance, point by point
    distance_table     splines through such distances
    distance_kernels   their compiled evaluation
    touched_surface    TouchedSurface, which the others make
    ball_overlap       Overlap, all of the surface that a ball meets
"""

from palpate.surrogates.surface.ball_overlap import Overlap
from palpate.surrogates.surface.distance_kernels import distance_into
from palpate.surrogates.surface.touched_surface import TouchedSurface

__all__ = ["Overlap", "TouchedSurface", "distance_into"]
