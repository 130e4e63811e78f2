"""Files that are written for other tools: where they may go, and which of those that are there may be replaced.

An export replaces what an earlier export wrote and nobody changed since. Anything else stays, unless its user says
otherwise. Texts end with a line that holds a checksum of all above it; other formats name palpate in their own
metadata. Tables have no such place, and are never replaced unasked.

::

    require_outputs   refuses names that can't be written to, or whose files are not palpate's to replace
    sealed            a text with the line that lets a later export replace it
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import zipfile
from collections.abc import Iterable
from pathlib import Path

from palpate.errors import UsageError

__all__ = ["is_own", "require_outputs", "seal", "with_seal"]

_COMMENTS = {
    ".h": ("/* ", " */"),
    ".c": ("/* ", " */"),
    ".cs": ("// ", ""),
    ".py": ("# ", ""),
    ".txt": ("# ", ""),
    ".m": ("% ", ""),
    **dict.fromkeys((".md", ".html", ".htm", ".pvd", ".vtu"), ("<!-- ", " -->")),
}
"""How a line of comment begins and ends, by the ending of a file's name."""

_SENTENCE = "Written by palpate; the next export replaces this file unless it was changed. Checksum "
_LAST_LINE = re.compile(rb"[^\n]*" + re.escape(_SENTENCE.encode()) + rb"([0-9a-f]{16})[^\n]*\n\Z")
_LONGEST_LINE = 200
_BINARY_HEADS = {".glb": b'"generator":"palpate"', ".onnx": b"\x12\x07palpate"}  # its field producer_name
_LIBRARIES = {".so", ".dylib", ".dll"}


def require_outputs(
    files: Iterable[str | os.PathLike[str]],
    *,
    endings: tuple[str, ...] = (),
    folder: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
) -> None:
    """Refuse files that can't be written, or that are there and are not palpate's to replace.

    Parameters
    ----------
    files : iterable of path
        Files that are about to be written.
    endings : tuple of str
        Endings of which each file has one, such as ``".fmu"``; by default any.
    folder : path, optional
        Folder of the files that the export makes itself; by default the files lie in folders that exist.
    overwrite : bool
        True replaces files whatever they are.

    Raises
    ------
    UsageError
        If an ending is another one, a folder stands where a file goes or the reverse, the folder around is missing,
        or a file exists that no export wrote or that was changed since.
    """
    paths = [Path(file) for file in files]
    place = None if folder is None else Path(folder)
    if place is not None and place.exists() and not place.is_dir():
        raise UsageError(
            f"{place} is a file.", why="This export writes several files.", fix="Name a folder for them."
        )
    for path in paths:
        if path.is_dir():
            raise UsageError(
                f"{path} is a folder.",
                why="A file goes there.",
                fix="Name a file, such as one in that folder.",
            )
        if endings and path.suffix.lower() not in endings:
            raise UsageError(
                f"{path} does not end in {' or '.join(endings)}.",
                why="Other programs tell the format by the name.",
                fix=f"Write to {path.with_suffix(endings[0]).name}.",
            )
        around = path.parent if place is None else place.parent
        if not around.is_dir():
            raise UsageError(
                f"The folder {around} does not exist.",
                why=f"{path if place is None else place} goes into it.",
                fix="Make it first, or choose another place with --out.",
            )
        if not overwrite and path.exists() and not is_own(path):
            raise UsageError(
                f"{path} exists already.",
                why="It is not known as palpate's, or it was changed after palpate wrote it.",
                fix="Choose another name with --out, or replace it with --force (in Python overwrite=True).",
            )


def with_seal(file: str | os.PathLike[str], text: str) -> str:
    """Return a text with a last line that lets a later export replace it; a format without comments as it stands.

    Parameters
    ----------
    file : path
        Name of the file, whose ending tells how comments are written.
    text : str
        Its content.
    """
    comment = _COMMENTS.get(Path(file).suffix.lower())
    if comment is None:
        return text
    whole = text if text.endswith("\n") else text + "\n"
    return f"{whole}{comment[0]}{_SENTENCE}{_checksum(whole.encode())}{comment[1]}\n"


def seal(path: Path) -> None:
    """Add that line to a file that another library wrote."""
    path.write_text(with_seal(path, path.read_text("utf-8")), "utf-8", newline="\n")


def is_own(path: Path) -> bool:
    """Return whether an export wrote a file, and it is still as it was where the format can tell."""
    ending = path.suffix.lower()
    content = path.read_bytes() if path.is_file() else b""
    if ending in _COMMENTS:
        line = _LAST_LINE.search(content, max(0, len(content) - _LONGEST_LINE))
        return line is not None and line[1].decode() == _checksum(content[: line.start()])
    if ending in _BINARY_HEADS:
        return _BINARY_HEADS[ending] in content[:256]
    if ending in _LIBRARIES:  # which exports the functions of that name
        name = path.stem.removeprefix("lib").encode()
        return all(name + function in content for function in (b"_hash", b"_limits", b"_deviation"))
    if ending == ".json":
        return _is_card(content)
    return ending == ".fmu" and _is_fmu(path)


def _checksum(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def _is_card(content: bytes) -> bool:
    try:
        card = json.loads(content)
    except ValueError:
        return False
    return isinstance(card, dict) and card.get("format") == "palpate model card"


def _is_fmu(path: Path) -> bool:
    try:
        with zipfile.ZipFile(path) as file:
            return b'generationTool="palpate ' in file.read("modelDescription.xml")
    except (zipfile.BadZipFile, KeyError):
        return False
