"""The command line in this process, and a small study carried out once."""

from __future__ import annotations

import contextlib
import io
import os
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
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


@dataclass(frozen=True)
class Answer:
    """Exit code, stdout and stderr of a command."""

    code: int
    out: str
    err: str


Palpate = Callable[..., Answer]


@pytest.fixture
def palpate(capsys) -> Palpate:
    def run(*words: object) -> Answer:
        capsys.readouterr()
        alone = one_core() if words and words[0] in {"demo", "sweep", "learn"} else contextlib.nullcontext()
        with alone, pytest.raises(SystemExit) as stop:
            main([str(w) for w in words])
        captured = capsys.readouterr()
        return Answer(int(stop.value.code or 0), captured.out, captured.err)

    return run


@pytest.fixture(scope="session")
def carried_out(tmp_path_factory) -> Path:
    """Folder of a study that was swept and learnt through the command line; tests copy what they change.

    What `learn` said is in `learn.out` and `learn.err`.
    """
    folder = tmp_path_factory.mktemp("study")
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
    return folder
