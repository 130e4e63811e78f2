"""Compiled kernels: how they are made, and when their source runs in the interpreter instead.

A `kernel` is entered from Python; Numba compiles it and keeps it on disk. A `part` is called by kernels alone. Numba
would optimise every function by itself and then once more in each of its callers, down to machine code that nobody
enters; a part is only translated, and optimised where it is linked. This halves the time of compilation, and changes
no result.

To compile the kernels of a body takes seconds, to interpret their source for one place some milliseconds. So a few
rows are answered by `for_rows` without waiting for a compiler: the same statements, and the same bits.
"""

from __future__ import annotations

import ctypes
from collections import Counter
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np
from numba import _dynfunc, njit
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.dispatcher import Dispatcher
from numba.core.registry import CPUDispatcher

__all__ = ["FEW", "MANY", "for_rows", "interpreted", "is_ready", "kernel", "part"]

FEW = 256
"""Rows that are interpreted sooner than a kernel for them is compiled."""
MANY = 100_000
"""Rows that a kernel for one row answers sooner than a kernel for all of them is compiled beside it."""

# `fastmath` stays off, so that all ways agree to the last bit
_OPTIONS = {"nogil": True, "error_model": "numpy", "_nrt": False}
_REFUSES = ctypes.cast(
    ctypes.pythonapi.PyObject_Call, ctypes.c_void_p
).value  # of an object that can't be called


_asked: Counter[Any] = Counter()  # rows, of kernels that were not compiled


class _PartLibrary(JITCodeLibrary):
    """The translated code of a part: nothing is optimised, and nothing becomes machine code, before it is linked."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


class _PartCompiler(Compiler):
    """Numba's own passes without the last one, which makes machine code, and without wrappers for Python."""

    def define_pipelines(self) -> Any:
        state = self.state
        state.flags.no_compile = state.flags.no_cpython_wrapper = state.flags.no_cfunc_wrapper = True
        state.library = _PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        return super().define_pipelines()

    def _compile_core(self) -> Any:
        result = super()._compile_core()
        own = result.fndesc
        # Numba knows a compiled function by the object that enters it
        entry = _dynfunc.make_function(
            own.lookup_module(), own.qualname, "", _REFUSES, result.environment, (result.library,)
        )
        self.state.targetctx.insert_user_function(entry, own, [result.library])
        return result._replace(entry_point=entry)


class _Part(CPUDispatcher):  # type: ignore[misc]
    """A part, which Python may call too, for tests; then its source is interpreted."""

    def __call__(self, *arguments: Any) -> Any:
        return interpreted(self)(*arguments)


def part(function: Callable[..., Any]) -> Any:
    """Return a function that kernels may call; it is compiled as a part of each."""
    return _Part(function, {}, {"nopython": True, **_OPTIONS}, pipeline_class=_PartCompiler)


def kernel(
    function: Callable[..., Any] | None = None, *, allocates: bool = False, fastmath: Any = False
) -> Any:
    """Return a compiled function that Python may call, kept in Numba's cache.

    One that makes arrays `allocates`, and counts references to them; `fastmath` is that of Numba.
    """
    return njit(function, cache=True, **(_OPTIONS | {"_nrt": allocates, "fastmath": fastmath}))


@cache
def interpreted(compiled: Any) -> Callable[..., Any]:
    """Return the source of a kernel or part as a Python function, whose callees are interpreted too."""
    source = compiled.py_func
    names = dict(source.__globals__)
    own = FunctionType(source.__code__, names, source.__name__, source.__defaults__, source.__closure__)
    for name in source.__code__.co_names:
        if isinstance(names.get(name), Dispatcher):
            names[name] = interpreted(names[name])
    return own


def is_ready(compiled: Any) -> bool:
    """Return True where a kernel need not be compiled: it is in memory or on disk."""
    if compiled.overloads:
        return True
    source = compiled.py_func
    name = f"{Path(source.__code__.co_filename).stem}.{source.__qualname__}-{source.__code__.co_firstlineno}."
    return any(Path(compiled.stats.cache_path).glob(f"{name}*.nbi"))


def for_rows(compiled: Any, rows: int, one: Any = None) -> Callable[..., Any]:
    """Return what answers a number of rows soonest: a kernel, or its source while it isn't compiled.

    The source is interpreted until `FEW` rows in all were asked for. Where it calls a kernel `one` for each row, its
    loop is then interpreted around that, until `MANY` rows were.
    """
    if is_ready(compiled):
        return compiled  # type: ignore[no-any-return]
    _asked[compiled] += rows
    if _asked[compiled] > (FEW if one is None else MANY):
        return compiled  # type: ignore[no-any-return]
    if one is not None and (_asked[compiled] > FEW or is_ready(one)):
        return compiled.py_func  # type: ignore[no-any-return]

    def interpret(*arguments: Any) -> Any:
        try:
            with np.errstate(all="ignore"):
                return interpreted(compiled)(*arguments)
        except (
            ArithmeticError,
            ValueError,
        ):  # what Python refuses and a processor answers by ∞ or not-a-number
            return compiled(*arguments)

    return interpret
