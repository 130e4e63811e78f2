"""Ten parts made by scripts, each from its file to a touchable body by one command.

    python -m benchmarks.ten_parts [PART …] [--minutes 30] [--until 2%] [--refined 4] [--folder DIR] [--out FILE.json]

Not one of the tables that run by themselves: it takes as long as its limit for each part. It runs `palpate touch PART
--no-view` as a user does, one after the other, and takes the figures from its output. With `--refined` some unseen
solves are repeated on elements of 0.6 of the size: what the mesh adds to the error.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.scripted_parts import PARTS

FINER = 0.6  # of the study's element
PATIENCE = 600.0  # s beyond the limit: the last batch, learning and the report


def touch(name: str, folder: Path, until: str, minutes: float) -> dict[str, Any]:
    """Return what one command says of one part: solves, errors, times, or why there are none."""
    part = PARTS[name](folder)
    command = [sys.executable, "-m", "palpate", "touch", str(part), "--no-view", "--json"]
    began = time.perf_counter()
    try:
        done = subprocess.run(
            [*command, "--until", until, "--minutes", str(minutes)],
            capture_output=True,
            text=True,
            timeout=60 * minutes + PATIENCE,
            check=False,
            env=os.environ | {"OMP_NUM_THREADS": "1"},
        )
    except subprocess.TimeoutExpired:
        return {
            "part": part.name,
            "seconds": 60 * minutes + PATIENCE,
            "error": "It took longer than its limit.",
        }
    row: dict[str, Any] = {"part": part.name, "seconds": time.perf_counter() - began, "code": done.returncode}
    start = done.stdout.find("{")
    said = json.loads(done.stdout[start:]) if start >= 0 else {}
    if "steps" in said:
        row |= {
            "steps": said["steps"],
            "reached": said["reached"],
            "reason": said["reason"],
            "model": said["model"],
        }
    else:
        row["error"] = json.dumps(said) if said else " ".join(done.stderr.split("error:")[-1].split())[:400]
    return row


def mesh_error(model: Path, study_file: Path, count: int) -> dict[str, float]:
    """Return the relative differences of a surrogate's force from solves on finer elements, at unseen places."""
    from palpate.dataset import Dataset
    from palpate.study import read_study
    from palpate.surrogates import Surrogate

    study, body = read_study(study_file), Surrogate.load(model)
    sweep = study.sweep
    assert sweep is not None
    if getattr(sweep, "element", None) is None:
        return {}
    finer = study.model_copy(update={"sweep": sweep.model_copy(update={"element": FINER * sweep.element})})
    problem, unseen = finer.problem(), Dataset.open(study_file.with_name(f"{study.name}-random.zarr"))
    X, F = np.asarray(unseen.X), np.linalg.norm(np.asarray(unseen.force), axis=1)
    strong = np.argsort(F)[-3 * count :: 3]
    errors = []
    for x in X[strong]:
        solved = np.asarray(problem.solve(x, fields=False).response)
        learnt = body.energy.force(x[None])[0]
        errors.append(float(np.linalg.norm(learnt - solved) / np.linalg.norm(solved)))
    return {"median": float(np.median(errors)), "largest": max(errors), "solves": len(errors)}


def main() -> None:
    """Run the parts that are named, or all, and write their figures after each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", default=list(PARTS))
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--until", default="2%")
    parser.add_argument("--refined", type=int, default=0)
    parser.add_argument("--folder", type=Path, default=Path("parts"))
    parser.add_argument("--out", type=Path, default=Path("ten_parts.json"))
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for name in given.parts:
        row = touch(name, given.folder, given.until, given.minutes)
        if given.refined and "model" in row:
            model = Path(row["model"])
            row["refined"] = mesh_error(model, model.with_suffix(".toml"), given.refined)
        rows.append(row)
        given.out.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        last = row.get("steps") or [{}]
        print(row["part"], f"{row['seconds']:.0f} s", last[-1], row.get("reason", row.get("error", "")))


if __name__ == "__main__":
    main()
