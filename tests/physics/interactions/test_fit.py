"""What has no room on the body is refused before anything is solved."""

from __future__ import annotations

import pytest

from palpate.errors import UsageError
from palpate.physics.interactions import SphereProbe
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block, Dome
from palpate.physics.solid import Body


def ranges(probe, body=None):
    return (body or BLOCK).problem(probe).ranges


BLOCK = Body(Block((0.06, 0.04, 0.02)), NeoHookean(9e3, 0.4))


@pytest.mark.grid
@pytest.mark.parametrize(
    ("touches", "over", "words"),
    [
        ("top", ((0.0, 0.0), (0.09, 0.04)), r"30 mm beyond the surface along x"),
        ("top", ((0.0, -0.003), (0.06, 0.04)), r"3 mm beyond the surface along y"),
        ("x_max", ((0.05, 0.0, 0.0), (0.06, 0.04, 0.025)), r"5 mm beyond the surface along z"),
    ],
)
def test_contact_points_beyond_a_plane_are_refused(touches, over, words):
    with pytest.raises(UsageError, match=words):
        ranges(SphereProbe(0.01, touches=touches, depth=(0.0, 0.004), over=over))


def test_a_depth_of_the_whole_thickness_is_refused():
    with pytest.raises(UsageError, match=r"20 mm deep.*\n.*20 mm thick"):
        ranges(SphereProbe(0.01, depth=(0.0, 0.02), over=((0.0, 0.0), (0.06, 0.04))))
    with pytest.raises(UsageError, match="60 mm thick"):
        ranges(SphereProbe(0.01, touches="x_max", depth=(0.0, 0.06)))


def test_the_whole_face_with_its_edges_is_fine():
    whole = ranges(SphereProbe(0.01, depth=(0.0, 0.006), over=((0.0, 0.0), (0.06, 0.04))))
    assert (whole[0].low, whole[0].high) == pytest.approx((0.0, 0.06))
    assert (whole[1].low, whole[1].high) == pytest.approx((0.0, 0.04))


@pytest.mark.full
def test_a_box_around_a_round_surface_may_be_larger():
    dome = Body(Dome(radius=0.05, element=0.03), NeoHookean(9e3, 0.4))
    probe = SphereProbe(0.015, depth=(0.0, 0.01), over=((-0.06, -0.06), (0.06, 0.06)))
    assert ranges(probe, dome)
