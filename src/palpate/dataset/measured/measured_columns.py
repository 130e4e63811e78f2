"""Measurements on a specimen in SI units, and the columns that make one.

    t                    time, optional
    x y z                the probe's centre
    Fx Fy Fz             force on the probe; or only one of them
    depth F              instead: how far the probe went in from first touch, and the force against it, at a place x y z

Case does not matter. Units are few and always named: a guessed one would be taken for another specimen.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.tables import plain_unit
from palpate.units import parse_quantity

__all__ = ["NAMES", "Columns", "Measurements", "UnitError", "number"]

_TIME, _PLACE, _FORCE, _PRESSED = "t", ("x", "y", "z"), ("fx", "fy", "fz"), ("depth", "f")
NAMES = (_TIME, *_PLACE, *_FORCE, *_PRESSED)

_LENGTH = ("length", "m", ("m", "cm", "mm", "um", "µm"))  # quantity, SI unit, spellings taken
_NEWTONS = ("force", "N", ("N", "mN", "kN", "gf", "kgf"))
_SECONDS = ("time", "s", ("s", "ms", "us", "µs"))
_UNITS = {
    **dict.fromkeys((*_PLACE, "depth"), _LENGTH),
    **dict.fromkeys((*_FORCE, "f"), _NEWTONS),
    _TIME: _SECONDS,
}


class UnitError(UsageError):
    """A column's unit is missing or unknown; the error names the line on which units stand."""


@dataclass(frozen=True, eq=False)
class Measurements:
    """N measurements on one specimen.

    Attributes
    ----------
    position : (N, 3)
        The probe's centre, m. Of a pressed depth: the place on the surface, see `depth`.
    force : (N, 3)
        Force on the probe, N. Of a pressed depth the force against it stands along −direction.
    along : (N, 3)
        Unit vector of the only component measured; zeros where all three were.
    depth : (N,)
        Depth from first touch in m, where depths were measured; not-a-number elsewhere.
    time : (N,)
        Time in s; not-a-number where it is not known.
    notes : tuple of str
        Sentences on what of a file was left out, or taken for something.
    """

    position: np.ndarray
    force: np.ndarray
    along: np.ndarray
    depth: np.ndarray
    time: np.ndarray
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.force)

    @property
    def pressed(self) -> bool:
        """True where positions are yet to be found from depths."""
        return bool(np.isfinite(self.depth).any())

    @classmethod
    def of(
        cls,
        rows: Sequence[Mapping[str, float]],
        *,
        place: Sequence[float] | None = None,
        direction: Sequence[float] = (0.0, 0.0, -1.0),
    ) -> Measurements:
        """Make measurements from rows of values by the name of their column.

        Parameters
        ----------
        rows : sequence of mappings
            For each measurement the values that its columns gave, in SI units.
        place : three numbers, optional
            Point on the surface, m, at which depths were measured; needed where the rows name none.
        direction : three numbers
            Direction of pressing, of any length; by default down.
        """
        N, d = len(rows), np.array(direction, dtype=np.float64)
        d = d / np.linalg.norm(d)
        position, force, along = np.zeros((N, 3)), np.zeros((N, 3)), np.zeros((N, 3))
        depth, time = np.full(N, np.nan), np.full(N, np.nan)
        for i, row in enumerate(rows):
            time[i] = row.get(_TIME, np.nan)
            position[i] = [row[name] for name in _PLACE] if "x" in row else place
            if "depth" in row:
                depth[i], force[i], along[i] = row["depth"], -row["f"] * d, -d
                continue
            given = [axis for axis, name in enumerate(_FORCE) if name in row]
            for axis in given:
                force[i, axis] = row[_FORCE[axis]]
            if len(given) == 1:
                along[i, given[0]] = 1.0
        return cls(position, force, along, depth, time)


@dataclass(frozen=True)
class Columns:
    """Columns of a table or a stream, in order."""

    names: tuple[str, ...]  # in lower case
    scales: tuple[float, ...]  # size of each column's unit in SI units

    @classmethod
    def of(cls, names: Sequence[str], units: Mapping[str, str], *, placed: bool = False) -> Columns:
        """Make columns from their names as written, in any case, and the unit of each.

        Units of other names are ignored. `placed` is True where the place of pressed depths is known already.
        """
        lower = tuple(name.strip().lower() for name in names)
        unit_of = {name.strip().lower(): unit.strip() for name, unit in units.items()}
        for i, (name, written) in enumerate(zip(lower, names, strict=True), 1):
            if name not in NAMES or lower.index(name) != i - 1:
                raise UsageError(
                    f"Column {i} is called {written.strip()!r}"
                    + (", as another is." if name in NAMES else ", which is no measured quantity."),
                    fix="Columns are t (optional), x, y, z and Fx, Fy, Fz or one of them; or depth and F at a place.",
                )
            if not unit_of.get(name):
                raise UnitError(
                    f"Column {i}, {written.strip()!r}, has no unit.",
                    why="Metres and millimetres differ by what a correction would take for another specimen.",
                    fix="Name it, for example: x [mm].",
                )
        columns = cls(lower, tuple(_scale(unit_of[name], *_UNITS[name]) for name in lower))
        columns._check(placed)
        return columns

    @property
    def pressed(self) -> bool:
        """True where the columns give depths at a place, not positions."""
        return "depth" in self.names

    def values(self, cells: Sequence[str]) -> dict[str, float]:
        """Read the numbers of one row, in SI units, by name."""
        if len(cells) != len(self.names):
            raise UsageError(
                f"{len(cells)} values stand where {len(self.names)} belong.",
                fix=f"One for each of {' '.join(self.names)}.",
            )
        row = {}
        for i, (name, scale, cell) in enumerate(zip(self.names, self.scales, cells, strict=True), 1):
            value = number(cell)
            if value is None:
                raise UsageError(
                    f"Column {i} ({name}) holds {cell.strip()[:40]!r}, which is no finite number.",
                    fix="Write a decimal point; leave out rows in which a sensor said nothing.",
                )
            row[name] = scale * value
        return row

    def _check(self, placed: bool) -> None:
        own = set(self.names) - {_TIME}
        forces = own & set(_FORCE)
        positions = own - forces == set(_PLACE) and len(forces) in {1, 3}
        depths = own in ({*_PRESSED, *_PLACE}, set(_PRESSED)) and (placed or set(_PLACE) <= own)
        if not (positions or depths):
            raise UsageError(
                f"Columns {' '.join(self.names)} make no measurement."
                if self.names
                else "No column has the name of something measured.",
                why="A measurement is a position with a force, or a depth with the force against it, at a place.",
                fix="Give x y z with Fx Fy Fz or one of them; or depth F with x y z, or with a `place` in the sidecar.",
            )


def number(text: str) -> float | None:
    """Read a finite decimal number of a line of text; None if the text is none."""
    text = text.strip()
    if not text or not set(text) <= set("0123456789+-.eE"):
        return None
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _scale(unit: str, quantity: str, si_unit: str, spellings: Sequence[str]) -> float:
    unit = plain_unit(unit)
    if unit not in spellings:
        raise UnitError(
            f"{unit!r} is no unit of {quantity}.",
            why="Units are written as they are here, and never guessed.",
            fix=f"Use one of {', '.join(spellings)}.",
        )
    return parse_quantity(f"1 {unit}", si_unit)
