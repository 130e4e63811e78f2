"""An elastic law that was stretched before it was built in, as skin is: tension at rest, and stiffer to the touch.

A sheet stretched by λ_x and λ_y and free on its faces shrinks to λ_z, where σ_zz = 0. With F₀ = diag(λ_x, λ_y, λ_z) the
body as it is drawn has the energy, per volume of the drawn shape,

    W(F) = [W_base(F F₀) − W_base(F₀)] / det F₀

so F is counted from the tense state, and the touched surface lies where it is drawn (the "deformation gradient of the
natural state", Chuong & Fung 1986, J. Biomech. Eng. 108, 189-192; Rodriguez, Hoger & McCulloch 1994, J. Biomech. 27,
455-467).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.physics.materials.homogeneous import is_incompressible, relax_free
from palpate.physics.materials.material import NO_STATE, MadeFrom, Material
from palpate.physics.materials.tensors import Scalar, Tensor, constant, matmul

__all__ = ["PreStretched"]


@dataclass(frozen=True)
class PreStretched(MadeFrom):
    """The law `base` under a stretch along x and y, with no stress along z.

    Tension must be held: fix the sides of the body. Its moduli are those of the base law at rest; the
    mixed form is not made for it, so keep Poisson's ratio below 0.48.

    Attributes
    ----------
    base : Material
        An elastic law of large strain.
    stretch_x : float
        Stretch λ_x, a pure number; 1 is no stretch.
    stretch_y : float, optional
        Stretch λ_y; λ_x by default.

    Raises
    ------
    UsageError
        If a stretch is not positive, or the base law has a history, small strain or no compressibility.
    """

    base: Material
    stretch_x: float
    stretch_y: float | None = None

    law: ClassVar[str] = "pre-stretched"

    def __post_init__(self) -> None:
        checks.positive("The stretch along x", self.stretch_x, "")
        checks.positive("The stretch along y", self._along[1], "")
        if self.base.states or self.base.kinematics != "large" or is_incompressible(self.base):
            raise UsageError(
                f"{self.base.name} can't be stretched beforehand.",
                why="It has a history, is a law of small strain, or allows no change of volume.",
                fix="Take an elastic law such as NeoHookean(young=9e3, poisson=0.45).",
            )

    @property
    def origin(self) -> Material:
        """The base law."""
        return self.base

    @property
    def _along(self) -> tuple[float, float]:
        return self.stretch_x, self.stretch_x if self.stretch_y is None else self.stretch_y

    @cached_property
    def stretches(self) -> tuple[float, float, float]:
        """λ_x, λ_y and the λ_z at which σ_zz is zero.

        Raises
        ------
        UsageError
            If there is none.
        """
        x, y = self._along
        F, balanced = relax_free(self.base.energy, np.diag([x, y, 1.0])[None], ((2, 2),), small=False)
        if not balanced[0]:
            raise UsageError(
                f"{self.base.name} finds no balance when it is stretched by {x:g} and {y:g}.",
                fix="Stretch it less, or check its constants.",
            )
        return x, y, float(F[0, 2, 2])

    @property
    def name(self) -> str:  # type: ignore[override]
        """Name of the base law and the stretches."""
        return f"{self.base.name} stretched by {' and '.join(f'{s:.4g}' for s in self._along)}"

    @property
    def density(self) -> float:  # type: ignore[override]
        """Density of the drawn shape in kg/m³."""
        return self.origin.density / float(np.prod(self.stretches))

    def distortion(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """Return the energy density beyond that of the stretch, per volume of the drawn shape, in J/m³."""
        before = np.diag(self.stretches)
        rest = float(self.base.energy(before[None])[0])
        return (self.base.energy(matmul(F, constant(before, F))) - rest) / float(np.prod(self.stretches))
