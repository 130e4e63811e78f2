"""Files of a case made of templates: ``{{ power | W }}`` is replaced by the value of the input in that unit.

Nothing is computed in a template: a name, and a unit where the value has one. Files that are no text, and those that
the study names as `raw`, are copied as they are. A name of a file may hold ``{case}``.
"""

from __future__ import annotations

import fnmatch
import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from palpate.checks import did_you_mean
from palpate.errors import UsageError
from palpate.files import system_errors
from palpate.input_files import read_input
from palpate.units import Range

__all__ = ["DIGITS", "TemplateFiles", "fill_words"]

DIGITS = 12
"""Significant digits of a number in a template: with sign and exponent it fits the 20 columns that CalculiX reads."""

_MARK = re.compile(r"\{\{(?P<inside>.*?)\}\}", re.DOTALL)
_INSIDE = re.compile(r"^\s*(?P<name>[^|{}]+?)\s*(?:\|\s*(?P<unit>[^|{}]*?)\s*)?$")
_WORD = re.compile(r"\{(\w*)\}")
_MOST_FILES = 1000  # files of a folder of templates; more are a folder that was named by mistake


@dataclass(frozen=True)
class TemplateFiles:
    """A folder of templates, with its subfolders."""

    folder: Path
    raw: tuple[str, ...] = ()  # patterns of the names of files that are copied without a look into them
    digits: int = DIGITS  # significant digits of numbers

    def paths(self) -> list[Path]:
        """Return the paths of all files, below the folder and in the order of their names."""
        if not self.folder.is_dir():
            raise UsageError(
                f"There is no folder {self.folder}.",
                why="The templates of the solver's files stand in it.",
                fix="Correct `templates` in [solver].",
            )
        files = sorted(path for path in self.folder.rglob("*") if path.is_file())
        if not files or len(files) > _MOST_FILES:
            raise UsageError(
                f"The folder of templates {self.folder} holds {len(files) or 'no'} files.",
                why=f"It is copied for each case, with at most {_MOST_FILES} files.",
                fix="Put the solver's input files there, and nothing else.",
            )
        return [path.relative_to(self.folder) for path in files]

    def hashes(self) -> dict[str, str]:
        """Return the SHA-256 of each file by its name."""
        return {path.as_posix(): _digest(read_input(self.folder / path)) for path in self.paths()}

    def check(self, values: Sequence[Range], constants: Mapping[str, tuple[float, str]]) -> None:
        """Refuse templates that can't be filled, and inputs that no template names.

        `constants` are further values with their SI units.
        """
        units = {r.name: r.unit for r in values} | {name: unit for name, (_, unit) in constants.items()}
        used = set()
        for path in self.paths():
            _fill(path.name, {"case": ""}, f"The name of the template {path}")
            text = self._text(path)
            for match in _MARK.finditer(text or ""):
                used.add(_conversion(match, units, self.folder / path, text or "")[0])
        unused = [r.name for r in values if r.name not in used]
        if unused:
            raise UsageError(
                f"No template in {self.folder} names the input {unused[0]!r}.",
                why="Its value would not reach the solver, and the answers would not vary with it.",
                fix=f"Write {{{{ {unused[0]} | {units[unused[0]] or '1'} }}}} where its value belongs.",
            )

    def write(self, target: Path, case: str, values: Mapping[str, tuple[float, str]]) -> None:
        """Write the files of a case into the folder `target`; `values` are SI values with their units by name."""
        units = {name: unit for name, (_, unit) in values.items()}

        def number(match: re.Match[str]) -> str:
            name, factor, offset = _conversion(match, units, path, text or "")
            return f"{(values[name][0] - offset) / factor:.{self.digits}g}"

        for path in self.paths():
            text = self._text(path)
            place = target / path.with_name(path.name.replace("{case}", case))
            with system_errors(f"The file {place} could not be written."):
                place.parent.mkdir(parents=True, exist_ok=True)
                content = read_input(self.folder / path)
                place.write_bytes(content if text is None else _MARK.sub(number, text).encode())
                place.chmod((self.folder / path).stat().st_mode & 0o777)

    def _text(self, path: Path) -> str | None:
        """Return the text of a template; None of a file that is copied as it is."""
        if any(fnmatch.fnmatch(path.as_posix(), pattern) for pattern in self.raw):
            return None
        content = read_input(self.folder / path)
        try:
            return None if b"\0" in content else content.decode()
        except UnicodeDecodeError:
            return None


def _conversion(
    match: re.Match[str], units: Mapping[str, str], path: Path, text: str
) -> tuple[str, float, float]:
    """Return the name that stands in a mark, and factor and offset from its unit to the SI unit of the value."""
    from palpate.tables.unit_names import plain_unit
    from palpate.unit_text import si_conversion

    where = f"{path}, line {text.count(chr(10), 0, match.start()) + 1}"
    parts = _INSIDE.match(match["inside"])
    if parts is None:
        raise UsageError(
            f"{where}: {match[0]!r} is no name with a unit.",
            why="A template takes values and computes nothing.",
            fix="Write {{ name | unit }}, or name the file in `raw` where its braces mean something else.",
        )
    name, unit = parts["name"], parts["unit"]
    if name not in units:
        near = did_you_mean(name, list(units))
        raise UsageError(
            f"{where}: the template names {name!r}, which has no value.",
            why=f"Inputs and values of the study are {', '.join(units) or 'none'}.",
            fix=near or "Add it to [[inputs]] or [values], or name the file in `raw`.",
        )
    if not unit and units[name]:
        raise UsageError(
            f"{where}: the unit of {name!r} is missing.",
            why=f"It is a quantity in {units[name]}, and the solver's files have units of their own.",
            fix=f"Write {{{{ {name} | {units[name]} }}}}, in the unit that the solver's file wants.",
        )
    factor, offset, si = si_conversion(plain_unit(unit or ""))
    if si != units[name]:
        raise UsageError(
            f"{where}: {name!r} can't be written in {unit or 'pure numbers'}.",
            why=f"It is a quantity in {units[name] or 'pure numbers'}.",
            fix="Correct the unit in the template, or that of the range in [[inputs]].",
        )
    return name, factor, offset


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def fill_words(words: Sequence[str], known: Mapping[str, str], what: str) -> list[str]:
    """Return words with ``{case}`` and the like replaced; `what` names them for messages."""
    return [_fill(word, known, what) for word in words]


def _fill(word: str, known: Mapping[str, str], what: str) -> str:
    unknown = [name for name in _WORD.findall(word) if name not in known]
    if unknown:
        raise UsageError(
            f"{what} says {word!r}.",
            why=f"{{{unknown[0]}}} stands for nothing.",
            fix=f"What can stand there: {', '.join(f'{{{name}}}' for name in known)}.",
        )
    return _WORD.sub(lambda match: known[match[1]], word)
