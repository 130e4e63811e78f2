"""A CalculiX study of a bracket that is heated, cooled and pressed: its folder, for `palpate sweep`.

An angle of 60 x 40 x 50 mm, 6 mm thick, is held by two bolts. A shaft in its wall heats the bore with a heat flux, air
at 293.15 K cools all other faces, and a pressure acts on the wall. Inputs are the heat flux, the heat transfer
coefficient to the air, the conductivity and the pressure; answers are the temperature and the displacement of all nodes
of quadratic tetrahedra.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

__all__ = ["write_bracket"]

_AIR = 293.15  # K, at which the bracket is also free of strain
_SIDES = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))  # corners of CalculiX's faces 1 to 4
_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))  # whose middles are nodes 5 to 10

# in N, mm, s and K: heat in mW
_DECK = """{mesh}
*MATERIAL, NAME=ALLOY
*ELASTIC
70000., 0.33
*EXPANSION, ZERO={air}
2.3e-5
*CONDUCTIVITY
{{{{ conductivity | mW/(mm K) }}}}
*SOLID SECTION, ELSET=BODY, MATERIAL=ALLOY
*INITIAL CONDITIONS, TYPE=TEMPERATURE
ALL, {air}
*STEP
*UNCOUPLED TEMPERATURE-DISPLACEMENT, STEADY STATE
*BOUNDARY
BOLTS, 1, 3
*DFLUX
BORE{{side}}
*FILM
AIR{{side}}
*DLOAD
WALL{{side}}
*NODE FILE
U, NT
*END STEP
"""

_STUDY = """
name = "bracket"

[solver]
command = ["ccx", "-i", "{{case}}"]
results = ["{{case}}.frd"]
failure = ["*ERROR"]
limit = "5 min"

[[inputs]]
name = "heat flux"
range = ["5 kW/m^2", "50 kW/m^2"]

[[inputs]]
name = "heat transfer"
range = ["10 W/(m^2 K)", "100 W/(m^2 K)"]

[[inputs]]
name = "conductivity"
range = ["20 W/(m K)", "200 W/(m K)"]

[[inputs]]
name = "pressure"
range = ["0 MPa", "1 MPa"]

[mapping.units]
length = "mm"
force = "N"

[[mapping.outputs]]
name = "temperature"
from = "NDTEMP.T"
unit = "K"

[[mapping.outputs]]
name = "displacement"
from = "DISP"

[sweep]
samples = {samples}
seed = {seed}
workers = 1

[test]
random = {unseen}
"""


def write_bracket(folder: Path, *, size: float, samples: int, unseen: int, seed: int = 0) -> tuple[Path, int]:
    """Write the study and its template into a folder; return the study's file and the number of nodes.

    `size` is that of the elements, mm; `samples` and `unseen` are the solves to learn from and to judge by.
    """
    mesh, sides, nodes = _mesh(size)
    deck = _DECK.format(mesh=mesh, air=_AIR)
    loads = {
        "BORE": [f"{element}, S{side}, {{{{ heat flux | mW/mm^2 }}}}" for element, side in sides["bore"]],
        "AIR": [
            f"{element}, F{side}, {_AIR}, {{{{ heat transfer | mW/(mm^2 K) }}}}"
            for name in ("air", "wall")
            for element, side in sides[name]
        ],
        "WALL": [f"{element}, P{side}, {{{{ pressure | MPa }}}}" for element, side in sides["wall"]],
    }
    for name, lines in loads.items():
        deck = deck.replace(f"{name}{{side}}", "\n".join(lines))
    (folder / "templates").mkdir(parents=True, exist_ok=True)
    (folder / "templates" / "{case}.inp").write_text(deck, encoding="utf-8")
    study = folder / "bracket.toml"
    study.write_text(_STUDY.format(samples=samples, unseen=unseen, seed=seed), encoding="utf-8")
    return study, nodes


def _mesh(size: float) -> tuple[str, dict[str, list[tuple[int, int]]], int]:
    """Return the deck's nodes, elements and bolts, the faces (element, side) of each name, and the number of nodes."""
    from netgen.occ import Axes, Box, Cylinder, OCCGeometry, X, Y, Z
    from ngsolve import BND, Mesh

    body = Box((0, 0, 0), (60, 40, 6)) + Box((0, 0, 0), (6, 40, 50))
    body.faces.name = "air"
    body.faces.Min(X).name = "wall"
    for y in (10, 30):
        bolt = Cylinder(Axes((40, y, -1), Z), r=4, h=8)
        bolt.faces.name = "bolts"
        body -= bolt
    bore = Cylinder(Axes((-1, 20, 35), X, Y), r=8, h=8)
    bore.faces.name = "bore"
    body -= bore
    mesh = Mesh(OCCGeometry(body).GenerateMesh(maxh=size))
    points = np.array([v.point for v in mesh.vertices])
    corners = np.array([[v.nr for v in e.vertices] for e in mesh.Elements()])
    p = points[corners]
    turned = np.linalg.det(p[:, 1:] - p[:, :1]) < 0
    corners[turned] = corners[turned][:, [0, 2, 1, 3]]
    ends = np.sort(corners[:, _EDGES].reshape(-1, 2), axis=1)
    edges, number = np.unique(ends, axis=0, return_inverse=True)
    elements = np.hstack([corners, len(points) + number.reshape(-1, 6)]) + 1
    points = np.vstack([points, points[edges].mean(axis=1)])
    owner = {
        tuple(sorted(row[list(side)].tolist())): (element, place)
        for element, row in enumerate(corners, 1)
        for place, side in enumerate(_SIDES, 1)
    }
    sides: dict[str, list[tuple[int, int]]] = {name: [] for name in ("air", "wall", "bolts", "bore")}
    for triangle in mesh.Elements(BND):
        sides[triangle.mat].append(owner[tuple(sorted(v.nr for v in triangle.vertices))])
    held = {
        int(node)
        for element, place in sides["bolts"]
        for node in _nodes_of_side(elements[element - 1], _SIDES[place - 1])
    }
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{i}, {x!r}, {y!r}, {z!r}" for i, (x, y, z) in enumerate(points.tolist(), 1)]
    lines.append("*ELEMENT, TYPE=C3D10, ELSET=BODY")
    lines += [", ".join(map(str, [i, *row])) for i, row in enumerate(elements.tolist(), 1)]
    lines += ["*NSET, NSET=BOLTS", *(f"{node}," for node in sorted(held))]
    return "\n".join(lines), sides, len(points)


def _nodes_of_side(element: np.ndarray, side: tuple[int, ...]) -> np.ndarray:
    """Return the six nodes of a face of a quadratic tetrahedron (10,)."""
    own = [4 + i for i, edge in enumerate(_EDGES) if set(edge) <= set(side)]
    return element[[*side, *own]]
