"""A modulus from indentation: finite-element solves of a ball on a slab, scaled to the measured forces.

Hertz's force on a half-space, 4/3 E/(1 − ν²) √R d^(3/2) (Hertz 1882), with the series for a bonded layer of Dimitriadis
et al. (2002, Biophys. J. 82, 2798-2810), gives a first guess. At a given depth the force on a rigid ball is
proportional to the moduli of a law, so that one run of solves, at several depths, serves all: the modulus is a linear
least square. The ball bears a pad as all probes do, here so stiff beside the body that it takes under half a percent. A
quarter of the slab is solved.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import SolverError, UsageError
from palpate.physics.interactions import Fixed, PrescribedDisplacement, SphereProbe
from palpate.physics.materials.material_fit import Constant, MaterialFit
from palpate.physics.materials.neo_hooke import NeoHookean
from palpate.physics.materials.specimen_tests import IndentationTest
from palpate.physics.materials.viscous import Scaled
from palpate.physics.shapes import Block, FineMesh
from palpate.physics.solid.solid_body import Body

__all__ = ["fit_indentation", "hertz_modulus", "indentation_forces"]

ACROSS = 5  # elements over the radius of the largest contact: the force is then 0.3 % too large
STIFF = 300.0  # stiffness of the pad over E/((1 − ν²) √(R d)): it takes 0.3 % of the force
DEPTHS = (0.06, 0.2, 0.42, 0.7, 1.0)  # depths that are solved, as shares of a record's largest
HIGHEST = 0.4999  # Poisson's ratio from which on a slab is solved as nearly incompressible
_FAR = 1e3  # m, farther than any slab reaches


@dataclass(frozen=True)
class _QuarterProbe(SphereProbe):
    """A ball above the corner of a quarter of the slab, whose mesh is fine under the contact only."""

    fine: float = 1e-3
    reach: float = 5e-3

    def refinements(self, geometry: Any) -> tuple[FineMesh, ...]:
        height = geometry.size[2]
        return (FineMesh(self.touches, self.fine, (0.0, 0.0, height), (self.reach, self.reach, height)),)


def fit_indentation(law: Any, tests: Sequence[Any], poisson: float, confidence: float = 0.95) -> MaterialFit:
    """Fit the modulus of a law to records of indentation, of any balls and slabs.

    All moduli of `law` are scaled by one factor; ``"neo-hookean"`` or None is a neo-Hookean law with the Poisson's
    ratio that is given, below 0.5, while another law has its own. `confidence` is the level of the interval.
    Indentations can't be fitted together with other tests, nor where the forces don't push the ball back; a slab that
    can't be solved is a `SolverError`.
    """
    if not all(isinstance(t, IndentationTest) for t in tests):
        raise UsageError(
            "Indentations and tests of stress can't be fitted together.",
            why="An indentation tells one modulus, that of a law of given shape.",
            fix="Fit the tests of stress first, and scale the law that comes out: fit(found.material, indentation).",
        )
    if not min(np.abs(t.force).max() for t in tests) > 0:
        raise UsageError(
            "An indentation has no force.",
            why="All its forces are 0, and a modulus is the scale of a force.",
            fix="Check the column of the force, and that the rows go beyond the first contact.",
        )
    base = _law_of(law, poisson, tests)
    curves = [_Curve.of(base, test) for test in tests]
    model = np.concatenate(
        [c.at(t.depth) / np.abs(t.force).max() for c, t in zip(curves, tests, strict=True)]
    )
    measured = np.concatenate([t.force / np.abs(t.force).max() for t in tests])
    factor = float(model @ measured / (model @ model))
    if not factor > 0:
        raise UsageError(
            "The forces pull the ball into the slab.",
            why=f"A modulus of {factor * base.young:.3g} Pa would fit them best.",
            fix="Turn the sign of the forces: positive pushes the ball back.",
        )
    return _result(law, base, factor, tests, curves, model, measured, confidence)


def _result(
    law: Any,
    base: Any,
    factor: float,
    tests: Sequence[IndentationTest],
    curves: Sequence[_Curve],
    model: np.ndarray,
    measured: np.ndarray,
    confidence: float,
) -> MaterialFit:
    from scipy.special import stdtrit

    residual = factor * model - measured
    rows = len(measured)
    spread = math.sqrt(float(residual @ residual) / (rows - 1) / float(model @ model))
    spread *= float(stdtrit(rows - 1, 0.5 + confidence / 2))
    young = [f * base.young for f in (factor, factor - spread, factor + spread)]
    own = law is None or isinstance(law, str)
    material: Any = NeoHookean(young[0], base.poisson) if own else Scaled(base, factor, part="all")
    errors = {
        t.name: float(np.sqrt(np.mean((factor * c.at(t.depth) - t.force) ** 2)))
        for t, c in zip(tests, curves, strict=True)
    }
    return MaterialFit(
        material,
        "neo-hookean" if own else base.law,
        (Constant("young", young[0], young[1], young[2], "Pa"),),
        tuple(tests),
        errors,
        None,
        _notes(tests, base, law is None),
        (),
        confidence,
        "peak",
        float(np.sqrt(np.mean(residual**2))),
        {"young": young[0]} if own else None,
        tuple((c.depths, factor * c.forces) for c in curves),
    )


def hertz_modulus(test: IndentationTest, poisson: float) -> float:
    """Return Young's modulus in Pa by the theory of small contacts on a bonded layer, a first guess."""
    chi = np.sqrt(test.radius * test.depth) / test.thickness
    a = -(1.2876 - 1.4678 * poisson + 1.3442 * poisson**2) / (1 - poisson)
    b = (0.6387 - 1.0277 * poisson + 1.5164 * poisson**2) / (1 - poisson)
    pi = math.pi
    layer = (
        1 - 2 * a / pi * chi + 4 * a**2 / pi**2 * chi**2 - 8 / pi**3 * (a**3 + 4 * pi**2 / 15 * b) * chi**3
    )
    layer = layer + 16 * a / pi**4 * (a**3 + 3 * pi**2 / 5 * b) * chi**4
    unit = 4 / 3 / (1 - poisson**2) * math.sqrt(test.radius) * test.depth**1.5 * np.maximum(layer, 1.0)
    return float(unit @ test.force / (unit @ unit))


def indentation_forces(material: Any, test: IndentationTest, depths: Sequence[float]) -> np.ndarray:
    """Return the forces (n,) in N on the ball at rising depths in m, by finite elements."""
    radius, height, deepest = test.radius, test.thickness, max(depths)
    contact = math.sqrt(radius * deepest)
    width = test.width if test.width is not None else max(6 * contact, 3 * height)
    block = Block((width / 2, width / 2, height), element=min(height / 3, width / 6))
    body = Body(block, material, held=(_mirror("x"), _mirror("y")))
    modulus = 2 * material.shear_modulus / (1 - material.poisson)
    probe = _QuarterProbe(
        radius,
        pad=STIFF * modulus / contact,
        stop=None,
        depth=(0.0, 1.1 * deepest),
        over=((0.0, 0.0), (1e-6, 1e-6)),
        fine=contact / ACROSS,
        reach=1.2 * contact,
    )
    solver = body.problem(probe).open()
    forces = []
    for depth in depths:
        found = solver.solve((0.0, 0.0, height + radius - depth))
        if not found.converged:
            raise SolverError(
                f"The slab of {height:g} m could not be solved at a depth of {depth:g} m.",
                why=f"{found.message}.",
                fix="Leave out the deepest rows, or check radius and thickness.",
            )
        forces.append(4 * float(found.response[2]))
    return np.array(forces)


@dataclass(frozen=True, eq=False)
class _Curve:
    """Forces in N at depths in m of the law before it is scaled."""

    depths: np.ndarray
    forces: np.ndarray

    @classmethod
    def of(cls, material: Any, test: IndentationTest) -> _Curve:
        depths = np.array(DEPTHS) * float(test.depth.max())
        return cls(
            np.append(0.0, depths), np.append(0.0, indentation_forces(material, test, depths.tolist()))
        )

    def at(self, depth: np.ndarray) -> np.ndarray:
        """Return the forces (N,) at depths; their powers 2/3 are nearly straight, and interpolated."""
        from scipy.interpolate import PchipInterpolator

        straight = PchipInterpolator(self.depths, np.maximum(self.forces, 0.0) ** (2 / 3))
        return np.asarray(np.maximum(straight(depth), 0.0) ** 1.5)


def _law_of(law: Any, poisson: float, tests: Sequence[IndentationTest]) -> Any:
    """Return the law before it is scaled."""
    if (
        law is None
        or (isinstance(law, str) and law.lower() in {"neo-hookean", "neo-hooke"})
        or law is NeoHookean
    ):
        if not -1 < poisson <= 0.5:
            raise UsageError(
                f"Poisson's ratio is {poisson!r}.",
                why="It lies above -1 and is at most 0.5.",
                fix="Pass 0.45 to 0.5 for soft tissue and elastomers, or the ratio that was measured.",
            )
        ratio = min(poisson, HIGHEST)
        guess = float(np.mean([hertz_modulus(t, ratio) for t in tests]))
        return NeoHookean(max(guess, 1.0) if math.isfinite(guess) else 1.0, ratio)
    if isinstance(law, str | type) or not hasattr(law, "shear_modulus"):
        raise UsageError(
            f"The constants of {law!r} can't be fitted to an indentation.",
            why="One curve of force against depth tells one modulus.",
            fix="Leave the law out for neo-Hookean, or pass a material whose shape is known: it is scaled.",
        )
    return law


def _mirror(axis: str) -> Fixed:
    """Return the face at 0 of an axis as a plane of symmetry."""
    upper = [_FAR, _FAR, _FAR]
    upper["xyz".index(axis)] = 0.0
    box = ((-_FAR, -_FAR, -_FAR), (upper[0], upper[1], upper[2]))
    return Fixed(PrescribedDisplacement("side", axis, (-_FAR, _FAR), sliding=True, within=box), (0.0,))


def _notes(tests: Sequence[IndentationTest], base: Any, chosen: bool) -> tuple[str, ...]:
    """Return sentences on what indentation does not tell."""
    low, high = 1 - 0.45**2, 1 - 0.5**2
    notes = [
        f"Poisson's ratio {base.poisson:g} is given, not fitted: a curve tells about E/(1 − ν²), more on thin slabs. "
        f"Between ν 0.45 and 0.5 the modulus of a thick slab changes by {low / high - 1:.0%}.",
        "Depths count from the first contact: a contact found too late makes the modulus too large.",
        "The ball is rigid and slides without friction; the slab is bonded to a rigid ground.",
    ]
    if chosen:
        notes.append("The shape of the law is assumed; how the material stiffens tell tests of stress.")
    strains = [0.2 * math.sqrt(t.depth.max() / t.radius) for t in tests]
    if max(strains) < 0.05:
        notes.append("Strains stay under 5 %: the modulus is that of small strain.")
    return tuple(notes)
