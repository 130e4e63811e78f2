"""Ask the methods of soft-touch, each in a sweep of its settings, and keep what they answer.

    python -m benchmarks.soft_touch.ask_methods [--method NAME ...] [--case NAME ...] [--paths 12] [--minutes 30]

A sweep asks for the presses of the first two paths alone. The setting that comes nearest to the oracle there, chosen
for each body by itself, is asked for everything else: rivals are shown at their best, which this choice flatters. A
method with `shown_of(case)`, palpate's, is shown in that setting without such a choice.
What they answer is kept in `answers/METHOD.json` with settings, versions and the machine, case by case, so that a
second call goes on.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from importlib import metadata
from typing import Any

import numpy as np

from benchmarks.machine import machine_line
from benchmarks.soft_touch.case_files import CASES, Case, case_names, read_case
from benchmarks.soft_touch.judge import question, question_moving
from benchmarks.soft_touch.standings import ANSWERS, METHODS, best_row
from palpate.files import write_file

__all__ = ["ask", "load", "main", "settings_of", "sweep"]

SWEPT_PATHS = 2
PACKAGES = {"mujoco_flex": ("mujoco",), "newton_vbd": ("newton", "warp-lang"), "force_rbf": ("scipy",)}
PROBED_PATHS = 2  # whose presses a simulator is asked for stiffness: each takes it steps to rest
LOOP_EVERY = 6  # of the 72 corners of a closed path, a simulator is asked for every sixth
DIGITS = 6  # significant, of numbers that are kept


def sweep(
    name: str, case: Case, kept: list[dict[str, Any]], count: int | None = None
) -> Iterator[dict[str, Any]]:
    """Yield what each setting of a method answers at the presses of the first paths, less those that are kept."""
    few = _first_paths(case, SWEPT_PATHS)
    for setting in settings_of(name, case)[:count]:
        if all(row["setting"] != setting for row in kept):
            begin = time.process_time()
            method = load(name, case, setting)
            forces = method.force(few.places).tolist()
            spent = time.process_time() - begin
            answers = {"press": few.presses, "at_presses": forces, "seconds": spent}
            yield {"setting": setting, "settings": method.settings, **answers}


def settings_of(name: str, case: Case) -> list[dict[str, Any]]:
    """Return all settings of a method on a case."""
    module = _module(name)
    return list(module.settings_of(case) if hasattr(module, "settings_of") else module.SETTINGS)


def load(name: str, case: Case, setting: dict[str, Any]) -> Any:
    """Return a method in one of its settings."""
    return _module(name).load(case, **setting)


def _module(name: str) -> Any:
    return importlib.import_module(f"benchmarks.soft_touch.methods.{name}")


def _first_paths(case: Case, count: int) -> Case:
    return case.only([press for press, path in zip(case.presses, case.paths, strict=True) if path < count])


def _with_oracle(blind: Case, whole: Case) -> Case:
    """Return a case with all presses, and the oracle's forces where it has them: later ones need no asking anew."""
    rows = [blind.presses.index(press) for press in whole.presses]
    force = blind.force.copy()
    force[rows] = whole.force
    return replace(blind, force=force)


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _rounded(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_rounded(entry) for entry in value]
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}") if np.isfinite(value) else None
    return value


def _versions(name: str) -> str:
    return ", ".join(f"{package} {metadata.version(package)}" for package in PACKAGES.get(name, ()))


def ask(name: str, case: str, kept: dict[str, Any], options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """Yield what is kept of a method on a case whenever there is more: the sweep, then the best setting's answers."""
    blind = read_case(case, blind=True)
    kept.setdefault("sweep", [])
    for row in sweep(name, blind, kept["sweep"], options.settings):
        kept["sweep"].append(row)
        print(f"{name}, {case}: {row['settings']}, {row['seconds']:.0f} s", file=sys.stderr, flush=True)
        yield kept
    if case not in case_names() or not kept["sweep"]:
        return
    whole = read_case(case)
    shown_of = getattr(_module(name), "shown_of", None)
    setting = shown_of(whole) if shown_of else best_row(kept["sweep"], whole)["setting"]
    asked = _first_paths(_with_oracle(blind, whole), options.paths)
    before = kept.get("best", {})
    fresh = before.get("setting") == setting and before["press"] == asked.presses
    moving = options.loops and not (fresh and "loop_work" in before)
    if fresh and not moving:
        return
    method, probed = load(name, blind, setting), None
    if hasattr(method, "step"):
        probed = _first_paths(asked, PROBED_PATHS).presses
        asked = replace(asked, loops={loop: places[::LOOP_EVERY] for loop, places in asked.loops.items()})
    if not fresh:
        kept["best"] = {"setting": setting, **question(method, asked, loops=False, probed=probed)}
        print(f"{name}, {case}: all presses, {method.settings}", file=sys.stderr, flush=True)
        yield kept
    if moving:
        kept["best"] |= question_moving(method, asked)
        print(f"{name}, {case}: closed paths and strokes, {method.settings}", file=sys.stderr, flush=True)
        yield kept


def main(arguments: list[str] | None = None) -> int:
    """Ask methods for what their files don't hold yet, as long as the time allows."""
    names = sorted(path.parent.name for path in CASES.glob("*/presses.csv"))
    parser = argparse.ArgumentParser(prog="python -m benchmarks.soft_touch.ask_methods")
    parser.add_argument("--method", nargs="+", choices=list(METHODS), default=list(METHODS))
    parser.add_argument("--case", nargs="+", choices=names, default=names)
    parser.add_argument("--paths", type=int, default=12, help="paths that the best setting is asked for")
    parser.add_argument("--minutes", type=float, default=30.0, help="nothing is begun after so long")
    parser.add_argument("--settings", type=int, help="settings of the sweep, the first ones. Default: all")
    parser.add_argument(
        "--no-loops", dest="loops", action="store_false", help="leave out closed paths and strokes"
    )
    options = parser.parse_args(arguments)
    begin = time.monotonic()
    for name in options.method:
        path = ANSWERS / f"{name}.json"
        kept = json.loads(path.read_text("utf-8")) if path.exists() else {"cases": {}}
        for case in options.case:
            before = dict(kept["cases"].get(case, {}))
            try:
                for answers in ask(name, case, before, options):
                    kept["cases"][case] = _rounded(answers)
                    kept |= {"versions": _versions(name), "machine": machine_line()}
                    path.parent.mkdir(exist_ok=True)
                    text = json.dumps(kept, separators=(",", ":"), ensure_ascii=False)
                    write_file(path, text.replace('{"setting"', '\n{"setting"') + "\n")
                    if time.monotonic() - begin > 60.0 * options.minutes:
                        return 0
            except ImportError as error:
                print(f"{METHODS[name]} is left as it is: {error}", file=sys.stderr)
                break
    return 0


if __name__ == "__main__":
    sys.exit(main())
