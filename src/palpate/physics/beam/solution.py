"""What a solve returns: always a value, also where it failed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.physics.equilibrium.stop import Stop

__all__ = ["Solution"]


@dataclass(frozen=True)
class Solution:
    """Equilibrium of a beam, or the reason why there is none.

    Attributes
    ----------
    stop : Stop
        Why the solver stopped.
    iterations : int
        Newton iterations spent, over all load steps.
    residual : float
        √(Newton decrement / energy): about the relative error left, in the energy norm.
    displacement : (node, 3) array
        u_x and u_y in m and the rotation in rad, counter-clockwise, at the mesh's vertices. NaN unless
        converged, as are all the fields below.
    root_reaction : (3,) array
        Force (x, y) in N and moment in N·m that the clamp exerts on the beam.
    strain_energy, potential_energy : float
        In J; the potential energy is the strain energy, that is what can be had back, less the work potential of loads
        and weight.
    largest_strain : float
        Largest strain of a fibre along the beam, |ε| + |κ| times the section's half height: what tells whether a
        linear elastic material could bear the load.
    detail : str
        Figures that belong to the reason.
    state : (dof,) array
        All unknowns, for a warm start.
    time : float
        In s, of a beam that follows a history; else NaN.
    dissipated : float
        Energy in J lost for good since the virgin beam: plastic work, or what dashpots took. The work of loads and
        weight is strain energy plus this.
    history : value
        All that the future of a beam that remembers depends on, to march on from; else None.
    """

    stop: Stop
    iterations: int
    residual: float
    displacement: np.ndarray
    root_reaction: np.ndarray
    strain_energy: float
    potential_energy: float
    largest_strain: float = np.nan
    detail: str = ""
    state: np.ndarray = field(default_factory=lambda: np.empty(0), repr=False)
    time: float = np.nan
    dissipated: float = 0.0
    history: Any = field(default=None, repr=False)

    @property
    def converged(self) -> bool:
        """Whether this is a stable equilibrium within the model's reach."""
        return self.stop is Stop.CONVERGED

    @property
    def message(self) -> str:
        """The reason in words, with its figures."""
        return f"{self.stop} ({self.detail})" if self.detail else str(self.stop)
