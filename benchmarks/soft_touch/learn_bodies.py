"""Solve the bodies of soft-touch with palpate, and learn them from few and from more of the solves.

    python -m benchmarks.soft_touch.learn_bodies [--case NAME ...] [--solves 40]

Writes `learnt/NAME-COUNT.palpate`, and the places and forces of the same solves in `learnt/NAME-COUNT.csv`, for all and
for half of the solves. Places are palpate's own design over the pressed region; none is a place of the test.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

import palpate as pp
from benchmarks.soft_touch.bodies import BODIES, problem
from benchmarks.soft_touch.methods.palpate_surrogate import LEARNT

__all__ = ["learn", "main"]

SOLVES = 40
ELEMENT = 0.005  # m, under the ball: half its radius, which is palpate's own choice
EFFORT = 0.3  # of palpate's search for the energy


def learn(name: str, solves: int, keep: Path) -> None:
    """Solve a body, and learn it from all and from half of the solves; an interrupted sweep goes on from `keep`."""
    data = pp.sweep(
        problem(name, element=ELEMENT), samples=solves, seed=0, path=keep / f"{name}-{solves}.zarr"
    )
    order = np.random.default_rng(0).permutation(solves)
    LEARNT.mkdir(exist_ok=True)
    for count in (solves // 2, solves):
        left_out = sorted(order[count:].tolist())
        touch, _ = pp.learn(data, effort=EFFORT, shape=False, leave_out=left_out)
        energy = pp.Surrogate(touch.energy, meta={"name": f"soft-touch {name}"})
        energy.save(LEARNT / f"{name}-{count}.palpate")
        rows = [row for row in np.flatnonzero(data.converged) if row not in left_out]
        table = np.hstack([data.X[rows], data.force[rows]])
        head = "x,y,z,fx,fy,fz"
        np.savetxt(LEARNT / f"{name}-{count}.csv", table, "%.7g", ",", header=head, comments="")


def main(arguments: list[str] | None = None) -> int:
    """Learn bodies that are not learnt yet."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.soft_touch.learn_bodies")
    parser.add_argument("--case", nargs="+", choices=list(BODIES), default=list(BODIES))
    parser.add_argument("--solves", type=int, default=SOLVES)
    parser.add_argument("--keep", type=Path, help="folder for the solves. Default: one that is removed")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as scratch:
        for name in options.case:
            if not (LEARNT / f"{name}-{options.solves}.palpate").exists():
                learn(name, options.solves, options.keep or Path(scratch))
                print(f"{name}: learnt from {options.solves} solves", file=sys.stderr, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
