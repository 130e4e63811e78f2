"""Two tiers of tests: a plain run goes through every real part, and `full` holds what that leaves out."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import kernels

ROOT = Path(__file__).parents[2]
TESTS = ROOT / "tests"
FILES = sorted(TESTS.rglob("test_*.py"))
FOLDERS = sorted({path.parent for path in FILES})


def functions(path: Path) -> Iterator[tuple[str, bool]]:
    """Name of each test function of a file, and whether a plain run leaves it out."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    marks = [
        ast.unparse(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "pytestmark"
    ]
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            marked = [
                *marks,
                *(ast.unparse(mark) for mark in node.decorator_list if "param" not in ast.unparse(mark)),
            ]
            yield node.name, any("pytest.mark.full" in mark for mark in marked)


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.relative_to(TESTS).as_posix())
def test_every_folder_has_tests_in_a_plain_run(folder: Path):
    own = [full for path in FILES if path.parent == folder for _, full in functions(path)]
    assert own
    assert not all(own), "a fault here would only be seen by the whole check"


# real parts, and the files that go through them in a plain run
REAL_PARTS = {
    "bodies of each kind": "cli/test_each_kind.py",
    "Zarr": "dataset/test_dataset.py",
    "workers": "sweeps/test_sweep.py",
    "websockets": "viewer/test_traffic.py",
    "Chromium": "viewer/test_page.py",
    "compiled C": "export/test_export_checklist.py",
    "devices": "devices/test_device_checklist.py",
}


@pytest.mark.parametrize("part", REAL_PARTS)
def test_a_plain_run_goes_through_every_real_part(part: str):
    (path,) = [path for path in FILES if path.as_posix().endswith(REAL_PARTS[part].partition("/")[2])]
    assert not all(full for _, full in functions(path))


def test_one_other_tier_is_all_there_is():
    words = [
        (path.name, "pytest.mark." + word)
        for path in TESTS.rglob("*.py")
        for word in ("slo" + "w",)
        if "pytest.mark." + word in path.read_text(encoding="utf-8")
    ]
    assert not words


def test_the_long_files_exist():
    names = (TESTS / "long_files.txt").read_text(encoding="utf-8").split()
    assert len(names) == len(set(names))
    assert not [name for name in names if not (ROOT / name).is_file()]


def test_the_whole_check_runs_both_tiers():
    commands = (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()
    runs = [line.partition("||")[0].strip() for line in commands if line.startswith("python -m pytest")]
    assert runs == ["python -m pytest", "python -m pytest -m full"]


@pytest.mark.full
@pytest.mark.parametrize("half", kernels.HALVES)
def test_the_warm_up_calls_what_there_is(half: str):
    """A whole run goes on without it, only slower."""
    done = subprocess.run(
        [sys.executable, kernels.__file__, half], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
