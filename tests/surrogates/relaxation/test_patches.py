"""Where patches lie."""

from __future__ import annotations

import numpy as np
import pytest
from relaxing import bed

from palpate.errors import UsageError
from palpate.surrogates.memories import Patches

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def test_patches_cover_a_surface_evenly():
    """On a square of side 1 with spacing 1/10: as many as there are squares of that side, each point near one."""
    patches = Patches.over(SQUARE, HALVES, 0.1, width=0.1, energy=0.0)
    assert len(patches) == 100
    x = np.linspace(0, 1, 33)
    places = np.stack([*np.meshgrid(x, x), np.zeros((33, 33))], axis=-1).reshape(-1, 1, 3)
    assert np.linalg.norm(places - patches.points, axis=2).min(axis=1).max() < 0.1


def test_patches_do_not_depend_on_the_mesh():
    middle = np.vstack([SQUARE, [0.5, 0.5, 0]])
    quarters = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    one, other = (
        Patches.over(*m, 0.1, width=0.1, energy=0.0) for m in ((SQUARE, HALVES), (middle, quarters))
    )
    assert len(one) == len(other)
    assert np.abs(one.points - other.points).max() < 0.05


def test_mistaken_patches_are_refused():
    for arguments in ((np.zeros((0, 3)), 1.0), (np.zeros((1, 3)), 0.0), (np.full((1, 3), np.nan), 1.0)):
        with pytest.raises(UsageError):
            Patches(*arguments)
    with pytest.raises(UsageError, match="would be"):
        Patches.over(SQUARE, HALVES, 1e-3, width=0.1, energy=0.0)
    with pytest.raises(UsageError, match="apart"):
        Patches.over(SQUARE, HALVES, 0.0, width=0.1, energy=0.0)
    assert "patches" in str(bed())
