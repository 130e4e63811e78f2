"""Sample organs: each is closed, smooth, as large as its implicit body, and can be set up, meshed and touched."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from palpate.physics.shapes.sample_part import ORGANS, write_sample_part
from palpate.study.part_choices import chosen_study, shown_part
from palpate.study.part_study import part_study

CELLS = 60  # along each side of the box around an organ


@pytest.mark.grid
@pytest.mark.parametrize("name", ORGANS)
def test_an_organ_bounds_its_implicit_body(name: str, tmp_path: Path):
    """Its volume is that of the cells of a grid in which the function is negative; each ray leaves the body once."""
    organ, path = ORGANS[name], write_sample_part(tmp_path / f"{name}.stl", name)
    assert path.stat().st_size < 300_000
    surface = trimesh.load_mesh(path)
    assert surface.is_watertight
    assert surface.euler_number == 2
    assert np.degrees(surface.face_adjacency_angles.max()) < 30, "smooth: no edge is seen as sharp"
    points, _ = organ.surface()
    assert np.abs(organ.level(points)).max() < 1e-9
    low, high = points.min(axis=0), points.max(axis=0)
    sides = [a + (b - a) * (np.arange(CELLS) + 0.5) / CELLS for a, b in zip(low, high, strict=True)]
    is_in = organ.level(np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1)) < 0
    assert 1e-9 * surface.volume == pytest.approx(is_in.mean() * np.prod(high - low), rel=0.01)
    along = np.linspace(0.0, 0.999, 50)[:, None, None]
    assert (organ.level(organ.middle + along * (points - organ.middle)) < 0).all()


@pytest.mark.full
@pytest.mark.parametrize("name", ORGANS)
def test_a_finer_surface_of_an_organ_holds_as_much(name: str):
    volumes = [trimesh.Trimesh(*ORGANS[name].surface(n), process=False).volume for n in (3, 4, 5)]
    coarse, fine = np.abs(np.diff(volumes))
    assert coarse / fine == pytest.approx(4.0, rel=0.15), "the volume converges with the square of the edges"
    assert fine < 0.005 * volumes[-1]


@pytest.mark.full
@pytest.mark.parametrize("name", ORGANS)
def test_an_organ_is_set_up_and_meshed(name: str, tmp_path: Path):
    path = write_sample_part(tmp_path / f"{name}.stl", name)
    study, _ = part_study(path, material="prostate" if name == "prostate" else None)
    part = shown_part(study)
    assert len(part.faces) == 1
    assert part.held.any()
    assert part.touched.any()
    assert chosen_study(study, part.choices).body.surfaces == study.body.surfaces
    element = 0.05 * float(np.ptp(part.points, axis=0).max())
    mesh = study.body.model_copy(update={"element": element}).build().geometry.rest()
    corners = mesh.points[mesh.tetrahedra[:, :4]]
    volume = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum() / 6
    assert volume == pytest.approx(1e-9 * trimesh.load_mesh(path).volume, rel=0.03)
