"""Learning chooses between closest point and overlap, on solves of an independent solver."""

from __future__ import annotations

import numpy as np
import pytest

import half_space
from palpate.learning.energy import learn_energy
from palpate.surrogates import ContactBaseline, ContactLaw, TouchedSurface
from palpate.surrogates.baselines import OverlapBaseline
from palpate.surrogates.surface import Overlap

pytestmark = pytest.mark.full


def test_the_half_space_solver_is_hertz_on_a_plane_and_has_the_gradient_of_its_energy():
    s, R, E = 4e-4, half_space.R, half_space.MODULUS
    U, F = half_space.press(np.array([0.0, 0.0, R - s]), depth=0.0)
    assert pytest.approx(8 / 15 * E * np.sqrt(R) * s**2.5, rel=0.02) == U
    assert pytest.approx([0.0, 0.0, 4 / 3 * E * np.sqrt(R) * s**1.5], rel=0.02, abs=1e-12) == F
    c, h = np.array([3e-4, 2e-4, R - 1e-3]), 2e-6
    by_difference = [
        (half_space.press(c - h * e)[0] - half_space.press(c + h * e)[0]) / (2 * h) for e in np.eye(3)
    ]
    assert by_difference == pytest.approx(half_space.press(c)[1], rel=0.01)


def test_over_grooves_the_overlap_is_chosen():
    surface = TouchedSurface.of(*half_space.mesh(), radius=half_space.R, spacing=half_space.R / 8)
    closest = ContactBaseline(ContactLaw("hertz"), surface, half_space.R)
    overlap = Overlap.of(surface, *half_space.mesh())
    forms = [
        OverlapBaseline(closest.law, surface, half_space.R, overlap=overlap.field(m), weight=m)
        for m in (0.5, 1.0)
    ]
    quick = {"effort": 0.02, "networks": 1, "units_max": 2, "workers": 1}
    energy, _ = learn_energy(half_space.solves(24, 0), closest, rivals=lambda: forms, **quick)
    assert isinstance(energy.baseline, OverlapBaseline)


def test_on_a_plane_the_closest_point_is_kept_and_no_overlap_made():
    """Hertz's law with one factor is exact to some percent there."""
    points, triangles = half_space.mesh(depth=0.0, step=6e-3)
    surface = TouchedSurface.of(points, triangles, radius=half_space.R)
    solves = half_space.solves(16, 2, depth=0.0, shallowest=1e-3)

    def refuse():
        raise AssertionError("the closest point is good enough")

    closest = ContactBaseline(ContactLaw("hertz"), surface, half_space.R)
    energy, _ = learn_energy(solves, closest, rivals=refuse, effort=0.02, networks=1, units_max=2, workers=1)
    assert type(energy.baseline) is ContactBaseline
