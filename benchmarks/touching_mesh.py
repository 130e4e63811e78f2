"""What the mesh does to the force of a touch: its imprint while the sphere slides, and convergence over its size.

python -m benchmarks.touching_mesh [--quick] [--json]
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark
from benchmarks.touching import HEIGHT, RADIUS, block, probe

__all__ = ["tables"]

POISSONS = (0.45, 0.49, 0.499, 0.4999)
SIZES = (0.010, 0.0075, 0.005, 0.0035)  # m, elements under the probe
DEFAULT = 0.005  # m, 0.5 R
IMPRINT_SIZES = (0.0075, 0.006, DEFAULT)
DEPTHS = (0.001, 0.002, 0.005)
DEPTH = 0.005
START, SLIDE, ASIDE = (
    0.045,
    0.010,
    0.053,
)  # m: from x, by more than an element, at y off the planes of symmetry
PLACES = 31
WANTED = 0.002  # ripple and spurious force, as a share of the normal force


def tables(*, quick: bool = False) -> list[Table]:
    """The tables; `quick` uses coarse meshes, few places and one size each."""
    return [_imprint_table(quick), _size_table(quick)]


def _imprint_table(quick: bool) -> Table:
    sizes, depths = ((0.025,), DEPTHS[1:2]) if quick else (IMPRINT_SIZES, DEPTHS)
    rows = [row for size in sizes for row in _slid(size, depths, 3 if quick else PLACES)]
    named = [row for row in rows if row["size"] == 1e3 * DEFAULT]
    return Table(
        "touching-imprint",
        f"What the mesh prints on the force while the sphere slides{quick_mark(quick)}",
        (
            Column("size", "elements under the probe, mm", "g"),
            Column("unknowns", "unknowns"),
            Column("depth", "depth, mm", ".0f"),
            Column("force", "F_z, N", ".4f"),
            Column("ripple", "ripple of F_z / F_z, %", ".3f"),
            Column("largest", "largest, %", ".3f"),
            Column("spurious", "spurious F_x / F_z, %", ".3f"),
            Column("spurious_largest", "largest, %", ".3f"),
            Column("stiffness", "∂F_z/∂c_z, N/m", ".1f"),
            Column("stiffness_ripple", "its ripple, %", ".3f"),
        ),
        rows,
        claims=tuple(
            Claim(f"{what} at {row['depth']:.0f} mm, default mesh", (row[key] / 100,), WANTED, ".3%")
            for row in named
            for key, what in (("ripple", "ripple of F_z"), ("spurious", "spurious F_x"))
        ),
        notes=(
            f"sliding {1e3 * SLIDE:.0f} mm along x in steps of a third of a millimetre across the middle of the block, "
            "off its planes of symmetry; 5 mm is the default mesh that is fine under all of it, the others are fine "
            "along the path only",
            "ripple: standard deviation about a parabola (F_z, stiffness) or a cubic (F_x), over the mean; largest: "
            "the largest deviation instead",
        ),
    )


def _slid(size: float, depths: Sequence[float], places: int) -> list[dict[str, Any]]:
    along = np.linspace(START, START + SLIDE, places)
    path = probe(((along[0], ASIDE), (along[-1], ASIDE + 1e-4)), (0.0, DEPTH))
    solver = (
        block()
        .problem(probe() if size == DEFAULT else path, element=None if size == DEFAULT else size)
        .open()
    )
    rows = []
    for depth in depths:
        solver.reset()
        found = [solver.solve((x, ASIDE, HEIGHT + RADIUS - depth)) for x in along]
        force = np.array([solution.response for solution in found])
        stiffness = np.array([solution.response_gradient[2, 2] for solution in found])
        mean = 0.01 * force[:, 2].mean()  # so that what is over it is in percent
        normal, sideways = _deviation(along, force[:, 2], 2), _deviation(along, force[:, 0], 3)
        rows.append(
            {
                "size": 1e3 * size,
                "unknowns": found[0].state.size,
                "depth": 1e3 * depth,
                "force": float(100 * mean),
                "ripple": float(normal.std() / mean),
                "largest": float(abs(normal).max() / mean),
                "spurious": float(sideways.std() / mean),
                "spurious_largest": float(abs(sideways).max() / mean),
                "stiffness": float(stiffness.mean()),
                "stiffness_ripple": float(
                    100 * _deviation(along, stiffness, 2).std() / abs(stiffness.mean())
                ),
            }
        )
    return rows


def _deviation(x: np.ndarray, y: np.ndarray, degree: int) -> np.ndarray:
    """Values (n,) less the polynomial of best fit."""
    scaled = (x - x.mean()) / np.ptp(x)
    deviation: np.ndarray = y - np.polyval(np.polyfit(scaled, y, min(degree, len(x) - 1)), scaled)
    return deviation


def _size_table(quick: bool) -> Table:
    poissons, sizes = ((0.499,), (0.025,)) if quick else (POISSONS, SIZES)
    rows = [_sized(poisson, size, 0.002 if quick else DEPTH) for poisson in poissons for size in sizes]
    fine = {row["poisson"]: row["mixed"] for row in rows}  # the last size of each is the smallest
    for row in rows:
        for form in ("displacement", "mixed"):
            row[f"{form}_off"] = 100 * (row[form] / fine[row["poisson"]] - 1)
    return Table(
        "touching-sizes",
        f"Normal force at 5 mm depth over element size and Poisson's ratio{quick_mark(quick)}",
        (
            Column("poisson", "ν", "g"),
            Column("size", "elements under the probe, mm", "g"),
            Column("unknowns", "unknowns"),
            Column("displacement", "displacement P2, N", ".5f"),
            Column("displacement_off", "off by, %", ".2f"),
            Column("mixed", "mixed P2–P1, N", ".5f"),
            Column("mixed_off", "off by, %", ".2f"),
        ),
        rows,
        claims=tuple(
            Claim(
                f"mixed form at 5 mm, ν = {row['poisson']:g}, off by",
                (abs(row["mixed_off"]) / 100,),
                0.01,
                ".2%",
            )
            for row in rows
            if row["size"] == 1e3 * DEFAULT
        ),
        notes=(
            "off by: against the mixed form on the smallest elements of the same ν; the unknowns are the mixed form's; "
            "elements elsewhere are up to 2.5 times as large and shrink along",
        ),
    )


def _sized(poisson: float, size: float, depth: float) -> dict[str, Any]:
    """Both forms in the middle of the block, where few elements have to be small."""
    row: dict[str, Any] = {"poisson": poisson, "size": 1e3 * size}
    middle = probe(((0.0499, 0.0499), (0.0501, 0.0501)), (0.0, depth))
    for form in ("displacement", "mixed"):
        body = block(poisson, form, coarse=min(2.5 * size, HEIGHT / 2))
        solution = body.problem(middle, element=size).solve((0.05, 0.05, HEIGHT + RADIUS - depth))
        row[form] = float(solution.response[2])
        row["unknowns"] = solution.state.size
    return row


if __name__ == "__main__":
    sys.exit(main(only="touching_mesh"))
