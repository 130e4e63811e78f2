"""The picture of where the ball went: solves to learn from and unseen ones, over the outline of the body."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.format import count
from palpate.surrogates import FieldSurrogate, LearntEnergy
from palpate.validation.report.chapter import Chapter
from palpate.validation.report.style import BLUE, INK, ORANGE, Picture, figure, picture
from palpate.validation.report.touch_pictures import View, contact_points

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["place_pictures", "plot_places", "silhouette"]

SMALL, LARGE = 10.0, 70.0  # points², areas of the dots of the shallowest and the deepest solve


def place_pictures(chapter: Chapter, key: str) -> list[Picture]:
    """Draw where the ball went; nothing for models that are not touched on a surface."""
    model, test = chapter.surrogate, chapter.subject.solves
    if test is None or model is None or model.hand_energy.baseline.surface is None:
        return []
    learnt = chapter.learnt_from if chapter.learnt_from.shape[1] == test.X.shape[1] else test.X[:0]
    field = next(iter(model.surface_fields.values()), None)
    told = f"{count(len(test.X), 'unseen solve')}"
    if len(learnt):
        told = f"{count(len(learnt), 'solve')} to learn from and {told}"
    return [
        picture(
            f"{key}-places",
            "Where the ball went",
            f"Places of {told} of {chapter.name} on the surface, seen from outside.",
            f"Filled: learnt from. Rings: unseen. The larger, the deeper. There are {told}.",
            lambda: plot_places(model.hand_energy, learnt, test.X, field),
        )
    ]


def plot_places(
    energy: LearntEnergy, learnt: np.ndarray, unseen: np.ndarray, field: FieldSurrogate | None = None
) -> Figure:
    """Draw the places of learnt (N, n) and unseen (M, n) solves on the touched surface, seen from where they come.

    The field has the body's surface, whose outline is drawn.
    """
    from matplotlib.collections import LineCollection

    fig, axes = figure(1, 1, size=(7.0, 4.2))
    axis, view = axes[0, 0], View.of(energy, np.vstack([learnt, unseen]))
    if field is not None:
        ends = silhouette(field.points, field.triangles, view.out)
        lines = 1e3 * view.flat(field.points[ends.ravel()]).reshape(-1, 2, 2)
        axis.add_collection(LineCollection(list(lines), colors=INK, linewidths=0.9, alpha=0.6))
    deepest = max(float(energy.depth(X).max()) for X in (learnt, unseen) if len(X))
    for X, looks, name in (
        (learnt, {"color": BLUE, "linewidths": 0}, "learnt from"),
        (unseen, {"facecolors": "none", "edgecolors": ORANGE, "linewidths": 1.3}, "unseen"),
    ):
        if len(X):
            share = np.clip(energy.depth(X) / max(deepest, 1e-12), 0.0, 1.0)
            size = SMALL + (LARGE - SMALL) * share
            axis.scatter(*(1e3 * view.flat(contact_points(energy, X))).T, s=size, label=name, **looks)
    across, up = view.labels()
    axis.set_xlabel(across)
    axis.set_ylabel(up)
    axis.set_aspect("equal", adjustable="datalim")
    axis.autoscale_view()
    axis.legend(loc="best")
    return fig


def silhouette(points: np.ndarray, triangles: np.ndarray, out: np.ndarray) -> np.ndarray:
    """Return the edges (s, 2) of a closed surface between triangles that face a viewer and triangles that don't.

    `points` (n, 3) are in m, `triangles` (t, 3) counter-clockwise from outside, `out` (3,) points towards the viewer.
    """
    a, b, c = np.moveaxis(np.asarray(points)[triangles], 1, 0)
    faces = np.cross(b - a, c - a) @ out > 0.0
    edges = np.sort(
        np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1
    )
    known, which = np.unique(edges, axis=0, return_inverse=True)
    seen = np.bincount(which.ravel(), np.tile(faces, 3), minlength=len(known))
    return np.asarray(known[seen == 1])  # one of its two triangles faces the viewer
