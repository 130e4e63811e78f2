"""The tool of a MuJoCo scene that touches a learnt body: where it is, and how it is turned."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.surrogates import Surrogate
from palpate.surrogates.baselines import require_one_tool
from palpate.surrogates.learnt_torque import TURNS
from palpate.tools.rotations import rotation_vector, swing_vector

__all__ = ["SceneTool", "number_of", "tool_of"]

_TURNED = math.radians(2.0)  # by which a tool of fixed orientation may be turned


class SceneTool:
    """A tool of the scene that touches a body: a geom by its centre, or a site at its foremost point, in own axes."""

    def __init__(self, number: int, name: str, model: Any, body: Surrogate, posed: Any) -> None:
        self.number, self.name, self.is_site = number, name, posed is not None
        self.bound = int((model.site_bodyid if self.is_site else model.geom_bodyid)[number])
        names = [r.name for r in body.parameters]
        self.inputs = [(names.index(turn), k) for k, turn in enumerate(TURNS) if turn in names]
        self._first = np.eye(3) if posed is None or posed.turn is None else np.asarray(posed.turn)

    def place(self, data: Any) -> np.ndarray:
        """Return its place (3,) in the scene, m."""
        return (data.site_xpos if self.is_site else data.geom_xpos)[self.number]  # type: ignore[no-any-return]

    def turn_into(self, parameters: np.ndarray, data: Any, body: np.ndarray) -> bool:
        """Put its turn in the body's axes (3, 3) into the further inputs (p,); whether a fixed one is as learnt."""
        if not self.is_site:
            return True
        R = body.T @ data.site_xmat[self.number].reshape(3, 3) @ self._first.T
        if not self.inputs:
            return bool(np.linalg.norm(rotation_vector(R)) <= _TURNED)
        axis = self._first[:, 2]
        w = rotation_vector(R) if len(self.inputs) == 3 else swing_vector(axis, R @ axis)
        for number, k in self.inputs:
            parameters[number] = w[k]
        return True


def tool_of(mujoco: Any, model: Any, body: Surrogate, geom: str | None, site: str | None) -> SceneTool:
    """Return the tool by the name of its geom or of its site; one that doesn't fit what was learnt is refused."""
    require_one_tool(body.hand_energy.baseline, "act in a MuJoCo scene")
    posed = getattr(body.hand_energy.baseline, "posed_tool", None)
    named = geom if posed is None else site
    if named is None or (geom is not None and site is not None):
        raise UsageError(
            f"The tool of {body.name!r} is not named as it must be.",
            why="It was learnt under a ball or held by a pad, so that the scene has a geom for it."
            if posed is None
            else f"It was learnt under a {posed}, whose foremost point and axes a site of the scene tells.",
            fix="Give geom=NAME, and no site."
            if posed is None
            else "Give site=NAME, and no geom: a site at the tool's foremost point, the tool pointing along its −z.",
        )
    return SceneTool(
        number_of(mujoco, model, "geom" if posed is None else "site", named), named, model, body, posed
    )


def number_of(mujoco: Any, model: Any, kind: str, name: str) -> int:
    """Return the number of what has a name in the scene."""
    number = int(mujoco.mj_name2id(model, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), name))
    if number < 0:
        rows = range(getattr(model, f"n{kind}"))
        names = [getattr(model, kind)(k).name for k in rows]
        raise UsageError(
            f"The scene has no {kind} named {name!r}.",
            why=f"Its names are {', '.join(repr(n) for n in names if n) or 'none: nothing has one'}.",
            fix=f"Name the {kind} in the scene's XML, and give that name.",
        )
    return number
