"""The cantilevers of the founding study, two with several loads and two that remember, by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from palpate.checks import did_you_mean
from palpate.errors import UsageError
from palpate.physics.beam.beam_loads import Load, LoadAndUnload, PointLoad, StepAndHold, TipLoad
from palpate.physics.beam.beam_problem import BeamProblem
from palpate.physics.beam.cantilever import Cantilever
from palpate.physics.beam.cross_section import Circle
from palpate.physics.materials.library import named_material
from palpate.physics.materials.linear import LinearElastic

__all__ = ["HISTORY_PRESETS", "PRESETS", "Preset", "preset"]


@dataclass(frozen=True)
class Preset:
    """A body, its loads and the points at which to solve.

    Attributes
    ----------
    name, summary : str
        Name, and one line on what it is.
    body : Cantilever
        The beam.
    loads : tuple of loads
        Its loads, whose inputs are the inputs of a sweep.
    design : "grid" or "sobol"
        Design by which the ranges of the loads are sampled.
    samples : int
        Number of solves; a grid of one load has its ends among them.
    """

    name: str
    summary: str
    body: Cantilever
    loads: tuple[Load, ...]
    design: Literal["grid", "sobol"]
    samples: int

    def problem(self) -> BeamProblem:
        """Return the body under its loads, ready to be solved."""
        return self.body.problem(self.loads)


def _founding_beam(material: str) -> Cantilever:
    """The cantilever of Narayanan, Singla, Garimella, Waz & Krovi 2011: L = 1 m, r = 5 mm, six nodes.

    The founding text is ambiguous. It gives the length as 0.1 m and its node table as 1 m; 1 m is taken here. It gives
    the loads as 0 … 10 N by 0.05 and as 0 … 5 N by 0.01; both are presets. Its materials are copper and nylon.
    """
    return Cantilever(
        length=1.0, section=Circle(radius=0.005), material=named_material(material, LinearElastic)
    )


def _tip(material: str, newton: int, samples: int) -> Callable[[], Preset]:
    def build() -> Preset:
        name = f"beam-{material}" + ("" if newton == 5 else f"-{newton}n")
        summary = f"{material} cantilever of the founding study, tip load 0 … {newton} N, {samples} solves"
        return Preset(name, summary, _founding_beam(material), (TipLoad(0.0, newton),), "grid", samples)

    return build


def _beam_plane() -> Preset:
    """Nylon cantilever whose tip is pushed in the plane.

    The beam buckles under an axial load of π²EI/4L² = 2.42 N (Euler 1744); 1.5 N stays well below it. With at
    most 5 N across no second equilibrium exists: the shooting of the inextensible elastica finds none.
    """
    loads = (
        TipLoad(-1.5, 1.5, direction=(1.0, 0.0), name="P_x"),
        TipLoad(-5.0, 5.0, direction=(0.0, 1.0), name="P_y"),
    )
    summary = "nylon cantilever, tip pushed in the plane: P_x ±1.5 N, P_y ±5 N, 768 solves"
    return Preset("beam-plane", summary, _founding_beam("nylon"), loads, "sobol", 768)


def _beam_three_loads() -> Preset:
    """Nylon cantilever pushed down at three nodes: the n-dimensional case that the founding study planned."""
    loads = tuple(PointLoad(f"P_{x:g}m", x, 0.0, 2.0) for x in (0.4, 0.6, 1.0))
    summary = "nylon cantilever pushed down at 0.4, 0.6 and 1.0 m by 0 … 2 N each, 768 solves"
    return Preset("beam-three-loads", summary, _founding_beam("nylon"), loads, "sobol", 768)


def _beam_plastic() -> Preset:
    """The founding copper beam, annealed, loaded past yield and unloaded.

    Its outer fibres yield at the clamp from π r³ σ_y/4L = 12.3 N on, and without hardening it would collapse at
    4 r³ σ_y/3L = 20.9 N.
    """
    from palpate.physics.materials.plastic import Plastic

    copper = named_material("annealed copper", Plastic)
    body = Cantilever(length=1.0, section=Circle(radius=0.005), material=copper)
    loads = (LoadAndUnload("P", peak=(0.0, 25.0)),)
    summary = "annealed copper cantilever, tip loaded to P_max = 0 … 25 N, then to P = 0 … 25 N, 256 solves"
    return Preset("beam-plastic", summary, body, loads, "sobol", 256)


def _beam_viscoelastic() -> Preset:
    """The founding nylon beam with an illustrative creep, under a load that is put on at once and held.

    The Prony series is an illustration, no measurement: nylon's depends on its kind, moisture and temperature.
    """
    from palpate.physics.materials.viscous import Viscoelastic

    material = Viscoelastic(
        named_material("nylon", LinearElastic),
        ((0.3, 0.1), (0.2, 2.0)),
        part="all",
        name="creeping nylon",
        source="elastic constants of the founding case; the Prony series is an illustration, not measured",
    )
    body = Cantilever(length=1.0, section=Circle(radius=0.005), material=material)
    loads = (StepAndHold("P", 0.0, 5.0, held=(0.0, 10.0)),)
    summary = "nylon cantilever with illustrative creep, tip load 0 … 5 N held for 0 … 10 s, 256 solves"
    return Preset("beam-viscoelastic", summary, body, loads, "sobol", 256)


PRESETS: dict[str, Callable[[], Preset]] = {
    "beam-copper": _tip("copper", 5, 501),
    "beam-nylon": _tip("nylon", 5, 501),
    "beam-copper-10n": _tip("copper", 10, 201),
    "beam-nylon-10n": _tip("nylon", 10, 201),
    "beam-plane": _beam_plane,
    "beam-three-loads": _beam_three_loads,
}
"""Every preset of an elastic beam by its name; studies of these can be named."""

HISTORY_PRESETS: dict[str, Callable[[], Preset]] = {
    "beam-plastic": _beam_plastic,
    "beam-viscoelastic": _beam_viscoelastic,
}
"""Every preset of a beam that remembers by its name."""


def preset(name: str) -> Preset:
    """Build a preset.

    Raises
    ------
    UsageError
        If the name is not known; the message lists the names that are.
    """
    presets = PRESETS | HISTORY_PRESETS
    if name in presets:
        return presets[name]()
    raise UsageError(
        f"There is no preset called {name!r}.",
        why=f"Known presets: {', '.join(presets)}.",
        fix=did_you_mean(name, presets, shown=repr) or "Choose one of these.",
    )
