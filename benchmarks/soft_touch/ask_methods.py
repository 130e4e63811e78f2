"""Ask the methods of soft-touch, each in a sweep of its settings, and keep what they answer.

    python -m benchmarks.soft_touch.ask_methods [--method NAME ...] [--case NAME ...] [--paths 12] [--minutes 30]

A sweep asks for the presses of the first two paths alone. The setting that comes nearest to the oracle there, chosen
for each body by itself, is asked for everything else: rivals are shown at their best, which this choice flatters.
What they answer is kept in `answers/METHOD.json` with settings, versions and the machine, case by case, so that a
second call goes on.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
import time
from importlib import metadata
from typing import Any

import numpy as np

from benchmarks.machine import machine_line
from benchmarks.soft_touch.case_files import Case, case_names, read_case
from benchmarks.soft_touch.judge import compare, question
from benchmarks.soft_touch.standings import ANSWERS, METHODS

__all__ = ["ask"]

SWEPT_PATHS = 2
PACKAGES = {"mujoco_flex": ("mujoco",), "newton_vbd": ("newton", "warp-lang"), "force_rbf": ("scipy",)}
FIGURES = 6  # significant, of numbers that are kept


def ask(name: str, case: Case, paths: int) -> dict[str, Any]:
    """Return the sweep of a method on a case, and all answers of its best setting."""
    module = importlib.import_module(f"benchmarks.soft_touch.methods.{name}")
    few = _first_paths(case, SWEPT_PATHS)
    sweep = []
    settings = getattr(module, "settings_of", lambda _: module.SETTINGS)(case)
    for setting in settings:
        begin = time.process_time()
        method = module.load(case, **setting)
        answers = {"press": few.presses, "at_presses": method.force(few.places).tolist()}
        figures = compare(answers, case)
        row = {name: figures[name] for name in ("force_median", "jnd_median", "jnd_p95", "presses")}
        sweep.append({"settings": method.settings, **row, "seconds": time.process_time() - begin})
        print(f"{name}, {case.name}: {sweep[-1]}", file=sys.stderr, flush=True)
    best = min(range(len(sweep)), key=lambda k: sweep[k]["jnd_median"])
    method = module.load(case, **settings[best])
    return {"sweep": sweep, "best": question(method, _first_paths(case, paths))}


def _first_paths(case: Case, count: int) -> Case:
    return case.only([press for press, path in zip(case.presses, case.paths, strict=True) if path < count])


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _rounded(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_rounded(entry) for entry in value]
    if isinstance(value, float):
        return float(f"{value:.{FIGURES}g}") if np.isfinite(value) else None
    return value


def _versions(name: str) -> str:
    return ", ".join(f"{package} {metadata.version(package)}" for package in PACKAGES.get(name, ()))


def main(arguments: list[str] | None = None) -> int:
    """Ask methods for what their files don't hold yet, as long as the time allows."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.soft_touch.ask_methods")
    parser.add_argument("--method", nargs="+", choices=list(METHODS), default=list(METHODS))
    parser.add_argument("--case", nargs="+", choices=case_names(), default=case_names())
    parser.add_argument(
        "--paths", type=int, default=12, help="paths of each body that the best setting is asked for"
    )
    parser.add_argument("--minutes", type=float, default=30.0, help="no body is begun after so long")
    parser.add_argument("--again", action="store_true", help="ask again what is kept already")
    options = parser.parse_args(arguments)
    begin = time.monotonic()
    for name in options.method:
        path = ANSWERS / f"{name}.json"
        kept = json.loads(path.read_text("utf-8")) if path.exists() else {"cases": {}}
        for case in options.case:
            if (
                case in kept["cases"] and not options.again
            ) or time.monotonic() - begin > 60 * options.minutes:
                continue
            kept["cases"][case] = _rounded(ask(name, read_case(case), options.paths))
            kept |= {"versions": _versions(name), "machine": machine_line()}
            path.parent.mkdir(exist_ok=True)
            path.write_text(json.dumps(kept, separators=(",", ":"), ensure_ascii=False) + "\n", "utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
