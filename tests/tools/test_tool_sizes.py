"""Tools as a person names them: sizes by name, with units, and what is no tool in words."""

from __future__ import annotations

import math

import pytest

from palpate.errors import UsageError
from palpate.tools import Capsule, PosedTool, Punch
from palpate.tools.tool_sizes import BALL, USUAL, read_tool, sizes_of, suitable_tool, tool_by_name


@pytest.mark.parametrize("name", USUAL)
def test_sizes_make_the_tool_again(name: str):
    tool = PosedTool(USUAL[name], (0.1, 0.0, -0.2))
    assert tool_by_name(name, sizes_of(tool)) == tool


def test_a_text_names_a_tool_and_its_sizes():
    name, tool = read_tool("Capsule, radius 6 mm, length=2.4 cm, turn_y 5°", 0.010)
    assert name == "capsule"
    assert tool == PosedTool(Capsule(0.006, 0.024), (0.0, math.radians(5), 0.0))


def test_sizes_that_are_left_out_suit_a_ball_or_are_known():
    assert read_tool("punch", 0.020)[1] == PosedTool(Punch(0.016, 0.004))
    known = PosedTool(Punch(0.005, 0.001), (0.1, 0.0, 0.0))
    wanted = PosedTool(Punch(0.005, 0.002), (0.1, 0.0, 0.0))
    assert read_tool("punch, edge 2 mm", 0.020, known)[1] == wanted


def test_an_angle_does_not_grow_with_the_part():
    assert suitable_tool("cone", 0.030).shape.half_angle == USUAL["cone"].half_angle


def test_a_ball_is_no_tool():
    assert read_tool(" Ball ", 0.01) == (BALL, None)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("capsul", "did you mean 'capsule'"),
        ("punch, width 6 mm", "no size 'width'"),
        ("punch, radius 6 kg", "unit of something else"),
        ("punch, radius 6", "no unit"),
        ("punch, radius 2 mm, edge 4 mm", "edge radius of a punch is 4 mm"),
        ("ball, radius 6 mm", "--radius"),
    ],
)
def test_what_is_no_tool_is_refused_in_words(text: str, words: str):
    with pytest.raises(UsageError, match=f"(?is){words}"):
        read_tool(text, 0.010)


@pytest.mark.parametrize("sizes", [{}, {"radius": 0.005}, {"radius": 0.005, "edge": 0.001, "width": 0.01}])
def test_sizes_of_another_tool_are_refused_with_those_that_it_has(sizes):
    with pytest.raises(UsageError, match="sizes of a punch are radius, edge"):
        tool_by_name("punch", sizes)
