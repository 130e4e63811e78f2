"""Quasi-static answers of springs to a probe."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.massspring.state import Energy

if TYPE_CHECKING:
    from benchmarks.massspring.body import MassSpringBody

__all__ = ["MassSpringSolution", "MassSpringSolver"]

NEWTON = 60  # iterations of one step of the path; negative curvature can take many
CUTS = 30  # halvings of a line search
SMALLEST = 1e-3  # of the probe's radius: no shorter step of the path is tried
ARMIJO = 1e-4


@dataclass(frozen=True, eq=False)
class MassSpringSolution:
    """What the springs answered at one position of the probe.

    Attributes
    ----------
    centre : (3,) array
        Of the probe, m.
    displacement : (node, 3) array
        m.
    response : (3,) array
        Force on the probe, −∂U/∂c, N.
    response_gradient : (3, 3) array or None
        ∂F/∂c, N/m, where asked for.
    potential_energy, strain_energy : float
        With and without the pad's share, J.
    penetration : float
        Largest penetration of the pad, m.
    least_volume_ratio : float
        Smallest V/V₀ of the tetrahedra; springs let them turn inside out.
    converged : bool
        Whether this is an equilibrium in which no pressed point has passed the sphere's centre.
    message : str
        Why not, where not.
    iterations, products : int
        Newton iterations and Hessian products of this call.
    mesh : BodyMesh
    probe : SphereProbe
    """

    centre: np.ndarray
    displacement: np.ndarray
    response: np.ndarray
    response_gradient: np.ndarray | None
    potential_energy: float
    strain_energy: float
    penetration: float
    least_volume_ratio: float
    converged: bool
    message: str
    iterations: int
    products: int
    mesh: Any
    probe: Any


class MassSpringSolver:
    """Follows the probe from equilibrium to equilibrium.

    Parameters
    ----------
    body : MassSpringBody
    probe : SphereProbe
        Anything with `radius`, `touches`, `pad` and `stop`.
    tolerance : float
        Residual relative to the force on the probe.
    """

    def __init__(self, body: MassSpringBody, probe: Any, tolerance: float = 1e-6) -> None:
        self.body, self.probe, self.tolerance = body, probe, tolerance
        self.energy = Energy(body.network(), body.pad(probe), body.free())
        # forces far below what one spring bears at a millionth of its length count as none
        network = self.energy.network
        self._least = 1e-9 * float(np.median(network.stiffness * network.lengths))
        self._surface_normal = self._outward()
        self.reset()

    def reset(self) -> None:
        """Back to rest, the probe away."""
        self.x = self.energy.network.points.copy()
        self.centre: np.ndarray | None = None

    def solve(self, centre: Any, *, gradient: bool = False) -> MassSpringSolution:
        """Equilibrium with the probe at `centre` (3,), m, reached along a straight path from the last one.

        From rest the path comes straight down on the touched surface. `gradient` asks for ∂F/∂c as well.
        """
        goal = np.asarray(centre, dtype=float)
        iterations, products, message = 0, 0, ""
        at = self._above(goal) if self.centre is None else self.centre
        step = float(np.linalg.norm(goal - at)) or 1.0
        while True:
            left = float(np.linalg.norm(goal - at))
            trial = goal if step >= left * (1 - 1e-9) else at + (goal - at) * (step / left)
            before = self.x.copy()
            reached, used, spent = self._newton(trial)
            iterations, products = iterations + used, products + spent
            if reached:
                at, step = trial, 1.5 * step
                if trial is goal:
                    break
                continue
            self.x, step = before, min(step, left) / 2
            if step < SMALLEST * self.probe.radius:
                message = "No step along the path, however small, led to an equilibrium."
                break
        self.centre = at
        return self._solution(goal, message, iterations, products, gradient)

    def _newton(self, centre: np.ndarray) -> tuple[bool, int, int]:
        """Minimise at a fixed centre; whether it worked, iterations, products."""
        value, products = self.energy.value(self.x, centre), 0
        if not np.isfinite(value):
            return False, 0, 0
        for iteration in range(NEWTON):
            g = self.energy.gradient(self.x, centre)
            size = float(np.linalg.norm(g))
            pressed = float(np.linalg.norm(self.energy.pad.gradient(self.x, centre).sum(axis=0)))
            target = self.tolerance * pressed + self._least
            if size <= target:
                return True, iteration, products
            tangent = self.energy.tangent(self.x, centre)
            # as exact as the rest of the way to the target deserves
            d, _ = tangent.solve(-g, max(min(0.1, np.sqrt(target / size)), 0.1 * target / size))
            products += tangent.products
            alpha = self._along(d, centre, value, float(np.vdot(g, d)))
            if alpha is None:
                return False, iteration + 1, products
            self.x = self.x + alpha * d
            value = self.energy.value(self.x, centre)
        return False, NEWTON, products

    def _along(self, d: np.ndarray, centre: np.ndarray, value: float, slope: float) -> float | None:
        """Length of a step that lowers the energy enough (Armijo), or None."""
        alpha, slack = 1.0, 1e-14 * abs(value)
        for _ in range(CUTS):
            if self.energy.value(self.x + alpha * d, centre) <= value + ARMIJO * alpha * slope + slack:
                return alpha
            alpha /= 2
        return None

    def _solution(
        self, goal: np.ndarray, message: str, iterations: int, products: int, gradient: bool
    ) -> MassSpringSolution:
        centre = goal if not message else self.centre
        assert centre is not None
        elastic, _ = self.energy.elastic(self.x)
        pad = self.energy.pad
        if not message and self._swallowed(centre):
            message = "Points of the surface have passed the sphere's centre: the sphere is swallowed."
        return MassSpringSolution(
            centre=centre,
            displacement=self.x - self.energy.network.points,
            response=pad.gradient(self.x, centre).sum(axis=0),
            response_gradient=self.stiffness(centre) if gradient and not message else None,
            potential_energy=elastic + pad.energy(self.x, centre),
            strain_energy=elastic,
            penetration=max(float(pad.penetration(self.x, centre).max()), 0.0),
            least_volume_ratio=self._least_volume_ratio(),
            converged=not message,
            message=message,
            iterations=iterations,
            products=products,
            mesh=self.body.mesh,
            probe=self.probe,
        )

    def stiffness(self, centre: np.ndarray) -> np.ndarray:
        """∂F/∂c (3, 3) in N/m at the present state: −(D − Bᵀ K⁻¹ B) with B and D of the pad alone."""
        tangent = self.energy.tangent(self.x, centre)
        nodes, blocks = self.energy.pad.nodes, tangent.blocks
        moved = np.zeros((3, *self.x.shape))
        for j in range(3):
            load = np.zeros_like(self.x)
            load[nodes] = blocks[:, :, j]
            moved[j] = tangent.solve(load, 1e-10)[0]
        answer = np.einsum("mij,kmj->ik", blocks, moved[:, nodes])
        return np.asarray(answer - blocks.sum(axis=0))

    def _swallowed(self, centre: np.ndarray) -> bool:
        """Whether a pressed point has passed the sphere's centre, or the centre lies in a tetrahedron."""
        pad, corners = self.energy.pad, self.x[self.energy.network.tetrahedra]
        pressed = pad.penetration(self.x, centre) > 0
        if np.any((self.x[pad.nodes[pressed]] - centre) @ self._surface_normal > 0):
            return True
        near = np.all((corners.min(axis=1) <= centre) & (centre <= corners.max(axis=1)), axis=1)
        edges = np.moveaxis(corners[near, 1:] - corners[near, :1], 1, 2)
        return bool(np.any(_inside(edges, centre - corners[near, 0])))

    def _least_volume_ratio(self) -> float:
        network = self.energy.network
        corners = self.x[network.tetrahedra]
        return float((np.linalg.det(corners[:, 1:] - corners[:, :1]) / (6 * network.volumes)).min())

    def _outward(self) -> np.ndarray:
        mesh = self.body.mesh
        chosen = mesh.triangles_of(self.probe.touches)
        a, b, c = np.moveaxis(mesh.points[chosen], 1, 0)
        normal = np.cross(b - a, c - a).sum(axis=0)
        return np.asarray(normal / np.linalg.norm(normal))

    def _above(self, goal: np.ndarray) -> np.ndarray:
        """The place straight above `goal` where the probe is clear of the touched points at rest."""
        heights = (self.energy.network.points[self.energy.pad.nodes] - goal) @ self._surface_normal
        clear = max(float(heights.max()) + self.probe.radius, 0.0)
        return np.asarray(goal + clear * self._surface_normal)


def _inside(edges: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """Whether points at `offset` (t, 3) from a corner lie in tetrahedra with edges (t, 3, 3) in columns."""
    shares = np.einsum("tij,tj->ti", np.linalg.pinv(edges), offset)
    return np.asarray(np.all(shares >= 0, axis=1) & (shares.sum(axis=1) <= 1))
