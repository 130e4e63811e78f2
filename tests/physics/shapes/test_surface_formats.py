"""Surfaces and solids in the formats that scanners, segmentations and CAD programs write, and what is damaged."""

from __future__ import annotations

import gzip
import os
import shutil
import struct
from pathlib import Path

import meshio
import numpy as np
import pytest
import trimesh

from palpate.errors import FileFormatError, PalpateError, UsageError
from palpate.file_kinds import part_ending, part_kind
from palpate.physics.advice import ModelWarning
from palpate.physics.shapes import Block, ImportedMesh, ImportedSolid

FIELD = Path(__file__).parents[2] / "data" / "field"
BOX = trimesh.creation.box((40.0, 30.0, 20.0))
VOLUME = 24e-6  # m³


def read(path: Path) -> ImportedSolid:
    return ImportedSolid(path, unit="mm")


def write(path: Path, surface: trimesh.Trimesh) -> Path:
    """Write a surface in the format of the ending, and packed where the name ends in .gz."""
    content = surface.export(file_type=part_ending(path).removeprefix("."))
    content = content.encode() if isinstance(content, str) else content
    path.write_bytes(gzip.compress(content) if path.suffix.lower() == ".gz" else content)
    return path


def volume_of(solid: ImportedSolid) -> float:
    """Return the volume in m³ that the surface encloses, by the divergence theorem; no elements are made."""
    corners = solid.skin.points[solid.skin.triangles]
    return float(np.einsum("ti,ti->", np.cross(corners[:, 0], corners[:, 1]), corners[:, 2]) / 6)


def test_quads_with_numbers_of_textures_become_triangles():
    cube = read(FIELD / "surface" / "quad_cube.obj")
    assert cube.skin.areas == pytest.approx({f"face {k}": 1600e-6 for k in range(1, 7)})
    assert volume_of(cube) == pytest.approx(64e-6)
    assert cube.notes == ()


@pytest.mark.parametrize("name", ["bump.vtp", "bump_polydata.vtk"])
def test_polydata_of_vtk_is_a_surface(name: str):
    pytest.importorskip("pyvista")
    assert part_kind(FIELD / "surface" / name) == "surface"
    assert volume_of(read(FIELD / "surface" / name)) == pytest.approx(33_513e-9, rel=1e-3)


@pytest.mark.parametrize("name", ["A.PLY", "a.Off", "a.obj.gz", "a.GLB", "a.stl.GZ"])
def test_every_format_in_any_case_and_packed(tmp_path: Path, name: str):
    solid = read(write(tmp_path / name, BOX))
    if "GLB" in name:
        with pytest.warns(ModelWarning, match="y points upwards"):
            assert solid.notes
    low, high = solid.skin.corners
    sides = (40, 20, 30) if "GLB" in name else (40, 30, 20)  # glTF's y is up
    assert high - low == pytest.approx(np.array(sides) * 1e-3)
    assert volume_of(solid) == pytest.approx(VOLUME)


@pytest.mark.parametrize("first", range(6))
def test_polygons_that_are_not_convex_are_cut_within_themselves(tmp_path: Path, first: int):
    """A prism of 20 mm over an L: three quarters of a square of 40 mm, each of its ends one polygon of six corners."""
    outline = [(0, 0), (40, 0), (40, 20), (20, 20), (20, 40), (0, 40)]
    lines = [f"v {x} {y} {z}" for z in (0, 20) for x, y in outline]
    ends = [[6 + (k + first) % 6 for k in range(6)], [(5 - k + first) % 6 for k in range(6)]]
    sides = [[k, (k + 1) % 6, 6 + (k + 1) % 6, 6 + k] for k in range(6)]
    lines += ["f " + " ".join(f"{node + 1}/1/1" for node in face) for face in [*ends, *sides]]
    (tmp_path / "a.obj").write_text("\n".join(lines))
    solid = read(tmp_path / "a.obj")
    assert volume_of(solid) == pytest.approx(24e-6)
    assert sorted(solid.skin.areas.values()) == pytest.approx([400e-6] * 4 + [800e-6] * 2 + [1200e-6] * 2)


def test_groups_of_an_obj_file_name_parts_of_its_surface(tmp_path: Path):
    faces = [f"f {' '.join(str(node + 1) for node in face)}" for face in BOX.faces]
    top = BOX.face_normals[:, 2] > 0.9
    lines = [f"v {x} {y} {z}" for x, y, z in BOX.vertices]
    for name, chosen in (("skin", top), ("rest", ~top)):
        lines += [f"g {name}", *(face for face, mine in zip(faces, chosen, strict=True) if mine)]
    (tmp_path / "a.obj").write_text("\n".join(lines))
    assert read(tmp_path / "a.obj").skin.areas == pytest.approx({"skin": 1200e-6, "rest": 4000e-6})


@pytest.mark.parametrize("name", ["a.stl", "a.obj", "a.ply"])
def test_a_surface_that_is_inside_out_is_turned_and_told(tmp_path: Path, name: str):
    inverted = BOX.copy()
    inverted.invert()
    solid = read(write(tmp_path / name, inverted))
    with pytest.warns(ModelWarning, match="inside out"):
        assert volume_of(solid) == pytest.approx(VOLUME)
    assert "turned" in solid.notes[-1]


PLY = (
    "ply\nformat {}\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n{}end_header\n"
)
FACE = "element face 1\nproperty list uchar int vertex_indices\n"
DAMAGED = {
    "words.obj": b"hello",
    "missing.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 1000000000\n",
    "nowhere.obj": b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "star.obj": b"".join(b"v %d %d 0\n" % (k, k % 7) for k in range(9_000))
    + b"f "
    + b" ".join(b"%d" % k for k in range(1, 9_001)),
    "behind.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -9\n",
    "many.ply": PLY.format("ascii 1.0", 10**9, FACE).encode() + b"0 0 0\n",
    "few.ply": PLY.format("binary_little_endian 1.0", 90, FACE).encode() + bytes(100),
    "missing.ply": PLY.format("ascii 1.0", 3, FACE).encode() + b"0 0 0\n1 0 0\n0 1 0\n3 0 1 99999999\n",
    "points.ply": PLY.format("ascii 1.0", 3, "").encode() + b"0 0 0\n1 0 0\n0 1 0\n",
    "many.off": b"OFF\n1000000000 1000000000 0\n0 0 0\n",
    "negative.off": b"OFF\n-3 -1 0\n",
    "cut.glb": BOX.export(file_type="glb")[:-100],
    "head.glb": b"glTF" + b"\xff" * 100,
    "zeros.stl": bytes(300),
    "many.vtp": b'<VTKFile type="PolyData"><PolyData><Piece NumberOfPoints="1000000000" NumberOfPolys="1">',
    "words.vtp": b"<VTKFile><<<",
    "many.vtk": b"# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 1000000000 float\n",
    "words.stp": b"nonsense",
    "words.igs": b"nonsense",
    "words.brep": b"nonsense",
    "words.obj.gz": b"v 0 0 0",
    "cut.obj.gz": gzip.compress(b"v 0 0 0\n" * 1000)[:30],
}


@pytest.mark.parametrize("name", DAMAGED)
def test_damaged_files_are_refused_in_words(tmp_path: Path, name: str):
    (tmp_path / name).write_bytes(DAMAGED[name])
    unit = None if name in {"words.stp", "words.igs"} else "mm"
    with pytest.raises(PalpateError) as caught:
        ImportedSolid(tmp_path / name, unit=unit).rest()
    assert caught.value.exit_code in (2, 3)
    assert caught.value.fix


@pytest.mark.parametrize("ending", ["vtu", "vtk", "msh", "mesh", "su2"])
def test_counts_that_a_file_has_no_room_for_are_refused_unread(tmp_path: Path, ending: str):
    heads = {
        "vtu": '<VTKFile type="UnstructuredGrid"><Piece NumberOfPoints="{}" NumberOfCells="1">',
        "vtk": "# vtk DataFile Version 3.0\nx\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS {} double\n",
        "msh": "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n1 0 0 0\n$EndNodes\n",
        "mesh": "MeshVersionFormatted 1\nDimension 3\nVertices\n{}\n0 0 0 1\n",
        "su2": "NDIME= 3\nNPOIN= {}\n0 0 0\n",
    }
    for count in (10**9, -4):
        path = tmp_path / f"a.{ending}"
        path.write_text(heads[ending].format(count))
        with pytest.raises(FileFormatError, match=f"states {count:,} nodes or cells"):
            ImportedMesh(path).rest()


def test_an_index_that_is_not_there_is_named(tmp_path: Path):
    block = Block().rest()
    cells = block.tetrahedra.copy()
    cells[3, 2] = 10**9
    meshio.Mesh(block.points, [("tetra", cells)]).write(tmp_path / "a.vtu")
    with pytest.raises(FileFormatError, match="names number 1000000000, counted from 0, of"):
        ImportedMesh(tmp_path / "a.vtu").rest()
    points = block.points.copy()
    points[5] = np.inf
    meshio.Mesh(points, [("tetra", block.tetrahedra)]).write(tmp_path / "b.vtu")
    with pytest.raises(FileFormatError, match="no finite numbers"):
        ImportedMesh(tmp_path / "b.vtu").rest()


def test_a_surface_without_thickness_has_no_volume(tmp_path: Path):
    with pytest.raises(UsageError, match="no thickness"):
        read(FIELD / "stl" / "flat_sheet.stl").rest()
    tilted = trimesh.load_mesh(FIELD / "stl" / "flat_sheet.stl")
    tilted.apply_transform(trimesh.transformations.rotation_matrix(0.7, (1, 2, 0.5)))
    with pytest.raises(UsageError, match="no thickness"):
        read(write(tmp_path / "tilted.stl", tilted)).rest()


def test_a_folder_is_no_part(tmp_path: Path):
    for name in ("a.stl", "a.step", "a.vtu"):
        (tmp_path / name).mkdir()
        kind = ImportedMesh if name == "a.vtu" else ImportedSolid
        with pytest.raises(UsageError, match="is a folder"):
            kind(tmp_path / name, **({} if name == "a.step" else {"unit": "mm"}))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_or_a_device_is_no_part(tmp_path: Path):
    os.mkfifo(tmp_path / "pipe.stl")
    (tmp_path / "zero.obj").symlink_to("/dev/zero")
    for name in ("pipe.stl", "zero.obj"):
        with pytest.raises(UsageError, match="a device, a pipe or a socket"):
            read(tmp_path / name)


@pytest.mark.full
def test_cad_files_of_any_case_and_packed(tmp_path: Path):
    block = ImportedSolid(FIELD / "step" / "BLOCK.STEP")
    assert block.rest().volume == pytest.approx(32e-6)
    assert {"top", "bottom"} <= set(block.surfaces)
    (tmp_path / "a.Stp.gz").write_bytes(gzip.compress((FIELD / "step" / "BLOCK.STEP").read_bytes()))
    assert ImportedSolid(tmp_path / "a.Stp.gz").rest().volume == pytest.approx(32e-6)


@pytest.mark.full
def test_faces_without_a_solid_are_sewn_into_one_and_told(tmp_path: Path):
    from netgen.occ import Box, Compound, Pnt, Z

    box = Box(Pnt(0, 0, 0), Pnt(40, 40, 20))
    box.faces.Max(Z).name = "lid"
    Compound(list(box.faces)).WriteStep(str(tmp_path / "faces.step"))
    shutil.copy(FIELD / "step" / "faces.igs", tmp_path / "faces.IGS")
    for name in ("faces.step", "faces.IGS"):
        solid = ImportedSolid(tmp_path / name)
        with pytest.warns(ModelWarning, match="6 faces and no solid: they were sewn into a solid"):
            assert solid.surfaces
        assert solid.rest().volume == pytest.approx(32e-6)
    assert "lid" in ImportedSolid(tmp_path / "faces.step").surfaces


def test_a_brep_file_needs_a_unit(tmp_path: Path):
    from netgen.occ import Box, Pnt

    Box(Pnt(0, 0, 0), Pnt(4, 4, 2)).WriteBrep(str(tmp_path / "a.brep"))
    with pytest.raises(UsageError, match="unit"):
        ImportedSolid(tmp_path / "a.brep")
    assert ImportedSolid(tmp_path / "a.brep", unit="cm").rest().volume == pytest.approx(32e-6)


def test_two_solids_of_one_name_are_two_regions(tmp_path: Path):
    from netgen.occ import Box, Compound, Pnt

    solids = [Box(Pnt(0, 0, z), Pnt(40, 40, z + 20)) for z in (0, 20)]
    for solid in solids:
        solid.solids.name = "foam"
    Compound(solids).WriteStep(str(tmp_path / "twins.step"))
    part = ImportedSolid(tmp_path / "twins.step")
    with pytest.warns(ModelWarning, match="2 solids are called 'foam'"):
        assert part.regions == ("foam 1", "foam 2")
    assert part.rest().region_volumes == pytest.approx({"foam 1": 32e-6, "foam 2": 32e-6})


@pytest.mark.full
def test_details_far_below_the_elements_get_no_elements_of_their_own():
    """Fillets of 0.2 mm on the edges of a block take away (1 − π/4) r² of area each, and less at the corners."""
    part = ImportedSolid(FIELD / "step" / "small_fillets.step")
    with pytest.warns(ModelWarning, match="Details far below the elements of 6.7 mm"):
        mesh = part.rest()
    assert len(mesh.triangles) < 2_000
    edges = 4 * (40 + 40 + 20) * 1e-3
    assert mesh.volume == pytest.approx(32e-6 - (1 - np.pi / 4) * 0.2e-3**2 * edges, rel=5e-4)


def test_curvature_of_the_body_itself_is_no_detail(tmp_path: Path):
    from netgen.occ import Box, Cylinder, Pnt, Z

    rod = Cylinder(Pnt(0, 0, 0), Z, r=3, h=200)
    bored = Box(Pnt(0, 0, 0), Pnt(40, 40, 20)) - Cylinder(Pnt(20, 20, 0), Z, r=1.5, h=20)
    for name, solid in (("rod", rod), ("bored", bored)):
        solid.WriteStep(str(tmp_path / f"{name}.step"))
        assert ImportedSolid(tmp_path / f"{name}.step").notes == ()


def test_a_mesh_of_gmsh_in_format_4_0():
    mesh = ImportedMesh(FIELD / "mesh" / "version40.msh", unit="mm")
    assert mesh.rest().volume == pytest.approx(32e-6)
    assert sorted(mesh.rest().areas.values()) == pytest.approx([800e-6] * 4 + [1600e-6] * 2)


def test_bulk_data_without_its_first_line():
    mesh = ImportedMesh(FIELD / "mesh" / "no_begin_bulk.bdf", unit="mm")
    assert sorted(mesh.rest().region_volumes.values()) == pytest.approx([8e-6, 32e-6])


def test_a_mesh_of_named_surfaces_alone_says_why(tmp_path: Path):
    block = Block().rest()
    tags = block.surface_of + 1
    meshio.Mesh(
        block.points,
        [("triangle", block.triangles)],
        cell_data={"gmsh:physical": [tags], "gmsh:geometrical": [tags]},
        field_data={"held": [1, 2]},
    ).write(tmp_path / "a.msh", file_format="gmsh22", binary=False)
    with pytest.raises(UsageError, match="no cells of volume") as caught:
        ImportedMesh(tmp_path / "a.msh").rest()
    assert "groups of surfaces alone ('held'" in caught.value.why
    assert "Physical Volume" in caught.value.fix


def test_fields_that_are_no_labels_are_refused_by_name(tmp_path: Path):
    block = Block().rest()
    count = len(block.tetrahedra)
    data = {"fibre": [np.tile([0, 0, 1], (count, 1))], "share": [np.full(count, 0.5)]}
    meshio.Mesh(block.points, [("tetra", block.tetrahedra)], cell_data=data).write(tmp_path / "a.vtu")
    assert ImportedMesh(tmp_path / "a.vtu").regions == ("body",)
    for name, said in (("fibre", "a vector or a tensor"), ("share", "not whole")):
        with pytest.raises(UsageError, match="can't tell regions apart") as caught:
            assert ImportedMesh(tmp_path / "a.vtu", labels=name).regions
        assert said in caught.value.why


def test_a_binary_head_that_promises_more_is_refused(tmp_path: Path):
    head = b"$MeshFormat\n4.1 1 8\n\x01\0\0\0\n$EndMeshFormat\n$Nodes\n"
    (tmp_path / "a.msh").write_bytes(head + struct.pack("<4Q", 2**60, 2**60, 1, 2**60) + b"\n$EndNodes\n")
    with pytest.raises(FileFormatError, match="room for"):
        ImportedMesh(tmp_path / "a.msh").rest()
