"""A material of one's own: one function from the deformation gradient to the energy density."""

from __future__ import annotations

import hashlib
import importlib
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any, ClassVar, Literal, overload

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.physics.materials.material import (
    NO_STATE,
    ShearAndBulk,
    StateVariable,
    Volumetric,
    initial_state,
    volume_change,
)
from palpate.physics.materials.moduli import require_density
from palpate.physics.materials.tensors import Scalar, Tensor, gradient, second_gradient

__all__ = ["UserMaterial", "material"]

_SHORT = 1e-9  # s: a step that leaves a history no time, for the instantaneous moduli


@dataclass(frozen=True)
class UserMaterial(ShearAndBulk):
    """A material whose energy density is a function written with `palpate.physics.materials.tensors`.

    The function is tried at once in NumPy: it must be stress-free at F = I, stiff against every strain, and (for large
    strain) blind to rotations.

    Attributes
    ----------
    function : callable
        ``function(F, **constants)`` in J/m³; with `states`, ``function(F, state, dt, **constants)``, the incremental
        energy of a step of dt seconds. With `bulk`, the energy without its volumetric part.
    constants : mapping
        Keyword arguments of the function that differ from its defaults; kept as a sorted tuple of pairs.
    bulk : float, optional
        K in Pa: adds ½ K measure(F)², apart from the rest so that a mixed formulation can take it.
    measure : callable
        Of the volume, for `bulk`: `volume_change` (J − 1), `log_volume` or another module-level function.
    kinematics : str
        ``"large"``, or ``"small"`` for a function of sym(F − I) alone.
    states : tuple of StateVariable
        Internal variables.
    evolution : callable, optional
        ``evolution(F, state, dt, **constants)``, a dict of the states at the end of the step; needed with `states`.
    density : float
        Reference density in kg/m³.
    name, source : str
        Name of the material, by default that of its function, and source of its constants.

    Raises
    ------
    UsageError
        For a function that can't be evaluated or is no such energy, or for constants out of range.
    """

    function: Callable[..., Scalar]
    constants: Mapping[str, Any] | tuple[tuple[str, Any], ...] = ()
    bulk: float | None = None
    measure: Callable[[Tensor], Scalar] = volume_change
    kinematics: Literal["large", "small"] = "large"  # type: ignore[misc]  # fixed in other laws
    states: tuple[StateVariable, ...] = ()  # type: ignore[misc]  # none in other laws
    evolution: Callable[..., dict[str, Any]] | None = None
    density: float = 0.0
    name: str = ""
    source: str = ""

    law: ClassVar[str] = "user's material"

    def __post_init__(self) -> None:
        pairs = tuple(sorted(dict(self.constants).items()))
        object.__setattr__(self, "constants", pairs)
        object.__setattr__(self, "states", tuple(self.states))
        if not callable(self.function):
            raise UsageError(
                f"The energy is {self.function!r}.",
                why="It must be a function of F.",
                fix="Pass the function itself, without calling it.",
            )
        if not self.name:
            object.__setattr__(self, "name", getattr(self.function, "__name__", "user").replace("_", " "))
        if self.bulk is not None:
            checks.positive(f"The bulk modulus of {self.name}", self.bulk, "Pa", infinite=True)
        require_density(self.density)
        if self.states and self.evolution is None:
            raise UsageError(
                f"{self.name} has internal variables and no evolution.",
                why="A solver keeps their values at the end of each step.",
                fix="Pass evolution=function(F, state, dt), which returns them as a dict.",
            )
        _examine(self)

    def distortion(self, F: Tensor, state: Mapping[str, Any] = NO_STATE, dt: Any = None) -> Scalar:
        """The function's value, in J/m³."""
        if self.states:
            return self.function(F, state, dt, **dict(self.constants))
        return self.function(F, **dict(self.constants))

    def advance(self, F: Tensor, state: Mapping[str, Any], dt: Any) -> dict[str, Any]:
        """Internal variables at the end of the step."""
        return {} if self.evolution is None else self.evolution(F, state, dt, **dict(self.constants))

    @property
    def volumetric(self) -> Volumetric | None:
        """½ `bulk` `measure`², if there is a `bulk`."""
        return None if self.bulk is None else Volumetric(self.bulk, self.measure)

    @cached_property
    def _moduli(self) -> tuple[float, float]:
        """Shear and bulk modulus of the function at F = I."""
        F = np.eye(3)
        state = initial_state(self, F)
        C = second_gradient(lambda G: self.distortion(G, state, _SHORT), F)
        whole, shape = float(np.einsum("iijj", C)), float(np.einsum("ijij", C) + np.einsum("ijji", C)) / 2
        # the isotropic part: C = λ δδ + μ (δδ + δδ) has the contractions 9λ + 6μ and 3λ + 12μ
        return (3 * shape - whole) / 30, whole / 9

    @property
    def shear_modulus(self) -> float:
        """Initial shear modulus in Pa, by differences; the average over directions if they differ."""
        return self._moduli[0]

    @property
    def bulk_modulus(self) -> float:
        """Initial bulk modulus in Pa, by differences."""
        return self._moduli[1] + (self.bulk or 0.0)

    def describe(self) -> dict[str, Any]:
        """Plain data for JSON: the function by name and by a digest of its text, and the constants."""
        return {
            "law": type(self).__name__,
            "function": f"{self.function.__module__}.{_path(self.function)}",
            "digest": _digest(self.function),
            "constants": dict(self.constants),
            "bulk": self.bulk,
            "measure": None if self.bulk is None else _path(self.measure),
            "kinematics": self.kinematics,
            "states": [s.name for s in self.states],
            "density": self.density,
            "name": self.name,
            "source": self.source,
        }

    def __reduce__(self) -> tuple[object, ...]:
        # by name: a decorated function's name leads to the material, not to the function
        functions = {"function": self.function, "measure": self.measure, "evolution": self.evolution}
        names = {key: _reference(self.name, f) for key, f in functions.items() if f is not None}
        rest = ("constants", "bulk", "kinematics", "states", "density", "name", "source")
        return _rebuild, (names, {key: getattr(self, key) for key in rest})


@overload
def material(function: Callable[..., Scalar]) -> UserMaterial: ...
@overload
def material(**settings: Any) -> Callable[[Callable[..., Scalar]], UserMaterial]: ...
def material(function: Callable[..., Scalar] | None = None, **settings: Any) -> Any:
    """Make a function of F a material: ``@material`` or ``@material(density=1000.0, bulk=1e6)``.

    The settings are the other attributes of `UserMaterial`.
    """
    return UserMaterial(function, **settings) if function else lambda f: UserMaterial(f, **settings)


def _examine(law: UserMaterial) -> None:
    """Refuse what is no energy of an elastic body, by trying it."""
    state = initial_state(law, np.eye(3))
    try:
        shear, stiff = law.shear_modulus, law.bulk_modulus
        stress = gradient(lambda G: law.distortion(G, state, _SHORT), np.eye(3))
        turned, straight = (law.distortion(F, state, _SHORT) for F in _turned_and_straight())
    except (TypeError, ValueError, AttributeError, IndexError, KeyError) as error:
        raise UsageError(
            f"The energy of {law.name} can't be evaluated: {error}.",
            why="It is called with arrays (..., 3, 3), also complex ones, and with coefficient functions of NGSolve.",
            fix="Write it with the functions of palpate.physics.materials.tensors: trace, determinant, log, where …",
        ) from error
    if not (np.isfinite(stress).all() and np.isfinite(shear) and np.abs(stress).max() <= 1e-6 * abs(shear)):
        raise _no_energy(
            law, f"its stress at F = I is up to {np.abs(stress).max():.3g} Pa", "is stress-free there"
        )
    if not (shear > 0 and stiff > 0):
        raise _no_energy(
            law, f"μ = {shear:.3g} Pa and K = {stiff:.3g} Pa at F = I", "resists shear and compression"
        )
    if law.kinematics == "large" and not np.isclose(turned, straight, rtol=1e-9, atol=1e-9 * shear):
        raise _no_energy(law, "it changes with a rotation of the body", "depends on FᵀF alone")


def _turned_and_straight() -> tuple[np.ndarray, np.ndarray]:
    F = np.array([[1.1, 0.1, 0.0], [0.0, 0.95, 0.05], [0.02, 0.0, 1.0]])
    c, s = np.cos(0.5), np.sin(0.5)
    Q = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ np.array(
        [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]
    )
    return Q @ F, F


def _no_energy(law: UserMaterial, fault: str, rule: str) -> UsageError:
    return UsageError(
        f"{law.name} is not the energy of an undeformed body: {fault}.",
        why=f"A body at rest {rule}.",
        fix="Check the function: add what is missing (such as −μ ln J, or bulk=…), or kinematics='small'.",
    )


def _path(function: Callable[..., Any]) -> str:
    return getattr(function, "__qualname__", type(function).__qualname__)


def _digest(function: Callable[..., Any]) -> str | None:
    try:
        return hashlib.sha256(inspect.getsource(function).encode()).hexdigest()[:16]
    except (OSError, TypeError):  # typed at a prompt, or built in
        return None


def _reference(name: str, function: Callable[..., Any]) -> tuple[str, str]:
    """Module and path by which another process finds the function."""
    module, path = getattr(function, "__module__", ""), _path(function)
    try:
        located = _find(module, path)
    except (ImportError, AttributeError, ValueError):
        located = None
    if located is not function:
        raise UsageError(
            f"The material {name} can't be sent to another process.",
            why=f"Its function {path} is not found by that name in its module {module}.",
            fix="Define the function at the top level of a file, not inside another function or as a lambda.",
        )
    return module, path


def _find(module: str, path: str) -> Any:
    target = reduce(getattr, path.split("."), importlib.import_module(module))
    return target.function if isinstance(target, UserMaterial) else target


def _rebuild(names: dict[str, tuple[str, str]], rest: dict[str, Any]) -> UserMaterial:
    return UserMaterial(**{key: _find(*name) for key, name in names.items()}, **rest)
