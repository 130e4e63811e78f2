"""Files of parts as they lie on the disk: regular ones, perhaps packed with gzip, with endings in any case.

read_part        the bytes, unpacked
plain_file       a path under which libraries that look at the ending find the file
require_counts   refuses a file whose head promises more than it can hold, before a library makes room for it
"""

from __future__ import annotations

import contextlib
import gzip
import os
import re
import zlib
from collections.abc import Iterator
from pathlib import Path

from palpate.errors import FileFormatError, UsageError
from palpate.file_kinds import part_ending
from palpate.files import TemporaryFolder
from palpate.input_files import read_input
from palpate.sizes import require_deflated

__all__ = ["plain_file", "read_part", "require_counts", "require_file"]

LARGEST = 4 << 30  # bytes: a part that is larger than this, packed or not, fits no solver
_GZIP = b"\x1f\x8b"
# numbers of nodes and cells that the heads of formats state
_STATED = {
    **dict.fromkeys(
        (".vtu", ".vtp"),
        re.compile(rb'\bNumberOf(?:Points|Cells|Polys|Strips|Lines|Verts)\s*=\s*"\s*(-?\d+)'),
    ),
    ".vtk": re.compile(
        rb"^[ \t]*(?:POINTS|CELLS|CELL_TYPES|POLYGONS|TRIANGLE_STRIPS|LINES|VERTICES)[ \t]+(-?\d+)", re.M
    ),
    ".msh": re.compile(rb"^\$(?:Nodes|Elements)[ \t]*\r?\n[ \t]*(-?\d+)[ \t]*\r?$", re.M),
    ".mesh": re.compile(rb"^[ \t]*(?:Vertices|Tetrahedra|Triangles|Hexahedra)\s+(-?\d+)", re.M),
    **dict.fromkeys((".node", ".ele"), re.compile(rb"\A(?:\s*#[^\n]*\n)*\s*(-?\d+)")),
    ".su2": re.compile(rb"^[ \t]*N(?:POIN|ELEM)[ \t]*=[ \t]*(-?\d+)", re.M),
    ".avs": re.compile(rb"\A(?:\s*#[^\n]*\n)*\s*(-?\d+)"),
    ".ply": re.compile(rb"^element[ \t]+\w+[ \t]+(-?\d+)", re.M),
    ".off": re.compile(rb"\A\s*\w*OFF\s+(?:#[^\n]*\n\s*)*(-?\d+)", re.I),
}


def require_file(path: str | os.PathLike[str]) -> None:
    """Refuse what is no file that ends: a folder, a device, a pipe, or nothing at all."""
    file = Path(path)
    try:
        size = file.stat().st_size
    except OSError as error:
        raise UsageError(
            f"The file {path} can't be read.",
            why=f"{error.strerror}.",
            fix="Check the path; a relative one starts from the directory of the running program.",
        ) from error
    if not file.is_file():
        what = "a folder" if file.is_dir() else "a device, a pipe or a socket"
        raise UsageError(f"{path} is {what}.", why="A part is a file.", fix="Name the file of the part.")
    if size > LARGEST:
        raise UsageError(
            f"{path} has {size / 1e9:.3g} GB.",
            why="A part that large fits no solver on one machine.",
            fix="Simplify the part in the program that made it.",
        )


def read_part(path: str | os.PathLike[str]) -> bytes:
    """Return the bytes of a part's file; of one packed with gzip those that are packed in it."""
    require_file(path)
    content = read_input(path)
    if Path(path).suffix.lower() != ".gz":
        return content
    why = "It is no gzip file." if not content.startswith(_GZIP) else "It is damaged or cut short."
    with contextlib.suppress(OSError, EOFError, zlib.error):
        with gzip.open(path) as file:
            unpacked = file.read(LARGEST + 1)
        if len(unpacked) <= LARGEST:
            return unpacked
        why = f"More than {LARGEST / 1e9:.3g} GB are packed in it."
    raise FileFormatError(f"{path} can't be unpacked.", why=why, fix="Pack the file again with gzip.")


@contextlib.contextmanager
def plain_file(path: str, ending: str | None = None, content: bytes | None = None) -> Iterator[str]:
    """Yield a path under which a file lies unpacked, with its ending in small letters; or another ending or content."""
    ending = ending or part_ending(path)
    if Path(path).suffix == ending and content is None:
        yield path
        return
    with TemporaryFolder() as folder:
        copy = folder / f"part{ending}"
        copy.write_bytes(read_part(path) if content is None else content)
        yield str(copy)


def require_counts(path: str, content: bytes) -> None:
    """Refuse a file that states more nodes or cells than its bytes can hold, or fewer than none.

    A node or a cell takes a byte at least; VTK's own compression makes as much of a byte as deflate can.
    """
    pattern = _STATED.get(part_ending(path))
    if pattern is None:
        return
    for stated in map(int, pattern.findall(content)):
        with contextlib.suppress(ValueError):
            if stated >= 0:
                if part_ending(path) in {".vtu", ".vtp"}:
                    require_deflated(stated, len(content))
                elif stated > len(content):
                    raise ValueError
                continue
        raise FileFormatError(
            f"The file {path} states {stated:,} nodes or cells, and has {len(content):,} bytes.",
            why="So many are not in it: it is damaged or cut short.",
            fix="Open it in the program that made it and export it again.",
        )
