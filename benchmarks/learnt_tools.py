"""Learnt bodies under tools: error of force and torque on solves of their own, and the time of a tick beside a ball's.

    python -m benchmarks.learnt_tools                     all cases, an hour or two on one core
    python -m benchmarks.learnt_tools --case dome-punch   one of them, some minutes
    python -m benchmarks.learnt_tools --folder solves     solves are kept in a folder, and taken from there
    python -m benchmarks.learnt_tools --record            the table of record and the documentation's block, too
    python -m benchmarks.learnt_tools --case dome-punch --record   the same, other cases as recorded before

Bodies are neo-Hookean, 9 kPa, ν 0.45: a block of 44 × 40 × 20 mm and a dome of radius 30 mm, 18 mm high. Pads have 6e6
N/m³, elements under a tool are 4 mm long, presses 0.5 to 4 mm deep. Solves to judge by are at places, depths and angles
of another seed.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

import palpate as pp
from benchmarks.records import Record, renew
from benchmarks.table import Claim, Column, Table
from palpate.dataset import Dataset

__all__ = ["CASES", "Case", "judge", "solves_of", "table"]

RADIUS = 0.006  # m, of all tools
DEPTHS = (0.0005, 0.004)  # m
TICKS = 4000
ANGLE_STEP = 1e-4  # rad, of the difference that gives a torque


def _block() -> pp.Body:
    block = pp.shapes.Block((0.044, 0.040, 0.02), element=0.015)
    return pp.Body(block, pp.materials.NeoHookean(young=9e3, poisson=0.45))


def _upright_block() -> pp.Body:
    block = pp.shapes.Block((0.030, 0.040, 0.030), element=0.015)
    return pp.Body(block, pp.materials.NeoHookean(young=9e3, poisson=0.45))


def _dome() -> pp.Body:
    dome = pp.shapes.Dome(radius=0.03, height=0.018, element=0.012)
    return pp.Body(dome, pp.materials.NeoHookean(young=9e3, poisson=0.45))


@dataclass(frozen=True)
class Case:
    """A body under a tool: what is solved, and what must be reached."""

    words: str
    body: Callable[[], pp.Body]
    shape: Callable[[], pp.tools.Tool | pp.Pinch]
    options: tuple[tuple[str, Any], ...] = ()
    solves: tuple[int, int] = (40, 20)  # to learn from, and to judge by
    depths: int = 4  # in a series to learn from
    bounds: tuple[float, float] = (0.01, 0.02)  # of the force's error: median, 95th percentile

    def problem(self) -> Any:
        """Return the problem."""
        shape = self.shape()
        if isinstance(shape, pp.Pinch):
            return self.body().problem(shape)
        tool = pp.SurfaceTool(shape, depth=DEPTHS, pad=6e6, element=0.004, **dict(self.options))
        return self.body().problem(tool)


OVER = (("over", ((0.018, 0.016), (0.026, 0.024))),)


def _sphere() -> pp.tools.Tool:
    return pp.tools.Sphere(RADIUS)


def _capsule() -> pp.tools.Tool:
    return pp.tools.Capsule(RADIUS, 0.020)


def _punch() -> pp.tools.Tool:
    return pp.tools.Punch(RADIUS, 0.002)


def _two_capsules() -> pp.Pinch:
    return pp.Pinch(
        pp.tools.Capsule(RADIUS, 0.018),
        touches="x_min + x_max",
        depth=DEPTHS,
        pad=6e6,
        element=0.004,
        over=((0.015, 0.012), (0.025, 0.020)),
    )


def _file_sphere() -> pp.tools.Tool:
    """Return the sphere as a file of its triangles has it."""
    return _read(trimesh.creation.icosphere(subdivisions=3, radius=1e3 * RADIUS), "ball")


def _file_fingertip() -> pp.tools.Tool:
    """Return a finger of 16 × 14 × 24 mm that points down: flatter at the nail, a little lumpy."""
    finger = trimesh.creation.icosphere(subdivisions=4)
    x, y, z = finger.vertices.T
    wide = 7 * y * np.where(y > 0, 0.8, 1.0) + 0.15 * np.sin(3 * x)
    finger.vertices = np.stack([8 * x * (1 - 0.06 * z), wide, 12 * z], axis=1)
    return _read(finger, "finger")


def _read(surface: trimesh.Trimesh, name: str) -> pp.tools.Tool:
    """Return the tool of a surface in mm, by way of its STL."""
    with tempfile.TemporaryDirectory() as folder:
        surface.export(path := Path(folder) / f"{name}.stl")
        return pp.read_tool(path, unit="mm")


CASES = {
    "block-sphere": Case("sphere on a block", _block, _sphere, OVER),
    "block-capsule": Case("capsule on a block", _block, _capsule, OVER),
    "block-punch": Case("punch on a block", _block, _punch, OVER),
    "block-file-sphere": Case("sphere of an STL on a block", _block, _file_sphere, OVER),
    "block-file-fingertip": Case("fingertip of a scan on a block", _block, _file_fingertip, OVER),
    "dome-sphere": Case("sphere on a dome", _dome, _sphere),
    "dome-capsule": Case("capsule on a dome", _dome, _capsule),
    "dome-punch": Case("punch on a dome", _dome, _punch),
    "block-capsule-axis": Case(
        "capsule on a block, its axis an input, to 20°",
        _block,
        _capsule,
        (*OVER, ("turns", "axis"), ("tilt", math.radians(20))),
        solves=(120, 40),
        depths=3,
        bounds=(math.inf, 0.035),
    ),
    "block-pinch": Case(
        "two capsules pinch a block of 30 × 40 × 30 mm",
        _upright_block,
        _two_capsules,
        solves=(60, 20),
        bounds=(0.01, 0.035),
    ),
}


def solves_of(name: str, folder: Path) -> tuple[Dataset, Dataset]:
    """Return the solves of a case to learn from and to judge by, from a folder or made anew and kept there."""
    case, paths = CASES[name], [folder / f"{name}-{part}" for part in ("train", "test")]
    problem = case.problem()
    learnt, judged = case.solves
    every = problem.design(4 * judged, 9, depths=4)
    some = np.random.default_rng(7).permutation(4 * judged)[:judged]
    designs = problem.design(learnt, 1, depths=case.depths), every[some]
    found = [
        Dataset.open(path) if path.exists() else pp.sweep(problem, points=points, workers=1, path=path)
        for path, points in zip(paths, designs, strict=True)
    ]
    return found[0], found[1]


def judge(name: str, train: Dataset, test: Dataset, effort: float) -> dict[str, Any]:
    """Return a row of the table: what a body learnt from some solves misses of others."""
    test = test.ok
    body = pp.learn(train, effort=effort, shape=False, workers=1)[0]
    energy, force, pinched = body.hand_energy, test.response[:, :3], isinstance(CASES[name].shape(), pp.Pinch)
    felt = energy.force(test.X)
    if pinched:  # of balanced jaws the force on both is nothing: the effort counts beside it
        force, felt = test.response, np.column_stack([felt, body.effort(test.X)])
    size = np.linalg.norm(force, axis=1)
    error = np.linalg.norm(felt - force, axis=1) / size
    row = {
        "case": CASES[name].words,
        "solves": len(train.ok),
        "judged": len(test),
        "median": 100 * float(np.median(error)),
        "p95": 100 * float(np.quantile(error, 0.95)),
        "worst": 100 * float(error.max()),
        "tick": _tick(energy, test.X),
    }
    angles = 0 if pinched else test.X.shape[1] - 3
    if angles:
        steps = ANGLE_STEP * np.eye(test.X.shape[1])[3:]
        up, down = (np.array([energy.energy(test.X + sign * s) for s in steps]).T for sign in (1, -1))
        off = np.linalg.norm(-(up - down) / (2 * ANGLE_STEP) - test.response[:, 3:], axis=1)
        row["torque"] = 100 * float(np.quantile(off / (size * RADIUS), 0.95))
    elif "torque" in test and body.torque_evaluator is not None:
        off = np.linalg.norm(body.torque(test.X) - test["torque"], axis=1)
        row["torque"] = 100 * float(np.quantile(off / (size * RADIUS), 0.95))
    return row


def _tick(energy: Any, X: np.ndarray) -> float:
    """Return the 99th percentile in µs of an answer at places (N, n), of the quieter half of the time."""
    evaluator, spent = energy.evaluator(), []
    rows = [(x[:3].copy(), x[3:].copy()) for x in X]
    for k in range(TICKS):
        position, parameters = rows[k % len(rows)]
        began = time.perf_counter()
        evaluator(position, parameters)
        spent.append(1e6 * (time.perf_counter() - began))
    parts = np.array(spent).reshape(20, -1)
    return float(np.quantile(parts[np.argsort(parts.mean(axis=1))[:10]], 0.99))


def table(rows: dict[str, dict[str, Any]]) -> Table:
    """Return the table of the rows of some cases."""
    claims = []
    for name, row in rows.items():
        for key, what, bound in zip(
            ("median", "p95"), ("median", "95th percentile"), CASES[name].bounds, strict=True
        ):
            if math.isfinite(bound):
                words = f"{row['case']}: force, {what}, % off"
                claims.append(Claim(words, (row[key],), 100 * bound, ".2g"))
        claims.append(Claim(f"{row['case']}: an answer, 99th percentile, µs", (row["tick"],), 60.0, ".2g"))
    return Table(
        "learnt_tools",
        "Learnt bodies under tools, judged by solves at places of their own",
        [
            Column("case", "case"),
            Column("solves", "solves", "d"),
            Column("judged", "judged by", "d"),
            Column("median", "force off, %: median", ".2f"),
            Column("p95", "95th percentile", ".2f"),
            Column("worst", "worst", ".2f"),
            Column("torque", "torque off, % of ‖F‖ R, 95th percentile", ".2f"),
            Column("tick", "an answer, µs, 99th percentile", ".0f"),
        ],
        list(rows.values()),
        claims,
    )


def _with_others(measured: Record) -> Record:
    """Return a record with the rows and claims that the one on disk has of present cases not measured now."""
    old, words = Record.read("learnt_tools"), [case.words for case in CASES.values()]
    others = set(words) - {row[0] for row in measured.rows}
    rows = [*measured.rows, *(row for row in old.rows if row[0] in others)]
    kept = [claim for claim in old.claims if any(f": {name}: " in claim for name in others)]
    rows.sort(key=lambda row: words.index(row[0]))
    return replace(measured, rows=tuple(rows), claims=(*measured.claims, *kept))


def main(arguments: list[str]) -> int:
    """Measure the cases that are asked for, and print their table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--case", choices=CASES, action="append")
    parser.add_argument("--folder", type=Path, help="where solves are kept")
    parser.add_argument("--effort", type=float, default=0.1, help="of the learning")
    parser.add_argument("--record", action="store_true")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as passing:
        folder = options.folder or Path(passing)
        rows = {}
        for name in options.case or CASES:
            rows[name] = judge(name, *solves_of(name, folder), options.effort)
            print(rows[name], file=sys.stderr, flush=True)
    found = Record.of(table(rows))
    print(found.markdown())
    if options.record:
        _with_others(found).write("learnt_tools")
        renew()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
