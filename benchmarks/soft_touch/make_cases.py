"""Make the folders of soft-touch: shapes, places and the oracle's tables.

    python -m benchmarks.soft_touch.make_cases [--case NAME ...] [--seed N --out FOLDER]

Without a seed the shipped folders are renewed in place: the shapes and places at once, then all solves that
`solves.csv` does not hold yet, as long as `--minutes` allows; `oracle.csv` follows from `solves.csv`. With a seed,
other places of the same bodies are solved by palpate alone.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import time
from collections import deque
from collections.abc import Sequence
from pathlib import Path as File

import numpy as np

from palpate.physics.shapes.mesh import BodyMesh

from .bodies import BODIES, CASES, RADIUS, SEED, held_points, mesh_of
from .press_places import write_places

__all__ = ["CASES", "main", "make_places", "write_case"]

LAW = "W = shear/2 (J^(-2/3) tr(FᵀF) - 3) + bulk/2 (J - 1)^2, J = det F"


def write_case(name: str, folder: File) -> None:
    """Write a body's card and mesh."""
    folder.mkdir(parents=True, exist_ok=True)
    mesh = mesh_of(name)
    (folder / "case.toml").write_text(_card(name, mesh), "utf-8")
    _write_mesh(mesh, held_points(name, mesh), folder / "mesh.vtu")


def make_places(name: str, seed: int, folder: File) -> None:
    """Write a whole case with the places of another seed, solved by palpate alone, in some minutes."""
    from .oracle import solve_paths, write_oracle

    folder.mkdir(parents=True, exist_ok=True)
    for part in ("case.toml", "mesh.vtu"):
        shutil.copy(CASES / name / part, folder / part)
    write_places(name, seed, folder)
    deque(solve_paths(name, seed, folder), maxlen=0)
    write_oracle(folder, reference=CASES / name)


def _card(name: str, mesh: BodyMesh) -> str:
    soft = BODIES[name]
    lines = [
        f'title = "{soft.title}"',
        'units = "SI: m, N, Pa, J"',
        f'shape = "{soft.shape}"',
        'contact = "rigid ball, frictionless, quasi-static"',
        f'support = "the surface {" and ".join(soft.body.fixed)}: nodes with fixed = 1 in mesh.vtu"',
        'source = "benchmarks/soft_touch/bodies.py"',
        "",
        "[ball]",
        f"radius = {RADIUS}",
    ]
    # in the order of the mesh's labels
    for label in mesh.regions:
        law = soft.body.materials[label]
        lines += [
            "",
            f"[materials.{label}]",
            'law = "neo-Hookean"',
            f"shear = {law.shear_modulus:.8g}",
            f"bulk = {law.bulk_modulus:.8g}",
            f"young = {law.young:g}",
            f"poisson = {law.poisson:g}",
            f'energy = "{LAW}"',
        ]
    return "\n".join(lines) + "\n"


def _write_mesh(mesh: BodyMesh, held: np.ndarray, file: File) -> None:
    """Write tetrahedra as a VTU file in words, which a reader of twenty lines can read."""
    nodes, cells = len(mesh.points), len(mesh.tetrahedra)
    point = "\n".join(" ".join(f"{value:.7g}" for value in row) for row in mesh.points)
    corners = "\n".join(" ".join(map(str, row)) for row in mesh.tetrahedra.tolist())
    text = f"""<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">
<UnstructuredGrid><Piece NumberOfPoints="{nodes}" NumberOfCells="{cells}">
<Points><DataArray type="Float64" Name="Points" NumberOfComponents="3" format="ascii">
{point}
</DataArray></Points>
<Cells><DataArray type="Int32" Name="connectivity" format="ascii">
{corners}
</DataArray><DataArray type="Int32" Name="offsets" format="ascii">
{" ".join(str(4 * (k + 1)) for k in range(cells))}
</DataArray><DataArray type="UInt8" Name="types" format="ascii">
{" ".join(["10"] * cells)}
</DataArray></Cells>
<PointData><DataArray type="Int32" Name="fixed" format="ascii">
{" ".join(map(str, held.astype(int).tolist()))}
</DataArray></PointData>
<CellData><DataArray type="Int32" Name="label" format="ascii">
{" ".join(map(str, mesh.region_of.tolist()))}
</DataArray></CellData>
</Piece></UnstructuredGrid></VTKFile>
"""
    file.write_text(text, "utf-8")


def main(arguments: Sequence[str] | None = None) -> int:
    """Write folders, solve, and join."""
    from .oracle import solve_calculix, solve_paths, write_oracle

    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.soft_touch.make_cases", description=__doc__.split("\n")[0]
    )
    parser.add_argument("--case", nargs="+", choices=BODIES, default=list(BODIES))
    parser.add_argument("--seed", type=int, help="makes other places, in the folder of --out")
    parser.add_argument("--out", type=File, help="folder of the other places")
    parser.add_argument("--minutes", type=float, default=np.inf, help="no solve begins later")
    parser.add_argument("--shapes", action="store_true", help="write shapes and places only")
    parser.add_argument("--calculix", action="store_true", help="solve by CalculiX (ccx) only")
    options = parser.parse_args(arguments)
    if (options.seed is None) != (options.out is None):
        parser.error("--seed and --out belong together: the shipped folders keep the published seed")
    until = time.monotonic() + 60 * options.minutes
    if options.seed is not None:
        for name in options.case:
            make_places(name, options.seed, options.out / name)
    elif options.shapes:
        for name in options.case:
            write_case(name, CASES / name)
            write_places(name, SEED, CASES / name)
    else:
        solve = solve_calculix if options.calculix else solve_paths
        work = {name: solve(name, SEED, CASES / name) for name in options.case}
        while work and time.monotonic() < until:  # by turns, so that every body has some rows soon
            for name in list(work):
                if next(work[name], False) is False:
                    del work[name]
                write_oracle(CASES / name)
    return 0


if __name__ == "__main__":
    sys.exit(main())
