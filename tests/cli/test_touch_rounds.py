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
    assert "It says otherwise of --radius." in other.err
    assert len(asked) == 2


def test_it_goes_on_with_the_study_that_init_has_written(palpate, asked, tmp_path):
    part = box(tmp_path / "left pad.stl")
    assert palpate("init", part).code == 0
    assert palpate("touch", part, "--no-view").code == 1
    assert [path.name for path in tmp_path.glob("*.toml")] == ["left-pad.toml"]


def test_a_choice_that_does_not_suit_is_no_missed_target(palpate, asked, tmp_path):
    answer = palpate("touch", box(tmp_path / "pad.stl"), "--poisson", "0.7", "--no-view")
    assert answer.code == 2
    assert "poisson" in answer.err
    assert not asked
