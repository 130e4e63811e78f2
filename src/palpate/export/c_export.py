"""Export to C99: a header, a source with the weights as tables, an example and a CMake file, compared with palpate."""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.export.answer_network import answers_of
from palpate.export.c_files import c_files, require_name
from palpate.export.check_answers import compare_answers
from palpate.export.check_points import Comparison, Precision, compare_body
from palpate.export.check_program import CheckProgram
from palpate.export.compilers import find_compiler
from palpate.export.field_tables import chosen_field
from palpate.export.weights_block import PLACES, ROOT, WeightsBlock, identifier
from palpate.files import system_errors, write_file
from palpate.network import Network
from palpate.output_files import require_outputs, with_seal
from palpate.surrogates import Surrogate
from palpate.surrogates.model_card import card_of

__all__ = ["ExportedC", "block_of", "compare_c", "export_c"]


@dataclass(frozen=True)
class ExportedC:
    """Files that an export wrote, and how far they are from palpate.

    Attributes
    ----------
    files : tuple of Path
        The header first.
    name : str
        Beginning of all names in C.
    hash : str
        SHA-256 of the weights.
    field : str
        The field that went out with it; "" for none.
    comparison : Comparison, optional
        How far it is from palpate; None where there was no compiler, or nothing was to be compared.
    """

    files: tuple[Path, ...]
    name: str
    hash: str
    field: str
    comparison: Comparison | None

    @property
    def sources(self) -> tuple[Path, ...]:
        """The .c files that belong into a program."""
        return tuple(f for f in self.files if f.suffix == ".c" and f.name != "example.c")

    @property
    def example(self) -> Path:
        """The program that presses the body once."""
        return next(f for f in self.files if f.name == "example.c")

    def as_dict(self) -> dict[str, Any]:
        """Return what was written and compared, for JSON."""
        files = [{"file": str(f), "bytes": f.stat().st_size} for f in self.files]
        return {
            "files": files,
            "name": self.name,
            "hash": self.hash,
            "field": self.field,
            "compared": None if self.comparison is None else self.comparison.as_dict(),
        }


def export_c(
    thing: Surrogate | Network,
    out: str | os.PathLike[str],
    *,
    name: str | None = None,
    single: bool = False,
    field: str | None = None,
    with_field: bool = True,
    deviation: bool = True,
    check: bool = True,
    compiler: str | None = None,
    overwrite: bool = False,
) -> ExportedC:
    """Write a surrogate or a network as C99, and compare it with palpate at 1,000 places if there is a C compiler.

    Of what no hand feels all numbers, and all values of all fields and curves go out.

    Parameters
    ----------
    thing : Surrogate or Network
        What goes out.
    out : path
        Folder for the files; it is made where it is missing, in a folder that exists.
    name : str, optional
        Beginning of all names in C; by default the body's name.
    single : bool
        Whether numbers are of single precision.
    field : str, optional
        The field that goes out, as a second source; by default the displacement.
    with_field, deviation : bool
        Whether the field and the deviation of the force go out.
    check : bool
        Whether it is compiled and compared.
    compiler : str, optional
        Name of the compiler to compare with; by default that of the variable CC, or the first one found.
    overwrite : bool
        True replaces files whatever they are; by default those alone that an earlier export wrote.

    Raises
    ------
    UsageError
        If the name is no identifier, a part of the body has no C source, there is no such compiler, or a file exists
        that no export wrote.
    AccuracyError
        If the compiled files differ from palpate by more than they may; nothing is written.
    """
    surrogate = Surrogate.of(thing)
    name = require_name(identifier(surrogate.name) if name is None else name)
    if single and not surrogate.can_be_touched:
        deviation = False  # a form that is small beside its terms is lost in 32 bits
    block = block_of(surrogate, field=field, with_field=with_field, deviation=deviation)
    texts = c_files(surrogate, answers_of(surrogate), block, name, single=single)
    card = card_of(surrogate).with_hash(block.label, block.hash)
    texts |= {f"{name}_card.md": card.to_markdown(), f"{name}_card.json": card.to_json()}
    folder = Path(out)
    require_outputs((folder / file for file in texts), folder=folder, overwrite=overwrite)
    path, comparison = find_compiler(compiler) if check else None, None
    if path is not None:
        with tempfile.TemporaryDirectory() as place:
            tried = ExportedC(_write(Path(place), texts), name, block.hash, block.field, None)
            comparison = compare_c(surrogate, block, tried, path, single=single)
        why = (
            "Single precision is too coarse for this body."
            if single
            else "The compiler may bend the arithmetic."
        )
        fix = "Export in double precision." if single else "Try another compiler, and report this."
        comparison.require("The exported files do", why=why, fix=f"Nothing was written. {fix}")
    with system_errors(f"The folder {folder} could not be made."):
        folder.mkdir(exist_ok=True)
    return ExportedC(_write(folder, texts), name, block.hash, block.field, comparison)


def _write(folder: Path, texts: dict[str, str]) -> tuple[Path, ...]:
    return tuple(write_file(folder / file, with_seal(file, text)) for file, text in texts.items())


def block_of(surrogate: Surrogate, *, field: str | None, with_field: bool, deviation: bool) -> WeightsBlock:
    """Return the weights of a surrogate; an error where a part of it has no C source."""
    if (answers := answers_of(surrogate)) is not None:
        return WeightsBlock.of_answers(answers if deviation else answers.without_doubts())
    chosen = chosen_field(surrogate, field) if with_field else None
    return WeightsBlock.of(surrogate, field=chosen, deviation=deviation)


def compare_c(
    surrogate: Surrogate,
    block: WeightsBlock,
    done: ExportedC,
    compiler: str,
    *,
    single: bool,
    options: tuple[str, ...] = (),
) -> Comparison:
    """Compile exported files and compare them with palpate."""
    precision = Precision(single)
    with tempfile.TemporaryDirectory() as folder:
        if (answers := answers_of(surrogate)) is not None:
            program = CheckProgram.compile(
                compiler, done.sources, done.name, Path(folder), network=True, options=options
            )
            answers = answers if PLACES in block.tables else answers.without_doubts()
            return compare_answers(answers, lambda X: program.replies(X, len(answers.outputs)), precision)
        nodes = surrogate.surface_fields[block.field].rest.shape if block.field else (0, 0)
        program = CheckProgram.compile(
            compiler,
            done.sources,
            done.name,
            Path(folder),
            memory=bool(block.memory),
            field=nodes,
            torque=block.torque,
            options=options,
        )
        known = ROOT in block.tables
        return compare_body(surrogate, program, precision, field=block.field, deviation=known)
