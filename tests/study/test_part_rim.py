"""The rim of a painted surface: as wide as the largest contact, nothing that is held, and only where it goes on."""

from __future__ import annotations

import math
from pathlib import Path

import meshio
import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from palpate.errors import StudyError, UsageError
from palpate.physics.shapes import Block, ImportedSolid, SurfacePatch
from palpate.study import Study
from palpate.study.part_rim import contact_radius, with_rim
from palpate.study.part_study import part_study

BALL = 0.02  # m, radius of the round part


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a ball and a block as STL files in mm."""
    path = tmp_path_factory.mktemp("rims")
    trimesh.creation.icosphere(subdivisions=4, radius=1e3 * BALL).export(path / "ball.stl")
    mesh = Block(size=(0.04, 0.03, 0.02), element=0.004).rest()
    meshio.Mesh(1e3 * mesh.points, [("triangle", mesh.triangles)]).write(path / "block.stl", binary=True)
    return path


@pytest.fixture(scope="module")
def ball(folder: Path) -> Study:
    return part_study(folder / "ball.stl", radius=0.004, depth=0.002)[0]


def test_a_contact_is_a_cap_of_the_ball():
    # Pythagoras: the plane that cuts a cap of height d off a ball of radius R lies R − d from its centre
    assert contact_radius(0.01, 0.004) == pytest.approx(math.sqrt(0.01**2 - 0.006**2))
    assert contact_radius(0.01, 0.02) == 0.01


def test_the_rim_of_a_cap_is_a_zone_as_wide_as_the_contact(ball: Study):
    skin = ball.body.shape().skin
    middle = skin.points[skin.triangles].mean(axis=1)
    angle = np.arccos(skin.normals[:, 2])  # from the top
    width = contact_radius(0.004, 0.002)
    edge = np.radians(60.0)  # what faces up
    rim, touched = skin.on("rim"), skin.on("touched")
    assert touched[angle < edge - 0.01].all()
    size = np.sqrt(4 * np.pi * BALL**2 / len(skin.triangles))
    assert rim[(angle > edge + 0.01) & (angle < edge + (width - size) / BALL)].all()
    assert not rim[angle > edge + (width + 2 * size) / BALL].any()
    assert cKDTree(middle[touched]).query(middle[rim])[0].max() <= width + size


def test_what_is_held_is_no_rim(ball: Study):
    surfaces = [s if s.name != "held" else s.model_copy(update={"below": 0.009}) for s in ball.body.surfaces]
    lower = with_rim(
        ball.model_copy(update={"body": ball.body.model_copy(update={"surfaces": tuple(surfaces)})})
    )
    skin = lower.body.shape().skin
    held = skin.on("held")
    middle = skin.points[skin.triangles].mean(axis=1)
    assert held[middle[:, 2] < 0.0089].all()
    assert skin.on("rim").any()
    assert not (skin.on("rim") & held).any()


def test_where_edges_are_sharp_the_places_keep_their_margin(folder: Path):
    study = part_study(folder / "block.stl", radius=0.006)[0]
    assert study.interaction.rim is None
    assert {s.name for s in study.body.surfaces} == {"touched"}


def test_the_back_of_a_thin_wall_does_not_belong(folder: Path):
    around = SurfacePatch("rim", around="top", reach=0.05)
    top = SurfacePatch("top", facing=(0, 0, 1), lower=(-1, -1, 0.0199))
    solid = ImportedSolid(str(folder / "block.stl"), "mm", patches=(top, around))
    with pytest.raises(UsageError, match="'rim' contains no part"):
        _ = solid.surfaces


def test_a_rim_needs_both_its_surface_and_its_reach(ball: Study):
    with pytest.raises(UsageError, match="reach"):
        SurfacePatch("rim", around="top")
    record = ball.body.surfaces[-1].model_dump()
    for name in ("around", "reach"):
        with pytest.raises((ValueError, StudyError), match="go together"):
            type(ball.body.surfaces[-1]).model_validate({**record, name: "" if name == "around" else None})


def test_the_places_are_all_over_the_touched_surface(ball: Study):
    problem = ball.problem()
    X = problem.design(60, 0, depths=1)
    angle = np.degrees(np.arccos(X[:, 2] / np.linalg.norm(X, axis=1)))
    # the area of a cap grows as 1 − cos: of 60 even places so many lie within half the angle
    half = (1 - math.cos(math.radians(30))) / (1 - math.cos(math.radians(60)))
    assert (angle < 30).mean() == pytest.approx(half, abs=0.09)
    assert angle.max() > 54
    depth = BALL + 0.004 - np.linalg.norm(X, axis=1)
    assert depth.min() > 0
    assert depth.max() < 0.0022
    low, high = np.array([(r.low, r.high) for r in problem.ranges]).T
    assert ((low <= X) & (high >= X)).all()


def test_presses_that_judge_are_even_over_area_and_depth(ball: Study):
    problem = ball.problem()
    X = problem.interactions[0].random_presses(problem.body.geometry, 2000, seed=1)
    away = np.linalg.norm(X, axis=1)
    height, depth = X[:, 2] / away, BALL + 0.004 - away
    # Archimedes: on a sphere even by area is even by height, here from cos 60° to 1; so is the depth between its ends
    for values, low, high in ((height, 0.5, 1.0), (depth, *ball.interaction.depth)):
        shares = np.histogram(values, np.linspace(low, high, 5))[0] / len(X)
        assert shares == pytest.approx(0.25, abs=0.04)  # four deviations of a binomial law
