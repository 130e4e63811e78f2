"""The oracle of soft-touch: forces, stiffness and energies from two solvers on fine meshes, and their errors.

Each path has a mesh of its own, fine beneath the ball and coarse elsewhere. palpate's rigid ball has a stiff pad that
leaves a share of the force. All its answers are linear in the pad's compliance 1/k to a thousandth, so the derivative
by it, one back-substitution in the solved state, takes them to a ball without a pad.

Of the mesh: some paths are solved on two sizes of elements, h and `FINER` h. The force errs as h², as long as the edge
of the contact lies within elements, and Richardson's rule gives its value for h → 0. Paths that are solved on one size
get the mean correction of those solved on both at the same step.
"""

from __future__ import annotations

import csv
import time
from collections.abc import Iterator
from pathlib import Path as File
from typing import Any

import numpy as np

from benchmarks.soft_touch.bodies import BODIES, DEPTHS, RADIUS, STEPS, Path, paths_of
from palpate.physics.interactions import SphereProbe
from palpate.physics.shapes.meshing import FineMesh
from palpate.physics.solid import SolidProblem

__all__ = ["fine_problem", "read_solves", "solve_calculix", "solve_paths", "write_oracle"]

ELEMENT = 0.0025  # m, elements under the ball: 0.8 of the narrowest contact's radius
FINER = 0.7  # size of the finer elements over that: twice the unknowns
REACH = 0.0075  # m, half the side of the fine box: the widest contact has a radius of 6.3 mm
BOTH = (0, 4, 8, 2, 6, 10, 1, 3, 5, 7, 9, 11)  # order in which paths are solved on finer elements
TOLERANCE = 1e-6  # relative error in the energy norm, far below that of the mesh
NUDGE = 1e-3  # relative change of the pad's stiffness by which the derivative is taken
HEADER = "press,solver,element,fx,fy,fz,kn,energy,seconds"


def fine_problem(name: str, path: Path, element: float) -> SolidProblem:
    """Return the body with a mesh that is fine beneath one path."""
    soft = BODIES[name]
    around = (tuple(path.place - 1e-3), tuple(path.place + 1e-3))
    probe: Any = SphereProbe(
        RADIUS, touches=soft.touches, pad="rigid", stop=None, depth=(0.0, DEPTHS[1]), over=around
    )
    box = (tuple((path.place - REACH).tolist()), tuple((path.place + REACH).tolist()))
    return SolidProblem(soft.body, (probe,), fine=(FineMesh(soft.touches, element, *box),))


def solve_path(name: str, path: Path, element: float, steps: int = STEPS) -> list[list[float]]:
    """Return rows of force (3,) in N, stiffness in N/m and energy in J under a rigid ball, of the first depths."""
    solver = fine_problem(name, path, element).open(tolerance=TOLERANCE)
    rows, shares = [], []
    for centre in path.centres[:steps]:
        pressed = solver.solve(centre)
        if not pressed.converged:
            raise RuntimeError(f"{name}, path {path.number}: {pressed.message}")
        force, change, energy = _without_pad(solver.model, pressed)
        rows.append([*(force + change), -path.normal @ pressed.response_gradient @ path.normal, energy])
        shares.append(float(change @ path.normal / (force @ path.normal)))
    # F = F_pad (1 + s), s ~ depth^(-1/2) by Hertz: dF = k (1 + s) + F_pad s', whose s' is -s/(2 depth)
    for row, share, depth in zip(rows, shares, path.depths, strict=False):
        row[3] = row[3] * (1 + share) - float(np.array(row[:3]) @ path.normal) * share / (2 * depth)
    return rows


def _without_pad(model: Any, pressed: Any) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the force (3,) in N, its change and the energy in J as the pad's compliance goes to zero."""
    state = pressed.state
    try:
        model.stiffen(1 / (1 + NUDGE))
        softer = state - model.system.solve(model.system.residual(state))
        change = (pressed.response - model.response(softer))[:3] / NUDGE
    finally:
        model.stiffen(1.0)
    # dU/d(1/k) = -k times the pad's own energy, exactly
    return pressed.response[:3], change, 2 * pressed.potential_energy - pressed.strain_energy


def solve_paths(name: str, seed: int, folder: File, *, until: float) -> None:
    """Add palpate's solves that `solves.csv` does not hold yet; none begins after a time."""
    paths = paths_of(name, seed)
    plan = [(path, ELEMENT) for path in paths] + [(paths[k], FINER * ELEMENT) for k in BOTH]
    for path, element in plan:
        if time.monotonic() > until:
            return
        first = path.number * STEPS
        if (first, "palpate", f"{element:g}") in read_solves(folder):
            continue
        began = time.process_time()
        rows = solve_path(name, path, element)
        spent = (time.process_time() - began) / len(rows)
        _append(folder, [[first + k, "palpate", f"{element:g}", *row, spent] for k, row in enumerate(rows)])
        print(f"{name}, path {path.number}, {element:g} m: {spent:.1f} s of CPU time a press", flush=True)


def solve_calculix(name: str, seed: int, folder: File, *, until: float) -> None:
    """Add CalculiX's solves that `solves.csv` does not hold yet; none begins after a time."""
    from benchmarks.soft_touch.calculix_press import solve_path as solve

    paths = paths_of(name, seed)
    for path in (paths[k] for k in BOTH):
        if time.monotonic() > until:
            return
        first = path.number * STEPS
        if any((first, "CalculiX") == key[:2] for key in read_solves(folder)):
            continue
        began = time.monotonic()
        forces, energies, element = solve(name, path)
        spent = (time.monotonic() - began) / len(forces)
        rows = [
            [first + k, "CalculiX", f"{element:g}", *force, np.nan, energy, spent]
            for k, (force, energy) in enumerate(zip(forces, energies, strict=True))
        ]
        _append(folder, rows)
        print(f"{name}, path {path.number}, CalculiX: {spent:.1f} s a press", flush=True)


def read_solves(folder: File) -> dict[tuple[int, str, str], np.ndarray]:
    """Return fx, fy, fz in N, kn in N/m and energy in J by press, solver and element."""
    file = folder / "solves.csv"
    if not file.exists():
        return {}
    with file.open(encoding="utf-8") as stream:
        return {
            (int(row["press"]), row["solver"], row["element"]): np.array(
                [float(row[key] or "nan") for key in ("fx", "fy", "fz", "kn", "energy")]
            )
            for row in csv.DictReader(stream)
        }


def _append(folder: File, rows: list[list[Any]]) -> None:
    file = folder / "solves.csv"
    if not file.exists():
        file.write_text(HEADER + "\n", "utf-8")
    with file.open("a", encoding="utf-8") as stream:
        for press, solver, element, *numbers in rows:
            words = ["" if np.isnan(number) else f"{number:.7g}" for number in numbers]
            stream.write(",".join([str(press), solver, element, *words]) + "\n")


def write_oracle(folder: File, *, reference: File | None = None) -> None:
    """Write `oracle.csv` from `solves.csv`; a folder of another seed takes CalculiX's differences from a reference."""
    from benchmarks.soft_touch.make_cases import write_table

    rows = list(oracle_rows(folder, folder if reference is None else reference))
    header = "press,fx,fy,fz,kn,energy,force_error,stiffness_error,energy_error"
    write_table(folder / "oracle.csv", header, rows)


def oracle_rows(folder: File, reference: File) -> Iterator[list[Any]]:
    """Yield rows of the oracle: values at h → 0 and errors."""
    solves = read_solves(folder)
    normals = _normals(folder)
    coarse, finer = _of(solves, ELEMENT), _of(solves, FINER * ELEMENT)
    factor = _mesh_factors(coarse, finer)
    differences = _solver_differences(reference)
    for press in sorted(coarse):
        step, size = press % STEPS, _sizes(coarse[press])
        if press in finer:
            value = finer[press] + (finer[press] - coarse[press]) * FINER**2 / (1 - FINER**2)
            gap = np.abs(_sizes(value - finer[press]))
        else:
            value = coarse[press] * (1 + factor[step, 0])
            gap = size * factor[step, 1]
        error = np.maximum(gap, size * differences[step])
        yield [press, *(f"{number:.7g}" for number in value), *(f"{number:.3g}" for number in error)]
    assert len(normals) >= len(coarse)


def _normals(folder: File) -> np.ndarray:
    return np.loadtxt(folder / "presses.csv", delimiter=",", skiprows=1, usecols=(6, 7, 8))
