"""What a page is told of a body, and the pictures it is sent: a body held at one node, that remembers, or pressed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from palpate.runtime.held_node import BeamTouchable, RodTouchable
from palpate.runtime.safety import Fault
from palpate.runtime.shared_state import State, now
from palpate.runtime.touchable import Touchable
from palpate.units import Range
from palpate.viewer.messages import PROTOCOL, Beat, Frame, Hello, RangeInfo, Vec3
from palpate.viewer.picture import Picture
from palpate.viewer.wire import Json

__all__ = ["Exhibit", "HeldExhibit", "exhibit_of", "loop_facts", "ranges", "vector"]


class Exhibit(Protocol):
    """A body as the pages of one server see it."""

    def hello(self, state: State, rate: float) -> Json:
        """What every page is told first; `rate` is what the loop aims at, Hz."""
        ...

    def frame(self, beat: Mapping[str, Any], state: State, held: bool, parameters: np.ndarray) -> Beat:
        """A picture: what every one tells (`beat`), and what this body looks like in the loop's state.

        Parameters
        ----------
        beat : mapping
            The fields of `Beat`.
        state : State
        held : bool
            Whether a hand holds the body.
        parameters : (p,)
            The untouched inputs.
        """
        ...


class HeldExhibit:
    """A body held at one node."""

    def __init__(self, body: BeamTouchable) -> None:
        self.body, self.model = body, body.energy
        self._picture = Picture(body.energy)

    def hello(self, state: State, rate: float) -> Hello:
        """See `Exhibit`."""
        return _greeting(self.body, state, rate)

    def frame(self, beat: Mapping[str, Any], state: State, held: bool, parameters: np.ndarray) -> Frame:
        """See `Exhibit`."""
        if held:
            loads = state.loads[: len(self.model.inputs)]
            shape = self._picture.held(loads, state.mirrored, state.contact, now())
        else:
            shape = self._picture.free(parameters, now())
        return Frame(**beat, contact=vector(shape.contact), displacement=shape.displacement)


class RememberingExhibit:
    """A body held at one node that remembers: drawn as it lies, held or not."""

    def __init__(self, body: BeamTouchable) -> None:
        self.body, self.model = body, body.energy

    def hello(self, state: State, rate: float) -> Hello:
        """See `Exhibit`."""
        return _greeting(self.body, state, rate)

    def frame(self, beat: Mapping[str, Any], state: State, held: bool, parameters: np.ndarray) -> Frame:
        """See `Exhibit`."""
        del held, parameters
        shape = self.model.displacement(state.loads[: len(self.model.inputs)])
        return Frame(**beat, contact=vector(state.contact), displacement=shape)


def exhibit_of(model: Touchable) -> Exhibit:
    """The exhibit of a model."""
    from palpate.viewer.pressing import PressedExhibit

    if isinstance(model, RodTouchable):
        return RememberingExhibit(model)
    return HeldExhibit(model) if isinstance(model, BeamTouchable) else PressedExhibit(model)


def _greeting(body: BeamTouchable, state: State, rate: float) -> Hello:
    """What the page of a body held at one node is told first."""
    model = body.energy
    return Hello(
        protocol=PROTOCOL,
        name=model.name,
        rest=tuple(vector(node) for node in model.rest),
        radius=model.radius,
        touch_node=model.touch_node,
        nodes_of_interest=tuple(int(i) for i in model.nodes_of_interest),
        inputs=ranges(model.inputs),
        parameters=ranges(model.parameters),
        reach=model.reach,
        travel=tuple(vector(corner) for corner in body.travel),
        meta=model.meta,
        **loop_facts(state, rate),
    )


def loop_facts(state: State, rate: float) -> dict[str, Any]:
    """What every page is told of the loop: scale, workspace, force limit, rate, words for faults."""
    return {
        "scale": state.scale,
        "workspace": state.radius,
        "max_force": state.max_force,
        "rate": rate,
        "faults": tuple(f.meaning for f in Fault),
    }


def ranges(inputs: tuple[Range, ...]) -> tuple[RangeInfo, ...]:
    """Ranges as the page takes them."""
    return tuple(RangeInfo(r.name, r.low, r.high, r.unit) for r in inputs)


def vector(v: np.ndarray) -> Vec3:
    """Three numbers."""
    return (float(v[0]), float(v[1]), float(v[2]))
