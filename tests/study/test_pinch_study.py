"""Studies of bodies that two jaws pinch: their tables, what is refused, and a study from its solves to its errors."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh

import palpate as pp
from palpate.errors import StudyError
from palpate.physics.solid.finer_problem import finer_problem
from palpate.study import Study, read_study, to_toml
from palpate.study.run import learn_study, sweep_study, validate_study

HEAD = """
[body]
kind = "block"
size = ["20 mm", "20 mm", "20 mm"]
element = "10 mm"
material = { young = "9 kPa" }
[interaction]
kind = "pinch"
touches = "x_min + x_max"
"""
BALLS = '[interaction.jaw]\nkind = "sphere"\nradius = "5 mm"\n'
OVER = 'depth = ["0.2 mm", "2 mm"]\nover = [["9 mm", "9 mm"], ["11 mm", "11 mm"]]\n'


def read(tmp_path: Path, text: str) -> Study:
    path = tmp_path / "pinch.toml"
    path.write_text(HEAD + text, encoding="utf-8")
    return read_study(path)


def test_the_pinch_of_a_study_is_the_one_that_it_says(tmp_path: Path):
    text = (
        f'axis = "y"\nroll = "10 deg"\npad = 4e6\n{OVER}{BALLS}[interaction.other]\nkind = "fingertip"\n'
        'size_x = "8 mm"\nsize_y = "8 mm"\nsize_z = "8 mm"\n[sweep]\nelement = "4 mm"\n'
    )
    study = read(tmp_path, text)
    assert study.interaction.build(None, element=0.004) == pp.Pinch(
        pp.tools.Sphere(0.005),
        pp.tools.Fingertip(0.008, 0.008, 0.008),
        axis="y",
        roll=math.radians(10),
        touches="x_min + x_max",
        pad=4e6,
        depth=(2e-4, 0.002),
        over=((0.009, 0.009), (0.011, 0.011)),
        element=0.004,
    )
    again = tmp_path / "again.toml"
    again.write_text(to_toml(study), encoding="utf-8")
    assert read_study(again) == study


def test_a_jaw_of_a_file_lies_beside_its_study(tmp_path: Path):
    trimesh.creation.icosphere(subdivisions=2, radius=5.0).export(tmp_path / "ball.stl")
    study = read(tmp_path, '[interaction.jaw]\nkind = "file"\nfile = "ball.stl"\nunit = "mm"\n')
    assert study.interaction.build(None).jaw.size == pytest.approx(0.005, rel=0.01)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('axis = "w"\n', "axis"),
        ('pad = "rigid"\n', "pad"),
        ('depth = ["2 mm", "1 mm"]\n', "no range from 0 on"),
        ('over = [["5 mm", "5 mm"], ["1 mm", "9 mm"]]\n', "lower one comes first"),
        ("[runtime]\nfriction = 0.3\n", "pinched by two jaws"),
        ('[[varied]]\npath = "body.young"\nlow = "8 kPa"\nhigh = "9 kPa"\n', "make a study of each"),
        ('roll = "5 mm"\n', "not a quantity in rad"),
        ('[interaction.jaw]\nkind = "finger"\n', "there are sphere, capsule.*fingertip"),
        ('[interaction.jaw]\nkind = "capsule"\nradius = "15 mm"\n', "A capsule is 24 mm long"),
        ('[interaction.jaw]\nkind = "sphere"\nwidth = "1 mm"\n', "no such key"),
    ],
)
def test_what_a_study_of_a_pinch_can_not_mean_is_refused_in_words(text: str, words: str, tmp_path: Path):
    with pytest.raises(StudyError, match=f"(?s){words}"):
        read(tmp_path, text)


def test_finer_elements_lie_under_both_jaws(tmp_path: Path):
    problem = read(tmp_path, f'{OVER}{BALLS}[sweep]\nelement = "4 mm"\n').problem()
    (place,) = problem.design(1, 0, depths=1)
    boxes = finer_problem(problem, place[None]).fine[len(problem.refinements) :]
    for jaw in problem.interactions[0].gripper.places(place):
        inside = [(np.array(b.lower) <= jaw).all() and (np.array(b.upper) >= jaw).all() for b in boxes]
        assert any(inside)
    assert {box.element for box in boxes} == {0.002}


@pytest.mark.full
@pytest.mark.timeout(600)
def test_a_study_of_a_pinch_is_swept_learnt_and_judged_with_its_effort(tmp_path: Path):
    """The error counts the effort beside the force: of jaws that press alike the force alone is nothing."""
    study = read(
        tmp_path,
        f'{OVER}{BALLS}[sweep]\nsamples = 12\ndepths = 3\nelement = "4 mm"\nworkers = 1\n'
        "[test]\nsamples = 4\ndepths = 2\nfiner = 0\n[learning]\neffort = 0.05\nworkers = 1\nshape = false\n",
    )
    train, test = sweep_study(study, progress=False)
    model, _ = learn_study(study, train)
    validation = validate_study(study, model, test)
    answer = np.column_stack([model.energy.force(test.X), model.effort(test.X)])
    size = np.linalg.norm(test.response, axis=1)
    off = np.linalg.norm(answer - test.response, axis=1) / size
    assert validation.force.largest == pytest.approx(size.max())
    heavy = size > 0.05 * size.max()
    assert validation.force.median == pytest.approx(np.median(off[heavy]))
    assert validation.force.median < 0.05
