"""Response of a material whose deformation is the same everywhere, as in a test specimen.

The load acts along the first axis (and the second). Unloaded directions take the stretch, and those of an anisotropic
material also the shear, at which they carry no stress: `relax_free` minimises the energy over them. F is upper
triangular: every F is, up to a rotation, and energies do not feel rotations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from palpate.errors import UsageError
from palpate.physics.materials.material import NO_STATE, Material, incompressible, initial_state
from palpate.physics.materials.tensors import (
    Scalar,
    Tensor,
    determinant,
    gradient,
    trace,
)

__all__ = [
    "Response",
    "diagonal",
    "energy_of",
    "equibiaxial",
    "is_incompressible",
    "planar",
    "relax_free",
    "simple_shear",
    "uniaxial",
    "unit_tensors",
    "volumetric",
]

ITERATIONS = 60
DIFFERENCE = 1e-5  # of the free components, for the tangent
ROUNDING = 1e-14  # of the stiffest direction: what is left of a sum of large terms
TOLERANCE = 1e-10  # of the last Newton step, whose square is the error left
_PLANE = ((0, 2), (1, 2), (2, 2))  # free where the first two axes are given
_LATERAL = ((0, 1), (1, 1), *_PLANE)


def relax_free(
    energy: Callable[[Tensor], Scalar], F: np.ndarray, free: tuple[tuple[int, int], ...], small: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Minimise the energy of each state over the free components, by Newton steps that may only descend."""
    index = np.array([3 * i + j for i, j in free])
    F, done = F.copy(), np.zeros(len(F), dtype=bool)
    for _ in range(ITERATIONS):
        slope = gradient(energy, F).reshape(-1, 9)[:, index]
        tangent = _tangent(energy, F, index)
        step, stiffest = _descent(tangent, slope), np.abs(tangent).max(axis=(1, 2))
        move = np.zeros((len(F), 9))
        move[:, index] = step
        gain = np.einsum("ni,ni->n", step, slope)
        taken = _shorten(energy, F, move.reshape(F.shape), gain, ROUNDING * stiffest, small)
        F = F + taken[:, None, None] * move.reshape(F.shape)
        settled = np.abs(step).max(axis=1) < TOLERANCE
        balanced = np.abs(slope).max(axis=1) < ROUNDING * stiffest
        done = (taken > 0) & (settled | balanced)
        volume = _volume(F, small)
        # an energy without a minimum lets the body vanish or grow without bound
        lost = (taken == 0) | (volume < 1e-3) | (volume > 1e3)
        if (done | lost).all():
            break
    return F, done & ~lost


def _tangent(energy: Callable[[Tensor], Scalar], F: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Second derivatives with respect to the free components (n, free, free), good to 1e-9: enough for Newton steps."""
    move = DIFFERENCE * np.eye(9)[index].reshape(-1, 1, 3, 3)
    slopes = (gradient(energy, F + move) - gradient(energy, F - move)) / (2 * DIFFERENCE)
    tangent = np.moveaxis(slopes.reshape(len(index), len(F), 9)[..., index], 0, -1)
    symmetric: np.ndarray = (tangent + np.swapaxes(tangent, 1, 2)) / 2
    return symmetric


def _descent(tangent: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Return the Newton step, with the tangent's negative curvatures turned round; NaN states stay where they are."""
    bad = ~(np.isfinite(tangent).all(axis=(1, 2)) & np.isfinite(slope).all(axis=1))
    values, vectors = np.linalg.eigh(np.where(bad[:, None, None], np.eye(slope.shape[1]), tangent))
    least = 1e-12 * np.abs(values).max(axis=1, keepdims=True)
    along = np.einsum("nji,nj->ni", vectors, np.where(bad[:, None], 0.0, slope))
    step = -np.einsum("nij,nj->ni", vectors, along / np.maximum(np.abs(values), least))
    return np.where(bad[:, None], 1.0, step)  # a step that the energy, NaN there, refuses


def _shorten(
    energy: Callable[[Tensor], Scalar],
    F: np.ndarray,
    move: np.ndarray,
    slope: np.ndarray,
    rounding: np.ndarray,
    small: bool,
) -> np.ndarray:
    """Return the share of each step that lowers the energy, up to rounding, and keeps its volume; 0 where none does."""
    start = energy(F)
    rounding = rounding + 1e-12 * np.abs(start)
    share, good = np.ones(len(F)), np.zeros(len(F), dtype=bool)
    for _ in range(40):
        trial = F + share[:, None, None] * move
        value = energy(trial)
        good = (_volume(trial, small) > 0) & (value <= start + 1e-4 * share * slope + rounding)
        if good.all():
            break
        share = np.where(good, share, share / 2)
    return np.where(good, share, 0.0)


def _volume(F: np.ndarray, small: bool) -> np.ndarray:
    """Return volume ratios (n,); a small-strain law has none that could vanish."""
    return np.ones(len(F)) if small else np.linalg.det(F)


@dataclass(frozen=True, eq=False)
class Response:
    """States of one kind of test: stresses and energies per undeformed area and volume, NaN without an equilibrium."""

    amount: np.ndarray  # (n,) prescribed stretches, shear strains or volume ratios
    deformation: np.ndarray  # (n, 3, 3) deformation gradients F
    nominal: np.ndarray  # (n, 3, 3) first Piola–Kirchhoff stresses ∂W/∂F in Pa
    energy: np.ndarray  # (n,) J/m³
    converged: np.ndarray  # (n,) bool, whether the free directions reached a stress-free state
    stress: np.ndarray  # (n,) Pa, of the test: along the first axis, of the shear, or the mean one

    @property
    def cauchy(self) -> np.ndarray:
        """True stresses P Fᵀ/J (n, 3, 3) in Pa."""
        J = np.linalg.det(self.deformation)
        stress: np.ndarray = self.nominal @ np.swapaxes(self.deformation, -1, -2) / J[..., None, None]
        return stress


def uniaxial(
    material: Material, stretch: ArrayLike, *, state: Mapping[str, Any] = NO_STATE, dt: Any = None
) -> Response:
    """Return tension (stretch > 1) or compression along the first axis, the sides free.

    `stretch` (n,) is length over undeformed length. `state` holds the internal variables at the beginning of the step
    (n, …), by default the undeformed body's, `dt` is its length in s, for materials with a history.
    """
    loaded = _amounts(stretch, "stretch")
    side = _side(material, loaded, 1)
    return _test(material, loaded, diagonal(loaded, side, side), _LATERAL, (0, 0), state, dt)


def equibiaxial(
    material: Material, stretch: ArrayLike, *, state: Mapping[str, Any] = NO_STATE, dt: Any = None
) -> Response:
    """Return the stretch λ along the first two axes alike, the third free; arguments as of `uniaxial`."""
    loaded = _amounts(stretch, "stretch")
    F = diagonal(loaded, loaded, _side(material, loaded, 2))
    return _test(material, loaded, F, _PLANE, (0, 0), state, dt)


def planar(
    material: Material, stretch: ArrayLike, *, state: Mapping[str, Any] = NO_STATE, dt: Any = None
) -> Response:
    """Return the stretch λ along the first axis, none along the second, the third free ("pure shear")."""
    loaded = _amounts(stretch, "stretch")
    F = diagonal(loaded, np.ones_like(loaded), np.sqrt(_side(material, loaded, 2)))
    return _test(material, loaded, F, _PLANE, (0, 0), state, dt)


def simple_shear(
    material: Material, shear: ArrayLike, *, state: Mapping[str, Any] = NO_STATE, dt: Any = None
) -> Response:
    """Return F = I + γ e₁ ⊗ e₂ for shear strains γ (n,); `state` and `dt` as of `uniaxial`."""
    loaded = _amounts(shear, "shear strain", positive=False)
    F = unit_tensors(len(loaded))
    F[:, 0, 1] = loaded
    return _test(material, loaded, F, (), (0, 1), state, dt)


def volumetric(
    material: Material, ratio: ArrayLike, *, state: Mapping[str, Any] = NO_STATE, dt: Any = None
) -> Response:
    """Return F = J^(1/3) I for volume ratios J (n,) of a compressible material; `state` and `dt` as of `uniaxial`."""
    loaded = _amounts(ratio, "volume ratio")
    if is_incompressible(material):
        raise incompressible(material.name)
    sides = 1 + (loaded - 1) / 3 if material.kinematics == "small" else np.cbrt(loaded)
    F = sides[:, None, None] * np.eye(3)
    return _test(material, loaded, F, (), None, state, dt)


def energy_of(
    material: Material, state: Mapping[str, Any] = NO_STATE, dt: Any = None
) -> Callable[[Tensor], Scalar]:
    """Return the material's energy as a function of F alone; of an incompressible one, the distortion."""
    whole = material.distortion if is_incompressible(material) else material.energy
    return lambda F: whole(F, state, dt)


def is_incompressible(material: Material) -> bool:
    """Return whether only deformations at constant volume are possible."""
    return material.volumetric is not None and bool(np.isinf(material.volumetric.modulus))


def _at_constant_volume(F: np.ndarray, small: bool) -> np.ndarray:
    """Return F with the third diagonal component that keeps the volume.

    The third axis bears no load, so that the slope of the energy along the constraint is the nominal stress, pressure
    included.
    """
    F = F.copy()
    F[..., 2, 2] = 0
    if small:
        F[..., 2, 2] = 3 - trace(F)
    else:
        minor = F[..., 0, 0] * F[..., 1, 1] - F[..., 0, 1] * F[..., 1, 0]
        F[..., 2, 2] = (1 - determinant(F)) / minor
    return F


def _test(
    material: Material,
    amount: np.ndarray,
    F: np.ndarray,
    free: tuple[tuple[int, int], ...],
    component: tuple[int, int] | None,
    state: Mapping[str, Any],
    dt: Any,
) -> Response:
    if material.states and not state:
        state = initial_state(material, F)
    energy, small = energy_of(material, state, dt), material.kinematics == "small"
    if is_incompressible(material):
        distortion = energy
        free = tuple(entry for entry in free if entry != (2, 2))
        F, energy = _at_constant_volume(F, small), lambda G: distortion(_at_constant_volume(G, small))
    F, converged = relax_free(energy, F, free, small) if free else (F, np.ones(len(F), dtype=bool))
    if is_incompressible(material):
        F = _at_constant_volume(F, small)
    P, W = gradient(energy, F), np.broadcast_to(energy(F), amount.shape).copy()
    for values in (F, P, W):
        values[~converged] = np.nan
    stress = np.trace(P, axis1=1, axis2=2) / 3 if component is None else P[:, component[0], component[1]]
    return Response(amount, F, P, W, converged, stress)


def _amounts(values: ArrayLike, what: str, *, positive: bool = True) -> np.ndarray:
    amounts = np.atleast_1d(np.asarray(values, dtype=float)).ravel()
    if not np.isfinite(amounts).all() or (positive and (amounts <= 0).any()):
        raise UsageError(
            f"The {what}s run from {amounts.min()} to {amounts.max()}.",
            why=f"A {what} is {'positive and ' if positive else ''}finite{'; 1 is undeformed' if positive else ''}.",
            fix="Pass 1 + strain, for example 1.2 for 20 % tension." if positive else "Correct the values.",
        )
    return amounts


def unit_tensors(count: int) -> np.ndarray:
    """Return unit tensors (count, 3, 3)."""
    return np.tile(np.eye(3), (count, 1, 1))


def diagonal(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return the deformation gradients (n, 3, 3) of stretches (n,) along the axes."""
    F = np.zeros((len(x), 3, 3), dtype=x.dtype)
    F[:, range(3), range(3)] = np.stack([x, y, z], axis=-1)
    return F


def _side(material: Material, stretch: np.ndarray, loaded: int) -> np.ndarray:
    """Return a first guess of the free stretch: that of the initial Poisson's ratio ν."""
    ratio = material.poisson if loaded == 1 else 2 * material.poisson / (1 - material.poisson)
    return 1 - ratio * (stretch - 1) if material.kinematics == "small" else stretch**-ratio
