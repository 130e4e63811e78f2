"""Files that are read: all are opened by one function, which refuses what is no file or has no end.

::

    open_input     a file for reading in bytes
    read_input     all bytes of a file
    require_input  the check alone, for libraries that open a file by its name
    read_toml      the content of a TOML file, its texts plain
    plain_text     a text without marks that a reader or a terminal would obey in place of showing them
    plain_texts    the same for all texts in a value of JSON or TOML

A named pipe that nobody writes to would wait for ever, a device such as ``/dev/zero`` has no end, and opening some
devices does something.
"""

from __future__ import annotations

import os
import re
import stat
import struct
import tomllib
import zipfile
import zlib
from collections.abc import Mapping
from typing import Any, BinaryIO, TypeVar

from palpate.errors import FileFormatError, ResourceError

__all__ = [
    "DAMAGE",
    "LARGEST",
    "open_input",
    "plain_text",
    "plain_texts",
    "read_input",
    "read_toml",
    "require_input",
]

LARGEST = 4_000_000_000
"""Number of bytes of the largest file that is read whole."""
DAMAGE = (
    OSError,
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    ArithmeticError,
    AssertionError,
    RuntimeError,  # recursion, a packing that is not known
    SyntaxError,  # of XML
    MemoryError,
    EOFError,
    struct.error,
    zlib.error,
    zipfile.BadZipFile,
)
"""Kinds of errors that libraries raise on broken bytes."""
_TOML_LARGEST = 2_000_000  # bytes: a study has some thousands
_DEEP_KEY = re.compile(r"""^[ \t\[]*[\w"'-]+([ \t]*\.[ \t]*[\w"'-]+){64}""", re.MULTILINE)
_GROWTH = 64_000_000  # bytes more than its stated size that a file may have: those of /proc state none
_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a named pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)
# Unicode's marks of direction (UAX 9): text after them is shown in another order than it stands
_DIRECTIONS = re.compile("[\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]")
_HIDDEN = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff\ufffe\uffff]")
Value = TypeVar("Value")


def open_input(path: str | os.PathLike[str], *, largest: int = LARGEST) -> BinaryIO:
    """Open a file for reading, in bytes; links are followed.

    A folder, a pipe, a device or a socket is refused, and a file of more than `largest` bytes.
    """
    try:
        _require_regular(path, os.stat(path), largest)  # before it is opened: some devices act on that
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        file = os.fdopen(handle, "rb")
        try:
            _require_regular(path, os.fstat(file.fileno()), largest)
        except BaseException:
            file.close()
            raise
    except (OSError, ValueError) as error:  # a name with a zero byte is of the second kind
        said = getattr(error, "strerror", None) or error
        raise FileFormatError(
            f"{path} can't be read.", why=f"{said}.", fix="Give the path of a file."
        ) from error
    return file


def read_input(path: str | os.PathLike[str], *, largest: int = LARGEST) -> bytes:
    """Read a whole file, as `open_input` opens it; one that grows meanwhile, or exceeds the free memory, is refused."""
    with open_input(path, largest=largest) as file:
        size = os.fstat(file.fileno()).st_size
        if size > _GROWTH:
            _require_memory(path, size)
        try:
            content = file.read(size + _GROWTH + 1)
        except OSError as error:
            raise FileFormatError(
                f"{path} can't be read.", why=f"{error.strerror}.", fix="Check the disk."
            ) from error
    if len(content) > min(size + _GROWTH, largest):
        raise FileFormatError(
            f"{path} has no end.", why="It grows while it is read.", fix="Copy it first, and read the copy."
        )
    return content


def require_input(path: str | os.PathLike[str], *, largest: int = LARGEST) -> None:
    """Refuse what `open_input` refuses."""
    open_input(path, largest=largest).close()


def read_toml(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a TOML file; its texts are plain, see `plain_text`."""
    try:
        text = read_input(path, largest=_TOML_LARGEST).decode()
        if _DEEP_KEY.search(text):  # which takes the parser minutes
            raise RecursionError  # noqa: TRY301 - said as of nested lists
        return dict(plain_texts(tomllib.loads(text)))
    except UnicodeDecodeError as error:
        raise FileFormatError(
            f"{path} can't be read as TOML.", why=f"{error}.", fix="Save it as a text in UTF-8."
        ) from error
    except RecursionError as error:
        raise FileFormatError(
            f"{path} is not valid TOML.", why="It is nested too deep.", fix="Write it with fewer levels."
        ) from error
    except ValueError as error:  # of tomllib, or of a whole number with too many digits
        fix = _way_to_toml(str(error), text)
        raise FileFormatError(f"{path} is not valid TOML.", why=f"{error}.", fix=fix) from error


def _way_to_toml(message: str, text: str) -> str:
    """Return what makes TOML of a text of which its reader says `message`."""
    if "overwrite" in message:
        return "A key or a table stands there twice: keep one."
    number = re.search(r"at line ([0-9]+)", message)
    line = text.split("\n")[int(number[1]) - 1] if number else ""
    if re.search(r"= *[-+]?[0-9]+,[0-9]+ *(#|$)", line.strip()):
        return "A number without quotes has a decimal point: 0.45, not 0,45."
    return "Correct that line."


def plain_text(text: str) -> str:
    r"""Return a text that shows as it stands.

    Marks of direction are left out. Control characters but tab and line feed, and halves of characters, which no
    encoding takes, become their escapes, such as ``\x1b``.
    """
    if text.isascii() and text.isprintable():
        return text
    return _HIDDEN.sub(_escape, _DIRECTIONS.sub("", text).replace("\r\n", "\n"))


def plain_texts(value: Value) -> Value:
    """Return a value of JSON or TOML in which each text is plain, see `plain_text`."""
    plain: Any = value
    if isinstance(value, str):
        plain = plain_text(value)
    elif isinstance(value, Mapping):
        plain = {plain_texts(key): plain_texts(entry) for key, entry in value.items()}
    elif isinstance(value, list | tuple):
        plain = type(value)(plain_texts(entry) for entry in value)
    return plain  # type: ignore[no-any-return]


def _escape(match: re.Match[str]) -> str:
    code = ord(match[0])
    return f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}"


def _require_regular(path: str | os.PathLike[str], state: os.stat_result, largest: int) -> None:
    if not stat.S_ISREG(state.st_mode):
        kind = next((words for test, words in _KINDS if test(state.st_mode)), "no file")
        raise FileFormatError(f"{path} can't be read.", why=f"It is {kind}.", fix="Give the path of a file.")
    if state.st_size > largest:
        raise FileFormatError(
            f"{path} has {state.st_size / 1e9:.2g} GB, more than {largest / 1e9:.2g}.",
            why="It would be read into memory whole.",
            fix="Export less into it, or split it.",
        )


def _require_memory(path: str | os.PathLike[str], size: int) -> None:
    import psutil

    free = psutil.virtual_memory().available
    if size > free:
        raise ResourceError(
            f"{path} does not fit into memory.",
            why=f"It has {size / 1e9:.3g} GB, and {free / 1e9:.3g} GB are free.",
            fix="End other programs, or take a machine with more memory.",
        )
