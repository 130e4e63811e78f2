"""From the record of a study of touches to the objects it means."""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.physics import (
    Block,
    Body,
    BodyFamily,
    Cylinder,
    Dome,
    Inclusion,
    LayeredBlock,
    NeoHookean,
    Organ,
    SphereProbe,
    Varied,
    named_material,
)
from palpate.physics.solid import FamilyProblem
from palpate.physics.solid.body_symmetry import fundamental_part
from palpate.physics.solid.solid_problem import SolidProblem
from palpate.study.touching.records import TouchStudy
from palpate.study.touching.shapes import (
    BlockRecord,
    CylinderRecord,
    DomeRecord,
    LayeredRecord,
    SoftRecord,
)
from palpate.validation import Limits

__all__ = ["limits_of", "points_of", "probe_of", "problem_of", "solid_of"]


def solid_of(study: TouchStudy) -> Body:
    """The study's body."""
    b = study.body
    if isinstance(b, LayeredRecord):
        layers = tuple((layer.name, layer.thickness) for layer in b.layers)
        tissues = {layer.name: _material(layer.material) for layer in b.layers}
        return Body(LayeredBlock(b.extent, layers, element=b.element), tissues, fixed=b.fixed)
    if isinstance(b, DomeRecord):
        return _dome(b)
    if isinstance(b, BlockRecord):
        shape: Any = Block(b.size, element=b.element)
    elif isinstance(b, CylinderRecord):
        shape = Cylinder(b.radius, b.height, element=b.element)
    else:
        shape = Organ(b.length, b.seed, element=b.element)
    return Body(shape, _material(b.material), fixed=b.fixed)


def _dome(b: DomeRecord) -> Body:
    inside = Inclusion(b.inclusion.centre, b.inclusion.radius) if b.inclusion else None
    shape = Dome(b.radius, b.height, b.skin.thickness if b.skin else 0.0, inside, element=b.element)
    materials = {"body": _material(b.material)}
    if b.skin:
        materials["skin"] = _material(b.skin.material)
    if b.inclusion:
        materials["inclusion"] = _material(b.inclusion.material)
    return Body(shape, materials, fixed=b.fixed)


def _material(value: str | SoftRecord) -> Any:
    if isinstance(value, str):
        return named_material(value)
    return NeoHookean(value.young, value.poisson, density=value.density, name=value.name)


def probe_of(study: TouchStudy) -> SphereProbe:
    """The study's probe, over all that it shall touch."""
    p = study.probe
    return SphereProbe(p.radius, touches=p.touches, pad=p.pad, stop=p.stop, depth=p.depth, over=p.over)


def problem_of(study: TouchStudy, *, whole: bool = False) -> SolidProblem | FamilyProblem:
    """Body or family under the probe; over the part that is solved, unless the `whole` is asked for."""
    body, probe = solid_of(study), probe_of(study)
    if study.sweep.symmetric and not whole:
        probe = fundamental_part(body, probe)
    varied = tuple(Varied(one.path, one.low, one.high) for one in study.varied)
    family = BodyFamily(body, varied) if varied else body
    return family.problem(probe, element=study.sweep.element)


def points_of(study: TouchStudy, problem: SolidProblem | FamilyProblem, *, test: bool = False) -> np.ndarray:
    """Inputs (N, n), of which the first 3 are the ball's centre in m, column by column: to learn from, or to test."""
    part = study.test if test else study.sweep
    return problem.design(part.samples, part.seed, depths=part.depths)


def limits_of(study: TouchStudy) -> Limits:
    """What is asked of the study's model; a key that is 0 asks nothing."""
    asked = study.target.model_dump()
    band = asked.pop("coverage")
    limits: dict[str, Any] = {name: value or None for name, value in asked.items()}
    limits["border_loop_work"] = limits["loop_work"]
    return Limits(**limits, interval_coverage=None if band == (0.0, 1.0) else band)
