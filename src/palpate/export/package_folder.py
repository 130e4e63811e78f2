"""A folder of files that belong together, as a package or a plugin, replaced where nobody changed it."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from palpate.errors import UsageError
from palpate.export.check_points import Comparison
from palpate.files import system_errors, write_file

__all__ = ["ExportedPackage", "write_package"]

_RECORD = ".palpate.json"  # engines leave names with a dot alone


@dataclass(frozen=True)
class ExportedPackage:
    """A folder for an engine, and how far its library is from palpate.

    Attributes
    ----------
    folder : Path
        The package.
    files : tuple of Path
        All of its files.
    hash : str
        SHA-256 of the weights.
    comparison : Comparison, optional
        How far it is from palpate; None where nothing was to be compared, or nothing here runs it.
    """

    folder: Path
    files: tuple[Path, ...]
    hash: str
    comparison: Comparison | None

    def as_dict(self) -> dict[str, object]:
        """Return what was written and compared, for JSON."""
        compared = None if self.comparison is None else self.comparison.as_dict()
        files = [{"file": str(f), "bytes": f.stat().st_size} for f in self.files]
        return {"folder": str(self.folder), "files": files, "hash": self.hash, "compared": compared}


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _written_before(folder: Path) -> Mapping[str, str]:
    """Return the hashes of the files that an export wrote into a folder, by their relative names."""
    try:
        return dict(json.loads((folder / _RECORD).read_text("utf-8"))["files"])
    except (OSError, ValueError, KeyError, TypeError):
        return {}


def write_package(
    out: str | os.PathLike[str], files: Mapping[str, bytes], *, overwrite: bool
) -> tuple[Path, ...]:
    """Write files by their relative names into a folder, and remember their hashes there.

    Files that an export wrote and nobody changed are replaced or, where there is no new one, removed; a changed one is
    replaced with `overwrite`, and one that no export wrote never.
    """
    folder = Path(out)
    if not folder.parent.is_dir() or (folder.exists() and not folder.is_dir()):
        raise UsageError(
            f"The folder {folder} can't be made.",
            why="It is a file." if folder.exists() else f"{folder.parent} does not exist.",
            fix="Choose another place with --out.",
        )
    before = _written_before(folder)
    for name in {*files, *before}:
        path = folder / name
        if not path.exists() or before.get(name) == _hash(path.read_bytes()):
            continue
        if name in before and (overwrite or name not in files):
            continue
        ours = name in before
        raise UsageError(
            f"{path} exists already, and " + ("was changed." if ours else "palpate did not write it."),
            why="Files that somebody changed are replaced with --force alone."
            if ours
            else "Files of others are never replaced.",
            fix="Choose another folder with --out, or use --force (in Python overwrite=True)."
            if ours
            else "Choose another folder with --out.",
        )
    for name, digest in before.items():
        path = folder / name
        if name not in files and path.is_file() and _hash(path.read_bytes()) == digest:
            path.unlink()
    with system_errors(f"The folder {folder} could not be written."):
        for name in files:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
        record = {"written by": "palpate", "files": {name: _hash(data) for name, data in files.items()}}
        write_file(folder / _RECORD, json.dumps(record, indent=1) + "\n")
        return tuple(write_file(folder / name, data) for name, data in files.items())
