"""Names that are mistyped, and words of other tools: each is refused with the name that is meant."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys

import pytest

from palpate.checks import did_you_mean
from pressed import surrogate


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        ("swep", "palpate sweep"),
        ("simulink", "palpate export fmu"),
        ("fmu body.palpate", "palpate export fmu"),
        ("export simulink body.palpate", "palpate export fmu"),
        ("export htlm", "palpate export html"),
        ("export Unity", "palpate export unity"),
        ("material fti", "palpate material fit"),
        ("dataset imprt", "palpate dataset import"),
        ("devices simulate omega.7", "palpate devices simulate forcedimension"),
    ],
)
def test_a_command_that_is_none_finds_the_one_that_is_meant(palpate, words, meant):
    answer = palpate(*words.split())
    assert answer.code == 2
    assert answer.err.splitlines()[0].startswith("error: There is no command `palpate ")
    assert f"Did you mean `{meant}`?" in answer.err


@pytest.mark.parametrize(
    ("words", "what", "fix"),
    [
        ("touch kidney.stl --materal liver", "`palpate touch` has no option --materal.", "Did you mean --material?"),
        ("export html k.palpate --oot k", "`palpate export html` has no option --oot.", "Did you mean --out?"),
        ("--versoin", "`palpate` has no option --versoin.", "Did you mean --version?"),
        ("touch", "`palpate touch` needs PART.", "For example `palpate touch kidney.stl`."),
        ("material fit", "`palpate material fit` needs FILES.", "For example `palpate material fit tests.csv`."),
        ("ask a b", "`palpate ask`: got unexpected extra argument", "`palpate ask --help` says what it takes."),
        ("view k --token=3", "`palpate view`: option '--token' does not take a value.", "`palpate view --help`"),
        ("export kidney.palpate", "", "Did you mean `palpate export html kidney.palpate`?"),
        ("export kidney.zarr", "", "Did you mean `palpate dataset export kidney.zarr`?"),
        ("kidney.stl", "", "Did you mean `palpate touch kidney.stl`?"),
        ("'my study.toml'", "", "Did you mean `palpate sweep 'my study.toml'`?"),
    ],
)  # fmt: skip
def test_a_wrong_option_or_argument_is_refused_as_a_wrong_command_is(palpate, words, what, fix):
    answer = palpate(*shlex.split(words))
    assert answer.code == 2
    first, *rest = answer.err.splitlines()
    assert first.startswith("error: ")
    assert what in first
    assert fix in "\n".join(rest)
    assert "╭" not in answer.err
    if what:
        told = json.loads(palpate(*shlex.split(words), "--json").out)["error"]
        assert what in told["what"]


@pytest.mark.parametrize("path", ["", "touch", "export html", "devices simulate"])
def test_a_short_h_prints_the_help(palpate, path):
    answer = palpate(*path.split(), "-h")
    assert (answer.code, answer.out) == (0, palpate(*path.split(), "--help").out)
    assert "Usage: " in answer.out


def test_studies_beside_are_offered_where_none_is_named(palpate, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pyproject.toml").write_text("[project]\nname = 'other'\n", encoding="utf-8")
    assert "Did you mean" not in palpate("sweep").err
    assert palpate("init", "my.toml").code == 0
    for command in ("sweep", "learn", "validate"):
        answer = palpate(command)
        assert answer.code == 2
        assert answer.err.startswith("error: study.toml does not exist.\nDid you mean my.toml?")


@pytest.mark.parametrize(
    ("device", "meant"),
    [
        ("touch", "openhaptics"),
        ("omega.7", "forcedimension"),
        ("omega7", "forcedimension"),
        ("Inverse3", "haply"),
        ("strok:frequency=1", "stroke"),
        ("haplly", "haply"),
        ("xbox", "gamepad"),
    ],
)
def test_a_device_that_is_none_finds_the_one_that_is_meant(palpate, tmp_path, device, meant):
    answer = palpate("run", surrogate().save(tmp_path / "slab.palpate"), "--device", device)
    assert answer.code == 2
    assert f"Did you mean --device {meant}?" in answer.err


def test_options_studies_and_files_find_what_is_meant(palpate, tmp_path):
    model = surrogate().save(tmp_path / "slab.palpate")
    for words, meant in (
        (("run", model, "--device", "stroke:freqency=1"), "frequency"),
        (("run", model, "--device", "simulated:profile=omega.8"), "omega."),
        (("demo", "blok", "--folder", tmp_path / "demo"), "'block'"),
        (("init", "--preset", "leyered", "--print"), "'layered'"),
        (("ask", tmp_path / "slap.palpate"), str(model)),
    ):
        answer = palpate(*words)
        assert answer.code == 2, words
        assert f"Did you mean {meant}" in answer.err, answer.err
    assert not (tmp_path / "demo").exists()


def test_a_word_that_stands_for_a_choice_goes_before_spelling():
    assert did_you_mean("touch", ["torch", "page"], meant={"touch": "page"}) == "Did you mean page?"
    assert did_you_mean("torhc", ["torch", "page"], meant={"touch": "page"}) == "Did you mean torch?"
    assert did_you_mean("zzz", ["torch", "page"]) == ""


def test_a_shell_completes_commands():
    asked = os.environ | {
        "_PALPATE_COMPLETE": "complete_bash",
        "COMP_WORDS": "palpate export f",
        "COMP_CWORD": "2",
    }
    program = "import sys; sys.argv = ['palpate']; from palpate.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", program], env=asked, capture_output=True, text=True, check=False, timeout=60
    )
    assert done.stdout.split() == ["fmu"], done.stderr
