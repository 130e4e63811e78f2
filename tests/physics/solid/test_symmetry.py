"""Isometries of bodies: shapes' surfaces go where they say, and what breaks a symmetry breaks it."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.physics import (
    Block,
    Body,
    Cylinder,
    Dome,
    FibreFamily,
    FibreReinforced,
    GluedPad,
    Inclusion,
    LayeredBlock,
    NeoHookean,
    Organ,
    SphereProbe,
    Tube,
)
from palpate.physics.solid.body_symmetry import fundamental_part, symmetry_of

SOFT = NeoHookean(9e3, 0.45)
CUBE = Block((0.1, 0.1, 0.1))


@pytest.mark.full
@pytest.mark.parametrize(
    ("shape", "count"),
    [
        (CUBE, 48),
        (Block((0.1, 0.1, 0.05)), 16),
        (Block((0.1, 0.08, 0.05)), 8),
        (LayeredBlock((0.1, 0.1), (("a", 0.02), ("b", 0.03))), 8),
        (Dome(0.06, 0.045), 16),
        (Dome(0.06, 0.045, inclusion=Inclusion((0.01, 0.02, 0.02), 0.005)), 2),
        (Cylinder(0.05, 0.05), 16),
        (Tube(), 16),
    ],
)
def test_isometries_take_surfaces_where_they_say(shape, count):
    """A group of so many; each face's box and normal go to those of the face that is named."""
    group = shape.isometries
    assert len(group) == count
    products = [a.matrix @ b.matrix for a in group for b in group]
    assert all(any(np.allclose(p, one.matrix) for one in group) for p in products[:: max(1, count // 3)])
    faces = {face.name: face for face in shape.faces}
    area = max(face.area for face in faces.values())
    for one in group:
        for face in faces.values():
            there = faces[one.surface(face.name)]
            centre = one.about + one.matrix @ (np.array(face.centre) - one.about)
            # facets of a round face are not quite symmetric
            assert np.allclose(centre, there.centre, atol=2e-3)
            assert np.allclose(one.matrix @ face.normal, there.normal, atol=0.05)
            assert face.area == pytest.approx(there.area, abs=0.02 * area)


@pytest.mark.parametrize(
    ("body", "touches", "count"),
    [
        (Body(CUBE, SOFT), "top", 8),
        (Body(CUBE, SOFT), "x_max", 2),
        (Body(CUBE, SOFT, fixed=("bottom", "x_min")), "top", 2),
        (Body(CUBE, SOFT, fixed="side"), "top", 8),
        (Body(CUBE, NeoHookean(9e3, 0.45, density=1e3), gravity=(0.0, 9.81, 0.0)), "top", 2),
        (Body(CUBE, NeoHookean(9e3, 0.45, density=1e3), gravity=(0.0, 0.0, -9.81)), "top", 8),
        (Body(Organ(), SOFT, fixed="attached"), "front", 1),
        (Body(CUBE, FibreReinforced(SOFT, (FibreFamily((1, 0, 0), 1e4, 1.0),))), "top", 1),
    ],
)
def test_supports_surface_gravity_and_fibres_break_a_symmetry(body, touches, count):
    assert len(symmetry_of(body, touches)) == count


@pytest.mark.parametrize(
    ("shape", "pad", "count"),
    [
        (CUBE, {"radius": 0.02, "over": ((0.04, 0.04), (0.06, 0.06))}, 8),
        (CUBE, {"radius": 0.02, "at": (0.05, 0.05, 0.1)}, 8),
        (CUBE, {"radius": 0.02, "at": (0.06, 0.05, 0.1)}, 2),
        (CUBE, {"radius": 0.02, "at": (0.06, 0.04, 0.1)}, 2),
        (CUBE, {"radius": 0.02, "at": (0.06, 0.055, 0.1)}, 1),
        (CUBE, {}, 8),
        (Block((0.1, 0.08, 0.05)), {"radius": 0.01, "over": ((0.03, 0.03), (0.06, 0.05))}, 4),
        # seen along x, a round side keeps the isometries that leave x a line
        (Cylinder(0.05, 0.1), {"touches": "side", "radius": 0.01, "at": (0.05, 0.0, 0.05)}, 2),
    ],
)
def test_a_pad_keeps_what_leaves_its_places_where_they_are(shape, pad, count):
    body = Body(shape, SOFT, fixed="bottom")
    told = body.problem(GluedPad(**pad, element=0.02)).symmetry
    assert len(told["isometries"]) == count
    M = np.array(told["isometries"])
    for one in M:  # a group
        for other in M:
            assert np.isclose(M, one @ other).all(axis=(1, 2)).any()


def test_images_of_the_fundamental_part_are_the_whole():
    """Every place of a square, and of a disc, is an image of one in the part that is solved."""
    random = np.random.default_rng(0).uniform(-1, 1, (400, 2))
    discs = random[np.hypot(*random.T) < 1]
    for shape, places, middle, half in (
        (CUBE, random, (0.05, 0.05), 0.04),
        (Dome(0.06, 0.045), discs, (0.0, 0.0), 0.04),
    ):
        middle = np.array(middle)
        over = (tuple(middle - half), tuple(middle + half))
        body, probe = Body(shape, SOFT), SphereProbe(0.01, touches="top", over=over)
        (x0, y0), (x1, y1) = fundamental_part(body, probe).over
        assert (x1 - x0) * (y1 - y0) <= half**2 * (1 + 1e-9)
        symmetry = symmetry_of(body, "top")
        for place in middle + half * places:
            images = middle + (symmetry.matrices[:, :2, :2] @ (place - middle))
            low, high = np.array((x0, y0)) - 1e-9, np.array((x1, y1)) + 1e-9
            inside = (images > low) & (images < high)
            assert inside.all(axis=1).any()


def test_contact_points_beside_the_middle_stay_whole():
    probe = SphereProbe(0.01, touches="top", over=((0.02, 0.03), (0.05, 0.06)))
    assert fundamental_part(Body(CUBE, SOFT), probe) == probe


def test_a_column_has_as_many_depths_as_asked():
    probe = SphereProbe(0.01, touches="top", depth=(0.001, 0.006))
    points = probe.design(CUBE, 12, seed=3, depths=4)
    assert len({tuple(p) for p in points[:, :2].round(9)}) == 3
    assert [len(rows) for rows in probe.chains(CUBE, points)] == [4, 4, 4]
