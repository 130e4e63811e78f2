"""The model of a page: a touchable body as the pages of one server see it.

What is drawn is a line of nodes or a surface with fields; what a hand does is to press a free probe or to hold a node
or a patch. Both follow from the body, which is asked for what it can do.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from palpate.devices.hand_kind import HandKind
from palpate.format import bind_units
from palpate.input_words import input_in_words
from palpate.runtime.safety import Fault
from palpate.runtime.shared_state import State, now
from palpate.runtime.touchable import Touchable
from palpate.surrogates import NodeField
from palpate.surrogates.grip_effort import efforts
from palpate.surrogates.rigid_ball import pad_part_of
from palpate.units import Range, bounds
from palpate.viewer.about_record import about_record
from palpate.viewer.drawn_tool import drawn_tool
from palpate.viewer.indentation_drawing import yielding_in_words
from palpate.viewer.messages import PROTOCOL, Frame, Hello, Line, Modes, RangeInfo, Surface, Vec3
from palpate.viewer.part_messages import TrustMap
from palpate.viewer.surface_drawing import SurfaceDrawing
from palpate.viewer.trust_map import trust_map

__all__ = ["HandSettings", "LineDrawing", "PageModel", "swing", "vector"]

FREQUENCY = 2.0  # Hz, a pace that the eye can follow; the model's file holds no mass
DAMPING = 0.25  # share of the critical damping: at rest again within two seconds
STILL = 1e-3  # share of the last shape below which the body counts as at rest

_NO_TOUCH: dict[str, Any] = {
    "contact": (0.0, 0.0, 0.0),
    "normal": (0.0, 0.0, 0.0),
    "deviation": math.nan,
    "drawn": 0.0,
    "displacement": np.zeros(0),
    "coefficients": np.zeros(0),
    "indentation": np.zeros(0),
}


class HandSettings(Protocol):
    """The reach of a hand, as a page is told: a tick of the loop knows it, and so does a page without a loop."""

    @property
    def scale(self) -> float:
        """Metres of body per metre of hand."""

    @property
    def radius(self) -> float:
        """Radius of the hand's workspace, m."""

    @property
    def max_force(self) -> float:
        """The force limit, N."""


class PageModel:
    """A touchable body with all that its pages are told and sent.

    `version` counts the surrogates of one body, where a later one takes the place of the one before. `centre` (3,) is
    the device's centre in the body's coordinates, m, by default the body's own; a later surrogate has that of the
    first, because the loop keeps its workspace. `surface` is the body's at rest, None for one drawn as a line; an
    `outline`, points (n, 3) in m and triangles (t, 3), stands for it where no field tells it.
    """

    def __init__(
        self,
        body: Touchable,
        version: int = 1,
        centre: np.ndarray | None = None,
        outline: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> None:
        self.body, self.version = body, version
        self.centre = body.home if centre is None else centre
        self._line = None if body.line is None else LineDrawing(body, body.line)
        self._on_surface = SurfaceDrawing(body, outline=outline) if body.line is None else None
        self.surface: Surface | None = None if self._on_surface is None else self._on_surface.surface

    @property
    def drawing(self) -> SurfaceDrawing:
        """The drawing of a body with a surface."""
        assert self._on_surface is not None
        return self._on_surface

    @property
    def _drawing(self) -> LineDrawing | SurfaceDrawing:
        return self._line or self.drawing

    @property
    def field_count(self) -> int:
        """Number of the fields on the surface."""
        return len(self._drawing.infos)

    @cached_property
    def pad_words(self) -> str:
        """Return the pad's part in a press, in words; empty where there is no pad."""
        part = pad_part_of(self.body.energy, self.body.meta)
        return "" if part is None else bind_units(str(part))

    def modes(self, index: int) -> Modes:
        """Return what the page needs to sum up field `index` of the surface."""
        return self.drawing.modes(index)

    def trust_map(self) -> TrustMap:
        """Return how well the force is known over the touched surface."""
        return trust_map(self.drawing)

    def hello(
        self, state: HandSettings, rate: float, hand: HandKind = HandKind.PAGE, device: str = ""
    ) -> Hello:
        """Return what every page is told first; `rate` is that of the loop in Hz.

        `hand` says who moves the hand, and `device` names it in words; those are empty where it is a page's own.
        """
        body, tool = self.body, self.body.tool or self.body.gripper
        return Hello(
            protocol=PROTOCOL,
            version=self.version,
            name=body.name,
            inputs=_ranges(body.inputs),
            parameters=_ranges(body.parameters),
            holds=body.holds,
            radius=body.radius,
            radius_parameter=-1 if body.radius_parameter is None else body.radius_parameter,
            tool=None if tool is None else drawn_tool(tool, body.parameters, body.shift.tolist()),
            twists=body.tells_torque,
            deepest=body.deepest,
            force_max=body.force_max,
            stiffness_max=body.stiffness_max,
            centre=vector(self.centre),
            line=None if self._line is None else self._line.line,
            fields=self._drawing.infos,
            pad=self.pad_words,
            remembers="" if body.line is not None else yielding_in_words(body) or str(body.memory or ""),
            scale=state.scale,
            workspace=state.radius,
            max_force=state.max_force,
            rate=rate,
            faults=tuple(fault.meaning_for(hand) for fault in Fault),
            hand=hand,
            device=device,
            meta=about_record(body.meta),
        )

    def frame(self, loop: Mapping[str, Any], state: State, held: bool, parameters: np.ndarray) -> Frame:
        """Return a picture of a tick; `parameters` (p,) are the inputs that the hand doesn't supply.

        `loop` has the fields of `Frame` that tell of the loop and the page, whatever the body.
        """
        parameters = parameters[: len(self.body.energy.parameters)]
        drawn = self._drawing.frame(state, held, parameters)
        felt = {"depth": state.depth, "stiffness": state.stiffness if held else 0.0}
        felt["effort"] = self._effort(state.position, parameters) if held and state.depth > 0.0 else 0.0
        return Frame(**{"version": self.version, **_NO_TOUCH, **felt, **loop, **drawn})

    def _effort(self, position: np.ndarray, parameters: np.ndarray) -> float:
        """Return the effort of two jaws at a place (3,), N; not-a-number of one tool, and of a body that remembers."""
        if self.body.gripper is None or self.body.memory is not None:
            return math.nan
        return float(efforts(self.body.energy, np.append(position, parameters)[None])[0])


class LineDrawing:
    """A body drawn as a line, and its way back to rest after the hand lets go.

    While a hand holds the body, the drawn shape is the one under the loads that the loop published: the picture and the
    force belong to one state. A body that remembers is drawn as it lies. Any other, once released, feels no hand and
    the *force is zero*; the loop knows no inertia, so the swing back is a drawing, not a result: the loads decay from
    their last value as a lightly damped oscillator of one degree of freedom (`swing`), and each drawn shape is the
    body's static shape under that share of the last loads.
    """

    infos = ()

    def __init__(self, body: Touchable, field: NodeField) -> None:
        self._body, self._field = body, field
        self._low, self._high = bounds(field.inputs)
        self._loads, self._released = np.zeros(len(field.inputs)), -math.inf

    @property
    def line(self) -> Line:
        """The line at rest."""
        field = self._field
        return Line(
            rest=tuple(vector(node) for node in field.points),
            touch_node=field.held,
            nodes_of_interest=tuple(int(i) for i in field.of_interest),
            travel=tuple(vector(corner) for corner in self._body.travel),
        )

    def frame(self, state: State, held: bool, parameters: np.ndarray) -> dict[str, Any]:
        """Return the shape's part of a frame; see `PageModel.frame`."""
        loads, contact = state.loads[: len(self._loads)], state.contact
        if self._body.stays:
            displacement = self._field.values(loads)[0]
        elif held:
            displacement = self.held(loads, now())
        else:
            displacement = self.free(parameters, now())
            contact = displacement[self._field.held]
        return {"contact": vector(contact), "displacement": displacement}

    def held(self, loads: np.ndarray, at: float) -> np.ndarray:
        """Return the displacement (N, 3) under the published loads (n,) at time `at` (s), while a hand holds, m."""
        self._loads, self._released = loads.copy(), at
        return np.asarray(self._field.values(loads)[0])

    def free(self, parameters: np.ndarray, at: float) -> np.ndarray:
        """Return the displacement (N, 3) at time `at` (s) without a hand, under the untouched loads (p,) alone, m."""
        field, loads = self._field, self._loads.copy()
        loads[list(field.further)] = parameters
        # a one-sided load of a body that doesn't mirror stops at its end of the range
        low = -self._high if field.mirror is not None else np.minimum(self._low, 0.0)
        driven = np.clip(swing(at - self._released) * loads, low, self._high)
        loads[field.touched] = driven[field.touched]
        return np.asarray(field.values(loads)[0])


def swing(elapsed: float) -> float:
    """Return the share s of the last loads that is drawn `elapsed` seconds after release.

        s(t) = e^(−ζωt) (cos ω_d t + ζω/ω_d sin ω_d t),   ω_d = ω √(1 − ζ²)

    It is 1 at first with zero slope, and 0 at last.
    """
    w = 2.0 * math.pi * FREQUENCY
    envelope = math.exp(-DAMPING * w * elapsed)
    if envelope < STILL:
        return 0.0
    root = math.sqrt(1.0 - DAMPING**2)
    return envelope * (math.cos(root * w * elapsed) + DAMPING / root * math.sin(root * w * elapsed))


def vector(v: np.ndarray) -> Vec3:
    """Return three numbers as a tuple."""
    return (float(v[0]), float(v[1]), float(v[2]))


def _ranges(inputs: tuple[Range, ...]) -> tuple[RangeInfo, ...]:
    return tuple(RangeInfo(r.name, input_in_words(r.name), r.low, r.high, r.unit) for r in inputs)
