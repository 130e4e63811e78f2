"""The text of a table's file: bytes of any usual encoding decoded, or a refusal that says what the file is instead."""

from __future__ import annotations

import codecs
import os
import re
from pathlib import Path

from palpate.errors import FileFormatError
from palpate.input_files import plain_text, read_input

__all__ = ["read_table_text"]

_MARKS = (  # longest first: the mark of UTF-16 begins that of UTF-32
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
_OTHERS = (
    (b"PK\x03\x04", "a ZIP archive", "Unpack it; a workbook's name ends in .xlsx."),
    (b"\xd0\xcf\x11\xe0", "a workbook of the old format .xls", "Save it as CSV or .xlsx."),
    (b"\x1f\x8b", "compressed by gzip", "Unpack it first."),
    (b"PAR1", "a Parquet file", "Read it with pandas.read_parquet and pass the frame, or save it as CSV."),
    (b"\x89HDF", "an HDF5 file", "Export its columns as CSV."),
    (b"%PDF", "a PDF", "Export the table as CSV."),
    (b"<html", "a web page, whatever its name says", "Save the table as CSV."),
    (b"<!DOC", "a web page, whatever its name says", "Save the table as CSV."),
    (b"<?xml", "an XML file", "Save the table as CSV."),
)
_NO_TEXT = re.compile("[\x00-\x08\x0b\x0e-\x19\x1b-\x1f\ufffe\uffff]")


def read_table_text(path: str | os.PathLike[str], encoding: str | None = None) -> tuple[str, str]:
    """Read a file as text.

    By default the encoding is that of the byte order mark; without one UTF-16 where every other byte is zero, else
    UTF-8, else Windows-1252, which contains Latin-1. Returns the text, its lines ended by a line feed, and a note
    where the encoding was not certain, else "".
    """
    path = Path(path)
    content = read_input(path)
    for magic, kind, fix in _OTHERS:
        if content[:64].lstrip()[: len(magic)].lower() == magic.lower():
            raise FileFormatError(f"{path} can't be read as a table: it is {kind}.", fix=fix)
    text, note = _decoded(path, content, encoding)
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n").rstrip("\x1a")
    if fault := _NO_TEXT.search(text):
        raise FileFormatError(
            f"{path} can't be read as text: line {text.count(chr(10), 0, fault.start()) + 1} holds the character "
            f"{fault[0]!r}.",
            why="The file is damaged, no text, or in another encoding.",
            fix="Export it as CSV in UTF-8, or name its encoding: encoding='utf-16' (--encoding).",
        )
    return plain_text(text), note


def _decoded(path: Path, content: bytes, encoding: str | None) -> tuple[str, str]:
    """Return the text, and a note where its encoding is a guess."""
    stated = encoding or next((name for mark, name in _MARKS if content.startswith(mark)), None)
    if stated is None:
        half = max(1, len(content[:4096]) // 2)
        zeros = [content[start:4096:2].count(0) / half for start in (0, 1)]
        if max(zeros) > 0.3 and min(zeros) < 0.1:
            stated = "utf-16-be" if zeros[0] > zeros[1] else "utf-16-le"
    try:
        return content.decode(stated or "utf-8"), ""
    except LookupError as error:
        raise FileFormatError(
            f"There is no encoding {encoding!r}.", fix="Such as utf-8, utf-16, latin-1, cp1252."
        ) from error
    except UnicodeDecodeError as error:
        if stated is not None:
            raise FileFormatError(
                f"{path} can't be read as text in {stated}.",
                why=f"{error.reason} at byte {error.start}.",
                fix="Name another encoding, or save it as UTF-8.",
            ) from error
        line = content.count(b"\n", 0, error.start) + 1
    try:
        text = content.decode("cp1252")
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    return text, (
        f"Line {line} is not UTF-8: read as Latin-1 (Windows-1252). Another encoding: encoding=… (--encoding)."
    )
