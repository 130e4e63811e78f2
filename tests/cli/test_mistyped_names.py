"""Names that are mistyped, and words of other tools: each is refused with the name that is meant."""

from __future__ import annotations

import os
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
        ("export Unity", "palpate export lib"),
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
