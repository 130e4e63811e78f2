"""How punctual the loop is, beside ``cyclictest`` (rt-tests) at the same priority, while a page and a learner work.

    python -m benchmarks.punctuality [--quick] [--json]

The second table is of one loop while a page drags: at rest, while a part is solved and learnt as `palpate touch` does,
and while, besides, another surrogate takes the place of the one in the hand, every two seconds.

Rounds alternate: `cyclictest` beside a learner that adapts in a process of its own, then the loop beside the same
learner and with a page that drags and asks for pictures. Both are asked for a tick each millisecond. Without
`cyclictest` on this machine its columns stay empty.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import multiprocessing
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from websockets.sync.client import connect

from benchmarks.cases import formula_block, touch_model
from benchmarks.runner import main
from benchmarks.surrogate_cases import Case
from benchmarks.surrogate_measure import learnt
from benchmarks.table import Claim, Column, Table
from palpate.files import TemporaryFolder
from palpate.learning import Learner
from palpate.physics.shapes.sample_part import write_sample_part
from palpate.processes import available_cores, helper_environment, kill_group
from palpate.runtime.loop_report import percentile
from palpate.study.part_study import part_study, part_text
from palpate.surrogates import Surrogate
from palpate.units import Range
from palpate.viewer import Viewer
from palpate.viewer.messages import Credit, Hand

__all__ = ["await_grab", "drag", "tables"]

SECONDS, ROUNDS = 20.0, 3
PRIORITY = 40  # that of the loop, where it is granted
FRAMES = 60.0  # of the page, Hz
WARM = 2.0  # s before counting
SWAPS = 2.0  # s from one swap to the next; a part brings one in half a minute or so
SHARES = (0.5, 0.99, 0.999)


def tables(*, quick: bool = False) -> list[Table]:
    """The table; `quick` takes one round of a second on the beam."""
    seconds, rounds = (1.0, 1) if quick else (SECONDS, ROUNDS)
    bodies = {"nylon beam": touch_model("nylon", quick=quick)}
    if not quick:
        bodies["liver"] = _liver()
    rows = []
    with _learner():
        for name, body in bodies.items():
            pairs = [(_cyclictest(seconds), _loop(body, seconds)) for _ in range(rounds)]
            rows.append(_row(name, pairs))
    worst = {key: max(row[key] for row in rows) for key in ("late_p50", "late_p99", "work_p50", "work_p999")}
    rival = {key: min(row[key] for row in rows) for key in ("cyclic_p50", "cyclic_p99")}
    return [
        Table(
            "punctuality",
            f"A tick each ms beside a learner and a page, {rounds} × {seconds:g} s{' (quick)' if quick else ''}, µs",
            (
                Column("body", "body"),
                Column("late_p50", "late, median", ".1f"),
                Column("late_p99", "p99", ".1f"),
                Column("late_p999", "p99.9", ".0f"),
                Column("cyclic_p50", "cyclictest: median", ".0f"),
                Column("cyclic_p99", "p99", ".0f"),
                Column("cyclic_p999", "p99.9", ".0f"),
                Column("work_p50", "CPU of a tick, median", ".0f"),
                Column("work_p99", "p99", ".0f"),
                Column("work_p999", "p99.9", ".0f"),
                Column("granted", "granted"),
            ),
            rows,
            [
                Claim(
                    "lateness over cyclictest's, median",
                    (worst["late_p50"] / rival["cyclic_p50"],),
                    1.2,
                    ".2f",
                ),
                Claim(
                    "lateness over cyclictest's, p99", (worst["late_p99"] / rival["cyclic_p99"],), 1.2, ".2f"
                ),
                Claim("CPU time of a tick, µs, median", (worst["work_p50"],), 50.0, ".0f"),
                Claim("CPU time of a tick, µs, p99.9", (worst["work_p999"],), 200.0, ".0f"),
            ],
            (
                "each figure the median of the rounds; a lateness below the histogram's 1 µs counts as 1 µs",
                "the loop sleeps until shortly before a tick and then asks the clock; cyclictest sleeps all the way",
                f"cyclictest -p {PRIORITY} -m -i 1000, with the learner alone; the loop also has a page beside it",
            ),
        ),
        _while_working(quick=quick),
    ]


def _while_working(*, quick: bool) -> Table:
    """The table of one loop at rest, beside solves and learning, and with swaps."""
    seconds, rounds = (1.0, 1) if quick else (SECONDS, ROUNDS)
    with TemporaryFolder() as folder:
        rows = _phases(folder, seconds, rounds, quick=quick)
    rest = rows[0]["late_p99"]
    return Table(
        "punctuality_working",
        f"One loop under a page's hand, {rounds} × {seconds:g} s{' (quick)' if quick else ''}, µs",
        (
            Column("phase", "meanwhile"),
            Column("late_p50", "late, median", ".1f"),
            Column("late_p99", "p99", ".1f"),
            Column("late_p999", "p99.9", ".0f"),
            Column("late_max", "largest", ".0f"),
            Column("work_p50", "CPU of a tick, median", ".0f"),
            Column("work_p99", "p99", ".0f"),
            Column("swaps", "swaps", "d"),
            Column("faults", "faults", "d"),
        ),
        rows,
        [
            Claim(
                "p99 of lateness beside solves and learning, over that at rest",
                (rows[1]["late_p99"] / rest,),
                1.5,
                ".2f",
            ),
            Claim(
                "p99 of lateness with swaps besides, over that at rest",
                (rows[2]["late_p99"] / rest,),
                1.5,
                ".2f",
            ),
        ],
        (
            "solves and learning: the process behind the page of `palpate touch`, with a worker for each core but one",
            "a lateness below the histogram's 1 µs counts as 1 µs",
        ),
    )


def _phases(folder: Path, seconds: float, rounds: int, *, quick: bool) -> list[dict[str, Any]]:
    bodies = [formula_block(), formula_block()] if quick else [_liver(), _liver(40)]
    files = [body.save(folder / f"{k}.palpate") for k, body in enumerate(bodies)]
    measured: dict[str, list[dict[str, Any]]] = {
        "nothing else": [],
        "solves and learning": [],
        "swaps too": [],
    }
    with _dragged(bodies[0]) as viewer:
        for _ in range(rounds):
            measured["nothing else"].append(_window(viewer, seconds, []))
            with _solving(folder) as ready:
                ready(1.0 if quick else 30.0)
                measured["solves and learning"].append(_window(viewer, seconds, []))
                measured["swaps too"].append(_window(viewer, seconds, files[::-1]))
    return [
        {
            "phase": name,
            "swaps": sum(r["swaps"] for r in windows),
            "faults": sum(r["faults"] for r in windows),
        }
        | {
            key: statistics.median(r[key] for r in windows)
            for key in windows[0]
            if key.startswith(("late", "work"))
        }
        for name, windows in measured.items()
    ]


def _window(viewer: Viewer, seconds: float, files: list[Path]) -> dict[str, Any]:
    """Lateness and work of the loop in a time, µs, while the surrogates of files take turns in the hand."""
    first, until, turn = viewer.loop.read(), time.monotonic() + seconds, itertools.cycle(files)
    while (rest := until - time.monotonic()) > 0:
        if files:
            viewer.loop.swap(next(turn))
        time.sleep(min(rest, SWAPS if files else 0.5))
    last = viewer.loop.read()
    late, work = last.histogram - first.histogram, last.work_histogram - first.work_histogram
    shares = {"p50": 0.5, "p99": 0.99, "p999": 0.999, "max": 1.0 - 1e-9}
    return (
        {f"late_{name}": max(1.0, 1e6 * percentile(late, share)) for name, share in shares.items()}
        | {f"work_{name}": 1e6 * percentile(work, share) for name, share in shares.items()}
        | {"swaps": last.swaps - first.swaps, "faults": last.faults - first.faults}
    )


@contextlib.contextmanager
def _solving(folder: Path) -> Iterator[Callable[[float], None]]:
    """The process behind `palpate touch` on the sample part; what is yielded waits until it solves, at most a time."""
    part, file = folder / "kidney.stl", folder / "kidney.toml"
    if not file.exists():
        write_sample_part(part)
        file.write_text(part_text(*part_study(part, unit="mm")), encoding="utf-8")
    for old in folder.glob("kidney*.zarr*"):
        shutil.rmtree(old, ignore_errors=True)
    process = subprocess.Popen(
        [sys.executable, "-m", "palpate.study.part_work"],
        stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, env=helper_environment(), start_new_session=True,
    )  # fmt: skip
    assert process.stdin is not None
    workers = max(1, available_cores() - 1)
    wish = {"study": str(file), "until": 0.001, "limit": 600.0, "workers": workers}
    process.stdin.write(json.dumps(wish) + "\n")
    process.stdin.flush()
    try:
        yield time.sleep
    finally:
        kill_group(process)
        process.stdin.close()


@contextlib.contextmanager
def _dragged(body: Surrogate) -> Iterator[Viewer]:
    """A page that drags a body about."""
    context = multiprocessing.get_context("spawn")
    with Viewer(body, port=0) as viewer:
        over = context.Event()
        cookie = "; ".join(f"{name}={value}" for name, value in viewer.cookies.items())
        reach = float(viewer.model.workspace(0.075).radius)
        page = context.Process(target=drag, args=(viewer.address, cookie, reach, over), daemon=True)
        page.start()
        await_grab(viewer)
        time.sleep(WARM)
        yield viewer
        over.set()
        page.join(10)


def _row(name: str, pairs: list[tuple[dict[str, Any], dict[str, Any]]]) -> dict[str, Any]:
    keys = [key for pair in pairs[:1] for part in pair for key in part if key != "granted"]
    merged = [a | b for a, b in pairs]
    return {"body": name, "granted": merged[0]["granted"]} | {
        key: statistics.median(one[key] for one in merged) for key in keys
    }


def _cyclictest(seconds: float) -> dict[str, float]:
    """Lateness by `cyclictest`, µs; NaN where it is not installed or not allowed."""
    names = [f"cyclic_p{str(share)[2:].ljust(2, '0')}" for share in SHARES]
    program = shutil.which("cyclictest")
    if program is None:
        return dict.fromkeys(names, math.nan)
    command = [
        program,
        "-q",
        "-m",
        "-p",
        str(PRIORITY),
        "-i",
        "1000",
        "-l",
        str(round(1000 * seconds)),
        "-h",
        "2000",
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=seconds + 30, check=False)
    lines = [line.split() for line in done.stdout.splitlines() if line[:1].isdigit()]
    if not lines:
        return dict.fromkeys(names, math.nan)
    late, counts = np.array([[int(part) for part in line[:2]] for line in lines]).T
    below = np.cumsum(counts)
    return {
        name: float(late[np.searchsorted(below, share * below[-1])])
        for name, share in zip(names, SHARES, strict=True)
    }


def _loop(body: Surrogate, seconds: float) -> dict[str, Any]:
    """Lateness and work of the loop, µs, while a page drags."""
    with _dragged(body) as viewer:
        first = viewer.loop.read()
        time.sleep(seconds)
        last = viewer.loop.read()
        loop = viewer.loop
    report = loop.report()
    late, work = last.histogram - first.histogram, last.work_histogram - first.work_histogram
    names = ("p50", "p99", "p999")
    return (
        {f"late_{n}": max(1.0, 1e6 * percentile(late, s)) for n, s in zip(names, SHARES, strict=True)}
        | {f"work_{n}": 1e6 * percentile(work, s) for n, s in zip(names, SHARES, strict=True)}
        | {"granted": report.obtained.get("scheduler", "unknown")}
    )


def await_grab(viewer: Viewer) -> None:
    """Wait until a page holds the body."""
    until = time.monotonic() + 30.0
    while not viewer.loop.read().grabbed:
        if time.monotonic() > until:
            raise TimeoutError("the page did not take hold of the body")
        time.sleep(0.05)


def drag(address: str, cookie: str, reach: float, over: Any) -> None:
    """Drag the body about as a page does, and take its pictures."""
    headers = {"Cookie": cookie}
    origin = address.rstrip("/")
    with connect(
        address.replace("http", "ws", 1) + "touch", origin=origin, additional_headers=headers
    ) as page:
        begun = time.perf_counter()
        while not over.is_set():
            at = time.perf_counter() - begun
            y = -0.4 * reach * math.sin(2.0 * math.pi * 0.5 * at)
            page.send(Hand(1e3 * at, 1.0 / FRAMES, (0.0, y, 0.0), True, False, np.zeros(0, "f4")).pack())
            page.send(Credit(1).pack())
            with contextlib.suppress(TimeoutError):
                page.recv(timeout=1.0 / FRAMES)
            time.sleep(max(0.0, begun + at + 1.0 / FRAMES - time.perf_counter()))


@contextlib.contextmanager
def _learner() -> Iterator[None]:
    """A process that learns a stream of readings as fast as it can."""
    context = multiprocessing.get_context("spawn")
    over = context.Event()
    process = context.Process(target=_adapt, args=(over,), daemon=True)
    process.start()
    try:
        yield
    finally:
        over.set()
        process.join(10)
        process.kill()


def _adapt(over: Any) -> None:
    rng = np.random.default_rng(1)
    learner = Learner([Range("a", -1.0, 1.0), Range("b", -1.0, 1.0)], [Range("y", -2.0, 2.0)], seed=1)
    while not over.is_set():
        x = rng.uniform(-1.0, 1.0, 2)
        learner.observe(x, np.array([math.sin(3.0 * x[0]) * x[1] + 0.05 * rng.normal()]))


def _liver(solves: int = 80) -> Surrogate:
    case = Case.load("liver")
    assert case is not None
    return learnt(case, solves, 1.0)


if __name__ == "__main__":
    sys.exit(main(only="punctuality"))
