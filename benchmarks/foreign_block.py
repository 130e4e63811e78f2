"""A ball pressed into a block by a plain NGSolve script that shares no code with palpate: data of a foreign solver.

    python -m benchmarks.foreign_block            learns from each ten, judges by sixty and prints the force errors
    python -m benchmarks.foreign_block --solve    solves again and writes benchmarks/data/foreign_block.npz, 10 minutes

A block of 60 × 60 × 30 mm of neo-Hookean tissue, 9 kPa, held at its bottom; a ball of radius 10 mm whose pad of
2 MPa/m gives way. Forty presses to learn from, in four tens that each spread over the whole range, and sixty to judge
by, all on an eighth of the top's middle: the block has eight mirror images. `palpate` gets places, energies and forces.
"""

from __future__ import annotations

import itertools
import sys
from pathlib import Path
from typing import Any

import numpy as np

__all__ = ["force_errors", "places", "solve"]

SIDE, HEIGHT, RADIUS = 0.06, 0.03, 0.010  # m
YOUNG, POISSON = 9e3, 0.45  # Pa, 1
PAD = 2e6  # Pa/m
REACH = 0.010  # m, of the ball's centre from the middle of the top
DEPTHS = (5e-4, 6e-3)  # m
STEP = 2e-3  # m, of a load step
TENS, TEN, JUDGED = 4, 10, 60
FILE = Path(__file__).parent / "data" / "foreign_block.npz"


def places() -> np.ndarray:
    """Centres (N, 3) of the ball in m; those to learn from are four nets of ten."""
    from scipy.stats.qmc import Sobol

    parts = []
    for seed, count in (*((1 + k, TEN) for k in range(TENS)), (1 + TENS, JUDGED)):
        u = Sobol(3, seed=seed).random(64)[:count]
        far, near = np.maximum(u[:, 0], u[:, 1]), np.minimum(u[:, 0], u[:, 1])  # into the eighth
        depth = DEPTHS[0] + (DEPTHS[1] - DEPTHS[0]) * u[:, 2]
        middle = SIDE / 2
        parts.append(np.column_stack([middle + REACH * far, middle + REACH * near, HEIGHT + RADIUS - depth]))
    return np.concatenate(parts)


def mesh() -> Any:
    """Return a mesh that is fine where the eighth is pressed."""
    import ngsolve
    from netgen.meshing import MeshingParameters
    from netgen.occ import Box, OCCGeometry, Pnt

    box = Box(Pnt(0, 0, 0), Pnt(SIDE, SIDE, HEIGHT))
    box.faces.Min(_axis()).name, box.faces.Max(_axis()).name = "bottom", "top"
    settings = MeshingParameters(maxh=0.008, grading=0.3)
    for x in np.arange(0.024, 0.0461, 0.0025):
        for y in np.arange(0.024, 0.0461, 0.0025):
            settings.RestrictH(x=x, y=y, z=HEIGHT, h=0.0025)
    return ngsolve.Mesh(OCCGeometry(box).GenerateMesh(settings))


def _axis() -> Any:
    from netgen.occ import Z

    return Z


def solve(centres: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the energies (N,) in J and the forces (N, 3) in N on the ball at its centres (N, 3) in m."""
    import ngsolve as ng

    ng.SetNumThreads(1)
    body = mesh()
    space = ng.VectorH1(body, order=2, dirichlet="bottom")
    u, shear = space.TrialFunction(), YOUNG / 2 / (1 + POISSON)
    bulk = YOUNG * POISSON / (1 + POISSON) / (1 - 2 * POISSON)
    F = ng.Id(3) + ng.Grad(u)
    J = ng.Det(F)
    stored = shear / 2 * (ng.Trace(F.trans * F) - 3) - shear * ng.log(J) + bulk / 2 * ng.log(J) ** 2
    ball = [ng.Parameter(0.0) for _ in range(3)]
    away = ng.CF(tuple(p + u[i] - ball[i] for i, p in enumerate((ng.x, ng.y, ng.z))))
    gap = RADIUS - ng.sqrt(ng.InnerProduct(away, away))
    touch = ng.BilinearForm(space, symmetric=True)
    whole = ng.BilinearForm(space, symmetric=True)
    pad = ng.Variation((ng.IfPos(gap, PAD / 2 * gap * gap, 0)).Compile() * ng.ds("top", bonus_intorder=8))
    touch += pad
    whole += ng.Variation(stored.Compile() * ng.dx(bonus_intorder=2))
    whole += pad
    state, residual, rigid = ng.GridFunction(space), None, []
    for axis in range(3):
        moved = ng.GridFunction(space)
        moved.Set(ng.CF(tuple(float(axis == i) for i in range(3))), definedon=body.Boundaries("top"))
        rigid.append(moved.vec)
    residual = state.vec.CreateVector()
    energies, forces = np.empty(len(centres)), np.empty((len(centres), 3))
    for row, centre in enumerate(centres):
        state.vec[:] = 0
        depth = HEIGHT + RADIUS - centre[2]
        for share in np.linspace(0, 1, 1 + int(np.ceil(depth / STEP)))[1:]:
            for parameter, value in zip(ball, (*centre[:2], HEIGHT + RADIUS - share * depth), strict=True):
                parameter.Set(value)
            ng.solvers.NewtonMinimization(
                whole, state, inverse="sparsecholesky", maxit=40, maxerr=1e-10, printing=False
            )
        energies[row] = whole.Energy(state.vec)
        touch.Apply(state.vec, residual)
        forces[row] = [ng.InnerProduct(residual, v) for v in rigid]
        print(row, centre, energies[row], forces[row], flush=True)
    return energies, forces


def force_errors(ten: int) -> np.ndarray:
    """Return the relative force errors (60,) of a surrogate learnt from one of the four tens."""
    from palpate.learning import learn_energy
    from palpate.surrogates import ContactBaseline, ContactLaw, Solves, TouchedSurface
    from palpate.units import Range

    with np.load(FILE) as data:
        centre, energy, force = (data[name] for name in ("centre", "energy", "force"))
    learnt, judged = slice(TEN * ten, TEN * (ten + 1)), slice(TENS * TEN, None)
    middle, far = SIDE / 2, 3 * SIDE
    corners = np.array([[-far, -far, HEIGHT], [far, -far, HEIGHT], [far, far, HEIGHT], [-far, far, HEIGHT]])
    surface = TouchedSurface.of(corners, np.array([[0, 1, 2], [0, 2, 3]]), radius=RADIUS)
    top = HEIGHT + RADIUS
    inputs = (
        *(Range(f"c_{axis}", middle - REACH, middle + REACH, "m") for axis in "xy"),
        Range("c_z", top - DEPTHS[1], top - DEPTHS[0], "m"),
    )
    turns = (np.eye(3), np.eye(3)[[1, 0, 2]])
    square = [np.diag([a, b, 1.0]) @ turn for a, b, turn in itertools.product((1, -1), (1, -1), turns)]
    solves = Solves(
        centre[learnt],
        energy[learnt],
        force[learnt],
        None,
        inputs,
        np.array(square),
        np.array([middle, middle, 0.0]),
    )
    found = learn_energy(solves, ContactBaseline(ContactLaw("series", RADIUS / 10), surface, RADIUS))[0]
    off = np.linalg.norm(found.force(centre[judged]) - force[judged], axis=1)
    return np.asarray(off / np.linalg.norm(force[judged], axis=1))


def main() -> None:
    """Solve where that is asked for, else judge each of the tens."""
    if "--solve" in sys.argv:
        centres = places()
        energies, forces = solve(centres)
        np.savez_compressed(FILE, centre=centres, energy=energies, force=forces)
        return
    for ten in range(TENS):
        errors = 100 * force_errors(ten)
        print(
            f"ten {ten + 1}: median {np.median(errors):.2f} %, 95th percentile {np.quantile(errors, 0.95):.2f} %"
        )


if __name__ == "__main__":
    main()
