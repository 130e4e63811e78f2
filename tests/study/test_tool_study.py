"""Studies of bodies under a tool: their tables, what is refused, and parts that a tool presses."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh

import palpate as pp
from palpate.errors import StudyError, UsageError
from palpate.study import Study, preset_study, read_study, to_toml
from palpate.study.part_choices import chosen_study, shown_part
from palpate.study.part_study import part_study
from palpate.study.part_work import rough_study
from palpate.study.tool_kind import SHAPES
from palpate.tools import Capsule, PosedTool, ScannedTool
from palpate.tools.tool_sizes import USUAL
from palpate.viewer.part_messages import StartWish
from palpate.viewer.shown_part import choices_of

HEAD = """
[body]
kind = "block"
size = ["60 mm", "50 mm", "30 mm"]
material = { young = "9 kPa" }
[interaction]
kind = "tool"
depth = ["0.2 mm", "4 mm"]
over = [["22 mm", "18 mm"], ["38 mm", "32 mm"]]
"""
SIZE = (60.0, 50.0, 30.0)  # mm, of the part


def read(tmp_path: Path, text: str) -> Study:
    path = tmp_path / "tool.toml"
    path.write_text(HEAD + text, encoding="utf-8")
    return read_study(path)


@pytest.fixture
def part(tmp_path: Path) -> Path:
    path = tmp_path / "pad.stl"
    trimesh.creation.box(SIZE).export(path)
    return path


def test_every_shape_has_a_table_with_its_usual_sizes():
    assert {name: record().build() for name, record in SHAPES.items()} == USUAL


@pytest.mark.parametrize("name", SHAPES)
def test_a_study_is_written_and_read_as_the_same(name: str, tmp_path: Path):
    study = read(
        tmp_path, f'turns = "axis"\nrotation = [0.0, "5 deg", 0.0]\n[interaction.shape]\nkind = "{name}"\n'
    )
    path = tmp_path / "again.toml"
    path.write_text(to_toml(study), encoding="utf-8")
    assert read_study(path) == study


def test_the_tool_of_a_study_is_the_one_that_it_says(tmp_path: Path):
    study = read(
        tmp_path,
        'rotation = ["0 deg", "5 deg", "0 deg"]\npad = "rigid"\n'
        '[interaction.shape]\nkind = "capsule"\nradius = "6 mm"\nlength = "2.4 cm"\n[sweep]\nelement = "5 mm"\n',
    )
    (tool,) = study.problem().interactions
    assert tool == pp.SurfaceTool(
        pp.tools.Capsule(0.006, 0.024),
        pad="rigid",
        depth=(2e-4, 0.004),
        over=((0.022, 0.018), (0.038, 0.032)),
        rotation=(0.0, math.radians(5), 0.0),
        element=0.005,
    )


def test_small_elements_let_an_edge_be_sharp(tmp_path: Path):
    shape = '[interaction.shape]\nkind = "punch"\nradius = "8 mm"\nedge = "0.1 mm"\n'
    with pytest.raises(UsageError, match="too sharp for elements"):
        read(tmp_path, shape).problem()
    fine = read(tmp_path, f'{shape}[sweep]\nelement = "0.2 mm"\n').problem()
    assert fine.interactions[0].element == 2e-4


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[interaction.shape]\nkind = "fingr"\n', "there are sphere, capsule.*fingertip"),
        ('[interaction.shape]\nkind = "box"\nlength = "1 mm"\n', "no such key"),
        ('[interaction.shape]\nkind = "box"\nsize_x = "1 N"\n', "unit of something else"),
        ('[interaction.shape]\nkind = "capsule"\nradius = "15 mm"\n', "A capsule is 24 mm long"),
        ('rotation = ["5 mm", 0.0, 0.0]\n', "not a quantity in rad"),
        ('touches = "lid"\n', "no surface 'lid'"),
        ('turns = "some"\n', "axis"),
        ('tilt = "120 deg"\n', "out of range"),
    ],
)
def test_what_a_study_can_not_mean_is_refused_in_words(text: str, words: str, tmp_path: Path):
    with pytest.raises(StudyError, match=f"(?s){words}"):
        read(tmp_path, text)


def test_the_preset_presses_with_a_fingertip():
    study = preset_study("fingertip")
    assert str(study.problem().interactions[0]).startswith("fingertip of 18 mm × 16 mm × 14 mm on 'top'")


def test_a_part_is_pressed_by_the_tool_of_the_command(part: Path):
    study = part_study(part, tool="capsule, radius 5 mm, length 20 mm", depth=0.003)[0]
    assert study.interaction.build_tool() == PosedTool(Capsule(0.005, 0.020))
    assert study.interaction.depth[1] == 0.003
    problem = study.problem()
    places = problem.design(4, 0, depths=2)
    assert np.ptp(places[:, 2]) > 0
    assert rough_study(study).sweep.element > study.sweep.element


@pytest.mark.parametrize(
    ("tool", "words"),
    [
        ("capsule, radius 20 mm, length 90 mm", "90 mm across, and the part 60 mm long"),
        ("punch, radius 8 mm, edge 0.1 mm", "at least 0.5 mm"),
    ],
)
def test_a_tool_that_does_not_suit_a_part_is_refused_with_what_would_do(tool: str, words: str, part: Path):
    with pytest.raises(UsageError, match=words):
        part_study(part, tool=tool)


def test_the_radius_of_a_ball_is_none_of_a_tool(part: Path):
    with pytest.raises(UsageError, match="--radius is that of a ball"):
        part_study(part, tool="capsule", radius=0.005)


def wish_for(shown: object, name: str, **sizes: str) -> StartWish:
    """What the page sends where a person has chosen a tool, with some sizes of their own."""
    info = next(tool for tool in shown.facts().tools if tool.name == name)
    texts = {size.name: size.value for size in info.sizes} | sizes
    choices = shown.facts().choices
    return StartWish("", choices["law"], "10 kPa", "0.45", choices["radius"], "3 mm", tool=name, sizes=texts)


def test_the_page_proposes_sizes_that_suit_the_part_and_takes_others(part: Path):
    study = part_study(part)[0]
    shown = shown_part(study)
    for name in USUAL:
        assert shown.misfits(wish_for(shown, name)) == {}
    wish = wish_for(shown, "punch", radius="6 mm", edge="1.5 mm", turn_x="10°")
    chosen = chosen_study(study, choices_of(wish, None, None))
    tool = chosen.interaction.build_tool()
    assert str(tool) == "punch of radius 6 mm, edge 1.5 mm, turned by 10°"
    again = shown_part(chosen)  # the tool is among the choices that are shown first
    assert again.facts().choices["tool"] == "punch"
    assert chosen_study(chosen, choices_of(wish, None, None)) == chosen
    ball = StartWish("", "neo-hookean", "10 kPa", "0.45", "6 mm", "3 mm")
    assert chosen_study(chosen, choices_of(ball, None, None)).interaction.kind == "probe"


@pytest.mark.parametrize(
    ("sizes", "field", "words"),
    [
        ({"radius": "6"}, "size-radius", "has no unit"),
        ({"edge": "9 mm"}, "size-edge", "edge radius of a punch is 9 mm"),
        ({"edge": "0.01 mm"}, "size-edge", "at least"),
        ({"radius": "80 mm"}, "size-radius", "160 mm across"),
    ],
)
def test_a_misfit_of_a_size_stands_at_its_field(sizes: dict[str, str], field: str, words: str, part: Path):
    shown = shown_part(part_study(part)[0])
    assert words in shown.misfits(wish_for(shown, "punch", **sizes))[field]


def test_a_tool_of_a_file_lies_beside_its_study(tmp_path: Path):
    trimesh.creation.icosphere(subdivisions=2, radius=8.0).export(tmp_path / "ball.stl")
    study = read(tmp_path, '[interaction.shape]\nkind = "file"\nfile = "ball.stl"\nunit = "mm"\n')
    shape = study.interaction.build_tool().shape
    assert isinstance(shape, ScannedTool)
    assert shape.size == pytest.approx(0.008, rel=0.01)
    again = tmp_path / "again.toml"
    again.write_text(to_toml(study), encoding="utf-8")
    assert read_study(again) == study


def under(study: Study, **changes: object) -> Study:
    """A study of a part with other keys of its tool."""
    content = study.model_dump()
    content["interaction"] |= changes
    return Study.model_validate(content)


def test_what_turns_of_a_tool_stays_when_its_sizes_are_chosen(part: Path):
    study = under(part_study(part, tool="capsule")[0], turns="axis", tilt=0.2)
    wish = wish_for(shown_part(study), "capsule", radius="5 mm", length="20 mm")
    tool = chosen_study(study, choices_of(wish, None, None)).interaction.build_tool()
    assert tool == PosedTool(Capsule(0.005, 0.020), turns="axis", tilt=0.2)


def test_a_tool_whose_file_is_missing_is_refused(tmp_path: Path):
    with pytest.raises(UsageError, match=r"ball\.stl"):
        read(tmp_path, '[interaction.shape]\nkind = "file"\nfile = "ball.stl"\nunit = "mm"\n')


def test_friction_of_a_study_is_a_pair_in_order_and_of_a_tool(tmp_path: Path):
    study = read(tmp_path, "[runtime]\nfriction = 0.3\nstatic_friction = 0.4\n")
    assert (study.runtime.friction, study.runtime.static_friction) == (0.3, 0.4)
    for text in ("friction = -0.1", "static_friction = 0.4", "friction = 0.5\nstatic_friction = 0.4"):
        with pytest.raises(StudyError, match="friction"):
            read(tmp_path, f"[runtime]\n{text}\n")
