"""The two forms of STL files, as programs really write them.

The binary form is a head of 80 bytes, the number of triangles and 50 bytes for each; some programs leave bytes behind
the last one, others begin the head with the word of the ASCII form. The ASCII form has a name for each solid; some
programs write decimal commas.
"""

from __future__ import annotations

import re

import numpy as np

from palpate.errors import FileFormatError
from palpate.physics.shapes.naming import plain_name
from palpate.physics.shapes.surface_repair import Surface

__all__ = ["parse_stl"]

HEAD, RECORD = 84, 50  # bytes before the first triangle, and of each
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
SOLID = re.compile(rb"^[ \t]*solid\b([^\r\n]*)", re.MULTILINE | re.IGNORECASE)
LOOP = re.compile(rb"\bouter\s+loop\b(.*?)\bendloop\b", re.DOTALL | re.IGNORECASE)
VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)


def parse_stl(path: str, content: bytes) -> Surface:
    """Return the triangles of an STL file, each with corners of its own, in the unit of the file.

    `path` is named in messages only; `content` is the whole file.
    """
    text = content[:3].removeprefix(b"\xef\xbb\xbf") + content[3:]
    is_text = text[:512].lstrip()[:5].lower() == b"solid" and (
        b"facet" in text[:4096].lower() or b"endsolid" in text[-4096:].lower()
    )
    surface = _parse_text(path, text) if is_text else _parse_binary(path, content)
    bad = ~np.isfinite(surface.points).all(axis=1)
    if bad.any():
        raise FileFormatError(
            f"{int(bad.reshape(-1, 3).any(axis=1).sum())} triangles of {path} have corners that are no finite numbers.",
            why=f"The first is triangle {int(bad.argmax()) // 3 + 1}.",
            fix="Export the surface again.",
        )
    return surface


def _damage(path: str, why: str) -> FileFormatError:
    return FileFormatError(
        f"The file {path} holds no whole surface of triangles.",
        why=why,
        fix="Export the surface again, as STL.",
    )


def _parse_binary(path: str, content: bytes) -> Surface:
    if len(content) < HEAD:
        raise _damage(path, "It is too short for an STL file, or of another format.")
    stated = int.from_bytes(content[80:HEAD], "little")
    there, spare = divmod(len(content) - HEAD, RECORD)
    notes = []
    count = stated
    if not stated and there and not spare:
        count = there
        notes.append(f"The file's head counts no triangles; {there} are there, and were read.")
    elif stated > there:
        raise _damage(
            path,
            f"Its head counts {stated} triangles, and there is room for {there}: it is cut short, or no STL file.",
        )
    elif not stated:
        raise _damage(path, "It counts no triangles: it is empty, or no STL file.")
    elif left := len(content) - HEAD - RECORD * stated:
        notes.append(f"{left} bytes behind the last of {stated} triangles were passed over.")
    corners = np.frombuffer(content, dtype=TRIANGLE, count=count, offset=HEAD)["corners"]
    return _surface(corners.reshape(-1, 3).astype(float), np.zeros(count, dtype=np.int64), ("",), notes)


def _surface(points: np.ndarray, label_of: np.ndarray, labels: tuple[str, ...], notes: list[str]) -> Surface:
    triangles = np.arange(len(points)).reshape(-1, 3)
    return Surface(points, triangles, label_of, labels, tuple(notes))


def _parse_text(path: str, content: bytes) -> Surface:
    starts = list(SOLID.finditer(content))
    numbers: list[tuple[bytes, ...]] = []
    label_of: list[int] = []
    labels: dict[str, int] = {}
    facets = len(re.findall(rb"\bfacet\s+normal\b", content, re.IGNORECASE))
    for start, end in zip(starts, [*(s.start() for s in starts[1:]), len(content)], strict=True):
        # some programs write a comment behind the name
        said = start[1].decode("utf-8", "replace").partition(";")[0].strip()
        label = labels.setdefault(plain_name(said) if said else "", len(labels))
        for loop in LOOP.finditer(content, start.end(), end):
            corners = VERTEX.findall(loop[1])
            if len(corners) != 3:
                raise _damage(
                    path, f"Facet {len(label_of) + 1} has {len(corners)} corners, and a triangle has three."
                )
            numbers += corners
            label_of.append(label)
    if not label_of or len(label_of) != facets:
        raise _damage(
            path, f"It has {facets} facets, of which {len(label_of)} are whole: it is cut short or damaged."
        )
    notes = []
    digits = np.array(numbers)
    if any(b"," in number for row in numbers[:30] for number in row):
        digits = np.char.replace(digits, b",", b".")
        notes.append("Commas in its numbers were read as decimal marks.")
    try:
        points = digits.astype(float)
    except ValueError as error:
        raise _damage(path, f"A coordinate is no number ({error}).") from error
    return _surface(points, np.array(label_of, dtype=np.int64), tuple(labels), notes)
