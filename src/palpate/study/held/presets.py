"""Beams that remember, by name, each with a quick form: coarser elements, larger steps, fewer histories."""

from __future__ import annotations

from typing import Any

from palpate.study.held.record import HeldStudy
from palpate.study.touching.presets import QUICK

__all__ = ["HELD", "held_preset"]

HELD: dict[str, dict[str, Any]] = {
    "beam-plastic": {"load": 25.0, "train": 10, "test": 14},
    "beam-viscoelastic": {"load": 5.0, "train": 4, "test": 3},
}
"""What each study says; everything else is the record's default."""

_QUICK: dict[str, dict[str, Any]] = {
    "beam-plastic": {"train": 3, "test": 2},
    "beam-viscoelastic": {"train": 2, "test": 2, "step": 0.1},
}
_COARSE = {"elements": 8, "fibres": 24, "tolerance": 1e-4}


def held_preset(name: str, *, quick: bool = False) -> HeldStudy:
    """The study of that name, which must be in `HELD`; the quick form asks the same of the force."""
    content: dict[str, Any] = {"name": name, "preset": name, **HELD[name]}
    if quick:
        content |= _QUICK[name] | _COARSE | {"name": name + QUICK}
    return HeldStudy.model_validate(content)
