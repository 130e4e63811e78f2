"""A part on the page on which it is set up: its surface, and the choices that a person makes there.

ShownPart    surface, faces, and what is chosen at first
PartChoices  what a person has chosen
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from palpate.errors import PalpateError, UsageError
from palpate.format import bound, millimetres, share
from palpate.tools import PosedTool
from palpate.tools.tool_sizes import (
    BALL,
    TURNS,
    USUAL,
    about,
    size_unit,
    sizes_of,
    suitable_tool,
    tool_by_name,
)
from palpate.units import parse_quantity
from palpate.viewer.messages import Surface
from palpate.viewer.part_messages import (
    FaceInfo,
    MaterialInfo,
    PartFaces,
    PartFacts,
    RegionInfo,
    Role,
    SizeInfo,
    StartWish,
    ToolInfo,
)
from palpate.viewer.surfaces import split

__all__ = [
    "PartChoices",
    "ShownMaterial",
    "ShownPart",
    "as_wish",
    "choices_of",
    "error_line",
    "require_room",
    "require_room_for_tool",
    "require_round_edge",
    "wished_tool",
]

_QUANTITIES = {
    "young": ("Young's modulus", "Pa"),
    "poisson": ("Poisson's ratio", ""),
    "radius": ("The radius of the ball", "m"),
    "depth": ("The depth", "m"),
}
"""The choices that are numbers, by their names in `StartWish`, with what they are called and their SI units."""


@dataclass(frozen=True, eq=False)
class PartChoices:
    """The choices of a person for a part."""

    material: str  # name in the library; empty where law and constants are given
    law: str  # of an own material
    young: float  # Pa
    poisson: float
    radius: float  # of the ball, m; of another tool that of the ball which its usual sizes go with
    depth: float  # largest depth of the ball or tool, m
    held: np.ndarray | None = None  # (k,) int, triangles; None: as chosen at first
    touched: np.ndarray | None = None  # (k,) int, triangles; None: as chosen at first
    tool: str = BALL  # what presses, by name
    posed: PosedTool | None = None  # the tool; None for a ball
    regions: Mapping[str, str] = field(default_factory=dict)  # materials as texts; "": that of the whole part


@dataclass(frozen=True)
class ShownMaterial:
    """A material that can be asked for by name."""

    about: str  # what there is to say of it, in words
    kind: str = "other"  # or ``tissue`` or ``silicone``
    young: float = 10e3  # Young's modulus at small strains, Pa
    poisson: float = 0.45


@dataclass(frozen=True, eq=False)
class ShownPart:
    """A part to set up: its surface as triangles, its faces, and the choices made for it at first."""

    name: str  # title of the page
    file: str
    unit: str  # of the file's numbers; empty where the file states it
    points: np.ndarray  # (n, 3), corners of the triangles, m, z up
    triangles: np.ndarray  # (t, 3) int, outer surface, counter-clockwise as seen from outside
    face_of: np.ndarray  # (t,) int, index into `faces`
    faces: tuple[str, ...]
    held: np.ndarray  # (t,) bool, unless a person chooses others
    touched: np.ndarray  # (t,) bool, unless a person chooses others
    choices: PartChoices
    units: tuple[str, ...] = ()  # in which the file's numbers could be taken instead
    whole: bool = False  # faces can be picked as a whole only, as those of a CAD file
    materials: Mapping[str, ShownMaterial] = field(default_factory=dict)  # by name
    laws: tuple[str, ...] = ("neo-hookean",)  # that take Young's modulus and Poisson's ratio
    notes: tuple[str, ...] = ()  # what else to say of the file, in sentences
    # refuses a text that is no material of a region, by the region's name
    judge_region: Callable[[str, str], object] = field(default=lambda region, text: None)

    @cached_property
    def surface(self) -> Surface:
        """Its surface as a message, split along sharp edges; triangles keep their order."""
        triangles = np.asarray(self.triangles, dtype=np.int64)
        points = np.asarray(self.points, dtype=float)
        return split(points, triangles, np.zeros(len(triangles), bool)).surface(points)

    def picks(self) -> PartFaces:
        """Return the faces and the first roles of its triangles as a message; what is held goes over the rest."""
        roles = np.where(self.touched, float(Role.TOUCHED), float(Role.FREE))
        roles[np.asarray(self.held, dtype=bool)] = float(Role.HELD)
        return PartFaces(faces=np.asarray(self.face_of), roles=roles)

    @cached_property
    def size(self) -> np.ndarray:
        """Lengths (3,) of the box around it, m."""
        corners = np.asarray(self.points, dtype=float)[np.unique(self.triangles)]
        return np.asarray(np.ptp(corners, axis=0))

    def misfits(self, wish: StartWish) -> dict[str, str]:
        """Return what is wrong with numbers of a wish, in sentences by the names of `StartWish`."""
        problems: dict[str, str] = {}
        for name in _QUANTITIES:
            if (wish.material and name in {"young", "poisson"}) or (wish.tool != BALL and name == "radius"):
                continue  # those of the material are taken, and those of the tool
            try:
                number = _quantity(name, getattr(wish, name))
                if name in {"radius", "depth"}:
                    require_room(name, number, self.size)
            except UsageError as error:
                problems[name] = error_line(error)
        if wish.tool != BALL:
            problems |= _size_problems(wish, self.size)
        return problems | self._region_problems(wish)

    def _region_problems(self, wish: StartWish) -> dict[str, str]:
        """Return what is wrong with the materials of regions, by ``region-`` and the region's number."""
        problems: dict[str, str] = {}
        for number, (name, first) in enumerate(self.choices.regions.items()):
            text = wish.regions.get(name, first)
            if text not in {"", first}:  # what was there stays, whatever law it has
                try:
                    self.judge_region(name, text)
                except UsageError as error:
                    problems[f"region-{number}"] = error_line(error)
        return problems

    def facts(self) -> PartFacts:
        """Return what the page asks for first."""
        corners = np.asarray(self.points, dtype=float)[np.asarray(self.triangles)]
        area = (
            np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
        )
        middle, faces = corners.mean(axis=1), []
        for index, name in enumerate(self.faces):
            mine = np.asarray(self.face_of) == index
            x, y, z = (area[mine] @ middle[mine] / max(area[mine].sum(), 1e-300)).tolist()
            faces.append(FaceInfo(name, float(area[mine].sum()), (x, y, z)))
        wish = as_wish(self.choices)
        return PartFacts(
            file=self.file,
            unit=self.unit,
            units=self.units,
            size=(float(self.size[0]), float(self.size[1]), float(self.size[2])),
            faces=tuple(faces),
            whole=self.whole,
            materials=tuple(
                MaterialInfo(name, m.about, m.kind, f"{m.young / 1e3:.6g} kPa", f"{m.poisson:.6g}")
                for name, m in self.materials.items()
            ),
            laws=self.laws,
            tools=_tools(self.choices),
            regions=tuple(RegionInfo(name, text) for name, text in self.choices.regions.items()),
            choices={
                name: getattr(wish, name)
                for name in ("material", "law", "young", "poisson", "radius", "depth", "tool")
            },
            notes=self.notes,
        )


def as_wish(choices: PartChoices) -> StartWish:
    """Return choices as the texts that the page shows."""
    return StartWish(
        material=choices.material,
        law=choices.law,
        young=f"{choices.young / 1e3:.6g} kPa",
        poisson=f"{choices.poisson:.6g}",
        radius=f"{choices.radius * 1e3:.6g} mm",
        depth=f"{choices.depth * 1e3:.6g} mm",
        tool=choices.tool,
        sizes={} if choices.posed is None else _size_texts(choices.posed),
        regions=choices.regions,
    )


def choices_of(wish: StartWish, held: np.ndarray | None, touched: np.ndarray | None) -> PartChoices:
    """Return the choices that a page has sent; `held` and `touched` are triangles (k,), None where nothing changed."""
    own = not wish.material
    return PartChoices(
        material=wish.material,
        law=wish.law,
        young=_quantity("young", wish.young) if own else 0.0,
        poisson=_quantity("poisson", wish.poisson) if own else 0.0,
        radius=_quantity("radius", wish.radius) if wish.tool == BALL else 0.0,
        depth=_quantity("depth", wish.depth),
        held=held,
        touched=touched,
        tool=wish.tool,
        posed=None if wish.tool == BALL else wished_tool(wish),
        regions=wish.regions,
    )


def wished_tool(wish: StartWish) -> PosedTool:
    """Return the tool of a wish; a size that is none is refused."""
    sizes = {key: parse_quantity(text, size_unit(key), _title(key)) for key, text in wish.sizes.items()}
    return tool_by_name(wish.tool, sizes)


def _size_problems(wish: StartWish, room: np.ndarray) -> dict[str, str]:
    """Return what is wrong with the sizes of a tool on a part of a size (3,) in m, by ``size-`` and their names."""
    problems: dict[str, str] = {}
    for key, text in wish.sizes.items():
        try:
            parse_quantity(text, size_unit(key), _title(key))
        except UsageError as error:
            problems[f"size-{key}"] = error_line(error)
    if problems:
        return problems
    first, last = (
        next(iter(wish.sizes), ""),
        next((key for key in reversed(list(wish.sizes)) if key not in TURNS), ""),
    )
    try:
        tool = wished_tool(wish)
    except UsageError as error:  # of sizes that do not go together the last is the one that ends the shape
        return {f"size-{last}": error_line(error)}
    try:
        require_room_for_tool(tool, room)
    except UsageError as error:
        return {f"size-{first}": error_line(error)}
    try:
        require_round_edge(tool)
    except UsageError as error:
        return {f"size-{last}": error_line(error)}
    return {}


def require_room_for_tool(tool: PosedTool, size: np.ndarray) -> None:
    """Refuse a tool that is wider than a part of a size (3,) in m is long."""
    axes = np.vstack([np.eye(3), -np.eye(3)])
    turned = axes if tool.turn is None else axes @ tool.turn
    reach = tool.shape.support(turned).reshape(2, 3).sum(axis=0)
    wide, longest = float(reach[np.isfinite(reach)].max(initial=2 * tool.shape.size)), float(size.max())
    if wide > longest:
        raise UsageError(
            f"The {tool.shape} is {millimetres(wide)} across, and the part {millimetres(longest)} long.",
            fix=f"Choose sizes of at most {share(longest / wide)} of these.",
        )


def require_round_edge(tool: PosedTool) -> None:
    """Refuse an edge that is sharper than the elements under a tool become by themselves."""
    from palpate.physics.interactions.surface_tool import (
        EDGE_ELEMENT,
        FINEST,
    )  # a page of a body needs no physics

    edge, finest = tool.shape.least_radius, FINEST * tool.shape.size
    if finest > EDGE_ELEMENT * edge:
        raise UsageError(
            f"The edge of the {tool.shape} is too sharp for elements of {millimetres(finest)}.",
            fix=f"Choose one with a radius of at least {millimetres(bound(finest / EDGE_ELEMENT, least=True))}.",
        )


def _tools(choices: PartChoices) -> tuple[ToolInfo, ...]:
    """Return what can press a part, with sizes that suit it, or those that were chosen."""
    tools = [ToolInfo(BALL, "", ())]
    for name in dict.fromkeys((*USUAL, choices.tool)) if choices.tool != BALL else USUAL:
        own = choices.posed if name == choices.tool else None
        texts = _size_texts(own or suitable_tool(name, choices.radius))
        sizes = tuple(
            SizeInfo(key, _title(key).removeprefix("The ").lower(), text) for key, text in texts.items()
        )
        tools.append(ToolInfo(name, about(name), sizes))
    return tuple(tools)


def _size_texts(tool: PosedTool) -> dict[str, str]:
    """Return the sizes of a tool as texts with their units."""
    return {
        key: f"{math.degrees(value):.6g}°" if size_unit(key) == "rad" else f"{1e3 * value:.6g} mm"
        for key, value in sizes_of(tool).items()
    }


def _title(key: str) -> str:
    """Return what a size is called, at the head of a sentence."""
    if key in TURNS:
        return f"The turn about {key[-1]}"
    if key.startswith("size_"):
        return f"The length along {key[-1]}"
    return {
        "edge": "The edge's radius",
        "tip": "The tip's radius",
        "half_angle": "The angle from axis to side",
    }.get(key, f"The {key}")


def error_line(error: PalpateError) -> str:
    """Return what, why and fix of an error in one line."""
    return " ".join(filter(None, (error.what, error.why, error.fix)))


def require_room(name: str, length: float, size: np.ndarray) -> None:
    """Refuse a ball's ``radius`` or a ``depth`` in m for which a part of this size (3,) in m has no room."""
    least, longest = float(size.min()), float(size.max())
    if name == "radius" and 2 * length > longest:
        raise UsageError(
            f"The ball, {millimetres(2 * length)} across, is larger than the part, {millimetres(longest)}.",
            fix="Choose a smaller radius.",
        )
    if name == "depth" and length >= least:
        raise UsageError(
            f"The depth of {millimetres(length)} is more than the part is thick, {millimetres(least)}.",
            fix="Choose a smaller depth.",
        )


def _quantity(name: str, text: str) -> float:
    """Return a choice in its SI unit; its text must say a unit where it has one, and be in range."""
    title, unit = _QUANTITIES[name]
    number = parse_quantity(text, unit, title)
    if name == "poisson":
        if not 0 <= number < 0.5:
            raise UsageError(
                f"{title} is {text.strip()}, which is out of range.",
                fix="Choose one from 0 to less than 0.5; 0.45 suits soft tissue.",
            )
    elif number <= 0:
        raise UsageError(f"{title} is {text.strip()}, which is not above zero.", fix="Choose a larger one.")
    return number
