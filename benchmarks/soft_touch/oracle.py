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
from dataclasses import replace
from pathlib import Path as File
from typing import Any

import numpy as np

from palpate.errors import SolverError
from palpate.physics.interactions import SphereProbe
from palpate.physics.shapes.meshing import FineMesh
from palpate.physics.solid import SolidProblem

from .bodies import BODIES, CASES, DEPTHS, RADIUS, SEED, STEPS, Path, paths_of

__all__ = ["fine_problem", "read_solves", "solve_calculix", "solve_path", "solve_paths", "write_oracle"]

ELEMENT = 0.0025  # m, elements under the ball: 0.8 of the narrowest contact's radius
FINER = 0.7  # size of the finer elements over that: twice the unknowns
REACH = 0.0065  # m, half the side of the fine box: the widest contact has a radius of 6.3 mm
# order in which paths are solved on finer elements and by CalculiX: the first few lie far apart
BOTH = (*range(0, 12, 4), *range(2, 12, 4), *range(1, 12, 2))
TOLERANCE = 1e-6  # relative error in the energy norm, far below that of the mesh
CHANGE = 1e-3  # relative change of the pad's compliance by which the derivative is taken
HEADER = "press,solver,element,fx,fy,fz,kn,energy,seconds"


def fine_problem(name: str, path: Path, element: float) -> SolidProblem:
    """Return the body with a mesh that is fine beneath one path."""
    soft = BODIES[name]
    around = (tuple(path.place - 1e-3), tuple(path.place + 1e-3))
    probe: Any = SphereProbe(
        RADIUS, touches=soft.touches, pad="rigid", stop=None, depth=(0.0, DEPTHS[1]), over=around
    )
    box = (tuple((path.place - REACH).tolist()), tuple((path.place + REACH).tolist()))
    geometry: Any = soft.body.geometry
    body = replace(soft.body, geometry=replace(geometry, element=max(geometry.coarse, soft.coarse)))
    return SolidProblem(body, (probe,), fine=(FineMesh(soft.touches, element, *box),))


def solve_path(name: str, path: Path, element: float, steps: int = STEPS) -> list[list[float]]:
    """Return rows of force (3,) in N, stiffness in N/m and energy in J under a rigid ball, of the first depths."""
    solver = fine_problem(name, path, element).open(tolerance=TOLERANCE)
    rows, shares = [], []
    for centre in path.centres[:steps]:
        pressed = solver.solve(centre)
        if not pressed.converged:
            raise SolverError(f"{name}, path {path.number}, {element:g} m: {pressed.message}.")
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
        model.stiffen(1 / (1 + CHANGE))
        softer = state - model.system.solve(model.system.residual(state))
        change = (pressed.response - model.response(softer))[:3] / CHANGE
    finally:
        model.stiffen(1.0)
    # dU/d(1/k) = -k times the pad's own energy, exactly
    return pressed.response[:3], change, 2 * pressed.potential_energy - pressed.strain_energy


def solve_paths(name: str, seed: int, folder: File) -> Iterator[None]:
    """Add palpate's solves of a case that `solves.csv` does not hold yet, one path at each step of the iteration."""
    paths = paths_of(name, seed)
    plan = [(path, ELEMENT) for path in paths]
    if seed == SEED:  # a table of other places takes the mesh's part from the shipped one
        finer = [(paths[k], FINER * ELEMENT) for k in BOTH]
        plan = [*plan[:3], finer[0], *plan[3:], *finer[1:]]
    for path, element in plan:
        first = path.number * STEPS
        if (first, "palpate", f"{element:g}") in read_solves(folder):
            continue
        began = time.process_time()
        try:
            rows = solve_path(name, path, element)
        except SolverError as error:  # the other paths go on; the oracle lacks this one
            print(f"{error} Left out; another `ELEMENT` may do.", flush=True)
            continue
        spent = (time.process_time() - began) / len(rows)
        _append(folder, [[first + k, "palpate", f"{element:g}", *row, spent] for k, row in enumerate(rows)])
        print(f"{name}, path {path.number}, {element:g} m: {spent:.1f} s of CPU time a press", flush=True)
        yield


def solve_calculix(name: str, seed: int, folder: File) -> Iterator[None]:
    """Add CalculiX's solves of a case that `solves.csv` does not hold yet, one path at each step of the iteration."""
    from .calculix_press import solve_press_path

    for path in (paths_of(name, seed)[k] for k in BOTH):
        first = path.number * STEPS
        if (first, "CalculiX", f"{ELEMENT:g}") in read_solves(folder):
            continue
        began = time.monotonic()
        forces = solve_press_path(fine_problem(name, path, ELEMENT), path)
        spent = (time.monotonic() - began) / len(forces)
        rows = [
            [first + k, "CalculiX", f"{ELEMENT:g}", *force, np.nan, np.nan, spent]
            for k, force in enumerate(forces)
        ]
        _append(folder, rows)
        print(f"{name}, path {path.number}, CalculiX: {spent:.1f} s a press", flush=True)
        yield


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
    """Write `oracle.csv` from `solves.csv`; a folder of another seed takes both corrections from a reference."""
    solves, shipped = read_solves(folder), read_solves(folder if reference is None else reference)
    coarse, finer = _by_press(solves, "palpate", ELEMENT), _by_press(solves, "palpate", FINER * ELEMENT)
    if not coarse:
        return
    part, doubt = _mesh_part(shipped)
    gaps = _solver_gaps(shipped, paths_of(folder.name, SEED))
    presses = np.loadtxt(folder / "presses.csv", delimiter=",", skiprows=1)
    with (folder / "oracle.csv").open("w", encoding="utf-8") as stream:
        stream.write("press,fx,fy,fz,kn,energy,force_error,stiffness_error,energy_error\n")
        for first in sorted({press - press % STEPS for press in coarse}):
            values, errors = np.empty((STEPS, 5)), np.empty((STEPS, 3))
            for step, press in enumerate(range(first, first + STEPS)):
                if press in finer:
                    values[step] = _extrapolate(coarse[press], finer[press])
                    errors[step] = _sizes(np.abs(values[step] - finer[press]))
                else:
                    values[step] = coarse[press] * (1 + part[step, [0, 0, 0, 1, 2]])
                    errors[step] = doubt[step] * _sizes(values[step])
                errors[step] = np.maximum(errors[step], gaps[step] * _sizes(values[step]))
            own = presses[first : first + STEPS]
            errors[:, 1] = np.maximum(errors[:, 1], _ripple(own[:, 9], own[0, 6:9], values))
            for step in range(STEPS):
                words = [f"{x:.6g}" for x in values[step]] + [f"{x:.2g}" for x in errors[step]]
                stream.write(",".join([str(first + step), *words]) + "\n")


def _ripple(depth: np.ndarray, normal: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the error of the stiffness (5,) in N/m that its mean shows beside the force's own slope between depths.

    Elements enter the contact one after the other, of which the stiffness tells more than the force.
    """
    slope = np.diff(values[:, :3] @ normal) / np.diff(depth)
    gap = np.abs(slope - (values[1:, 3] + values[:-1, 3]) / 2)
    return np.maximum(np.append(gap, 0.0), np.append(0.0, gap))


def _by_press(
    solves: dict[tuple[int, str, str], np.ndarray], solver: str, element: float
) -> dict[int, np.ndarray]:
    return {key[0]: row for key, row in solves.items() if key[1:] == (solver, f"{element:g}")}


def _sizes(row: np.ndarray) -> np.ndarray:
    """Return the force's size, stiffness and energy (3,) of a row."""
    return np.array([np.linalg.norm(row[:3]), row[3], row[4]])


def _extrapolate(coarse: np.ndarray, finer: np.ndarray) -> np.ndarray:
    """Return a row for elements of size zero, by Richardson's rule for an error of second order."""
    return np.asarray(finer + (finer - coarse) * FINER**2 / (1 - FINER**2))


def _mesh_part(solves: dict[tuple[int, str, str], np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return, by step, what force, stiffness and energy on coarse elements miss (5, 3), relative, and its error.

    It goes with the size of elements over the contact's radius. So a body without a path on finer elements has that of
    the block, all of which counts as an error.
    """
    borrowed = not _by_press(solves, "palpate", FINER * ELEMENT)
    if borrowed:
        solves = read_solves(CASES / "block")
    coarse, finer = (_by_press(solves, "palpate", size) for size in (ELEMENT, FINER * ELEMENT))
    part, doubt = np.zeros((STEPS, 3)), np.zeros((STEPS, 3))
    for step in range(STEPS):
        # a path may have failed on coarse elements alone
        presses = [press for press in finer if press % STEPS == step and press in coarse]
        ends = [_sizes(_extrapolate(coarse[k], finer[k])) for k in presses]
        missing = np.array([end / _sizes(coarse[k]) - 1 for k, end in zip(presses, ends, strict=True)])
        left = np.array([np.abs(end / _sizes(finer[k]) - 1) for k, end in zip(presses, ends, strict=True)])
        part[step] = missing.mean(axis=0)
        doubt[step] = (
            np.abs(missing - part[step]).max(axis=0) + left.max(axis=0) + borrowed * np.abs(part[step])
        )
    return part, doubt


def _solver_gaps(solves: dict[tuple[int, str, str], np.ndarray], paths: list[Path]) -> np.ndarray:
    """Return, by step, the largest difference of the two solvers on one mesh (5, 3), relative; 0 without a rival.

    CalculiX gives forces. Their difference along a path, as a parabola in the depth, has a slope and an integral.
    """
    own, other = _by_press(solves, "palpate", ELEMENT), _by_press(solves, "CalculiX", ELEMENT)
    gaps = np.zeros((STEPS, 3))
    for path in paths:
        steps = [k for k in range(STEPS) if {path.number * STEPS + k} <= own.keys() & other.keys()]
        if len(steps) < 2:
            continue
        ours, theirs = (np.array([rows[path.number * STEPS + k] for k in steps]) for rows in (own, other))
        depth, along = path.depths[steps], (theirs - ours)[:, :3] @ path.normal
        linear, square = np.linalg.lstsq(np.column_stack([depth, depth**2]), along, rcond=None)[0]
        force = np.linalg.norm((theirs - ours)[:, :3], axis=1) / np.linalg.norm(ours[:, :3], axis=1)
        slope = np.abs(linear + 2 * square * depth) / ours[:, 3]
        energy = np.abs(linear * depth**2 / 2 + square * depth**3 / 3) / ours[:, 4]
        gaps[steps] = np.maximum(gaps[steps], np.column_stack([force, slope, energy]))
    return gaps
