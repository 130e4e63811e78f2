"""Checks of a body, its parts and its inputs.

Each raises a `UsageError` with a hint on what was meant, often other units.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from numbers import Integral
from typing import Any

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.format import millimetres
from palpate.physics.advice import advise
from palpate.physics.interactions.interaction import Fixed, Interaction
from palpate.physics.interactions.loads import BodyForce, PointForce, Pressure, SurfaceTraction
from palpate.physics.interactions.pinch import Pinch
from palpate.physics.interactions.pressing import PressingTool
from palpate.physics.shapes.naming import members, require_known
from palpate.physics.shapes.surface_checks import surface_gap
from palpate.physics.shapes.surface_repair import place
from palpate.units import Range, bounds

__all__ = [
    "advise_on_sizes",
    "by_region",
    "longest_side",
    "require_element",
    "require_finite",
    "require_geometry",
    "require_held_values",
    "require_lengths",
    "require_near",
    "require_no_loose_part",
    "require_order",
    "require_weight",
    "surfaces_of",
]

# radius over the body's longest side: larger spheres are flat, millimetres taken for metres larger
FLATTEST = 20.0
# lengths of interactions in m, and how many times the body's longest side they may be
LENGTHS = {"radius": FLATTEST, "depth": 1.0, "stop": 1.0, "displacement": 1.0, "element": 1.0}
# interactions that push and hold nothing
PUSHING = (PressingTool, Pinch, PointForce, SurfaceTraction, BodyForce, Pressure)
# members that a geometry and a material must have
GEOMETRY = ("surfaces", "regions", "mesh", "rest", "describe")
MATERIAL = ("poisson", "density", "kinematics", "states", "volumetric", "energy", "advance", "describe")


def require_geometry(thing: Any) -> None:
    """Refuse what is no geometry."""
    if _lacks(thing, GEOMETRY) or isinstance(thing, type):
        raise UsageError(
            f"The geometry of a body is {thing!r}, of type {type(thing).__name__}.",
            why="A geometry has surfaces and regions, and can be meshed.",
            fix="Pass for example Block(size=(0.10, 0.10, 0.05)), sizes in m.",
        )


def surfaces_of(given: Any, geometry: Any) -> tuple[str, ...]:
    """Return the names of fixed surfaces, all known to the geometry, ``"side"`` of a box written out."""
    names = given if isinstance(given, Iterable) and not isinstance(given, str) else (given,)
    surfaces: list[str] = []
    for name in names:
        require_known("surface", name, geometry.surfaces)
        surfaces += members(name, geometry.surfaces)
    return tuple(dict.fromkeys(surfaces))


def by_region(
    given: Any, regions: tuple[str, ...], needed: tuple[str, ...] = MATERIAL
) -> tuple[tuple[str, Any], ...]:
    """Return (region, material) in the order of the regions, from one material for all or one for each.

    `needed` are the names of the members that a material must have.
    """
    if isinstance(given, tuple):
        given = dict(given)  # a copy of a body brings its material along as kept
    if not isinstance(given, Mapping):
        given = dict.fromkeys(regions, given)
    for name in given:
        require_known("region", name, regions)
    missing = [region for region in regions if region not in given]
    if missing:
        raise UsageError(
            f"The region {missing[0]!r} has no material.",
            why=f"The body's regions are {', '.join(regions)}; given were {', '.join(given)}.",
            fix="Name a material for each region.",
        )
    for material in given.values():
        _require_material(material, needed)
    return tuple((region, given[region]) for region in regions)


def require_held_values(given: Any) -> tuple[Fixed, ...]:
    """Return constant interactions, each of them `Fixed` with its inputs."""
    parts = tuple(given) if isinstance(given, tuple | list) else (given,)
    for part in parts:
        if isinstance(part, Fixed):
            continue
        raise UsageError(
            f"{part} is held by the body without inputs."
            if isinstance(part, Interaction)
            else f"{part!r} is held.",
            why="What always acts is an interaction with the values of its inputs.",
            fix="Wrap it: held=Fixed(interaction, values), for example "
            'Fixed(PrescribedDisplacement("top", "z", (-0.01, 0.0)), -0.004).',
        )
    return parts


def require_order(order: Any) -> None:
    """Refuse a polynomial order that is no whole number from 2 on."""
    if isinstance(order, Integral) and int(order) >= 2:
        return
    raise UsageError(
        f"The order of a solid is {order!r}.",
        why="It is a whole number; displacements of first order lock in bending and pair with no stable pressure.",
        fix="Use order=2, or 3 on a coarse mesh.",
    )


def require_weight(materials: Mapping[str, Any]) -> None:
    """Refuse gravity on a material without a density."""
    for region, material in materials.items():
        if not material.density:
            raise UsageError(
                f"Gravity acts, but the material of the region {region!r} has no density.",
                why="The weight is density times gravity: the region would have none.",
                fix="Give the material a density in kg/m³, for example NeoHookean(..., density=1000).",
            )


def _require_material(thing: Any, needed: tuple[str, ...]) -> None:
    if not _lacks(thing, needed) and not isinstance(thing, type):
        return
    named = f', or named_material("{thing}")' if isinstance(thing, str) else ""
    raise UsageError(
        f"The material of a body is {thing!r}, of type {type(thing).__name__}.",
        why="A material has moduli, a density and an energy.",
        fix=f"Pass for example NeoHookean(young=9e3, poisson=0.45), moduli in Pa{named}.",
    )


def _lacks(thing: Any, names: tuple[str, ...]) -> bool:
    """Return whether a member is missing; none is evaluated, for a file would be read."""
    nothing = object()
    return any(inspect.getattr_static(thing, name, nothing) is nothing for name in names)


def longest_side(geometry: Any) -> float:
    """Return the body's longest side in m."""
    size = getattr(geometry, "size", None)
    if size is None:
        low, high = geometry.rest().corners
        size = high - low
    return float(np.max(size))


def require_lengths(interaction: Any, longest: float) -> None:
    """Refuse an interaction with a length that the body's longest side in m leaves no room for."""
    for what, share in LENGTHS.items():
        for length in _numbers(getattr(interaction, what, None)):
            if abs(length) > share * longest:
                raise _too_long(f"The {what} of the {_kind(interaction)}", length, longest)


def advise_on_sizes(interaction: Any, element: float | None, longest: float) -> None:
    """Warn of a ball that is larger than the body, and of elements that are larger than the ball.

    `element` is the element size under the ball in m, None where the interaction chooses its own; `longest` is the
    body's longest side in m. An interaction without a radius passes.
    """
    radius = getattr(interaction, "radius", None)
    if radius is None:
        return
    what = _kind(interaction)
    if 2 * radius > longest:
        advise(
            f"The {what} has a radius of {millimetres(radius)} and is larger than the body, {millimetres(longest)}.",
            why="Such a ball is nearly a flat plate: it touches the body's rim first, and its place says little.",
            fix="Lengths are in m: pass 0.005 for 5 mm.",
        )
    size = element if element is not None else getattr(interaction, "element", None)
    if size is not None and size > 2 * radius:
        advise(
            f"The elements under the {what} measure {millimetres(size)}, the {what} itself {millimetres(2 * radius)}.",
            why="Elements larger than what touches them do not resolve the contact: forces are far too large.",
            fix=f"Pass element={radius / 2:.2g} (m), or leave it out.",
        )


def require_element(element: Any, longest: float) -> None:
    """Refuse an element size that is not positive, or larger than the body."""
    checks.positive("The element size of a problem", element, "m")
    if element > longest:
        raise _too_long("The element size of the problem", element, longest)


def require_finite(values: np.ndarray, ranges: Sequence[Range]) -> None:
    """Refuse inputs (n,) that are no finite numbers."""
    for value, given in zip(values.tolist(), ranges, strict=True):
        if not math.isfinite(value):
            raise UsageError(
                f"The input {given.name} is {value}.",
                why="It is no finite number: often the outcome of a division by zero, or a gap in a table.",
                fix=f"Pass finite numbers; the range of {given.name} is {given.low:.4g} … {given.high:.4g} "
                f"{given.unit}".rstrip()
                + ".",
            )


def require_near(points: np.ndarray, ranges: Sequence[Range], longest: float) -> None:
    """Refuse inputs (N, n) in m that are farther from their ranges than the body is long."""
    low, high = bounds(ranges)
    beyond = np.maximum(low - points, points - high)
    beyond[:, [r.unit != "m" for r in ranges]] = 0.0
    beyond[~np.isfinite(beyond)] = 0.0  # what is no number is refused by its name
    if not beyond.size or beyond.max() <= longest:
        return
    row, column = divmod(int(np.argmax(beyond)), len(ranges))
    given = ranges[column]
    raise UsageError(
        f"The input {given.name} is {points[row, column]:g} m, far from the body.",
        why=f"Its range is {given.low:.4g} … {given.high:.4g} m, the body's longest side "
        f"{longest:.4g} m: out there nothing touches.",
        fix="Lengths are in m: pass 0.030 for 30 mm.",
    )


def require_no_loose_part(body: Any, interactions: Sequence[Any]) -> None:
    """Refuse a body from a file of which a part is held by nothing: no surface of it is fixed, led or glued."""
    geometry = body.geometry
    if not getattr(geometry, "foreign", False):
        return  # palpate's own shapes are of one piece
    mesh = geometry.rest()
    part_of, part_of_triangle = mesh.parts
    if not part_of.any():
        return
    holding = [
        *(held.interaction for held in body.held),
        *(i for i in interactions if not isinstance(i, PUSHING)),
    ]
    named = [getattr(part, "touches", getattr(part, "surface", None)) for part in holding]
    if not all(isinstance(name, str) for name in named):
        return  # where one's own interaction acts is not known
    surfaces = {member for name in (*body.fixed, *named) for member in members(name, mesh.surfaces)}
    held = np.isin(mesh.surface_of, [mesh.surfaces.index(name) for name in surfaces if name in mesh.surfaces])
    for part in np.unique(part_of).tolist():
        mine = part_of_triangle == part
        if not held[mine].any():
            raise _loose_part(mesh, part)


def _loose_part(mesh: Any, part: int) -> UsageError:
    part_of, part_of_triangle = mesh.parts
    mine = part_of_triangle == part
    corners = mesh.points[mesh.triangles]
    gap, where = surface_gap(corners[mine], corners[~mine])
    middle = (corners[mine].min(axis=(0, 1)) + corners[mine].max(axis=(0, 1))) / 2
    regions = [mesh.regions[i] for i in np.unique(mesh.region_of[part_of == part])]
    names = [mesh.surfaces[i] for i in np.unique(mesh.surface_of[mine])]
    distance = (
        f"It is {millimetres(gap)} from the rest"
        if gap > 0
        else "It meets the rest in an edge or point only,"
    )
    return UsageError(
        f"The part of {' and '.join(map(repr, regions))} around {place(middle)} hangs on nothing.",
        why=f"{distance} around {place(where)}, and no surface of it is held: it would fly away at a touch.",
        fix="If the parts should be one, let them touch and unite them in the program that made the file; else hold a "
        f"surface of it: {', '.join(map(repr, names[:4]))}{', …' if len(names) > 4 else ''}.",
    )


def _numbers(value: Any) -> Iterator[float]:
    """Yield the numbers in a value, a range or several of them."""
    if isinstance(value, int | float):
        yield float(value)
    elif isinstance(value, tuple | list):
        for part in value:
            yield from _numbers(part)


def _kind(interaction: Any) -> str:
    return type(interaction).__name__


def _too_long(what: str, length: float, longest: float) -> UsageError:
    return UsageError(
        f"{what} is {length:g} m, the body's longest side {longest:.4g} m.",
        why="That is out of all proportion to the body.",
        fix="Lengths are in m: pass 0.010 for 10 mm.",
    )
