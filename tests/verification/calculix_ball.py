"""A rigid ball in hard, frictionless contact with a quarter of a block, in CalculiX.

The block's hexahedra of second order with reduced integration (C3D20R) are `fine` wide under the ball and grow away
from it. The ball is a cap of hexahedra all of whose nodes go down together; their reactions are the force. Units are
mm, mN and kPa, see `calculix`.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

KILO, MILLI = 1e3, 1e-3
REACH = 0.8  # of the fine part and of the cap, over the ball's radius
GROWTH = 1.5  # of an element over the one before, outside the fine part
FACET = 0.04  # width of the cap's facets over the ball's radius: 0.02 % of it inside the ball at most
PENALTY = 300.0  # stiffness of the penalty over E/R: it takes 0.9 % of the force at a tenth of the radius
THICK = 0.1  # of the cap over the ball's radius
# corners of an element in CalculiX's order, then the middles of its edges
CORNERS = ((0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2))
MIDDLES = (
    *((1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0)),
    *((1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)),
    *((0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)),
)


def graded(length: float, reach: float, fine: float) -> np.ndarray:
    """Ends of elements from 0 to a length, `fine` wide up to a reach and then larger and larger."""
    count = round(reach / fine)
    ends = list(np.linspace(0.0, reach, count + 1))
    size = reach / count
    while ends[-1] < length:
        size *= GROWTH
        ends.append(ends[-1] + size)
    tail = np.array(ends[count:])
    tail = reach + (tail - reach) * (length - reach) / (tail[-1] - reach)
    return np.concatenate([ends[:count], tail])


def deck(
    law: str, young: float, size: tuple[float, float], radius: float, depths: list[float], fine: float
) -> str:
    """Input for CalculiX: a block of a width and a height in m under a ball, its depths in m from shallow to deep."""
    width, height, ball = size[0] / 2 / MILLI, size[1] / MILLI, radius / MILLI
    across = graded(width, REACH * ball, fine / MILLI)
    down = graded(height, REACH * ball, fine / MILLI)
    lines = [*block(across, across, down), *cap(ball)]
    lines += contact(law, PENALTY * young / KILO / ball)
    lines += ["*BOUNDARY", "BOTTOM, 1, 3", "XSIDE, 1, 1", "YSIDE, 2, 2", "TOOLNODES, 1, 2"]
    return "\n".join([*lines, *steps(depths)]) + "\n"


def steps(depths: list[float]) -> list[str]:
    """Steps in which the ball goes to depths in m from shallow to deep."""
    lines = []
    for depth in depths:
        lines += [
            "*STEP, NLGEOM, INC=200",
            "*STATIC",
            "0.5, 1., 1e-3, 0.5",
            "*BOUNDARY",
            f"TOOLNODES, 3, 3, {-depth / MILLI!r}",
            "*NODE PRINT, NSET=TOOLNODES, TOTALS=ONLY, FREQUENCY=1000",
            "RF",
            "*END STEP",
        ]
    return lines


def forces(text: str) -> np.ndarray:
    """Force on the whole ball in N at the end of each step, from `body.dat`: four times that on the quarter."""
    rows = text.splitlines()
    totals = [rows[i + 2] for i, row in enumerate(rows) if row.lstrip().startswith("total force")]
    return -4 * MILLI * np.array([float(row.split()[-1]) for row in totals])


def contact(law: str, stiff: float, friction: tuple[float, float] | None = None) -> list[str]:
    """Materials of body and tool, and contact between them under a penalty in kPa/mm.

    `friction` has the coefficient and the stiffness of what sticks, in kPa/mm.
    """
    rubs = [] if friction is None else ["*FRICTION", ", ".join(map(repr, friction))]
    return [
        *("*MATERIAL, NAME=LAW", law, "*SOLID SECTION, ELSET=BODY, MATERIAL=LAW"),
        *("*MATERIAL, NAME=HARD", "*ELASTIC", "1e6, 0.3", "*SOLID SECTION, ELSET=TOOL, MATERIAL=HARD"),
        *(
            "*SURFACE INTERACTION, NAME=TOUCH",
            "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
            f"{stiff!r}",
            *rubs,
        ),
        *("*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE", "TOP, FRONT"),
    ]


def block(across: np.ndarray, along: np.ndarray, down: np.ndarray, *, linear: bool = False) -> list[str]:
    """Nodes, elements and sets from ends of elements along x, y and −z, from small to large; the top is z = 0.

    Elements are C3D20R, or C3D8 where they are linear.
    """
    places = CORNERS if linear else CORNERS + MIDDLES
    x, y, z = (
        np.sort(np.concatenate([ends, (ends[1:] + ends[:-1]) / 2])).tolist() for ends in (across, along, down)
    )
    number: dict[tuple[int, int, int], int] = {}
    elements = []
    counts = (len(across) - 1, len(along) - 1, len(down) - 1)
    for i, j, k in np.ndindex(*counts):
        # k counts downwards, so an element's lower side comes first
        own = [(2 * i + a, 2 * j + b, 2 * k + 2 - c) for a, b, c in places]
        elements.append([number.setdefault(node, len(number) + 1) for node in own])
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{n}, {x[i]!r}, {y[j]!r}, {-z[k]!r}" for (i, j, k), n in number.items()]
    lines += [f"*ELEMENT, TYPE={'C3D8' if linear else 'C3D20R'}, ELSET=BODY"]
    for n, row in enumerate(elements, 1):
        words = list(map(str, [n, *row]))
        lines += [", ".join(words)] if linear else [", ".join(words[:11]) + ",", ", ".join(words[11:])]
    last = 2 * counts[2]
    for name, axis, value in (("BOTTOM", 2, last), ("XSIDE", 0, 0), ("YSIDE", 1, 0)):
        lines += [f"*NSET, NSET={name}", *(f"{n}," for node, n in number.items() if node[axis] == value)]
    top = [n for n, index in enumerate(np.ndindex(*counts), 1) if index[2] == 0]
    return [*lines, "*SURFACE, NAME=TOP", *(f"{n}, S2" for n in top)]


def cap(ball: float, *, half: bool = False) -> list[str]:
    """The ball's lower cap as a layer of hexahedra (C3D8), its tip at z = 0: a quarter, x, y ≥ 0, or a half, y ≥ 0."""
    count = math.ceil(REACH / FACET)
    # of lines through the centre, in two planes
    across, slopes = (
        np.tan(np.arange(low, count + 1) * REACH / count) for low in (-count if half else -1, -1)
    )
    first, width = 1_000_000, len(slopes)  # numbers that the block's nodes and elements do not have
    layers = len(across) * width
    lines, faces = ["*NODE, NSET=TOOLNODES"], []
    for layer, (i, j) in itertools.product((0, 1), np.ndindex(len(across), width)):
        ray = np.array([across[i], slopes[j], -1.0])
        place = (1 - THICK * layer) * ball * ray / np.linalg.norm(ray) + [0.0, 0.0, ball]
        number = first + layer * layers + i * width + j
        lines.append(", ".join(map(repr, [number, *place.tolist()])))
    lines.append("*ELEMENT, TYPE=C3D8, ELSET=TOOL")
    for i, j in np.ndindex(len(across) - 1, width - 1):
        n = first + i * width + j
        square = [n, n + width, n + width + 1, n + 1]
        lines.append(", ".join(map(str, [n, *square, *(m + layers for m in square)])))
        faces.append(f"{n}, S1")
    return [*lines, "*SURFACE, NAME=FRONT", *faces]
