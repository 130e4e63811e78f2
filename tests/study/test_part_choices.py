"""Choices made on a page become a study: picks by name or as triangles, and one sentence for what does not fit."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import meshio
import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.physics.shapes import Block
from palpate.physics.shapes.sample_part import write_sample_part
from palpate.physics.shapes.triangle_list import read_triangles, triangle_text
from palpate.study import Study, read_study
from palpate.study.part_choices import chosen_study, shown_part
from palpate.study.part_study import part_study, part_text


@pytest.fixture(scope="module")
def kidney(tmp_path_factory: pytest.TempPathFactory) -> Study:
    return part_study(write_sample_part(tmp_path_factory.mktemp("parts") / "kidney.stl"))[0]


@pytest.fixture(scope="module")
def block(tmp_path_factory: pytest.TempPathFactory) -> Study:
    mesh = Block(size=(0.04, 0.03, 0.02), element=0.01).rest()
    path = tmp_path_factory.mktemp("parts") / "block.vtu"
    meshio.Mesh(1e3 * mesh.points, [("tetra", mesh.tetrahedra)]).write(path)
    return part_study(path, radius=0.008)[0]


def areas(study: Study) -> dict[str, float]:
    return {face.name: face.area for face in study.body.shape().faces}


def test_picked_triangles_are_the_same_after_writing_and_reading(kidney: Study):
    part = shown_part(kidney)
    corners = part.points[part.triangles]
    middle = corners.mean(axis=1)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    held, touched = np.flatnonzero(middle[:, 0] < -0.03), np.flatnonzero(middle[:, 0] > 0.0)
    study = chosen_study(kidney, dataclasses.replace(part.choices, held=held, touched=touched))
    path = Path(study.body.file).with_name("picked.toml")
    path.write_text(part_text(study, ()), encoding="utf-8")
    again = read_study(path)
    assert areas(again) == areas(study)
    assert areas(again)["held"] == pytest.approx(area[held].sum())
    assert areas(again)["touched"] == pytest.approx(area[touched].sum())
    shown = shown_part(again)
    assert np.array_equal(np.flatnonzero(shown.held), held)
    assert np.array_equal(np.flatnonzero(shown.touched), touched)


def test_whole_faces_are_picked_by_name(block: Study):
    part = shown_part(block)
    side = part.face_of[part.held][0]
    other = next(i for i in range(len(part.faces)) if i != side and not part.touched[part.face_of == i].any())
    choices = dataclasses.replace(
        part.choices, held=np.flatnonzero(part.face_of == other), touched=np.flatnonzero(part.touched)
    )
    study = chosen_study(block, choices)
    assert study.body.surfaces[-1].faces == (part.faces[other],)
    assert study.interaction.touches == block.interaction.touches, "what is touched is named as before"


def test_without_picks_the_names_stay(kidney: Study):
    choices = dataclasses.replace(shown_part(kidney).choices, young=4e3, radius=0.004)
    study = chosen_study(kidney, choices)
    *named, rim = study.body.surfaces
    assert tuple(named) == kidney.body.surfaces[:-1]
    assert rim.reach < kidney.body.surfaces[-1].reach, "a smaller ball meets less beyond the paint"
    assert study.body.material.young == 4e3
    assert study.sweep.element <= 0.002, "elements suit the smaller ball"
    assert chosen_study(kidney, dataclasses.replace(choices, material="ecoflex 00-30")).body.material == (
        "ecoflex 00-30"
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"held": np.zeros(0, int), "touched": np.arange(9)}, "Nothing is held"),
        ({"held": np.arange(9), "touched": np.zeros(0, int)}, "Nothing is touched"),
        ({"held": np.arange(9), "touched": np.arange(9)}, "Nothing is touched"),
        ({"radius": 0.06}, "larger than the part"),
        ({"depth": 0.05}, "more than the part is thick"),
        ({"poisson": 0.6}, "poisson"),
    ],
)
def test_what_does_not_fit_is_said(kidney: Study, change: dict, words: str):
    with pytest.raises(UsageError, match=words):
        chosen_study(kidney, dataclasses.replace(shown_part(kidney).choices, **change))


def test_elements_larger_than_the_ball_are_refused(block: Study):
    with pytest.raises(UsageError, match="are larger than the ball"):
        chosen_study(block, dataclasses.replace(shown_part(block).choices, radius=0.002, depth=0.001))


def test_triangles_as_text_come_back():
    chosen = np.random.default_rng(0).choice(500, 120, replace=False)
    back, count = read_triangles(triangle_text(chosen, 500))
    assert (back.tolist(), count) == (sorted(chosen.tolist()), 500)
    for text in ("", "of 5", "7 of 5", "3-1 of 5", "1,2 of 5", "1 2"):
        with pytest.raises(UsageError, match="no list of triangles"):
            read_triangles(text)


def test_a_file_that_has_changed_is_told(tmp_path: Path):
    path = write_sample_part(tmp_path / "kidney.stl")
    study = part_study(path)[0]
    part = shown_part(study)
    picked = chosen_study(
        study, dataclasses.replace(part.choices, held=np.arange(9), touched=np.arange(20, 99))
    )
    surfaces = [
        s.model_copy(update={"triangles": f"{s.triangles.split(' of')[0]} of 5121"}) if s.triangles else s
        for s in picked.body.surfaces
    ]
    with pytest.raises(UsageError, match="of 5121 triangles; there are 5120"):
        picked.body.model_copy(update={"surfaces": tuple(surfaces)}).surface_names()


@pytest.mark.full
def test_a_face_of_a_step_file_is_not_picked_in_part(tmp_path: Path):
    """What faces up cuts a lying cylinder's side; with another face it is no pick of whole faces any more."""
    from netgen.occ import Cylinder, Pnt, X

    Cylinder(Pnt(0, 0, 0), X, r=10, h=30).WriteStep(str(tmp_path / "bar.step"))
    study = part_study(tmp_path / "bar.step", radius=0.004)[0]
    part = shown_part(study)
    touched = part.touched | (
        part.face_of == next(f for f in part.face_of if not part.touched[part.face_of == f].any())
    )
    with pytest.raises(UsageError, match="only a part is touched"):
        chosen_study(study, dataclasses.replace(part.choices, touched=np.flatnonzero(touched)))
