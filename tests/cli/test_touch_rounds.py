"""`palpate touch`: its options and the study that it writes; the improvement itself is tested with parts."""

from __future__ import annotations

from pathlib import Path

import pytest
import trimesh

from palpate.errors import AccuracyError
from palpate.study import Study


@pytest.fixture
def asked(monkeypatch) -> list[Study]:
    """The studies whose improvement was asked for; none is solved, as if the time was over."""
    studies: list[Study] = []

    def improve(study: Study, *_: object, **__: object):
        studies.append(study)
        raise AccuracyError("The force error is not reached.")

    monkeypatch.setattr("palpate.study.improve_study.improve_study", improve)
    return studies


def box(path: Path) -> Path:
    trimesh.creation.box((40.0, 30.0, 20.0)).export(path)
    return path


def test_the_same_command_goes_on(palpate, asked, tmp_path):
    words = ("touch", box(tmp_path / "left pad.stl"), "--young", "4 kPa", "--poisson", "0", "--no-view")
    first, second = palpate(*words), palpate(*words)
    assert (first.code, second.code) == (1, 1), first.err + second.err
    assert (tmp_path / "left-pad.toml").is_file()
    assert "Going on with the study" in second.err
    assert asked[0].body.material == asked[1].body.material
    assert asked[0].body.material.young == pytest.approx(4e3)
    assert asked[0].body.material.poisson == 0.0
    assert asked[0].interaction == asked[1].interaction
    other = palpate(*words, "--radius", "7 mm", "--until", "5%")
    assert other.code == 2
    assert "says otherwise of --radius." in other.err
    assert len(asked) == 2


def test_it_goes_on_with_the_study_that_init_has_written(palpate, asked, tmp_path):
    part = box(tmp_path / "left pad.stl")
    assert palpate("init", part).code == 0
    assert palpate("touch", part, "--no-view").code == 1
    assert [path.name for path in tmp_path.glob("*.toml")] == ["left-pad.toml"]


def test_one_part_has_several_studies_by_their_names(palpate, asked, tmp_path):
    part = box(tmp_path / "pad.stl")
    words = ("touch", part, "--name", "soft", "--tissue", "liver", "--no-view")
    assert (palpate(*words).code, palpate(*words).code) == (1, 1)
    assert [study.name for study in asked] == ["soft", "soft"]
    assert asked[0].body.material == "liver"
    assert [path.name for path in tmp_path.glob("*.toml")] == ["soft.toml"]
    other = palpate("touch", part, "--name", "soft", "--material", "kidney", "--no-view")
    assert other.code == 2
    assert "says otherwise of --material" in other.err
    assert "--name NAME" in other.err


@pytest.mark.parametrize(
    ("options", "keys"),
    [
        (("--unit", "cm"), "unit"),
        (("--young", "4 kPa"), "young"),
        (("--poisson", "0.4"), "poisson"),
        (("--radius", "7 mm"), "radius"),
        (("--depth", "1 mm"), "depth"),
        (("--element", "0.3 mm"), "element"),
        (("--held", "face 5"), "fixed"),
        (("--touched", "face 2"), "touches"),
    ],
)
def test_an_option_that_the_study_says_otherwise_is_named_with_its_line(
    palpate, asked, tmp_path, options, keys
):
    part = box(tmp_path / "pad.stl")
    assert palpate("init", part).code == 0
    lines = (tmp_path / "pad.toml").read_text(encoding="utf-8").splitlines()
    answer = palpate("touch", part, *options, "--no-view")
    assert answer.code == 2
    asked_for, where = next(line for line in answer.err.splitlines() if line.startswith("  ")).split("; ")
    assert asked_for == f"  {options[0]} asks for {options[1]}"
    number, line = where.removeprefix("line ").split(" says ")
    assert lines[int(number) - 1].startswith(line)
    assert line.startswith(f"{keys} = ")
    assert not asked


@pytest.mark.parametrize(
    "options",
    [
        ("--depth", "1 m"),
        ("--radius", "0.01 mm"),
        pytest.param(("--depth", "25 mm", "--radius", "8 mm"), marks=pytest.mark.full),
        ("--device", "stroke"),
        ("--device", "omni"),
    ],
)
@pytest.mark.filterwarnings("ignore::UserWarning")  # of a pad that is too soft for such a ball
def test_options_that_are_refused_leave_no_study_behind(palpate, tmp_path, options):
    part = box(tmp_path / "pad.stl")
    answer = palpate("touch", part, *options, "--no-view", "--minutes", "0")
    assert answer.code == 2, answer.err
    assert list(tmp_path.iterdir()) == [part]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--depth", "20 mm"), "The depth of 20 mm is more than the part is thick, 20 mm."),
        (("--radius", "21 mm"), "The ball, 42 mm across, is larger than the part, 40 mm."),
        (("--element", "9 mm", "--radius", "4 mm"), "The elements, 9 mm, are larger than the ball, 8 mm."),
    ],
)
def test_a_number_that_the_page_refuses_is_refused_before_anything_is_written(
    palpate, asked, tmp_path, options, words
):
    part = box(tmp_path / "pad.stl")
    for command in (("touch", part, "--no-view"), ("init", part)):
        answer = palpate(*command, *options)
        assert answer.code == 2, answer.err
        assert words in answer.err.replace("\N{NO-BREAK SPACE}", " ")
        assert list(tmp_path.iterdir()) == [part]
    assert not asked


@pytest.mark.full
def test_a_choice_that_does_not_suit_is_no_missed_target(palpate, asked, tmp_path):
    answer = palpate("touch", box(tmp_path / "pad.stl"), "--poisson", "0.7", "--no-view")
    assert answer.code == 2
    assert "poisson" in answer.err
    assert not asked


def test_quantities_behind_options_are_read_as_they_are_written(palpate, asked, tmp_path):
    part = box(tmp_path / "pad.stl")
    assert (
        palpate("touch", part, "--young", "10,5kPa", "--depth", "3,5mm", "--poisson", "0,4", "--no-view").code
        == 1
    )
    study = asked[0]
    assert study.body.material.young == 10500.0
    assert study.body.material.poisson == 0.4
    assert study.interaction.depth[1] == 0.0035


@pytest.mark.grid
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--young", "10"), "--young: '10' has no unit.\nWrite it with its unit, for example \"10 kPa\"."),
        (("--young", "10 MPA"), "may mean"),
        (("--depth", "1,000 mm"), "1,000 may be 1.000 or 1000"),
        (("--radius", "∞ m"), "infinity"),
        (
            ("--poisson", "0.7"),
            "0.7 is out of range; allowed is at least 0 and less than 0.5; for example 0.45",
        ),
        (("--poisson", "nan"), "--poisson: 'nan' is no number"),
        (("--poisson", "0.4x"), "--poisson: '0.4x' is not a pure number"),
        (("--minutes", "-1"), "--minutes: -1 is out of range"),
        (("--workers", "1_0"), "--workers: '1_0' is no whole number"),
        (("--workers", "1,5"), "--workers: '1,5' is no whole number"),
        (("--port", "99999"), "--port: 99999 is out of range"),
        (("--until", "2"), "out of range"),
        (("--until", "2,5 %%"), "--until:"),
    ],
)
def test_what_is_no_such_quantity_is_asked_for(palpate, asked, tmp_path, options, words):
    answer = palpate("touch", box(tmp_path / "pad.stl"), *options, "--no-view")
    assert answer.code == 2
    assert words in answer.err
    assert "Input should" not in answer.err
    assert not asked
