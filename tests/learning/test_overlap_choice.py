"""Learning chooses between closest point and overlap, on solves of an independent solver."""

from __future__ import annotations

import numpy as np
import pytest

import half_space
from palpate.improvement.force_model import ForceModel
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


@pytest.fixture(scope="module")
def forms():
    """The closest point on the grooves, and the overlap with weights ½, ¾ and 1."""
    surface = TouchedSurface.of(*half_space.mesh(), radius=half_space.R, spacing=half_space.R / 8)
    law, overlap = ContactLaw("hertz"), Overlap.of(surface, *half_space.mesh())
    weighted = [
        OverlapBaseline(law, surface, half_space.R, overlap=overlap.change(m), weight=m)
        for m in (0.5, 0.75, 1.0)
    ]
    return ContactBaseline(law, surface, half_space.R), weighted


def test_over_grooves_the_overlap_is_chosen(forms):
    closest, weighted = forms
    quick = {"effort": 0.02, "networks": 1, "units_max": 2, "workers": 1}
    energy, _ = learn_energy(half_space.solves(24, 0), closest, rivals=lambda: weighted, **quick)
    assert isinstance(energy.baseline, OverlapBaseline)


@pytest.mark.parametrize("seed", range(3))
def test_the_process_that_chooses_solves_counts_from_the_overlap_and_expects_forces_better(forms, seed):
    """Without a network: of 16 solves the 95th percentile of 40 unseen errors falls by a quarter at least."""
    closest, weighted = forms
    solves, unseen = half_space.solves(16, seed), half_space.solves(40, 77)

    def p95(model):
        error = np.linalg.norm(model.force(unseen.X) - unseen.force, axis=1)
        size = np.linalg.norm(unseen.force, axis=1)
        return np.quantile(error / np.maximum(size, 0.05 * size.max()), 0.95)

    begun = ForceModel.fit(solves, closest)
    later = ForceModel.fit(solves, weighted[1], begun)
    assert isinstance(later.baseline, OverlapBaseline)
    assert p95(later) < 0.75 * p95(begun)


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
