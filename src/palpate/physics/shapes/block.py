"""Rectangular boxes: the block of one material, and slabs of different tissue on each other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from palpate import checks
from palpate.errors import UsageError
from palpate.format import millimetres
from palpate.physics.shapes.meshing import FineMesh
from palpate.physics.shapes.naming import INTERFACE, UPRIGHT, require_name
from palpate.physics.shapes.shape import Isometry, Solid, box_isometries

__all__ = [
    "Block",
    "LayeredBlock",
    "name_sides",
    "name_upright_faces",
]

FLATTEST = 3.0  # element size over thickness of its layer: flatter tetrahedra condition the system badly


@dataclass(frozen=True)
class Block(Solid):
    """A box with a corner at the origin: x in 0 … size[0], y in 0 … size[1], z in 0 … size[2].

    Surfaces are ``top`` (largest z), ``bottom`` (z = 0) and the upright faces ``x_min``, ``x_max``, ``y_min`` and
    ``y_max``, which together can be called ``side``; the region is ``body``.

    Attributes
    ----------
    size : tuple of three floats
        Extent along x, y and z in m.
    element : float, optional
        Largest element size in m, by default a third of the least extent.

    Raises
    ------
    UsageError
        If a size is not positive, or tells of mistaken units.
    """

    size: tuple[float, float, float] = (0.10, 0.10, 0.05)
    element: float | None = None

    def __post_init__(self) -> None:
        size = checks.triple("The size of a block", self.size, "m")
        for axis, extent in zip("xyz", size, strict=True):
            checks.positive(f"The block's extent along {axis}", extent, "m")
        object.__setattr__(self, "size", size)
        self.check_extent("The block")

    @property
    def surfaces(self) -> tuple[str, ...]:
        """``top``, ``bottom`` and the four upright faces."""
        return ("top", "bottom", *UPRIGHT)

    @property
    def isometries(self) -> tuple[Isometry, ...]:
        """Rotations and reflections of the box."""
        return box_isometries(self.size)

    def __str__(self) -> str:
        return f"block {millimetres(*self.size)}"

    def solid(self) -> Any:
        """The box, its faces named."""
        from netgen.occ import Box, Pnt

        box = Box(Pnt(0, 0, 0), Pnt(*self.size))
        box.mat("body")
        name_upright_faces(box, self.size[2])
        name_sides(box, self.size)
        return box


def name_upright_faces(solid: Any, height: float) -> None:
    """Name the faces of a solid between z = 0 and z = height: ``bottom``, ``top`` and for the others ``side``."""
    for face in solid.faces:
        z = face.center.z
        level = abs(z - height) < 1e-6 * height, abs(z) < 1e-6 * height
        face.name = "top" if level[0] else "bottom" if level[1] else "side"


def name_sides(solid: Any, size: tuple[float, float, float]) -> None:
    """Name the upright faces of a box with a corner at the origin by where they are."""
    for face in solid.faces:
        for axis, at, far in zip("xy", (face.center.x, face.center.y), size, strict=False):
            if face.name == "side" and min(abs(at), abs(at - far)) < 1e-6 * far:
                face.name = f"{axis}_min" if at < far / 2 else f"{axis}_max"


@dataclass(frozen=True)
class LayeredBlock(Solid):
    """A box of layers, with a corner at the origin: x in 0 … extent[0], y in 0 … extent[1], the base at z = 0.

    Surfaces are ``top`` (the first layer's), ``bottom`` and the upright faces ``x_min``, ``x_max``, ``y_min`` and
    ``y_max``, which together can be called ``side``; each layer is a region of its own. Layers share the nodes
    of the face between them, so they don't slide.

    Attributes
    ----------
    extent : tuple of two floats
        Extent along x and y in m.
    layers : tuple of (str, float)
        Name and thickness in m of each layer, from the surface down.
    element : float, optional
        Largest element size in m, by default a third of the least extent. In a thin layer elements have at most
        3 times its thickness.
    meshed : tuple of float, optional
        Thickness in m for which the mesh is made, of each layer; its nodes are then moved to where the layers are. So
        blocks of other thicknesses have the same elements. Their heights must add up to the same.

    Raises
    ------
    UsageError
        If a size is not positive, two layers share a name, or the sizes tell of mistaken units.
    """

    extent: tuple[float, float] = (0.10, 0.10)
    layers: tuple[tuple[str, float], ...] = (("skin", 0.003), ("fat", 0.012), ("muscle", 0.035))
    element: float | None = None
    meshed: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "extent", _extents(self.extent))
        object.__setattr__(self, "layers", _named_layers(self.layers))
        if self.meshed is not None:
            object.__setattr__(self, "meshed", _mesh_thicknesses(self.meshed, self.layers))
        self.check_extent("The layered block")

    @property
    def surfaces(self) -> tuple[str, ...]:
        """``top``, ``bottom`` and the four upright faces."""
        return ("top", "bottom", *UPRIGHT)

    @property
    def regions(self) -> tuple[str, ...]:
        """Names of the layers, from the surface down."""
        return tuple(name for name, _ in self.layers)

    @property
    def levels(self) -> tuple[float, ...]:
        """Heights z in m of the faces between the layers, from the top to 0."""
        thickness = [t for _, t in self.layers]
        return tuple(sum(thickness[i:]) for i in range(len(thickness) + 1))

    @property
    def size(self) -> tuple[float, float, float]:
        """Extent along x, y and z in m."""
        return (*self.extent, self.levels[0])

    @property
    def isometries(self) -> tuple[Isometry, ...]:
        """Rotations and reflections of the box that keep the layers."""
        return box_isometries(self.size, layered=True)

    def __str__(self) -> str:
        layers = ", ".join(f"{name} {millimetres(thickness)}" for name, thickness in self.layers)
        return f"layered block {millimetres(*self.size)} ({layers})"

    def with_thickness(self, layer: str, thickness: float) -> LayeredBlock:
        """Return the block with another thickness of one layer: its height and its elements stay, moved.

        What the layer takes, the deepest one gives.

        Parameters
        ----------
        layer : str
            Name of a layer above the deepest.
        thickness : float
            New thickness in m, below that of the layer and the deepest together.

        Raises
        ------
        UsageError
            If there is no such layer above the deepest, or nothing would be left of one.
        """
        names, old = [name for name, _ in self.layers], [t for _, t in self.layers]
        if layer not in names[:-1]:
            raise UsageError(
                f"{layer!r} is no layer whose thickness can change.",
                why=f"The layers are {', '.join(names)}; what one takes, the deepest gives.",
                fix="Name a layer above the deepest.",
            )
        own, new = names.index(layer), old.copy()
        new[own] = float(thickness)
        new[-1] = old[-1] + old[own] - new[own]
        if not (new[own] > 0 and new[-1] > 0):
            raise UsageError(
                f"The layer {layer!r} can't be {millimetres(thickness)} thick.",
                why=f"It and {names[-1]!r} together are {millimetres(old[own] + old[-1])}.",
                fix="Give a thickness between 0 and that.",
            )
        return replace(
            self,
            layers=tuple(zip(names, new, strict=True)),
            meshed=tuple(old) if self.meshed is None else self.meshed,
        )

    def describe(self) -> dict[str, Any]:
        """Everything that decides the mesh, as plain data for a JSON file."""
        data = super().describe()
        return data if self.meshed is not None else {k: v for k, v in data.items() if k != "meshed"}

    def generate(self, refinements: tuple[FineMesh, ...]) -> Any:
        """A new `netgen.meshing.Mesh` in m, whose names of surfaces and regions are set."""
        if self.meshed is None:
            return super().generate(refinements)
        names = [name for name, _ in self.layers]
        as_meshed = replace(self, layers=tuple(zip(names, self.meshed, strict=True)), meshed=None)
        mesh = as_meshed.generate(refinements)
        old, new = as_meshed.levels[::-1], self.levels[::-1]
        for point in mesh.Points():
            point[2] = float(np.interp(point[2], old, new))
        return mesh

    def solid(self) -> Any:
        """The layers, glued; their faces named."""
        from netgen.occ import Box, Glue, Pnt

        slabs = []
        for (name, thickness), (high, low) in zip(self.layers, pairwise(self.levels), strict=True):
            slab = Box(Pnt(0, 0, low), Pnt(*self.extent, high))
            slab.mat(name)
            slab.solids.maxh = min(self.coarse, FLATTEST * thickness)
            slabs.append(slab)
        block = Glue(slabs)
        name_upright_faces(block, self.size[2])
        name_sides(block, self.size)
        for face in block.faces:
            if face.name == "side":
                face.name = INTERFACE
        return block


def _mesh_thicknesses(value: Any, layers: tuple[tuple[str, float], ...]) -> tuple[float, ...]:
    """Thickness of each layer as it is meshed, of the same sum."""
    meshed: tuple[float, ...] = tuple(float(t) for t in value)
    height = sum(t for _, t in layers)
    if len(meshed) != len(layers) or min(meshed) <= 0 or abs(sum(meshed) - height) > 1e-9 * height:
        raise UsageError(
            f"A mesh for layers of {meshed} m does not fit layers of {tuple(t for _, t in layers)} m.",
            why="Both need as many layers, all of some thickness, that are equally high together.",
            fix="Leave `meshed` out, or use `LayeredBlock.with_thickness`.",
        )
    return meshed


def _extents(value: Any) -> tuple[float, float]:
    try:
        x, y = value
    except (TypeError, ValueError):
        raise UsageError(
            f"The size of a layered block is {value!r}.",
            why="It is the extent along x and y; the height is the sum of the layers.",
            fix="Pass (0.10, 0.10) for 100 mm by 100 mm.",
        ) from None
    checks.positive("The layered block's extent along x", x, "m")
    checks.positive("The layered block's extent along y", y, "m")
    return float(x), float(y)


def _named_layers(value: Any) -> tuple[tuple[str, float], ...]:
    try:
        layers = tuple((name, thickness) for name, thickness in value)
    except (TypeError, ValueError):
        layers = ()
    if not layers:
        raise UsageError(
            f"The layers of a block are {value!r}.",
            why="Each is a name and a thickness in m, from the surface down; at least one is needed.",
            fix='Pass layers=(("skin", 0.002), ("fat", 0.010), ("muscle", 0.030)).',
        )
    for name, thickness in layers:
        require_name("A layer's name", name)
        checks.positive(f"The thickness of the layer {name!r}", thickness, "m")
    names = [name for name, _ in layers]
    if len(set(names)) < len(names):
        raise UsageError(
            f"Two layers have the same name: {', '.join(names)}.",
            why="The name tells which material a layer is made of.",
            fix="Number them, for example fat 1 and fat 2.",
        )
    return tuple((name, float(thickness)) for name, thickness in layers)
