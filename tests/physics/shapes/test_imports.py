"""Files of solids, surfaces and meshes: what comes back is what was written, and faults are named."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import meshio
import ngsolve
import numpy as np
import pytest

from palpate.errors import FileFormatError, UsageError
from palpate.physics.advice import ModelWarning
from palpate.physics.shapes import (
    Block,
    Cylinder,
    FineMesh,
    ImportedMesh,
    ImportedSolid,
    LayeredBlock,
    SurfacePatch,
)
from palpate.physics.shapes.mesh import body_mesh
from palpate.physics.shapes.naming import UPRIGHT

PLATE = 0.1 * 0.06 * 0.04 - np.pi * 0.015**2 * 0.04  # m³, a block with a round hole
CUBE = np.array([[x, y, z] for x in (0.0, 0.1) for y in (0.0, 0.1) for z in (0.0, 0.1)])
SIDES = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
)


def write_plate(path: Path, *, names: bool = True) -> None:
    """A plate of 100 x 60 x 40 mm with a hole of 15 mm radius."""
    from netgen.occ import Box, Cylinder, Pnt, Z

    plate = Box(Pnt(0, 0, 0), Pnt(100, 60, 40)) - Cylinder(Pnt(50, 30, 0), Z, r=15, h=40)
    if names:
        plate.faces.name = "outer (rough)"
        plate.faces.Max(Z).name = "lid"
        plate.faces.Max(Z).col = (1, 0, 0)
        plate.solids.name = "steel"
    plate.WriteStep(str(path))


def write_stl(path: Path, points: np.ndarray, triangles: np.ndarray, **more: Any) -> ImportedSolid:
    meshio.Mesh(points, [("triangle", triangles)]).write(path, binary=True)
    return ImportedSolid(path, unit="m", **more)


def write_tetrahedra(path: Path, mesh, **extra) -> None:
    meshio.Mesh(mesh.points, [("tetra", mesh.tetrahedra)], **extra).write(path)


def failure(attempt, kind=UsageError) -> str:
    with pytest.raises(kind) as caught:
        attempt()
    assert caught.value.what
    assert caught.value.why
    assert caught.value.fix
    return str(caught.value)


@pytest.mark.full
def test_step_keeps_names_and_is_read_in_metres(tmp_path: Path):
    write_plate(tmp_path / "plate.step")
    plate = ImportedSolid(tmp_path / "plate.step")
    assert set(plate.surfaces) == {"outer _rough_", "lid"}
    assert plate.regions == ("steel",)
    mesh = plate.mesh()
    assert ngsolve.Integrate(1, mesh) == pytest.approx(PLATE, rel=1e-3)
    lid = ngsolve.Integrate(1, mesh, definedon=mesh.Boundaries("lid"))
    assert lid == pytest.approx(PLATE / 0.04, rel=1e-3)
    assert pickle.loads(pickle.dumps(plate)).rest() is plate.rest()
    assert len(plate.describe()["sha256"]) == 64
    fine = plate.rest((FineMesh("lid", 0.004, (0, 0, 0), (0.03, 0.06, 1)),))
    assert len(fine.points) > 1.5 * len(plate.rest().points)


def test_step_without_names_has_numbers_and_takes_patches(tmp_path: Path):
    write_plate(tmp_path / "plate.stp", names=False)
    plate = ImportedSolid(
        tmp_path / "plate.stp", patches=(SurfacePatch("hole", (0.045, 0.025, 0.015), (0.055, 0.035, 0.025)),)
    )
    assert plate.regions == ("body",)
    assert "hole" in plate.surfaces
    assert sum(name.startswith("face ") for name in plate.surfaces) == 6
    mesh = plate.mesh()
    hole = ngsolve.Integrate(1, mesh, definedon=mesh.Boundaries("hole"))
    assert hole == pytest.approx(2 * np.pi * 0.015 * 0.04, rel=2e-3)


def test_stl_becomes_a_body_split_along_its_edges(tmp_path: Path):
    block = Block(size=(0.1, 0.08, 0.05)).rest()
    path = tmp_path / "block.stl"
    write_stl(path, block.points * 1000, block.triangles)
    solid = ImportedSolid(
        path,
        unit="mm",
        patches=(SurfacePatch("top", where=above), SurfacePatch("low", (-1, -1, -1), (1, 1, 0.001))),
    )
    assert solid.surfaces == ("top", "low", "face 3", "face 4", "face 5", "face 6")
    mesh = solid.rest()
    assert mesh.volume == pytest.approx(0.1 * 0.08 * 0.05, rel=1e-9)
    areas = {"top": 0.008, "low": 0.008, "face 3": 0.005, "face 4": 0.005, "face 5": 0.004, "face 6": 0.004}
    assert mesh.areas == pytest.approx(areas, rel=1e-9)
    assert np.allclose(mesh.normals[mesh.surface_of == 0], [0, 0, 1])
    fine = solid.rest((FineMesh("top", 0.006, (0.03, 0.02, 0), (0.07, 0.06, 1)),))
    assert fine.areas == pytest.approx(areas, rel=1e-9)
    assert len(fine.triangles_of("top")) > 2 * len(mesh.triangles_of("top"))


def above(centres: np.ndarray) -> np.ndarray:
    return centres[:, 2] > 0.0499


@pytest.mark.parametrize("ending", ["vtu", "msh", "mesh", "inp"])
def test_volume_meshes_come_back(tmp_path: Path, ending: str):
    block = Block().rest()
    path = tmp_path / f"block.{ending}"
    write_tetrahedra(path, block)
    mesh = ImportedMesh(path).rest()
    assert np.allclose(mesh.points, block.points, atol=1e-9)
    assert np.array_equal(mesh.tetrahedra, block.tetrahedra)
    assert mesh.regions == ("body",)
    assert mesh.surfaces == tuple(f"face {i}" for i in range(1, 7))
    assert sorted(mesh.areas.values()) == pytest.approx([0.005] * 4 + [0.01] * 2, rel=1e-6)


def test_groups_of_a_gmsh_file_are_regions_and_surfaces(tmp_path: Path):
    layers = LayeredBlock(extent=(0.05, 0.05), layers=(("fat", 0.01), ("muscle", 0.02)))
    mesh = layers.rest()
    tags = [mesh.region_of + 1, mesh.surface_of + 11]
    source = meshio.Mesh(
        mesh.points * 1e3,
        [("tetra", mesh.tetrahedra), ("triangle", mesh.triangles)],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={
            "fat": [1, 3],
            "muscle": [2, 3],
            **{name: [11 + i, 2] for i, name in enumerate(mesh.surfaces)},
        },
    )
    source.write(tmp_path / "layers.msh", file_format="gmsh22", binary=False)
    read = ImportedMesh(tmp_path / "layers.msh", unit="mm")
    assert read.regions == ("fat", "muscle")
    assert read.surfaces == ("top", "bottom", *UPRIGHT)
    assert read.rest().areas == pytest.approx(mesh.areas)
    assert read.rest().region_volumes == pytest.approx(mesh.region_volumes)
    assert set(read.mesh().GetMaterials()) == {"fat", "muscle"}


def test_second_order_and_numbered_regions(tmp_path: Path):
    block = Block().rest()
    pairs = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
    middles = np.stack([block.points[block.tetrahedra[:, list(p)]].mean(axis=1) for p in pairs], axis=1)
    nodes = len(block.points) + np.arange(middles[..., 0].size).reshape(-1, 6)
    upper = block.points[block.tetrahedra].mean(axis=1)[:, 2] > 0.025
    meshio.Mesh(
        np.concatenate([block.points, middles.reshape(-1, 3)]),
        [("tetra10", np.hstack([block.tetrahedra, nodes]))],
        cell_data={"region": [upper.astype(int) + 4]},
    ).write(tmp_path / "ten.vtu")
    read = ImportedMesh(tmp_path / "ten.vtu").rest()
    assert len(read.points) == len(block.points)
    assert read.volume == pytest.approx(block.volume)
    assert read.regions == ("region 4", "region 5")


def test_left_handed_meshes_are_turned(tmp_path: Path):
    block = Block().rest()
    path = tmp_path / "left.vtu"
    meshio.Mesh(block.points, [("tetra", block.tetrahedra[:, [0, 2, 1, 3]])]).write(path)
    assert ImportedMesh(path).rest().volume == pytest.approx(5e-4)


@pytest.mark.full
def test_imported_meshes_are_bisected_where_asked(tmp_path: Path):
    write_tetrahedra(tmp_path / "block.vtu", Block().rest())
    body = ImportedMesh(tmp_path / "block.vtu", patches=(SurfacePatch("top", where=above),))
    patch = FineMesh("top", 0.008, (0.04, 0.04, 0.0), (0.06, 0.06, 1.0))
    mesh = body.rest((patch,))
    assert mesh.volume == pytest.approx(5e-4, rel=1e-9)
    corners = mesh.points[mesh.triangles_of("top")]
    centres = corners.mean(axis=1)
    inside = ((centres >= patch.lower) & (centres <= patch.upper)).all(axis=1)
    assert np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)[inside].max() <= 1.5 * patch.element
    assert "more than" in failure(lambda: body.mesh((FineMesh("top", 1e-4),)))


@pytest.mark.full
def test_faults_of_surfaces(tmp_path: Path):
    stl = tmp_path / "cube.stl"
    assert write_stl(stl, CUBE, SIDES).rest().volume == pytest.approx(1e-3)
    said = failure(lambda: write_stl(stl, CUBE, SIDES[:-2]).mesh())
    assert "open: 4 edges" in said
    assert "around (0.05, 0.05, 0.1) m" in said
    with pytest.warns(ModelWarning, match="inside out"):
        assert write_stl(stl, CUBE, SIDES[:, ::-1]).rest().volume == pytest.approx(1e-3)
    turned = np.concatenate([SIDES[:1, ::-1], SIDES[1:]])
    assert "inverted" in failure(lambda: write_stl(stl, CUBE, turned).mesh())
    both = np.concatenate([SIDES, SIDES + 8])
    beside = np.concatenate([CUBE, CUBE + np.array([0.1, 0.1, 0.0])])
    assert "not a manifold: 1 edge" in failure(lambda: write_stl(stl, beside, both).mesh())
    overlap = np.concatenate([CUBE, CUBE * 0.9 + [0.05, 0.03, 0.02]])
    assert "cuts itself" in failure(lambda: write_stl(stl, overlap, both).mesh())
    assert 'unit="mm"' in failure(lambda: write_stl(stl, CUBE * 1000, SIDES).mesh())
    assert 'unit="m"' in failure(lambda: ImportedSolid(write_stl(stl, CUBE, SIDES).path, unit="um").mesh())


def test_faults_of_files(tmp_path: Path):
    (tmp_path / "empty.stl").touch()
    (tmp_path / "wrong.stl").write_text("solid nothing of this kind\nendsolid\n")
    (tmp_path / "wrong.step").write_text("ISO-10303-21;\nnonsense")
    (tmp_path / "wrong.vtu").write_text("<VTKFile><Unstr")
    (tmp_path / "wrong.msh").write_bytes(b"\x00\x01\x02" * 40)
    assert "No such file" in failure(lambda: ImportedSolid(tmp_path / "none.step"))
    assert "No such file" in failure(lambda: ImportedMesh(tmp_path / "none.vtu"))
    assert "is empty" in failure(lambda: ImportedSolid(tmp_path / "empty.stl", unit="m"), FileFormatError)
    for name, unit in (("wrong.stl", "m"), ("wrong.step", None)):
        failure(lambda name=name, unit=unit: ImportedSolid(tmp_path / name, unit).mesh(), FileFormatError)
    assert 'unit="mm"' in failure(lambda: ImportedSolid(tmp_path / "wrong.stl"))
    for name in ("wrong.vtu", "wrong.msh"):
        failure(lambda name=name: ImportedMesh(tmp_path / name).mesh(), FileFormatError)
    assert "neither a CAD file nor a surface" in failure(lambda: ImportedSolid(tmp_path / "wrong.vtu"))
    assert "Units of length" in failure(lambda: ImportedMesh(tmp_path / "wrong.vtu", unit="mile"))
    write_plate(tmp_path / "plate.step")
    assert "state their own unit" in failure(lambda: ImportedSolid(tmp_path / "plate.step", unit="mm"))
    plate = ImportedSolid(tmp_path / "plate.step")
    with (tmp_path / "plate.step").open("a") as file:
        file.write("\n")
    assert "has changed" in failure(plate.mesh)


def test_a_step_file_without_a_solid_is_open(tmp_path: Path):
    from netgen.occ import Box, Pnt, Sew

    Sew(list(Box(Pnt(0, 0, 0), Pnt(50, 50, 50)).faces)[:5]).WriteStep(str(tmp_path / "open.step"))
    said = failure(lambda: ImportedSolid(tmp_path / "open.step").mesh())
    assert "open, 4 edges" in said


def test_faults_of_volume_meshes(tmp_path: Path):
    block = Block().rest()
    path = tmp_path / "block.vtu"
    meshio.Mesh(block.points, [("triangle", block.triangles)]).write(path)
    assert "of the kind triangle" in failure(lambda: ImportedMesh(path).mesh())
    write_tetrahedra(path, Block(size=(0.1, 0.1, 0.1)).rest())
    assert "Did you mean 'face 1'" in failure(lambda: ImportedMesh(path).mesh((FineMesh("face1", 0.01),)))
    far = SurfacePatch("tip", (5, 5, 5), (6, 6, 6))
    assert "contains no part" in failure(lambda: ImportedMesh(path, patches=(far,)).mesh())
    tetrahedra = block.tetrahedra.copy()
    tetrahedra[7] = tetrahedra[7][[0, 2, 1, 3]]
    meshio.Mesh(block.points, [("tetra", tetrahedra)]).write(path)
    said = failure(lambda: ImportedMesh(path).mesh())
    assert f"1 of {len(tetrahedra)} tetrahedra" in said
    assert "inverted" in said
    assert "element 7" in said
    meshio.Mesh(block.points * 1000, [("tetra", block.tetrahedra)]).write(path)
    assert 'Pass unit="mm"' in failure(lambda: ImportedMesh(path).mesh())
    # two tetrahedra that share nothing but an edge
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0], [0, 0, -1]]) * 0.1
    meshio.Mesh(points, [("tetra", np.array([[0, 1, 2, 3], [0, 1, 4, 5]]))]).write(path)
    assert "not a manifold: 1 edge" in failure(lambda: ImportedMesh(path).mesh())


def test_patches_need_a_place():
    assert "no clear place" in failure(lambda: SurfacePatch("tip"))
    assert "no clear place" in failure(lambda: SurfacePatch("tip", (0, 0, 0), (1, 1, 1), above))
    assert "patterns" in failure(lambda: SurfacePatch("tip|top", (0, 0, 0), (1, 1, 1)))
    assert "points nowhere" in failure(lambda: SurfacePatch("tip", facing=(0, 0, 0)))


def test_patches_are_chosen_by_plane_by_direction_and_by_name(tmp_path: Path):
    """On a cube each choice is a known number of its six faces of 0.01 m²; choices in one patch must all hold."""
    square = 0.01

    def area(**choice: Any) -> float:
        patches = (SurfacePatch("chosen", **choice),)
        cube = write_stl(tmp_path / "cube.stl", CUBE, SIDES, patches=patches)
        return next(face.area for face in cube.faces if face.name == "chosen") / square

    assert area(facing=(0, 0, 2)) == pytest.approx(1)
    assert area(facing=(0, 0, 1), within=90) == pytest.approx(5)
    assert area(facing=(1, 1, 1)) == pytest.approx(3)  # each at arccos(1/√3) = 54.7°
    assert area(upper=(None, None, 0.001)) == pytest.approx(1)
    assert area(lower=(None, None, None)) == pytest.approx(6)
    assert area(lower=(None, None, 0.001), facing=(1, 0, 0)) == pytest.approx(1)
    names = write_stl(tmp_path / "cube.stl", CUBE, SIDES).surfaces
    assert area(faces=names[:2]) == pytest.approx(2)
    assert "Did you mean" in failure(lambda: area(faces=("face1",)))


@pytest.mark.full
def test_a_curved_face_of_a_step_file_is_cut_by_the_way_that_it_faces(tmp_path: Path):
    """Of a lying cylinder's side what faces up within 60° gets the name; the rest keeps its own."""
    from netgen.occ import Cylinder, Pnt, X

    path, radius, length = tmp_path / "bar.step", 10.0, 30.0
    Cylinder(Pnt(0, 0, 0), X, r=radius, h=length).WriteStep(str(path))
    bare, top = ImportedSolid(path, element=4e-3), SurfacePatch("top", facing=(0, 0, 1), within=60)
    side = next(face.name for face in bare.faces if face.area > 1e-3)
    solid = ImportedSolid(path, element=4e-3, patches=(top,))
    assert set(solid.surfaces) == {"top", *bare.surfaces}

    curved = solid.mesh((FineMesh("top", 2e-3),))
    mesh, coarse = body_mesh(curved.ngmesh), solid.rest()
    areas = {}
    for name in ("top", side):
        corners = mesh.points[mesh.triangles_of(name)]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas[name] = np.linalg.norm(normals, axis=1).sum() / 2
        upright = normals[:, 2] / np.linalg.norm(normals, axis=1)
        assert ((upright >= 0.5) == (name == "top")).all()
    assert areas["top"] + areas[side] == pytest.approx(2e-6 * np.pi * radius * length, rel=0.02)
    assert len(mesh.triangles_of("top")) > 2 * len(coarse.triangles_of("top"))
    curved.Curve(3)
    volume = ngsolve.Integrate(1.0, curved)
    assert volume == pytest.approx(
        1e-9 * np.pi * radius**2 * length, rel=1e-4
    )  # straight triangles miss a hundredth


def test_faces_say_where_they_are(tmp_path: Path):
    cube = write_stl(tmp_path / "cube.stl", CUBE, SIDES)
    faces = {face.normal: face for face in cube.faces}
    assert set(faces) == {tuple(sign * row) for row in np.eye(3) for sign in (1.0, -1.0)}
    lid = faces[0.0, 0.0, 1.0]
    assert lid.name in cube.surfaces
    assert lid.area == pytest.approx(0.01)
    assert lid.centre == pytest.approx((0.05, 0.05, 0.1))
    assert str(lid) == (
        f"{lid.name}: 1e+04 mm² around (50, 50, 100) mm, facing (0, 0, 1), in (0, 0, 100) … (100, 100, 100) mm"
    )
    assert [face.name for face in cube.faces] == list(cube.surfaces)
    round_faces = {face.name: face for face in Cylinder(0.01, 0.05).faces}
    assert "facing all ways" in str(round_faces["side"])
    assert round_faces["top"].lower[2] == pytest.approx(0.05)


def write_limb(path: Path) -> None:
    """A tube of muscle of radii 6 and 20 mm and height 40 mm around a bone."""
    from netgen.occ import Compound, Cylinder, Pnt, Z

    muscle = Cylinder(Pnt(0, 0, 0), Z, r=20, h=40) - Cylinder(Pnt(0, 0, 0), Z, r=6, h=40)
    muscle.faces.name = "skin"
    muscle.faces.Max(Z).name, muscle.faces.Min(Z).name = "cut top", "cut bottom"
    bone = Cylinder(Pnt(0, 0, 0), Z, r=6, h=40)
    muscle.solids.name, bone.solids.name = "muscle", "bone"
    Compound([muscle, bone]).WriteStep(str(path))


@pytest.mark.full
def test_concentric_solids_keep_their_faces(tmp_path: Path):
    """All faces around the axis have one centre; only the wall between the solids is none of the surface."""
    write_limb(tmp_path / "limb.step")
    limb = ImportedSolid(tmp_path / "limb.step", element=0.02)
    assert limb.regions == ("muscle", "bone")
    assert set(limb.surfaces) > {"skin", "cut top", "cut bottom"}
    assert sum(name.startswith("bone face") for name in limb.surfaces) == 2
    mesh = limb.mesh()

    def area(name: str) -> float:
        return 1e6 * ngsolve.Integrate(1, mesh, definedon=mesh.Boundaries(name))

    assert area("skin") == pytest.approx(2 * np.pi * 20 * 40, rel=5e-3)
    assert area("between regions") == pytest.approx(2 * np.pi * 6 * 40, rel=5e-3)
    assert area("cut top") == pytest.approx(np.pi * (20**2 - 6**2), rel=5e-3)
    assert not any(limb.rest().parts[0])
    # a patch around the axis names the skin, whose centre is there, and not the wall
    around = SurfacePatch("round", (-0.01, -0.01, 0.015), (0.01, 0.01, 0.025))
    mesh = ImportedSolid(limb.path, element=0.02, patches=(around,)).mesh()
    assert area("round") == pytest.approx(2 * np.pi * 20 * 40, rel=5e-3)
    assert area("between regions") == pytest.approx(2 * np.pi * 6 * 40, rel=5e-3)


def write_boxes(path: Path, *boxes: tuple[str, tuple, tuple]) -> None:
    from netgen.occ import Box, Compound, Pnt

    solids = []
    for name, low, high in boxes:
        solid = Box(Pnt(*low), Pnt(*high))
        solid.solids.name = name
        solids.append(solid)
    Compound(solids).WriteStep(str(path))


def test_a_face_that_is_covered_in_part_keeps_the_rest(tmp_path: Path):
    write_boxes(tmp_path / "a.step", ("fat", (0, 0, 0), (40, 40, 20)), ("lump", (10, 10, 20), (30, 30, 28)))
    shape = ImportedSolid(tmp_path / "a.step", element=0.02)
    areas = {name: 1e6 * area for name, area in shape.rest().areas.items()}
    assert len(areas) == 11
    assert sum(areas.values()) == pytest.approx(1600 * 2 + 4 * 800 - 400 + 400 + 4 * 160)
    ring = next(face for face in shape.faces if face.lower[2] == face.upper[2] == pytest.approx(0.02))
    assert ring.name.startswith("fat face")
    assert 1e6 * ring.area == pytest.approx(1600 - 400)


def test_solids_that_share_a_volume(tmp_path: Path):
    low = ("low", (0, 0, 0), (40, 40, 20))
    write_boxes(tmp_path / "a.step", low, ("high", (10, 10, 15), (30, 30, 25)))
    said = failure(lambda: ImportedSolid(tmp_path / "a.step").surfaces)
    assert "'low' and 'high'" in said
    assert "overlap by 2e+03 mm³" in said
    assert "around (20, 20, 17.5) mm" in said
    write_boxes(tmp_path / "b.step", low, ("core", (10, 10, 5), (30, 30, 15)))
    assert "inside the other, around (20, 20, 10) mm" in failure(
        lambda: ImportedSolid(tmp_path / "b.step").surfaces
    )
    write_boxes(tmp_path / "c.step", low, ("again", low[1], low[2]))
    twice = ImportedSolid(tmp_path / "c.step", element=0.02)
    with pytest.warns(ModelWarning, match="'again' is the same as 'low'"):
        assert len(twice.surfaces) == 6
    assert twice.regions == ("low",)
    assert twice.rest().volume == pytest.approx(32e-6)
