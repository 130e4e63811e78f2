"""Meshes, surfaces, studies and recordings, cut, changed and doubled: an answer or a sentence, never anything else.

The bytes are damaged by a seeded generator, so that each run has the same files. Tables and results of other programs
are tried in `dataset/readers/test_hostile_tables.py`.
"""

from __future__ import annotations

import struct
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from palpate.dataset.readers.mapping import read_mapping
from palpate.devices.tick_record import TICK
from palpate.devices.trace_file import TraceWriter, read_trace
from palpate.errors import PalpateError
from palpate.physics.shapes.mesh_source import read_source
from palpate.physics.shapes.surface_file import parse_surface
from palpate.study.toml import read_study

FIELD = Path(__file__).parent / "data" / "field"
MOST = 2e9  # bytes that a reader may add to the process


def stl(_: Path) -> bytes:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * 40.0
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *corners[list(f)].ravel(), 0) for f in faces)
    return bytes(80) + struct.pack("<I", len(faces)) + body


def abaqus(_: Path) -> bytes:
    nodes = "1, 0, 0, 0\n2, 40, 0, 0\n3, 0, 40, 0\n4, 0, 0, 40\n"
    return (
        f"*NODE\n{nodes}*ELEMENT, TYPE=C3D4, ELSET=BODY\n1, 1, 2, 3, 4\n*NSET, NSET=BASE\n1, 2, 3\n".encode()
    )


def recording(path: Path) -> bytes:
    ticks = np.zeros(300, TICK)
    ticks["tick"], ticks["time"] = np.arange(300), 1e-3 * np.arange(300)
    writer = TraceWriter(path, {"workspace": {"radius": 0.075}, "limits": {"max_force": 12.0}})
    writer.add_ticks(ticks)
    writer.close({})
    return path.read_bytes()


STUDY = b"""name = "block"
[body]
kind = "block"
size = ["60 mm", "60 mm", "30 mm"]
[body.material]
kind = "neo-hooke"
young = "9 kPa"
poisson = 0.45
[interaction]
kind = "probe"
radius = "10 mm"
depth = ["0 mm", "6 mm"]
"""
MAPPING = b"""inputs = ["force"]
[[outputs]]
name = "u"
column = "u [mm]"
unit = "mm"
"""


@dataclass(frozen=True)
class Reader:
    """A reader, the file that it reads as a function of a path, and how many damaged ones it is given."""

    name: str
    make: Callable[[Path], bytes]
    read: Callable[[Path], object]
    count: int = 60


READERS = {
    "study": Reader("a.toml", lambda _: STUDY, read_study),
    "mapping": Reader("a.toml", lambda _: MAPPING, read_mapping),
    "STL": Reader("a.stl", stl, lambda path: parse_surface(str(path))),
    "OBJ": Reader("a.obj", lambda _: (FIELD / "surface" / "quad_cube.obj").read_bytes(),
                  lambda path: parse_surface(str(path))),
    "Abaqus": Reader("a.inp", abaqus, lambda path: read_source(str(path))),
    "Gmsh": Reader("a.msh", lambda _: (FIELD / "mesh" / "version40.msh").read_bytes(),
                   lambda path: read_source(str(path)), 20),
    "Nastran": Reader("a.bdf", lambda _: (FIELD / "mesh" / "no_begin_bulk.bdf").read_bytes()[:6000],
                      lambda path: read_source(str(path)), 20),
    "recording": Reader("a.trace", recording, read_trace, 30),
}  # fmt: skip


def damage(content: bytes, rng: np.random.Generator) -> bytes:
    """Return the bytes cut, with some overwritten, doubled, taken out, or filled with what readers trip on."""
    data = bytearray(content)
    for _ in range(rng.integers(1, 4)):
        a, b = sorted(rng.integers(0, len(data) + 1, 2))
        b = min(b, a + int(rng.integers(1, 200)))
        kind = rng.integers(0, 6)
        if kind == 0:
            del data[a:]
        elif kind == 1:
            data[a:b] = rng.integers(0, 256, b - a, np.uint8).tobytes()
        elif kind == 2:
            data[a:a] = data[a:b]
        elif kind == 3:
            del data[a:b]
        elif kind == 4:
            data[a:a] = rng.choice(
                [b"nan", b"1e999", b"-1", b"99999999999", b"\x00", b"\xff\xfe", b"[[", b'"']
            )
        elif data:
            data[min(a, len(data) - 1)] ^= 1 << int(rng.integers(0, 8))
        if not data:
            break
    return bytes(data)


@pytest.mark.grid
@pytest.mark.timeout(60)
@pytest.mark.skipif(sys.platform == "win32", reason="the peak of the memory is asked of POSIX")
@pytest.mark.parametrize("kind", list(READERS))
def test_damaged_files_are_read_or_refused_in_a_sentence(tmp_path, kind):
    import resource

    reader, rng = READERS[kind], np.random.default_rng(len(kind))
    content = reader.make(tmp_path / reader.name)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    refusals = []
    for k in range(reader.count):
        path = tmp_path / f"{k}-{reader.name}"
        path.write_bytes(damage(content, rng))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what is odd and can be read is told so
            try:
                reader.read(path)
            except PalpateError as error:
                refusals.append(str(error))
    assert refusals, "the damage is real"
    assert all(refusals)
    assert not [said for said in refusals if "Traceback" in said]
    assert 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) < MOST
