"""A study of a beam that bends under one load, carried out by the command line in a few seconds."""

from __future__ import annotations

import io
import os
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from palpate.cli import main
from programs import one_core

SMALL = """\
name = "small"

[body]
material = "nylon"
elements = 10

[[interaction.loads]]
name = "P"
low = "0 N"
high = "2 N"

[sweep]
samples = 33
workers = 1

[test]
random = 8
"""
"""The study file."""


def carry_out(folder: Path) -> None:
    """Sweep and learn the study in a folder; what `learn` says goes into `learn.out` and `learn.err`."""
    (folder / "study.toml").write_text(SMALL, encoding="utf-8")
    here = Path.cwd()
    os.chdir(folder)  # the default study file is the one in the present folder
    try:
        for command in ("sweep", "learn"):
            out, err = io.StringIO(), io.StringIO()
            with (
                one_core(),
                redirect_stdout(out),
                redirect_stderr(err),
                pytest.raises(SystemExit) as stop,
            ):
                main([command])
            assert not stop.value.code, err.getvalue()
        Path("learn.out").write_text(out.getvalue(), encoding="utf-8")
        Path("learn.err").write_text(err.getvalue(), encoding="utf-8")
    finally:
        os.chdir(here)
