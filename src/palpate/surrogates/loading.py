"""What a file holds, whichever kind of learnt body that is."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

from palpate.network import load_archive
from palpate.surrogates.fields.field_file import KIND as FIELD
from palpate.surrogates.fields.field_file import load_field
from palpate.surrogates.fields.field_surrogate import FieldSurrogate
from palpate.surrogates.fields.touched_body import KIND as BODY
from palpate.surrogates.fields.touched_body import TouchedBody
from palpate.surrogates.grasp.file import KIND as GRASP
from palpate.surrogates.grasp.surrogate import GraspSurrogate
from palpate.surrogates.plastic.held_body import HeldBody
from palpate.surrogates.plastic.held_file import KIND as HELD
from palpate.surrogates.touch import TouchModel
from palpate.surrogates.touch_file import KIND as SURROGATE
from palpate.surrogates.touch_surrogate import TouchSurrogate

__all__ = ["Loaded", "load"]

Loaded: TypeAlias = TouchModel | TouchedBody | TouchSurrogate | FieldSurrogate | HeldBody | GraspSurrogate

_LOAD: dict[str, Callable[[Path], Loaded]] = {
    BODY: TouchedBody.load,
    SURROGATE: TouchSurrogate.load,
    HELD: HeldBody.load,
    GRASP: GraspSurrogate.load,
    FIELD: load_field,
}


def load(path: str | os.PathLike[str]) -> Loaded:
    """Read a learnt body from a file of any kind.

    Networks that `palpate.fit` has made are read by `Fitted.load`.

    Returns
    -------
    TouchedBody, TouchSurrogate or FieldSurrogate
        A body pressed by a probe, or its energy or one of its fields alone.
    TouchModel or HeldBody
        A body held at a node, without or with a memory.
    GraspSurrogate
        A body held by a pad.

    Raises
    ------
    FileFormatError
        If the file is missing, corrupt, foreign, from a later version, or holds something else.
    """
    path = Path(path)
    return _LOAD.get(load_archive(path).kind, TouchModel.load)(path)
