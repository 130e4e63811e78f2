"""The picture of a body in space, pressed as deeply as an unseen solve presses it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.format import length
from palpate.surrogates import FieldSurrogate, Surrogate
from palpate.validation.report.chapter import Chapter
from palpate.validation.report.style import Picture, figure, picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["body_pictures", "drawn_triangles"]

ASIDE = np.array([0.5, -0.7, 0.45])  # from the pressed place towards whoever looks, beside the outward normal
LIGHT = np.array([0.2, -0.5, 0.85])
LIGHT_SHARE = 0.5  # of a colour that depends on how a triangle faces the light
REST, MOVED = (
    np.array([0.80, 0.83, 0.85]),
    np.array([0.85, 0.39, 0.17]),
)  # colours where nothing moves, and most


def body_pictures(chapter: Chapter, key: str) -> list[Picture]:
    """Draw the body under the deepest unseen touch; nothing for a body whose surface is not known."""
    model, test = chapter.surrogate, chapter.subject.solves
    field = chapter.subject.field
    if test is None or model is None or field is None or field.rest.shape[1] != 3:
        return []
    depths = model.hand_energy.depth(test.X)
    x = test.X[int(np.argmax(depths))]
    moved = field.values(x[None])[0]
    largest = float(np.linalg.norm(moved, axis=1).max())
    depth = length(float(depths.max()))
    return [
        picture(
            f"{key}-body",
            "The body",
            f"{chapter.name}, pressed {depth} deep; its surface moves by up to {length(largest)}.",
            f"Pressed {depth} deep, as in the deepest unseen solve, and drawn to scale. Colours show the displacement, "
            f"up to {length(largest)}.",
            lambda: _draw(field, moved, largest, _towards(model, x)),
        )
    ]


def _towards(model: Surrogate, x: np.ndarray) -> np.ndarray:
    """Return the direction (3,) from which the place that inputs (n,) press is seen."""
    surface = model.hand_energy.baseline.surface
    return ASIDE if surface is None else ASIDE + surface.at(np.ascontiguousarray(x[None, :3]))[1][0]


def _draw(field: FieldSurrogate, moved: np.ndarray, largest: float, out: np.ndarray) -> Figure:
    """Draw the surface with its displacement (n, 3), m, as seen from `out` (3,)."""
    from matplotlib.collections import PolyCollection

    fig, axes = figure(1, 1, size=(5.6, 3.0))
    axis = axes[0, 0]
    flat, order, shade = drawn_triangles(field.points + moved, field.triangles, out)
    size = np.linalg.norm(moved, axis=1)[field.triangles[order]].mean(axis=1)
    share = (size / max(largest, 1e-12))[:, None]
    colours = shade[:, None] * ((1.0 - share) * REST + share * MOVED)
    axis.add_collection(
        # a picture in the picture: thousands of triangles weigh more
        PolyCollection(
            list(1e3 * flat), facecolors=colours, edgecolors=colours, linewidths=0.3, rasterized=True
        )
    )
    axis.set_aspect("equal")
    axis.autoscale_view()
    axis.set_axis_off()
    return fig


def drawn_triangles(
    points: np.ndarray, triangles: np.ndarray, out: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what is seen of a closed surface from `out` (3,), which is not upright, the farthest triangle first.

    `points` (n, 3) are in m, `triangles` (t, 3) counter-clockwise from outside. The seen ones come as corners on the
    page (s, 3, 2), m, as their rows of `triangles` (s,), and with the share of light (s,) that each takes.
    """
    out = out / np.linalg.norm(out)
    across = np.cross([0.0, 0.0, 1.0], out)
    across /= np.linalg.norm(across)
    up = np.cross(out, across)
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    seen = np.flatnonzero(normals @ out > 0.0)
    order = seen[np.argsort(corners[seen].mean(axis=1) @ out, kind="stable")]
    towards_light = normals[order] @ LIGHT / (np.linalg.norm(normals[order], axis=1) * np.linalg.norm(LIGHT))
    shade = 1.0 - LIGHT_SHARE * (1.0 - np.clip(towards_light, 0.0, 1.0))
    return corners[order] @ np.stack([across, up], axis=1), order, shade
