"""Export as a shared library with a plain C ABI, with wrappers for Python and MATLAB.

Functions take pointers to doubles and whole numbers of 32 bits, no structures by value and no callbacks. The library
is compiled by this machine's compiler; without one the sources and their CMake file are what is written.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from palpate.export.answer_network import AnswerNetwork, answers_of
from palpate.export.c_export import ExportedC, block_of, export_c
from palpate.export.check_answers import compare_answers
from palpate.export.check_library import CheckLibrary, CheckModel
from palpate.export.check_points import Comparison, compare_body
from palpate.export.compilers import compile_c, find_compiler
from palpate.export.core_source import fill_template
from palpate.export.weights_block import ROOT
from palpate.files import system_errors, write_file
from palpate.output_files import require_outputs, with_seal
from palpate.surrogates import Surrogate

__all__ = ["ExportedLibrary", "export_lib", "library_name"]


@dataclass(frozen=True)
class ExportedLibrary:
    """Sources, wrappers and library of one body."""

    sources: ExportedC  # the C files
    wrappers: tuple[Path, ...]  # for Python and MATLAB
    library: Path | None  # the shared library; None where there was no compiler
    comparison: Comparison | None  # how far the library is from palpate, asked by the Python wrapper

    @property
    def files(self) -> tuple[Path, ...]:
        """All files, the library first."""
        own = () if self.library is None else (self.library,)
        return (*own, *self.wrappers, *self.sources.files)


def library_name(name: str) -> str:
    """Return the file name of a shared library on this system."""
    return {"win32": f"{name}.dll", "darwin": f"lib{name}.dylib"}.get(sys.platform, f"lib{name}.so")


def export_lib(
    surrogate: Surrogate,
    out: str | os.PathLike[str],
    *,
    name: str | None = None,
    field: str | None = None,
    with_field: bool = True,
    deviation: bool = True,
    check: bool = True,
    compiler: str | None = None,
    overwrite: bool = False,
) -> ExportedLibrary:
    """Write a body, or numbers, curves and fields, as a shared library with its sources and wrappers.

    Parameters
    ----------
    surrogate : Surrogate
        What goes out.
    out : path
        Folder for the files; it is made where it is missing, in a folder that exists.
    name, field, with_field, deviation : optional
        As `palpate.export.export_c` takes them.
    check : bool
        Whether the library is compared with palpate.
    compiler : str, optional
        Name of the compiler; by default that of the variable CC, or the first one found.
    overwrite : bool
        True replaces files whatever they are; by default those alone that an earlier export wrote.

    Raises
    ------
    UsageError
        If the name is no identifier, a part of the body has no C source, there is no such compiler, or a file exists
        that no export wrote.
    ResourceError
        If the compiler refuses the sources.
    AccuracyError
        If the library differs from palpate by more than it may; nothing is written.
    """
    parts = {"field": field, "with_field": with_field, "deviation": deviation}
    # a library that was loaded can't be removed on Windows
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as place:
        built = _build(surrogate, Path(place), name, parts, compiler, check=check)
        return _copy(built, Path(out), overwrite=overwrite)


def _build(
    surrogate: Surrogate,
    folder: Path,
    name: str | None,
    parts: dict[str, Any],
    compiler: str | None,
    *,
    check: bool,
) -> ExportedLibrary:
    """Return the library and all beside it, written into a folder and compared there."""
    done = export_c(surrogate, folder, name=name, check=False, **parts)
    wrappers = tuple(
        write_file(folder / file, with_seal(file, text)) for file, text in _wrappers(surrogate, done).items()
    )
    path = find_compiler(compiler)
    if path is None:
        return ExportedLibrary(done, wrappers, None, None)
    library = folder / library_name(done.name)
    compile_c(path, list(done.sources), library, options=("-shared", "-fPIC", *_install_name(library.name)))
    whole = ExportedLibrary(done, wrappers, library, None)
    if not check:
        return whole
    comparison = _compare(surrogate, folder / f"{done.name}.py", parts)
    why, fix = (
        "The compiler may bend the arithmetic.",
        "Nothing was written. Try another compiler, and report this.",
    )
    comparison.require("The library does", why=why, fix=fix)
    return replace(whole, comparison=comparison)


def _compare(surrogate: Surrogate, wrapper: Path, parts: dict[str, Any]) -> Comparison:
    """Return how far the library beside a Python wrapper is from palpate."""
    if (answers := answers_of(surrogate)) is not None:
        return compare_answers(answers, CheckModel(wrapper).replies)
    block = block_of(surrogate, **parts)
    return compare_body(surrogate, CheckLibrary(wrapper), field=block.field, deviation=ROOT in block.tables)


def _install_name(file: str) -> tuple[str, ...]:
    """Return the options that keep the folder of the build out of a library of macOS."""
    return (f"-Wl,-install_name,@rpath/{file}",) if sys.platform == "darwin" else ()


def _copy(built: ExportedLibrary, folder: Path, *, overwrite: bool) -> ExportedLibrary:
    """Write all files into a folder, which is made where it is missing."""
    require_outputs((folder / file.name for file in built.files), folder=folder, overwrite=overwrite)
    with system_errors(f"The folder {folder} could not be made."):
        folder.mkdir(exist_ok=True)
    for file in built.files:
        write_file(folder / file.name, file.read_bytes())
    library = None if built.library is None else folder / built.library.name
    if built.library is not None and library is not None:
        shutil.copymode(built.library, library)
    sources = replace(built.sources, files=tuple(folder / f.name for f in built.sources.files))
    return ExportedLibrary(sources, tuple(folder / f.name for f in built.wrappers), library, built.comparison)


def _wrappers(surrogate: Surrogate, done: ExportedC) -> dict[str, str]:
    """Return the texts of the wrappers by their file names."""
    if (answers := answers_of(surrogate)) is not None:
        return _answer_wrappers(answers, done)
    name, baseline = done.name, surrogate.hand_energy.baseline
    middle = [(r.low + r.high) / 2 for r in surrogate.inputs]
    k = len(baseline.directions)
    place = sum(m * d for m, d in zip(middle[:k], baseline.directions, strict=True))
    words = {
        "@HASH@": done.hash,
        "@PLACE@": "[" + "; ".join(f"{v:.6g}" for v in place) + "]",
        "@PARAMETERS@": "["
        + "; ".join(f"{v:.6g}" for v in [*middle[k:], 0.0][: max(1, len(middle) - k)])
        + "]",
        "NAME": name,
    }
    memory = surrogate.memory
    parts = [] if memory is None else ["MEMORY"] + ["RELEASE"] * memory.moves_rest
    parts += ["FIELD"] * bool(done.field) + ["TORQUE"] * (surrogate.torque_evaluator is not None)
    templates = {
        f"{name}.py": "wrapper.py",
        f"{name}_matlab.h": "wrapper_matlab.h",
        f"{name}_example.m": "example.m",
    }
    return {file: fill_template(template, words, parts) for file, template in templates.items()}


def _answer_wrappers(answers: AnswerNetwork, done: ExportedC) -> dict[str, str]:
    """Return the texts of the wrappers of what no hand feels: for Python and MATLAB."""
    words = {
        "@HASH@": done.hash,
        "@MIDDLES@": "[" + ", ".join(f"{(r.low + r.high) / 2:.6g}" for r in answers.inputs) + "]",
        "@INPUTS@": str(len(answers.inputs)),
        "@OUTPUTS@": str(len(answers.outputs)),
        "NAME": done.name,
    }
    templates = {
        f"{done.name}.py": "wrapper_answers.py",
        f"{done.name}_matlab.h": "wrapper_answers_matlab.h",
        f"{done.name}_example.m": "example_answers.m",
    }
    return {file: fill_template(template, words, ()) for file, template in templates.items()}
