"""An hour of the loop at 1 kHz with a page that drags: memory, lateness, drift of the clock, faults.

    python -m benchmarks.soak [--seconds 3600] [--every 10] --out soak.json [--plot soak.svg]

Not one of the tables: run by hand. A page, as a program of its own, drags the body to and fro and takes pictures; its
requests keep the server at work as a browser does.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import os
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from benchmarks.cases import touch_model
from benchmarks.punctuality import await_grab, drag
from palpate.runtime.loop_report import percentile
from palpate.viewer import Viewer

RATE = 1000.0  # Hz


def watch(seconds: float, every: float) -> list[dict[str, float]]:
    """Return a row for each `every` s: what happened since the last, and the memory of loop and server, MB."""
    context = multiprocessing.get_context("spawn")
    rows = []
    with Viewer(touch_model("nylon", quick=True), port=0, rate=RATE) as viewer:
        over = context.Event()
        cookie = "; ".join(f"{name}={value}" for name, value in viewer.cookies.items())
        reach = float(viewer.model.workspace(0.075).radius)
        page = context.Process(target=drag, args=(viewer.address, cookie, reach, over), daemon=True)
        page.start()
        await_grab(viewer)
        loop, server = psutil.Process(viewer.loop.pid), psutil.Process(os.getpid())
        last, begun = viewer.loop.read(), time.perf_counter()
        first = last
        while (now := time.perf_counter()) < begun + seconds:
            time.sleep(min(every, begun + seconds - now))
            state, at = viewer.loop.read(), time.perf_counter() - begun
            late = state.histogram - last.histogram
            rows.append(
                {
                    "time": at,
                    "loop": loop.memory_info().rss / 1e6,
                    "server": server.memory_info().rss / 1e6,
                    "p50": 1e6 * percentile(late, 0.5),
                    "p99": 1e6 * percentile(late, 0.99),
                    "rate": (state.tick - last.tick) / (at - (rows[-1]["time"] if rows else 0.0)),
                    "missed": RATE * at - (state.tick - first.tick),
                    "faults": float((state.fault_counts - first.fault_counts)[1:].sum()),
                    "force": math.hypot(*state.force),
                }
            )
            last = state
        over.set()
        page.join(10)
    return rows


def plot(rows: list[dict[str, float]], path: Path) -> None:
    """Draw memory, lateness and missed ticks over time."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    minutes = np.array([row["time"] for row in rows]) / 60.0
    figure, axes = plt.subplots(3, 1, sharex=True, figsize=(7.0, 6.0), layout="constrained")
    lines: tuple[tuple[int, str, str], ...] = (
        (0, "loop", "loop"),
        (0, "server", "server with page"),
        (1, "p50", "median"),
        (1, "p99", "p99"),
        (2, "missed", "ticks missed so far"),
        (2, "faults", "faults so far"),
    )
    for panel, key, label in lines:
        axes[panel].plot(minutes, [row[key] for row in rows], label=label)
    for axis, title in zip(axes, ("memory, MB", "lateness, µs", "count"), strict=True):
        axis.set_ylabel(title)
        axis.set_ylim(bottom=0.0)
        axis.legend(loc="best", frameon=False)
    axes[-1].set_xlabel("time, min")
    figure.savefig(path)


def summary(rows: list[dict[str, float]]) -> dict[str, Any]:
    """Return growth of memory over the last three quarters, ticks missed and faults."""
    rest = rows[len(rows) // 4 :]
    minutes = np.array([row["time"] for row in rest]) / 60.0
    return {
        "minutes": rows[-1]["time"] / 60.0,
        "MB per hour, loop": 60.0 * float(np.polyfit(minutes, [row["loop"] for row in rest], 1)[0]),
        "MB per hour, server": 60.0 * float(np.polyfit(minutes, [row["server"] for row in rest], 1)[0]),
        "ticks missed": rows[-1]["missed"],
        "faults": rows[-1]["faults"],
        "lateness p50, µs, median": float(np.median([row["p50"] for row in rows])),
        "lateness p99, µs, median": float(np.median([row["p99"] for row in rows])),
    }


def main() -> None:
    """Watch, write and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=3600.0)
    parser.add_argument("--every", type=float, default=10.0, help="s between two rows")
    parser.add_argument("--out", type=Path, required=True, help="JSON file")
    parser.add_argument("--plot", type=Path, help="picture of it")
    options = parser.parse_args()
    rows = watch(options.seconds, options.every)
    options.out.write_text(json.dumps({"summary": summary(rows), "rows": rows}))
    if options.plot:
        plot(rows, options.plot)
    print(json.dumps(summary(rows), indent=2))


if __name__ == "__main__":
    main()
