"""Bodies that the surrogates are measured on: shape, material, probe, and the part of the surface that is pressed.

Of a body with symmetries only one part is solved, a quadrant; its images stand for the rest. Every study has the
sphere of 10 mm with a pad of k = 2·10⁶ N/m³ and a stop of 4 mm; those ending in -10k have ten times that k.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.physics.interactions import SphereProbe
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block, Dome, LayeredBlock, Organ
from palpate.physics.solid import Body, BodyFamily, FamilyProblem, SolidProblem, Varied

__all__ = ["STUDIES", "TouchStudy"]

RADIUS, PAD, STIFF_PAD, STOP = 0.01, 2e6, 2e7, 0.004
POISSON = 0.45
LEAST = 2e-4  # m: depths begin here, where the force is a thousandth of the largest
CLEAR = 0.012  # m of a named surface around a place: half the widest contact


@dataclass(frozen=True)
class TouchStudy:
    """One body under the probe.

    Attributes
    ----------
    body : callable
        () → Body.
    touches : str
        Surface that is pressed.
    depth : float
        Largest, in m.
    over : pair of corners, optional
        Box of the places in m; without it all of the surface that is `CLEAR` of its rim.
    pad : float
        In N/m³.
    symmetry : str
        ``"square"`` (8 images), ``"round"`` or ``"none"``.
    about : (2,) tuple
        Where the axis of symmetry stands, in m.
    to_edges : bool
        Whether `over` ends at edges of the body: training places are then denser there, where the body gives way
        within a few mm (by the sine, as Chebyshev's points are).
    within : float
        Farthest place from that axis, in m.
    inputs : tuple of Varied
        Beyond the position: properties of the materials.
    element : float, optional
        Size of the elements that are pressed, in m; the sphere's own choice by default.
    wanted : int
        Number of training solves at which targets are set.
    target : tuple of float
        Median and 95th percentile of the relative force error that are asked for; NaN where nothing is.
    """

    body: Callable[[], Body]
    touches: str = "top"
    depth: float = 0.012
    over: Any = None
    pad: float = PAD
    symmetry: str = "square"
    about: tuple[float, float] = (0.0, 0.0)
    to_edges: bool = False
    within: float = np.inf
    inputs: tuple[Varied, ...] = ()
    element: float | None = None
    wanted: int = 80
    target: tuple[float, float] = (0.005, 0.02)

    @property
    def probe(self) -> SphereProbe:
        """The sphere."""
        return SphereProbe(
            RADIUS,
            touches=self.touches,
            pad=self.pad,
            stop=STOP,
            depth=(0.0, self.depth),
            over=self.over,
        )

    def problem(self, *, finer: float = 1.0) -> SolidProblem | FamilyProblem:
        """The body under the probe; elements `finer` times smaller where it is pressed."""
        body, probe = self.body(), self.probe
        element = self.element
        if finer != 1.0:
            element = (element or min(f.element for f in probe.refinements(body.geometry))) / finer
        whole = BodyFamily(body, self.inputs) if self.inputs else body
        return whole.problem(probe, element=element)


def _block() -> Body:
    return Body(Block((0.1, 0.1, 0.05)), NeoHookean(9e3, POISSON), fixed="bottom")


def _layered() -> Body:
    layers = (("skin", 0.003), ("fat", 0.009), ("muscle", 0.028))
    moduli = {"skin": 30e3, "fat": 4e3, "muscle": 15e3}
    materials = {name: NeoHookean(modulus, POISSON) for name, modulus in moduli.items()}
    return Body(LayeredBlock((0.1, 0.1), layers), materials, fixed="bottom")


def _dome() -> Body:
    materials = {"skin": NeoHookean(20e3, POISSON), "body": NeoHookean(6e3, POISSON)}
    return Body(Dome(0.06, 0.045, layer=0.003), materials, fixed="bottom")


def _liver() -> Body:
    return Body(Organ(0.2), NeoHookean(6e3, POISSON), fixed="attached")


_WHOLE = ((0.05, 0.05), (0.1, 0.1))  # a quadrant of the whole top face
_MIDDLE = ((0.05, 0.05), (0.08, 0.08))  # of its middle, 60 mm wide
_MERIDIAN = ((0.0, -0.001), (0.045, 0.001))  # what is solved of a round body, and then turned
_BLOCK = TouchStudy(
    _block,
    over=_WHOLE,
    to_edges=True,
    about=(0.05, 0.05),
    element=0.0035,
    wanted=40,
    target=(0.003, 0.01),
)
# no edge near: the easiest to learn
_CENTRE = replace(
    _BLOCK,
    over=((0.05, 0.05), (0.07, 0.07)),
    depth=0.01,
    to_edges=False,
    element=0.006,
    wanted=10,
    target=(0.0019, 0.0074),
)
# a skin of 3 mm needs two elements through it: one alone makes it 2 to 5 % too stiff
_LAYERED = TouchStudy(_layered, over=_MIDDLE, about=(0.05, 0.05), element=0.0025)
_BREAST = TouchStudy(_dome, over=_MERIDIAN, symmetry="round", within=0.045, element=0.004)

STUDIES: dict[str, TouchStudy] = {
    "block": _BLOCK,
    "block-10k": replace(_BLOCK, pad=STIFF_PAD),
    "block-centre": _CENTRE,
    "layered": _LAYERED,
    "layered-10k": replace(_LAYERED, pad=STIFF_PAD),
    "breast-dome": _BREAST,
    "breast-dome-10k": replace(_BREAST, pad=STIFF_PAD),
    "liver": TouchStudy(
        _liver,
        touches="front",
        depth=0.015,
        symmetry="none",
        element=0.0065,
        wanted=200,
        target=(np.nan, 0.03),
    ),
    "family": replace(
        _LAYERED,
        element=0.005,
        inputs=(Varied("fat.young", 2e3, 8e3), Varied("muscle.young", 8e3, 30e3)),
        wanted=200,
        target=(np.nan, 0.03),
    ),
}
"""By name, as on the command line and in the files' names."""
