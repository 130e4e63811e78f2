"""Expressions of NGSolve that are read and no longer differentiated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from palpate.physics.materials.tensors import is_symbolic

__all__ = ["compiled"]


def compiled(values: Mapping[str, Any]) -> dict[str, Any]:
    """The same values; what NGSolve would evaluate as a tree is compiled, so that shared parts are evaluated once.

    A return mapping uses each Newton step's answer three times: uncompiled, its cost triples with every step.
    """
    return {name: value.Compile() if is_symbolic(value) else value for name, value in values.items()}
