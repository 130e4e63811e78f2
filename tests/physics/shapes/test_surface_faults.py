"""Surfaces with the faults of real exports: repaired with a word about it, or refused with the place.

Right values are those of boxes: closed forms.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh

from palpate.errors import FileFormatError, UsageError
from palpate.physics.advice import ModelWarning
from palpate.physics.shapes import ImportedSolid
from palpate.physics.shapes.filled_surface import read_surface

CUBE = trimesh.creation.box((40, 40, 40)).apply_translation((20, 20, 20))
VOLUME = 64e-6  # m³


def box(size, low) -> trimesh.Trimesh:
    return trimesh.creation.box(size).apply_translation(np.array(low) + np.array(size) / 2)


def binary(corners: np.ndarray, *, count: int | None = None, tail: bytes = b"", head: bytes = b"") -> bytes:
    records = np.zeros(
        len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")]
    )
    records["corners"] = corners
    stated = len(corners) if count is None else count
    return head.ljust(80, b"\0") + struct.pack("<I", stated) + records.tobytes() + tail


def ascii_solid(corners: np.ndarray, name: str = "part") -> str:
    facets = [
        "facet normal 0 0 0\n outer loop\n"
        + "".join(f"  vertex {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in corner.tolist())
        + " endloop\nendfacet\n"
        for corner in corners
    ]
    return f"solid {name}\n{''.join(facets)}endsolid {name}\n"


def read(path: Path, content: bytes | str) -> ImportedSolid:
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return ImportedSolid(path, unit="mm", element=0.012)


def refused(shape: ImportedSolid, kind=UsageError) -> str:
    with pytest.raises(kind) as caught:
        _ = shape.faces
    return str(caught.value)


def repaired(shape: ImportedSolid, volume: float = VOLUME, rel: float = 1e-9) -> str:
    """The notes about a surface that encloses this volume after its repair."""
    with pytest.warns(ModelWarning, match="read with repairs"):
        topology, surface, _ = read_surface(shape.path, "mm")
    assert topology.volume == pytest.approx(volume, rel=rel)
    with pytest.warns(ModelWarning, match="read with repairs"):
        assert surface.notes == shape.notes
    return " ".join(surface.notes)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "part.stl"


@pytest.mark.parametrize("tail", [b"x", b"13 bytes more", bytes(134)])
def test_bytes_behind_the_last_triangle_are_passed_over(path: Path, tail: bytes):
    assert f"{len(tail)} bytes behind the last of 12" in repaired(
        read(path, binary(CUBE.triangles, tail=tail))
    )


def test_forms_of_the_file(path: Path):
    """A binary head that begins like ASCII, a head without a count, decimal commas, a mark of UTF-8."""
    shape = read(path, binary(CUBE.triangles, head=b"solid by some program"))
    assert read_surface(shape.path, "mm")[0].volume == pytest.approx(VOLUME)
    assert shape.notes == ()
    assert "counts no triangles; 12" in repaired(read(path, binary(CUBE.triangles, count=0)))
    text = ascii_solid(CUBE.triangles + 0.5)
    assert "decimal marks" in repaired(read(path, text.replace(".", ",")))
    assert len(read(path, "\ufeff" + text.upper()).surfaces) == 6


def test_damaged_files_say_how_far_they_are_whole(path: Path):
    whole = binary(CUBE.triangles)
    assert "counts 12 triangles, and there is room for 11" in refused(read(path, whole[:-1]), FileFormatError)
    text = ascii_solid(CUBE.triangles)
    assert "12 facets, of which 11 are whole" in refused(
        read(path, text[: text.rindex("endloop")]), FileFormatError
    )
    wild = CUBE.triangles.copy()
    wild[4, 1, 2] = np.nan
    assert "The first is triangle 5" in refused(read(path, binary(wild)), FileFormatError)
    square = text.replace(" endloop", "  vertex 1 1 1\n endloop", 1)
    assert "Facet 1 has 4 corners" in refused(read(path, square), FileFormatError)


@pytest.mark.full
def test_a_flat_triangle_goes_and_its_neighbour_is_split(path: Path):
    """The middle of an edge is a node of one side only; a triangle without area joins it to the other."""
    edge = next(
        (t, k)
        for t, nodes in enumerate(CUBE.faces)
        for k in range(3)
        if np.ptp(CUBE.vertices[nodes[[k, (k + 1) % 3]]], axis=0).astype(bool).sum() == 1
    )
    triangle = np.roll(CUBE.triangles[edge[0]], -edge[1], axis=0)
    middle = triangle[:2].mean(axis=0)
    others = np.delete(CUBE.triangles, edge[0], axis=0)
    halves = [[triangle[0], middle, triangle[2]], [middle, triangle[1], triangle[2]]]
    flat = [[triangle[0], triangle[1], middle]]
    shape = read(path, binary(np.concatenate([others, halves, flat])))
    notes = repaired(shape)
    assert "1 flat triangle was dropped and 1 edge was split" in notes
    assert shape.rest().volume == pytest.approx(VOLUME, rel=1e-9)
    # without the flat triangle the node hangs on the neighbour's edge
    assert "1 edge was split at a node on it" in repaired(
        read(path, binary(np.concatenate([others, halves])))
    )


@pytest.mark.parametrize("noise", [1e-5, 4e-4, 2e-3])
def test_corners_that_miss_each_other_are_united(path: Path, noise: float):
    rng = np.random.default_rng(3)
    shift = rng.uniform(-0.5, 0.5, CUBE.triangles.shape) * noise / np.sqrt(3)
    fine = ascii_solid(CUBE.triangles + shift)
    if noise < 4e-5:  # mm, a millionth of the length
        assert read(path, fine).notes == ()
        return
    assert "missed their neighbours by up to" in repaired(read(path, fine), rel=1e-3)


def test_a_hole_is_no_noise(path: Path):
    assert "open: 3 edges" in refused(read(path, binary(np.delete(CUBE.triangles, 3, axis=0))))


def test_holes_are_counted_and_the_largest_has_its_place(path: Path):
    parts = [box((40, 40, 20), (0, 0, 0)).triangles, box((10, 10, 10), (60, 0, 0)).triangles]
    top = [(part[:, :, 2] < part[:, :, 2].max()).any(axis=1) for part in parts]
    parts = [parts[0][top[0]], np.delete(parts[1], 0, axis=0)]
    said = refused(read(path, binary(np.concatenate(parts))))
    assert "open: 7 edges" in said
    assert "2 holes, the largest around (0.02, 0.02, 0.02) m" in said


def test_shells_with_equal_faces_between_them_become_one(path: Path):
    lower, upper = box((40, 40, 20), (0, 0, 0)), box((40, 40, 20), (0, 0, 20))
    mirrored = upper.copy()
    # the common face has the same diagonal on both sides when one box is the other's mirror image
    mirrored.vertices[:, 2] = 40 - (lower.vertices[:, 2])
    mirrored.faces = lower.faces[:, ::-1]
    notes = repaired(read(path, binary(np.concatenate([lower.triangles, mirrored.triangles]))))
    assert "2 pairs of equal triangles" in notes
    assert "(0.02, 0.02, 0.02) m" in notes


def test_a_surface_that_was_exported_twice_is_there_once(path: Path):
    assert "12 triangles were there more than once" in repaired(
        read(path, binary(np.concatenate([CUBE.triangles, CUBE.triangles])))
    )


def test_shells_that_meet_in_a_point_are_refused(path: Path):
    parts = [box((20, 20, 20), (0, 0, 0)), box((20, 20, 20), (20, 20, 20))]
    said = refused(read(path, binary(trimesh.util.concatenate(parts).triangles)))
    assert "in a point only" in said
    assert "(0.02, 0.02, 0.02) m" in said


@pytest.mark.full
def test_a_body_inside_a_body_is_refused_and_a_cavity_is_none(path: Path):
    outer, inner = box((40, 40, 40), (0, 0, 0)), box((20, 20, 20), (10, 10, 10))
    said = refused(read(path, binary(trimesh.util.concatenate([outer, inner]).triangles)))
    assert "shell 2" in said
    assert "lies inside shell 1, around (0.02, 0.02, 0.02) m" in said
    inner.invert()
    hollow = read(path, binary(trimesh.util.concatenate([outer, inner]).triangles)).rest()
    assert hollow.volume == pytest.approx(64e-6 - 8e-6, rel=1e-9)
    assert len(hollow.surfaces) == 12
    outer.invert()
    part = read(path, binary(trimesh.util.concatenate([outer, inner]).triangles))
    with pytest.warns(ModelWarning, match="1 of its 2 closed shells were inside out"):
        assert part.rest().volume == pytest.approx(64e-6 - 8e-6, rel=1e-9)


def test_shells_that_overlap_are_refused_with_the_place(path: Path):
    parts = [box((40, 40, 20), (0, 0, 0)), box((20, 20, 20), (10, 10, 10))]
    said = refused(read(path, binary(trimesh.util.concatenate(parts).triangles)))
    assert "cuts itself" in said
    assert "near (0.0" in said


def test_solids_of_the_file_name_parts_of_the_surface(path: Path):
    """As meshers of fluids write it: one closed surface, its patches as solids of their own."""
    top = (CUBE.triangles[:, :, 2] > 39).all(axis=1)
    bottom = (CUBE.triangles[:, :, 2] < 1).all(axis=1)
    rest = ~(top | bottom)
    text = "".join(
        ascii_solid(CUBE.triangles[chosen], name)
        for name, chosen in (("lid", top), ("base", bottom), ("", rest))
    )
    shape = read(path, text)
    assert shape.surfaces == ("lid", "base", "face 1", "face 2", "face 3", "face 4")
    assert shape.faces[0].area == pytest.approx(1600e-6)
    two = ascii_solid(CUBE.triangles, "one") + ascii_solid(CUBE.triangles + np.array([60, 0, 0]), "two")
    assert read(path, two).surfaces == tuple(f"face {i + 1}" for i in range(12))
