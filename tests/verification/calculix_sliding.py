"""A rigid tool that is pressed into half a block and then slides along x, with friction, in CalculiX.

The block's hexahedra of second order with reduced integration (C3D20R) are `fine` wide under the tool; y = 0 is a plane
of symmetry. The tool is a sheet of hexahedra all of whose nodes move together; their reactions are the force. Units
are mm, mN and kPa, see `calculix`.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
from calculix_ball import CORNERS, KILO, MIDDLES, MILLI, PENALTY, graded

STICK = 1.0  # slope of the tangential penalty over that of the normal one
THICK = 1.0  # mm, of the tool's sheet


def deck(
    law: str,
    young: float,
    size: tuple[float, float],
    lowest: Callable[[np.ndarray, np.ndarray], np.ndarray],
    reach: float,
    fine: float,
    motion: list[tuple[float, float]],
    friction: float,
) -> str:
    """Input for CalculiX.

    A block of a width and height in m; the tool's height in mm above its foremost point over x and y in mm, out to a
    `reach` in m; (slip, depth) in m at the end of each step.
    """
    width, height, far = size[0] / 2 / MILLI, size[1] / MILLI, reach / MILLI
    half, down = graded(width, far, fine / MILLI), graded(height, far, fine / MILLI)
    along = np.concatenate([-half[:0:-1], half])
    lines = [*_block(along, half, down), *_sheet(lowest, far, fine / MILLI)]
    lines += ["*MATERIAL, NAME=LAW", law, "*SOLID SECTION, ELSET=BODY, MATERIAL=LAW"]
    lines += ["*MATERIAL, NAME=HARD", "*ELASTIC", "1e6, 0.3", "*SOLID SECTION, ELSET=TOOL, MATERIAL=HARD"]
    stiff = PENALTY * young / KILO / far
    lines += [
        "*SURFACE INTERACTION, NAME=TOUCH",
        "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
        f"{stiff!r}",
    ]
    lines += ["*FRICTION", f"{friction!r}, {STICK * stiff!r}"] if friction else []
    lines += ["*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE", "TOP, SHEET"]
    lines += ["*BOUNDARY", "BOTTOM, 1, 3", "YSIDE, 2, 2", "TOOLNODES, 2, 2"]
    for slip, depth in motion:
        lines += [
            *("*STEP, NLGEOM, INC=400", "*STATIC", "0.5, 1., 1e-4, 0.5", "*BOUNDARY"),
            *(f"TOOLNODES, 1, 1, {slip / MILLI!r}", f"TOOLNODES, 3, 3, {-depth / MILLI!r}"),
            *("*NODE PRINT, NSET=TOOLNODES, TOTALS=ONLY, FREQUENCY=1000", "RF", "*END STEP"),
        ]
    return "\n".join(lines) + "\n"


def forces(text: str) -> np.ndarray:
    """Force (N, 3) on the body by the whole tool in N at the end of each step: twice that on the half, y apart."""
    rows = text.splitlines()
    totals = [rows[i + 2] for i, row in enumerate(rows) if row.lstrip().startswith("total force")]
    return 2 * MILLI * np.array([[float(word) for word in row.split()[-3:]] for row in totals]) * [1, 0, 1]


def _block(along: np.ndarray, across: np.ndarray, down: np.ndarray) -> list[str]:
    """Nodes, elements and sets; the tool stands over x = y = 0 and the top is z = 0."""
    x, y, z = (
        np.sort(np.concatenate([ends, (ends[1:] + ends[:-1]) / 2])).tolist() for ends in (along, across, down)
    )
    number: dict[tuple[int, int, int], int] = {}
    elements, counts = [], (len(along) - 1, len(across) - 1, len(down) - 1)
    for i, j, k in np.ndindex(*counts):
        # k counts downwards, so an element's lower side comes first
        own = [(2 * i + a, 2 * j + b, 2 * k + 2 - c) for a, b, c in CORNERS + MIDDLES]
        elements.append([number.setdefault(node, len(number) + 1) for node in own])
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{n}, {x[i]!r}, {y[j]!r}, {-z[k]!r}" for (i, j, k), n in number.items()]
    lines += ["*ELEMENT, TYPE=C3D20R, ELSET=BODY"]
    for n, row in enumerate(elements, 1):
        lines += [", ".join(map(str, [n, *row[:10]])) + ",", ", ".join(map(str, row[10:]))]
    for name, axis, value in (("BOTTOM", 2, 2 * counts[2]), ("YSIDE", 1, 0)):
        lines += [f"*NSET, NSET={name}", *(f"{n}," for node, n in number.items() if node[axis] == value)]
    top = [n for n, index in enumerate(np.ndindex(*counts), 1) if index[2] == 0]
    return [*lines, "*SURFACE, NAME=TOP", *(f"{n}, S2" for n in top)]


def _sheet(lowest: Callable[[np.ndarray, np.ndarray], np.ndarray], far: float, fine: float) -> list[str]:
    """The tool's lower side as a layer of hexahedra (C3D8), half as wide as the block's elements."""
    count = round(2 * far / fine)
    x, y = np.linspace(-far, far, 2 * count + 1), np.linspace(-far / count, far, count + 2)
    first, lines, faces = 1_000_000, ["*NODE, NSET=TOOLNODES"], []
    for layer, (i, j) in itertools.product((0, 1), np.ndindex(len(x), len(y))):
        place = [x[i], y[j], float(lowest(x[i], y[j])) + THICK * layer]
        number = first + layer * len(x) * len(y) + i * len(y) + j
        lines.append(", ".join(map(repr, [number, *map(float, place)])))
    lines.append("*ELEMENT, TYPE=C3D8, ELSET=TOOL")
    for i, j in np.ndindex(len(x) - 1, len(y) - 1):
        n = first + i * len(y) + j
        square = [n, n + len(y), n + len(y) + 1, n + 1]
        lines.append(", ".join(map(str, [n, *square, *(m + len(x) * len(y) for m in square)])))
        faces.append(f"{n}, S1")
    return [*lines, "*SURFACE, NAME=SHEET", *faces]
