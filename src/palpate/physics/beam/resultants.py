"""What a cross-section answers to its strains when it remembers: its protocol, and the elastic stiffnesses.

A section law turns axial strain, shear strain and curvature at the end of a step into section forces. They are the
derivative of an incremental energy per length, so that the equilibrium is a minimum as it is for an elastic beam.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

__all__ = ["SectionAnswer", "SectionLaw"]


class SectionAnswer(NamedTuple):
    """Answer of sections to strains at the end of a step.

    Attributes
    ----------
    energy : (...) array
        Incremental energy in J/m.
    force : (..., 3) array
        N and Q in N, M in N·m.
    tangent : (..., 3, 3) array
        Their derivatives by the strains.
    internal : value
        Internal variables at the end of the step.
    """

    energy: np.ndarray
    force: np.ndarray
    tangent: np.ndarray
    internal: Any


class SectionLaw(Protocol):
    """What a beam asks of a section that remembers."""

    elastic: np.ndarray
    """Elastic (instantaneous) stiffnesses EA and kGA in N, EI in N·m²: shape (3,)."""

    quadratic: bool
    """Whether the incremental energy is quadratic in the strains."""

    def rest(self, shape: tuple[int, ...]) -> Any:
        """Internal variables of virgin sections."""

    def answer(self, strain: np.ndarray, internal: Any, dt: float | None) -> SectionAnswer:
        """Answer to strains (..., 3) after a step of dt seconds from `internal`; None is an instant."""

    def stored(self, strain: np.ndarray, internal: Any) -> np.ndarray:
        """Energy in J/m that can be had back."""

    def dissipated(self, before: Any, after: Any, dt: float | None) -> np.ndarray:
        """Energy in J/m that a step from one set of internal variables to the other took for good, not negative."""
