"""What a hand can be laid on, told apart by its file's kind: held at one node, with or without memory, or pressed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TypeAlias

from palpate.errors import FileFormatError
from palpate.runtime.pressed import PressedBody
from palpate.runtime.remembering import RememberingBody
from palpate.runtime.workspace import Workspace
from palpate.surrogates import FieldSurrogate, TouchedBody, TouchModel, TouchSurrogate
from palpate.surrogates.grasp import GraspSurrogate
from palpate.surrogates.loading import load
from palpate.surrogates.plastic import HeldBody

__all__ = ["Learnt", "Touchable", "load_touchable", "touchable", "workspace_for"]

Touchable: TypeAlias = TouchModel | PressedBody | RememberingBody
Learnt: TypeAlias = TouchModel | TouchedBody | TouchSurrogate | HeldBody


def touchable(model: Learnt, name: str = "") -> Touchable:
    """A model as the loop takes it; `name` where a body's own record has none."""
    if isinstance(model, HeldBody):
        return RememberingBody(model)
    return PressedBody.of(model, name) if isinstance(model, TouchedBody | TouchSurrogate) else model


def load_touchable(path: str | os.PathLike[str]) -> Touchable:
    """Read what can be touched from a file of any kind that can.

    Raises
    ------
    FileFormatError
        If the file is missing, corrupt, foreign, or of something that no hand can be laid on.
    """
    path = Path(path)
    model = load(path)
    if isinstance(model, GraspSurrogate):
        raise FileFormatError(
            f"{path} holds a body held by a pad, which has no page and no loop yet.",
            fix="Touch it from Python: GraspSurrogate.load(file).evaluator().",
        )
    if isinstance(model, FieldSurrogate):
        raise FileFormatError(
            f"{path} holds a field alone, which gives no force.",
            fix="Save it with its energy: TouchedBody(touch, fields).save(file).",
        )
    return touchable(model, path.stem)


def workspace_for(model: Touchable, radius: float) -> Workspace:
    """How a hand's workspace of `radius` (m) lies about a model."""
    if isinstance(model, PressedBody):
        x, y, z = model.home.tolist()
        return Workspace.for_reach(radius, model.reach, centre=(x, y, z), upright=True)
    return Workspace.for_reach(radius, model.reach)
