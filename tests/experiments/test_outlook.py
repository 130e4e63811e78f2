"""The outlook of a plan, and the commands that print it."""

from __future__ import annotations

import pytest
import typer
from test_sitting import write_plan as plan_file

from palpate.cli.experiment_commands import forget, simulate, write_plan
from palpate.errors import AccuracyError, UsageError
from palpate.experiments import read_plan
from palpate.experiments.outlook import foresee


def test_a_plan_that_misses_its_power_says_how_many_people_would_do(tmp_path, capsys):
    file = plan_file(tmp_path, change=("people = 12", "people = 2"))
    file.write_text(file.read_text("utf-8").replace("trials = 80", "trials = 40"), "utf-8")
    with pytest.raises(AccuracyError, match="2 people show equivalence") as error:
        simulate(file, people=60)
    assert "Plan for" in error.value.fix
    said = capsys.readouterr().out
    assert "simulated observers only" in said
    assert "64 people" in said


def test_fatigue_is_told_beside_the_rest(tmp_path):
    file = plan_file(tmp_path, "odd-one-out", change=("fatigue = 0.0", "fatigue = 0.5"))
    file.write_text(file.read_text("utf-8").replace("trials = 80", "trials = 30"), "utf-8")
    outlook = foresee(read_plan(file), people=50)
    assert outlook.tired is not None
    assert "against the JND at rest" in str(outlook)
    assert outlook.reaches  # no test of equivalence is wanted of it
    assert outlook.power == {}


def test_a_plan_is_never_overwritten_and_needs_its_bodies(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_plan(name="own")
    with pytest.raises(UsageError, match="is there already"):
        write_plan(name="own")
    with pytest.raises(UsageError, match="at least one body"):
        write_plan(bodies=[tmp_path / "one.palpate"], kind="full-model", name="other")
    with pytest.raises(UsageError, match=r"one\.toml is a study"):
        write_plan(bodies=[tmp_path / "one.toml", tmp_path / "two.palpate"], kind="full-model", name="other")


def test_the_plan_of_a_study_is_printed_without_its_solves(tmp_path, capsys):
    write_plan(bodies=[tmp_path / "not-there.toml"], kind="full-model", show=True)
    assert "other.palpate" in capsys.readouterr().out


def test_ratings_are_not_simulated_and_forgetting_asks(tmp_path, monkeypatch):
    file = plan_file(tmp_path, "rating")
    with pytest.raises(UsageError, match="can't be simulated"):
        simulate(file)
    monkeypatch.setattr(typer, "confirm", lambda _: False)
    with pytest.raises(typer.Exit):
        forget(file, "sub-01")
