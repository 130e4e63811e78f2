"""A learnt body in a MuJoCo scene: the force on a tool as a passive force, its reaction on what the body stands on.

    contact = attach(model, data, "block.palpate", geom="tool", at=(0.3, 0.0, 0.1))
    mujoco.mj_step(model, data)
    contact.force                                     # N, on the tool, in the scene's axes

MuJoCo calls `mjcb_passive` once a step; there the tool's place goes into the learnt energy, and the energy's force goes
into ``qfrc_passive``. A force that is the slope of one energy gives nothing away: with steps that are short for the
body's stiffness a bounce keeps its energy. With longer ones no explicit step can be stable; then the force is taken at
the end of the step, by its own stiffness (linearly implicit), which damps.

The body is quasi-static and fixed in the frame it stands in; the tool is a ball of the radius that was learnt, or
whatever point the pad of a held body is led by.
"""

from __future__ import annotations

import math
import os
import threading
import warnings
import weakref
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.adapters.extra import import_extra
from palpate.adapters.mujoco_callbacks import call_for, forget_scene
from palpate.adapters.mujoco_tool import SceneTool, number_of, tool_of
from palpate.errors import UsageError
from palpate.format import millimetres
from palpate.surrogates import Surrogate
from palpate.surrogates.energy_evaluator import EnergyEvaluator

__all__ = ["SENSOR_VALUES", "SoftContact", "StiffStepWarning", "attach"]

SENSOR_VALUES = ("force_x", "force_y", "force_z", "trust", "inside", "torque_x", "torque_y", "torque_z")
"""Values of a user sensor that a contact fills: N, the force's relative deviation, 1 or 0, N m; in the scene's axes."""

_RADIUS_SLACK = 1e-3  # share of the learnt radius by which a tool's may differ
_MILLIMETRES = 1e3
# K Δt² / m beyond which the force is taken at the end of the step; an explicit step is unstable from 4 on
_STIFF = 0.25
_MARGIN = 8.0  # how much lighter a tool may be, in some pose, than MuJoCo's estimate of it at rest


class StiffStepWarning(UserWarning):
    """A step is too long for the body's stiffness, so that the force is damped."""


@dataclass
class _Answer:
    """The last answer of one thread and one MjData."""

    force: np.ndarray = field(default_factory=lambda: np.zeros(3))
    torque: np.ndarray = field(default_factory=lambda: np.zeros(3))
    trust: float = 0.0
    inside: bool = True
    depth: float = -math.inf
    energy: float = 0.0


class _Place:
    """One thread's evaluator and scratch: nothing is shared between threads."""

    def __init__(self, contact: SoftContact) -> None:
        self.evaluator: EnergyEvaluator = contact.body.hand_energy.evaluator()
        self.jacobian, self.solved = np.zeros((3, contact.model.nv)), np.zeros((3, contact.model.nv))
        self.other, self.turn = np.zeros((3, contact.model.nv)), np.zeros((3, contact.model.nv))
        self.answer = _Answer()
        self.torque_at: Any = contact.body.torque_evaluator
        self.parameters = contact.parameters.copy()


class SoftContact:
    """The force between one tool of a scene and one learnt body; made by `attach`.

    Attributes
    ----------
    model : mujoco.MjModel
        The scene it belongs to; every MjData of it feels the body.
    body : Surrogate
        The learnt body.
    damped_steps : int
        How many steps were too long for the body's stiffness, so that the force was damped.
    """

    def __init__(
        self, model: Any, body: Surrogate, *, tool: SceneTool, base: int, place: np.ndarray, turn: np.ndarray,
        parameters: np.ndarray, sensor: tuple[int, int] | None,
    ) -> None:  # fmt: skip
        self._mujoco = import_extra("mujoco", "mujoco")
        self._model, self.body, self.parameters = weakref.ref(model), body, parameters
        self._tool, self._base, self._sensor = tool, base, sensor
        self._place, self._turn = place, turn
        self._bound = tool.bound
        # of a tool that is light in some pose, and of a base that gives way too
        self._lightness = _MARGIN * float(model.body_invweight0[[self._bound, base], 0].sum())
        self._threads = threading.local()
        self._last = _Answer()
        self.damped_steps = 0

    @property
    def model(self) -> Any:
        """The scene, while it is there."""
        return self._model()

    @property
    def force(self) -> np.ndarray:
        """Force (3,) on the tool at the last step, N, in the scene's axes; its opposite acts on what bears the body."""
        return self._last.force

    @property
    def torque(self) -> np.ndarray:
        """Torque (3,) on the tool about its place, N m, as `force`: zero of a ball, which has none about its centre."""
        return self._last.torque

    @property
    def trust(self) -> float:
        """Standard deviation of the force relative to its size; not-a-number for a body without a posterior."""
        return self._last.trust

    @property
    def inside(self) -> bool:
        """True where the tool was within the trained region, or without contact, where the answer is exact."""
        return self._last.inside

    @property
    def depth(self) -> float:
        """Depth of the tool in the surface at rest, m; negative without contact. Of a held body how far it was led."""
        return self._last.depth

    @property
    def energy(self) -> float:
        """Energy stored in the body, J."""
        return self._last.energy

    def pose(self, data: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return place (3,), m, and axes (3, 3) of the learnt body's frame in the scene.

        Parameters
        ----------
        data : mujoco.MjData
            Whose kinematics were computed.
        """
        if not self._base:
            return self._place, self._turn
        frame = data.xmat[self._base].reshape(3, 3)
        return data.xpos[self._base] + frame @ self._place, frame @ self._turn

    def place(self, data: Any) -> np.ndarray:
        """Return the tool's place (3,) in the learnt body's frame, m."""
        place, turn = self.pose(data)
        return np.asarray((self._tool.place(data) - place) @ turn)

    def detach(self) -> None:
        """Take the body out of the scene."""
        contacts = _contacts_of(self.model)
        if self in contacts:
            contacts.remove(self)
        if not contacts and self.model is not None:
            _leave(id(self.model), self.model._address)

    def __repr__(self) -> str:
        return f"SoftContact with {self.body.name!r}: force {self.force} N, {'inside' if self.inside else 'outside'}"

    def _mine(self) -> _Place:
        mine = getattr(self._threads, "place", None)
        if mine is None:
            mine = self._threads.place = _Place(self)
        return mine

    def add_force(self, model: Any, data: Any) -> None:
        """Add force and torque on the tool and their reactions to ``data.qfrc_passive``."""
        mine = self._mine()
        evaluator, answer = mine.evaluator, mine.answer
        place, turn = self.pose(data)
        centre = self._tool.place(data)
        own, trained = (centre - place) @ turn, self._tool.turn_into(mine.parameters, data, turn)
        evaluator(own, mine.parameters)
        answer.depth, answer.inside = evaluator.depth, bool(evaluator.inside) and trained
        answer.energy, answer.force = evaluator.energy, turn @ evaluator.force
        answer.torque = _ZERO
        force = answer.force
        self._last = answer
        if not force.any():
            return
        stiffness = math.sqrt(float(np.vdot(evaluator.stiffness, evaluator.stiffness)))
        step = float(model.opt.timestep)
        if stiffness * step * step * self._lightness > _STIFF:
            answer.force = force = self._late_force(model, data, mine, turn)
        if mine.torque_at is not None:
            mine.torque_at(own, mine.parameters, turn.T @ force)
            answer.torque = turn @ mine.torque_at.torque
        torque = answer.torque
        self._mujoco.mj_applyFT(model, data, force, torque, centre, self._bound, data.qfrc_passive)
        if self._base:
            self._mujoco.mj_applyFT(model, data, -force, -torque, centre, self._base, data.qfrc_passive)

    def _late_force(self, model: Any, data: Any, mine: _Place, turn: np.ndarray) -> np.ndarray:
        """Return F + Δt K v', the force at the end of the step, with v' the velocity that it will bring about.

        v' = v + Δt (a + W (F + Δt K v')), W = J M⁻¹ Jᵀ the tool's mobility and a its acceleration by all other forces,
        those of actuators and constraints as they were a step ago. A body that holds a tool at rest holds it where an
        explicit step would: there v' = 0.
        """
        mujoco, evaluator, step = self._mujoco, mine.evaluator, float(model.opt.timestep)
        centre, J = self._tool.place(data), mine.jacobian
        mujoco.mj_jac(model, data, J, mine.turn, centre, self._bound)
        if self._base:
            mujoco.mj_jac(model, data, mine.other, mine.turn, centre, self._base)
            J -= mine.other
        mujoco.mj_solveM(model, data, mine.solved, J)
        mobility = mine.solved @ J.T
        K = turn @ evaluator.stiffness @ turn.T
        force = turn @ evaluator.force
        if step * step * float(np.abs(np.linalg.eigvals(mobility @ K)).max()) <= _STIFF:
            return np.asarray(force)
        self._say_stiff(step, mobility, K)
        bias = np.zeros(model.nv)
        mujoco.mj_rne(model, data, 0, bias)
        others = data.qfrc_passive + data.qfrc_applied + data.qfrc_actuator + data.qfrc_constraint - bias
        speed = J @ data.qvel + step * (mine.solved @ others + mobility @ force)
        late = np.linalg.solve(np.eye(3) - step * step * mobility @ K, speed)
        force = force + step * K @ late
        outward = turn @ evaluator.outward
        pull = min(0.0, float(force @ outward))  # a touched surface does not pull
        return np.asarray(force - pull * outward)

    def _say_stiff(self, step: float, mobility: np.ndarray, K: np.ndarray) -> None:
        """Count a damped step, and tell of the first."""
        if not self.damped_steps:
            rate = math.sqrt(float(np.abs(np.linalg.eigvals(mobility @ K)).max()))
            warnings.warn(
                f"A step of {1e3 * step:g} ms is too long for the stiffness of {self.body.name!r}, so its force is "
                f"damped: energy is lost in a bounce. Up to {1e3 * math.sqrt(_STIFF) / rate:.2g} ms it is kept.",
                StiffStepWarning,
                stacklevel=2,
            )
        self.damped_steps += 1

    def write_sensor(self, data: Any) -> None:
        """Put force, trust and inside where the scene's user sensor has its values."""
        if self._sensor is None:
            return
        mine, (start, size) = self._mine(), self._sensor
        answer = mine.answer
        known = mine.evaluator.trust(self.place(data), mine.parameters) if size > 3 else 0.0
        answer.trust = known
        values = [*answer.force, known, float(answer.inside), *answer.torque]
        data.sensordata[start : start + size] = values[:size]


_ZERO = np.zeros(3)
# contacts of the scenes that have some; a scene that is gone takes its contacts with it
_SCENES: dict[int, list[SoftContact]] = {}
_FORMER: dict[str, Any] = {}  # callbacks that were there before


def _contacts_of(model: Any) -> list[SoftContact]:
    return _SCENES.get(id(model), []) if model is not None else []


def _add_forces(model: Any, data: Any) -> None:
    if (former := _FORMER.get("passive")) is not None:
        former(model, data)
    for contact in _SCENES.get(id(model), ()):
        contact.add_force(model, data)


def _write_sensors(model: Any, data: Any, stage: int) -> None:
    if (former := _FORMER.get("sensor")) is not None:
        former(model, data, stage)
    for contact in _SCENES.get(id(model), ()):
        contact.write_sensor(data)


def _leave(number: int, address: int) -> None:
    """Forget a scene that has no contact any more, or is gone."""
    _SCENES.pop(number, None)
    forget_scene(address)


def attach(
    model: Any,
    data: Any,
    body: Surrogate | str | os.PathLike[str],
    *,
    geom: str | None = None,
    site: str | None = None,
    at: Sequence[float],
    on: str = "world",
    moves: bool = False,
    parameters: Sequence[float] = (),
    sensor: str | None = None,
) -> SoftContact:
    """Put a learnt body into a MuJoCo scene, where one tool feels it; call it once for each tool.

    Parameters
    ----------
    model : mujoco.MjModel
        The scene, in metres, kilograms and seconds.
    data : mujoco.MjData
        Its state, brought up to date once; every other MjData of the scene feels the body too.
    body : Surrogate or path
        The learnt body, or its file.
    geom : str
        Name of the tool: a sphere of the learnt radius; of a body that is held, what holds it.
    site : str, optional
        In place of `geom`, where the body was learnt under a tool of another shape: a site at the tool's foremost
        point, whose axes are the tool's own, so that the tool points along the site's −z. A tool of fixed orientation
        counts as outside the trained region where the site is turned from that by more than 2°.
    at : (3,) or (7,)
        Place, m, and quaternion (w, x, y, z) of the learnt body's frame, in the frame of `on`.
    on : str
        The scene's body that it stands on, and that feels the reaction.
    moves : bool
        True if `on` may move: the learnt body has no inertia, so that this is true of slow motion only.
    parameters : (p,)
        Further inputs of the learnt body; the tool's radius is filled in where it is one of them.
    sensor : str, optional
        Name of a user sensor of the scene of up to five values, `SENSOR_VALUES`.

    Returns
    -------
    SoftContact
        What the tool feels; `SoftContact.detach` ends it.

    Raises
    ------
    UsageError
        If MuJoCo is not installed, a name is not in the scene, the tool is not what was learnt, `on` can move, or the
        parameters don't fit.
    """
    mujoco = import_extra("mujoco", "mujoco")
    learnt = body if isinstance(body, Surrogate) else Surrogate.load(body)
    if learnt.memory is not None:
        raise UsageError(
            f"The body {learnt.name!r} remembers how it was touched, and a scene does not.",
            why="MuJoCo may step a state twice, or go back to an earlier one; the memory could not follow.",
            fix="Attach it without: body.with_memory(None).",
        )
    tool, base = tool_of(mujoco, model, learnt, geom, site), number_of(mujoco, model, "body", on)
    if _can_move(model, base) and not moves:
        raise UsageError(
            f"The body stands on {on!r}, which can move.",
            why="A learnt body has no inertia: what it stands on must be fixed, or move slowly.",
            fix="Let it stand on the world or a fixed body; `moves=True` for slow motion.",
        )
    numbers = np.asarray(at, dtype=np.float64)
    if numbers.shape not in ((3,), (7,)) or not np.isfinite(numbers).all():
        raise UsageError(
            f"`at` must be a place, or a place and a quaternion, and is {at}.",
            why="It says where the learnt body's frame lies in the frame of what it stands on.",
            fix="Give (x, y, z) in m, or (x, y, z, w, x, y, z).",
        )
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, _unit(numbers[3:]))
    contact = SoftContact(
        model,
        learnt,
        tool=tool,
        base=base,
        place=numbers[:3].copy(),
        turn=turn.reshape(3, 3).copy(),
        parameters=_parameters(learnt, model, tool, parameters),
        sensor=None if sensor is None else _sensor_of(mujoco, model, sensor),
    )
    if id(model) not in _SCENES:
        weakref.finalize(model, _leave, id(model), model._address)
    _SCENES.setdefault(id(model), []).append(contact)
    _FORMER.update(call_for(mujoco, model, {"passive": _add_forces, "sensor": _write_sensors}))
    mujoco.mj_forward(model, data)
    return contact


def _can_move(model: Any, body: int) -> bool:
    """Return whether a body has a joint, or is led as a mocap body, by itself or by what bears it."""
    if int(model.body_weldid[body]):
        return True
    while body:
        if int(model.body_mocapid[body]) >= 0:
            return True
        body = int(model.body_parentid[body])
    return False


def _unit(quaternion: np.ndarray) -> np.ndarray:
    length = float(np.linalg.norm(quaternion))
    return quaternion / length if length else np.array([1.0, 0.0, 0.0, 0.0])


def _sensor_of(mujoco: Any, model: Any, name: str) -> tuple[int, int]:
    """Return where the values of a user sensor begin, and how many there are."""
    number = number_of(mujoco, model, "sensor", name)
    size = int(model.sensor_dim[number])
    if int(model.sensor_type[number]) != int(mujoco.mjtSensor.mjSENS_USER) or size > len(SENSOR_VALUES):
        raise UsageError(
            f"The sensor {name!r} can't hold what a contact tells.",
            why=f"That needs a user sensor of at most {len(SENSOR_VALUES)} values: {', '.join(SENSOR_VALUES)}.",
            fix=f'Write <user name="{name}" dim="{len(SENSOR_VALUES)}" needstage="acc"/> into the scene.',
        )
    return int(model.sensor_adr[number]), size


def _parameters(body: Surrogate, model: Any, tool: SceneTool, parameters: Sequence[float]) -> np.ndarray:
    """Return the further inputs (p,), the tool's radius and turn among them; a tool that was not learnt is refused."""
    baseline, felt = body.hand_energy.baseline, len(body.hand_energy.baseline.directions)
    values = [float(v) for v in parameters]
    own = None if baseline.radius_input is None else baseline.radius_input - felt
    if not tool.is_site and not baseline.holds:
        _check_ball(body, model, tool.number, tool.name)
    radius = math.nan if tool.is_site else float(model.geom_size[tool.number, 0])
    for number, _ in tool.inputs if len(values) == len(body.parameters) - len(tool.inputs) else ():
        values.insert(number, 0.0)  # the scene tells them
    if not baseline.holds and own is not None and len(values) == len(body.parameters) - 1:
        values.insert(own, radius)
    if len(values) != len(body.parameters) or not np.isfinite(values).all():
        names = ", ".join(r.name for r in body.parameters) or "none"
        raise UsageError(
            f"{len(values)} parameters were given for the body {body.name!r}.",
            why=f"Its further inputs are {names}.",
            fix="Give one finite number for each, in this order, in SI units.",
        )
    return np.array(values)


def _check_ball(body: Surrogate, model: Any, tool: int, name: str) -> None:
    """Refuse a tool that is no ball, or of another radius than was learnt."""
    baseline, radius = body.hand_energy.baseline, float(model.geom_size[tool, 0])
    if int(model.geom_type[tool]) != int(import_extra("mujoco", "mujoco").mjtGeom.mjGEOM_SPHERE):
        raise UsageError(
            f"The tool {name!r} is no sphere.",
            why=f"The body {body.name!r} was learnt with a ball.",
            fix='Give the tool a geom of type="sphere".',
        )
    own = baseline.radius_input
    low, high = (
        (baseline.radius, baseline.radius) if own is None else (body.inputs[own].low, body.inputs[own].high)
    )
    if low * (1.0 - _RADIUS_SLACK) <= radius <= high * (1.0 + _RADIUS_SLACK):
        return
    learnt = millimetres(low) if own is None else f"{millimetres(low)} to {millimetres(high)}"
    scaled = (
        low * _MILLIMETRES * (1.0 - _RADIUS_SLACK) <= radius <= high * _MILLIMETRES * (1.0 + _RADIUS_SLACK)
    )
    raise UsageError(
        f"The tool {name!r} has a radius of {radius:g} in the scene; {body.name!r} was learnt with {learnt}.",
        why="The scene seems to be in millimetres; the learnt body is in metres."
        if scaled
        else "The force of another ball was never learnt.",
        fix="Write the scene in metres, kilograms and seconds."
        if scaled
        else "Take a tool of that radius, or learn this one.",
    )
