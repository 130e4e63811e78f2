"""The first minute on a machine: commands with an empty cache of kernels, and once more with what they left there.

    python -m benchmarks.cold_start [--quick] [--json] [--record]

Each command gets a folder of its own for Numba's cache (``NUMBA_CACHE_DIR``), empty at first. `palpate demo` carries
out both founding beams; `palpate touch --start` presses the kidney sample until it can be touched, which counts from
the start; `ask` and `run` take what that has left, a body of twelve solves. The rival is a new process that reads
scikit-learn's Gaussian process of as many rows from a file of joblib and asks it at one place: it compiles nothing.
"""

from __future__ import annotations

import os
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.processes import kill_group

__all__ = ["tables"]

PALPATE = (sys.executable, "-m", "palpate")
WANTED = {"ask --at": 5.0, "run --seconds 1": 8.0, "demo": 35.0, "touch, first touch": 60.0}  # s, cold
_LIMIT = 600.0  # s
_TOUCHED = re.compile(r"It can be touched, ([\d.]+) (s|min) after the start")
_PLACE = "0,0,0.043"  # m, in the kidney by a little
_RIVAL = """
import joblib, numpy
model = joblib.load({path!r})
print(model.predict(numpy.zeros((1, 3)), return_std=True))
"""
_FIT = """
import joblib, numpy
from sklearn.gaussian_process import GaussianProcessRegressor
rng = numpy.random.default_rng(0)
X = rng.uniform(size=(12, 3))
joblib.dump(GaussianProcessRegressor(optimizer=None).fit(X, X.sum(axis=1)), {path!r})
"""


def tables(*, quick: bool = False) -> list[Table]:
    """Return the table; `quick` asks a body made by formula and leaves out the rest."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        rows = _quick_rows(folder) if quick else _rows(folder)
    claims = [
        Claim(f"{row['what']} with an empty cache, s", (float(row["cold"]),), WANTED[row["what"]], ".1f")
        for row in rows
        if row["what"] in WANTED
    ]
    columns = [
        Column("what", "command"),
        Column("cold", "s, empty cache", ".1f"),
        Column("cold_work", "of processors, s", ".1f"),
        Column("warm", "s, warm", ".1f"),
        Column("warm_work", "of processors, s", ".1f"),
    ]
    notes = (
        "s of processors are those of the command and of all processes that it started",
        "a busy machine takes longer; the seconds of processors tell by how much",
    )
    title = f"The first minute on a machine{quick_mark(quick)}"
    return [Table("cold_start", title, columns, rows, [] if quick else claims, notes)]


def _rows(folder: Path) -> list[dict[str, float | str]]:
    """Return a row for each command, and the rival's."""
    demo = _twice("demo", folder, _demo)
    touch = _twice("touch, first touch", folder, _first_touch)
    body = next(folder.glob("touch*/warm/kidney-rough.palpate"))
    return [_asked(folder, body, _PLACE), _run(folder, body), demo, touch, _rival(folder)]


def _quick_rows(folder: Path) -> list[dict[str, float | str]]:
    from palpate.runtime.warm_up import slab

    slab().save(folder / "slab.palpate")
    return [_asked(folder, folder / "slab.palpate", "0.03,0.03,0.008")]


def _asked(folder: Path, body: Path, place: str) -> dict[str, float | str]:
    command = (*PALPATE, "ask", str(body), "--at", place)
    return _twice("ask --at", folder, lambda own, cache: _seconds(command, own, cache))


def _run(folder: Path, body: Path) -> dict[str, float | str]:
    command = (*PALPATE, "run", str(body), "--seconds", "1")
    return _twice("run --seconds 1", folder, lambda own, cache: _seconds(command, own, cache))


def _twice(what: str, folder: Path, measure: Callable[[Path, Path], float]) -> dict[str, float | str]:
    """Measure a command with an empty cache and then with the cache that it left, each in a folder of its own."""
    row: dict[str, float | str] = {"what": what}
    place = folder / re.sub(r"\W+", "-", what)
    cache = place / "cache"
    cache.mkdir(parents=True)
    for how in ("cold", "warm"):
        (place / how).mkdir()
        before = _processor_seconds()
        row[how] = measure(place / how, cache)
        row[f"{how}_work"] = _processor_seconds() - before
        print(f"  {what}, {how}: {row[how]:.1f} s", file=sys.stderr, flush=True)
    return row


def _processor_seconds() -> float:
    """Return s of processors that children of this process have taken, those that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _seconds(command: tuple[str, ...], folder: Path, cache: Path) -> float:
    """Return s from the start of a command to its end."""
    began = time.perf_counter()
    subprocess.run(
        command, cwd=folder, env=_environment(cache), check=True, capture_output=True, timeout=_LIMIT
    )
    return time.perf_counter() - began


def _environment(cache: Path) -> dict[str, str]:
    return os.environ | {"NUMBA_CACHE_DIR": str(cache)}


def _demo(folder: Path, cache: Path) -> float:
    return _seconds((*PALPATE, "demo", "--no-view"), folder, cache)


def _first_touch(folder: Path, cache: Path) -> float:
    """Return s from the start of the work on the kidney sample until it can be touched."""
    _seconds((*PALPATE, "init", "--sample"), folder, cache)
    command = (*PALPATE, "touch", "kidney.stl", "--view", "--start", "--port", "0")
    process = subprocess.Popen(
        command,
        cwd=folder,
        env=_environment(cache),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        assert process.stderr is not None
        for line in process.stderr:
            if found := _TOUCHED.search(line):
                return float(found[1]) * (60.0 if found[2] == "min" else 1.0)
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(30.0)
        finally:
            kill_group(process)  # type: ignore[arg-type]
    raise RuntimeError("The kidney sample was never touched.")


def _rival(folder: Path) -> dict[str, float | str]:
    """Return the row of scikit-learn's Gaussian process in a new process."""
    path = str(folder / "model.joblib")
    subprocess.run((sys.executable, "-c", _FIT.format(path=path)), check=True, timeout=_LIMIT)
    command = (sys.executable, "-c", _RIVAL.format(path=path))
    return _twice("scikit-learn, predict", folder, lambda own, cache: _seconds(command, own, cache))


if __name__ == "__main__":
    sys.exit(main(only="cold_start"))
