"""`palpate benchmark soft-touch` shows kept answers beside one's own method, and refuses bad ones in words."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from benchmarks.soft_touch import judge, standings
from palpate.cli import benchmark_command
from palpate.cli.app import app
from palpate.errors import UsageError

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks" / "soft_touch"))
from half_space_case import force, write_case  # a case shared with the judge's tests


@pytest.fixture
def half_space(tmp_path, monkeypatch):
    """Put a folder with a single case in place of the benchmark's, and a rival's kept answers into it."""
    cases = tmp_path / "cases"
    write_case(cases / "half-space")
    answers = tmp_path / "answers"
    answers.mkdir()
    case = judge.read_case("half-space", cases)
    row = {"settings": "firm", "press": case.presses, "at_presses": (1.1 * force(case.places)).tolist()}
    kept = {"sweep": [{"seconds": 2.0, **row}], "best": {"solves": 0, **row}}
    plain = {"cases": {"half-space": kept}, "versions": "rival 1.0", "machine": "a machine"}
    (answers / "mass_spring.json").write_text(json.dumps(plain), "utf-8")
    folder = benchmark_command._folder()
    for name in ("judge", "standings", "case_files"):
        benchmark_command._module(folder, name)
    modules = sys.modules["palpate_soft_touch.judge"], sys.modules["palpate_soft_touch.standings"]
    for module in modules:
        monkeypatch.setattr(module, "CASES", cases)
    monkeypatch.setattr(modules[1], "ANSWERS", answers)
    monkeypatch.setattr(modules[0].read_case, "__defaults__", (cases,))
    monkeypatch.setattr(modules[0].case_names, "__defaults__", (cases,))
    return tmp_path


def run(*words):
    return CliRunner().invoke(app, ["benchmark", "soft-touch", *map(str, words)], catch_exceptions=True)


def test_standings_hold_the_rival_and_ones_own_method(half_space):
    mine = half_space / "mine.py"
    mine.write_text(
        "import numpy as np\ndef load(case):\n"
        "    return lambda p: np.interp(case.radius - p[:, 2], [0, 1], [0, 100])[:, None] * [0, 0, 1.0]\n",
        "utf-8",
    )
    picture = half_space / "out.svg"
    shown, done = (run("--judge", mine, "--plot", picture, *words) for words in ((), ("--json",)))
    assert shown.exit_code == done.exit_code == 0, shown.output + done.output
    plain = json.loads(done.stdout)
    rival, own = plain["rows"]
    assert rival["method"] == standings.METHODS["mass_spring"]
    assert rival["jnd_median"] == pytest.approx(1.0)  # a tenth, of forces below 1 N
    assert rival["stiffness_median"] is None
    assert own["method"] == "mine.py"
    assert own["loop_work"] == pytest.approx(0.0, abs=1e-6)  # a spring is conservative
    assert plain["sweep"][0]["jnd_p95"] == pytest.approx(1.0)
    assert plain["sources"] == {rival["method"]: "rival 1.0; a machine"}
    assert "not given" in shown.stdout
    assert "mine.py" in picture.read_text("utf-8")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--case", "sponge"), "The case is 'sponge'"),
        (("--judge", "nothing.py"), "There is no file nothing.py"),
        (("--plot", "standings.txt"), "does not end in .svg or .png"),
        (("--seed", "3"), "No method can be asked anew on half-space"),
    ],
)
def test_bad_arguments_are_refused_in_words(half_space, words, says):
    del half_space
    refused = run(*words).exception
    assert isinstance(refused, UsageError)
    assert says in refused.what


def test_an_empty_folder_says_what_to_run(half_space, monkeypatch):
    monkeypatch.setattr(
        sys.modules["palpate_soft_touch.judge"].case_names, "__defaults__", (half_space / "none",)
    )
    assert "make_cases" in run().exception.fix
