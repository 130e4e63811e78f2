"""Solution of a solid: a plain value that every solve returns, also where it failed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.dataset import conjugate_unit
from palpate.errors import UsageError
from palpate.format import number, span
from palpate.physics.shapes.mesh import BodyMesh
from palpate.physics.stop import Stop
from palpate.tools.gripper import OPENING
from palpate.units import Range

if TYPE_CHECKING:
    from palpate.physics.interactions.sphere import SphereProbe
    from palpate.physics.solid.solid_field import MidSides
    from palpate.physics.solid.solid_path import LoadStep
    from palpate.tools import Gripper, PosedTool

__all__ = ["SolidSolution"]

ROUNDING = 1e-9  # share of a range's ends by which rounding may carry an input beyond it


@dataclass(frozen=True, eq=False, repr=False)
class SolidSolution:
    """Equilibrium of a solid, or the reason why there is none.

    Attributes
    ----------
    stop : Stop
        Why the solver stopped.
    iterations : int
        Newton iterations (tangents assembled and factorised) over all load steps.
    chords : int
        Cheap steps beside them, each a residual and a back-substitution with a tangent used before.
    residual : float
        √(|rᵀK⁻¹r|/energy): about the relative error left, in the energy norm, with the tangent at the equilibrium.
    log : tuple of LoadStep
        The load steps, also those that were cut back.
    mesh : BodyMesh
        The body at rest.
    ranges : tuple of Range
        Name and unit of each of the n inputs.
    inputs : (n,) array
        Inputs that were asked for.
    displacement : (node, 3) array
        In m at the mesh's vertices. NaN unless converged, as are all the fields below but `state`.
    potential_energy : float
        U in J: the least potential energy less that without the interaction. Of a body with a history after a step
        in time: with the free energy in place of the step's, which for finite viscoelastic strains is an estimate.
    strain_energy : float
        ∫ W dV in J, without the interactions' energies. In an instant the plastic work counts too.
    response : (n,) array
        -∂U/∂q: for a probe's position the force on the probe in N.
    response_gradient : (n, n) array
        ∂response/∂q, symmetric.
    penetration : float
        Largest penetration of a probe's pad in m; 0 where there is none.
    least_volume_ratio : float
        Least det F at the quadrature points, corners and middles of edges of the elements.
    largest_strain : float
        Largest |λ - 1| of a principal stretch λ at the quadrature points; at small strain, of a principal strain.
    stress : (node, 3, 3) array or None
        Cauchy stress in Pa, averaged over the elements around each node, if fields were asked for.
    von_mises : (node,) array or None
        von Mises' equivalent of the Cauchy stress in Pa, if fields were asked for.
    largest_stretch : (node,) array or None
        Largest principal stretch, if fields were asked for.
    detail : str
        Figures that belong to the reason.
    reached : (n,) array
        Inputs of the last equilibrium on the way; those asked, if converged; NaN where there was no way.
    state : (dof,) array
        All unknowns of that equilibrium.
    last_good : SolidSolution or None
        Of a failed solve, that equilibrium: displacement, strains and penetration, and for a body without a history
        the response. It has no energies and no stiffness.
    fixed : tuple of str
        Names of the fixed surfaces.
    probe : SphereProbe or None
        The sphere among the interactions, if there is one.
    centre : (3,) array or None
        Where its centre is, in m.
    tool : PosedTool, Gripper or None
        The tool or gripper among the interactions, if there is one.
    pose : (3 + k,) array or None
        Its place in m, then its angles in rad or its opening in m where they are inputs.
    torque : (3,) array or None
        Torque on a `SurfaceTool` or `Pinch` about its place, in N m; None without one, and unless converged.
    mid_sides : MidSides or None
        Displacements in the middle of the mesh's edges, with which pictures are drawn; None unless converged.
    """

    stop: Stop
    iterations: int
    residual: float
    log: tuple[LoadStep, ...]
    mesh: BodyMesh
    ranges: tuple[Range, ...]
    inputs: np.ndarray
    displacement: np.ndarray
    response: np.ndarray
    response_gradient: np.ndarray
    potential_energy: float = np.nan
    strain_energy: float = np.nan
    penetration: float = np.nan
    least_volume_ratio: float = np.nan
    largest_strain: float = np.nan
    stress: np.ndarray | None = None
    von_mises: np.ndarray | None = None
    largest_stretch: np.ndarray | None = None
    detail: str = ""
    reached: np.ndarray = field(default_factory=lambda: np.empty(0))
    state: np.ndarray = field(default_factory=lambda: np.empty(0))
    chords: int = 0
    last_good: SolidSolution | None = None
    fixed: tuple[str, ...] = ()
    probe: SphereProbe | None = None
    centre: np.ndarray | None = None
    tool: PosedTool | Gripper | None = None
    pose: np.ndarray | None = None
    torque: np.ndarray | None = None
    mid_sides: MidSides | None = None

    @property
    def converged(self) -> bool:
        """True for a stable, admissible equilibrium."""
        return self.stop is Stop.CONVERGED

    @property
    def mid_displacement(self) -> np.ndarray:
        """Displacements (m, 3) in the middles of the edges of the mesh's surface, m; NaN unless converged."""
        if self.mid_sides is None:
            return np.full((len(self.mesh.edges), 3), np.nan)
        size = len(self.mesh.points)
        every, own = (edges @ (size, 1) for edges in (self.mid_sides.edges, self.mesh.edges))
        return np.asarray(self.mid_sides.displacement[np.searchsorted(every, own)])

    @property
    def inside(self) -> bool:
        """True where all inputs are within their ranges; beyond them the mesh may be coarse where it is touched."""
        return not self._beyond()

    def _beyond(self) -> list[str]:
        """Return the inputs outside of their ranges, in words; roundings of an end don't count."""
        beyond = []
        for r, x in zip(self.ranges, self.inputs, strict=True):
            slack = ROUNDING * max(abs(r.low), abs(r.high))
            if not r.low - slack <= x <= r.high + slack:
                beyond.append(f"{r.name} = {number(x, 6)} is not in {span((r.low, r.high), r.unit)}")
        return beyond

    @property
    def message(self) -> str:
        """The reason in words, with its figures."""
        return f"{self.stop} ({self.detail})" if self.detail else str(self.stop)

    @property
    def force(self) -> np.ndarray:
        """The response to the inputs that are lengths, shape (n,): for a probe or tool the force that it feels, in N.

        Raises
        ------
        UsageError
            If an input is neither a length nor an angle of a tool.
        """
        lengths = [r.unit == "m" and r.name != OPENING for r in self.ranges]
        if not all(lengths) and self.torque is None:
            raise UsageError(
                "This solution has no force by itself.",
                why=f"Its inputs are {', '.join(map(str, self.ranges))}; a force belongs to a length.",
                fix="Read response: −∂U/∂input for each input.",
            )
        return self.response[lengths]

    def __str__(self) -> str:
        asked = ", ".join(
            f"{r.name} = {number(x, 6)} {r.unit}" for r, x in zip(self.ranges, self.inputs, strict=True)
        )
        lines = [f"Solid of {len(self.mesh.points)} nodes: {self.message}", f"  inputs       {asked}"]
        if beyond := self._beyond():
            lines.append(f"  beyond range {', '.join(beyond)}: the mesh may be coarse there")
        if self.converged:
            lines += [
                f"  response     {self._responses()}",
                ""
                if self.torque is None
                else f"  torque       {', '.join(number(t) for t in self.torque)} N m",
                f"  energy       {self.potential_energy:.6g} J, {self.strain_energy:.6g} J of it in the body",
                f"  penetration  {1e3 * self.penetration:.3g} mm into the pad" if self.probe else "",
                f"  strain       largest |λ − 1| {self.largest_strain:.3g}, "
                f"least det F {self.least_volume_ratio:.3g}",
            ]
        else:
            at = ", ".join(
                f"{r.name} = {number(x, 6)}"
                for r, x in zip(self.ranges, self.reached, strict=False)
                if np.isfinite(x)
            )
            lines.append(f"  reached      {at or 'nothing'}")
        cost = (
            f"{self.iterations} Newton iterations (+ {self.chords} steps with a reused tangent)"
            f" in {len(self.log)} load steps"
        )
        lines.append(f"  cost         {cost}")
        return "\n".join(line for line in lines if line)

    __repr__ = __str__

    def _responses(self) -> str:
        pairs = zip(self.ranges, self.response, strict=True)
        return ", ".join(f"{number(x, 6)} {conjugate_unit(r.unit)}" for r, x in pairs)

    def plot(self, *args: Any, last: bool = False, **kwargs: Any) -> Any:
        """Draw the deformed body; see `palpate.physics.renderer.plot_solution`.

        With `last` a failed solve's last equilibrium is drawn.
        """
        from palpate.physics.renderer import plot_solution

        return plot_solution(self._shown(last), *args, **kwargs)

    def to_vtu(self, path: Any, *, last: bool = False, **kwargs: Any) -> Any:
        """Write the deformed body as a VTU file, as `plot` draws it; see `palpate.physics.vtu.write_vtu`."""
        from palpate.physics.vtu import write_vtu

        return write_vtu(self._shown(last), path, **kwargs)

    def _shown(self, last: bool) -> SolidSolution:
        return self.last_good if last and self.last_good is not None else self
