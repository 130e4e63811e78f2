"""Why a search for an equilibrium ended."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

__all__ = ["Stop", "Verdict"]


class Stop(StrEnum):
    """Why a solver stopped."""

    CONVERGED = "converged"
    ITERATION_LIMIT = "the iteration limit was reached before equilibrium"
    STEP_TOO_SMALL = "no step along the load path, however small, led to an equilibrium"
    NOT_FINITE = "the energy or its derivatives are not finite"
    UNSTABLE = "the equilibrium is unstable: the tangent has a negative direction, the body would snap away"
    STRAIN_LIMIT = "the strain is beyond the reach of the material law"
    COARSE_MESH = "one element bends by more than a radian: the load is beyond the reach of this mesh"
    ELEMENT_INVERTED = "an element is turned inside out: det F is not positive somewhere in it"
    PAST_STOP = "the surface is pressed past the stop of the pad"
    THROUGH_SURFACE = "the probe has gone through the surface: its centre is on the inner side"
    NO_APPROACH = (
        "no way leads from outside to these inputs: the probe stays in the body, or meets what is held"
    )
    SINGULAR = "the tangent can't be factorised accurately"
    BAD_INPUT = "an input is no finite number"


@dataclass(frozen=True)
class Verdict:
    """Verdict of a check on a state that Newton's method has accepted."""

    stop: Stop = Stop.CONVERGED  # `Stop.CONVERGED`, or why the state is not admissible
    detail: str = ""  # figures that belong to the reason, in words
    figures: Mapping[str, float] = field(default_factory=dict)  # such as {"penetration": 1e-3}
