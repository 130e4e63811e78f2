"""Two rigid balls that pinch a block in hard, frictionless contact, in CalculiX: a quarter of it, by two mirror planes.

The first ball presses down at z = 0; the mirror plane between both balls is the quarter's lower end. The block is held
at its end of least x, and y = 0 halves it. Units are mm, mN and kPa, see `calculix`.
"""

from __future__ import annotations

import numpy as np
from calculix_ball import KILO, MILLI, PENALTY, REACH, block, cap, contact, graded


def deck(
    law: str, young: float, size: tuple[float, float, float], radius: float, depth: float, fine: float
) -> str:
    """Input for CalculiX: a block of a height, a width and a thickness in m under balls at half its height."""
    half, along, down = (side / 2 / MILLI for side in size)
    ball = radius / MILLI
    across = graded(half, REACH * ball, fine / MILLI)
    lines = block(
        np.concatenate([-across[:0:-1], across]),
        graded(along, REACH * ball, fine / MILLI),
        graded(down, REACH * ball, fine / MILLI),
    )
    lines += [*cap(ball, half=True), *contact(law, PENALTY * young / KILO / ball)]
    return "\n".join(
        [
            *lines,
            *("*BOUNDARY", "XSIDE, 1, 3", "YSIDE, 2, 2", "BOTTOM, 3, 3", "TOOLNODES, 1, 2"),
            *("*STEP, NLGEOM, INC=200", "*STATIC", "0.5, 1., 1e-3, 0.5"),
            *("*BOUNDARY", f"TOOLNODES, 3, 3, {-depth / MILLI!r}"),
            *("*NODE PRINT, NSET=TOOLNODES, TOTALS=ONLY, FREQUENCY=1000", "RF", "*END STEP", ""),
        ]
    )


def answer(text: str) -> tuple[float, float]:
    """Force in N with which a ball is pushed out, and that on both balls away from the block's fixed end."""
    rows = text.splitlines()
    total = next(rows[i + 2] for i, row in enumerate(rows) if row.lstrip().startswith("total force"))
    up, _, out = (-MILLI * float(word) for word in total.split()[-3:])
    return 2 * out, 4 * up
