"""J2 plasticity at small strain as an incremental energy.

With ε = sym(F − I), its deviator e and the plastic strain ε_p (deviatoric: flow keeps the volume), the energy of a step
that starts from (ε_p, α) is the least over the plastic strain that may follow (Ortiz & Stainier 1999, Comput. Methods
Appl. Mech. Eng. 171, 419-444). Along the radial return it depends on the trial stress q = √6 G |e − ε_p| alone:

    W = ½ K (tr ε)² + min over Δ ≥ 0 of (q − 3GΔ)²/(6G) + w_p(α + Δ),        w_p(α) = ∫σ_y dα

and Δ solves q − 3GΔ = σ_y(α + Δ) where q > σ_y(α), else it is 0: the return mapping of Wilkins 1964 with the
consistent tangent of Simo & Taylor 1985 (Comput. Methods Appl. Mech. Eng. 48, 101-118), which here is simply the second
derivative.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from palpate.errors import UsageError
from palpate.physics.materials.hardening import Hardening, require_hardening
from palpate.physics.materials.linear import LinearElastic
from palpate.physics.materials.material import (
    NO_STATE,
    MadeFrom,
    Material,
    StateVariable,
    Volumetric,
    in_words,
    initial_state,
)
from palpate.physics.materials.tensors import (
    Scalar,
    Tensor,
    compile_values,
    deviator,
    identity,
    inner,
    scale,
    sqrt,
    sym,
    where,
)

__all__ = ["Plastic"]

_ZERO = ((0.0, 0.0, 0.0),) * 3


@dataclass(frozen=True)
class Plastic(MadeFrom):
    """A linear elastic material that yields by von Mises' rule and hardens isotropically.

    For strains of a few percent without large rotations. The energy counts all plastic work since the virgin state
    beside the elastic energy, so it goes on without a jump when a step's state is kept.

    Attributes
    ----------
    elastic : LinearElastic
        Law that gives moduli and density.
    hardening : Hardening
        For example ``VoceHardening(yield_stress=125e6, saturation=67e6, rate=52)``.
    name, source : str
        Name of the material, and source of the hardening; by default those of the elastic part.

    Raises
    ------
    UsageError
        If the elastic part is no LinearElastic, or the hardening no law of hardening.
    """

    elastic: LinearElastic
    hardening: Hardening
    name: str = ""
    source: str = ""

    law: ClassVar[str] = "J2 plastic"
    kinematics: ClassVar[Literal["large", "small"]] = "small"
    states: ClassVar[tuple[StateVariable, ...]] = (
        StateVariable("plastic_strain", (3, 3), _ZERO),
        StateVariable("accumulated"),
    )

    def __post_init__(self) -> None:
        if not isinstance(self.elastic, LinearElastic):
            raise UsageError(
                f"The elastic part of a plastic material is {self.elastic!r}.",
                why="Plastic flow is a small-strain law here and its elastic part a LinearElastic.",
                fix="Pass LinearElastic(young=110e9, poisson=0.35).",
            )
        require_hardening(self.hardening)
        for key in ("name", "source"):
            object.__setattr__(self, key, getattr(self, key) or getattr(self.elastic, key))

    @property
    def origin(self) -> Material:
        """The elastic law."""
        return self.elastic

    @property
    def volumetric(self) -> Volumetric:
        """½ K (tr ε)², which flow leaves alone: a mixed formulation keeps plastic bodies from locking."""
        return self.elastic.volumetric

    def distortion(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """Elastic energy of the change of shape and plastic work after the step, in J/m³; time plays no part."""
        state = state or initial_state(self, F)
        _, square, trial, flow = self._return(F, state)
        size = trial - 3 * self.shear_modulus * flow
        stored = where(flow, size * size, square) / (6 * self.shear_modulus)
        return stored + self.hardening.work(state["accumulated"] + flow)

    def advance(self, F: Tensor, state: Mapping[str, Any], dt: Any = None) -> dict[str, Any]:
        """Return the plastic strain (..., 3, 3) and accumulated plastic strain (...) after the step."""
        shape, _, trial, flow = self._return(F, state)
        change = scale(3 * self.shear_modulus * flow / trial, shape)
        strain, accumulated = state["plastic_strain"] + change, state["accumulated"] + flow
        return compile_values({"plastic_strain": strain, "accumulated": accumulated})

    def stored_energy(self, F: Tensor, state: Mapping[str, Any]) -> Scalar:
        """Return the elastic energy in J/m³ at F, with the state after the step: what unloading gives back."""
        return self.stored_distortion(F, state) + self.volumetric.energy(F)

    def stored_distortion(self, F: Tensor, state: Mapping[str, Any]) -> Scalar:
        """Return `stored_energy` without the volumetric part, which a mixed formulation writes in its own way."""
        shape = deviator(sym(F - identity(F)) - state["plastic_strain"])
        return self.shear_modulus * inner(shape, shape)

    def dissipated_energy(self, F: Tensor, state: Mapping[str, Any], dt: Any = None) -> Scalar:
        """Return the plastic work of a step from `state` to F in J/m³, never negative."""
        *_, flow = self._return(F, state)
        work = self.hardening.work
        heat = work(state["accumulated"] + flow) - work(state["accumulated"])
        return compile_values({"heat": heat})["heat"]

    def describe(self) -> dict[str, Any]:
        """Return plain data for JSON: the law, its parts and their constants."""
        parts = {"elastic": self.elastic.describe(), "hardening": self.hardening.describe()}
        return {"law": type(self).__name__, **parts, "name": self.name, "source": self.source}

    def __str__(self) -> str:
        """Return the elastic law, yield stress, hardening and source, in words."""
        return in_words(self, f"{self.hardening}")

    def _return(self, F: Tensor, state: Mapping[str, Any]) -> tuple[Tensor, Scalar, Scalar, Scalar]:
        """Elastic trial deviator, q² in Pa², the larger of q and the flow stress, and the plastic increment Δ."""
        shape = deviator(sym(F - identity(F)) - state["plastic_strain"])
        square = 6 * self.shear_modulus**2 * inner(shape, shape)
        limit = self.hardening.flow_stress(state["accumulated"])
        # elastic states don't enter the root, which has no slope at 0
        trial = sqrt(where(square - limit * limit, square, limit * limit))
        flow = self.hardening.increment(trial - limit, 3 * self.shear_modulus, state["accumulated"])
        return shape, square, trial, flow
