"""A field of any physics: temperatures of a plate whose hole is heated, from at most 60 solves.

    python -m benchmarks.heated_plate [--quick] [--json]

A square plate of 100 mm with a hole of 20 mm radius takes the heat flux q through the hole's rim and gives it to air at
293 K along its outer edges, h (T − 293 K). Its conductivity follows the temperature, k (1 + b (T − 293 K)). NGSolve
solves it with quadratic triangles and Newton's method; the four inputs are q, k, b and h. The error is that of each
node in 250 solves that learning has not seen, over the range of the field in these solves. EZyRB, SMT and OpenTURNS
learn the same solves in the same run, those that are installed.
"""

from __future__ import annotations

import sys

import numpy as np
from scipy.stats import qmc

from benchmarks.field_rows import COLUMNS, field_rows, missing_note
from benchmarks.runner import main
from benchmarks.table import Claim, Table, quick_mark
from palpate.surrogates import MeshPlaces
from palpate.units import Range, bounds

__all__ = ["Plate", "tables"]

RANGES = (
    Range("flux", 2e3, 2e4, "W/m²"),
    Range("conductivity", 5.0, 50.0, "W/(m K)"),
    Range("slope", -5e-4, 3e-3, "1/K"),
    Range("convection", 10.0, 100.0, "W/(m² K)"),
)
AIR = 293.0  # K
WANTED = 0.01  # of the range, at the 95th percentile over nodes and unseen solves
_NEWTON, _SMALL = 30, 1e-10  # steps at most, and the relative change at which they end


class Plate:
    """The finite-element model, meshed once."""

    def __init__(self, size: float = 4e-3) -> None:
        from netgen.occ import Circle, OCCGeometry, Rectangle
        from ngsolve import H1, Mesh

        face = Rectangle(0.1, 0.1).Face()
        face.edges.name = "outer"
        hole = Circle((0.05, 0.05), 0.02).Face()
        hole.edges.name = "rim"
        self.mesh = Mesh(OCCGeometry(face - hole, dim=2).GenerateMesh(maxh=size))
        self.mesh.Curve(2)
        self.space = H1(self.mesh, order=2)
        self.points = np.array([v.point for v in self.mesh.vertices])
        self.triangles = np.array([[v.nr for v in e.vertices] for e in self.mesh.Elements()])

    def solve(self, x: np.ndarray) -> np.ndarray:
        """Return the temperature (nodes,) in K at inputs x (4,)."""
        from ngsolve import BilinearForm, GridFunction, InnerProduct, ds, dx, grad

        flux, conductivity, slope, convection = x
        u, v = self.space.TnT()
        form = BilinearForm(self.space)
        form += conductivity * (1.0 + slope * u) * grad(u) * grad(v) * dx
        form += convection * u * v * ds("outer") - flux * v * ds("rim")
        rise = GridFunction(self.space)
        residual, step = rise.vec.CreateVector(), rise.vec.CreateVector()
        for _ in range(_NEWTON):
            form.Apply(rise.vec, residual)
            form.AssembleLinearization(rise.vec)
            step.data = form.mat.Inverse(self.space.FreeDofs()) * residual
            rise.vec.data -= step
            if InnerProduct(step, step) <= _SMALL**2 * InnerProduct(rise.vec, rise.vec):
                return AIR + np.array(rise.vec)[: len(self.points)]
        raise ArithmeticError(f"Newton's method did not end at {x}")


def tables(*, quick: bool = False) -> list[Table]:
    """Return the table; `quick` learns from fewer solves of a coarse mesh."""
    plate = Plate(2e-2 if quick else 4e-3)
    low, high = bounds(RANGES)
    asked = np.random.default_rng(3).uniform(low, high, (20 if quick else 250, len(low)))
    X = qmc.scale(qmc.Sobol(len(low), seed=1).random(64)[:60], low, high)
    truth, solved = (np.array([plate.solve(x) for x in some])[..., None] for some in (asked, X))
    points = np.hstack([plate.points, np.zeros((len(plate.points), 1))])
    places = MeshPlaces(points, plate.triangles)
    rows = [
        row
        for count in ((24,) if quick else (30, 60))
        for row in field_rows(
            *("temperature", "K", RANGES, places, (X[:count], solved[:count]), (asked, truth)),
            rivals=not quick,
        )
    ]
    own = [row["p95"] for row in rows if row["by"] == "palpate"]
    claims = [Claim("error at the 95th percentile from 60 solves", (own[-1],), WANTED, ".2e")]
    title = (
        f"A heated plate with a hole, {len(points):,} nodes, {len(asked)} unseen solves{quick_mark(quick)}"
    )
    notes = () if quick else missing_note()
    return [Table("heated_plate", title, COLUMNS, rows, [] if quick else claims, notes)]


if __name__ == "__main__":
    sys.exit(main(only="heated_plate"))
