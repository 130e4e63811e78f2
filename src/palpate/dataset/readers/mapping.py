"""The mapping: which columns of another solver's results are inputs, outputs and coordinates, and in which units.

A TOML file, or the same as a dictionary::

    name = "nylon beam"
    coordinates = ["x", "y"]           # of a plane body; all that the file has by default

    [units]
    length = "mm"                      # a consistent system, for files that state no units
    force = "N"

    [[inputs]]
    name = "tip load"
    from = "time"                      # a column; by default the one of this name
    times = "5 N"                      # a load factor times the whole load
    load = { at = ["100 mm", "0 mm"], direction = [0, -1] }

    [[outputs]]
    name = "displacement"
    from = "DISP"                      # a vector, or a list of its components
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from typing import Any, Literal

from pydantic import ConfigDict, Field, ValidationError, field_validator, model_validator

from palpate.errors import UsageError
from palpate.input_files import read_toml
from palpate.record_complaints import complaints
from palpate.records import Count, Metres, Number, Record, in_si

__all__ = ["ImportMapping", "Input", "Load", "Nodes", "Output", "read_mapping"]

Place = Count | tuple[Metres, ...]


class Load(Record):
    """A force on one node."""

    at: Place  # number of the node in the file, or its place at rest, m
    direction: tuple[Number, ...]  # of a positive load, of any length


class _Source(Record):
    model_config = ConfigDict(populate_by_name=True)

    name: str
    # column in the file; by default the one of its name
    source: str | tuple[str, ...] = Field(default="", alias="from")
    unit: str | None = None  # of the column, where the file states none or a wrong one
    # a factor, such as -1, after all else; as a quantity, "5 N", the column is a load factor without a unit
    times: float | str = 1.0
    at: Place | None = None  # place of the column whose values are meant
    # how one number is made of all places of the column
    reduce: Literal["max", "min", "mean", "sum"] | None = None

    @property
    def columns(self) -> str | tuple[str, ...]:
        """Column that it comes from, or the components of a vector."""
        return self.source or self.name


class Input(_Source):
    """One input of the dataset."""

    load: Load | None = None  # node and direction where the input is a force on a node
    # ends in SI units or as text with a unit; by default the least and the largest value
    range: tuple[float | str, float | str] | None = None


class Output(_Source):
    """One quantity that each case answers; the keys of an `Input` and these."""

    invariant: Literal["von Mises"] | None = None  # made of the six components of a tensor
    meaning: str = ""  # a few words that are kept beside the numbers


class Nodes(Record):
    """Nodes that are kept."""

    # coordinates that a kept node has, by the name of the axis in the file
    near: dict[str, Metres] = Field(default_factory=dict)
    tolerance: Metres | None = None  # largest distance from them; by default a millionth of the body's size
    sort: str | None = None  # axis along which the nodes are ordered


class ImportMapping(Record):
    """Meaning of the columns of another solver's results.

    Attributes
    ----------
    name : str
        Name of the body, for the dataset's record.
    inputs, outputs : tuple of Input, tuple of Output
        What becomes an input and an output of the dataset.
    units : mapping
        Units by column, and ``length``, ``force`` and ``time`` of a consistent system.
    coordinates : tuple of str, optional
        Axes that the body's coordinates are, two or three of those of the file; all by default.
    join : {"stem", "columns", "cases"}
        How several files belong together: files of one name but for its ending have the same cases (``stem``); all
        files have them; or each file has further cases.
    file_pattern : str
        Regular expression with named groups, such as ``F(?P<force>[0-9.]+)``: numbers in the names of files, which
        become columns.
    axis : str
        Column that runs along curves, such as ``time``: rows of equal inputs are one case, and outputs curves along it.
    nodes : Nodes, optional
        Nodes that are kept; all by default.
    surfaces : mapping of name to coordinates
        Parts of the surface by a coordinate of all corners of their triangles, such as ``top = { z = "50 mm" }``.
    mirrored : bool
        True where the body is its own mirror image across its axis, such as a straight beam: loads of the other sign
        are then known too, and a range of one load begins at zero.
    body : mapping
        Further facts of the body for its record, such as ``half_height`` in m.
    interactions : tuple of mappings
        What acts on the body, as the record of a sweep has it, such as a ``SphereProbe``; lengths in m or as text.
    """

    name: str = "imported body"
    inputs: tuple[Input, ...] = ()
    outputs: tuple[Output, ...] = ()
    units: dict[str, str] = Field(default_factory=dict)
    coordinates: tuple[str, ...] | None = None
    join: Literal["stem", "columns", "cases"] = "stem"
    file_pattern: str = ""
    axis: str = ""
    nodes: Nodes | None = None
    surfaces: dict[str, dict[str, Metres]] = Field(default_factory=dict)
    mirrored: bool = False
    body: dict[str, Any] = Field(default_factory=dict)
    interactions: tuple[dict[str, Any], ...] = ()

    @field_validator("interactions", mode="before")
    @classmethod
    def _interactions(cls, value: Any) -> Any:
        return [_plain(entry) for entry in value] if isinstance(value, list | tuple) else value

    @field_validator("body", mode="before")
    @classmethod
    def _body(cls, value: Any) -> Any:
        return _plain(value)

    @field_validator("file_pattern")
    @classmethod
    def _pattern(cls, value: str) -> str:
        try:
            groups = re.compile(value).groupindex
        except re.error as error:
            raise ValueError(f"it is no regular expression: {error}") from error
        if value and not groups:
            raise ValueError("it names no group; write (?P<force>[0-9.]+) for a number called force")
        return value

    @model_validator(mode="after")
    def _names(self) -> ImportMapping:
        for kind, entries in (("inputs", self.inputs), ("outputs", self.outputs)):
            names = [entry.name for entry in entries]
            twice = sorted({name for name in names if names.count(name) > 1})
            if twice:
                raise ValueError(f"two of the {kind} are called {twice[0]!r}")
        if any(not isinstance(entry.columns, str) for entry in self.inputs):
            raise ValueError("an input comes from one column; write several inputs for a vector")
        return self


def _plain(value: Any) -> Any:
    """Turn texts with a length, such as ``"10 mm"``, into m; all else stays."""
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    if isinstance(value, str) and re.match(r"\s*[-+−]?\s*[.,]?[0-9]", value):
        return in_si(value, "m")
    return value


def read_mapping(source: str | os.PathLike[str] | Mapping[str, Any] | ImportMapping) -> ImportMapping:
    """Return a mapping from a TOML file or a dictionary.

    Parameters
    ----------
    source : path, dict or ImportMapping
        Where it stands; one that has been read is returned as it is.

    Raises
    ------
    UsageError
        If the file is missing or no TOML, or a key is unknown or has a wrong value; all of them are listed.
    """
    if isinstance(source, ImportMapping):
        return source
    where = "The mapping"
    if not isinstance(source, Mapping):
        where, source = os.fspath(source), read_toml(source)
    try:
        return ImportMapping.model_validate(dict(source))
    except ValidationError as error:
        raise UsageError(
            f"{where} does not say what the columns are:",
            why="\n".join(f"  {line}" for line in complaints(error, ImportMapping, "mapping")),
            fix="The guide “Results of other solvers” has every key with its meaning.",
        ) from error
