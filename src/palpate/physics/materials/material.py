"""Materials: the contract with a finite-element model, and the bases of the laws."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Protocol, Self

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.physics.materials.moduli import (
    bulk_from_poisson,
    bulk_from_young,
    lame_modulus,
    poisson_ratio,
    require_density,
    require_moduli,
    require_numbers,
    require_poisson,
    shear_from_young,
    young_modulus,
)
from palpate.physics.materials.tensors import Scalar, Tensor, determinant, is_symbolic, log, trace

if TYPE_CHECKING:
    from palpate.physics.materials.material_stability import Stability

__all__ = [
    "NO_STATE",
    "Elastic",
    "Isochoric",
    "MadeFrom",
    "Material",
    "ShearAndBulk",
    "StateVariable",
    "Volumetric",
    "YoungAndPoisson",
    "in_words",
    "incompressible",
    "initial_state",
    "log_volume",
    "small_volume",
    "volume_change",
]

NO_STATE: Mapping[str, Any] = MappingProxyType({})
"""The state of a material that has none."""


def log_volume(F: Tensor) -> Scalar:
    """Return ln J with J = det F."""
    return log(determinant(F))


def volume_change(F: Tensor) -> Scalar:
    """Return J − 1 with J = det F."""
    return determinant(F) - 1


def small_volume(F: Tensor) -> Scalar:
    """Return the trace of ε = sym(F − I), the change of volume at small strain."""
    return trace(F) - 3


@dataclass(frozen=True)
class Volumetric:
    """The volumetric part ½ · modulus · measure(F)² of an energy."""

    # modulus in Pa, positive; infinite for an incompressible material, which only a mixed formulation can
    # solve
    modulus: float
    # function from F to a pure number that vanishes at F = I with slope 1 in the volume: `log_volume`,
    # `volume_change`, `small_volume`, or another module-level function
    measure: Callable[[Tensor], Scalar]

    def energy(self, F: Tensor) -> Scalar:
        """½ · modulus · measure(F)², in J/m³."""
        return 0.5 * self.modulus * self.measure(F) ** 2

    def mixed(self, F: Tensor, pressure: Scalar) -> Scalar:
        """Return p · measure(F) − p²/(2 · modulus), in J/m³: stationary in p it is the energy."""
        density = pressure * self.measure(F)
        return density if np.isinf(self.modulus) else density - pressure**2 / (2 * self.modulus)


@dataclass(frozen=True)
class StateVariable:
    """One internal variable, kept at every quadrature point.

    Attributes
    ----------
    name : str
        Key of the variable in the state.
    shape : tuple
        () for a scalar, (3, 3) for a tensor.
    initial : tuple or float
        Its value in the undeformed body: a number, or three rows of three.
    """

    name: str
    shape: tuple[()] | tuple[int, int] = ()
    initial: float | tuple[tuple[float, ...], ...] = 0.0


class Material(Protocol):
    """An energy density per reference volume, and what a model must know about it.

    Materials are frozen, hashable, picklable values. `F` is the deformation gradient: a coefficient function of NGSolve
    or a NumPy array (..., 3, 3).
    """

    @property
    def name(self) -> str:
        """Name for messages and reports."""

    @property
    def source(self) -> str:
        """Source of its constants."""

    @property
    def density(self) -> float:
        """Reference density in kg/m³."""

    @property
    def kinematics(self) -> Literal["large", "small"]:
        """``"small"`` if the law depends on ε = sym(F − I) alone."""

    @property
    def young(self) -> float:
        """Initial Young's modulus in Pa (viscoelastic: instantaneous)."""

    @property
    def poisson(self) -> float:
        """Initial Poisson's ratio."""

    @property
    def shear_modulus(self) -> float:
        """Initial shear modulus in Pa."""

    @property
    def bulk_modulus(self) -> float:
        """Initial bulk modulus in Pa."""

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """Internal variables; empty for an elastic material."""

    @property
    def volumetric(self) -> Volumetric | None:
        """The volumetric part of the energy, if it is separate from the rest."""

    def energy(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """Return the energy density in J/m³; its gradient in F is the first Piola–Kirchhoff stress.

        For a material with a history, the incremental energy of a step of `dt` seconds that starts from `state`.
        """

    def distortion(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """Return the energy without its volumetric part, in J/m³."""

    def advance(self, F: Tensor, state: Mapping[str, Any], dt: Any) -> dict[str, Any]:
        """Return the internal variables at the end of the step; empty for an elastic material."""

    def describe(self) -> dict[str, Any]:
        """Return plain data for JSON: the law's name and its constants."""


class Elastic:
    """Base of all laws: the sum of distortion and volumetric part, and the description.

    A law is a frozen dataclass that gives `law` (in words), the four moduli, `volumetric` and `distortion`; or `energy`
    where it has no separate volumetric part.

    Attributes
    ----------
    name, source : str
        Name of the material, and where its constants come from.
    density : float
        In kg/m³.
    """

    name: str
    source: str
    density: float
    law: ClassVar[str] = "elastic"
    quadrature: ClassVar[int] = 0  # orders of integration that the law needs beyond those of a uniform one
    kinematics: ClassVar[Literal["large", "small"]] = "large"
    states: ClassVar[tuple[StateVariable, ...]] = ()

    if TYPE_CHECKING:  # fields in some laws, properties in others

        @property
        def young(self) -> float: ...  # noqa: D102
        @property
        def poisson(self) -> float: ...  # noqa: D102
        @property
        def shear_modulus(self) -> float: ...  # noqa: D102
        @property
        def bulk_modulus(self) -> float: ...  # noqa: D102

    @property
    def volumetric(self) -> Volumetric | None:
        """The volumetric part of the energy, if it is separate from the rest."""
        return None

    def energy(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """Return the energy density in J/m³ at the deformation gradient F.

        Raises
        ------
        UsageError
            If the material is incompressible: then only `distortion` has a value.
        """
        volumetric = self.volumetric
        if volumetric is None:
            return self.distortion(F, state, dt)
        if np.isinf(volumetric.modulus):
            raise incompressible(self.name)
        return self.distortion(F, state, dt) + volumetric.energy(F)

    def distortion(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """Return the energy density without its volumetric part, in J/m³."""
        raise NotImplementedError

    def advance(self, F: Tensor, state: Mapping[str, Any], dt: Any) -> dict[str, Any]:
        """Return no variables: an elastic material has no history."""
        return {}

    def stability(
        self, strain: tuple[float, float] = (-0.5, 1.0), volume: tuple[float, float] = (-0.2, 0.2)
    ) -> Stability:
        """Test Drucker's criterion over ranges of strain; see `palpate.physics.materials.material_stability.stability`.

        Raises
        ------
        UsageError
            If a range is empty, does not hold 0, or begins at −1 or below.
        """
        from palpate.physics.materials.material_stability import stability  # it builds on this file

        return stability(self, strain, volume)

    def describe(self) -> dict[str, Any]:
        """Return plain data for JSON: the law's name and its constants."""
        fields = dataclasses.fields(self)  # type: ignore[arg-type]  # a law is a dataclass, this base is none
        constants = {f.name: _plain(getattr(self, f.name)) for f in fields}
        return {"law": type(self).__name__, **constants}

    def __str__(self) -> str:
        """Return the law, the initial moduli and the source, in words."""
        return in_words(self)


class YoungAndPoisson(Elastic):
    """Base of the laws whose constants are Young's modulus E and Poisson's ratio ν, fields `young` and `poisson`."""

    def __post_init__(self) -> None:
        require_moduli(self.young, self.poisson, self.density)

    @property
    def shear_modulus(self) -> float:
        """μ = E/(2(1 + ν)) in Pa."""
        return shear_from_young(self.young, self.poisson)

    @property
    def bulk_modulus(self) -> float:
        """K = E/(3(1 − 2ν)) in Pa."""
        return bulk_from_young(self.young, self.poisson)

    @property
    def _lame(self) -> float:
        """Lamé's λ = Eν/((1 + ν)(1 − 2ν)) in Pa."""
        return lame_modulus(self.young, self.poisson)


class ShearAndBulk(Elastic):
    """Base of the laws whose E and ν follow from their shear and bulk moduli."""

    @property
    def young(self) -> float:
        """Initial Young's modulus in Pa."""
        return young_modulus(self.shear_modulus, self.bulk_modulus)

    @property
    def poisson(self) -> float:
        """Initial Poisson's ratio."""
        return poisson_ratio(self.shear_modulus, self.bulk_modulus)


class Isochoric(ShearAndBulk):
    """Base of the laws of C̄ = J^(−2/3) FᵀF, with ½ K (J − 1)² for the volume and K their field `bulk`.

    The fields before `bulk` are the law's own constants, in Pa.
    """

    bulk: float

    def __post_init__(self) -> None:
        self._require_constants()
        checks.positive(f"The bulk modulus of {self.name}", self.bulk, "Pa", infinite=True)
        checks.positive(f"The initial shear modulus of {self.name}", self.shear_modulus, "Pa")
        require_density(self.density)

    def _require_constants(self) -> None:
        names = [f.name for f in dataclasses.fields(self)]  # type: ignore[arg-type]  # a law is a dataclass
        constants = [getattr(self, name) for name in names[: names.index("bulk")]]
        require_numbers(f"A constant of {self.name}", constants, "Pa")

    @classmethod
    def with_poisson(cls, poisson: float, **constants: Any) -> Self:
        """Return the law with the bulk modulus that gives an initial Poisson's ratio.

        Parameters
        ----------
        poisson : float
            Initial Poisson's ratio in (-1, 0.5]; 0.5 makes the material incompressible, for a mixed formulation only.
        **constants
            The law's constants but `bulk`.

        Raises
        ------
        UsageError
            For constants that no stable material has.
        """
        require_poisson(poisson)
        law = cls(**constants | {"bulk": 1.0})
        bulk = bulk_from_poisson(law.shear_modulus, poisson)
        return dataclasses.replace(law, bulk=bulk)  # type: ignore[type-var]  # every law is a dataclass

    @property
    def bulk_modulus(self) -> float:
        """K in Pa."""
        return self.bulk

    @property
    def volumetric(self) -> Volumetric:
        """½ K (J − 1)²."""
        return Volumetric(self.bulk, volume_change)


class MadeFrom(Elastic):
    """Base of the laws that are made from another one, their `origin`, and have its moduli, kinematics and source.

    The moduli of a law that relaxes are those of an instant.
    """

    @property
    def origin(self) -> Material:
        """Law from which it is made."""
        raise NotImplementedError

    @property
    def source(self) -> str:  # type: ignore[override]  # a field in other laws
        """Source of the constants of the origin."""
        return self.origin.source

    @property
    def density(self) -> float:  # type: ignore[override]  # a field in other laws
        """Density of the origin in kg/m³."""
        return self.origin.density

    @property
    def kinematics(self) -> Literal["large", "small"]:  # type: ignore[override]  # fixed in other laws
        """Kinematics of the origin."""
        return self.origin.kinematics

    @property
    def young(self) -> float:
        """E of the origin in Pa."""
        return self.origin.young

    @property
    def poisson(self) -> float:
        """ν of the origin."""
        return self.origin.poisson

    @property
    def shear_modulus(self) -> float:
        """G of the origin in Pa."""
        return self.origin.shear_modulus

    @property
    def bulk_modulus(self) -> float:
        """K of the origin in Pa."""
        return self.origin.bulk_modulus


def in_words(material: Any, more: str = "", *, at_once: bool = False) -> str:
    """Return a material's law, initial moduli, `more` and its source, in words.

    `at_once` says that the moduli are those of an instant, as they relax.
    """
    law = material.law
    named = material.name if material.name.lower() == law.lower() else f"{material.name}, {law}"
    moment = " at once" if at_once else ""
    figures = [f"E = {material.young:.4g} Pa{moment}", f"ν = {material.poisson:.5g}"]
    figures.append(f"ρ = {material.density:.4g} kg/m³" if material.density else "ρ not given")
    origin = f" ({material.source})" if material.source else ""
    return f"{named}: {', '.join([*figures, more] if more else figures)}{origin}"


def initial_state(material: Material, like: Tensor) -> dict[str, Any]:
    """State of the undeformed body, of the kind of `like` and, in NumPy, one value for every F (..., 3, 3)."""
    if is_symbolic(like):
        import ngsolve

        return {
            s.name: ngsolve.CF(tuple(np.ravel(s.initial).tolist()), dims=s.shape)
            if s.shape
            else ngsolve.CF(float(np.asarray(s.initial)))
            for s in material.states
        }
    leading = np.shape(like)[:-2]
    return {s.name: np.broadcast_to(np.asarray(s.initial, float), leading + s.shape) for s in material.states}


def incompressible(name: str) -> UsageError:
    """Return the error for an energy that does not exist because the volume can't change."""
    return UsageError(
        f"{name} is incompressible: its energy density has no value away from det F = 1.",
        why="Its bulk modulus is infinite (Poisson's ratio 0.5).",
        fix='Use formulation="mixed", or a Poisson\'s ratio such as 0.4999.',
    )


def _plain(value: Any) -> Any:
    if callable(getattr(value, "describe", None)):
        return value.describe()
    if isinstance(value, tuple | list):
        return [_plain(v) for v in value]
    return value.item() if isinstance(value, np.generic) else value
