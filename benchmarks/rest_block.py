"""A block of soft tissue that was learnt from fourteen finite-element solves, and how deep a ball rests on it.

    python -m benchmarks.rest_block       solves and learns again, ten minutes: benchmarks/data/rest_block.palpate

The block: 100 × 100 × 50 mm, neo-Hookean, 9 kPa and Poisson's ratio 0.45, held at its bottom. A rigid ball of 10 mm
radius presses it near the middle of its top.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import palpate as pp

__all__ = ["HEIGHT", "MASS", "POISSON", "RADIUS", "SIDE", "WEIGHT", "YOUNG", "body", "finite_element_depth"]

SIDE, HEIGHT, RADIUS = 0.1, 0.05, 0.01  # m
YOUNG, POISSON = 9e3, 0.45  # Pa, 1
MASS = 0.03  # kg, of the ball
WEIGHT = MASS * 9.81  # N
_SOLVES = 14
_DATA = Path(__file__).parent / "data"


def _problem() -> Any:
    block = pp.shapes.Block(size=(SIDE, SIDE, HEIGHT))
    tissue = pp.Body(block, pp.materials.NeoHookean(young=YOUNG, poisson=POISSON), fixed="bottom")
    over = ((0.047, 0.047), (0.053, 0.053))
    ball = pp.SphereProbe(radius=RADIUS, touches="top", depth=(0.0, 0.005), over=over, pad="rigid")
    return tissue.problem(ball)


def body() -> pp.Surrogate:
    """Return the learnt block, a corner of its bottom being the origin of its frame."""
    return pp.Surrogate.load(_DATA / "rest_block.palpate")


def finite_element_depth() -> float:
    """Return the depth, m, at which the solved force bears the ball."""
    return float(json.loads((_DATA / "rest_block.json").read_text("utf-8"))["depth"])


def _rest(problem: Any, depth: float) -> float:
    """Return the depth at which the finite elements bear the ball, by Newton's method."""
    for _ in range(3):
        there = problem.solve([SIDE / 2, SIDE / 2, HEIGHT + RADIUS - depth])
        depth += (WEIGHT - there.force[2]) / -there.response_gradient[2, 2]
    return depth


def main() -> None:
    """Solve, learn and store."""
    problem = _problem()
    with tempfile.TemporaryDirectory() as folder:
        data = pp.sweep(problem, samples=_SOLVES, seed=0, path=Path(folder) / "rest.zarr")
        touch, _ = pp.learn(data, effort=0.2)
    pp.Surrogate(touch.energy, meta={"name": "rest block"}).save(_DATA / "rest_block.palpate")
    depth = {"depth": _rest(problem, 0.0032), "unit": "m", "solves": _SOLVES}
    (_DATA / "rest_block.json").write_text(json.dumps(depth, indent=2) + "\n", "utf-8")


if __name__ == "__main__":
    sys.exit(main())
