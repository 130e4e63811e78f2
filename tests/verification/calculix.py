"""The same body in CalculiX: a deck written from a mesh, the program run on it, and its answers read.

The deck has the same tetrahedra with straight edges (C3D10: the four vertices, then the middles of the edges 12, 23,
31, 14, 24, 34), the same law and the same constraints. Its units are mm, mN and kPa: CalculiX takes forces below some
absolute bound for zero and so ends its iteration early on a soft body in SI units.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.physics.shapes import BodyMesh

EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
LIMIT = 300.0  # s that a run may take on a busy machine
KEPT = Path(__file__).parent / "calculix_answers.zip"  # what long runs wrote, by the hash of their input
MILLI = 1e-3  # mm in m, mN in N
KILO = 1e3  # kPa in Pa


@dataclass(frozen=True)
class Step:
    """Displacements (3,) in m of the moved nodes at the end of a step that is taken in `increments` equal parts."""

    move: tuple[float, float, float]
    increments: int = 1


@dataclass(frozen=True)
class Answer:
    """Displacements (node, 3) in m of vertices and middles of edges; the force (3,) in N that moves the moved ones."""

    displacement: np.ndarray
    force: np.ndarray


def neo_hookean(material) -> str:
    """C10 (Ī1 - 3) + (J - 1)²/D1: the law of two terms, μ = 2 C10 and K = 2/D1."""
    return f"*HYPERELASTIC, NEO HOOKE\n{material.shear_modulus / KILO / 2!r}, {2 * KILO / material.bulk_modulus!r}"


def linear(material) -> str:
    """E and ν."""
    return f"*ELASTIC\n{material.young / KILO!r}, {material.poisson!r}"


def plastic(material, strains) -> str:
    """E and ν, and the yield curve through flow stresses at accumulated plastic strains."""
    curve = [f"{material.hardening.flow_stress(strain) / KILO!r}, {strain!r}" for strain in strains]
    return linear(material) + "\n*PLASTIC\n" + "\n".join(curve)


def second_order(mesh: BodyMesh) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 3) of vertices and middles of edges, and the ten nodes (e, 10) of each tetrahedron."""
    ends = np.sort(mesh.tetrahedra[:, EDGES].reshape(-1, 2), axis=1)
    edges, number = np.unique(ends, axis=0, return_inverse=True)
    middles = mesh.points[edges].mean(axis=1)
    nodes = np.hstack([mesh.tetrahedra, len(mesh.points) + number.reshape(-1, 6)])
    return np.vstack([mesh.points, middles]), nodes


def nodes_of(mesh: BodyMesh, triangles: np.ndarray) -> np.ndarray:
    """Nodes of second order on triangles (t, 3): their vertices and the middles of their edges."""
    tetrahedra = second_order(mesh)[1]
    middle = {}
    for (a, b), column in zip(EDGES, tetrahedra[:, 4:].T, strict=True):
        ends = np.sort(tetrahedra[:, [a, b]], axis=1)
        middle |= {tuple(pair): node for pair, node in zip(ends.tolist(), column.tolist(), strict=True)}
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return np.union1d(triangles, [middle[tuple(pair)] for pair in sides.tolist()])


def deck(
    mesh: BodyMesh, law: str, fixed: np.ndarray, moved: np.ndarray, steps, *, large: bool, other=None
) -> str:
    """Input for CalculiX: nodes `fixed` held in all components, nodes `moved` (both counted from 0) displaced.

    `other` has elements (e,) of another law, counted from 0, and that law.
    """
    points, tetrahedra = second_order(mesh)
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{i}, {x!r}, {y!r}, {z!r}" for i, (x, y, z) in enumerate((points / MILLI).tolist(), 1)]
    lines += ["*ELEMENT, TYPE=C3D10, ELSET=BODY"]
    lines += [", ".join(map(str, [i, *row])) for i, row in enumerate((tetrahedra + 1).tolist(), 1)]
    for name, nodes in (("FIXED", fixed), ("MOVED", moved)):
        lines += [f"*NSET, NSET={name}", *(f"{node + 1}," for node in nodes.tolist())]
    elements, second = ([], "") if other is None else other
    rest = np.setdiff1d(np.arange(len(tetrahedra)), elements)
    for name, rows, own in (("REST", rest, law), ("OTHER", elements, second)):
        if len(rows):
            lines += [f"*ELSET, ELSET={name}", *(f"{row + 1}," for row in rows)]
            lines += [f"*MATERIAL, NAME=L{name}", own, f"*SOLID SECTION, ELSET={name}, MATERIAL=L{name}"]
    lines += ["*BOUNDARY", "FIXED, 1, 3"]
    for step in steps:
        lines += _step(step, large)
    return "\n".join(lines) + "\n"


def _step(step: Step, large: bool) -> list[str]:
    moves = [f"MOVED, {axis}, {axis}, {value / MILLI!r}" for axis, value in enumerate(step.move, 1)]
    return [
        f"*STEP{', NLGEOM' if large else ''}, INC=1000",
        "*STATIC, DIRECT" if step.increments > 1 else "*STATIC",
        f"{1 / step.increments!r}, 1.",
        # the default lets half a per cent of the mean force go
        "*CONTROLS, PARAMETERS=FIELD",
        "1e-8, 1e-8",
        "*BOUNDARY",
        *moves,
        "*NODE PRINT, NSET=ALL, FREQUENCY=1000",
        "U",
        "*NODE PRINT, NSET=MOVED, TOTALS=ONLY, FREQUENCY=1000",
        "RF",
        "*END STEP",
    ]


def run(program: str, folder: Path, text: str) -> list[Answer]:
    """Answers at the end of each step."""
    return answers(output(program, folder, text))


def kept_output(program: str, folder: Path, text: str) -> str:
    """What the program wrote for this very input, kept in `KEPT`; another input is solved anew.

    `PALPATE_KEEP=1 pytest -m full tests/verification` adds what is solved to the file.
    """
    name = f"{hashlib.sha256(text.encode()).hexdigest()[:32]}.dat"
    with zipfile.ZipFile(KEPT) as packed:
        if name in packed.namelist():
            return packed.read(name).decode()
    found = output(program, folder, text)
    if os.environ.get("PALPATE_KEEP"):
        with zipfile.ZipFile(KEPT, "a", zipfile.ZIP_LZMA) as packed:
            packed.writestr(name, found)
    return found


def output(program: str, folder: Path, text: str) -> str:
    """What the program writes into `body.dat` for an input."""
    (folder / "body.inp").write_text(text)
    alone = {**os.environ, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [program, "-i", "body"],
        cwd=folder,
        env=alone,
        capture_output=True,
        text=True,
        timeout=LIMIT,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-2000:]
    assert "*ERROR" not in done.stdout, done.stdout[-2000:]
    return (folder / "body.dat").read_text()


def answers(text: str) -> list[Answer]:
    """What `body.dat` has: by turns a table of displacements and a total force."""
    displacements, forces, table = [], [], None
    for line in text.splitlines():
        words = line.split()
        if line.lstrip().startswith("displacements"):
            displacements.append(table := [])
        elif line.lstrip().startswith("total force"):
            table = forces
        elif words and table is not None:
            table.append([float(word) for word in words[-3:]])
    return [
        Answer(MILLI * np.array(u), MILLI * np.array(f)) for u, f in zip(displacements, forces, strict=True)
    ]
