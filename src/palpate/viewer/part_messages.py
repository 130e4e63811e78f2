"""Every message of the page on which a part is set up and learnt, beside those of `messages`.

The conversation, over a websocket of its own at ``/part``:

1. The server says `PartNews` (JSON) at once and whenever the stage changes: reading the part, refused, choosing,
   working, ended. A part is refused whose surface bounds no body; `WrapWish` (JSON) asks for it to be wrapped. While
   it is chosen, the page asks for `PartFacts` (JSON) at ``/part/facts``, for the surface as `Surface` at
   ``/part/surface`` and for `PartFaces` at ``/part/faces``.
2. A page may ask for another unit of the file's numbers with `UnitWish` (JSON). What was picked on the surface is sent
   as `Picks`, in pieces that are small enough for one message each; then `StartWish` (JSON) says all other
   choices. A `StartWish` on trial asks only whether they fit. The server answers each wish with an `Answer` (JSON).
3. While solves run, `LearningProgress` (JSON) says how far they are. A page ends the work with `EndWish`.
4. Where `PartNews.version` is not zero, the body can be touched: the page joins the conversation at ``/touch``. Each
   later surrogate is announced there by a new `Hello` with a larger version; the page fetches that version's surface,
   fields and `TrustMap` (at ``/trust``), and says `Ready`. From then on its frames are drawn with that version.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Annotated, ClassVar

import numpy as np

from palpate.viewer.messages import DrawnTool, Vec3
from palpate.viewer.wire import Binary, Json, Wire

__all__ = [
    "Answer",
    "EndWish",
    "FaceInfo",
    "LearningProgress",
    "MaterialInfo",
    "PartFaces",
    "PartFacts",
    "PartNews",
    "Picks",
    "Ready",
    "RegionInfo",
    "Role",
    "SizeInfo",
    "StartWish",
    "ToolInfo",
    "TrustMap",
    "UnitWish",
    "WrapWish",
]


class Role(IntEnum):
    """The role of a triangle of a part's surface."""

    FREE = 0
    HELD = 1
    TOUCHED = 2


@dataclass(frozen=True, eq=False)
class Picks(Binary):
    """Triangles that were picked on a part's surface, page to server."""

    KIND: ClassVar[int] = 9

    role: Annotated[int, Wire("u8", "a Role, held or touched")]
    first: Annotated[bool, Wire("flag", "the first piece of this role; others are added to it")]
    triangles: Annotated[np.ndarray, Wire("floats", "indices into the part's triangles")]


@dataclass(frozen=True, eq=False)
class EndWish(Binary):
    """The wish that no more solves begin, because the surrogate is good enough; page to server."""

    KIND: ClassVar[int] = 10

    sure: Annotated[bool, Wire("flag", "always true")]


@dataclass(frozen=True, eq=False)
class Ready(Binary):
    """The news that the page has the surface and fields of a version of the body, page to server."""

    KIND: ClassVar[int] = 11

    version: Annotated[int, Wire("u16", "of the body, as in Hello")]


@dataclass(frozen=True, eq=False)
class PartFaces(Binary):
    """The faces that a part's triangles belong to, and what each is there for at first; server to page."""

    KIND: ClassVar[int] = 12

    faces: Annotated[np.ndarray, Wire("floats", "index into PartFacts.faces for each triangle")]
    roles: Annotated[np.ndarray, Wire("floats", "a Role for each triangle")]


@dataclass(frozen=True, eq=False)
class TrustMap(Binary):
    """The map of how well the force is known over the touched surface, server to page."""

    KIND: ClassVar[int] = 13

    depth: Annotated[float, Wire("f32", "m, of the ball at each point")]
    high: Annotated[float, Wire("f32", "upper end of the colour scale")]
    known: Annotated[bool, Wire("flag", "values are deviations; otherwise only the trained region is known")]
    values: Annotated[
        np.ndarray,
        Wire("floats", "deviation of the force over the force at each point; -1 not touched, -2 not trained"),
    ]


@dataclass(frozen=True)
class FaceInfo:
    """A face of a part: its name, its area in m², and the middle of it in m."""

    name: str
    area: float
    centre: Vec3


@dataclass(frozen=True)
class MaterialInfo:
    """A material that can be asked for by name, with what there is to say of it in a few words."""

    name: str
    about: str
    kind: str  # ``tissue``, ``silicone`` or ``other``
    young: str  # Young's modulus at small strains, with its unit
    poisson: str  # Poisson's ratio


@dataclass(frozen=True)
class SizeInfo:
    """A size of a tool that can be chosen: its name in `StartWish`, what it is, and a text with its unit."""

    name: str
    words: str
    value: str


@dataclass(frozen=True)
class ToolInfo:
    """Something that can press a part: a ball, or a tool with sizes that suit the part."""

    name: str  # ``ball`` or the tool's shape
    about: str  # in a few words
    sizes: tuple[SizeInfo, ...]  # none of a ball, whose radius is a choice of its own


@dataclass(frozen=True)
class RegionInfo:
    """A region of a part of several, and its material as it can be typed."""

    name: str
    material: str  # its name, a Young's modulus or a range of it; empty: that of the whole part


@dataclass(frozen=True)
class PartNews(Json):
    """The stage of the work on a part, server to page."""

    protocol: int  # `PROTOCOL`: a page of another one reloads itself
    name: str  # of the part
    stage: str  # ``reading`` the part, ``refused``, ``choosing``, ``working`` or ``ended``
    words: str  # what goes on, in a sentence
    version: int  # of the body that can be touched; 0 where there is none yet
    # counts the parts that are shown: another unit makes another part of a file; 0 where there is none yet
    part: int
    wrap: str = ""  # proposed size of a wrap of a part that is refused, as a text with its unit


@dataclass(frozen=True)
class PartFacts(Json):
    """A part and the choices that were made for it, server to page."""

    file: str  # its name
    unit: str  # of the file's numbers; empty where the file states it
    units: tuple[str, ...]  # in which the numbers could be taken instead; none where the file states its own
    size: Vec3  # (3,) lengths of the box around it, m
    faces: tuple[FaceInfo, ...]  # of the file, or parts of its surface between sharp edges
    whole: bool  # whether faces can be picked as a whole only
    materials: tuple[MaterialInfo, ...]  # that can be asked for by name
    laws: tuple[str, ...]  # that take Young's modulus and Poisson's ratio
    tools: tuple[ToolInfo, ...]  # that can press it
    regions: tuple[RegionInfo, ...]  # of a part of several; none of others
    choices: Mapping[str, str]  # made so far, as texts with units, by the names of `StartWish`
    notes: tuple[str, ...]  # what else there is to say, in sentences


@dataclass(frozen=True)
class StartWish(Json):
    """The choices with which the solves shall begin, page to server. Quantities are texts with units."""

    material: str  # name of a material; empty where law and constants are given
    law: str  # of an own material
    young: str  # Young's modulus of an own material
    poisson: str  # Poisson's ratio of an own material
    radius: str  # of the ball
    depth: str  # how deep the ball or tool presses at most
    trial: bool = False  # whether the choices are judged only, and nothing begins
    tool: str = "ball"  # what presses, by the name of a `ToolInfo`
    sizes: Mapping[str, str] = field(default_factory=dict)  # of a tool that is no ball, by their names
    # materials of regions by their names, as texts: a name, a Young's modulus or a range of it; empty: `material`
    regions: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class UnitWish(Json):
    """The wish that the numbers of the file are taken in another unit, page to server."""

    unit: str


@dataclass(frozen=True)
class WrapWish(Json):
    """The wish that a closed surface is wrapped around a refused one, page to server."""

    size: str  # of the wrap, as a text with its unit


@dataclass(frozen=True)
class Answer(Json):
    """The answer to a wish, server to page: problems in sentences, or none where all fits."""

    problem: str  # of the whole; empty where there is none
    # problems of single choices, by the names of `StartWish`; of sizes by ``size-`` and theirs, of regions by
    # ``region-`` and their numbers; null: none was judged
    fields: Mapping[str, str] | None = None
    trial: bool = False  # whether the wish was one on trial
    tool: DrawnTool | None = None  # the tool that was wished for, to be drawn


@dataclass(frozen=True)
class LearningProgress(Json):
    """The state of solving and learning, server to page."""

    phase: str  # what goes on, in words
    solves: int  # number that are done
    target: float  # relative force error at the 95th percentile that ends the work
    # relative force error against solves that were kept apart; null before the first body
    error_median: float | None
    error_p95: float | None  # 95th percentile of the same
    trial: str  # the latest body beside the one before it, on the same solves, in words; empty for none
    places: tuple[Vec3, ...]  # (k, 3) places on the surface where solves are done, m
    seconds: float  # time since the start, s
    report: bool  # whether there is a report at ``/report``
    remaining: float | None  # estimated time until the next surrogate, s; null where it is not known
    share: float  # of the way to the next surrogate that is done, 0 to 1
    painted_area: float | None = None  # that was to be touched, m²; null where it is not known
    trained_area: float | None = None  # its part that is trained, m²
