"""A sphere on a block of soft tissue: a sweep in columns beside a plain NGSolve script.

python -m benchmarks.touching [--quick] [--json]

What the mesh does to the force is measured by `benchmarks.touching_mesh`, what pads and springs do to it by
`benchmarks.touching_feel`, time and memory over the number of unknowns by `benchmarks.touching_cost`.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.plain_touch import PlainAnswer, PlainTouch, Setting
from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark
from benchmarks.touching_check import Inspection, Inspector
from palpate.physics.interactions import SphereProbe
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block
from palpate.physics.solid import Body

__all__ = ["HEIGHT", "RADIUS", "STEP", "STOP", "block", "probe", "stratified", "tables"]

SAMPLES, STRATA, TIGHT = (
    256,
    12,
    3,
)  # the rival solves one sample of each stratum, and every third of them tightly
STEP = 1e-3  # m, of the rival: `benchmarks.plain_touch` finds it
HEIGHT, RADIUS, STOP = 0.05, 0.010, 0.004


def block(poisson: float = 0.45, formulation: Any = "auto", *, coarse: float | None = None) -> Body:
    """The benchmark's body."""
    shape = Block((0.10, 0.10, HEIGHT), element=coarse)
    return Body(shape, NeoHookean(9e3, poisson), fixed="bottom", formulation=formulation)


def probe(over: Any = ((0.03, 0.03), (0.07, 0.07)), depth: tuple[float, float] = (0.0, 0.015)) -> SphereProbe:
    """The benchmark's probe: a pad of k = 2e6 N/m³ with a stop at 4 mm."""
    return SphereProbe(RADIUS, touches="top", pad=2e6, stop=STOP, depth=depth, over=over)


@dataclass(frozen=True)
class Swept:
    """All samples as palpate solved them.

    Attributes
    ----------
    solutions : list of SolidSolution
    seconds : (N,) array
        CPU time of each.
    checks : list of Inspection
    residual : (N,) array
        Norm of the plain script's residual at palpate's states over that of its contact forces.
    force : (N,) array
        Difference of the plain script's force there and palpate's, over the largest force of all.
    """

    solutions: list[Any]
    seconds: np.ndarray
    checks: list[Inspection]
    residual: np.ndarray
    force: np.ndarray

    @property
    def admissible(self) -> np.ndarray:
        """Bool of shape (N,)."""
        pairs = zip(self.solutions, self.checks, self.residual, strict=True)
        return np.array([_pushes(s) and c.admissible(STOP) and r < 1e-6 for s, c, r in pairs])

    def counts(self, name: str) -> np.ndarray:
        """Sum of `iterations` or `chords` over the load steps of each sample, shape (N,)."""
        return np.array([sum(getattr(step, name) for step in s.log) for s in self.solutions])


def _pushes(solution: Any) -> bool:
    return bool(solution.converged and solution.response[2] >= 0)


def tables(*, quick: bool = False) -> list[Table]:
    """The table; `quick` solves one short column on a coarse mesh."""
    sphere = probe(((0.0499, 0.0499), (0.0501, 0.0501)), (0.0, 0.004)) if quick else probe()
    problem = block().problem(sphere, element=0.02 if quick else None)
    points = problem.design(3 if quick else SAMPLES, 0)
    ours = _swept(problem, points)
    chosen = stratified(points[:, 2], 2 if quick else STRATA)
    some = chosen[:: 2 if quick else TIGHT]
    rivals = {
        "loose before the last step": (chosen, _pressed(problem, points[chosen], Setting(between=1e-3))),
        "one tolerance": (some, _pressed(problem, points[some], Setting())),
    }
    return [_table(ours, rivals, points, quick_mark(quick))]


def _table(ours: Swept, rivals: dict[str, Any], points: np.ndarray, mark: str) -> Table:
    own = float(ours.seconds.mean())
    rows = [_our_row(ours), *(_rival_row(how, found, own) for how, (_, found) in rivals.items())]
    best = min(row["seconds"] for row in rows[1:])
    return Table(
        "touching-sweep",
        f"Pressing a sphere into a block{mark}: {len(points)} positions",
        (
            Column("who", "solver"),
            Column("samples", "samples"),
            Column("median", "tangents, median", ".0f"),
            Column("p95", "p95", ".0f"),
            Column("most", "most", ".0f"),
            Column("chords", "chord steps, median", ".0f"),
            Column("chords_p95", "p95", ".0f"),
            Column("stiffness", "tangents for the stiffness"),
            Column("converged", "converged", ".1%"),
            Column("admissible", "admissible", ".1%"),
            Column("seconds", "CPU s / sample", ".2f"),
            Column("rate", "samples / min / core", ".1f"),
            Column("ratio", "palpate is faster by", ".1f"),
        ),
        rows,
        claims=_claims(ours, rows[0], own / best, _difference(ours, rivals)),
        notes=_notes(ours, rivals, points),
    )


def _claims(ours: Swept, row: dict[str, Any], share: float, difference: float) -> tuple[Claim, ...]:
    false = float(np.mean([s.converged for s in ours.solutions] & ~ours.admissible))
    return (
        Claim("iterations a sample (tangents on the way), median", (row["median"],), 4, ".0f"),
        Claim("iterations a sample (tangents on the way), p95", (row["p95"],), 10, ".0f"),
        Claim("share of samples without an admissible state", (1 - row["admissible"],), 0.01, ".1%"),
        Claim("share of samples called converged, but not admissible", (false,), 0.0, ".1%"),
        Claim("palpate's time over the faster plain script's", (share,), 0.25, ".3f"),
        Claim("the plain script's residual at palpate's states", (float(np.nanmax(ours.residual)),), 1e-6),
        Claim("its force there, off by, of the largest force", (float(np.nanmax(ours.force)),), 1e-8),
        Claim("its own answer's force, off by, of the largest force", (difference,), 1e-6),
    )


def _notes(ours: Swept, rivals: dict[str, Any], points: np.ndarray) -> tuple[str, ...]:
    chosen, answers = next(iter(rivals.values()))
    same = float(np.mean([s for _, s in answers]) / ours.seconds[chosen].mean())
    checks = ours.checks
    total = ours.counts("iterations") + ours.counts("chords") + 1
    return (
        "block 100 × 100 × 50 mm, neo-Hookean, E = 9 kPa, ν = 0.45, bottom fixed; R = 10 mm, probe over 40 × 40 mm, "
        "depth up to 15 mm, pad 2e6 N/m³ with a stop at 4 mm; "
        f"{ours.solutions[0].state.size} unknowns; `design({len(points)}, seed=0)`",
        "a tangent is assembled and factorised; a chord step takes a residual and a back-substitution with the last "
        "tangent; palpate factorises one tangent more at the equilibrium, for the stiffness and the next prediction. "
        f"All three together: median {np.median(total):.0f}, p95 {np.quantile(total, 0.95):.0f}, most {total.max()}",
        "times are CPU times, the building of forms and mesh left out; palpate's include energy, force, stiffness and "
        "all its checks, the script's only its solve, the force and its check",
        f"the script solves {len(chosen)} samples, one of each stratum of depth, drawn by seed 0, and with one "
        f"tolerance every {TIGHT}rd of them, each from the undeformed block in load steps of {1e3 * STEP:g} mm, begun "
        "anew with half as large ones where that fails; same mesh, law, contact energy, quadrature and tolerance; "
        "NGSolve's NewtonSolver with its line search, sparse Cholesky with the symbolic factorisation kept. "
        f"On the same {len(chosen)} samples palpate is faster by {same:.1f}",
        "admissible: det F > 0 at 35 points of each element, all of the surface short of the stop and, where pressed, "
        "facing the sphere's centre, the centre outside, F_z ≥ 0, and the script's residual there below 1e-6 of the "
        f"contact forces. Least det F {min(c.volume_ratio for c in checks):.3f}, largest penetration "
        f"{1e3 * max(c.penetration for c in checks):.2f} mm, least cosine {min(c.facing for c in checks):.2f}",
    )


def stratified(heights: np.ndarray, strata: int = STRATA) -> np.ndarray:
    """One row of each of so many groups of equal size in depth, drawn at random, shape (strata,)."""
    random = np.random.default_rng(0)
    return np.array([random.choice(rows) for rows in np.array_split(np.argsort(-heights), strata)])


def _swept(problem: Any, points: np.ndarray) -> Swept:
    """Each chain of the sweep's order by one solver, as a worker would do it."""
    solver = problem.open()
    found: list[Any] = [None] * len(points)
    seconds = np.zeros(len(points))
    for chain in problem.chains(points):
        solver.reset()
        for row in chain:
            began = time.process_time()
            found[row] = solver.solve(points[row])
            seconds[row] = time.process_time() - began
    return _judged(problem, found, seconds)


def _judged(problem: Any, found: list[Any], seconds: np.ndarray) -> Swept:
    mesh = problem.body.geometry.mesh(problem.refinements)
    inspector, script = Inspector(mesh, "top", RADIUS), PlainTouch(mesh, Setting(), STEP)
    balances = [script.balance(s.state, s.inputs) for s in found]
    force = np.array([abs(b.force - s.response).max() for b, s in zip(balances, found, strict=True)])
    return Swept(
        found,
        seconds,
        [inspector.inspect(s.state, s.inputs) for s in found],
        np.array([b.residual for b in balances]),
        force / max(np.abs(b.force).max() for b in balances),
    )


def _pressed(problem: Any, points: np.ndarray, setting: Setting) -> list[tuple[PlainAnswer, float]]:
    script = PlainTouch(problem.body.geometry.mesh(problem.refinements), setting, STEP)
    found = []
    for point in points:
        began = time.process_time()
        answer = script.solve(point, HEIGHT)
        found.append((answer, time.process_time() - began))
    return found


def _our_row(ours: Swept) -> dict[str, Any]:
    own, chords = float(ours.seconds.mean()), ours.counts("chords")
    return {
        "who": "palpate, in columns",
        "samples": len(ours.solutions),
        **_spread(ours.counts("iterations")),
        "chords": float(np.median(chords)),
        "chords_p95": float(np.quantile(chords, 0.95)),
        "stiffness": 1,
        "converged": float(np.mean([s.converged for s in ours.solutions])),
        "admissible": float(ours.admissible.mean()),
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
    return {
        "median": float(np.median(iterations)),
        "p95": float(np.quantile(iterations, 0.95)),
        "most": float(iterations.max()),
    }


def _difference(ours: Swept, rivals: dict[str, Any]) -> float:
    """Largest difference over the largest force, where both have an answer."""
    pairs = [(row, a) for chosen, found in rivals.values() for row, (a, _) in zip(chosen, found, strict=True)]
    force = np.array([s.response for s in ours.solutions])
    off = [np.abs(a.force - force[row]).max() for row, a in pairs if a.admissible and ours.admissible[row]]
    return float(max(off) / np.nanmax(np.abs(force))) if off else np.nan


if __name__ == "__main__":
    sys.exit(main(only="touching"))
