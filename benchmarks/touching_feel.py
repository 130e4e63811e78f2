"""What else is felt: the pad in series with the body, and what springs make of the same body.

python -m benchmarks.touching_feel [--quick] [--json]
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.massspring import MassSpringBody, MassSpringMotion
from benchmarks.runner import main
from benchmarks.table import Column, Table, quick_mark
from benchmarks.touching import HEIGHT, RADIUS, block, probe
from palpate.physics.interactions import pad_share

__all__ = ["tables"]

DEPTHS = (0.002, 0.005, 0.010)
PAD_DEPTHS = (0.001, 0.002, 0.005, 0.010)
MOVE = 1e-4  # m: what a hand at 0.1 m/s goes in a millisecond
MOVES = 20


def tables(*, quick: bool = False) -> list[Table]:
    """The tables; `quick` uses a coarse mesh and one shallow touch."""
    return [_spring_table(quick), _pad_table(quick)]


def _spring_table(quick: bool) -> Table:
    rows, motion = _sprung(0.025 if quick else None, DEPTHS[:1] if quick else DEPTHS)
    return Table(
        "touching-springs",
        f"Points and springs on the same mesh, beside finite elements{quick_mark(quick)}",
        (
            Column("depth", "depth, mm", ".0f"),
            Column("force", "finite elements: F_z, N", ".4f"),
            Column("seconds", "CPU s", ".2f"),
            Column("springs", "springs and volumes: F_z, N", ".4f"),
            Column("springs_off", "off by, %", ".1f"),
            Column("springs_query", "ms a query", ".1f"),
            Column("bare", "springs alone: F_z, N", ".4f"),
            Column("bare_off", "off by, %", ".1f"),
            Column("bare_query", "ms a query", ".1f"),
        ),
        rows,
        notes=(
            f"in the middle of the block, {motion['nodes']} vertices, on the study's default mesh; springs have a "
            "point per vertex, the elements are quadratic; depths one after the other",
            f"a query: the equilibrium after a move of {1e3 * MOVE:g} mm, down and up in turn, the mean of {MOVES}; "
            "the elements' time is that of coming from the depth before, with stiffness and checks",
            f"an explicit time step of springs and volumes at {motion['depth']:.0f} mm costs "
            f"{motion['explicit']:.2f} ms and may be {motion['longest']:.2f} ms long, an implicit one of 1 ms "
            f"costs {motion['implicit']:.1f} ms",
            "–: no equilibrium was found, or one with the sphere swallowed",
        ),
    )


def _sprung(element: float | None, depths: tuple[float, ...]) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    body, sphere = block(), probe()
    problem = body.problem(sphere, element=element)
    mesh = problem.mesh
    material = replace(body.material[0][1], density=1000.0)  # only time steps ask for it
    nets = {
        name: MassSpringBody(mesh, material, fixed="bottom", volume=volume).open(sphere)
        for name, volume in (("springs", True), ("bare", False))
    }
    solver = problem.open()
    solver.solve((0.05, 0.05, HEIGHT + RADIUS + 0.001))  # off the body: what is done once is left out
    rows: list[dict[str, Any]] = []
    for depth in depths:
        place = np.array((0.05, 0.05, HEIGHT + RADIUS - depth))
        began = time.process_time()
        force = float(solver.solve(place).response[2])
        row = {"depth": 1e3 * depth, "force": force, "seconds": time.process_time() - began}
        for name, net in nets.items():
            row |= _asked(net, name, place, force)
        rows.append(row)
    costs = MassSpringMotion(nets["springs"]).costs(place)
    motion = {
        "nodes": len(mesh.points),
        "depth": 1e3 * depths[-1],
        "explicit": 1e3 * costs.explicit_seconds,
        "implicit": 1e3 * costs.implicit_seconds,
        "longest": 1e3 * costs.explicit_longest,
    }
    return rows, motion


def _asked(net: Any, name: str, place: np.ndarray, force: float) -> dict[str, float]:
    """Force of springs, how far off it is, and the time of small moves from there."""
    found = net.solve(place)
    if not found.converged:
        return {name: np.nan, f"{name}_off": np.nan, f"{name}_query": np.nan}
    began = time.process_time()
    for i in range(MOVES):
        net.solve(place - (0.0, 0.0, MOVE * ((i + 1) % 2)))  # down and up again
    spent = time.process_time() - began
    own = float(found.response[2])
    return {name: own, f"{name}_off": 100 * (own / force - 1), f"{name}_query": 1e3 * spent / MOVES}


def _pad_table(quick: bool) -> Table:
    rows = [
        _shared(0.025 if quick else None, depth, quick)
        for depth in (PAD_DEPTHS[1:2] if quick else PAD_DEPTHS)
    ]
    return Table(
        "touching-pad",
        f"What the pad takes{quick_mark(quick)}: shares of a change of ln k",
        (
            Column("depth", "depth, mm", ".0f"),
            Column("force", "F_z at k, N", ".4f"),
            Column("d_force", "d ln F/d ln k", ".3f"),
            Column("share", "share of the compliance", ".3f"),
            Column("force_10", "F_z at 10 k, N", ".4f"),
            Column("d_force_10", "d ln F/d ln k", ".3f"),
            Column("share_10", "share of the compliance", ".3f"),
        ),
        rows,
        notes=(
            "in the middle of the block, k = 2e6 N/m³, stop at 4 mm, elements of 6 mm under the probe; share of the "
            "compliance: d ln (∂F/∂c along the force)/d ln k, which it is for springs in series",
        ),
    )


def _shared(element: float | None, depth: float, quick: bool) -> dict[str, float]:
    middle = probe(((0.0499, 0.0499), (0.0501, 0.0501)), (0.0, depth))
    place = (0.05, 0.05, HEIGHT + RADIUS - depth)
    row = {"depth": 1e3 * depth}
    for mark, factor in (("", 1),) if quick else (("", 1), ("_10", 10)):
        problem = block().problem(replace(middle, pad=factor * middle.pad), element=element)
        share = pad_share(problem, place)
        row[f"force{mark}"] = float(problem.solve(place).response[2])
        row |= {f"d_force{mark}": share.force, f"share{mark}": share.stiffness}
    return row


if __name__ == "__main__":
    sys.exit(main(only="touching_feel"))
