"""Balls that come to rest on a learnt block in Newton: how deep, and what a batch of forces costs a step.

    python -m benchmarks.newton_balls [--quick] [--record]

Newton and torch must be installed; Newton compiles its kernels at the first run, for minutes. Times are those of
processors, with and without the learnt forces in the same run.
"""

from __future__ import annotations

import math
import sys
import time
from typing import Any

import numpy as np

from benchmarks.rest_block import HEIGHT, MASS, RADIUS, SIDE, body, finite_element_depth
from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark

__all__ = ["tables"]

_STEP, _DAMPER = 5e-4, 1.0  # s, N s/m
_TOP = HEIGHT + RADIUS
_BOUND = 0.5  # % of the depth


def _model(count: int) -> Any:
    import newton
    import warp as wp

    builder = newton.ModelBuilder()
    density = MASS / (4 / 3 * math.pi * RADIUS**3)
    for _ in range(count):
        ball = builder.add_body(xform=wp.transform((SIDE / 2, SIDE / 2, _TOP), wp.quat_identity()))
        builder.add_shape_sphere(ball, radius=RADIUS, cfg=newton.ModelBuilder.ShapeConfig(density=density))
    return builder.finalize()


def _settled(count: int, steps: int, *, touched: bool) -> tuple[float, float]:
    """Return the mean depth of the balls, m, and the time of a step, s."""
    import newton
    import warp as wp

    from palpate.adapters.torch import TorchBody

    touch, model = TorchBody(body()), _model(count)
    solver, (now, after) = newton.solvers.SolverSemiImplicit(model), (model.state(), model.state())
    times = []
    for _ in range(steps):
        start = time.process_time()
        now.clear_forces()
        if touched:
            force = touch.force(wp.to_torch(now.body_q)[:, :3].double())
            wrench = wp.to_torch(now.body_f)
            wrench[:, :3] += force.float() - _DAMPER * wp.to_torch(now.body_qd)[:, :3]
        solver.step(now, after, None, None, _STEP)
        now, after = after, now
        times.append(time.process_time() - start)
    return _TOP - float(wp.to_torch(now.body_q)[:, 2].double().mean()), float(np.median(times))


def tables(*, quick: bool) -> list[Table]:
    """Return the table of depths and times; an empty one where Newton is not installed."""
    try:
        import newton  # noqa: F401
    except ImportError:
        print("Newton is not installed: left out", file=sys.stderr)
        return []
    depth, rows, claims = finite_element_depth(), [], []
    for count in (1,) if quick else (1, 64, 1024):
        steps = 20 if quick else 2_000 if count < 1024 else 1_000
        found, own = _settled(count, steps, touched=True)
        _, free = _settled(count, min(steps, 200), touched=False)
        error = 100.0 * (found / depth - 1.0)
        rows.append(
            {"count": count, "depth": 1e3 * found, "error": error, "with": 1e3 * own, "free": 1e3 * free}
        )
        claims.append(Claim(f"{count} balls: rest depth off by, %", (abs(error),), _BOUND, ".2f"))
    columns = (
        Column("count", "balls"),
        Column("depth", "rest depth, mm", ".3f"),
        Column("error", "error, %", "+.2f"),
        Column("with", "ms a step", ".2f"),
        Column("free", "without the body", ".2f"),
    )
    notes = (
        f"finite elements: {1e3 * depth:.3f} mm; Newton's places are of single precision",
        "all balls stand for scenes of their own: none feels the others",
    )
    title = f"Balls on a learnt block in Newton, on the processor{quick_mark(quick)}"
    return [Table("newton_balls", title, columns, rows, [] if quick else claims, notes)]


if __name__ == "__main__":
    sys.exit(main(only="newton_balls"))
