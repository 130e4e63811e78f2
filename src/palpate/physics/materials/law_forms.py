"""Laws whose constants can be fitted: each as coordinates of a search, and as the material that they make.

The coordinates of a search begin with moduli, in which an incompressible law's stresses are linear, and end with
exponents. Ogden's law is
searched by sₚ = ½ μₚ αₚ ≥ 0, the shares of its shear modulus: with none of them negative it is stable for every strain.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.checks import did_you_mean
from palpate.errors import UsageError
from palpate.physics.materials.homogeneous import diagonal, equibiaxial, is_incompressible, planar, uniaxial
from palpate.physics.materials.material import Material
from palpate.physics.materials.mooney_rivlin import MooneyRivlin
from palpate.physics.materials.neo_hooke import NeoHookean
from palpate.physics.materials.ogden import Ogden
from palpate.physics.materials.specimen_tests import StretchTest
from palpate.physics.materials.user import UserMaterial
from palpate.physics.materials.yeoh import Yeoh

__all__ = ["CANDIDATES", "FORMS", "LawForm", "form_of", "stress_in_test"]

_STEP = 1e-40  # of the complex step: its square vanishes beside 1 in double precision
# magnitudes of exponents between which a search stays
_LEAST_EXPONENT, _LARGEST_EXPONENT = 0.05, 40.0


@dataclass(frozen=True)
class LawForm:
    """A law whose constants are open.

    `build` makes the material of coordinates (n,) and Poisson's ratio, `values` the constants (n,) of coordinates,
    `keys` the keys of a material in a study file of constants. `starts` are the exponents from which searches begin,
    one empty tuple for a law without.
    """

    name: str  # such as "ogden-3"
    constants: tuple[tuple[str, str], ...]  # name and SI unit of each, in the order of `values`
    build: Callable[[np.ndarray, float], Any]
    values: Callable[[np.ndarray], np.ndarray]
    moduli: int  # number of coordinates that are moduli; the others are exponents
    starts: tuple[tuple[float, ...], ...] = ((),)
    signed: bool = False  # whether negative moduli can make a stable law: they are tried first
    origin: np.ndarray | None = None  # (n,) coordinates from which the search for a user's law begins
    keys: Callable[[np.ndarray], dict[str, Any]] | None = None

    @staticmethod
    def exponent_bounds(start: tuple[float, ...]) -> tuple[list[float], list[float]]:
        """Return the ends of the exponents, which keep the signs of their start."""
        ends = [sorted((np.sign(a) * _LEAST_EXPONENT, np.sign(a) * _LARGEST_EXPONENT)) for a in start]
        return [float(e[0]) for e in ends], [float(e[1]) for e in ends]


def _plain(x: np.ndarray) -> np.ndarray:
    return x


def _neo_hookean(x: np.ndarray, poisson: float) -> NeoHookean:
    return NeoHookean(float(x[0]) * 2 * (1 + poisson), poisson)


def _polynomial(law: Any, names: tuple[str, ...]) -> Callable[[np.ndarray, float], Any]:
    return lambda x, poisson: law.with_poisson(poisson, **dict(zip(names, map(float, x), strict=True)))


def _ogden(terms: int) -> LawForm:
    def values(x: np.ndarray) -> np.ndarray:
        return np.append(2 * x[:terms] / x[terms:], x[terms:])

    def build(x: np.ndarray, poisson: float) -> Ogden:
        mu, alpha = np.split(values(x), 2)
        return Ogden.with_poisson(poisson, mu=tuple(mu.tolist()), alpha=tuple(alpha.tolist()))

    numbered = ("",) if terms == 1 else tuple(f"_{i + 1}" for i in range(terms))
    names = tuple((f"mu{i}", "Pa") for i in numbered) + tuple((f"alpha{i}", "") for i in numbered)
    return LawForm(
        "ogden" if terms == 1 else f"ogden-{terms}",
        names,
        build,
        values,
        terms,
        _EXPONENTS[terms],
        keys=lambda v: {"mu": v[:terms].tolist(), "alpha": v[terms:].tolist()},
    )


_EXPONENTS: dict[int, tuple[tuple[float, ...], ...]] = {
    1: ((2.0,), (8.0,), (-3.0,)),
    2: ((1.5, -2.0), (1.5, 5.0), (2.0, 12.0), (-2.0, -8.0)),
    3: ((1.3, 5.0, -2.0), (1.5, 8.0, -1.0), (1.2, 4.0, 12.0)),
}


def _named(names: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    return tuple((name, "Pa") for name in names)


def _keyed(names: tuple[str, ...]) -> Callable[[np.ndarray], dict[str, Any]]:
    return lambda values: dict(zip(names, map(float, values), strict=True))


FORMS: Mapping[str, LawForm] = {
    form.name: form
    for form in (
        LawForm("neo-hookean", (("mu", "Pa"),), _neo_hookean, _plain, 1),
        LawForm(
            "mooney-rivlin",
            _named(("c10", "c01")),
            _polynomial(MooneyRivlin, ("c10", "c01")),
            _plain,
            2,
            signed=True,
            keys=_keyed(("c10", "c01")),
        ),
        LawForm(
            "yeoh",
            _named(("c10", "c20", "c30")),
            _polynomial(Yeoh, ("c10", "c20", "c30")),
            _plain,
            3,
            signed=True,
            keys=_keyed(("c10", "c20", "c30")),
        ),
        _ogden(1),
        _ogden(2),
        _ogden(3),
    )
}
"""Laws by name; each is isotropic."""

CANDIDATES = tuple(FORMS)
"""Names of the laws among which `fit` chooses."""


def form_of(law: Any) -> LawForm:
    """Return the form of a name, of one of the classes of laws, or of a user's material with constants."""
    classes = {NeoHookean: "neo-hookean", MooneyRivlin: "mooney-rivlin", Yeoh: "yeoh", Ogden: "ogden"}
    if isinstance(law, UserMaterial):
        return _user_form(law)
    name = law.lower().replace(" ", "-") if isinstance(law, str) else classes.get(law, "")
    name = {"ogden-1": "ogden", "neo-hooke": "neo-hookean", "mooney": "mooney-rivlin"}.get(name, name)
    if name in FORMS:
        return FORMS[name]
    raise UsageError(
        f"No constants of {law!r} can be fitted.",
        why=f"The laws are {', '.join(CANDIDATES)}, and a material of one's own with constants.",
        fix=did_you_mean(law, CANDIDATES, shown=repr)
        or "Name one of them, or leave it out to have one chosen.",
    )


def _user_form(law: UserMaterial) -> LawForm:
    constants: tuple[tuple[str, Any], ...] = tuple(law.constants)  # type: ignore[arg-type]  # pairs once it is made
    if not constants:
        raise UsageError(
            f"The material {law.name} states no constants.",
            why="Only constants that are given with the material can be fitted.",
            fix="Pass constants={'mu': 5e3} to it, with first guesses.",
        )
    names = tuple(name for name, _ in constants)
    origin = np.array([float(value) for _, value in constants])

    def build(x: np.ndarray, poisson: float) -> UserMaterial:
        changed = dataclasses.replace(law, constants=dict(zip(names, map(float, x), strict=True)))
        return changed if poisson < 0.5 or law.bulk is None else dataclasses.replace(changed, bulk=np.inf)

    return LawForm(
        law.name, tuple((name, "") for name in names), build, _plain, len(names), origin=origin, keys=None
    )


def stress_in_test(material: Material, test: StretchTest, stretch: np.ndarray | None = None) -> np.ndarray:
    """Return the stress (N,) in Pa that an elastic material has in a test, in the test's measure.

    An incompressible isotropic material's deformation is known beforehand, and its nominal stress is the slope of its
    energy along it, by a complex step; of other materials the free directions are found first. `stretch` (N,) is that
    of the test by default.
    """
    stretch = test.stretch if stretch is None else stretch
    if is_incompressible(material) and not isinstance(material, UserMaterial):
        stepped = _incompressible(test.mode, stretch + 1j * _STEP)
        nominal = np.imag(material.distortion(stepped)) / _STEP
        nominal = nominal / 2 if test.mode == "equibiaxial" else nominal
        return np.asarray(nominal if test.measure == "nominal" else nominal * stretch)
    response = {"uniaxial": uniaxial, "equibiaxial": equibiaxial, "planar": planar}[test.mode](
        material, stretch
    )
    return response.stress if test.measure == "nominal" else response.cauchy[:, 0, 0]


def _incompressible(mode: str, stretch: np.ndarray) -> np.ndarray:
    """Return F (N, 3, 3) of a test at constant volume."""
    if mode == "uniaxial":
        return diagonal(stretch, stretch**-0.5, stretch**-0.5)
    if mode == "equibiaxial":
        return diagonal(stretch, stretch, stretch**-2)
    return diagonal(stretch, np.ones_like(stretch), 1 / stretch)
