"""Parts of an imported body that nothing holds are refused when the problem is made, with the gap."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
import trimesh

from palpate.errors import UsageError
from palpate.physics import Body, ImportedMesh, ImportedSolid, NeoHookean, PrescribedDisplacement, SphereProbe
from palpate.physics.shapes import Block

SOFT = NeoHookean(1e4, 0.3)


def write_boxes(path: Path, gap: float) -> None:
    """A box of 40 × 40 × 20 mm and a plate of 40 × 40 × 5 above it, as named solids of a STEP file."""
    from netgen.occ import Box, Compound, Pnt, Z

    low, high = Box(Pnt(0, 0, 0), Pnt(40, 40, 20)), Box(Pnt(0, 0, 20 + gap), Pnt(40, 40, 25 + gap))
    low.solids.name, high.solids.name = "fat", "skin"
    low.faces.Min(Z).name, high.faces.Max(Z).name = "bottom", "top"
    Compound([low, high]).WriteStep(str(path))


def refused(body: Body, *interactions) -> str:
    with pytest.raises(UsageError) as caught:
        body.problem(*interactions)
    return str(caught.value)


@pytest.mark.full
def test_a_gap_of_a_drawing_is_told(tmp_path: Path):
    write_boxes(tmp_path / "gap.step", 0.02)
    body = Body(ImportedSolid(tmp_path / "gap.step", element=0.02), SOFT, fixed="bottom")
    probe = SphereProbe(0.005, touches="top")
    said = refused(body, probe)
    assert "The part of 'skin' around (0.02, 0.02, 0.02252) m hangs on nothing" in said
    assert "0.02 mm from the rest" in said
    assert "'skin face 1'" in said
    # held as well, or led by an interaction, it is a body of two parts
    both = Body(body.geometry, SOFT, fixed=("bottom", "skin face 1"))
    assert both.problem(probe).longest == pytest.approx(0.04)
    assert body.problem(PrescribedDisplacement("top", "z", (-0.001, 0.0))).ranges
    write_boxes(tmp_path / "none.step", 0.0)
    touching = ImportedSolid(tmp_path / "none.step", element=0.02)
    assert not touching.rest().parts[0].any()
    assert Body(touching, SOFT, fixed="bottom").problem(probe).ranges


@pytest.mark.full
def test_shells_of_a_surface_that_hang_apart_are_told(tmp_path: Path):
    boxes = [trimesh.creation.box((40, 40, 20)), trimesh.creation.box((40, 40, 20))]
    boxes[1].apply_translation((0, 0, 25))
    trimesh.util.concatenate(boxes).export(tmp_path / "two.stl")
    two = ImportedSolid(tmp_path / "two.stl", unit="mm", element=0.02)
    assert two.notes == (
        "Closed shell 2 is a body of its own, 5 mm from the others around (-0.02, -0.02, 0.015) m.",
    )
    floor = next(face.name for face in two.faces if face.normal[2] < -0.9 and face.centre[2] < 0)
    lid = next(face.name for face in two.faces if face.normal[2] > 0.9 and face.centre[2] > 0.03)
    said = refused(Body(two, SOFT, fixed=floor), SphereProbe(0.005, touches=lid))
    assert "hangs on nothing" in said
    assert "5 mm from the rest" in said


def test_what_meets_in_a_point_is_two_parts(tmp_path: Path):
    block = Block(size=(0.04, 0.04, 0.02), element=0.02).rest()
    nodes = len(block.points)
    other = block.points + np.array([0.04, 0.04, 0.02])
    meshio.Mesh(
        np.concatenate([block.points, other]),
        [("tetra", np.concatenate([block.tetrahedra, block.tetrahedra + nodes]))],
    ).write(tmp_path / "a.vtu")
    with pytest.warns(UserWarning, match="1 node lies on another"):
        mesh = ImportedMesh(tmp_path / "a.vtu").rest()
    part_of, part_of_triangle = mesh.parts
    assert np.bincount(part_of).tolist() == [len(block.tetrahedra)] * 2
    assert np.bincount(part_of_triangle).tolist() == [len(block.triangles)] * 2
    floor = next(face.name for face in ImportedMesh(tmp_path / "a.vtu").faces if face.centre[2] == 0)
    said = refused(
        Body(ImportedMesh(tmp_path / "a.vtu"), SOFT, fixed=floor), SphereProbe(0.005, touches="face 1")
    )
    assert "in an edge or point only, around (0.04, 0.04, 0.02) m" in said
