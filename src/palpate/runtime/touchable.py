"""What a hand can be laid on: a body held at one node, or one pressed anywhere; told apart by its file's kind."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

from palpate.errors import FileFormatError
from palpate.network import load_archive
from palpate.runtime.pressed import PressedBody
from palpate.runtime.workspace import Workspace
from palpate.surrogates import TouchedBody, TouchModel, TouchSurrogate
from palpate.surrogates.field.touched_body import KIND as BODY
from palpate.surrogates.plastic.held_file import KIND as REMEMBERS
from palpate.surrogates.touch_file import KIND as SURROGATE

__all__ = ["Touchable", "load_touchable", "touchable", "workspace_for"]

Touchable: TypeAlias = TouchModel | PressedBody

_PRESSED: dict[str, Callable[[Path], TouchedBody | TouchSurrogate]] = {
    BODY: TouchedBody.load,
    SURROGATE: TouchSurrogate.load,
}


def touchable(model: Touchable | TouchedBody | TouchSurrogate, name: str = "") -> Touchable:
    """A model as the loop takes it; `name` where a body's own record has none."""
    return PressedBody.of(model, name) if isinstance(model, TouchedBody | TouchSurrogate) else model


def load_touchable(path: str | os.PathLike[str]) -> Touchable:
    """Read what can be touched from a file of any kind that can.

    Raises
    ------
    FileFormatError
        If the file is missing, corrupt, foreign, or of something that no hand can be laid on.
    """
    path = Path(path)
    kind = load_archive(path).kind
    if kind == REMEMBERS:
        raise FileFormatError(
            f"{path} holds a body that remembers, which neither the page nor the loop takes.",
            why="They don't let go of it, and an idle hand would bend it back.",
            fix="Touch it from Python: HeldBody.load(file).evaluator(), with step and release.",
        )
    load = _PRESSED.get(kind)
    return TouchModel.load(path) if load is None else PressedBody.of(load(path), path.stem)


def workspace_for(model: Touchable, radius: float) -> Workspace:
    """How a hand's workspace of `radius` (m) lies about a model."""
    if isinstance(model, PressedBody):
        x, y, z = model.home.tolist()
        return Workspace.for_reach(radius, model.reach, centre=(x, y, z), upright=True)
    return Workspace.for_reach(radius, model.reach)
