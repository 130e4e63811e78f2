"""Viscoelasticity of any strain over any elastic law, as an incremental energy.

Finite linear viscoelasticity (Taylor, Pister & Goudreau 1970, Int. J. Numer. Methods Eng. 2, 45-59; Simo 1987, Comput.
Methods Appl. Mech. Eng. 60, 153-173; Govindjee & Simo 1992, J. Mech. Phys. Solids 40, 213-233; Holzapfel 1996, Int. J.
Numer. Methods Eng. 39, 3903-3926): each Prony term carries an overstress H_i of its own,

    S = γ_∞ S_0 + Σ H_i,     Ḣ_i + H_i/τ_i = γ_i Ṡ_0,     S_0 = 2 ∂W/∂C = F⁻¹ ∂W/∂F,

with W the part of the elastic law's energy that relaxes. If S_0 grows evenly over a step of length Δ, the update is

    H_i ← e_i H_i + γ_i a_i (S_0 − S_0,old),     e_i = exp(−Δ/τ_i),     a_i = (1 − e_i) τ_i/Δ,

and the stress at the step's end is the gradient of the incremental energy

    (γ_∞ + Σ γ_i a_i) W(F) + M : ½(FᵀF − I) + volumetric part,     M = Σ e_i H_i − γ_i a_i S_0,old,

as M is constant during the step. A law of small strain has ε in place of ½(FᵀF − I). The relaxed law, and the
instantaneous one of a relaxed law, are the base law `Scaled`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, TypeAlias

from palpate import checks
from palpate.errors import UsageError
from palpate.physics.materials.material import (
    NO_STATE,
    MadeFrom,
    Material,
    ShearAndBulk,
    StateVariable,
    Volumetric,
    in_words,
)
from palpate.physics.materials.prony import PronySeries, dashpot_loss, spring_energy
from palpate.physics.materials.tensors import (
    Scalar,
    Tensor,
    compile_values,
    gradient,
    identity,
    inner,
    inverse,
    matmul,
    scale,
    sym,
    transpose,
)

__all__ = [
    "Scaled",
    "Viscoelastic",
]

Part: TypeAlias = Literal["distortion", "all"]
"""Which part of an elastic law is meant; a law without a separate volumetric part is all distortion."""


@dataclass(frozen=True)
class Scaled(ShearAndBulk, MadeFrom):
    """The law `base` times a positive `factor`; a separate volumetric part stays as it is unless `part` is "all".

    A viscoelastic material turns into such a law once it has relaxed.
    """

    base: Material
    factor: float
    part: Part = "distortion"

    law: ClassVar[str] = "scaled"

    def __post_init__(self) -> None:
        checks.positive("The factor of a scaled law", self.factor, "")

    @property
    def origin(self) -> Material:
        """The base law."""
        return self.base

    @property
    def name(self) -> str:  # type: ignore[override]  # a field in other laws
        """Name of the base law and the factor."""
        return f"{self.base.name} × {self.factor:.4g}"

    @property
    def shear_modulus(self) -> float:
        """Factor times G of the base law, in Pa."""
        return self.factor * self.base.shear_modulus

    @property
    def bulk_modulus(self) -> float:
        """K in Pa; the volumetric part's share of it is not scaled."""
        elastic_bulk = _unrelaxed_bulk(self.base, self.part)
        # both may be infinite, and their difference then vanishes
        rest = 0.0 if elastic_bulk == self.base.bulk_modulus else self.base.bulk_modulus - elastic_bulk
        return elastic_bulk + self.factor * rest

    @property
    def volumetric(self) -> Volumetric | None:
        """Volumetric part of the base law, multiplied if `part` is "all"."""
        volumetric = self.base.volumetric
        if volumetric is None or self.part == "distortion":
            return volumetric
        return Volumetric(self.factor * volumetric.modulus, volumetric.measure)

    def distortion(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """Factor times the base law's distortion, in J/m³; of its whole energy where it has no volumetric part."""
        return self.factor * _part_of(self.base, "distortion", F)


def _part_of(base: Material, part: Part, F: Tensor) -> Scalar:
    """Return the energy in J/m³ of all of an elastic law, or of all but a separate volumetric part."""
    return base.energy(F) if part == "all" or base.volumetric is None else base.distortion(F)


def _unrelaxed_bulk(base: Material, part: Part) -> float:
    """Return the bulk modulus in Pa that is not in that part: of a separate volumetric energy, if any."""
    return 0.0 if part == "all" or base.volumetric is None else base.volumetric.modulus


_ZERO = ((0.0, 0.0, 0.0),) * 3


@dataclass(frozen=True)
class Viscoelastic(MadeFrom):
    """An elastic law that relaxes by a Prony series.

    The base law is the instantaneous one: what a sudden deformation meets. A separate volumetric part stays elastic
    unless `part` is "all"; a law that has none relaxes as a whole.

    Attributes
    ----------
    base : Material
        An elastic law.
    terms : tuple of (float, float)
        (γ_i, τ_i): share of the instantaneous law that relaxes, and relaxation time in s; a `PronySeries` is taken too.
        They are shares of the shear modulus, and of Young's modulus only where the volume can't change or relaxes too.
    part : "distortion" or "all"
        Part of the law that relaxes. If the volumetric part does, there is no mixed formulation.
    name, source : str
        Name of the material and source of its constants; by default those of the base law.

    Raises
    ------
    UsageError
        For a base law with a history of its own, or terms that are no Prony series.
    """

    base: Material
    terms: tuple[tuple[float, float], ...]
    part: Part = "distortion"
    name: str = ""
    source: str = ""

    law: ClassVar[str] = "viscoelastic"

    def __post_init__(self) -> None:
        if self.base.states:
            raise UsageError(
                f"{self.base.name} has a history of its own and can't be the base of a viscoelastic material.",
                why="The Prony series relaxes an elastic law's stress.",
                fix="Pass an elastic law, for example NeoHookean(young=9e3, poisson=0.45).",
            )
        series = self.terms if isinstance(self.terms, PronySeries) else PronySeries(self.terms)
        object.__setattr__(self, "terms", series.terms)
        for key in ("name", "source"):
            object.__setattr__(self, key, getattr(self, key) or getattr(self.base, key))

    @classmethod
    def from_relaxed(
        cls, law: Material, terms: PronySeries | tuple[tuple[float, float], ...]
    ) -> Viscoelastic:
        """Return the material that relaxes to `law`, by the same shares of the instantaneous law.

        Raises
        ------
        UsageError
            If the series relaxes to nothing.
        """
        series = terms if isinstance(terms, PronySeries) else PronySeries(terms)
        if series.equilibrium <= 0:
            raise UsageError(
                "A series whose shares sum to 1 relaxes to nothing.",
                why="The instantaneous law is the relaxed one over γ_∞ = 1 − Σγ_i.",
                fix="Give the instantaneous law: Viscoelastic(law, terms).",
            )
        return cls(Scaled(law, 1 / series.equilibrium), series.terms, name=law.name, source=law.source)

    @property
    def origin(self) -> Material:
        """The base law."""
        return self.base

    @property
    def prony(self) -> PronySeries:
        """The series."""
        return PronySeries(self.terms)

    @property
    def volumetric(self) -> Volumetric | None:
        """Volumetric part of the base law where it does not relax: then a mixed formulation works."""
        return self.base.volumetric if self.part == "distortion" else None

    @property
    def states(self) -> tuple[StateVariable, ...]:  # type: ignore[override]
        """The base law's stress S_0 at the end of the last step and each term's overstress H_i, in Pa."""
        names = ("stress", *self._overstresses)
        return tuple(StateVariable(name, (3, 3), _ZERO) for name in names)

    def relaxed_law(self) -> Scaled:
        """Return the elastic law that is left in the end, with the equilibrium moduli.

        Raises
        ------
        UsageError
            If nothing is left, as the shares sum to 1.
        """
        return Scaled(self.base, self.prony.equilibrium, self.part)

    def storage_modulus(self, frequency: Any) -> Any:
        """Return G'(ω) in Pa at small strain, for angular frequencies in rad/s."""
        return self.shear_modulus * self.prony.storage(frequency)

    def loss_modulus(self, frequency: Any) -> Any:
        """Return G''(ω) in Pa at small strain: a cycle of shear of amplitude γ loses π γ² G'' (J/m³)."""
        return self.shear_modulus * self.prony.loss(frequency)

    def distortion(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """Return the incremental energy without the elastic volumetric part, in J/m³.

        Its gradient is the stress; its value is no stored energy. `dt` in s; None is an instant, infinity for ever.
        """
        energy = self._weight(dt) * _part_of(self.base, self.part, F)
        if not state:
            return energy
        memory = state["memory"] if "memory" in state else self.prepare(state, dt)["memory"]
        return energy + inner(memory, self._strain(F))

    def prepare(self, state: Mapping[str, Any], dt: Any) -> dict[str, Any]:
        """Return M (..., 3, 3) in Pa, all that `energy` and `distortion` need of the state in a step of `dt` seconds.

        They take it in place of the state. A solver that keeps it at quadrature points saves its evaluation, once per
        pair of strain components and Newton iteration.
        """
        series = self.prony
        lost = sum(share * gain for share, gain in zip(series.shares, series.gain(dt), strict=True))
        memory = -scale(lost, state["stress"])
        for name, decay in zip(self._overstresses, series.decay(dt), strict=True):
            memory = memory + scale(decay, state[name])
        return {"memory": memory}

    def advance(self, F: Tensor, state: Mapping[str, Any], dt: Any) -> dict[str, Any]:
        """Return S_0 and H_i (..., 3, 3) in Pa at the end of the step."""
        stress = self._stress(F)
        series, change = self.prony, stress - state["stress"]
        after = {"stress": stress}
        terms = zip(self._overstresses, series.shares, series.decay(dt), series.gain(dt), strict=True)
        for name, share, decay, gain in terms:
            after[name] = scale(decay, state[name]) + scale(share * gain, change)
        return compile_values(after)

    def stored_energy(self, F: Tensor, state: Mapping[str, Any]) -> Scalar:
        """Return the free energy in J/m³ at F, with the state after the step: relaxed law and springs of the terms.

        Exact where the base law's stress is linear in its strain; elsewhere an estimate, see `spring_energy`.
        """
        relaxed = self.stored_distortion(F, state)
        return relaxed if self.volumetric is None else relaxed + self.volumetric.energy(F)

    def stored_distortion(self, F: Tensor, state: Mapping[str, Any]) -> Scalar:
        """`stored_energy` without the elastic volumetric part, which a mixed formulation writes in its own way."""
        series, bulk = self.prony, self._bulk
        springs = sum(
            spring_energy(state[name], share * self.shear_modulus, share * bulk)
            for name, share in zip(self._overstresses, series.shares, strict=True)
        )
        return series.equilibrium * _part_of(self.base, self.part, F) + springs

    def dissipated_energy(self, F: Tensor, state: Mapping[str, Any], dt: float) -> Scalar:
        """Return the heat of the dashpots in a step from `state` to F, in J/m³, never negative."""
        change, bulk = self._stress(F) - state["stress"], self._bulk
        return sum(
            dashpot_loss(
                state[name], scale(share, change), dt / time, share * self.shear_modulus, share * bulk
            )
            for name, (share, time) in zip(self._overstresses, self.terms, strict=True)
        )

    def __str__(self) -> str:
        """Return the law, its moduli at once and in the end, the Prony terms and the source, in words."""
        left = self.relaxed_law().young if self.prony.equilibrium > 0 else 0.0
        return in_words(self, f"{self.prony} to E = {left:.4g} Pa", at_once=True)

    @property
    def _overstresses(self) -> tuple[str, ...]:
        return tuple(f"overstress_{i}" for i in range(1, len(self.terms) + 1))

    @property
    def _bulk(self) -> float:
        """Bulk modulus in Pa of the part that relaxes."""
        elastic_bulk = _unrelaxed_bulk(self.base, self.part)
        return 0.0 if elastic_bulk == self.bulk_modulus else self.bulk_modulus - elastic_bulk

    def _weight(self, dt: Any) -> Any:
        """Return γ_∞ + Σ γ_i a_i."""
        series = self.prony
        gains = zip(series.shares, series.gain(dt), strict=True)
        return series.equilibrium + sum(share * gain for share, gain in gains)

    def _strain(self, F: Tensor) -> Tensor:
        """Return the strain that the law's stress works on: ε, or Green's strain."""
        if self.kinematics == "small":
            return sym(F - identity(F))
        return 0.5 * (matmul(transpose(F), F) - identity(F))

    def _stress(self, F: Tensor) -> Tensor:
        """Return S_0 of the part that relaxes (second Piola–Kirchhoff; Cauchy at small strain), in Pa."""
        first = gradient(lambda A: _part_of(self.base, self.part, A), F)
        return sym(first) if self.kinematics == "small" else sym(matmul(inverse(F), first))
