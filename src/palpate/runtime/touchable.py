"""A learnt body as a hand finds it: where the hand rests, how deep and stiff the body is, who answers in the loop.

Nothing of the answer is made here: energy, force and stiffness are the learnt body's own, and so is its memory. All
that follows from them for a hand is worked out once, when it is asked for.

A free probe's centre is the hand's place itself, in the body's coordinates, z up; the device's centre is a place of
first contact. What a hand holds is displaced by the hand from its rest position, which is the device's centre.
"""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from palpate.devices import device_traits
from palpate.errors import UsageError
from palpate.runtime.hand_evaluator import HandEvaluator
from palpate.runtime.workspace import Workspace
from palpate.surrogates import Field, LearntEnergy, LearntQuantities, NodeField, Surrogate, TouchedSurface
from palpate.surrogates.fields import line_of
from palpate.surrogates.learnt_torque import ARM, torque_evaluator
from palpate.surrogates.memories import Friction, Memory
from palpate.surrogates.moving_rest import follow
from palpate.surrogates.tool_friction import with_friction
from palpate.surrogates.training_record import correction_count, correction_warning
from palpate.tools import Gripper, PosedTool
from palpate.tools.gripper import OPENING
from palpate.units import Range, bounds

__all__ = ["FRICTION", "Touchable", "aim_device", "load_touchable", "touchable"]

FRICTION = "friction"  # name of the further input that is the coefficient of friction
_SHARE = 0.75  # of the deepest trained depth: how deep a scripted stroke goes
_WAY, _PAUSE = 9, 0.1  # places on the way to an end, and the time from one to the next, s
_SLIVER = 1e-3  # of the deepest depth: shallower is no press
_STEEPEST = 10.0  # slope of a depth: 1 for a distance, and 6 was measured behind flat bodies
_NEAR = 32  # rows near the middle of the ranges that are answered before all others


@dataclass(frozen=True, eq=False)
class Touchable:
    """An energy that a hand can feel, with all that follows from it for that hand."""

    energy: LearntEnergy  # what the hand feels: force and stiffness, depth, trained region
    # what the eye sees; may be empty
    fields: Mapping[str, Field] = field(default_factory=dict)
    name: str = "body"  # of the body, as pages and reports call it
    memory: Memory | None = None  # what it remembers of how it was touched
    meta: Mapping[str, Any] = field(default_factory=dict)  # what the file says of its making
    arm: LearntQuantities | None = None  # torque per newton about a tool's place, where that is learnt

    def __str__(self) -> str:
        return f"Touchable {self.name}: {self.energy}"

    __repr__ = __str__

    @property
    def inputs(self) -> tuple[Range, ...]:
        """Names and trained ranges of all inputs: the felt coordinates (m), then the further ones."""
        return tuple(self.energy.inputs)

    @property
    def parameters(self) -> tuple[Range, ...]:
        """The inputs that the hand doesn't supply, the coefficient of friction last where there is friction."""
        law = self.friction
        if law is None or law.kinetic == 0.0:
            return tuple(self.energy.parameters)
        # its middle, with which loop and page begin, is the body's own
        return (*self.energy.parameters, Range(FRICTION, 0.0, 2.0 * law.kinetic, ""))

    @property
    def start(self) -> np.ndarray:
        """Values (p,) of `parameters` with which loop and page begin: the middle of their ranges, jaws at their widest.

        A body that a device meets inside of it is felt only once the hand has left it, which jaws that are shut don't.
        """
        return np.array([r.high if r.name == OPENING else (r.low + r.high) / 2.0 for r in self.parameters])

    @property
    def friction(self) -> Friction | None:
        """The friction of the tool on it; None without."""
        return None if self.memory is None else self.memory.friction

    def with_friction(self, kinetic: float, static: float | None = None) -> Touchable:
        """Return the same body with another friction, pure numbers; the same value where it has just that."""
        law, static = self.friction, kinetic if static is None else static
        if (kinetic, static) == ((0.0, 0.0) if law is None else (law.kinetic, law.static)):
            return self
        return replace(self, memory=with_friction(self.energy, self.memory, kinetic, static))

    @property
    def surface(self) -> TouchedSurface | None:
        """The touched surface at rest, where a free probe touches one; otherwise None."""
        return self.energy.baseline.surface

    @property
    def tool(self) -> PosedTool | None:
        """The rigid tool that presses, in the orientation in which its further inputs find it; None of a ball."""
        tool = getattr(self.energy.baseline, "posed_tool", None)
        return tool if isinstance(tool, PosedTool) else None

    @property
    def gripper(self) -> Gripper | None:
        """The two jaws that pinch, whose opening is a further input; None of any other tool."""
        tool = getattr(self.energy.baseline, "posed_tool", None)
        return tool if isinstance(tool, Gripper) else None

    @cached_property
    def shift(self) -> np.ndarray:
        """Way (3,) in m from a tool's place to the centre of the ball whose depth counts; zero of a ball.

        `surface` is the body's less this way, so that it takes places; all of it where a tool turns.
        """
        return np.zeros(3) if self.tool is None else self.energy.baseline.surface_shift(self.normal)

    @property
    def holds(self) -> bool:
        """True where the hand holds a patch or a node of the body, and doesn't move a free probe."""
        return bool(self.energy.baseline.holds)

    @property
    def upright(self) -> bool:
        """True for z up, as solids have it; what is held within the x–y plane, as a beam is, has y up."""
        return bool(self.energy.baseline.directions[:, 2].any())

    @property
    def line(self) -> NodeField | None:
        """The displacement of a body that is drawn as a line of nodes, of which a hand holds one; otherwise None."""
        return line_of(self.fields)

    @property
    def tells_torque(self) -> bool:
        """True where the torque on a tool is known: it was learnt, or turns of the tool are inputs."""
        return torque_evaluator(self.energy, self.arm) is not None

    @property
    def tool_axis(self) -> np.ndarray:
        """The tool's own axis (3,), a unit vector; z of a probe that has none."""
        turn = getattr(getattr(self.energy.baseline, "posed_tool", None), "turn", None)
        return np.array([0.0, 0.0, 1.0]) if turn is None else np.ascontiguousarray(turn[:, 2])

    @property
    def stays(self) -> bool:
        """True for a body that lies elsewhere after a touch, so that there is no swing back to rest."""
        return self.memory is not None and self.memory.moves_rest

    @property
    def radius_parameter(self) -> int | None:
        """Index of the probe's radius among the further inputs; None where that is fixed."""
        own = self.energy.baseline.radius_input
        return None if own is None else own - self._felt

    @property
    def _felt(self) -> int:
        """Number of the inputs that the hand supplies: three, or the directions in which it can move a node."""
        return len(self.inputs) - len(self.energy.parameters)

    @property
    def radius(self) -> float:
        """Radius of the probe, m; the middle of its range where it is an input.

        Of what is held, and of a probe that has none, a size to draw.
        """
        if self.radius_parameter is not None:
            own = self.parameters[self.radius_parameter]
            return (own.low + own.high) / 2.0
        if self.line is not None:
            return self.line.radius
        radius = float(self.energy.baseline.radius)
        if math.isfinite(radius):
            return radius
        return self.reach / 2.0 if self.holds else self.deepest

    @cached_property
    def trained_inputs(self) -> np.ndarray:
        """Inputs (N, n) where the hand feels something, inside the trained region: random ones, and those learnt from.

        A body that has none is a UsageError.
        """
        X = self.energy.trained_rows()
        if self.holds:  # what is held is stiffest and goes farthest at the ends
            X = np.vstack([X, list(itertools.product(*((r.low, r.high) for r in self.inputs)))])
        depth = self.depth(X)
        felt = X[self.energy.inside(X) & (depth > _SLIVER * max(depth.max(), 0.0)) & (depth > 0.0)]
        if not len(felt):
            raise UsageError(
                "This body can't be touched.",
                why="No hand within the ranges it was trained on touches it.",
                fix="Learn it from solves in contact.",
            )
        return np.asarray(felt)

    def depth(self, X: np.ndarray) -> np.ndarray:
        """Depth (N,) of the probe in the surface at rest, or displacement of what is held, at inputs (N, n), m."""
        return np.asarray(self.energy.depth(X))

    @cached_property
    def stiffness_max(self) -> float:
        """Largest eigenvalue of −∂F/∂x over the trained region, N/m: what the loop's stability depends on."""
        return float(np.linalg.eigvalsh(-self.energy.stiffness(self.trained_inputs)).max())

    @cached_property
    def force_max(self) -> float:
        """Largest ‖F‖ of the trained region, N."""
        return float(np.linalg.norm(self.energy.force(self.trained_inputs), axis=1).max())

    @cached_property
    def deepest(self) -> float:
        """Deepest trained depth, or largest trained displacement of what is held, m."""
        known = self.energy.going.deepest
        return known if math.isfinite(known) else float(self.depth(self.trained_inputs).max())

    @cached_property
    def _first_contact(self) -> tuple[np.ndarray, np.ndarray]:
        """Centre of a probe at first contact in the middle of the touched place, and the outer normal there."""
        if self.holds:
            return np.zeros(3), np.array([0.0, 0.0, 1.0])
        # the middle of the ranges where that is a press; on a curved body it may lie too deep
        x = self._nearest_press()
        if self.gripper is not None:  # its centre lies in the body, and leaves it upwards, between the jaws
            return x[:3], np.eye(3)[0 if self.gripper.axis == "z" else 2]
        if self.surface is None:  # a probe that is felt without a surface: it comes against its force
            force = self.energy.force(x[None])[0]
            normal = force / np.linalg.norm(force)
            return x[:3] + self.depth(x[None])[0] * normal, normal
        _, slope, _ = self.surface.at(x[None, :3])
        normal = slope[0] / np.linalg.norm(slope[0])
        return x[:3] + self.depth(x[None])[0] * normal, normal

    def _nearest_press(self) -> np.ndarray:
        """Return the one of `trained_inputs` that is nearest to the middle of the ranges.

        Among the rows near the middle it is sought first: these are answered sooner than all.
        """
        low, high = bounds(self.inputs)
        if self.surface is not None:
            rows = self.energy.trained_rows()
            near = rows[np.argsort(_from_middle(rows, low, high), kind="stable")[:_NEAR]]
            depth = self.depth(near)
            press = self.energy.inside(near) & (depth > 0.0)
            first = int(np.argmax(press))
            deepest = depth[first] + _STEEPEST * float(np.linalg.norm(high - low))  # of all rows, at most
            if press[first] and depth[first] > _SLIVER * deepest:
                return np.asarray(near[first])
        X = self.trained_inputs
        return np.asarray(X[np.argmin(_from_middle(X, low, high))])

    @property
    def home(self) -> np.ndarray:
        """The device's centre (3,), m: the probe's centre at first contact in the middle, or rest."""
        return self._first_contact[0]

    @property
    def normal(self) -> np.ndarray:
        """Outer normal (3,) of the surface there."""
        return self._first_contact[1]

    @property
    def away(self) -> np.ndarray:
        """Where a probe (3,) is that nobody holds, m: a radius above `home`, in the air. What is held is at rest.

        Two jaws are beside the body, whatever their opening.
        """
        if self.gripper is not None:
            low, high = self.energy.baseline.surfaces[0].box
            return self.home + float(np.linalg.norm(high - low)) * self.normal
        return self.home if self.holds else self.home + self.radius * self.normal

    def held_place(self, parameters: np.ndarray) -> np.ndarray:
        """Return the place (3,) at rest of what is held at further inputs (p,), m.

        Further inputs that are lengths and whose names end with an axis, such as ``p_x``, are its coordinates.
        """
        place = np.zeros(3)
        for value, known in zip(parameters, self.energy.parameters, strict=True):
            if known.unit == "m" and known.name[-2:] in {"_x", "_y", "_z"}:
                place["xyz".index(known.name[-1])] = value
        return place

    @cached_property
    def reach(self) -> float:
        """Largest distance from `home` to which the hand went in training, m."""
        places = self.trained_inputs[:, : self._felt]
        return float(np.linalg.norm(places if self.holds else places - self.home, axis=1).max())

    @property
    def indentation(self) -> Any:
        """The memory of its indentation; None for a body that keeps none."""
        memory = None if self.memory is None else self.memory.of_body
        return memory if memory is not None and memory.keeps_indentation else None

    def evaluator(self, *, few: bool = False) -> HandEvaluator:
        """Return the allocation-free evaluator of the 1 kHz path; one for a `few` places waits for no compiler."""
        elastic, memory = self.energy.evaluator(few=few), None if self.memory is None else self.memory.start()
        if self.holds:
            # lengths among the further inputs of what is held say where it is held
            places = tuple(i for i, r in enumerate(self.parameters) if r.unit == "m")
            directions = self.energy.baseline.directions
            node = None if self.line is None else self.line.node(directions)
            return HandEvaluator(elastic, memory, holds=True, directions=directions, node=node, places=places)
        return HandEvaluator(
            elastic,
            memory,
            holds=False,
            away=self.away,
            normal=self.normal,
            inner=self.energy.baseline.inner,
            radius=self.energy.baseline.radius,
            radius_input=self.radius_parameter,
            further=len(self.energy.parameters),
            torque_at=torque_evaluator(self.energy, self.arm, few=few),
            few=few,
        )

    @cached_property
    def travel(self) -> np.ndarray:
        """Lower and upper corner (2, 3) of the box in which the held node of a line moves, offsets from rest, m.

        The box is taken over both ends and the middle of every load's range: bodies bend farthest at the ends, and
        reach farthest along their axis near the middle of a range of both signs. A body that mirrors goes as far
        against its load. One that lies elsewhere after a touch is led to both ends of its place, and let go there.
        """
        line = self.line
        if line is None:
            return np.zeros((2, 3))
        if self.stays:
            offsets = self._led_to_ends(line)
        else:
            ends = [(-r.high if line.mirror is not None else r.low, r.high) for r in line.inputs]
            lattice = np.array(list(itertools.product(*((a, (a + b) / 2.0, b) for a, b in ends))))
            offsets = np.vstack([line.values(lattice)[:, line.held], np.zeros(3)])
            if line.mirror is not None:
                half = line.values(lattice / 2.0)[:, line.held]
                offsets = np.vstack([offsets, half])
        return np.array([offsets.min(axis=0), offsets.max(axis=0)])

    def _led_to_ends(self, line: NodeField) -> np.ndarray:
        """Return offsets (N, 3) of the held node, m, led from rest to both ends of its place and let go there."""
        direction, ends, offsets = self.energy.baseline.directions[0], self.inputs[0], []
        for end in (ends.low, ends.high):
            way = np.linspace(0.0, end, _WAY)
            led = follow(self.energy, self.memory, way[:, None], _PAUSE * np.arange(_WAY))
            places = np.append(way, led.rest @ direction)
            pulls = np.append(-led.force @ direction, 0.0)
            offsets.append(line.values(np.stack([places, pulls], axis=1))[:, line.held])
        return np.concatenate(offsets)

    def workspace(self, radius: float) -> Workspace:
        """Return how a hand's workspace, the sphere of `radius` (m) that the device reaches, lies about the body."""
        x, y, z = self.home.tolist()
        return Workspace.for_reach(radius, self.reach, centre=(x, y, z), upright=self.upright)

    def stroke(self, scale: float) -> dict[str, float]:
        """Return amplitude (m) and direction, in device coordinates, of a stroke to three quarters of `deepest`.

        They lie under ``amplitude``, ``x``, ``y`` and ``z``; there are none where a hand holds, which the device's own
        stroke displaces. `scale` is metres of body per metre of hand.
        """
        if self.holds:
            return {}
        x, y, z = (-self.normal).tolist()
        return {"amplitude": _SHARE * self.deepest / scale, "x": x, "y": z, "z": -y}


def _from_middle(X: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the squared distances (N,) of rows X (N, n) from the middle of ranges, in units of these."""
    return np.asarray((((X - (low + high) / 2.0) / (high - low)) ** 2).sum(axis=1))


def aim_device(device: str, body: Touchable) -> str:
    """Return the device; a scripted stroke without a place presses where the body was trained to be pressed.

    A name that no device has is refused.
    """
    name, _, text = device.partition(":")
    scale = body.workspace(device_traits(device).radius).scale
    if name not in {"stroke", "simulated"} or body.holds:
        return device
    given = {part.partition("=")[0].strip() for part in text.split(",") if part}
    axes = {"x", "y", "z"}
    known = {
        k: v for k, v in body.stroke(scale).items() if k not in given and not (k in axes and given & axes)
    }
    return f"{name}:" + ",".join(
        [part for part in (text, *(f"{k}={v:.9g}" for k, v in known.items())) if part]
    )


def touchable(model: Surrogate, name: str = "") -> Touchable:
    """Return a learnt body as a hand finds it, under `name` where its own record has none."""
    known = str(model.meta.get("name", "")) or name or "body"
    if (touches := correction_count(model.meta)) is not None:
        known += f", corrected by {touches} touches" + (
            " with a warning" if correction_warning(model.meta) else ""
        )
    fields = {name: shown for name, shown in model.fields.items() if shown.carrier != "places"}
    arm = model.quantities.get(ARM)
    return Touchable(model.hand_energy, fields, known, model.memory, model.meta, arm)


def load_touchable(path: str | os.PathLike[str], friction: float | None = None) -> Touchable:
    """Read a learnt body that can be touched from its file, whose stem names a body whose own record has no name.

    A coefficient of friction, a pure number, takes the place of its own.
    """
    path = Path(path)
    body = touchable(Surrogate.load(path), path.stem)
    return body if friction is None else body.with_friction(friction)
