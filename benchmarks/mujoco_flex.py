"""How deep a ball rests on MuJoCo's own flex, in a sweep of its settings, and on the same block learnt by palpate.

    python -m benchmarks.mujoco_flex [--quick] [--record]

The depth is held against that of finite elements. Time is that of the processor, for a step and over that of the scene,
in the same run.
"""

from __future__ import annotations

import math
import sys

from benchmarks.mujoco_scenes import FlexSetting, palpate_rest, rest_on_flex
from benchmarks.rest_block import body, finite_element_depth
from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark

__all__ = ["SETTINGS", "tables"]

SETTINGS = (
    *(FlexSetting(f"grid {n}x{n}x{m}", step=s) for n, m in ((7, 4), (11, 6), (15, 8)) for s in (1e-3, 5e-3)),
    *(FlexSetting(f"graded {h} mm", step=s) for h in ("4", "2.5") for s in (1e-3, 5e-3)),
    FlexSetting("graded 1.7 mm", step=5e-3),
    FlexSetting("graded 2.5 mm", step=1e-2),
    FlexSetting("graded 2.5 mm", step=5e-3, solver="Newton"),
    FlexSetting("graded 2.5 mm", step=5e-3, passive=True),
    FlexSetting("graded 2.5 mm", step=5e-3, damping=0.1),
    FlexSetting("grid 7x7x4", integrator="Euler", step=1e-4),
    FlexSetting("graded 4 mm", integrator="Euler", step=5e-5),
)
_OWN = (5e-4, 1e-3, 5e-3)  # s, steps of the learnt body's scene
_BOUND = 0.5  # % of the depth


def tables(*, quick: bool) -> list[Table]:
    """Return the table of depths and times."""
    depth, rows, claims = finite_element_depth(), [], []
    touch = body()
    for step in _OWN[:1] if quick else _OWN:
        rest = palpate_rest(touch, step)
        error = 100.0 * (rest.depth / depth - 1.0)
        rows.append(_row(f"palpate, {1e3 * step:g} ms", 0, rest.depth, error, rest.step_seconds, rest.slower))
        claims.append(
            Claim(f"palpate, {1e3 * step:g} ms: rest depth off by, %", (abs(error),), _BOUND, ".2f")
        )
    for setting in SETTINGS[:1] if quick else SETTINGS:
        rest, count = rest_on_flex(setting)
        print(setting, rest, file=sys.stderr, flush=True)
        error = 100.0 * (rest.depth / depth - 1.0)
        rows.append(_row(f"flex, {setting}", count, rest.depth, error, rest.step_seconds, rest.slower))
    best = min((abs(r["error"]) for r in rows[len(claims) :] if math.isfinite(r["error"])), default=math.nan)
    columns = (
        Column("what", "body"),
        Column("count", "vertices"),
        Column("depth", "rest depth, mm", ".3f"),
        Column("error", "error, %", "+.2f"),
        Column("step", "ms a step", ".3f"),
        Column("slower", "time over the scene's", ".3f"),
    )
    notes = (
        f"finite elements: {1e3 * depth:.3f} mm, by palpate's own solver with a rigid ball",
        f"the best setting of flex is off by {best:.1f} %; a dash: the ball did not come to rest, or the scene blew up",
        "flex moves, has inertia and is touched by anything; a learnt body is fixed and quasi-static, and touched by "
        "the tool that was learnt",
    )
    return [
        Table(
            "mujoco_flex",
            f"A ball on a soft block in MuJoCo{quick_mark(quick)}",
            columns,
            rows,
            [] if quick else claims,
            notes,
        )
    ]


def _row(
    what: str, count: int, depth: float, error: float, step: float, slower: float
) -> dict[str, float | str | None]:
    size = count or None
    return {
        "what": what, "count": size, "depth": 1e3 * depth, "error": error, "step": 1e3 * step, "slower": slower,
    }  # fmt: skip


if __name__ == "__main__":
    sys.exit(main(only="mujoco_flex"))
