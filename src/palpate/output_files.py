"""Files that are written for other tools: where they may go, and which of those that are there may be replaced.

An export replaces what an earlier export wrote and nobody changed since. With ``--force`` it replaces what palpate
wrote and somebody changed, and tables. Nobody else's file is ever replaced. Texts end with a line that holds a checksum
of all above it, a study begins with a line of palpate's; other formats name palpate in their own metadata. Tables have
no such place, and are never replaced unasked.

::

    require_outputs   refuses names that can't be written to, or whose files are not palpate's to replace
    free_path         a name beside somebody else's file, where refusing would lose a result
    json_data         records and arrays as data that JSON can say
    with_seal         a text with the line that lets a later export replace it
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import os
import re
import tomllib
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from palpate.errors import UsageError
from palpate.files import require_regular

__all__ = [
    "SAMPLE_HEAD",
    "STUDY_HEAD",
    "free_path",
    "is_marked",
    "is_own",
    "json_data",
    "picture_metadata",
    "require_outputs",
    "seal",
    "with_seal",
]

STUDY_HEAD = "A palpate study: what is solved, learnt, checked and touched."
"""First comment of each study file that palpate writes."""

SAMPLE_HEAD = b"sample part of palpate"
"""Begin of the sample part, which `palpate init --sample` writes."""

PICTURE_MARK = "palpate"  # program that pictures name in their metadata

_COMMENTS = {
    ".h": ("/* ", " */"),
    ".c": ("/* ", " */"),
    ".cs": ("// ", ""),
    ".py": ("# ", ""),
    ".txt": ("# ", ""),
    ".toml": ("# ", ""),
    ".m": ("% ", ""),
    **dict.fromkeys((".md", ".html", ".htm", ".pvd", ".vtu"), ("<!-- ", " -->")),
}
"""How a line of comment begins and ends, by the ending of a file's name."""

_SENTENCE = "Written by palpate; the next export replaces this file unless it was changed. Checksum "
_LAST_LINE = re.compile(rb"[^\n]*" + re.escape(_SENTENCE.encode()) + rb"([0-9a-f]{16})[^\n]*\n\Z")
_LONGEST_LINE = 200  # bytes at the end of a file in which its mark stands
# a study has one of these, the latter two in files of version 0.1.0
_ACTING = {"interaction", "loads", "probe"}
_LIBRARIES = {".so", ".dylib", ".dll"}
_TABLES = {".csv", ".parquet", ".nc", ".npz"}  # formats without a place for a mark
# what names palpate in other formats, and in how many bytes from the start
_MARKS = {
    ".glb": (b'"generator":"palpate"', 256),
    ".onnx": (b"\x12\x07palpate", 256),  # its field producer_name
    ".stl": (SAMPLE_HEAD, 80),
    # where Matplotlib puts the program that it is told
    ".svg": (f"<dc:title>{PICTURE_MARK}</dc:title>".encode(), None),
    ".png": (b"Software\0" + PICTURE_MARK.encode(), None),
    ".pdf": (f"/Creator ({PICTURE_MARK})".encode(), None),
}


def require_outputs(
    files: Iterable[str | os.PathLike[str]],
    *,
    endings: tuple[str, ...] = (),
    folder: str | os.PathLike[str] | None = None,
    inputs: Iterable[str | os.PathLike[str]] = (),
    overwrite: bool = False,
) -> None:
    """Refuse files that can't be written, or that are there and are not palpate's to replace.

    `endings` are those of which each file has one, such as ``".fmu"``; by default any. `folder` is one that the export
    makes itself; otherwise the files lie in folders that exist. None of the `inputs` is replaced. `overwrite` also
    replaces tables, and files of palpate's that somebody changed.
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
                fix="Make it first, or choose another place.",
            )
        require_regular(path)
        if path.exists():
            _require_own(path, inputs, overwrite=overwrite)


def _require_own(path: Path, inputs: Iterable[str | os.PathLike[str]], *, overwrite: bool) -> None:
    """Refuse to replace a file that is read, that palpate did not write, or that was changed and is not given up."""
    if any(path.samefile(file) for file in map(Path, inputs) if file.exists()):
        raise UsageError(
            f"{path} is a file that is read here.",
            why="What is written would take its place.",
            fix="Choose another name.",
        )
    marked = is_marked(path)
    if is_own(path) or (overwrite and marked):
        return
    if marked:
        raise UsageError(
            f"{path} exists already.",
            why="It is a table, or was changed after palpate wrote it.",
            fix="Choose another name, or replace it with --force (in Python overwrite=True).",
        )
    raise UsageError(
        f"{path} exists already, and palpate did not write it.",
        why="Files of others are never replaced, with --force neither.",
        fix="Choose another name, or remove the file yourself.",
    )


def free_path(path: str | os.PathLike[str]) -> Path:
    """Return the path itself, or where somebody else's file has that name one with a number: ``NAME-2.html``."""
    wanted = Path(path)
    path, number = wanted, 1
    while path.is_file() and not is_marked(path):
        number += 1
        path = wanted.with_stem(f"{wanted.stem}-{number}")
    return path


def with_seal(file: str | os.PathLike[str], text: str) -> str:
    """Return a text with a last line that lets a later export replace it; a format without comments as it stands.

    The ending of the file's name tells how comments are written.
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
    if ending in _MARKS:
        mark, span = _MARKS[ending]
        return mark in content[:span]
    if ending in _LIBRARIES:  # which exports the functions of that name
        name = path.stem.removeprefix("lib").encode()
        ours = all(name + function in content for function in (b"_hash", b"_limits"))
        return ours and any(name + function in content for function in (b"_deviation", b"_evaluate"))
    if ending in {".json", ".fmu"}:
        return _is_card(content) if ending == ".json" else _is_fmu(path)
    # nobody else has that ending, and a damaged file is no loss
    return ending == ".palpate" or _is_archive(content)


def _is_archive(content: bytes) -> bool:
    """Return whether these are the bytes of a model file: an archive of safetensors whose header names palpate."""
    return content[8:9] == b"{" and b'"palpate":' in content[8 : 8 + int.from_bytes(content[:8], "little")]


def picture_metadata(path: str | os.PathLike[str]) -> dict[str, str] | None:
    """Return the metadata by which a picture that Matplotlib writes is known as palpate's; None in other formats."""
    key = {".svg": "Creator", ".pdf": "Creator", ".png": "Software"}.get(Path(path).suffix.lower())
    return None if key is None else {key: PICTURE_MARK}


def is_marked(path: Path) -> bool:
    """Return whether palpate wrote a file, whatever became of it since; of a table it is taken for granted."""
    ending = path.suffix.lower()
    if ending == ".toml":
        return path.read_bytes().lstrip().startswith(f"# {STUDY_HEAD}".encode()) or _is_study(path)
    if ending in _COMMENTS:
        return _SENTENCE.encode() in path.read_bytes()
    return ending in _TABLES or is_own(path)


def _is_study(path: Path) -> bool:
    """Return whether a file has the tables of a study, or the line of a file that palpate wrote."""
    content = path.read_bytes()
    try:
        tables = tomllib.loads(content.decode())
    except ValueError:
        return _SENTENCE.encode() in content
    return _SENTENCE.encode() in content or bool("name" in tables and _ACTING & tables.keys())


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


def json_data(value: Any) -> Any:
    """Return dataclasses, mappings, sequences and arrays as data for JSON; a float that is not finite becomes None."""
    if dataclasses.is_dataclass(value):
        return {f.name: json_data(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(k): json_data(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [json_data(v) for v in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return json_data(value.tolist()) if hasattr(value, "tolist") else value
