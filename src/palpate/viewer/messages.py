"""Every message between the server and its page; ``client/src/messages.ts`` is generated from here.

The conversation, over one websocket at ``/touch``:

1. The server says `Hello` (JSON): what the body is and what a hand does to it, ranges, scales, and the settings of
   the loop.
2. The page grants *credits* (`Credit`). The server sends a `Frame` only against a credit, and composes it at
   that moment from the newest tick, so nothing ever queues: a slow page gets fewer pictures, not older ones.
   The page grants one credit for each frame it has drawn, two at the start.
3. The page sends `Hand` at display rate while a hand holds the body, otherwise as a heartbeat every 50 ms.
   Without heartbeats the loop counts the input as stalled and sends no force. A hidden tab says so.
4. Only one page holds the hand at a time; `Frame.hold` tells each page where it stands.
5. Rare events in plain words are `Notice` (JSON).
6. A page that wants the touch recorded, or no longer, says `RecordWish`; the server tells all pages how it goes,
   `Recording` (JSON), at each change and once a second.
7. Before a frame that shows something new of it, the server says why there is no force, or lately was none (`Reason`,
   JSON), and whether the body is softened for the device (`Feel`, JSON). A page ends all force with `StopWish`.

A body drawn as a line (`Line`) is sent node by node in each frame. Of any other the page asks for the surface once, as
`Surface` at ``/surface``, and for the modes of each field as `Modes` at ``/fields/N``; a frame carries the coefficients
of the modes, and the page sums them itself.

A part that is set up and learnt while it is touched has a conversation of its own beside this one (`part_messages`).

A body that is only looked at needs no conversation: its page asks for `Shown` (JSON) at ``/shown``, for `Surface` at
``/surface`` and for each `Step` when it is wanted at ``/steps/N``.

Frames, signs and units: a line lies in the x–y plane, y up, z towards the viewer; a surface has z up. Metres, newtons,
seconds; displacements are offsets from rest; force is the force *on the hand*, in the body's axes.

    python -m palpate.viewer.messages > src/palpate/viewer/client/src/messages.ts
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated, Any, ClassVar

import numpy as np

from palpate.viewer.wire import Binary, Json, Wire

__all__ = [
    "PROTOCOL",
    "Credit",
    "DrawnTool",
    "Feel",
    "FieldInfo",
    "Frame",
    "Hand",
    "Hello",
    "Hold",
    "Line",
    "Loop",
    "Modes",
    "Notice",
    "RangeInfo",
    "Reason",
    "RecordWish",
    "Recording",
    "Shown",
    "Step",
    "StepInfo",
    "StopWish",
    "Surface",
    "Vec3",
]

PROTOCOL = 11  # a page of another protocol reloads itself

Vec3 = tuple[float, float, float]


class Loop(IntEnum):
    """The real-time process as the server sees it."""

    RUNNING = 0
    FROZEN = 1  # alive, but its ticks stand still
    ENDED = 2


class Hold(IntEnum):
    """Who holds the hand, from one page's point of view."""

    FREE = 0
    YOURS = 1
    ANOTHER = 2


@dataclass(frozen=True, eq=False)
class Frame(Binary):
    """One picture of the loop and of a touched body, server to page."""

    KIND: ClassVar[int] = 1

    version: Annotated[int, Wire("u16", "of the body that this picture is drawn with, as in Hello")]
    tick: Annotated[float, Wire("f64", "counts the loop's ticks")]
    time: Annotated[float, Wire("f64", "s, when the frame was composed, on the loop's clock")]
    echo: Annotated[float, Wire("f64", "ms, page clock: `sent` of the last Hand that this page sent")]
    position: Annotated[
        Vec3,
        Wire(
            "vec3",
            "m, the probe's centre or the tool's place, or the hand's offset from what it holds at rest",
        ),
    ]
    force: Annotated[Vec3, Wire("vec3", "N, on the hand")]
    torque: Annotated[Vec3, Wire("vec3", "N m, on a tool about its place; zero where none is told")]
    effort: Annotated[
        float, Wire("f32", "N, with which the body pushes two jaws apart; NaN where it is unknown")
    ]
    rate: Annotated[float, Wire("f32", "Hz, ticks per second achieved")]
    lateness: Annotated[
        float, Wire("f32", "s, the latest tick since the frame before, to a quarter of itself")
    ]
    lateness_p50: Annotated[float, Wire("f32", "s, median since the start, 0 below a microsecond")]
    lateness_p99: Annotated[float, Wire("f32", "s, 99th percentile since the start")]
    lateness_max: Annotated[float, Wire("f32", "s, largest since the start")]
    work_p50: Annotated[float, Wire("f32", "s, median CPU time of one tick")]
    faults: Annotated[int, Wire("u32", "faults since the start, stalls apart")]
    fault: Annotated[int, Wire("u8", "code of this tick's fault, 0 for none; words in Hello.faults")]
    last_fault: Annotated[int, Wire("u8", "code of the latest fault")]
    loop: Annotated[int, Wire("u8", "a Loop")]
    hold: Annotated[int, Wire("u8", "a Hold")]
    inside: Annotated[bool, Wire("flag", "the hand is within the trained range")]
    clamped: Annotated[bool, Wire("flag", "the force limit acted")]
    grabbed: Annotated[bool, Wire("flag", "a hand holds the body")]
    resting: Annotated[
        bool, Wire("flag", "nobody touches, and the loop ticks more slowly, or did so just now")
    ]
    stalled: Annotated[bool, Wire("flag", "the input is older than the loop allows")]
    parameters: Annotated[np.ndarray, Wire("floats", "current values of the parameters")]
    contact: Annotated[
        Vec3,
        Wire("vec3", "m, where a line's node is, as an offset from rest; else the contact point at rest"),
    ]
    normal: Annotated[Vec3, Wire("vec3", "of the surface there; zero where nothing touches")]
    depth: Annotated[
        float,
        Wire("f32", "m, of the probe in the surface at rest, negative in the air; or how far displaced"),
    ]
    stiffness: Annotated[float, Wire("f32", "N/m, along the force; 0 where unknown")]
    deviation: Annotated[
        float, Wire("f32", "standard deviation of the force relative to it, NaN where unknown")
    ]
    drawn: Annotated[float, Wire("f32", "m, depth of the shape drawn: after release it goes back to 0")]
    displacement: Annotated[
        np.ndarray, Wire("floats", "m, x y z of each of a line's nodes, as an offset from rest")
    ]
    coefficients: Annotated[
        np.ndarray, Wire("floats", "for each field its modes' coefficients and its local mode's profile")
    ]
    indentation: Annotated[
        np.ndarray,
        Wire("floats", "m, how deep it stays pressed at each of Surface.yielding; empty if nowhere"),
    ]


@dataclass(frozen=True, eq=False)
class Hand(Binary):
    """The hand's place and grip, page to server; also the heartbeat."""

    KIND: ClassVar[int] = 2

    sent: Annotated[float, Wire("f64", "ms, page clock when this was sent")]
    period: Annotated[float, Wire("f64", "s, the longest time to the next of these")]
    target: Annotated[Vec3, Wire("vec3d", "m, the hand in device coordinates")]
    grabbed: Annotated[bool, Wire("flag", "a hand holds the body")]
    hidden: Annotated[bool, Wire("flag", "the page is in the background")]
    parameters: Annotated[np.ndarray, Wire("floats", "wanted values of the parameters")]


@dataclass(frozen=True, eq=False)
class Credit(Binary):
    """Leave to send more frames, page to server."""

    KIND: ClassVar[int] = 3

    frames: Annotated[int, Wire("u16", "how many more")]


@dataclass(frozen=True, eq=False)
class Surface(Binary):
    """The surface of a body at rest, server to page. Points are split along sharp edges."""

    KIND: ClassVar[int] = 4

    rest: Annotated[np.ndarray, Wire("floats", "m, x y z of each point")]
    triangles: Annotated[np.ndarray, Wire("floats", "three points each; exact up to 16 million")]
    creases: Annotated[np.ndarray, Wire("floats", "two points for each sharp edge")]
    fixed: Annotated[np.ndarray, Wire("floats", "two points for each edge around the fixed surfaces")]
    touchable: Annotated[np.ndarray, Wire("floats", "1 for each triangle that a hand may touch, else 0")]
    yielding: Annotated[
        np.ndarray, Wire("floats", "points that keep indentations; none where the body keeps none")
    ]
    normals: Annotated[np.ndarray, Wire("floats", "outward unit normal of each of them")]


@dataclass(frozen=True, eq=False)
class Step(Binary):
    """One state of a body, server to page."""

    KIND: ClassVar[int] = 5

    index: Annotated[int, Wire("u32", "place in Shown.steps")]
    probed: Annotated[bool, Wire("flag", "a probe touches the body")]
    centre: Annotated[Vec3, Wire("vec3", "m, of the probe, or a tool's place")]
    turn: Annotated[
        Vec3, Wire("vec3", "rad, rotation vector that turns a tool about its place, beside its own")
    ]
    radius: Annotated[float, Wire("f32", "m, of the probe")]
    opening: Annotated[float, Wire("f32", "m, distance of two jaws; 0 of one tool")]
    displacement: Annotated[np.ndarray, Wire("floats", "m, x y z of each point of the surface")]
    values: Annotated[
        np.ndarray, Wire("floats", "all points' values of the first of Shown.fields, then the next")
    ]


@dataclass(frozen=True, eq=False)
class Modes(Binary):
    """A field on a Surface's points, server to page: rest + coefficients · modes + the local mode of a profile."""

    KIND: ClassVar[int] = 6

    reach: Annotated[float, Wire("f32", "m, of the local mode from the contact point; 0 for none")]
    rows: Annotated[int, Wire("u16", "splines of the distance from the contact point; 0 for none")]
    rest: Annotated[np.ndarray, Wire("floats", "components of each point")]
    modes: Annotated[np.ndarray, Wire("floats", "the same of each mode")]
    touched: Annotated[np.ndarray, Wire("floats", "points that the local mode may move")]
    shares: Annotated[np.ndarray, Wire("floats", "share of the local mode that each of them takes")]


@dataclass(frozen=True, eq=False)
class RecordWish(Binary):
    """The wish to record the touch, page to server."""

    KIND: ClassVar[int] = 7

    wanted: Annotated[bool, Wire("flag", "start one; otherwise stop it")]


@dataclass(frozen=True, eq=False)
class StopWish(Binary):
    """A person's wish to end all force, or to end the stop, page to server."""

    KIND: ClassVar[int] = 8

    stop: Annotated[bool, Wire("flag", "end all force; otherwise end the stop")]


@dataclass(frozen=True)
class RangeInfo:
    """A named interval."""

    name: str
    words: str  # the name as a person reads it
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class FieldInfo:
    """A quantity that deforms or colours a body, and its range over all that is shown."""

    name: str
    unit: str
    low: float
    high: float
    components: int
    modes: int  # that a frame has coefficients of


@dataclass(frozen=True)
class Line:
    """A body held at one node and drawn as a line."""

    rest: tuple[Vec3, ...]  # (N, 3) rest positions of the nodes along the body's axis, m
    touch_node: int  # the node that a hand holds
    nodes_of_interest: tuple[int, ...]  # nodes that the page marks
    # (2, 3) lower and upper corner of the box of the held node's offsets under all trained loads, m
    travel: tuple[Vec3, ...]


@dataclass(frozen=True)
class DrawnTool:
    """The tool that presses a body: its closed surface around its place, in the body's axes."""

    words: str  # shape and sizes, such as ``capsule of radius 6 mm, 24 mm long``
    centre: Vec3  # (3,) way from the tool's place to its middle, m
    # (3,) way from the tool's place to the ball whose depth counts, m: a file's core answers contact points less it
    shift: Vec3
    points: tuple[float, ...]  # x y z of each point from the place, m
    normals: tuple[float, ...]  # outward unit normal of each
    triangles: tuple[int, ...]  # three points each
    # parameters of `Hello` that are the rotation vector by which it is turned about its place, x y z, rad; -1 for none
    turns: tuple[int, int, int]
    opening: int = -1  # parameter of `Hello` that is the distance of two jaws, m; -1 for none
    along: Vec3 = (0.0, 0.0, 0.0)  # (3,) unit vector towards the first jaw; each moves half of the opening
    first: int = 0  # number of the points that belong to the first jaw; 0 of one tool


@dataclass(frozen=True)
class Hello(Json):
    """A touchable body and its loop, once per connection, server to page."""

    protocol: int  # `PROTOCOL`: a page of another one reloads itself
    # counts the surrogates of one body: a later one takes the place of the one before while it is touched
    version: int
    name: str  # of the body
    inputs: tuple[RangeInfo, ...]
    parameters: tuple[RangeInfo, ...]  # the inputs that the hand does not drive
    holds: bool  # whether the hand holds a node or a patch, and doesn't press a free probe
    radius: float  # of the probe, or of what is held, for drawing, m
    radius_parameter: int  # the parameter that is the probe's radius; -1 where none is
    tool: DrawnTool | None  # what presses where it is no ball; the probe's centre is then the tool's place
    twists: bool  # whether the torque on the tool is told
    deepest: float  # deepest trained depth, or largest trained displacement of what is held, m
    force_max: float  # largest force of the trained region, N
    stiffness_max: float  # largest stiffness of the trained region, N/m
    centre: Vec3  # (3,) the device's centre in the body's coordinates, m
    line: Line | None  # set where the body is drawn as a line, and not as a surface
    fields: tuple[FieldInfo, ...]  # to colour by; the first moves the surface where it has three components
    pad: str  # what the probe's pad takes of depth and force, in words; empty where there is none
    remembers: str  # how the force relaxes, or indentations stay, in words; empty where neither does
    scale: float  # body metres per metre of hand
    workspace: float  # radius of the hand's workspace, m
    max_force: float  # the force limit, N
    rate: float  # Hz, what the loop aims at
    faults: tuple[str, ...]  # words for fault codes, by code
    hand: str  # who moves the hand: ``page``, ``device``, ``recording`` or ``program``
    device: str  # the hand's name in words; empty where the page's own hand touches the body
    meta: Mapping[str, Any]  # what the model's file says of its making


@dataclass(frozen=True)
class StepInfo:
    """A state in words and figures."""

    label: str
    figures: Mapping[str, str]


@dataclass(frozen=True)
class Shown(Json):
    """A body to look at, server to page."""

    protocol: int  # `PROTOCOL`: a page of another one reloads itself
    name: str  # title of the page
    fields: tuple[FieldInfo, ...]  # quantities to colour by; the first is the displacement
    steps: tuple[StepInfo, ...]  # its states, in order
    reach: float  # largest displacement of all states, m
    tool: DrawnTool | None = None  # what presses where it is no ball; a state's centre is then its place


@dataclass(frozen=True)
class Notice(Json):
    """An event in plain words, server to page.

    What, why and fix are those of every error of palpate.
    """

    what: str
    why: str
    fix: str


@dataclass(frozen=True)
class Recording(Json):
    """The recording of the touch, server to page."""

    active: bool  # whether it runs
    file: str  # its name in the folder of the server; empty where there was none
    seconds: float  # duration, s
    size: float  # bytes so far
    lost: int  # number of ticks that could not be written down in time
    problem: str  # why it could not begin, or has stopped by itself; otherwise empty


@dataclass(frozen=True)
class Reason(Json):
    """The reason why there is no force, or lately was none, server to page."""

    now: str  # why there is none now, and what brings it back; empty where it may flow
    stopped: bool  # whether a person has stopped it, and must end that
    dropped: str  # what made the force drop last; empty where nothing has
    ago: float  # how long ago that was, s


@dataclass(frozen=True)
class Feel(Json):
    """Cautions about what is felt on the device, such as of a body too stiff for its rate and delay, server to page."""

    body: float  # the body's largest stiffness, N/m in hand metres
    limit: float  # the largest stiffness that is passive there, N/m
    felt: float  # the largest stiffness that the hand feels, N/m
    override: bool  # whether the user has asked for the body as stiff as it is
    # all of it in sentences, with the figures that the limit comes from; empty where there is nothing to say
    words: str


if __name__ == "__main__":
    import sys

    from palpate.viewer.typescript import generate

    sys.stdout.write(generate())
