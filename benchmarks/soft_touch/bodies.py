"""The five bodies of soft-touch, the ball that presses them, and the places where it does.

All materials are compressible neo-Hookean solids, W = G/2 (J^(-2/3) tr C − 3) + K/2 (J − 1)², a law that every solver
has. Places follow a scrambled Sobol sequence of a seed, even over the touched part of the surface.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path as File
from typing import Any

import numpy as np
from scipy.stats import qmc

from palpate.physics.interactions import SphereProbe
from palpate.physics.interactions.surface_patch import Patch, surface_of
from palpate.physics.materials import NeoHookean
from palpate.physics.shapes import Block, Dome, Inclusion, LayeredBlock, Organ
from palpate.physics.shapes.mesh import BodyMesh
from palpate.physics.shapes.meshing import FineMesh
from palpate.physics.solid import Body, SolidProblem

__all__ = [
    "BODIES",
    "CASES",
    "DEPTHS",
    "RADIUS",
    "SEED",
    "Path",
    "SoftBody",
    "held_points",
    "loops_of",
    "mesh_of",
    "paths_of",
    "problem",
    "touched",
]

CASES = File(__file__).parent / "cases"
RADIUS = 0.010  # m, of the ball: a fingertip
DEPTHS = (0.001, 0.004)  # m: below, the contact is narrower than elements that are affordable
PATHS, STEPS = 12, 5
SEED = 2026  # published: places of the shipped tables
POISSON = 0.45  # plain elements of second order are good up to 0.48


@dataclass(frozen=True)
class SoftBody:
    """A body, where the ball touches it, and words for its card."""

    title: str
    body: Body
    touches: str
    allows: Callable[[np.ndarray, np.ndarray], bool]  # whether a place (3,) of normal (3,) is pressed
    shape: str
    coarse: float  # m, largest element of the mesh that is shipped
    surface: float  # m, element on the touched surface of the mesh that is shipped


@dataclass(frozen=True)
class Path:
    """A straight way into the surface: place and outward unit normal (3,), and depths (5,) in m."""

    number: int
    place: np.ndarray
    normal: np.ndarray
    depths: np.ndarray

    @property
    def centres(self) -> np.ndarray:
        """Centres (5, 3) of the ball in m."""
        return np.asarray(self.place + (RADIUS - self.depths)[:, None] * self.normal)


def _gel(young: float) -> NeoHookean:
    return NeoHookean(young, POISSON, form="isochoric")


def _in_box(low: float, high: float) -> Callable[[np.ndarray, np.ndarray], bool]:
    return lambda place, _: bool((place[:2] > low).all() and (place[:2] < high).all())


def _steep(cosine: float) -> Callable[[np.ndarray, np.ndarray], bool]:
    return lambda _, normal: bool(normal[2] > cosine)


_BLOCK = Block((0.10, 0.10, 0.05))
_LAYERS = LayeredBlock((0.10, 0.10), (("skin", 0.003), ("fat", 0.010), ("muscle", 0.027)))
_LUMP = Inclusion((0.012, 0.0, 0.024), 0.008)
_HALF = "upper half of the ellipsoid (x/0.05)² + (y/0.05)² + (z/0.04)² = 1 m, held on its base z = 0"

BODIES: dict[str, SoftBody] = {
    "block": SoftBody(
        "Block of one gel", Body(_BLOCK, _gel(15e3), fixed="bottom"), "top", _in_box(0.02, 0.08),
        "box 0.10 × 0.10 × 0.05 m, one corner at the origin, held on z = 0", 0.0125, 0.006,
    ),
    "layered": SoftBody(
        "Skin on fat on muscle",
        Body(_LAYERS, {"skin": _gel(30e3), "fat": _gel(10e3), "muscle": _gel(20e3)}, fixed="bottom"),
        "top", _in_box(0.02, 0.08),
        "box 0.10 × 0.10 × 0.04 m, one corner at the origin, held on z = 0; from the top skin 3 mm, fat 10 mm, "
        "muscle 27 mm, bonded", 0.0125, 0.007,
    ),
    "dome": SoftBody(
        "Dome of one gel", Body(Dome(0.05, 0.04), _gel(10e3), fixed="bottom"), "top", _steep(0.6),
        _HALF, 0.010, 0.006,
    ),
    "organ": SoftBody(
        "Organ of two lobes", Body(Organ(0.16, seed=1), _gel(12e3), fixed="attached"), "front", _steep(0.75),
        "palpate.shapes.Organ(0.16, seed=1): two ellipsoids joined smoothly and bent, held at the middle of its back",
        0.012, 0.007,
    ),
    "lump": SoftBody(
        "Dome with a hard lump",
        Body(
            Dome(0.05, 0.04, inclusion=_LUMP), {"body": _gel(10e3), "inclusion": _gel(60e3)}, fixed="bottom"
        ),
        "top", _steep(0.6),
        _HALF + "; in it, bonded, a ball of radius 0.008 m around (0.012, 0, 0.024) m", 0.010, 0.006,
    ),
}  # fmt: skip
"""By name, as the folders are called."""


@cache
def touched(name: str) -> Patch:
    """Return the touched surface in triangles so small that a curved one is followed to a few μm."""
    soft = BODIES[name]
    fine = (FineMesh(soft.touches, 0.005),) if getattr(soft.body.geometry, "curved", False) else ()
    return surface_of(soft.body.geometry, soft.touches, fine)


def paths_of(name: str, seed: int, count: int = PATHS) -> list[Path]:
    """Return the first paths of a seed; depths are one in each fifth of the range, at a random share of it.

    Those of the published seed are read from the shipped table: a place follows from the surface's triangles too, and
    another mesher makes other ones.
    """
    table = CASES / name / "presses.csv"
    if seed == SEED and count <= PATHS and table.is_file():
        return _shipped_paths(table)[:count]
    soft, patch = BODIES[name], touched(name)
    rng = np.random.default_rng([seed, list(BODIES).index(name)])
    unit = qmc.Sobol(3, scramble=True, rng=rng).random(256)
    places, normals = patch.spread_with_normals(unit[:, :2])
    rows = [i for i in range(len(unit)) if soft.allows(places[i], normals[i])][:count]
    low, high = DEPTHS
    shares = (np.arange(STEPS) + unit[rows, 2:]) / STEPS
    return [
        Path(k, np.round(places[i], 6), normals[i], np.round(low + (high - low) * share, 6))
        for k, (i, share) in enumerate(zip(rows, shares, strict=True))
    ]


def _shipped_paths(table: File) -> list[Path]:
    """Return the paths of a table of presses."""
    rows = np.loadtxt(table, delimiter=",", skiprows=1).reshape(-1, STEPS, 10)
    centres, normals, depths = rows[:, 0, 3:6], rows[:, 0, 6:9], rows[:, :, 9]
    places = centres - (RADIUS - depths[:, :1]) * normals
    return [Path(k, places[k], normals[k], depths[k]) for k in range(len(rows))]


def loops_of(name: str, seed: int, count: int = 72) -> list[np.ndarray]:
    """Return two closed paths (count, 3) of the ball's centre in m, the first point repeated at the end.

    One circles around a place 2.5 mm deep; the other goes in, across, out and back, from 0.5 mm to 3.5 mm.
    """
    path = paths_of(name, seed)[0]
    patch = touched(name)
    side = np.cross(path.normal, [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side)
    turn = np.linspace(0.0, 2 * np.pi, count)
    circle = 0.006 * (np.outer(np.cos(turn), side) + np.outer(np.sin(turn), np.cross(path.normal, side)))
    across = 0.005 * np.outer(np.cos(turn), side)
    depths = (np.full(count, 0.0025), 0.002 + 0.0015 * np.sin(turn))
    loops = []
    for offsets, depth in zip((circle, across), depths, strict=True):
        nearest = [patch.nearest(path.place + offset) for offset in offsets]
        places, normals = (np.array([row[k] for row in nearest]) for k in (0, 1))
        loops.append(places + (RADIUS - depth)[:, None] * normals)
    return loops


def mesh_of(name: str, surface: float | None = None) -> BodyMesh:
    """Return the mesh that is shipped, or one with smaller elements, of so many metres, on the touched surface."""
    soft = BODIES[name]
    geometry = replace(soft.body.geometry, element=soft.coarse)  # type: ignore[type-var]
    return geometry.rest((FineMesh(soft.touches, surface or soft.surface),))


def held_points(name: str, mesh: BodyMesh) -> np.ndarray:
    """Return for each point of a body's mesh whether it is held."""
    held = np.zeros(len(mesh.points), dtype=bool)
    for surface in BODIES[name].body.fixed:
        held[np.unique(mesh.triangles_of(surface))] = True
    return held


def problem(name: str, *, depth: float = DEPTHS[1], element: float | None = None) -> SolidProblem:
    """Return the body under the rigid ball, pressed up to a depth in m all over the places that soft-touch presses.

    It is what a surrogate learns from; `element` is the size in m of the elements under the ball.
    """
    soft = BODIES[name]
    places = np.array([path.place for path in paths_of(name, 0, 200)])  # of another seed than any test's
    over: Any = (tuple(places.min(axis=0).tolist()), tuple(places.max(axis=0).tolist()))
    probe = SphereProbe(RADIUS, touches=soft.touches, pad="rigid", stop=None, depth=(0.0, depth), over=over)
    return soft.body.problem(probe, element=element)
