"""A scan that cuts itself, with holes and triangles inside out, is wrapped: closed, near it, of its volume."""

from __future__ import annotations

import numpy as np
import pytest
from ngsolve import Integrate
from trimesh import Trimesh
from trimesh.creation import box, icosphere

import palpate as pp
from palpate.errors import UsageError
from palpate.physics.shapes.surface_checks import require_closed
from palpate.physics.shapes.surface_repair import Surface
from palpate.physics.shapes.surface_wrap import wrap_surface

RADII, APART = (0.025, 0.020), 0.028  # m
SIZE = 0.002  # m


def blobs(noise=0.0002):
    """Points and triangles of two balls that overlap, with noise, a patch inside out and a hole of 4 mm."""
    rng = np.random.default_rng(0)
    parts = []
    for number, radius in enumerate(RADII):
        ball = icosphere(4)
        points = (radius + noise * rng.normal(size=len(ball.vertices)))[:, None] * ball.vertices
        parts.append((points + np.array([number * APART, 0, 0]), ball.faces + number * len(points)))
    points, triangles = (np.concatenate(some) for some in zip(*parts, strict=True))
    middles = points[triangles].mean(axis=1)
    turned = np.linalg.norm(middles - np.array([0, RADII[0], 0]), axis=1) < 0.006
    triangles[turned] = triangles[turned, ::-1]
    return points, triangles[np.linalg.norm(middles - np.array([0, -RADII[0], 0]), axis=1) > 0.002]


def union_volume():
    """Volume in m³ of two balls less that of the lens in both, in closed form."""
    R, r = RADII
    lens = np.pi * (R + r - APART) ** 2 * (APART**2 + 2 * APART * (R + r) - 3 * (R - r) ** 2) / (12 * APART)
    return 4 / 3 * np.pi * (R**3 + r**3) - lens


def surface(points, triangles):
    return Surface(points, triangles, np.zeros(len(triangles), dtype=np.int64))


def test_a_scan_that_cuts_itself_becomes_a_closed_surface_near_it():
    wrapped, moved = wrap_surface(surface(*blobs()), SIZE)
    mesh = Trimesh(wrapped.points, wrapped.triangles, process=False)
    require_closed(mesh, "the wrap")
    assert mesh.volume == pytest.approx(union_volume(), rel=0.03)
    assert moved.most <= SIZE
    assert moved.p95 <= SIZE / 4
    # by the balls' own equations: each point lies on the outer one
    off = [np.linalg.norm(wrapped.points - [i * APART, 0, 0], axis=1) - r for i, r in enumerate(RADII)]
    assert np.abs(np.minimum(*off)).max() <= SIZE


def write(path, points, triangles):
    Trimesh(1e3 * points, triangles, process=False).export(path)
    return path


@pytest.mark.full
def test_it_is_refused_with_an_offer_and_meshes_when_wrapped(tmp_path):
    path = write(tmp_path / "scan.stl", *blobs())
    with pytest.raises(UsageError, match="--wrap"):
        _ = pp.shapes.ImportedSolid(path, "mm").skin
    shape = pp.shapes.ImportedSolid(path, "mm", element=0.02, wrap=2 * SIZE)
    with pytest.warns(match="was wrapped"):
        assert any("was wrapped" in note for note in shape.notes)
    assert Integrate(1.0, shape.mesh()) == pytest.approx(union_volume(), rel=0.05)


def test_a_wrap_too_fine_for_memory_is_refused():
    with pytest.raises(UsageError, match="too fine"):
        wrap_surface(surface(*blobs()), 1e-5)


def test_a_wrap_too_coarse_for_a_thin_body_is_refused():
    """Refused where a cube would lose a tenth of its volume, taken where it does not."""
    cube = box(extents=(0.004, 0.004, 0.004))
    with pytest.raises(UsageError, match=r"too coarse for a surface 4 mm thin") as refusal:
        wrap_surface(surface(cube.vertices, cube.faces), 0.001)
    assert "0.5 mm" in refusal.value.fix
    wrapped, _ = wrap_surface(surface(cube.vertices, cube.faces), 0.0005)
    volume = Trimesh(wrapped.points, wrapped.triangles, process=False).volume
    assert volume == pytest.approx(0.004**3, rel=1 / 12)


def test_a_wrap_that_misses_a_part_is_refused():
    """A small ball apart from a large one would be left out as a crumb."""
    balls = [icosphere(3, radius=0.025), icosphere(2, radius=0.004)]
    balls[1].apply_translation((0.05, 0, 0))
    points = np.concatenate([ball.vertices for ball in balls])
    triangles = np.concatenate([balls[0].faces, balls[1].faces + len(balls[0].vertices)])
    with pytest.raises(UsageError, match="misses a part") as refusal:
        wrap_surface(surface(points, triangles), 0.003)
    assert "piece of its own" in refusal.value.why
