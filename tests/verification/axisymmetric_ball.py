"""A rigid ball pressed on the axis of a cylinder in a half-plane of radius and height, by NGSolve alone.

Displacements (u, w) of (r, z) are of order 2, the law is the coupled neo-Hookean one in cylindrical coordinates, and
the bottom is held. Under the ball acts a penalty ½ κ p² dA on p = R − √((r + u)² + (z + w − c)²) > 0. The force is
linear in 1/κ but for a second order, so two penalties give the limit; with κ a/E* of 24 and 96 some 0.05 % are left.
"""

from __future__ import annotations

import math

import ngsolve as ngs
import numpy as np
from netgen.geom2d import SplineGeometry
from ngsolve import grad, sqrt, x, y

ORDER = 2
LADDER = (
    6.0,
    24.0,
    96.0,
)  # penalties κ a/E*: a softer start would let the ball pass through, stiffer ones ripple
FINE, COARSE = (
    0.06,
    0.25,
)  # elements over the ball's radius under it, and over the cylinder's height elsewhere


def mesh_of(width: float, height: float, radius: float) -> ngs.Mesh:
    """Rectangle of 0 … width and 0 … height in m, fine at the upper end of the axis."""
    geometry = SplineGeometry()
    reach = 1.3 * radius
    corners = [(0, 0), (width, 0), (width, height), (reach, height), (0, height)]
    points = [geometry.AppendPoint(*corner) for corner in corners]
    names = ("bottom", "side", "far", "under", "axis")
    for i, name in enumerate(names):
        size = {"maxh": FINE * radius} if name == "under" else {}
        geometry.Append(
            ["line", points[i], points[(i + 1) % 5]], bc=name, leftdomain=1, rightdomain=0, **size
        )
    return ngs.Mesh(geometry.GenerateMesh(maxh=COARSE * height, grading=0.3))


def forces(
    young: float, poisson: float, radius: float, width: float, height: float, depths: list[float]
) -> np.ndarray:
    """Force on the ball in N at each depth in m, from shallow to deep."""
    mu, lame = young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))

    def law(squares, volume):
        return mu / 2 * (squares - 3) - mu * ngs.log(volume) + lame / 2 * ngs.log(volume) ** 2

    scale = young / (1 - poisson**2) / math.sqrt(radius)
    pads = [[rung * scale / math.sqrt(depth) for rung in LADDER] for depth in depths]
    pushes = press(mesh_of(width, height, radius), law, radius, height, depths, pads)
    ratio = LADDER[-1] / LADDER[-2]
    return (ratio * pushes[:, -1] - pushes[:, -2]) / (ratio - 1)


def press(
    mesh: ngs.Mesh, law, radius: float, height: float, depths: list[float], pads: list[list[float]]
) -> np.ndarray:
    """Force in N under each pad in N/m³ at each depth in m below a height, (depth, pad), from shallow to deep.

    `law` gives the energy from the sum of the squares of F's entries and the ratio of volumes.
    """
    free_axis = ngs.H1(mesh, order=ORDER, dirichlet="bottom|axis")
    space = free_axis * ngs.H1(mesh, order=ORDER, dirichlet="bottom")
    (u, w), state = space.TrialFunction(), ngs.GridFunction(space)
    hoop = 1 + u / x
    a, b, c, d = 1 + grad(u)[0], grad(u)[1], grad(w)[0], 1 + grad(w)[1]
    energy = law(a**2 + b**2 + c**2 + d**2 + hoop**2, hoop * (a * d - b * c))
    centre, penalty = ngs.Parameter(0.0), ngs.Parameter(0.0)
    gap = radius - sqrt((x + u) ** 2 + (y + w - centre) ** 2 + 1e-18)
    pressed = ngs.IfPos(gap, penalty / 2 * gap**2, 0)
    form = ngs.BilinearForm(space, symmetric=True)
    form += ngs.Variation((2 * math.pi * x * energy).Compile() * ngs.dx)
    form += ngs.Variation((2 * math.pi * x * pressed).Compile() * ngs.ds("under", bonus_intorder=6))
    answers = []
    for depth, stiffnesses in zip(depths, pads, strict=True):
        centre.Set(height + radius - depth)
        answers.append([])
        for stiffness in stiffnesses:
            penalty.Set(stiffness)
            _equilibrate(form, space, state)
            across, up = state.components
            far = sqrt((x + across) ** 2 + (y + up - centre) ** 2)
            push = ngs.IfPos(radius - far, penalty * (radius - far) * (centre - y - up) / far, 0)
            answers[-1].append(
                ngs.Integrate(2 * math.pi * x * push * ngs.ds("under", bonus_intorder=6), mesh)
            )
    return np.array(answers)


def _equilibrate(form: ngs.BilinearForm, space: ngs.FESpace, state: ngs.GridFunction) -> None:
    """Newton's method, with a step that halves until the energy falls."""
    residual, step, before = (state.vec.CreateVector() for _ in range(3))
    for _ in range(60):
        form.Apply(state.vec, residual)
        form.AssembleLinearization(state.vec)
        step.data = form.mat.Inverse(space.FreeDofs(), "sparsecholesky") * residual
        decrement = ngs.InnerProduct(step, residual)
        energy, before.data, length = form.Energy(state.vec), state.vec, 1.0
        if decrement < 0:  # a negative curvature on the way: the other direction leads down
            step.data = -1.0 * step
        if abs(decrement) < 1e-11 * abs(energy):
            return
        while length > 1e-3:
            state.vec.data = before - length * step
            trial = form.Energy(state.vec)
            if math.isfinite(trial) and trial <= energy + 1e-12 * abs(energy):
                break
            length /= 2
        else:
            raise AssertionError("Newton's method finds no lower energy")
    raise AssertionError("Newton's method has not converged")
