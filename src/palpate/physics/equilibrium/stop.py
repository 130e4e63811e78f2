"""Why a search for an equilibrium ended."""

from __future__ import annotations

from enum import StrEnum

__all__ = ["Stop"]


class Stop(StrEnum):
    """Why a solver stopped."""

    CONVERGED = "converged"
    ITERATION_LIMIT = "the iteration limit was reached before equilibrium"
    STEP_TOO_SMALL = "no step along the load path, however small, led to an equilibrium"
    NOT_FINITE = "the energy or its derivatives are not finite"
    UNSTABLE = "the equilibrium is unstable (the beam buckles): the tangent has a negative direction"
    STRAIN_LIMIT = "the strain is beyond the reach of the material law"
    COARSE_MESH = "one element bends by more than a radian: the load is beyond the reach of this mesh"
    BAD_INPUT = "the loads are not finite numbers"
