"""Callbacks of MuJoCo that are called for some scenes only.

A callback written in Python is called for every scene, and MuJoCo's compiler steps each new scene once, before Python
knows it; that ends in "engine error: Python exception raised". So a compiled filter stands before the callback: it lets
the scenes through that asked for it, and all of them where somebody else's callback was there before.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.core import cgutils
from numba.extending import intrinsic

__all__ = ["call_for", "forget_scene"]

_SCENES = 256  # that may have a callback at one time
_ALL = -1  # in the table's first place: every scene is let through
_table = np.zeros(1 + _SCENES, dtype=np.intp)  # of addresses, read by the compiled filters
_filters: dict[str, Any] = {}


@intrinsic
def _pointer(_context: Any, address: Any) -> Any:
    """Return an integer as a pointer, which Numba's functions of C types take."""

    def generate(_target: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], cgutils.voidptr_t)

    return numba.types.voidptr(address), generate


def _filter(behind: Any, stages: bool) -> Any:
    """Return a C function that calls another one for the scenes of the table."""
    address, size = _table.ctypes.data, len(_table)
    # Numba's functions are not what they seem to a type checker
    pointer: Any = _pointer
    view: Any = vars(numba)["carray"]

    def is_through(model: Any) -> bool:
        table = view(pointer(address), (size,), dtype=np.intp)
        through = table[0] == _ALL
        for k in range(1, size):
            through |= table[k] == model
        return through  # type: ignore[no-any-return]

    passes: Any = numba.njit(is_through)

    if stages:

        def with_stage(model: Any, data: Any, stage: Any) -> None:
            if passes(model):
                behind(model, data, stage)

        return numba.cfunc("void(intp, intp, intc)")(with_stage)

    def plain(model: Any, data: Any) -> None:
        if passes(model):
            behind(model, data)

    return numba.cfunc("void(intp, intp)")(plain)


def _variable(mujoco: Any, name: str) -> Any:
    """Return MuJoCo's own variable that holds a callback's address."""
    folder = Path(mujoco.__file__).parent
    path = next(p for p in sorted(folder.iterdir()) if p.name.startswith(("libmujoco.", "mujoco.dll")))
    return ctypes.c_void_p.in_dll(ctypes.CDLL(str(path)), f"mjcb_{name}")


def call_for(mujoco: Any, model: Any, callbacks: dict[str, Callable[..., None]]) -> dict[str, Any]:
    """Let MuJoCo call functions for a scene, and return those of somebody else that it called before, by name.

    A callback ``"passive"`` takes (model, data), ``"sensor"`` (model, data, stage).
    """
    former = {}
    for name, callback in callbacks.items():
        there = getattr(mujoco, f"get_mjcb_{name}")()
        if there is callback:
            continue
        former[name] = there
        getattr(mujoco, f"set_mjcb_{name}")(callback)
        variable, stages = _variable(mujoco, name), name == "sensor"
        enter = ctypes.CFUNCTYPE(None, *[ctypes.c_ssize_t] * 2, *[ctypes.c_int] * stages)
        _filters[name] = _filter(enter(variable.value), stages)
        variable.value = _filters[name].address
    if any(former.values()):
        _table[0] = _ALL
    if model._address not in _table[1:]:
        _table[1 + int(np.flatnonzero(_table[1:] == 0)[0])] = model._address
    return former


def forget_scene(address: int) -> None:
    """Call nothing for the scene at an address any more."""
    _table[1:][_table[1:] == address] = 0
