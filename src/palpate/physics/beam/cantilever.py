"""The cantilever: a plane beam, clamped at x = 0, that point loads bend."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.physics.advice import advise_on_modulus
from palpate.physics.beam.beam_loads import Load, LoadAndUnload, StepAndHold, as_loads
from palpate.physics.beam.beam_problem import BeamProblem
from palpate.physics.beam.cross_section import CrossSection
from palpate.physics.beam.section_laws import Kind, material_kind
from palpate.physics.materials.material import Material

__all__ = ["Cantilever"]

Kinematics = Literal["large", "small"]
FIBRES = 48  # with them the plastic moment of a circle is right to 5e-4
TOLERANCE = 1e-5  # relative error of a step of a history, unless another one is given
LONGEST = 100.0  # m: a longer beam was meant in mm


@dataclass(frozen=True)
class Cantilever:
    """A straight cantilever along x, clamped at x = 0, that moves in the x-y plane.

    Attributes
    ----------
    length : float
        Length in m.
    section : CrossSection
        For example ``Circle(radius=0.005)``.
    material : LinearElastic, Plastic or Viscoelastic
        It decides how the beam answers: always the same, or according to its history. A Viscoelastic one is over a
        LinearElastic and relaxes as a whole (``part="all"``), so that its Poisson's ratio stays.
    elements : int
        Approximate number of finite elements; every load and node of interest gets a vertex of its own.
    order : int
        Polynomial order of the elements, 2 or more: linear ones lock in shear.
    kinematics : "large" or "small"
        Geometrically exact (Reissner 1972), or the small displacements of Timoshenko 1921.
    self_weight : bool
        True for gravity, 9.80665 m/s² along -y.
    nodes : tuple of float
        Positions of interest in m; by default six, evenly spaced from clamp to tip.
    strain_limit : float
        Largest fibre strain for which the material's law is believed; beyond it a solve fails.
    fibres : int, optional
        Number of layers into which a section that yields is cut, by default 48; only for such beams.
    tolerance : float, optional
        Largest error of a step of a history, relative to the deflection and the energy, by default 1e-5; only for
        beams that remember.

    Raises
    ------
    UsageError
        For a value out of its bounds.
    """

    length: float
    section: CrossSection
    material: Material
    elements: int = 20
    order: int = 3
    kinematics: Kinematics = "large"
    self_weight: bool = False
    nodes: tuple[float, ...] = field(default=())
    strain_limit: float = 0.5
    fibres: int | None = None
    tolerance: float | None = None

    def __post_init__(self) -> None:
        checks.positive("The cantilever's length", self.length, "m")
        checks.fits("The cantilever's number of elements", self.elements, least=1)
        checks.finite("The cantilever's order", self.order)
        _check(2 <= self.order <= 8, "order", self.order, "between 2 and 8: linear elements lock in shear")
        checks.one_of("The cantilever's kinematics", self.kinematics, get_args(Kinematics))
        checks.positive("The cantilever's strain limit", self.strain_limit, infinite=True)
        _check_section(self.section)
        _check_sizes(self.length, self.section)
        _check_material(self.material)
        advise_on_modulus("of the cantilever", self.material)
        self._check_memory()
        nodes = tuple(self.nodes) or tuple(float(x) for x in np.linspace(0, self.length, 6))
        for x in nodes:
            checks.fits("A node of interest", x, "m", least=0, most=self.length)
        object.__setattr__(self, "nodes", tuple(sorted({float(x) for x in nodes})))

    @property
    def kind(self) -> Kind:
        """Kind of the beam by its material: it is elastic, yields ("plastic") or creeps ("viscous")."""
        kind = material_kind(self.material)
        assert kind is not None  # checked when the beam was made
        return kind

    @property
    def fibre_count(self) -> int:
        """Layers of a section that yields."""
        return FIBRES if self.fibres is None else self.fibres

    @property
    def step_tolerance(self) -> float:
        """Largest relative error of a step of a history."""
        return TOLERANCE if self.tolerance is None else self.tolerance

    def problem(self, loads: Load | Sequence[Load]) -> BeamProblem:
        """Put loads on the beam, and return a problem that can be solved.

        Raises
        ------
        UsageError
            If a load is off the beam, two loads share a name, or a load has a history that the beam does not remember.
        """
        several = as_loads(loads)
        _check_histories(self.kind, several)
        for load in several:
            on_beam = 1e-6 * self.length < self.position(load) <= self.length
            _check(on_beam, f"load {load.name!r}", load.at, "beyond the clamp, on the beam")
        return BeamProblem(self, several)

    def position(self, load: Load) -> float:
        """Return the place of a load in m along the beam."""
        return self.length if load.at is None else float(load.at)

    def vertices(self, loads: Sequence[Load] = ()) -> np.ndarray:
        """Positions of the mesh's vertices in m, shape (node,), those of loads and of interest among them."""
        places = np.array([0.0, self.length, *self.nodes, *(self.position(load) for load in loads)])
        # positions closer than a billionth of the length are one
        fixed = np.unique(np.round(places / self.length, 9)) * self.length
        pieces = [
            np.linspace(
                left, right, max(1, round(self.elements * (right - left) / self.length)), endpoint=False
            )
            for left, right in itertools.pairwise(fixed)
        ]
        return np.concatenate([*pieces, fixed[-1:]])

    def _check_memory(self) -> None:
        for name, value in (("fibres", self.fibres), ("tolerance", self.tolerance)):
            if value is None:
                continue
            checks.finite(f"The cantilever's {name}", value)
            useful = self.kind == "plastic" or (name == "tolerance" and self.kind == "viscous")
            _check(useful, name, value, f"left out: {self.material.name} has no use for it")
        if self.kind == "plastic":
            _check(2 <= self.fibre_count <= 1000, "fibres", self.fibres, "a whole number from 2 to 1000")
            _check(hasattr(self.section, "fibres"), "section", self.section, _FIBRED)
        if self.kind == "viscous":
            material: Any = self.material
            _check(material.prony.equilibrium > 1e-9, "Prony series", material.prony, _FLOWS)
            _check(getattr(material, "part", "all") == "all", "material", material, _WHOLE)
        _check(1e-9 <= self.step_tolerance <= 0.1, "tolerance", self.tolerance, "between 1e-9 and 0.1")


def _check_section(section: object) -> None:
    if not all(hasattr(section, name) for name in ("area", "second_moment", "half_height", "shear_factor")):
        raise UsageError(
            f"The cantilever's section is {section!r}, of type {type(section).__name__}.",
            why="It must be a cross-section, with its measures in m.",
            fix="Pass Circle(radius=0.005), Rectangle(width=0.02, height=0.004) or a Section of its numbers.",
        )


def _check_sizes(length: float, section: Any) -> None:
    """Refuse lengths in m that tell of millimetres."""
    if length > LONGEST:
        raise UsageError(
            f"The cantilever would be {length:g} m long.",
            why=f"Lengths are in m, and a beam to be touched measures at most {LONGEST:g} m.",
            fix=f"Pass length={length / 1000:g} for {length:g} mm.",
        )
    if section.half_height > length:
        raise UsageError(
            f"The cantilever's section is {2 * section.half_height:g} m high, the beam {length:g} m long.",
            why="Lengths are in m, and a beam is longer than its section is high.",
            fix=f"Pass {section.half_height / 1000:g} for {section.half_height:g} mm.",
        )


_FLOWS = "one that leaves a share of the modulus in the end: the sum of the others below 1, else the beam flows away"
_WHOLE = "Viscoelastic(..., part='all'): stretching and shear relax alike in a beam, so Poisson's ratio has to stay"
_FIBRED = "a Circle or a Rectangle: one that yields is cut into fibres, and bare numbers have no shape"


def _check_material(material: object) -> None:
    if material_kind(material) is not None:
        return
    by_name = f"named_material({material!r})" if isinstance(material, str) else 'named_material("nylon")'
    raise UsageError(
        f"The cantilever's material is {material!r}, of type {type(material).__name__}.",
        why="It must be a LinearElastic, a Plastic or a Viscoelastic over a LinearElastic; names: named_material.",
        fix=f"Pass {by_name}, or LinearElastic(young=70e9, poisson=0.33, density=2700.0).",
    )


def _check_histories(kind: Kind, loads: Sequence[Load]) -> None:
    for load, memory in ((load, _memory_of(load)) for load in loads):
        if memory not in {"", kind}:
            raise UsageError(
                f"The load {load.name!r} is a {type(load).__name__}, and the beam is {kind}.",
                why=f"Only a {memory} beam answers to such a history.",
                fix="Take a load without a history, such as TipLoad(0, 5), or another material.",
            )
    if sum(isinstance(load, StepAndHold) for load in loads) > 1:
        raise UsageError(
            "Two loads are held for times of their own.",
            why="The answer is that at the end of one such time.",
            fix="Give one StepAndHold, and the other loads as TipLoad or PointLoad, which act from the beginning.",
        )


def _memory_of(load: Load) -> str:
    """Return the kind of beam that a load with a history is for; empty for one without."""
    if isinstance(load, LoadAndUnload):
        return "plastic"
    return "viscous" if isinstance(load, StepAndHold) else ""


def _check(holds: bool, what: str, value: object, rule: str) -> None:
    if not holds:
        raise UsageError(
            f"The cantilever's {what} is {value!r}.",
            why=f"It must be {rule}.",
            fix="Correct the value.",
        )
