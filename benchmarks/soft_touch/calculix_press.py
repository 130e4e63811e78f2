"""One path of soft-touch in CalculiX: the same tetrahedra of second order under a rigid cap in frictionless contact.

The cap is a layer of hexahedra all of whose nodes go together along the path; their reactions are the force. The
contact's penalty leaves about 0.3 % of the force. Units are mm, mN and kPa, as in `tests/verification/calculix.py`.
"""

from __future__ import annotations

import itertools
import math
import tempfile
from pathlib import Path as File

import numpy as np
from tests.verification import calculix, calculix_ball

from palpate.physics.solid import SolidProblem

from .bodies import RADIUS, STEPS, Path

__all__ = ["deck", "solve_press_path"]

PENALTY = 1000.0  # kPa/mm over E/R
NEAR = 1.3  # distance from the place over the ball's radius, of the faces that may touch
FACES = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))  # corners of a tetrahedron's faces S1 to S4
FIRST = 1_000_000  # number of the cap's first node and element


def solve_press_path(problem: SolidProblem, path: Path, steps: int = STEPS) -> np.ndarray:
    """Return the forces on the ball (k, 3) in N at the first depths."""
    with tempfile.TemporaryDirectory() as folder:
        text = calculix.output("ccx", File(folder), deck(problem, path, steps))
    lines = text.splitlines()
    totals = [lines[k + 2].split()[-3:] for k, line in enumerate(lines) if "total force" in line]
    return -calculix.MILLI * np.array(totals, dtype=float)


def deck(problem: SolidProblem, path: Path, steps: int = STEPS) -> str:
    """Return CalculiX's input."""
    points, tetrahedra = _second_order(problem)
    mesh, materials = problem.mesh, problem.body.materials
    lines = ["*NODE, NSET=ALL"]  # CalculiX reads 20 letters of a number
    lines += [
        f"{k}, {x:.10g}, {y:.10g}, {z:.10g}"
        for k, (x, y, z) in enumerate((points / calculix.MILLI).tolist(), 1)
    ]
    for number, region in enumerate(mesh.regions):
        rows = np.flatnonzero(mesh.region_of == number)
        lines.append(f"*ELEMENT, TYPE=C3D10, ELSET=R{number}")
        lines += [", ".join(map(str, [k + 1, *(tetrahedra[k] + 1).tolist()])) for k in rows.tolist()]
        lines += [f"*MATERIAL, NAME=LAW{number}", calculix.neo_hookean(materials[region])]
        lines.append(f"*SOLID SECTION, ELSET=R{number}, MATERIAL=LAW{number}")
    lines += ["*ELSET, ELSET=BODY", *(f"R{number}," for number in range(len(mesh.regions)))]
    held = np.concatenate([calculix.nodes_of(mesh, mesh.triangles_of(name)) for name in problem.body.fixed])
    lines += ["*NSET, NSET=FIXED", *(f"{node + 1}," for node in np.unique(held).tolist())]
    lines += [*_contact_faces(problem, path), *_cap(path)]
    young = max(material.young for material in materials.values())
    # the body's laws stand above
    lines += calculix_ball.contact("", PENALTY * young / calculix.KILO / (RADIUS / calculix.MILLI))[3:]
    lines += ["*BOUNDARY", "FIXED, 1, 3"]
    for depth in path.depths[:steps]:
        lines += _step(-depth * path.normal / calculix.MILLI)
    return "\n".join(lines) + "\n"


def _step(move: np.ndarray) -> list[str]:
    return [
        *("*STEP, NLGEOM, INC=200", "*STATIC", "1., 1., 1e-3, 1."),
        *(
            "*BOUNDARY",
            *(f"TOOLNODES, {axis}, {axis}, {value:.10g}" for axis, value in enumerate(move.tolist(), 1)),
        ),
        *("*NODE PRINT, NSET=TOOLNODES, TOTALS=ONLY, FREQUENCY=1000", "RF"),
        "*END STEP",
    ]


def _second_order(problem: SolidProblem) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes (n, 3) in m and the ten of each tetrahedron; middles of edges lie on the curved elements."""
    import ngsolve

    points, tetrahedra = calculix.second_order(problem.mesh)
    mesh = problem.body.geometry.mesh(problem.refinements)
    corners = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]])  # of NGSolve's reference tetrahedron
    middles = corners[np.array(calculix.EDGES)].mean(axis=1)
    rule = ngsolve.IntegrationRule([tuple(row) for row in middles.tolist()], [1.0] * 6)
    mapped = np.asarray(
        ngsolve.CF((ngsolve.x, ngsolve.y, ngsolve.z))(mesh.MapToAllElements(rule, ngsolve.VOL))
    )
    own = np.array([[vertex.nr for vertex in element.vertices] for element in mesh.Elements(ngsolve.VOL)])
    place = {}
    for column, (a, b) in enumerate(calculix.EDGES):
        ends = np.sort(own[:, [a, b]], axis=1).tolist()
        place |= dict(zip(map(tuple, ends), mapped.reshape(-1, 6, 3)[:, column], strict=True))
    for column, (a, b) in enumerate(calculix.EDGES):
        ends = np.sort(tetrahedra[:, [a, b]], axis=1).tolist()
        points[tetrahedra[:, 4 + column]] = [place[tuple(pair)] for pair in ends]
    return points, tetrahedra


def _contact_faces(problem: SolidProblem, path: Path) -> list[str]:
    """Return the faces of the touched surface near the place."""
    mesh = problem.mesh
    triangles = mesh.triangles_of(problem.interactions[0].touches)
    centres = mesh.points[triangles].mean(axis=1)
    near = np.linalg.norm(centres - path.place, axis=1) < NEAR * RADIUS
    wanted = {tuple(sorted(row)) for row in triangles[near].tolist()}
    lines = ["*SURFACE, NAME=TOP"]
    for side, face in enumerate(FACES, 1):
        rows = np.sort(mesh.tetrahedra[:, face], axis=1).tolist()
        lines += [f"{k}, S{side}" for k, row in enumerate(rows, 1) if tuple(row) in wanted]
    return lines


def _cap(path: Path) -> list[str]:
    """Return the ball's lower cap as a layer of hexahedra (C3D8) that just touches the place."""
    count = math.ceil(calculix_ball.REACH / calculix_ball.FACET)
    slopes = np.tan(np.arange(-count, count + 1) * calculix_ball.REACH / count)
    across = np.cross(path.normal, np.eye(3)[int(np.argmin(np.abs(path.normal)))])
    across /= np.linalg.norm(across)
    axes = np.array([across, np.cross(path.normal, across), path.normal])
    # flat facets lie inside the ball, by this share of its radius in the mean
    ball = RADIUS / calculix.MILLI * (1 + calculix_ball.FACET**2 / 6)
    centre = (path.place + RADIUS * path.normal) / calculix.MILLI
    lines, width = ["*NODE, NSET=TOOLNODES"], len(slopes)
    for layer, (i, j) in itertools.product((0, 1), np.ndindex(width, width)):
        ray = np.array([slopes[i], slopes[j], -1.0])
        place = centre + (1 - calculix_ball.THICK * layer) * ball * ray / np.linalg.norm(ray) @ axes
        lines.append(f"{FIRST + layer * width**2 + i * width + j}, " + ", ".join(f"{x:.10g}" for x in place))
    lines.append("*ELEMENT, TYPE=C3D8, ELSET=TOOL")
    faces = []
    for i, j in np.ndindex(width - 1, width - 1):
        n = FIRST + i * width + j
        square = [n, n + width, n + width + 1, n + 1]
        lines.append(", ".join(map(str, [n, *square, *(m + width**2 for m in square)])))
        faces.append(f"{n}, S1")
    return [*lines, "*SURFACE, NAME=FRONT", *faces]
