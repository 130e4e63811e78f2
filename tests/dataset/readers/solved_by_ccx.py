"""Decks for CalculiX: a cube under constant strain, whose answers are known, and a slender beam pulled at its tip."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

CORNERS = ((0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2))
MIDDLES = (
    *((1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2)),
    *((1, 2, 2), (0, 1, 2), (0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)),
)
PRINTS = """*EL PRINT, ELSET=BODY
S
*EL PRINT, ELSET=BODY, TOTALS=ONLY
ELSE
*NODE PRINT, NSET={held}, TOTALS=ONLY
RF
*NODE PRINT, NSET={moved}
U
"""


def run(program: str, folder: Path, name: str, deck: str) -> Path:
    """Path of the .frd of a deck; the .dat lies beside it."""
    (folder / f"{name}.inp").write_text(deck)
    alone = {**os.environ, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [program, "-i", name], cwd=folder, env=alone, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stdout[-2000:]
    return folder / f"{name}.frd"


def row_of_bricks(count: int, size: tuple[float, float, float]) -> tuple[dict, list[str]]:
    """Nodes by place in half steps, and lines of a row of bricks of second order along x."""
    numbers: dict[tuple[int, int, int], int] = {}
    elements = []
    for element in range(count):
        places = [(2 * element + i, j, k) for i, j, k in CORNERS + MIDDLES]
        elements.append([numbers.setdefault(place, len(numbers) + 1) for place in places])
    lines = ["*NODE, NSET=ALL"]
    for (i, j, k), number in numbers.items():
        x, y, z = i * size[0] / (2 * count), j * size[1] / 2, k * size[2] / 2
        lines.append(f"{number}, {x!r}, {y!r}, {z!r}")
    lines.append("*ELEMENT, TYPE=C3D20, ELSET=BODY")
    for number, nodes in enumerate(elements, 1):
        lines += [f"{number}, {', '.join(map(str, nodes[:10]))},", ", ".join(map(str, nodes[10:]))]
    return numbers, lines


def patch_deck(gradient, young: float, poisson: float, output: str = "FILE") -> str:
    """Eight bricks of 5 mm whose outer nodes follow u = G x, in N and mm; one node inside, off the middle, is free."""
    lattice = [(i, j, k) for k in range(3) for j in range(3) for i in range(3)]
    numbers = {place: number for number, place in enumerate(lattice, 1)}
    places = {place: tuple(5.0 * c for c in place) for place in lattice}
    places[1, 1, 1] = (5.8, 4.4, 5.6)
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{numbers[place]}, {x!r}, {y!r}, {z!r}" for place, (x, y, z) in places.items()]
    lines.append("*ELEMENT, TYPE=C3D8, ELSET=BODY")
    for number, (i, j, k) in enumerate((p for p in lattice if max(p) < 2), 1):
        nodes = [numbers[i + a // 2, j + b // 2, k + c // 2] for a, b, c in CORNERS]
        lines.append(f"{number}, {', '.join(map(str, nodes))}")
    outer = [place for place in lattice if place != (1, 1, 1)]
    lines += ["*NSET, NSET=OUTER", *(f"{numbers[place]}," for place in outer)]
    lines += ["*MATERIAL, NAME=LAW", "*ELASTIC", f"{young!r}, {poisson!r}"]
    lines += ["*SOLID SECTION, ELSET=BODY, MATERIAL=LAW", "*STEP", "*STATIC", "*BOUNDARY"]
    for place in outer:
        for axis, row in enumerate(gradient, 1):
            moved = sum(g * c for g, c in zip(row, places[place], strict=True))
            lines.append(f"{numbers[place]}, {axis}, {axis}, {moved!r}")
    lines += [f"*NODE {output}", "U, RF", "*EL FILE" if output == "FILE" else "*ELEMENT OUTPUT", "S, E"]
    return "\n".join([*lines, PRINTS.format(held="OUTER", moved="ALL"), "*END STEP", ""])


def beam_deck(load: float, *, increments: int = 20, young: float = 1000.0) -> str:
    """A beam of 100 × 10 × 10 mm along x, held at its root; the load (N) pulls its tip down, geometry nonlinear.

    All nodes of the tip go down by the same, so that the load works along the deflection of any of them.
    """
    numbers, lines = row_of_bricks(8, (100.0, 10.0, 10.0))
    root = [number for place, number in numbers.items() if place[0] == 0]
    tip = [number for place, number in numbers.items() if place[0] == 16]
    for name, nodes in (("ROOT", root), ("TIP", tip)):
        lines += [f"*NSET, NSET={name}", *(f"{number}," for number in nodes)]
    lines += ["*MATERIAL, NAME=LAW", "*ELASTIC", f"{young!r}, 0."]
    lines += ["*SOLID SECTION, ELSET=BODY, MATERIAL=LAW", "*BOUNDARY", "ROOT, 1, 3"]
    first, *others = tip
    for number in others:
        lines += ["*EQUATION", "2", f"{number}, 2, 1., {first}, 2, -1."]
    lines += ["*STEP, NLGEOM, INC=1000", "*STATIC, DIRECT", f"{1 / increments!r}, 1."]
    lines += ["*CLOAD", f"{first}, 2, {-load!r}", "*NODE FILE", "U"]
    return "\n".join([*lines, PRINTS.format(held="ROOT", moved="TIP"), "*END STEP", ""])
