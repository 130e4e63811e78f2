"""The overlap of a ball: against closed forms on a plane, spheres and a groove, and where it must be the distance."""

from __future__ import annotations

import functools

import numpy as np
import pytest
import skins

from palpate.surrogates import TouchedSurface
from palpate.surrogates.surface import Overlap
from palpate.surrogates.surface.ball_overlap import FACING, LEAST, MOST, plane_overlaps

R, LARGE = 0.010, 0.030


def smooth_step(t):
    t = np.clip(t, 0.0, 1.0)
    return t * t * (3 - 2 * t)


def sphere_overlap(s, inside):
    """V/R^{7/2} of a ball pressed s (in radii) into a sphere of 3 radii, from outside or within, by its definition.

    Points of the sphere at r from the ball's centre have the area 2π ρ r dr / D, D the way between the centres.
    """
    sign, rho = (-1, LARGE / R) if inside else (1, LARGE / R)
    D = rho + sign * (1 - s)
    t, w = np.polynomial.legendre.leggauss(400)
    r = 1 - s + s * (t + 1) / 2
    facing = sign * (D * D - rho * rho - r * r) / (2 * rho * r)
    return np.pi * rho / D * s * w @ ((1 - r) ** 1.5 * smooth_step(facing / FACING) * r)


@functools.cache
def of_sphere(inside):
    points, triangles = skins.ball(LARGE, 10)
    triangles = triangles[:, ::-1] if inside else triangles
    surface = TouchedSurface.of(points, triangles, radius=R, inner=R if inside else None)
    return surface, Overlap.of(surface, points, triangles)


def directions(count):
    u = np.random.default_rng(1).normal(size=(count, 3))
    return u / np.linalg.norm(u, axis=1)[:, None]


def test_a_plane_overlap_is_that_of_an_elastic_foundation():
    """For small s, ∫ (s − ρ²/2R)^{3/2} dA = 2π R (2/5) s^{5/2}."""
    s = np.array([1e-4, 1e-3])
    assert plane_overlaps(s) == pytest.approx(0.8 * np.pi * s**2.5, rel=2 * s.max())


@pytest.mark.parametrize("inside", [False, pytest.param(True, marks=pytest.mark.full)])
def test_the_equivalent_depth_on_a_sphere_has_the_same_overlap(inside):
    surface, overlap = of_sphere(inside)
    field = overlap.field(1.0)
    for s in (0.06, 0.2, 0.5):
        height = LARGE - R * (1 - s) if inside else LARGE + R * (1 - s)
        equivalent = 1 - field.at(height * directions(100))[0] / R
        assert plane_overlaps(equivalent) == pytest.approx(sphere_overlap(s, inside), rel=0.02)
    # for small depths V goes with the effective radius R' = 1/(1/R ± 1/ρ), and s_V with V^{2/5}
    s, far = node_depths(surface)
    ratio = np.exp(
        overlap.log_ratio[(np.abs(s - LEAST * R) < 0.01 * R) & (far < (LARGE if inside else 2 * LARGE))]
    )
    assert ratio == pytest.approx((1 / (1 + (-1 if inside else 1) * R / LARGE)) ** 0.4, rel=0.02)


def node_depths(surface):
    shape = surface.coefficients.shape
    places = surface.frame[:3] + surface.spacing * np.argwhere(np.ones(shape, dtype=bool))
    return (R - surface.at(places)[0]).reshape(shape), np.linalg.norm(places, axis=1).reshape(shape)


def test_a_touch_begins_where_the_surface_does():
    surface, overlap = of_sphere(False)
    for weight in (0.5, 1.0):
        d = overlap.field(weight).at((LARGE + R) * directions(300))[0]
        assert d == pytest.approx(surface.at((LARGE + R) * directions(300))[0], abs=2e-6)


def test_over_straight_faces_the_equivalent_depth_is_that_in_the_face():
    """In the middle of a face that is wider than the contact, the surface through the corners lies a gap above it."""
    radius = R / 2
    points, triangles = skins.ball(LARGE, 5)
    surface = TouchedSurface.of(points, triangles, radius=radius)
    field = Overlap.of(surface, points, triangles, straight=True).field(1.0)
    middles = points[triangles].mean(axis=1)
    heights = np.linalg.norm(middles, axis=1)
    widest = np.argsort(heights)[:8]  # the lowest in the ball, so the widest
    outward, gap = middles[widest] / heights[widest, None], LARGE - heights[widest]
    for depth in (0.75e-3, 0.9e-3):
        e = field.at((LARGE + radius - gap - depth)[:, None] * outward)[0]
        assert radius - e == pytest.approx(depth, rel=0.1)


def test_no_weight_of_the_overlap_is_the_distance():
    surface, overlap = of_sphere(False)
    assert np.array_equal(overlap.field(0.0).coefficients, surface.coefficients)


def test_half_of_the_overlap_is_hertz_on_a_sphere():
    """U ∝ √R' s^{5/2}: the law s^{5/2} at the equivalent depth differs from that on a plane by √(R'/R)."""
    _, overlap = of_sphere(False)
    s = 0.06
    got = R - overlap.field(0.5).at((LARGE + R * (1 - s)) * directions(100))[0]
    assert (got / (s * R)) ** 2.5 == pytest.approx((1 / (1 + R / LARGE)) ** 0.5, rel=0.02)


def test_a_flat_surface_has_none():
    points, triangles = skins.plate(0.1, 2)
    assert Overlap.of(TouchedSurface.of(points, triangles, radius=R), points, triangles) is None


def groove(depth):
    """A channel with walls that slope by one half, the middle at x = 0; ridges to both sides at y = ± 12 mm."""
    x = np.linspace(-12.0, 12.0, 13)
    y = np.array([-12.0, 0.0, 12.0])
    points = np.stack([*np.meshgrid(x, y, indexing="ij"), np.zeros((13, 3))], -1).reshape(-1, 3)
    points[:, 2] = depth * np.abs(points[:, 1]) / 12.0
    return 1e-3 * points, skins.quads(3 * np.arange(13)[:, None] + np.arange(3))


def test_a_ball_between_two_walls_meets_twice_as_much():
    """In the middle of a channel both walls are as near: V is twice that of one, and the force points straight up."""
    points, triangles = groove(6.0)
    surface = TouchedSurface.of(points, triangles, radius=R, spacing=R / 8)
    field = Overlap.of(surface, points, triangles).field(1.0)
    slant = np.hypot(12.0, 6.0) / 12.0
    for s in (0.06, 0.1):  # the two contacts do not meet yet
        C = np.column_stack([np.linspace(-1e-3, 1e-3, 5), np.zeros(5), np.full(5, R * (1 - s) * slant)])
        d, slope, _ = field.at(C)
        assert plane_overlaps(1 - d / R) == pytest.approx(2 * plane_overlaps(np.array(s)), rel=0.25)
        assert np.abs(slope[:, 1]).max() < 0.01 * np.abs(slope[:, 2]).min()


def test_k_is_that_of_the_nearest_measured_depth_outside_of_where_it_is_measured():
    """Over a sphere k depends on the depth alone."""
    _, overlap = of_sphere(False)
    e = overlap.field(1.0)
    for s, at in ((-0.02, LEAST), (0.02, LEAST), (0.8, MOST)):
        d = e.at((LARGE + R * (1 - s)) * directions(100))[0]
        assert 1 - d / R == pytest.approx(sphere_k(at) * s, abs=0.01 * max(abs(s), 0.05))


def sphere_k(s):
    depths = np.linspace(1e-3, 0.9, 20_000)
    return np.interp(sphere_overlap(s, False), plane_overlaps(depths), depths) / s


def test_a_overlap_survives_its_file():
    surface, overlap = of_sphere(False)
    again = Overlap.from_arrays(surface, overlap.arrays())
    assert np.array_equal(again.log_ratio, overlap.log_ratio)
