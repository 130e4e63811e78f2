"""Tables of testing machines as records of tests: which column holds what, signs, raw load and extension, cycles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate import checks
from palpate.errors import FileFormatError, UsageError
from palpate.format import by_number
from palpate.tables import Column, Table, named_quantity, read_table

if TYPE_CHECKING:
    from palpate.physics.materials import IndentationTest

__all__ = ["KINDS", "SpecimenTables"]

KINDS = ("uniaxial", "equibiaxial", "planar", "indentation", "relaxation")
_SIDES = ("tension", "compression")  # sides of a uniaxial test, for --test too
_WORDS = {
    "equibiaxial": ("equibiaxial", "biaxial", "bulge", "inflation"),
    "planar": ("planar", "pure shear", "pure_shear", "pure-shear", "pureshear"),
    "indentation": ("indent",),
    "relaxation": ("relax",),
    "compression": ("compression", "compressive", "druckversuch"),
    "uniaxial": ("uniaxial", "tensile", "tension", "zugversuch"),
}
"""Words in a file's name that tell the kind of its test; the first that fits is taken."""

_UNITS = {
    "time": "s",
    "force": "N",
    "depth": "m",
    "extension": "m",
    "nominal": "Pa",
    "true": "Pa",
    "stress": "Pa",
}
_UNITS |= dict.fromkeys(("stretch", "strain", "log strain"), "")
"""What a column can hold, with its SI unit."""
_PERCENT = 3.0  # strain without a unit, above which it may be in per cent
_STRAY = 0.1  # share of the largest value, up to which values of the other sign are noise


@dataclass(frozen=True)
class SpecimenTables:
    """Files of tests, and what was said of them."""

    files: list[Path]
    kinds: list[str]  # of the tests, in their order; empty where the files' names tell them
    measure: str | None  # of stress, where columns don't tell it
    columns: list[str]  # words WHAT=NAME
    options: Any = field(default_factory=dict)  # of `palpate.tables.read_table`
    # undeformed lengths in m, one for all files or one for each; empty where the tables have strain
    heights: list[float] = field(default_factory=list)
    # undeformed sections in m², likewise; empty where the tables have stress
    areas: list[float] = field(default_factory=list)
    cycle: str | None = None  # which cycle of loads is taken; None takes the first loading
    # sentences on what was left out or taken for something, which reading adds to
    notes: list[str] = field(default_factory=list)

    def kind(self, i: int) -> str:
        """Return the kind of the test of a file, one of `KINDS`; see `_stated`."""
        stated = self._stated(i)
        return "uniaxial" if stated in _SIDES else stated

    def _stated(self, i: int) -> str:
        """Return the kind of a test as it is said, or as the file's name says it; tension and compression are kinds."""
        if self.kinds:
            if len(self.kinds) != len(self.files) or not set(self.kinds) <= {*KINDS, *_SIDES}:
                raise UsageError(
                    f"The kinds of {len(self.files)} tests are given as {', '.join(self.kinds)}.",
                    why=f"Each file has one of {', '.join((*KINDS, *_SIDES))}.",
                    fix="Give --test once for each file, in their order.",
                )
            return self.kinds[i]
        stem = self.files[i].stem.lower()
        for kind, words in _WORDS.items():
            if any(word in stem for word in words):
                return kind
        raise UsageError(
            f"The kind of the test in {self.files[i]} is not known.",
            why="The file's name does not say it.",
            fix=f"Give --test with one of {', '.join((*KINDS, *_SIDES))}.",
        )

    def stretch_test(self, i: int, kind: str) -> Any:
        """Return the record of a file with stresses, or with load and extension of a specimen of known size."""
        from palpate.physics.materials import StretchTest

        table = self._read(i)
        (what, column), (held, other) = checks.gather(
            [partial(self._deformation, table), partial(self._stress, table)]
        )
        amount = table.values(column.name, _UNITS[what])
        self._check_percent(table, column, what, amount)
        stress = table.values(other.name, _UNITS[held])
        if what == "extension":
            amount = amount / _of_file(self.heights, i, len(self.files), "--height")
        if held == "force":
            stress, held = stress / _of_file(self.areas, i, len(self.files), "--area"), "nominal"
        good = np.isfinite(amount) & np.isfinite(stress)
        amount, stress, lines = amount[good], stress[good], table.lines[good]
        if what != "stretch":
            amount, stress = self._signed(i, (column, amount), (other, stress))
        rows = self._cycle(i, amount - 1 if what == "stretch" else amount, lines)
        label, made = f"{kind} ({self.files[i].name})", StretchTest
        measure: Any = self._measure(table, other, held)
        mode: Any = kind
        if what == "stretch":
            return made(mode, amount[rows], stress[rows], measure, label)
        log = what == "log strain"
        return made.of_strain(mode, amount[rows], stress[rows], measure, logarithmic=log, name=label)

    def indentation(self, i: int, sizes: dict[str, float]) -> IndentationTest:
        """Return the record of a ball on a slab, whose sizes are given in m."""
        from palpate.physics.materials import IndentationTest

        table = self._read(i)
        what, column = self._column(table, "depth", "extension")
        depth, force = table.values(column.name, "m"), table.values(self._column(table, "force")[1].name, "N")
        if what == "extension":
            self.notes.append(
                f"{table.path.name}: {column.name!r} is taken for the depth from the first contact on."
            )
        good = np.isfinite(depth) & np.isfinite(force)
        depth, force, lines = depth[good], force[good], table.lines[good]
        rows = self._cycle(i, depth, lines)
        return IndentationTest(depth[rows], force[rows], name=self.files[i].name, **sizes)

    def relaxation(self, i: int) -> tuple[np.ndarray, np.ndarray, str]:
        """Return times in s and responses in an SI unit, and that unit."""
        table = self._read(i)
        time = table.values(self._column(table, "time")[1].name, "s")
        name = self._column(table, "stress", "force", "nominal", "true")[1].name
        response = table.values(name)
        good = np.isfinite(time) & np.isfinite(response)
        return time[good], response[good], table.si_unit(name)

    def _read(self, i: int) -> Table:
        table = read_table(self.files[i], **(self.options or {}))
        self.notes.extend(f"{table.path.name}: {note}" for note in table.notes)
        return table

    def _deformation(self, table: Table) -> tuple[str, Column]:
        """Return what tells the deformation, and its column."""
        if self.heights:
            return self._column(table, "extension")
        more = (
            "" if not _columns_of(table, "extension") else "Or give the undeformed length: --height '25 mm'."
        )
        return self._column(table, "stretch", "strain", "log strain", more=more)

    def _stress(self, table: Table) -> tuple[str, Column]:
        """Return what tells the stress, and its column."""
        if self.areas:
            return self._column(table, "force")
        more = "" if not _columns_of(table, "force") else "Or give the undeformed section: --area '12 mm^2'."
        return self._column(table, "nominal", "true", "stress", more=more)

    def _measure(self, table: Table, column: Column, held: str) -> str:
        """Return the measure of a stress: the one that is said, else that of the column's name."""
        if self.measure is not None:
            return self.measure
        if held == "stress":
            raise UsageError(
                f"{table.path}: whether the column {column.name!r} holds nominal or true stress is not known.",
                why="At a stretch of 2 they differ by a factor of 2.",
                fix="Give --measure nominal (force over undeformed area) or --measure true.",
            )
        quantity = named_quantity(column.name)
        if held == "nominal" and quantity is not None and quantity.kind == "stress" and not quantity.measure:
            self.notes.append(
                f"{table.path.name}: {column.name!r} is taken as nominal stress, force over the undeformed area, as "
                "testing machines compute it; --measure true says otherwise."
            )
        return held

    def _column(self, table: Table, *wanted: str, more: str = "") -> tuple[str, Column]:
        """Return what a column holds, and the column: that of --column, else of the first of `wanted` there is.

        The words of --column are WHAT=NAME.
        """
        given = {}
        for word in self.columns:
            what, mark, name = word.partition("=")
            if not mark or what.strip() not in _UNITS:
                raise UsageError(
                    f"{word!r} is no column of a test.", fix=f"Write WHAT=NAME with {', '.join(_UNITS)}."
                )
            given[what.strip()] = name.strip()
        for what in wanted:
            if what in given:
                column = table.column(given[what])
                return _what(column) if what == "stress" and _what(column) in {
                    "nominal",
                    "true",
                } else what, column
        for what in wanted:
            found = _columns_of(table, what)
            if len(found) > 1:
                names = " and ".join(repr(column.name) for column in found)
                raise UsageError(
                    f"{table.path}: {names} are both {what}.",
                    why="Which one is of this specimen can't be known.",
                    fix=f'Name it: --column "{what}={found[0].name}".',
                )
            if found:
                return what, found[0]
        fits = _fitting(table, wanted)
        advice = [f'Name it: --column "{what}={name}".' for what, name in fits] or [
            f'Name it: --column "{wanted[0]}=NAME".' if not more else ""
        ]
        raise UsageError(
            f"{table.path} has no column of {' or '.join(wanted)} that is known by its name.",
            why=f"Its columns are {', '.join(map(repr, table.names))}.",
            fix=" ".join(filter(None, [more, *advice[:1]])),
        )

    def _check_percent(self, table: Table, column: Column, what: str, amount: np.ndarray) -> None:
        """Refuse a strain without a unit that may be in per cent."""
        if what == "strain" and not column.unit and np.nanmax(np.abs(amount), initial=0.0) > _PERCENT:
            raise UsageError(
                f"{table.path}: {column.name!r} goes to {np.nanmax(np.abs(amount)):g} and has no unit.",
                why="It may be a strain, or per cent of one.",
                fix=f'Say which: --unit "{column.name}=%" or --unit "{column.name}=1".',
            )

    def _signed(
        self, i: int, first: tuple[Column, np.ndarray], second: tuple[Column, np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return strain and stress with tension positive; compression is negative, however the machine writes it."""
        by_name = [
            c for c, _ in (first, second) if (q := named_quantity(c.name)) and q.direction == "compressive"
        ]
        if not by_name and self._stated(i) != "compression":
            return first[1], second[1]
        turned = [column.name for column, values in (first, second) if _is_positive(values)]
        if turned:
            names = " and ".join(map(repr, turned))
            what = f"{by_name[0].name!r}" if by_name else "the test"
            self.notes.append(
                f"{self.files[i].name}: {names} {'is' if len(turned) == 1 else 'are'} positive, and {what} is of "
                "compression: taken with the other sign."
            )
        a, b = (-values if _is_positive(values) else values for _, values in (first, second))
        return a, b

    def _cycle(self, i: int, deformation: np.ndarray, lines: np.ndarray) -> np.ndarray:
        """Return the rows of the cycle that is fitted."""
        from palpate.physics.materials.load_cycles import rows_of_cycle

        rows, note = rows_of_cycle(deformation, self.cycle)
        if note:
            where = by_number("line", [int(lines[rows[0]])]) + f" to {lines[rows[-1]]}"
            self.notes.append(f"{self.files[i].name}: {note} ({where}.)")
        return rows


def _of_file(values: Sequence[float], i: int, count: int, option: str) -> float:
    """Return the value of a file, where there is one for all, or one for each."""
    if len(values) not in {1, count}:
        raise UsageError(
            f"{option} is given {len(values)} times for {count} files.",
            fix="Give it once for all, or once for each file, in their order.",
        )
    return values[i if len(values) > 1 else 0]


def _what(column: Column) -> str:
    """Return what a column holds by its name, "" where that is not known."""
    for name in (column.name, *column.aliases):
        if (quantity := named_quantity(name)) is None:
            continue
        if quantity.kind == "strain":
            return "log strain" if quantity.measure == "true" else "strain"
        if quantity.kind == "stress":  # machines call force over the first area tensile or compressive stress
            return quantity.measure or ("nominal" if quantity.direction else "stress")
        return quantity.kind
    return ""


def _columns_of(table: Table, what: str) -> list[Column]:
    return [column for column in table.columns if _what(column) == what]


def _fitting(table: Table, wanted: Sequence[str]) -> list[tuple[str, str]]:
    """Return columns of the right unit whose names say nothing else, each with what it may hold; stated units first."""
    found = []
    for column in table.columns:
        try:
            unit = table.si_unit(column.name)
        except FileFormatError:  # a unit that is not known, or a name that is there twice
            continue
        what = next((w for w in wanted if _UNITS[w] == unit), "")
        what = "strain" if what == "stretch" and column.unit == "%" else what
        if (
            what
            and not _what(column)
            and np.isfinite(table.numerals.values(table.cells[column.position - 1])).any()
        ):
            found.append((not column.unit, what, column.name))
    return [(what, name) for _, what, name in sorted(found, key=lambda entry: entry[0])]


def _is_positive(values: np.ndarray) -> bool:
    """Return true of values that are positive but for noise."""
    return bool(len(values) and values.max() > 0 and values.min() > -_STRAY * values.max())
