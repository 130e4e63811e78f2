"""A rigid tilted punch in hard, frictionless contact with half a block, in CalculiX.

The punch is turned about y, so y = 0 halves punch and block. The block's hexahedra of second order with reduced
integration (C3D20R) are `fine` wide under the punch and grow away from it. The punch is a shell of hexahedra and wedges
all of whose nodes go down together; their reactions are force and torque. Units are mm, mN and kPa, see `calculix`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from calculix_ball import KILO, MILLI, block, contact, graded

REACH = 1.3  # of the fine part over the punch's radius
DEEP = 0.8  # the same downwards
SECTORS, ARC = (
    32,
    10,
)  # facets around half the punch and along its edge: 0.12 % of either radius inside it at most
FLAT = 5  # rings of facets on its face
STEEP = math.radians(80)  # as far as the rounded edge is there
THICK = 0.1  # of the shell, over the distance from a point on the axis
FIRST = 1_000_000  # of the numbers of nodes and elements that the block does not have
PENALTY = (
    300.0  # stiffness of the penalty over E/a: by the mean pressure of Boussinesq it takes 0.3 % of the depth
)


@dataclass(frozen=True)
class Tilted:
    """A punch with radius and edge in m, turned about y by an angle in rad and pressed to a depth in m.

    The depth is that of its deepest point; the middle of its face stays at x = y = 0.
    """

    radius: float
    edge: float
    angle: float
    depth: float

    @property
    def height(self) -> float:
        """Height in m of the middle of its face over its deepest point."""
        flat = self.radius - self.edge
        return flat * math.sin(self.angle) + self.edge * (1 - math.cos(self.angle))

    def shell(self) -> np.ndarray:
        """Nodes (2, rings, sectors, 3) in mm of the outer and the inner layer, the deepest point at z = 0."""
        flat = self.radius - self.edge
        slopes = np.linspace(0.0, STEEP, ARC + 1)
        r = np.concatenate([np.linspace(0.0, flat, FLAT, endpoint=False), flat + self.edge * np.sin(slopes)])
        z = np.concatenate([np.zeros(FLAT), self.edge * (1 - np.cos(slopes))])
        around = (
            np.pi * np.arange(-1, SECTORS + 2) / SECTORS
        )  # a sector beyond the plane of symmetry on both sides
        out = np.stack(
            [r[:, None] * np.cos(around), r[:, None] * np.sin(around), np.repeat(z[:, None], around.size, 1)],
            -1,
        )
        middle = np.array([0.0, 0.0, self.radius])
        layers = np.stack([out, middle + (1 - THICK) * (out - middle)])
        c, s = math.cos(self.angle), math.sin(self.angle)
        turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        return (layers @ turn.T + [0.0, 0.0, self.height]) / MILLI


def deck(law: str, young: float, size: tuple[float, float, float], punch: Tilted, fine: float) -> str:
    """Input for CalculiX: a block of sizes in m under a punch, with elements of a size in m under it."""
    half, along, down = size[0] / 2 / MILLI, size[1] / 2 / MILLI, size[2] / MILLI
    radius = punch.radius / MILLI
    across = graded(half, REACH * radius, fine / MILLI)
    across = np.concatenate([-across[:0:-1], across])
    lines = block(
        across, graded(along, REACH * radius, fine / MILLI), graded(down, DEEP * radius, fine / MILLI)
    )
    lines += _shell(punch)
    lines += contact(law, PENALTY * young / KILO / radius)
    return "\n".join(
        [
            *lines,
            *("*BOUNDARY", "BOTTOM, 1, 3", "YSIDE, 2, 2", "TOOLNODES, 1, 2"),
            *("*STEP, NLGEOM, INC=200", "*STATIC", "0.25, 1., 1e-3, 0.25"),
            *("*BOUNDARY", f"TOOLNODES, 3, 3, {-punch.depth / MILLI!r}"),
            *("*NODE PRINT, NSET=TOOLNODES, FREQUENCY=1000", "RF", "*END STEP", ""),
        ]
    )


def answer(text: str, punch: Tilted) -> tuple[np.ndarray, np.ndarray]:
    """Force (3,) in N and torque (3,) in N m about the middle of the face on the whole punch, from `body.dat`."""
    rows = [row.split() for row in text.splitlines()]
    rows = [row for row in rows if len(row) == 4 and row[0].isdigit()]
    number = np.array([int(row[0]) for row in rows]) - FIRST
    force = -MILLI * np.array([row[1:] for row in rows], dtype=float)
    # all nodes of the punch go down alike, so arms stay as they are
    arm = MILLI * punch.shell().reshape(-1, 3)[number] - [0.0, 0.0, punch.height]
    mirrored = np.array([2.0, 0.0, 2.0])
    return mirrored * force.sum(0), (2.0 - mirrored) * np.cross(arm, force).sum(0)


def _shell(punch: Tilted) -> list[str]:
    """Nodes, elements and the front of the punch."""
    nodes = punch.shell()
    _, rings, around, _ = nodes.shape
    layer = rings * around
    lines = ["*NODE, NSET=TOOLNODES"]
    used = np.ones((2, rings, around), bool)
    used[:, 0, 1:] = False  # the axis has one node
    places = nodes.reshape(-1, 3)  # a number may have 20 signs
    lines += [
        ", ".join([str(FIRST + i), *(f"{x:.12g}" for x in places[i])]) for i in np.flatnonzero(used).tolist()
    ]
    for kind in ("C3D6", "C3D8"):
        lines.append(f"*ELEMENT, TYPE={kind}, ELSET=TOOL")
        for i, j in np.ndindex(rings - 1, around - 1):
            n = FIRST + i * around + j
            face = [n, n + around, n + around + 1, n + 1] if i else [FIRST, n + around, n + around + 1]
            if (kind == "C3D8") == bool(i):
                lines.append(", ".join(map(str, [n, *face, *(m + layer for m in face)])))
    return [
        *lines,
        "*SURFACE, NAME=FRONT",
        *(f"{FIRST + i * around + j}, S1" for i, j in np.ndindex(rings - 1, around - 1)),
    ]
