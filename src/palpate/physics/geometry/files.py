"""Files of shapes: their place, content and unit."""

from __future__ import annotations

import contextlib
import hashlib
import io
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import FileFormatError, UsageError

__all__ = ["UNITS", "digest_of", "read_with_meshio", "require_same", "require_unit"]

UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 1e-3, "um": 1e-6, "in": 0.0254}


def require_unit(unit: Any) -> None:
    """Refuse an unknown unit of length."""
    if unit not in UNITS:
        raise UsageError(
            f"The unit of a file is {unit!r}.",
            why=f"Units of length are {', '.join(UNITS)}.",
            fix='Pass unit="mm" if the file is in millimetres.',
        )


def digest_of(path: str) -> str:
    """SHA-256 of a file's content, as hexadecimal digits.

    Raises
    ------
    UsageError
        If there is no such file.
    FileFormatError
        If it is empty.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise UsageError(
            f"The file {path} can't be read.",
            why=f"{error.strerror}.",
            fix="Check the path; a relative one starts from the directory of the running program.",
        ) from error
    if not content.strip():
        raise FileFormatError(
            f"The file {path} is empty.", why="It has no content.", fix="Export the shape again."
        )
    return hashlib.sha256(content).hexdigest()


def require_same(path: str, digest: str) -> None:
    """Refuse a file whose content is no longer the one that the body was made from."""
    if digest_of(path) != digest:
        raise UsageError(
            f"The file {path} has changed.",
            why="Its content is not the one that this body was made from.",
            fix="Make the body anew from the file as it is now.",
        )


def read_with_meshio(path: str) -> Any:
    """Read a file of a mesh.

    Returns
    -------
    meshio.Mesh

    Raises
    ------
    FileFormatError
        If the format is unknown or the file corrupt.
    """
    import struct
    from xml.etree.ElementTree import ParseError

    import meshio

    try:
        # Where no reader takes the file, meshio prints and ends the program. Its reader of STL takes four letters
        # of an ASCII file for a count, which may overflow: no harm.
        silent = io.StringIO()
        with (
            contextlib.redirect_stdout(silent),
            contextlib.redirect_stderr(silent),
            np.errstate(over="ignore"),
        ):
            return meshio.read(path)
    except (meshio.ReadError, SystemExit, struct.error, ParseError) as error:
        raise _unreadable(path, error) from error
    except (
        ValueError,
        KeyError,
        IndexError,
        TypeError,
        AssertionError,
        AttributeError,
        OSError,
        EOFError,
    ) as error:
        raise _unreadable(path, error) from error


def _unreadable(path: str, error: BaseException) -> FileFormatError:
    said = str(error).strip() or type(error).__name__
    said = "no reader of meshio takes it" if isinstance(error, SystemExit) else said
    return FileFormatError(
        f"The file {path} can't be read as a mesh.",
        why=f"It is corrupt, cut short or of another format than its name says ({said}).",
        fix="Open it in the program that made it and export it again, as VTU, MSH or STL for example.",
    )
