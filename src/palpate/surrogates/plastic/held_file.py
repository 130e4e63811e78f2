"""A held body that remembers in one file: a network archive of its own kind, checked when read."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.network import Archive, save_archive
from palpate.surrogates.file_parts import read
from palpate.surrogates.memories.iwan_elements import IwanElements

if TYPE_CHECKING:
    from palpate.surrogates.plastic.held_body import HeldBody

__all__ = ["KIND", "load_held", "save_held"]

KIND = "held-body"
_PLAIN = ("name", "mirrors", "touch_node", "reach", "radius")
_ARRAYS = ("rest", "nodes_of_interest", "directions")


def save_held(path: str | os.PathLike[str], body: HeldBody) -> Path:
    """Write a held body; the file appears whole or not at all.

    Raises
    ------
    UsageError
        If the folder does not exist or can't be written, or `meta` holds what JSON does not know.
    """
    arrays = {name: getattr(body, name) for name in _ARRAYS}
    arrays["elements"] = np.stack(body.elements.compiled())
    meta = {name: getattr(body, name) for name in _PLAIN} | {"meta": dict(body.meta)}
    return save_archive(path, Archive({"stretch": body.stretch, "shape": body.shape}, arrays, meta, KIND))


def load_held(path: str | os.PathLike[str]) -> HeldBody:
    """Read a held body back, bit for bit.

    Raises
    ------
    FileFormatError
        If the file is missing, corrupt, foreign or from a later version, or its parts do not fit.
    """
    return read(path, KIND, "a held body", _held)


def _held(archive: Archive) -> HeldBody:
    from palpate.surrogates.plastic.held_body import HeldBody

    given: dict[str, Any] = {name: archive.arrays[name] for name in _ARRAYS}
    given |= {name: archive.meta[name] for name in (*_PLAIN, "meta")}
    numbers = archive.arrays["elements"].astype(np.float64)
    return HeldBody(
        stretch=archive.networks["stretch"],
        shape=archive.networks["shape"],
        elements=IwanElements(*numbers),
        **given,
    ).checked()
