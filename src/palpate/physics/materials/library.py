"""Materials that can be asked for by name, with their sources and the strains they were fitted over.

The silicones' constants are those of W = μ/α (λ₁^α + λ₂^α + λ₃^α − 3). Their tests and the fat's say nothing of
compressibility: a Poisson's ratio of 0.499 is set here, near enough to incompressible for their forces and far enough
for a solver (`dataclasses.replace` gives another `bulk`, or `poisson`). Densities are the manufacturer's (silicones)
and that of adipose tissue in ICRU Report 44 (1989).
"""

from __future__ import annotations

from typing import Literal, TypeVar, overload

from palpate.checks import did_you_mean
from palpate.errors import UsageError
from palpate.format import pressure
from palpate.physics.materials.hardening import VoceHardening
from palpate.physics.materials.linear import LinearElastic
from palpate.physics.materials.material import Elastic
from palpate.physics.materials.neo_hooke import NeoHookean
from palpate.physics.materials.ogden import Ogden
from palpate.physics.materials.plastic import Plastic
from palpate.physics.materials.tissues import TISSUES
from palpate.physics.materials.viscous import Viscoelastic

__all__ = [
    "MATERIALS",
    "material_kind",
    "material_words",
    "named_material",
]

L = TypeVar("L", bound=Elastic)

_NEARLY = 0.499
_FOUNDING = "Narayanan, Singla, Garimella, Waz & Krovi 2011, ASME DSCC"
_MARECHAL = "fitted to Marechal et al. 2020, doi 10.1089/soro.2019.0115, uniaxial tension, strain 5 to 100 %"
_SIMS = "Sims et al. 2010: shear modulus 0.53 kPa, taken as the instantaneous one; one Prony term of 0.39 and 700 s"

# name, density, C10 and Ogden's μ and α, in SI units
_ECOFLEX = (
    ("ecoflex 00-10", 1040.0, 3.98e3, 5.54e3, 2.52),
    ("ecoflex 00-30", 1070.0, 8.07e3, 11.99e3, 2.42),
    ("ecoflex 00-50", 1070.0, 11.21e3, 16.00e3, 2.48),
)
_DRAGON_SKIN = (("dragon skin 20", 1080.0, 68.2e3, 3.29), ("dragon skin 30", 1080.0, 110e3, 3.06))


def _gaussian(name: str, density: float, c10: float, source: str) -> NeoHookean:
    return NeoHookean.from_c10(
        c10, poisson=_NEARLY, density=density, form="isochoric", name=name, source=source
    )


def _ogden(name: str, density: float, mu: float, alpha: float) -> Ogden:
    return Ogden.with_poisson(_NEARLY, mu=mu, alpha=alpha, density=density, name=name, source=_MARECHAL)


_COPPER = LinearElastic(110e9, 0.35, 8700.0, "copper", _FOUNDING)
_ANNEALED_COPPER = Plastic(
    _COPPER,
    # least squares of relative deviation from 90 + 292 α^0.31 MPa over 0 < α ≤ 0.2
    VoceHardening(yield_stress=125.5e6, saturation=67.2e6, rate=52.2, modulus=390.8e6),
    "annealed copper",
    "flow stress 90 + 292 α^0.31 MPa of oxygen-free copper (Johnson & Cook 1983, 7th Int. Symp. Ballistics, "
    "541-547), met within 3 % for 0.002 ≤ α ≤ 0.2; elastic constants of the founding case",
)
_FAT = _gaussian("porcine fat", 950.0, 0.53e3 / 2, _SIMS)

MATERIALS: dict[str, Elastic] = {
    material.name: material
    for material in (
        _COPPER,
        LinearElastic(2e9, 0.43, 1150.0, "nylon", _FOUNDING),
        *(_ogden(name, rho, mu, alpha) for name, rho, _, mu, alpha in _ECOFLEX),
        *(_gaussian(f"{name} neo-hookean", rho, c10, _MARECHAL) for name, rho, c10, _, _ in _ECOFLEX),
        *(_ogden(*row) for row in _DRAGON_SKIN),
        _FAT,
        Viscoelastic(_FAT, ((0.39, 700.0),), name="porcine fat viscoelastic"),
        _ANNEALED_COPPER,
        *(tissue.material for tissue in TISSUES.values()),
    )
}
"""Materials that can be asked for by name."""


def material_kind(name: str) -> Literal["tissue", "silicone", "other"]:
    """Return the kind of a material that can be asked for by name."""
    if name in TISSUES:
        return "tissue"
    return "silicone" if name.startswith(("ecoflex", "dragon skin")) else "other"


def material_words(name: str) -> str:
    """Return what there is to say of a material that has a name: law, modulus, range, and source."""
    material, tissue = named_material(name), TISSUES.get(name)
    young = pressure(2 * material.shear_modulus * (1 + material.poisson))
    words = f"{material.law}, Young's modulus {young} at small strains"
    if tissue is not None:
        words += f"; published from {pressure(tissue.low)} to {pressure(tissue.high)}"
    source = material.source or "no source"
    return f"{words}. {source[0].upper()}{source[1:]}."


@overload
def named_material(name: str) -> Elastic: ...
@overload
def named_material(name: str, law: type[L]) -> L: ...
def named_material(name: str, law: type[Elastic] = Elastic) -> Elastic:
    """Look a material up by name.

    Parameters
    ----------
    name : str
        Name of the material in any case, such as ``"nylon"`` or ``"Ecoflex 00-30"``.
    law : type, optional
        The law that the body needs, such as `LinearElastic` for a beam.

    Raises
    ------
    UsageError
        If the name is not known, or the material is one of another law; the message lists the names that fit.
    """
    key = name.strip().lower()
    material = MATERIALS.get(key)
    if isinstance(material, law):
        return material
    fitting = [title for title, candidate in MATERIALS.items() if isinstance(candidate, law)]
    listed = f"Known materials: {', '.join(sorted(fitting))}."
    if material is not None:
        raise UsageError(
            f"{key} is a material of the law {material.law}; here {law.law} is needed.",
            why=listed,
            fix=f"Take one of these, or {law.__name__} with your own constants.",
        )
    raise UsageError(
        f"There is no material called {name!r}.",
        why=listed,
        fix=did_you_mean(key, fitting, shown=repr)
        or "Or give its constants, for example LinearElastic(young=70e9, poisson=0.33, density=2700.0).",
    )
