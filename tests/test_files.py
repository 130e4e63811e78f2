"""Files appear whole or not at all, whatever the disk does; scratch folders of killed processes go."""

import errno
import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from palpate import files
from palpate.cli.program import main
from palpate.dataset import Dataset, Layout, assemble
from palpate.errors import ResourceError, UsageError
from palpate.files import TemporaryFolder, system_errors, write_file, writing, writing_folder
from palpate.network.container import Container, write_container
from palpate.units import Range

resource = pytest.importorskip("resource")


@pytest.fixture
def full_disk():
    """No file may grow beyond 20 kB: the system refuses to write, as a full disk does."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def dataset(rows):
    noise = np.random.default_rng(0).standard_normal((rows, 1, 3))
    scalars = ("strain_energy", "potential_energy", "iterations", "residual", "solve_seconds")
    answers = {name: np.zeros(rows) for name in scalars}
    answers |= {"displacement": noise, "root_reaction": noise[:, 0], "converged": np.ones(rows, dtype=bool)}
    answers["message"] = np.full(rows, "converged", dtype=object)
    layout = Layout(np.array([[1.0, 0.0]]), None, (0,), ((0.0, -1.0),))
    return assemble((Range("P", 0.0, 1.0, "N"),), layout, noise[:, 0, :1], answers, {"problem": {}})


def names(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.full
def test_a_full_disk_changes_nothing(tmp_path, full_disk):
    old = dataset(4)
    old.save(tmp_path / "a.zarr")
    with pytest.raises(ResourceError, match="Could not write") as caught:
        dataset(20_000).save(tmp_path / "a.zarr", overwrite=True)
    assert "disk is full" in caught.value.why
    assert caught.value.exit_code == 3
    assert old.save(tmp_path / "a.zarr") == tmp_path / "a.zarr"
    write_file(tmp_path / "b.palpate", "old")
    with pytest.raises(ResourceError, match="disk is full"):
        write_container(tmp_path / "b.palpate", Container("networks", "{}", {"a": np.zeros(10_000)}))
    assert (tmp_path / "b.palpate").read_text() == "old"
    assert names(tmp_path) == ["a.zarr", "b.palpate"]


@pytest.mark.parametrize(
    ("code", "kind", "word"),
    [
        (errno.ENOSPC, ResourceError, "full"),
        (errno.EDQUOT, ResourceError, "full"),
        (errno.EROFS, ResourceError, "write-protected"),
        (errno.EACCES, ResourceError, "write-protected"),
        (errno.ENOMEM, ResourceError, "memory"),
        (errno.EIO, ResourceError, "Check the disk"),
        (errno.ENOENT, UsageError, "folder that exists"),
    ],
)
def test_errors_of_the_system_are_sentences(tmp_path, monkeypatch, code, kind, word):
    def refuse(*_):
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(files.os, "replace", refuse)
    with pytest.raises(kind, match=word) as caught:
        write_file(tmp_path / "a.txt", "new")
    assert type(caught.value) is kind
    assert names(tmp_path) == []
    monkeypatch.undo()
    with pytest.raises(kind), system_errors("It failed."):
        refuse()


def test_want_of_memory_is_a_sentence():
    with pytest.raises(ResourceError, match="no memory left"), system_errors("It failed."):
        raise MemoryError


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), MemoryError()])
def test_commands_end_with_code_3_not_1(monkeypatch, capsys, error):
    def fail(*_):
        raise error

    monkeypatch.setattr("palpate.cli.doctor.report", fail)
    with pytest.raises(SystemExit) as end:
        main(["doctor"])
    assert end.value.code == 3
    assert "palpate doctor could not go on" in capsys.readouterr().err


def test_an_interrupted_write_leaves_the_old_file(tmp_path):
    write_file(tmp_path / "a.txt", "old")
    folder = tmp_path / "b"
    folder.mkdir()
    (folder / "old").touch()

    def begin_file():
        with writing(tmp_path / "a.txt") as part:
            part.write_text("ne")
            raise KeyboardInterrupt

    def begin_folder():
        with writing_folder(folder) as part:
            part.mkdir()
            raise KeyboardInterrupt

    for begin in (begin_file, begin_folder):
        with pytest.raises(KeyboardInterrupt):
            begin()
    assert (tmp_path / "a.txt").read_text() == "old"
    assert names(tmp_path) == ["a.txt", "b"]
    assert names(folder) == ["old"]
    with writing_folder(folder) as part:
        part.mkdir()
        (part / "new").touch()
    assert names(folder) == ["new"]


def test_what_a_killed_process_was_writing_goes_with_the_next_write(tmp_path):
    old, young, store = (
        tmp_path / name for name in (".a.0123abcd.part.txt", ".a.89abcdef.part.txt", ".b.01234567.part")
    )
    for part in (old, young):
        part.touch()
    store.mkdir()
    for part in (old, store):
        os.utime(part, (0.0, 0.0))
    write_file(tmp_path / "a.txt", "new")
    with writing_folder(tmp_path / "b") as part:
        part.mkdir()
    assert names(tmp_path) == [young.name, "a.txt", "b"]


KILLED_IN_BETWEEN = """
import os, signal, sys
from palpate.dataset import Dataset
data = Dataset.open(sys.argv[1])
def replace(source, target, replaced=os.replace):
    if str(target) == sys.argv[1]:
        os.kill(os.getpid(), signal.SIGKILL)
    replaced(source, target)
os.replace = replace
data.take([0]).save(sys.argv[1], overwrite=True)
"""


@pytest.mark.full
def test_a_dataset_that_a_killed_process_was_replacing_is_taken_back(tmp_path):
    """It is killed after the old one has been moved aside, before the new one takes its place."""
    old = dataset(4)
    old.save(tmp_path / "a.zarr")
    done = subprocess.run([sys.executable, "-c", KILLED_IN_BETWEEN, tmp_path / "a.zarr"], check=False)
    assert done.returncode == -signal.SIGKILL
    assert not (tmp_path / "a.zarr").exists()
    assert Dataset.open(tmp_path / "a.zarr").hash == old.hash
    assert not list(tmp_path.glob(".a.zarr.*.old"))
    assert old.save(tmp_path / "a.zarr") == tmp_path / "a.zarr"


HOLDER = """
import signal, sys
from palpate.cli import main
import palpate.cli.doctor
from palpate.files import TemporaryFolder
def report(*_):
    with TemporaryFolder() as folder:
        print(folder, flush=True)
        signal.pause()
palpate.cli.doctor.report = report
sys.argv = ["palpate", "doctor"]
main()
"""


def held_folder(tmp_path):
    """A process that holds a temporary folder in `tmp_path` until it is ended, and the folder."""
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDER], stdout=subprocess.PIPE, text=True, env=environment
    )
    return process, process.stdout.readline().strip()


@pytest.mark.full
def test_sigterm_removes_temporary_folders(tmp_path):
    process, folder = held_folder(tmp_path)
    assert names(tmp_path) == [os.path.basename(folder)]
    process.terminate()
    process.communicate(timeout=20)
    assert process.returncode == 128 + signal.SIGTERM
    assert names(tmp_path) == []


@pytest.mark.full
def test_folders_of_killed_processes_go_with_the_next_start(tmp_path, monkeypatch):
    killed, stale = held_folder(tmp_path)
    running, alive = held_folder(tmp_path)
    killed.kill()
    killed.communicate()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    try:
        with TemporaryFolder() as own:
            assert names(tmp_path) == sorted(map(os.path.basename, (alive, own)))
            assert stale not in (alive, str(own))
    finally:
        running.kill()
        running.communicate()
