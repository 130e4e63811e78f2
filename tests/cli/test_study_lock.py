"""One command at a time works on a study: a second one is refused, and a lock of a killed one is taken over."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import trimesh

from few_solves import BLOCK, FEW_SOLVES
from palpate.errors import UsageError
from palpate.study.run import Paths
from palpate.study.study_lock import hold_study

HOLD = """
import sys
from pathlib import Path
from palpate.study.study_lock import hold_study
from palpate.study.study_paths import Paths

with hold_study(Paths(Path(sys.argv[1]), sys.argv[2]), "palpate touch") as lock:
    lock.set_address("http://127.0.0.1:8080/?token=secret")
    print("held", flush=True)
    sys.stdin.readline()
"""


@contextmanager
def other_command(folder: Path, name: str) -> Iterator[subprocess.Popen[str]]:
    """Another process that holds the lock of a study until a line comes, or it is killed."""
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(folder), name],
        text=True,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.full
def test_a_second_command_is_refused_until_the_first_has_ended(palpate, tmp_path):
    part = tmp_path / "pad.stl"
    trimesh.creation.box((40.0, 30.0, 20.0)).export(part)
    block = tmp_path / "block.toml"
    block.write_text(BLOCK + FEW_SOLVES, encoding="utf-8")
    before = sorted(tmp_path.iterdir())
    for name, commands in (
        ("pad", (("touch", part, "--no-view"), ("touch", part, "--view", "--port", "0"))),
        ("tiny", (("sweep", block), ("sweep", block, "--until", "5%"), ("learn", block))),
    ):
        with other_command(tmp_path, name) as other:
            for words in commands:
                answer = palpate(*words)
                assert answer.code == 2, answer.err
                assert (
                    f"palpate already works on {name}, at http://127.0.0.1:8080/?token=secret." in answer.err
                )
                assert f"`palpate touch`, process {other.pid}" in answer.err
            other.communicate("end\n", timeout=30)
        assert sorted(tmp_path.iterdir()) == before, "nothing was written, and the lock is gone"


def test_the_lock_of_a_killed_command_is_taken_over(tmp_path):
    paths = Paths(tmp_path, "pad")
    with other_command(tmp_path, "pad") as other:
        with pytest.raises(UsageError, match="already works on pad"), hold_study(paths, "palpate sweep"):
            pass
        other.send_signal(signal.SIGTERM if sys.platform == "win32" else signal.SIGKILL)
        other.wait(30)
    assert paths.lock.exists(), "it was left behind"
    with hold_study(paths, "palpate learn"):
        assert json.loads(paths.lock.read_text(encoding="utf-8"))["work"] == "palpate learn"
        with pytest.raises(UsageError, match="`palpate learn`"), hold_study(paths, "palpate sweep"):
            pass
    assert not paths.lock.exists()
    with hold_study(paths, "palpate sweep"):  # again, as nothing is held
        pass


@pytest.mark.skipif(sys.platform == "win32", reason="permissions of files are POSIX")
def test_only_its_user_reads_the_address_with_its_token(tmp_path):
    paths = Paths(tmp_path, "pad")
    with hold_study(paths, "palpate touch"):
        assert paths.lock.stat().st_mode & 0o777 == 0o600
