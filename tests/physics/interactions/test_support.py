"""A roller makes a part of a body stand for the whole of it."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.physics.interactions import SurfaceTraction, roller
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block
from palpate.physics.solid import Body

SIZE = (0.02, 0.02, 0.02)
GEL = NeoHookean(young=9e3, poisson=0.4)


def test_a_block_on_three_planes_of_symmetry_stretches_evenly():
    """Uniaxial: the displacement is linear, zero on the planes, and free to shrink sideways."""
    low = ((-1.0, -1.0, -1.0), (0.0, 1.0, 1.0)), ((-1.0, -1.0, -1.0), (1.0, 0.0, 1.0))
    held = (roller("side", "x", low[0]), roller("side", "y", low[1]), roller("bottom", "z"))
    body = Body(Block(SIZE, element=0.02), GEL, fixed=(), held=held)
    found = body.problem(SurfaceTraction("top", "z", (0.0, 5e3))).solve(3e3)
    assert found.converged, found.message
    at = found.mesh.points
    slopes = [np.polyfit(at[:, i], found.displacement[:, i], 1)[0] for i in range(3)]
    np.testing.assert_allclose(found.displacement, at * slopes, atol=1e-9)
    assert slopes[2] > 0.2
    assert slopes[0] == pytest.approx(slopes[1], rel=1e-7)
    assert slopes[0] < -0.05


def test_an_oblique_roller_is_refused():
    with pytest.raises(UsageError):
        roller("bottom", "up")
