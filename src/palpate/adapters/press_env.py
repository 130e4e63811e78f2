"""A Gymnasium environment: press a soft body until a wanted force is reached, and hold it.

    import gymnasium, palpate.adapters.press_env
    env = gymnasium.make("palpate/Press-v0", body="kidney.palpate")

A ball of some mass is pushed about by the action, a force; the learnt body pushes back, and the reward falls with the
distance of its force from the wanted one. Every episode begins above another place with another wanted force, by the
seed. A body that is held is led the same way, from its place of rest.
"""

from __future__ import annotations

import math
import os
from typing import Any, ClassVar

import numpy as np

from palpate.adapters.extra import import_extra
from palpate.errors import UsageError
from palpate.surrogates import Surrogate

_gymnasium: Any = import_extra("gymnasium", "gymnasium")

__all__ = ["ENVIRONMENT", "PressEnv"]

ENVIRONMENT = "palpate/Press-v0"
"""Name by which Gymnasium makes it."""

_STEP = 0.02  # s, from one action to the next
_EPISODE = 200  # steps
_MASS = 0.1  # kg, of the tool
_DAMPED = 1.0  # share of critical damping that the tool's own drag has at the body's typical stiffness
_STIFF = 0.25  # K Δt²/m of an inner step, as in a scene
_STRENGTH = 2.0  # largest push over the largest force that is wanted
_LEAST = 0.15  # the smallest wanted force over the largest
_CLEARANCE = 0.2  # of the deepest depth: so far above the body an episode begins


class PressEnv(_gymnasium.Env):  # type: ignore[misc]
    """Press a learnt body until a wanted force is reached.

    Observation (10,): the tool's place from where the episode's goal lies, over the deepest trained depth; its velocity
    times 0.1 s over that depth; force on the tool, and the wanted size of it, over the largest wanted force. Action
    (3,), −1 to 1: push on the tool, over twice the largest wanted force. Reward: −|‖F‖ − F*| / F*, and −1 more where
    the tool has left the trained region, which ends the episode.

    Parameters
    ----------
    body : Surrogate or path
        The learnt body, or its file.
    parameters : (p,)
        Its further inputs; the middle of their ranges by default.
    mass : float
        Of the tool, kg.

    Raises
    ------
    UsageError
        If the body can't be touched, the parameters don't fit, or the mass is not positive.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": []}

    def __init__(
        self, body: Surrogate | str | os.PathLike[str], *, parameters: Any = None, mass: float = _MASS
    ) -> None:
        learnt = body if isinstance(body, Surrogate) else Surrogate.load(body)
        if not (math.isfinite(mass) and mass > 0):
            raise UsageError(
                f"A tool's mass must be positive, not {mass} kg.", fix=f"Give {_MASS}, for example."
            )
        energy, middle = learnt.hand_energy, [(r.low + r.high) / 2.0 for r in learnt.parameters]
        self._parameters = np.asarray(middle if parameters is None else parameters, dtype=np.float64)
        if self._parameters.shape != (len(middle),) or not np.isfinite(self._parameters).all():
            names = ", ".join(r.name for r in learnt.parameters) or "none"
            raise UsageError(
                f"The parameters {parameters} don't fit {learnt.name!r}: its further inputs are {names}."
            )
        self.body, self._mass, self._evaluator = learnt, mass, energy.evaluator()
        self._torque: Any = learnt.torque_evaluator
        felt = len(energy.baseline.directions)
        self._axes = energy.baseline.directions
        X = energy.trained_rows()
        X[:, felt:] = self._parameters
        X = X[energy.inside(X) & (energy.depth(X) > 0.0)]
        size = np.linalg.norm(energy.force(X), axis=1)
        self._largest = float(np.quantile(size, 0.9))
        wanted = (size > _LEAST * self._largest) & (size <= self._largest)
        self._goals, self._sizes = X[wanted, :felt], size[wanted]
        self._scale = float(energy.depth(X).max())
        stiffest = float(np.abs(np.linalg.eigvalsh(energy.stiffness(X))).max())
        self._inner = math.ceil(_STEP / math.sqrt(_STIFF * mass / stiffest))
        self._drag = _DAMPED * 2.0 * math.sqrt(stiffest * mass)
        box = _gymnasium.spaces.Box
        self.action_space = box(-1.0, 1.0, (3,), np.float32)
        self.observation_space = box(-np.inf, np.inf, (10,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode above a place of the body, and return the observation and what else is known.

        Parameters
        ----------
        seed : int, optional
            By which all later episodes are drawn.
        options : dict, optional
            None are known.
        """
        super().reset(seed=seed)
        row = int(self.np_random.integers(len(self._goals)))
        self._goal, self.wanted = self._goals[row] @ self._axes, float(self._sizes[row])
        self._evaluator(self._goal, self._parameters)
        away = self._evaluator.outward if self._evaluator.outward.any() else np.zeros(3)
        lift = max(0.0, self._evaluator.depth) + _CLEARANCE * self._scale
        self._place = self._goal + lift * away if away.any() else np.zeros(3)
        self._velocity = np.zeros(3)
        self._evaluator(self._place, self._parameters)
        return self._observation(), self._info()

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Push the tool for 20 ms, and return observation, reward, whether it ended, False, and what else is known.

        Parameters
        ----------
        action : (3,)
            Push over twice the largest wanted force, −1 to 1 each.
        """
        push = _STRENGTH * self._largest * np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0)
        felt = self._axes.T @ self._axes  # a beam is led in its plane
        step = _STEP / self._inner
        for _ in range(self._inner):
            total = felt @ (push + self._evaluator.force)
            self._velocity = (self._velocity + step / self._mass * total) / (
                1.0 + step * self._drag / self._mass
            )
            self._place = self._place + step * self._velocity
            self._evaluator(self._place, self._parameters)
        size = float(np.linalg.norm(self._evaluator.force))
        reward = -abs(size - self.wanted) / self.wanted
        outside = (
            not self._evaluator.inside or float(np.linalg.norm(self._place - self._goal)) > 10.0 * self._scale
        )
        return self._observation(), reward - float(outside), outside, False, self._info()

    def _observation(self) -> np.ndarray:
        parts = [
            (self._place - self._goal) / self._scale,
            0.1 * self._velocity / self._scale,
            self._evaluator.force / self._largest,
            [self.wanted / self._largest],
        ]
        return np.concatenate(parts).astype(np.float32)

    def _info(self) -> dict[str, Any]:
        """Return force and wanted force, N, depth, m, whether it is trained, and the torque, N m, where it is known."""
        torque: dict[str, Any] = {}
        if self._torque is not None:
            self._torque(self._place, self._parameters, self._evaluator.force)
            torque["torque"] = self._torque.torque.copy()
        return torque | {
            "force": self._evaluator.force.copy(),
            "wanted": self.wanted,
            "depth": self._evaluator.depth,
            "inside": bool(self._evaluator.inside),
        }


_gymnasium.register(id=ENVIRONMENT, entry_point=PressEnv, max_episode_steps=_EPISODE)
