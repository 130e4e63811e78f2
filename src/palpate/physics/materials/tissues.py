"""Moduli of soft tissues from published measurements: one table for the page, the commands and the documentation.

Tissues vary: between people, with age, disease, preload and rate, and most of all with the way of measuring. Each entry
therefore has the range of its sources beside the value that is taken: one standard deviation around the mean, from the
lowest to the highest where there are two. Sources take tissue as incompressible; a Poisson's ratio of 0.45 is a choice
with which a rigid ball meets 6 % less force, and which needs no mixed elements.
"""

from __future__ import annotations

from dataclasses import dataclass

from palpate.physics.materials.neo_hooke import NeoHookean

__all__ = ["TISSUES", "Tissue"]

POISSON = 0.45

ROULOT = "Roulot et al. 2008, J. Hepatology 48, 606-613"
ARDA = "Arda et al. 2011, Am. J. Roentgenology 197, 532-536"
SAMANI = "Samani, Zubovits & Plewes 2007, Phys. Med. Biol. 52, 1565-1576"
RZYMSKI = "Rzymski et al. 2011, Arch. Med. Sci. 7, 127-133"
PAILLER = "Pailler-Mattei, Bec & Zahouani 2008, Med. Eng. Phys. 30, 599-606"
KALRA = "Kalra, Lowe & Al-Jumaily 2016, J. Material Sci. Eng. 5"
AHN = "Ahn et al. 2010, Urology 76, 1007-1011"


@dataclass(frozen=True)
class Tissue:
    """A soft tissue: Young's modulus at small strains and its range in Pa, density in kg/m³, and their sources."""

    name: str
    young: float
    low: float
    high: float
    density: float
    measured: str  # what was measured, and how
    sources: tuple[str, ...]

    @property
    def material(self) -> NeoHookean:
        """A neo-Hookean material of this modulus."""
        source = f"{self.measured} ({'; '.join(self.sources)})"
        return NeoHookean(self.young, POISSON, self.density, name=self.name, source=source)


TISSUES: dict[str, Tissue] = {
    tissue.name: tissue
    for tissue in (
        Tissue(
            "liver", 5.5e3, 3.9e3, 7.1e3, 1060.0,
            "healthy, in 429 people, 5.49 ± 1.59 kPa by transient elastography",
            (ROULOT,),
        ),
        Tissue(
            "kidney", 5.0e3, 2.1e3, 7.9e3, 1050.0,
            "cortex, in 127 healthy people, 5.0 ± 2.9 kPa by shear waves",
            (ARDA,),
        ),
        Tissue(
            "fat", 3.3e3, 2.3e3, 13.7e3, 950.0,
            "of the breast, 3.25 ± 0.91 kPa pressed outside the body, 9.24 ± 4.48 kPa by shear waves within",
            (SAMANI, RZYMSKI),
        ),
        Tissue(
            "muscle", 11.1e3, 7.0e3, 15.2e3, 1050.0,
            "calf at rest, in 127 healthy people, 11.1 ± 4.1 kPa by shear waves",
            (ARDA,),
        ),
        Tissue(
            "skin", 35e3, 5e3, 140e6, 1090.0,
            "dermis, about 35 kPa by pressing; 5 kPa to 140 MPa over all ways of measuring",
            (PAILLER, KALRA),
        ),
        Tissue(
            "breast", 3.2e3, 2.6e3, 17.1e3, 1020.0,
            "gland, 3.24 ± 0.61 kPa pressed outside the body, 11.28 ± 5.79 kPa by shear waves within",
            (SAMANI, RZYMSKI),
        ),
        Tissue(
            "prostate", 17e3, 8e3, 26e3, 1050.0,
            "free of cancer, 46 glands, 17.0 ± 9.0 kPa pressed outside the body; with cancer 24.1 ± 14.5 kPa",
            (AHN,),
        ),
    )
}  # fmt: skip
"""Tissues by name. Densities are those of ICRU Report 44 (1989); the prostate's is that of muscle."""
