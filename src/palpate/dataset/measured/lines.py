"""A line protocol for a live sensor: text, one measurement a line, over anything that carries lines.

::

    palpate 1 length=mm force=N time=s                 first: units, always named
    # anything after a hash is skipped
    0.010 50.0 50.0 59.5 0.001 -0.002 0.013            t x y z Fx Fy Fz
    end                                                or close the stream

``columns=x,y,z,fz`` in the greeting says that other columns come, as `columns` knows them (no pressed depths). The
greeting is answered by ``ok`` and the columns. A line that can't be taken is answered by ``error line N: …`` and
skipped; before a greeting that is every line. Good lines are not answered.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from palpate.dataset.measured.columns import Columns
from palpate.dataset.measured.record import Measured
from palpate.errors import UsageError

__all__ = ["VERSION", "greeting", "measurements"]

VERSION = "1"
_DEFAULT = "t,x,y,z,fx,fy,fz"
_LENGTHS, _FORCES = ("x", "y", "z"), ("fx", "fy", "fz")
_EXAMPLE = f"palpate {VERSION} length=mm force=N time=s"


def measurements(lines: Iterable[str], answer: Callable[[str], None]) -> Iterator[Measured]:
    """One measurement for each good line, until the lines end or say so."""
    columns: Columns | None = None
    told = False
    for at, line in enumerate(lines, 1):
        words = line.split("#", 1)[0].replace(",", " ") if columns else line.split("#", 1)[0]
        cells = words.split()
        if not cells:
            continue
        if cells == ["end"]:
            return
        try:
            if columns is None:
                columns = greeting(cells)
                answer(f"ok {' '.join(columns.names)}")
                continue
            row = columns.values(cells)
        except UsageError as error:
            if columns is None and cells[0] != "palpate":  # of data without a greeting one line tells enough
                if told:
                    continue
                told = True
            answer(f"error line {at}: {error.what} {error.fix}".rstrip())
            continue
        yield Measured.of([row])


def greeting(words: list[str]) -> Columns:
    """The columns that a greeting announces.

    Raises
    ------
    UsageError
        If it is none, of another version, or lacks a unit.
    """
    if words[:2] != ["palpate", VERSION]:
        raise UsageError("Units come first.", fix=f"Begin with: {_EXAMPLE}")
    pairs = [word.partition("=")[::2] for word in words[2:]]
    said = dict(pairs)
    if len(said) != len(pairs) or not said.keys() <= {"length", "force", "time", "columns"}:
        raise UsageError(
            "A greeting names length, force, time and columns, once.", fix=f"Such as: {_EXAMPLE}"
        )
    names = said.get("columns", _DEFAULT).split(",")
    if "depth" in names:
        raise UsageError("Pressed depths come in files only.", fix="Send positions: x, y, z.")
    units = {n: said.get("length", "") for n in _LENGTHS} | {n: said.get("force", "") for n in _FORCES}
    return Columns.of(names, units | {"t": said.get("time", "")})
