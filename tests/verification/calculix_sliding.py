"""A rigid tool that is pressed into a slice of a block and then slides along x, with friction, in CalculiX.

The slice is in plane strain: one layer of hexahedra of second order with reduced integration (C3D20R), which are
`fine` wide under the tool. The tool is a strip of hexahedra all of whose nodes move together; their reactions are the
force. Units are mm, mN and kPa, see `calculix`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from calculix_ball import CORNERS, KILO, MIDDLES, MILLI, graded

PENALTY = 150.0  # stiffness of the normal penalty over E and the reach
STICK = 0.05  # slope of the tangential penalty over that of the normal one
THICK = 1.0  # mm, of slice and tool


def deck(
    law: str,
    young: float,
    size: tuple[float, float],
    profile: Callable[[np.ndarray], np.ndarray],
    reach: float,
    fine: float,
    motion: Sequence[tuple[float, float]],
    friction: float,
) -> str:
    """Input for CalculiX.

    A slice of a width and height in m; the tool's height in mm above its foremost line over x in mm, out to a `reach`
    in m; (slip, depth) in m at the end of each step; 0 for no friction.
    """
    far = reach / MILLI
    half = graded(size[0] / 2 / MILLI, far, fine / MILLI)
    lines = [*_slice(np.concatenate([-half[:0:-1], half]), graded(size[1] / MILLI, far, fine / MILLI))]
    lines += _strip(profile, far, fine / MILLI)
    lines += ["*MATERIAL, NAME=LAW", law, "*SOLID SECTION, ELSET=BODY, MATERIAL=LAW"]
    lines += ["*MATERIAL, NAME=HARD", "*ELASTIC", "1e6, 0.3", "*SOLID SECTION, ELSET=TOOL, MATERIAL=HARD"]
    stiff = PENALTY * young / KILO / far
    lines += ["*SURFACE INTERACTION, NAME=TOUCH"]
    lines += ["*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{stiff!r}"]
    lines += ["*FRICTION", f"{friction!r}, {STICK * stiff!r}"] if friction else []
    lines += ["*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE", "TOP, STRIP"]
    lines += ["*BOUNDARY", "BOTTOM, 1, 3", "ALL, 2, 2", "TOOLNODES, 2, 2"]
    for slip, depth in motion:
        lines += [
            *("*STEP, NLGEOM, INC=400", "*STATIC", "0.2, 1., 1e-4, 0.4", "*BOUNDARY"),
            *(f"TOOLNODES, 1, 1, {float(slip) / MILLI!r}", f"TOOLNODES, 3, 3, {-float(depth) / MILLI!r}"),
            *("*NODE PRINT, NSET=TOOLNODES, TOTALS=ONLY, FREQUENCY=1000", "RF", "*END STEP"),
        ]
    return "\n".join(lines) + "\n"


def forces(text: str) -> np.ndarray:
    """Force (N, 2) on the tool along x and z, in N per slice, at the end of each step."""
    rows = text.splitlines()
    totals = [rows[i + 2] for i, row in enumerate(rows) if row.lstrip().startswith("total force")]
    return -MILLI * np.array([[float(word) for word in row.split()[-3:]] for row in totals])[:, ::2]


def _slice(along: np.ndarray, down: np.ndarray) -> list[str]:
    """Nodes, elements and sets; the tool stands over x = 0 and the top is z = 0."""
    x, y, z = (
        np.sort(np.concatenate([ends, (ends[1:] + ends[:-1]) / 2])).tolist()
        for ends in (along, np.array([0.0, THICK]), down)
    )
    number: dict[tuple[int, int, int], int] = {}
    elements, counts = [], (len(along) - 1, 1, len(down) - 1)
    for i, j, k in np.ndindex(*counts):
        # k counts downwards, so an element's lower side comes first
        own = [(2 * i + a, 2 * j + b, 2 * k + 2 - c) for a, b, c in CORNERS + MIDDLES]
        elements.append([number.setdefault(node, len(number) + 1) for node in own])
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{n}, {x[i]!r}, {y[j]!r}, {-z[k]!r}" for (i, j, k), n in number.items()]
    lines += ["*ELEMENT, TYPE=C3D20R, ELSET=BODY"]
    for n, row in enumerate(elements, 1):
        lines += [", ".join(map(str, [n, *row[:10]])) + ",", ", ".join(map(str, row[10:]))]
    last = 2 * counts[2]
    lines += ["*NSET, NSET=BOTTOM", *(f"{n}," for node, n in number.items() if node[2] == last)]
    top = [n for n, index in enumerate(np.ndindex(*counts), 1) if index[2] == 0]
    return [*lines, "*SURFACE, NAME=TOP", *(f"{n}, S2" for n in top)]


def _strip(profile: Callable[[np.ndarray], np.ndarray], far: float, fine: float) -> list[str]:
    """The tool's lower side as a row of hexahedra (C3D8), a quarter as wide as the block's elements."""
    x = np.linspace(-far, far, 8 * round(far / fine) + 1)
    low, first = profile(x), 1_000_000  # numbers that the block's nodes and elements do not have
    lines, faces, n = ["*NODE, NSET=TOOLNODES"], [], len(x)
    for layer, side, i in np.ndindex(2, 2, n):
        place = [float(x[i]), THICK * (3 * side - 1), float(low[i]) + THICK * layer]
        lines.append(", ".join(map(repr, [first + (2 * layer + side) * n + i, *place])))
    lines.append("*ELEMENT, TYPE=C3D8, ELSET=TOOL")
    for i in range(n - 1):
        a = first + i
        square = [a, a + 1, a + n + 1, a + n]
        lines.append(", ".join(map(str, [a, *square, *(m + 2 * n for m in square)])))
        faces.append(f"{a}, S1")
    return [*lines, "*SURFACE, NAME=STRIP", *faces]
