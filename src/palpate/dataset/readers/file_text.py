"""Text files of other programs: their bytes decoded, and their numbers read."""

from __future__ import annotations

import codecs
from pathlib import Path

from palpate.dataset.readers.results import refuse
from palpate.errors import FileFormatError
from palpate.input_files import open_input, plain_text, read_input

__all__ = ["head_of", "read_bytes", "read_lines", "to_number"]

_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


def read_bytes(path: Path) -> bytes:
    """Read a whole file; one that is empty or larger than 4 GB is refused."""
    content = read_input(path)
    if not content.strip():
        raise refuse(path, None, "the file is empty.")
    return content


def read_lines(path: Path) -> list[str]:
    """Read a text file as lines: UTF-8, UTF-16 with its mark, otherwise Latin-1."""
    content = read_bytes(path)
    encoding = next((name for mark, name in _MARKS if content.startswith(mark)), "utf-8")
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    if "\0" in text:
        raise refuse(
            path,
            text[: text.index("\0")].count("\n") + 1,
            "the file holds bytes that are no text.",
            fix="Export the results as text.",
        )
    return plain_text(text).splitlines()


def head_of(path: Path, size: int = 4096) -> str:
    """Return the beginning of a file as text, "" where it can't be read; for telling its format."""
    try:
        with open_input(path) as file:
            content = file.read(size)
    except (FileFormatError, OSError):
        return ""
    encoding = next((name for mark, name in _MARKS if content.startswith(mark)), "utf-8")
    return content.decode(encoding, errors="replace")


def to_number(text: str, *, decimal_comma: bool = False) -> complex | None:
    """Return the number that a cell holds, real or complex; None where it holds none."""
    text = text.strip().strip('"')
    if decimal_comma:
        text = text.replace(",", ".")
    try:
        return float(text)
    except ValueError:
        pass
    try:
        return complex(text.replace("i", "j"))
    except ValueError:
        return None
