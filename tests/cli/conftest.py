"""The command line in this process, and a small study that was carried out."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from palpate.cli import main
from programs import one_core
from solved import unpack


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

    It is shipped; what `learn` said is in `learn.out` and `learn.err`.
    """
    return unpack("small", tmp_path_factory.mktemp("study"))
