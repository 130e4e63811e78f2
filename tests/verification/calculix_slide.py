"""A rigid ball that is pressed into half a block and then slid, with friction, in CalculiX.

The slide is along x, so y = 0 halves ball and block. Elements are linear hexahedra (C3D8) `fine` wide under the ball:
with friction the matrix is not symmetric, and second order takes hours. Units are mm, mN and kPa, see `calculix`.
"""

from __future__ import annotations

import numpy as np
from calculix_ball import KILO, MILLI, block, cap, contact, graded

REACH, DEEP = 0.8, 0.8  # of the fine part over the ball's radius, along the surface and down
PENALTY = 100.0  # stiffness of the penalty over E/R: larger ones do not converge once the contact slips
# stiffness of what sticks over that of the penalty: it takes 13 % of the first sideways stiffness; 0.5 stalls
STICK = 0.1
INCREMENT = 0.1  # mm of slide


def deck(
    law: str,
    young: float,
    size: tuple[float, float],
    radius: float,
    depth: float,
    slides,
    mu: float,
    fine: float,
) -> str:
    """Input for CalculiX: a block of a width and a height in m, the ball's depth, and its slides, ascending, in m."""
    ball = radius / MILLI
    half = graded(size[0] / 2 / MILLI, REACH * ball, fine / MILLI)
    down = graded(size[1] / MILLI, DEEP * ball, fine / MILLI)
    stiff = PENALTY * young / KILO / ball
    lines = block(np.concatenate([-half[:0:-1], half]), half, down, linear=True)
    lines += [*cap(ball, half=True), *contact(law, stiff, (mu, STICK * stiff))]
    lines += ["*BOUNDARY", "BOTTOM, 1, 3", "YSIDE, 2, 2", "TOOLNODES, 1, 2"]
    before = 0.0
    for slide in (0.0, *slides):
        part = min(INCREMENT / max((slide - before) / MILLI, 1e-9), 1 / 3 if slide == 0 else 1.0)
        lines += ["*STEP, NLGEOM, INC=500", "*STATIC", f"{part!r}, 1., 1e-4, {part!r}", "*BOUNDARY"]
        lines += [f"TOOLNODES, 1, 1, {slide / MILLI!r}", f"TOOLNODES, 3, 3, {-depth / MILLI!r}"]
        lines += ["*NODE PRINT, NSET=TOOLNODES, TOTALS=ONLY, FREQUENCY=1000", "RF", "*END STEP"]
        before = slide
    return "\n".join(lines) + "\n"


def forces(text: str) -> np.ndarray:
    """Forces (n, 3) in N on the whole ball at the end of each slide from `body.dat`, the first before any."""
    rows = text.splitlines()
    totals = [rows[i + 2] for i, row in enumerate(rows) if row.lstrip().startswith("total force")]
    return -2 * MILLI * np.array([row.split() for row in totals], dtype=float) * [1.0, 0.0, 1.0]
