"""Columns of measured indentation: what may stand in one, and which of them make a measurement.

    t                    time, optional
    x y z                the probe's centre
    Fx Fy Fz             force on the probe; or only one of them
    depth F              instead: how far the probe went in from first touch, and the force against it, at a place x y z

Case does not matter.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from palpate.dataset.measured.units import FORCES, LENGTHS, TIMES, UnitError, in_si
from palpate.errors import UsageError

__all__ = ["NAMES", "Columns", "number"]

_TIME, _PLACE, _FORCE, _PRESSED = "t", ("x", "y", "z"), ("fx", "fy", "fz"), ("depth", "f")
NAMES = (_TIME, *_PLACE, *_FORCE, *_PRESSED)
_KINDS = {
    **dict.fromkeys((*_PLACE, "depth"), (LENGTHS, "length")),
    **dict.fromkeys((*_FORCE, "f"), (FORCES, "force")),
    _TIME: (TIMES, "time"),
}


@dataclass(frozen=True)
class Columns:
    """Names of the columns in order, and how much of SI each of their units is.

    Attributes
    ----------
    names : tuple of str
        In lower case.
    scales : tuple of float
    """

    names: tuple[str, ...]
    scales: tuple[float, ...]

    @classmethod
    def of(cls, names: Sequence[str], units: Mapping[str, str], *, placed: bool = False) -> Columns:
        """From names as written and the unit of each; `placed` where the place of a depth is known already.

        Raises
        ------
        UsageError
            If a column is unknown, named twice or without a unit, or they make no measurement.
        """
        lower = tuple(name.strip().lower() for name in names)
        known = {name.strip().lower(): unit.strip() for name, unit in units.items()}
        for number_, (name, written) in enumerate(zip(lower, names, strict=True), 1):
            if name not in NAMES or lower.index(name) != number_ - 1:
                raise UsageError(
                    f"Column {number_} is called {written.strip()!r}"
                    + (", as another is." if name in NAMES else ", which is no measured quantity."),
                    fix="Columns are t (optional), x, y, z and Fx, Fy, Fz or one of them; or depth and F at a place.",
                )
            if not known.get(name):
                raise UnitError(
                    f"Column {number_}, {written.strip()!r}, has no unit.",
                    why="Metres and millimetres differ by what a correction would take for another specimen.",
                    fix="Name it, for example: x [mm].",
                )
        scales = tuple(in_si(known[name], *_KINDS[name]) for name in lower)
        columns = cls(lower, scales)
        columns._check(placed)
        return columns

    @property
    def pressed(self) -> bool:
        """Whether depths at a place were measured and not positions."""
        return "depth" in self.names

    def values(self, cells: Sequence[str]) -> dict[str, float]:
        """Numbers of one row, in SI units, by name.

        Raises
        ------
        UsageError
            If there are too many or too few cells, or one of them is no finite number.
        """
        if len(cells) != len(self.names):
            raise UsageError(
                f"{len(cells)} values stand where {len(self.names)} belong.",
                fix=f"One for each of {' '.join(self.names)}.",
            )
        found = {}
        for i, (name, scale, cell) in enumerate(zip(self.names, self.scales, cells, strict=True), 1):
            value = number(cell)
            if value is None:
                raise UsageError(
                    f"Column {i} ({name}) holds {cell.strip()[:40]!r}, which is no finite number.",
                    fix="Write a decimal point; leave out rows in which a sensor said nothing.",
                )
            found[name] = scale * value
        return found

    def _check(self, placed: bool) -> None:
        own = set(self.names) - {_TIME}
        forces = own & set(_FORCE)
        whole = own - forces == set(_PLACE) and len(forces) in {1, 3}
        pressed = own in ({*_PRESSED, *_PLACE}, set(_PRESSED)) and (placed or set(_PLACE) <= own)
        if not (whole or pressed):
            raise UsageError(
                f"Columns {' '.join(self.names)} make no measurement.",
                why="A measurement is a position with a force, or a depth with the force against it, at a place.",
                fix="Give x y z with Fx Fy Fz or one of them; or depth F with x y z, or with a `place` in the sidecar.",
            )


def number(text: str) -> float | None:
    """A finite decimal number, or None."""
    text = text.strip()
    if not text or not set(text) <= set("0123456789+-.eE"):
        return None
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
