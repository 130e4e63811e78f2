"""Ctrl-C of every command: exit code 130, and one sentence on what is kept."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from few_solves import BLOCK, FEW_SOLVES
from palpate.cli.app import app
from palpate.cli.command_names import command_paths
from palpate.cli.program import KEPT, kept_after
from pressed import surrogate
from solved import unpack

HELPING = {"dataset", "material"}  # groups that print their help alone
PATHS = [path for path in map(" ".join, command_paths(typer.main.get_command(app))) if path not in HELPING]

# what is run, and a word of its output after which it waits or works; by the command whose sentence it ends with
BEGUN = {
    "demo": ("demo grasp --quick --no-view --folder demo", "sweep"),
    "touch": ("touch kidney.stl --no-view", "Starting"),
    "sweep": ("sweep tiny.toml", "Solving"),
    "learn": ("learn block.zarr", "energy of"),
    "view": ("view slab.palpate --port 0 --no-browser", "Ctrl-C ends it"),
    "show": ("show block.zarr --port 0 --no-browser", "Ctrl-C ends it"),
    "run": ("run slab.palpate --seconds 60", "The loop runs for 60 s; it took"),
    "correct": ("correct slab.palpate --port 0 --out new.palpate", "listening"),
    "devices simulate": ("devices simulate haply --port 0 --events 0", "listens"),
    "doctor": ("doctor --seconds 60", "Timing test"),
}


@pytest.mark.parametrize("path", PATHS)
def test_every_command_says_what_is_kept(path):
    sentence = kept_after([*path.split(), "--json", "FILE"])
    assert sentence.endswith(".")
    assert sentence in KEPT.values()


def test_no_sentence_is_of_a_command_that_is_not_there():
    groups = {path.rpartition(" ")[0] for path in PATHS}
    assert set(KEPT) <= {*PATHS, *groups}


@pytest.mark.skipif(os.name != "posix", reason="signals of a terminal are POSIX")
@pytest.mark.parametrize(
    "command",
    [c if c == "devices simulate" else pytest.param(c, marks=pytest.mark.full) for c in BEGUN],
)
def test_ctrl_c_ends_with_code_130_and_one_sentence(command, tmp_path: Path):
    """Real processes, whose whole group gets the signal, as a terminal's does."""
    words, sign = BEGUN[command]
    _prepare(tmp_path, words)
    with subprocess.Popen(
        [sys.executable, "-m", "palpate", *words.split()],
        cwd=tmp_path,
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
    ) as process:
        assert process.stderr is not None
        before = ""
        while sign not in before:
            line = process.stderr.readline()
            assert line, before
            before += line
        os.killpg(process.pid, signal.SIGINT)
        _, after = process.communicate(timeout=60)
    assert process.returncode == 130, before + after
    assert after.endswith(f"\nInterrupted. {KEPT[command]}\n")
    assert "Traceback" not in after


def _prepare(folder: Path, words: str) -> None:
    if "slab.palpate" in words:
        surrogate().save(folder / "slab.palpate")
    if "block.zarr" in words:
        unpack("block", folder / "block.zarr")
    if "kidney" in words:
        from palpate.physics.shapes.sample_part import write_sample_part

        write_sample_part(folder / "kidney.stl")
    (folder / "tiny.toml").write_text(BLOCK + FEW_SOLVES, encoding="utf-8")
