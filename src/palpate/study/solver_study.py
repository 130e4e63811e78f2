"""A study of another program's solver: what varies, how the program is started, and what its results mean.

Its file has `[solver]` in place of `[body]`. `palpate sweep` alone reads it and starts the program; what comes out is a
dataset like an imported one, which every other command takes.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError, field_validator, model_validator

from palpate.dataset.readers.case_results import mapping_of_outputs
from palpate.dataset.readers.mapping import ImportMapping, Load
from palpate.errors import StudyError, UsageError
from palpate.input_files import read_toml
from palpate.number_text import leading_number
from palpate.record_complaints import complaints
from palpate.records import Count, Record, in_si
from palpate.study.study_paths import Paths
from palpate.sweeps.command_problem import CommandProblem
from palpate.sweeps.template_files import DIGITS, TemplateFiles
from palpate.sweeps.umbridge_problem import UMBridgeProblem
from palpate.tables.unit_names import plain_unit
from palpate.unit_text import si_conversion
from palpate.units import Range

__all__ = [
    "SolverInputRecord",
    "SolverRecord",
    "SolverStudy",
    "SolverSweepRecord",
    "SolverTestRecord",
    "UMBridgeRecord",
    "read_solver_study",
    "says_solver",
]

Quantity = float | str


class SolverRecord(Record):
    """Program that solves, and what it needs."""

    command: tuple[str, ...] = Field(
        description="program and arguments, started without a shell in the folder of a case; `{case}`, "
        "`{templates}` and `{python}` are replaced",
        examples=[["ccx", "{case}"]],
        min_length=1,
    )
    templates: str = Field("templates", description="folder of the templates, beside the study")
    raw: tuple[str, ...] = Field((), description="patterns of templates that are copied as they are")
    digits: Count = Field(DIGITS, ge=1, le=17, description="significant digits of numbers in templates")
    results: tuple[str, ...] = Field(
        description="files that the program leaves, all of one solve", examples=[["{case}.frd"]], min_length=1
    )
    solution: Literal["last", "first", "only"] = Field(
        "last", description="which of several solutions in the results is taken"
    )
    failure: tuple[str, ...] = Field(
        (),
        description="texts in the output that mean a failure, whatever the exit code",
        examples=[["*ERROR"]],
    )
    limit: Quantity | None = Field(
        None,
        description="time after which the program is ended; left out: that of `--case-limit`",
        examples=["10 min"],
    )
    environment: dict[str, str] = Field(
        default_factory=dict, description="environment variables for the program"
    )

    @field_validator("limit")
    @classmethod
    def _seconds(cls, value: Quantity | None) -> float | None:
        seconds = None if value is None else in_si(value, "s")
        if seconds is not None and seconds <= 0:
            raise ValueError(f"{value!r} is no time that a program could take")
        return seconds

    def problem(self, study: SolverStudy, folder: Path, limit: float) -> CommandProblem:
        """Return the problem of a study whose files stand in `folder`; a program takes at most `limit` s."""
        base, command = folder.resolve(), self.command
        if os.sep in command[0] and "{" not in command[0]:  # a program beside the study
            command = (os.path.normpath(base / command[0]), *command[1:])
        return CommandProblem(
            ranges=study.ranges,
            command=command,
            templates=TemplateFiles(base / self.templates, self.raw, self.digits),
            results=self.results,
            mapping=study.results_mapping(folder),
            cases=base / f"{study.name}.cases",
            constants={name: _si(value) for name, value in study.values.items()},
            solution=self.solution,
            failure=self.failure,
            limit=limit if self.limit is None else min(limit, float(self.limit)),
            environment=self.environment,
        )


class UMBridgeRecord(Record):
    """Model of a UM-Bridge server in place of a command."""

    url: str = Field(
        pattern=r"^https?://[^/\s]+", description="address of the server", examples=["http://127.0.0.1:4242"]
    )
    model: str = Field("forward", description="name of its model")
    config: dict[str, Any] = Field(default_factory=dict, description="settings that the model takes")

    def problem(self, study: SolverStudy, folder: Path, limit: float) -> UMBridgeProblem:
        """Return the problem of a study whose files stand in `folder`; a solve takes at most `limit` s."""
        return UMBridgeProblem(
            ranges=study.ranges,
            units=tuple(entry.conversion() for entry in study.inputs),
            url=self.url,
            model=self.model,
            mapping=study.results_mapping(folder),
            config=self.config,
            limit=limit,
        )


class SolverInputRecord(Record):
    """One input."""

    name: str = Field(min_length=1, pattern=r"^[^|{}\n]+$", description="name, also in the templates")
    range: tuple[Quantity, Quantity] = Field(description="ends with their unit", examples=[["10 W", "50 W"]])
    unit: str | None = Field(
        None, description="with `url`: unit that the model takes; templates name their units themselves"
    )
    load: Load | None = Field(None, description="node and direction, where the input is a force on a node")

    @field_validator("range")
    @classmethod
    def _ends(cls, value: tuple[Quantity, Quantity]) -> tuple[Quantity, Quantity]:
        (low, unit), (high, other) = _si(value[0]), _si(value[1])
        if unit != other:
            raise ValueError(f"its ends are in {unit or 'pure numbers'} and {other or 'pure numbers'}")
        if not low < high:
            raise ValueError(
                f"from {value[0]!r} to {value[1]!r} it does not vary; a fixed value stands in [values]"
            )
        return value

    def interval(self) -> Range:
        """Return the range in SI units."""
        low, unit = _si(self.range[0])
        return Range(self.name, low, _si(self.range[1])[0], unit)

    def conversion(self) -> tuple[float, float]:
        """Return factor and offset from the unit that a model takes to SI."""
        wanted = self.interval().unit
        if self.unit is None and wanted:
            raise UsageError(
                f"The unit of the input {self.name!r} is missing.",
                why="A model of UM-Bridge takes plain numbers, and states no unit.",
                fix=f'Add unit = "{wanted}", or the unit that the model takes, to this input.',
            )
        factor, offset, unit = si_conversion(plain_unit(self.unit or ""))
        if unit != wanted:
            raise UsageError(
                f"The input {self.name!r} is in {wanted or 'pure numbers'}, and its `unit` is {self.unit}.",
                fix="Correct one of them.",
            )
        return factor, offset


def _si(value: Quantity) -> tuple[float, str]:
    """Return a quantity of any dimension in SI units, and its SI unit; it raises `ValueError`."""
    if not isinstance(value, str):
        return in_si(value, ""), ""
    try:
        number = leading_number(value)
        factor, offset, unit = si_conversion(plain_unit(number.rest))
    except UsageError as error:
        raise ValueError(f"{error.what} {error.fix}".strip()) from error
    return float(number.value) * factor + offset, unit


class SolverSweepRecord(Record):
    """Solves to learn from."""

    samples: Count = Field(40, ge=1, description="number of solves")
    seed: Count = Field(0, ge=0, description="decides the design")
    design: Literal["sobol", "grid", "random"] = Field("sobol", description="how the ranges are sampled")
    workers: Count | None = Field(
        None, ge=1, description="programs at the same time; left out: one per core", examples=[2]
    )


class SolverTestRecord(Record):
    """Solves for testing, which learning never sees."""

    random: Count = Field(10, ge=0, description="number of solves at random places")
    seed: Count = Field(1, ge=0, description="decides the places")


class SolverStudy(Record):
    """Study of another program's solver."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", description="files are named after it")
    solver: SolverRecord | UMBridgeRecord = Field(description="`command`, or `url` of a UM-Bridge server")
    inputs: tuple[SolverInputRecord, ...] = Field(min_length=1)
    values: dict[str, Quantity] = Field(
        default_factory=dict, description="further values for the templates, which do not vary"
    )
    mapping: dict[str, Any] | str = Field(
        description="meaning of the results' columns, as for `palpate dataset import`, or the path of such a file"
    )
    sweep: SolverSweepRecord = SolverSweepRecord()
    test: SolverTestRecord = SolverTestRecord()

    @field_validator("solver", mode="before")
    @classmethod
    def _solver_of_its_kind(cls, value: Any) -> Any:
        """Return the record that the keys ask for, so that what is wrong with it is said of this one alone."""
        if not isinstance(value, Mapping):
            return value
        return (UMBridgeRecord if "url" in value else SolverRecord).model_validate(dict(value))

    @field_validator("values")
    @classmethod
    def _constants(cls, value: dict[str, Quantity]) -> dict[str, Quantity]:
        for text in value.values():
            _si(text)
        return value

    @model_validator(mode="after")
    def _names(self) -> SolverStudy:
        names = [entry.name for entry in self.inputs] + list(self.values)
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise ValueError(f"two inputs or values are called {twice[0]!r}")
        return self

    def results_mapping(self, folder: Path) -> ImportMapping:
        """Return the meaning of the results' columns; a file of it stands in `folder`."""
        content = read_toml(folder / self.mapping) if isinstance(self.mapping, str) else self.mapping
        content = {"name": self.name, **content}
        loads: Mapping[str, Any] = {entry.name: entry.load for entry in self.inputs if entry.load is not None}
        return mapping_of_outputs(content, self.ranges, loads)

    @property
    def ranges(self) -> tuple[Range, ...]:
        """The inputs in SI units."""
        return tuple(entry.interval() for entry in self.inputs)

    def problem(self, folder: Path, limit: float) -> CommandProblem | UMBridgeProblem:
        """Return the problem of the study, whose files stand in `folder`; a solve takes at most `limit` s."""
        return self.solver.problem(self, folder, limit)

    def paths(self, folder: Path) -> Paths:
        """Return the files of the study."""
        return Paths(folder, self.name)


def says_solver(path: Path) -> bool:
    """Return whether a file is a study of another program's solver; False for what is no TOML at all."""
    try:
        return path.is_file() and "solver" in read_toml(path)
    except UsageError:
        return False


def read_solver_study(path: Path) -> SolverStudy:
    """Read a study with `[solver]`; all that is wrong with it is listed."""
    try:
        return SolverStudy.model_validate(read_toml(path))
    except ValidationError as error:
        raise StudyError(
            f"{path} does not describe a study of a solver:",
            why="\n".join(f"  {line}" for line in complaints(error, SolverStudy)),
            fix="The guide “Solvers as sources” has every key with its meaning.",
        ) from error
