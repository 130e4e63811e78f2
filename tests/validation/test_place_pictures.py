"""The picture of where the ball went: every solve is drawn where it touches, over the outline of the body."""

from __future__ import annotations

import numpy as np

from palpate.physics.shapes.sample_part import kidney_surface
from palpate.validation.report.place_pictures import plot_places, silhouette
from palpate.validation.report.touch_pictures import contact_points
from pressed import places, surrogate


def test_every_solve_is_drawn_where_it_touches():
    energy = surrogate().energy
    learnt, unseen = places(12), places(30)[20:]
    axis = plot_places(energy, learnt, unseen).axes[0]
    for drawn, X in zip(axis.collections, (learnt, unseen), strict=True):
        np.testing.assert_allclose(drawn.get_offsets(), 1e3 * contact_points(energy, X)[:, :2], atol=1e-9)
    assert [text.get_text() for text in axis.get_legend().get_texts()] == ["learnt from", "unseen"]


def test_the_outline_goes_once_around():
    points, triangles = kidney_surface(3)
    ends = silhouette(points, triangles, np.array([0.0, 0.0, 1.0]))
    assert not (np.bincount(ends.ravel()) % 2).any(), "its lines are closed"
    flat = points[np.unique(ends)][:, :2]
    for k in (0, 1):  # it reaches as far as the body
        assert np.isclose(np.ptp(flat[:, k]), np.ptp(points[:, k]), rtol=2e-2)
