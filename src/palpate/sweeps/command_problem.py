"""A problem whose solves another program makes: a command, a folder of templates, and files of results.

Each case has a folder of its own. Its answers are kept in a file until the sweep is whole, so that a sweep that was
killed runs no finished case again; the folder of a case that failed stays.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from palpate.dataset.readers.case_results import read_case
from palpate.dataset.readers.mapping import ImportMapping
from palpate.errors import PalpateError, SolverError, UsageError
from palpate.files import system_errors
from palpate.supervised import ChildEnded, run_in_child
from palpate.sweeps.answer_files import SavedCase
from palpate.sweeps.mapped_problem import CaseFailure, MappedProblem, MappedSolver
from palpate.sweeps.program_run import OUTPUT, last_lines, run_program
from palpate.sweeps.space import Space, random
from palpate.sweeps.template_files import TemplateFiles, fill_words
from palpate.units import Range

__all__ = ["READING", "CommandProblem"]

READING = 120.0
"""Time in s that writing the files of a case and reading its results may take, besides the program itself."""

_FIRST_TRIES = 3  # cases that are tried for the mesh, the middle of the ranges first
_SAME_PLACE = 1e-6  # distance over the body's size that is rounding of coordinates printed with six digits


@dataclass(frozen=True)
class CommandProblem(MappedProblem):
    """A problem that another program solves, started without a shell in a folder of its own for each case.

    The first case, in the middle of the ranges, says what the others look like: its mesh is that of the dataset. A case
    whose program fails, takes too long, or leaves no results or such of another mesh becomes a row with the reason.
    """

    ranges: tuple[Range, ...]
    # program and arguments: {case} is the name of the case, {templates} their folder, {python} this Python
    command: tuple[str, ...]
    templates: TemplateFiles  # files that are written into the folder of each case
    results: tuple[str, ...]  # files that the program leaves there, all of one solve
    mapping: ImportMapping  # meaning of the columns of the results
    cases: Path  # folder for the folders of the cases
    # further values for the templates, in SI units, with these units
    constants: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    solution: str = (
        "last"  # which of several solutions is the answer: the "last", the "first", or the "only" one
    )
    failure: tuple[
        str, ...
    ] = ()  # texts in the program's output that mean that it failed, whatever its exit code
    limit: float = 3600.0  # time in s after which the program is ended, with all that it started
    environment: Mapping[str, str] = field(
        default_factory=dict
    )  # besides the variables that this process has

    def __getstate__(self) -> dict[str, Any]:
        """Return what a worker gets: it reads the first case from its file."""
        return {name: value for name, value in self.__dict__.items() if name != "first"}

    def source(self) -> dict[str, Any]:
        """Return what decides the answers besides the mapping: templates by their hashes."""
        return {
            "command": list(self.command),
            "templates": self._hashes,
            "raw": list(self.templates.raw),
            "digits": self.templates.digits,
            "results": list(self.results),
            "solution": self.solution,
            "failure": list(self.failure),
            "constants": {name: list(value) for name, value in self.constants.items()},
            "environment": dict(self.environment),
        }

    @functools.cached_property
    def _hashes(self) -> dict[str, str]:
        """Hashes of the templates when the sweep began."""
        return self.templates.hashes()

    @functools.cached_property
    def _identity(self) -> bytes:
        return hashlib.sha256(json.dumps(self.describe(), sort_keys=True).encode()).digest()

    def open(self) -> MappedSolver:
        """Make a solver; templates that were changed since the sweep began are refused."""
        if self.templates.hashes() != self._hashes:
            raise UsageError(
                f"The templates in {self.templates.folder} were changed during the sweep.",
                fix="Sweep again under another name, or put them back.",
            )
        return MappedSolver(self)

    def values(self, x: np.ndarray) -> Mapping[str, np.ndarray]:
        """Return the answers for the inputs `x` (n,), of the program unless an earlier run has them."""
        return self.solve_once(x, self.first).values

    def shown_command(self) -> str:
        """Return the command as a person would type it, with the folder that it is started in."""
        import shlex

        return f"{shlex.join(self._words('{case}'))}\n  without a shell, in {self.cases}{os.sep}{{case}}"

    @property
    def program(self) -> str:
        """Name of the program, without its folder."""
        return Path(self._words("")[0]).name

    def check(self) -> None:
        """Refuse a command that does not exist, and templates that can't be filled."""
        self.templates.check(self.ranges, self.constants)
        for name in self.results:
            _require_inside(fill_words([name], {"case": "case"}, "`results`")[0])
        if not self.results:
            raise UsageError(
                "The solver's study names no results.", fix='Say results = ["NAME.frd"] in [solver].'
            )
        program = self._words("")[0]
        if shutil.which(program) is None:
            raise UsageError(
                f"There is no program {program!r}.",
                why="It is neither a file that can be run nor on the PATH.",
                fix="Install it, or write its path in `command`.",
            )
        if program.lower().endswith((".bat", ".cmd")):
            raise UsageError(
                f"{program} is a script of the Windows shell.",
                why="A sweep starts programs without a shell.",
                fix='Name the program itself, or command = ["{python}", "{templates}/run.py"].',
            )

    def tidy(self) -> None:
        """Remove the answers that were kept for an interruption; folders of failed cases stay."""
        for path in self.cases.glob("*.npz"):
            path.unlink(missing_ok=True)
        if self.cases.is_dir() and not any(self.cases.iterdir()):
            self.cases.rmdir()

    @functools.cached_property
    def first(self) -> SavedCase:
        """The first case that has answers; the others must have its mesh."""
        path = self.cases / f"first-{self._identity.hex()[:12]}.npz"
        saved = SavedCase.load(path)
        if saved is not None:
            return saved
        space, failures = Space(self.ranges), []
        for x in [space.from_unit(np.full(len(space), 0.5)), *random(space, _FIRST_TRIES - 1, seed=0)]:
            try:
                saved = run_in_child(_solve_first, self, x, limit=self.limit + READING)
            except (ChildEnded, CaseFailure) as error:
                failures.append(f"{_shown(self.ranges, x)}: {error.what}\n{error.why}".rstrip())
                continue
            saved.save(path)
            return saved
        raise SolverError(
            f"None of the first {len(failures)} cases has an answer.",
            why="\n".join(failures),
            fix=f"Look into the folders of the cases in {self.cases}, and correct templates, command or mapping.",
        )

    def solve_once(self, x: np.ndarray, first: SavedCase | None = None) -> SavedCase:
        """Return the answers for the inputs `x` (n,), of an earlier run or of the program.

        Answers on another mesh than those of the `first` case are a failure.
        """
        case = f"case-{hashlib.sha256(self._identity + np.ascontiguousarray(x).tobytes()).hexdigest()[:12]}"
        path = self.cases / f"{case}.npz"
        saved = SavedCase.load(path)
        if saved is not None:
            return saved
        folder = self.cases / case
        shutil.rmtree(folder, ignore_errors=True)  # a killed sweep left it
        with system_errors(f"The folder {folder} could not be made."):
            folder.mkdir(parents=True)
        self._write(folder, case, x)
        self._run(folder, case)
        files = [folder / name for name in fill_words(self.results, {"case": case}, "`results`")]
        saved, notes = self._read(folder, files, x)
        if difference := "; ".join(_differences(first or saved, saved)):
            raise _failure_of(" ".join([f"its results differ: {difference}.", *notes]).rstrip("."), folder)
        saved.save(path)
        shutil.rmtree(folder, ignore_errors=True)
        return saved

    def _write(self, folder: Path, case: str, x: np.ndarray) -> None:
        values = {r.name: (float(v), r.unit) for r, v in zip(self.ranges, x, strict=True)}
        self.templates.write(folder, case, {**self.constants, **values})

    def _run(self, folder: Path, case: str) -> None:
        end = run_program(self._words(case), folder, self.environment, self.limit)
        reason = end.failure
        if not reason and self.failure:
            output = (folder / OUTPUT).read_text(encoding="utf-8", errors="replace")
            sign = next((text for text in self.failure if text in output), None)
            reason = "" if sign is None else f"{self.program} printed {sign!r}"
        if reason:
            raise _failure_of(reason, folder)

    def _read(self, folder: Path, files: Sequence[Path], x: np.ndarray) -> tuple[SavedCase, Sequence[str]]:
        missing = [file.name for file in files if not file.is_file()]
        if missing:
            raise _failure_of(f"{self.program} ended without an error, but wrote no {missing[0]}", folder)
        try:
            answers = read_case(files, self.mapping, x, self.solution)
        except (PalpateError, ChildEnded) as error:
            reason = " ".join(filter(None, (error.what, error.why)))
            raise _failure_of(f"its results can't be taken: {reason}".rstrip("."), folder) from error
        for entry in answers.fields:
            if not np.isfinite(answers.answers[entry.name]).all():
                raise _failure_of(f"{entry.name!r} in its results is not a number", folder)
        values = {entry.name: answers.answers[entry.name][0] for entry in answers.fields}
        return SavedCase(answers.layout, answers.fields, values), answers.notes

    def _names(self, case: str) -> dict[str, str]:
        return {"case": case, "templates": os.fspath(self.templates.folder), "python": sys.executable}

    def _words(self, case: str) -> list[str]:
        return fill_words(self.command, self._names(case), "The command")


def _require_inside(name: str) -> None:
    if Path(name).is_absolute() or ".." in Path(name).parts:
        raise UsageError(
            f"The results {name!r} do not lie in the folder of the case.",
            fix="Name files that the program writes where it is started.",
        )


def _failure_of(reason: str, folder: Path) -> CaseFailure:
    lines = last_lines(folder / OUTPUT)
    said = "".join(f"\n    {line}" for line in lines)
    end = f"The last lines of its output:{said}" if lines else "It printed nothing."
    return CaseFailure(f"{reason[0].upper()}{reason[1:]}.", why=f"{end}\nIts folder is {folder}")


def _solve_first(problem: CommandProblem, x: np.ndarray) -> SavedCase:
    return problem.solve_once(x)


def _shown(ranges: Sequence[Range], x: np.ndarray) -> str:
    return ", ".join(f"{r.name} = {v:.6g} {r.unit}".rstrip() for r, v in zip(ranges, x, strict=True))


def _differences(first: SavedCase, other: SavedCase) -> Iterator[str]:
    """Yield what makes a case one of another mesh than the first."""
    a, b = first.layout.rest, other.layout.rest
    if a.shape != b.shape:
        yield f"{len(b)} nodes have answers, {len(a)} in the first case"
    elif np.abs(a - b).max(initial=0.0) > _SAME_PLACE * max(float(np.ptp(a)), 1e-300):
        yield "their nodes lie elsewhere than in the first case: another mesh, or that of the deformed body"
    for mine, theirs in zip(first.fields, other.fields, strict=True):
        if a.shape == b.shape and mine.shape != theirs.shape:
            yield f"{mine.name!r} has the shape {theirs.shape}, {mine.shape} in the first case"
