"""A sphere on a block of soft tissue: a sweep beside a plain NGSolve script, and what the mesh does to the force.

python -m benchmarks.touching [--quick] [--json | --markdown]

The time and memory of one Newton iteration over the number of unknowns are measured by `benchmarks.touching_cost`.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.plain_touch import PlainAnswer, PlainTouch, Setting
from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table
from palpate.physics.geometry import Block
from palpate.physics.interactions import SphereProbe
from palpate.physics.materials import NeoHookean
from palpate.physics.solid import Body

__all__ = ["STEP", "block", "middle", "probe", "tables"]

SAMPLES, QUICK_SAMPLES = 256, 4
EVERY = 8  # the rival solves every eighth sample
STEP = (
    5e-4  # m, of the rival: the largest of those tried with which it fails at no more than 1 % of the samples
)
HEIGHT, RADIUS, STOP = 0.05, 0.010, 0.004
POISSONS = (0.45, 0.49, 0.499, 0.4999)
SIZES = (0.010, 0.008, 0.006, 0.004)  # m, elements under the probe
IMPRINT_SIZES = (0.008, 0.006, 0.004)
DEPTHS = (0.001, 0.002, 0.005)
SLIDE = 0.010  # m, more than an element
FORCE = 0.002  # wanted ripple, as a share of the normal force


def block(poisson: float = 0.45, formulation: Any = "auto", *, coarse: float | None = None) -> Body:
    """The benchmark's body."""
    shape = Block((0.10, 0.10, HEIGHT), element=coarse)
    return Body(shape, NeoHookean(9e3, poisson), fixed="bottom", formulation=formulation)


def probe(over: Any = ((0.03, 0.03), (0.07, 0.07)), depth: tuple[float, float] = (0.0, 0.015)) -> SphereProbe:
    """The benchmark's probe: a pad of k = 2e6 N/m³ with a stop at 4 mm."""
    return SphereProbe(RADIUS, touches="top", pad=2e6, stop=STOP, depth=depth, over=over)


def middle() -> SphereProbe:
    """The same probe in the middle of the block only, so that few elements have to be small."""
    return probe(((0.0499, 0.0499), (0.0501, 0.0501)), (0.0, 0.005))


def tables(*, quick: bool = False) -> list[Table]:
    """The tables; `quick` uses coarse meshes, few samples and one size each."""
    return [_sweep_table(quick), _imprint_table(quick), _size_table(quick)]


def _sweep_table(quick: bool) -> Table:
    body, sphere = block(), probe()
    problem = body.problem(sphere, element=0.02 if quick else None)
    points = problem.design(QUICK_SAMPLES if quick else SAMPLES, 0)
    ours = _swept(problem, points)
    chosen = np.arange(0, len(points), 3 if quick else EVERY)
    rivals = {
        "one tolerance": _pressed(problem, points[chosen], Setting()),
        "loose before the last step": _pressed(problem, points[chosen], Setting(between=1e-3)),
    }
    own = ours["seconds"] / len(points)
    rows = [_our_row(ours, own)] + [_rival_row(how, found, own) for how, found in rivals.items()]
    best = min(rows[1:], key=lambda row: row["seconds"])
    return Table(
        "touching-sweep",
        f"Pressing a sphere into a block{' (quick)' if quick else ''}: {len(points)} positions",
        (
            Column("who", "solver"),
            Column("samples", "samples"),
            Column("median", "iterations, median", ".0f"),
            Column("p95", "p95", ".0f"),
            Column("converged", "converged", ".1%"),
            Column("admissible", "admissible", ".1%"),
            Column("seconds", "CPU s / sample", ".2f"),
            Column("rate", "samples / min / core", ".1f"),
            Column("ratio", "palpate is faster by", ".1f"),
        ),
        rows,
        claims=(
            Claim("iterations a sample, median", (rows[0]["median"],), 4, ".0f"),
            Claim("iterations a sample, p95", (rows[0]["p95"],), 10, ".0f"),
            Claim("share of samples without an admissible state", (1 - rows[0]["admissible"],), 0.01, ".1%"),
            Claim("palpate's time over the faster plain script's", (own / best["seconds"],), 0.25, ".2f"),
            Claim("largest difference of the two's forces", (_difference(ours, rivals, chosen),), 1e-4),
        ),
        notes=_sweep_notes(ours["unknowns"], chosen, points),
    )


def _sweep_notes(unknowns: int, chosen: np.ndarray, points: np.ndarray) -> tuple[str, ...]:
    return (
        f"block 100 × 100 × 50 mm, neo-Hookean, E = 9 kPa, ν = 0.45, bottom fixed; R = 10 mm, footprint 40 × 40 mm, "
        f"depth up to 15 mm, pad 2e6 N/m³ with a stop at 4 mm; {unknowns} unknowns",
        "an iteration is a tangent assembled and factorised; palpate also takes cheap steps with the last tangent, "
        "which its time includes",
        f"the script solves every {len(points) // max(1, len(chosen))}th sample, each from the undeformed block in "
        f"load steps of {1e3 * STEP:g} mm, the largest of 1, 0.75, 0.6 and 0.5 mm with which at most 1 % fail",
        "same mesh, law, contact energy, quadrature and tolerance; NGSolve's NewtonSolver with its line search, "
        "sparse Cholesky with the symbolic factorisation kept",
        "times are CPU times, the building of forms and mesh left out; palpate's include energy, force, stiffness and "
        "all checks of a sample",
    )


def _swept(problem: Any, points: np.ndarray) -> dict[str, Any]:
    """Each chain of the sweep's order by one solver, as a worker would do it."""
    solver = problem.open()
    found: list[Any] = [None] * len(points)
    began = time.process_time()
    for chain in problem.chains(points):
        solver.reset()
        for row in chain:
            found[row] = solver.solve(points[row])
    seconds = time.process_time() - began
    return {
        "seconds": seconds,
        "unknowns": found[0].state.size,
        "converged": np.array([s.converged for s in found]),
        "admissible": np.array([_admissible(s) for s in found]),
        "iterations": np.array([s.iterations for s in found]),
        "force": np.array([s.response for s in found]),
    }


def _admissible(solution: Any) -> bool:
    """A check of its own: pushed back, not past the stop, no element turned inside out."""
    return bool(
        solution.converged
        and solution.response[2] >= 0
        and solution.penetration < STOP
        and solution.least_volume_ratio > 0
    )


def _pressed(problem: Any, points: np.ndarray, setting: Setting) -> list[tuple[PlainAnswer, float]]:
    script = PlainTouch(problem.body.geometry.mesh(problem.refinements), setting, STEP)
    found = []
    for point in points:
        began = time.process_time()
        answer = script.solve(point, HEIGHT)
        found.append((answer, time.process_time() - began))
    return found


def _our_row(ours: dict[str, Any], own: float) -> dict[str, Any]:
    return {
        "who": "palpate, in columns",
        "samples": len(ours["converged"]),
        **_spread(ours["iterations"]),
        "converged": float(ours["converged"].mean()),
        "admissible": float(ours["admissible"].mean()),
        "seconds": own,
        "rate": 60 / own,
        "ratio": 1.0,
    }


def _rival_row(how: str, found: Sequence[tuple[PlainAnswer, float]], own: float) -> dict[str, Any]:
    answers, seconds = [a for a, _ in found], float(np.mean([s for _, s in found]))
    return {
        "who": f"plain NGSolve, {how}",
        "samples": len(found),
        **_spread(np.array([a.iterations for a in answers])),
        "converged": float(np.mean([a.converged for a in answers])),
        "admissible": float(np.mean([a.admissible for a in answers])),
        "seconds": seconds,
        "rate": 60 / seconds,
        "ratio": seconds / own,
    }


def _spread(iterations: np.ndarray) -> dict[str, float]:
    return {"median": float(np.median(iterations)), "p95": float(np.quantile(iterations, 0.95))}


def _difference(ours: dict[str, Any], rivals: dict[str, Any], chosen: np.ndarray) -> float:
    """Largest difference over the largest force, where both have an answer."""
    answers = [answer for answer, _ in rivals["one tolerance"]]
    force, scale = ours["force"][chosen], np.nanmax(np.abs(ours["force"]))
    both = [a.admissible and ours["admissible"][row] for a, row in zip(answers, chosen, strict=True)]
    theirs = np.array([a.force for a in answers])
    return float(np.abs(force - theirs)[both].max() / scale) if any(both) else np.nan


def _imprint_table(quick: bool) -> Table:
    sizes, depths = ((0.02,), DEPTHS[-1:]) if quick else (IMPRINT_SIZES, DEPTHS)
    rows = [row for size in sizes for row in _slid(size, depths, 3 if quick else 41)]
    named = [row for row in rows if row["size"] == 1e3 * 0.006]
    return Table(
        "touching-imprint",
        f"What the mesh prints on the force while the sphere slides{' (quick)' if quick else ''}",
        (
            Column("size", "elements under the probe, mm", ".0f"),
            Column("unknowns", "unknowns"),
            Column("depth", "depth, mm", ".0f"),
            Column("force", "normal force, N", ".4f"),
            Column("ripple", "ripple of F_z / F_z, %", ".3f"),
            Column("spurious", "of F_x / F_z, %", ".3f"),
        ),
        rows,
        claims=tuple(
            Claim(
                f"{what} at {row['depth']:.0f} mm, elements of 6 mm, share of F_z",
                (row[key] / 100,),
                FORCE,
                ".2%",
            )
            for row in named
            for key, what in (("ripple", "ripple of F_z"), ("spurious", "spurious F_x"))
        ),
        notes=(
            f"sliding {1e3 * SLIDE:.0f} mm along x in steps of 0.25 mm across the middle of the block, off its planes "
            "of symmetry in y; standard deviation about a parabola (F_z) or a cubic (F_x) over the mean of F_z",
        ),
    )


def _slid(size: float, depths: Sequence[float], places: int) -> list[dict[str, Any]]:
    path = probe(((0.045, 0.053), (0.055, 0.0531)), (0.0, 0.005))
    solver = block().problem(path, element=size).open()
    along = np.linspace(0.045, 0.045 + SLIDE, places)
    rows = []
    for depth in depths:
        solver.reset()
        found = [solver.solve((x, 0.053, HEIGHT + RADIUS - depth)) for x in along]
        force = np.array([solution.response for solution in found])
        mean = force[:, 2].mean()
        rows.append(
            {
                "size": 1e3 * size,
                "unknowns": found[0].state.size,
                "depth": 1e3 * depth,
                "force": float(mean),
                "ripple": float(100 * _off(along, force[:, 2], 2) / mean),
                "spurious": float(100 * _off(along, force[:, 0], 3) / mean),
            }
        )
    return rows


def _off(x: np.ndarray, y: np.ndarray, degree: int) -> float:
    """Standard deviation of y about the polynomial of best fit."""
    scaled = (x - x.mean()) / np.ptp(x)
    return float(np.std(y - np.polyval(np.polyfit(scaled, y, min(degree, len(x) - 1)), scaled)))


def _size_table(quick: bool) -> Table:
    poissons, sizes = ((0.499,), (0.02,)) if quick else (POISSONS, SIZES)
    rows = [_sized(poisson, size) for poisson in poissons for size in sizes]
    fine = {row["poisson"]: row["mixed"] for row in rows}  # the last size of each is the smallest
    for row in rows:
        for form in ("displacement", "mixed"):
            row[f"{form}_off"] = 100 * (row[form] / fine[row["poisson"]] - 1)
    return Table(
        "touching-sizes",
        f"Normal force at 5 mm depth over element size and Poisson's ratio{' (quick)' if quick else ''}",
        (
            Column("poisson", "ν", "g"),
            Column("size", "elements under the probe, mm", ".0f"),
            Column("unknowns", "unknowns"),
            Column("displacement", "displacement P2, N", ".5f"),
            Column("displacement_off", "off by, %", ".2f"),
            Column("mixed", "mixed P2–P1, N", ".5f"),
            Column("mixed_off", "off by, %", ".2f"),
        ),
        rows,
        claims=tuple(
            Claim(
                f"mixed form at {row['size']:.0f} mm, ν = {row['poisson']:g}, off by",
                (abs(row["mixed_off"]) / 100,),
                0.01,
                ".2%",
            )
            for row in rows
            if row["size"] == 1e3 * 0.006
        ),
        notes=(
            "off by: against the mixed form on the smallest elements of the same ν; the unknowns are the mixed form's",
        ),
    )


def _sized(poisson: float, size: float) -> dict[str, Any]:
    """Both forms in the middle of the block; the elements elsewhere shrink along."""
    row: dict[str, Any] = {"poisson": poisson, "size": 1e3 * size}
    for form in ("displacement", "mixed"):
        body = block(poisson, form, coarse=min(2.5 * size, HEIGHT / 3))
        solver = body.problem(middle(), element=size).open()
        solution = solver.solve((0.05, 0.05, HEIGHT + RADIUS - 0.005))
        row[form] = float(solution.response[2]) if solution.converged else np.nan
        row["unknowns"] = solution.state.size
    return row


if __name__ == "__main__":
    sys.exit(main(only="touching"))
