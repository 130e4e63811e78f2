"""Meshes, supports and loads of the benchmarks.

Boxes and everything mapped from a box are regular, each small box parted into six tetrahedra (Kuhn 1960), so that
orders of convergence are clean. Round bodies come from the CAD kernel, with elements of second order.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.physics.interactions import Attached
from palpate.physics.shapes.mesh import BodyMesh, outer_faces, to_ngsolve
from palpate.physics.shapes.shape import Shape
from palpate.units import Range

BOX = ("left", "right", "front", "back", "bottom", "top")  # x, y, z: low and high


@dataclass(frozen=True)
class Boxes(Shape):
    """The image of the unit cube, n = (n_x, n_y, n_z) boxes of six tetrahedra, under a map of points (k, 3)."""

    n: tuple[int, int, int]
    place: Callable[[np.ndarray], np.ndarray]

    @property
    def surfaces(self) -> tuple[str, ...]:
        return BOX

    def describe(self) -> dict[str, Any]:
        return {"type": "Boxes", "n": self.n}

    def generate(self, refinements: Any) -> Any:
        return to_ngsolve(self.plain()).ngmesh

    def plain(self) -> BodyMesh:
        """The mesh as arrays."""
        shape = np.array(self.n) + 1
        grid = np.stack(np.meshgrid(*(np.linspace(0, 1, k) for k in shape), indexing="ij"), -1).reshape(-1, 3)
        corner = np.stack(np.meshgrid(*(np.arange(k) for k in self.n), indexing="ij"), -1).reshape(-1, 3)
        stride = np.array([shape[1] * shape[2], shape[2], 1])
        parts = []
        for order in itertools.permutations(range(3)):
            path = np.cumsum([np.zeros(3, int), *np.eye(3, dtype=int)[list(order)]], axis=0)
            nodes = (corner @ stride)[:, None] + path @ stride
            odd = np.linalg.det(np.eye(3)[list(order)]) < 0
            parts.append(nodes[:, [0, 2, 1, 3]] if odd else nodes)
        tetrahedra = np.concatenate(parts)
        triangles = outer_faces(tetrahedra)
        ends = grid[triangles]
        flat = [(ends[:, :, axis] == side).all(axis=1) for axis in range(3) for side in (0.0, 1.0)]
        return BodyMesh(
            self.place(grid),
            tetrahedra,
            triangles,
            np.argmax(flat, axis=0),
            np.zeros(len(tetrahedra), int),
            BOX,
            ("body",),
        )


@dataclass(frozen=True)
class Drawn(Shape):
    """A body of the CAD kernel, its faces named by `draw`; each refinement halves all edges."""

    curved = True

    draw: Callable[[], Any]
    names: tuple[str, ...]
    element: float
    halvings: int = 0

    @property
    def surfaces(self) -> tuple[str, ...]:
        return self.names

    def describe(self) -> dict[str, Any]:
        return {"type": "Drawn", "element": self.element, "halvings": self.halvings}

    def generate(self, refinements: Any) -> Any:
        from netgen.occ import OCCGeometry

        mesh = OCCGeometry(self.draw()).GenerateMesh(maxh=self.element)
        for _ in range(self.halvings):
            mesh.Refine()
        return mesh


@dataclass(frozen=True)
class Moved:
    """Surfaces moved by q times a displacement field, given as a function of the coordinates.

    With `sliding`, pairs of a surface and an axis, only those components are held.
    """

    displacement: Callable[[Any, Any, Any], tuple[Any, Any, Any]]
    surfaces: tuple[str, ...] = BOX
    sliding: tuple[tuple[str, int], ...] = ()

    def ranges(self, geometry: Any) -> tuple[Range, ...]:
        return (Range("q", -1.0, 1.0),)

    def describe(self) -> dict[str, Any]:
        return {"type": "Moved"}

    def refinements(self, geometry: Any) -> tuple[()]:
        return ()

    def attach(self, field: Any) -> Attached:
        import ngsolve as ng

        held = np.zeros(field.size, dtype=bool)
        for name in self.surfaces:
            held |= field.surface_dofs(name)
        for name, axis in self.sliding:
            component = field.displacement.space.Range(axis)
            part = np.zeros(field.size, dtype=bool)
            part[component.start : component.stop] = True
            held |= part & field.surface_dofs(name)
        lift = field.interpolate(ng.CF(self.displacement(ng.x, ng.y, ng.z))) * held
        return Attached((ng.Parameter(0.0),), lifts=lift[None, :], constrained=held)


@dataclass(frozen=True)
class Loaded:
    """q times a load given by its virtual work, a function of field and test displacement."""

    work: Callable[[Any, Any], Any]

    def ranges(self, geometry: Any) -> tuple[Range, ...]:
        return (Range("q", -1.0, 1.0),)

    def describe(self) -> dict[str, Any]:
        return {"type": "Loaded"}

    def refinements(self, geometry: Any) -> tuple[()]:
        return ()

    def attach(self, field: Any) -> Attached:
        import ngsolve as ng

        load = field.load(lambda v: self.work(field, v))
        return Attached((ng.Parameter(0.0),), loads=load[None, :])
