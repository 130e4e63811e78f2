"""A ball pressed into a block by a plain NGSolve script that shares no code with palpate: data of a foreign solver.

    python -m benchmarks.foreign_block                learns from each ten, judges by sixty, prints the force errors
    python -m benchmarks.foreign_block --effort 4     with another effort of learning than 1
    python -m benchmarks.foreign_block --element 5    solves them all first with elements of 5 mm in place of 2.5 mm
    python -m benchmarks.foreign_block --solve        solves and writes benchmarks/data/foreign_block.npz, 10 minutes

A block of 60 × 60 × 30 mm of neo-Hookean tissue, 9 kPa, held at its bottom; a ball of radius 10 mm whose pad of
2 MPa/m gives way. Forty presses to learn from, in four tens that each spread over the whole range, and sixty to judge
by, all on an eighth of the top's middle: the block has eight mirror images. `palpate` gets places, energies and forces.
"""

from __future__ import annotations

import argparse
import itertools
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
ELEMENT, COARSE = 2.5e-3, 8e-3  # m, where it is pressed and elsewhere
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


def mesh(element: float) -> Any:
    """Return a mesh with elements of this size in m where the eighth is pressed."""
    import ngsolve
    from netgen.meshing import MeshingParameters
    from netgen.occ import Box, OCCGeometry, Pnt

    box = Box(Pnt(0, 0, 0), Pnt(SIDE, SIDE, HEIGHT))
    box.faces.Min(_axis()).name, box.faces.Max(_axis()).name = "bottom", "top"
    settings = MeshingParameters(maxh=COARSE, grading=0.3)
    for x, y in itertools.product(np.arange(0.024, 0.0461, element), repeat=2):
        settings.RestrictH(x=x, y=y, z=HEIGHT, h=element)
    return ngsolve.Mesh(OCCGeometry(box).GenerateMesh(settings))


def _axis() -> Any:
    from netgen.occ import Z

    return Z


def solve(centres: np.ndarray, element: float = ELEMENT) -> dict[str, np.ndarray]:
    """Return centres (N, 3) of the ball in m, energies (N,) in J and forces (N, 3) on it in N, by their names."""
    import ngsolve as ng

    ng.SetNumThreads(1)
    body = mesh(element)
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
    return {"centre": centres, "energy": energies, "force": forces}


def force_errors(data: dict[str, np.ndarray], ten: int, effort: float = 1.0) -> np.ndarray:
    """Return the relative force errors (60,) of a surrogate learnt from one of the four tens of these touches."""
    from palpate.learning import learn_energy
    from palpate.surrogates import ContactBaseline, ContactLaw, Solves, TouchedSurface
    from palpate.units import Range

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
    baseline = ContactBaseline(ContactLaw("series", RADIUS / 10), surface, RADIUS)
    found = learn_energy(solves, baseline, effort=effort)[0]
    off = np.linalg.norm(found.force(centre[judged]) - force[judged], axis=1)
    return np.asarray(off / np.linalg.norm(force[judged], axis=1))


def main() -> None:
    """Solve where that is asked for, and judge each of the tens."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--solve", action="store_true", help="write the data anew")
    parser.add_argument("--element", type=float, metavar="MM", help="solve with elements of this size")
    parser.add_argument("--effort", type=float, default=1.0, help="of learning")
    wanted = parser.parse_args()
    if wanted.solve:
        np.savez_compressed(FILE, **solve(places()))
    if wanted.element:
        data = solve(places(), wanted.element / 1e3)
    else:
        with np.load(FILE) as stored:
            data = dict(stored)
    for ten in range(TENS):
        errors = 100 * force_errors(data, ten, wanted.effort)
        print(
            f"ten {ten + 1}: median {np.median(errors):.2f} %, 95th percentile {np.quantile(errors, 0.95):.2f} %"
        )


if __name__ == "__main__":
    main()
