"""Compiled kernels: how they are made, and when their source runs in the interpreter instead.

A `kernel` is entered from Python; Numba compiles it and keeps it on disk. A `part` is called by kernels alone. Numba
would optimise every function by itself and then once more in each of its callers, down to machine code that nobody
enters; a part is only translated, and optimised where it is linked. This halves the time of compilation, and changes
no result. The translation is kept on disk too: so several processes may share the work for one kernel.

To compile the kernels of a body takes seconds, to interpret their source for one place some milliseconds. So a few
rows are answered by `for_rows` without waiting for a compiler: the same statements, and the same bits.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import time
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from types import FunctionType
from typing import Any

import numba
import numpy as np
import psutil
from llvmlite.binding import parse_bitcode
from numba._dynfunc import make_function
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompileResult
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import Dispatcher
from numba.core.registry import CPUDispatcher
from numba.core.sigutils import normalize_signature

__all__ = ["FEW", "MANY", "for_rows", "is_ready", "kernel", "part", "python_source"]

FEW = 256
"""Rows that are interpreted sooner than a kernel for them is compiled."""
MANY = 100_000
"""Rows that a kernel for one row answers sooner than a kernel for all of them is compiled beside it."""

# `fastmath` stays off, so that all ways agree to the last bit
_OPTIONS = {"nogil": True, "error_model": "numpy", "_nrt": False}
# address of the C code of an object that can't be called
_REFUSES = ctypes.cast(ctypes.pythonapi.PyObject_Call, ctypes.c_void_p).value


_TRIED = (
    (0, 68),
)  # versions of Numba whose insides parts are known to fit; with others each is a kernel of its own
_PATIENCE = 60.0  # s that another process may take to compile a kernel
_asked: Counter[Any] = Counter()  # rows, of kernels that were not compiled


class _PartLibrary(JITCodeLibrary):
    """The translated code of a part: nothing is optimised, and nothing becomes machine code, before it is linked."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        # addresses of callees, which Numba notes as values and nobody loads, bind no part to this process
        if "load ptr, ptr @numba.dynamic.globals" in str(self._final_module):
            self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]
        self._finalized = True


class _PartCompiler(Compiler):
    """Numba's own passes without the last one, which makes machine code, and without wrappers for Python."""

    def define_pipelines(self) -> Any:
        state = self.state
        state.flags.no_compile = state.flags.no_cpython_wrapper = state.flags.no_cfunc_wrapper = True
        library: Any = _PartLibrary
        state.library = library(state.targetctx.codegen(), state.func_id.func_qualname)
        return super().define_pipelines()  # type: ignore[no-untyped-call]

    def _compile_core(self) -> Any:
        result = super()._compile_core()  # type: ignore[no-untyped-call]
        return _with_entry(result, self.state.targetctx)


def _with_entry(result: Any, target: Any) -> Any:
    """Give a part the object by which Numba knows a compiled function, and which would enter it."""
    own = result.fndesc
    entry = make_function(
        own.lookup_module(), own.qualname, "", _REFUSES, result.environment, (result.library,)
    )
    target.insert_user_function(entry, own, [result.library])
    return result._replace(entry_point=entry)


class _PartOnDisk(CompileResultCacheImpl):
    """The form in which a part is kept on disk, for all kernels that it will be linked into."""

    def reduce(self, cres: Any) -> Any:
        own = cres.fndesc
        own.typemap = own.calltypes = None  # as Numba does: they need not be kept
        return cres.library._final_module.as_bitcode(), own, cres.environment, cres.signature

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        bitcode, own, environment, signature = payload
        make: Any = _PartLibrary
        library = make(target_context.codegen(), own.qualname)
        library._final_module, library._finalized = parse_bitcode(bitcode), True
        known = {"library": library, "fndesc": own, "environment": environment, "signature": signature}
        nothing: dict[str, Any] = dict.fromkeys(CompileResult._fields)
        result = CompileResult(**nothing | known | {"objectmode": False, "lifted": (), "reload_init": []})
        return _with_entry(result, target_context)


class _PartCache(FunctionCache):
    _impl_class = _PartOnDisk


class _Kernel(CPUDispatcher):
    """A kernel that one process compiles at a time; the others take from the cache what that one leaves there."""

    def compile(self, sig: Any) -> Any:
        known = tuple(normalize_signature(sig)[0]) in self.overloads
        with global_compiler_lock, contextlib.nullcontext() if known else _only_one(self):
            return super().compile(sig)

    def translate(self, *arguments: Any) -> None:
        """Leave on disk what callers with such arguments need."""
        self.compile(tuple(numba.typeof(argument) for argument in arguments))


class _Part(_Kernel):
    """A part, which Python may call too, for tests; then its source is interpreted."""

    def __call__(self, *arguments: Any) -> Any:
        return python_source(self)(*arguments)

    def enable_caching(self) -> None:
        self._cache = _PartCache(self.py_func)  # type: ignore[no-untyped-call]


def part(function: Callable[..., Any]) -> Any:
    """Return a function that kernels may call; it is compiled as a part of each."""
    if numba.version_info.short not in _TRIED:
        return kernel(function)
    own: Any = _Part(function, {}, {"nopython": True, **_OPTIONS}, pipeline_class=_PartCompiler)
    own.enable_caching()
    return own


@contextlib.contextmanager
def _only_one(compiled: Any) -> Iterator[None]:
    """Wait while another process compiles a kernel, and keep the others waiting meanwhile."""
    mark, until, taken = _cache_file(compiled, "busy"), time.monotonic() + _PATIENCE, False
    with contextlib.suppress(OSError):  # nothing can be kept there, so nothing is to be waited for
        mark.parent.mkdir(parents=True, exist_ok=True)
        while not (taken := _take(mark)) and time.monotonic() < until:
            time.sleep(0.02)
    try:
        yield
    finally:
        if taken:
            mark.unlink(missing_ok=True)


def _take(mark: Path) -> bool:
    """Return True where no other living process has this mark; it is then this one's."""
    try:
        with mark.open("x") as file:
            file.write(str(os.getpid()))
    except FileExistsError:
        with contextlib.suppress(ValueError, FileNotFoundError):  # being written, or just removed
            owner = int(mark.read_text())
            if owner != os.getpid() and psutil.pid_exists(owner):
                return False
            mark.unlink()
        return False
    return True


def kernel(
    function: Callable[..., Any] | None = None, *, allocates: bool = False, fastmath: Any = False
) -> Any:
    """Return a compiled function that Python may call, kept in Numba's cache.

    One that makes arrays `allocates`, and counts references to them; `fastmath` is that of Numba.
    """
    if function is None:
        return partial(kernel, allocates=allocates, fastmath=fastmath)
    options = _OPTIONS | {"_nrt": allocates, "fastmath": fastmath}
    own: Any = _Kernel(function, {}, {"nopython": True, **options})
    own.enable_caching()
    return own


@cache
def python_source(compiled: Any) -> Callable[..., Any]:
    """Return the source of a kernel or part as a Python function, whose callees are interpreted too."""
    source = compiled.py_func
    names = dict(source.__globals__)
    own = FunctionType(source.__code__, names, source.__name__, source.__defaults__, source.__closure__)
    for name in source.__code__.co_names:
        if isinstance(names.get(name), Dispatcher):
            names[name] = python_source(names[name])
    return own


def is_ready(compiled: Any) -> bool:
    """Return True where a kernel need not be compiled: it is in memory or on disk."""
    if compiled.overloads:
        return True
    own = _cache_file(compiled, "*.nbi")
    return any(own.parent.glob(own.name))


def _cache_file(compiled: Any, ending: str) -> Path:
    """Return a file beside those that Numba keeps of a kernel, named as they are."""
    source = compiled.py_func
    name = f"{Path(source.__code__.co_filename).stem}.{source.__qualname__}-{source.__code__.co_firstlineno}"
    return Path(compiled.stats.cache_path) / f"{name}.{ending}"


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
                return python_source(compiled)(*arguments)
        except (ArithmeticError, ValueError):
            # Python refuses what a processor answers by ∞ or not-a-number
            return compiled(*arguments)

    return interpret
