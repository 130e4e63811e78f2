"""Volume meshes in the forms that programs write: every label becomes a region or surface, no cell is lost.

The body is a block of 40 × 40 × 20 mm, 32,000 mm³; its upper quarter, 8,000 mm³, is another material.
"""

from __future__ import annotations

import itertools
import struct
import sys
from pathlib import Path

import meshio
import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.physics.advice import ModelWarning
from palpate.physics.shapes import ImportedMesh
from palpate.physics.shapes import vtk_file as reader

SIZE = np.array([40.0, 40.0, 20.0])
COUNT = (2, 2, 4)
AXES = [np.linspace(0, length, n + 1) for length, n in zip(SIZE, COUNT, strict=True)]
POINTS = np.stack(np.meshgrid(*AXES, indexing="ij"), axis=-1).reshape(-1, 3)
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
NUMBER = np.arange(len(POINTS)).reshape([n + 1 for n in COUNT])
HEXES = np.array(
    [
        [NUMBER[i + a, j + b, k + c] for a, b, c in CORNERS]
        for i, j, k in itertools.product(*(range(n) for n in COUNT))
    ]
)
# six tetrahedra around the diagonal from corner 0 to corner 6 of each (Kuhn)
KUHN = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
TETS = HEXES[:, np.array(KUHN)].reshape(-1, 4)
UPPER = POINTS[TETS].mean(axis=1)[:, 2] > 15
REGIONS = {False: 24e-6, True: 8e-6}  # m³
SIDES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def outer(level: float) -> np.ndarray:
    """Triangles of the plane z = level that tetrahedra have there."""
    faces = np.unique(np.sort(TETS[:, SIDES].reshape(-1, 3), axis=1), axis=0)
    return faces[(POINTS[faces][:, :, 2] == level).all(axis=1)]


BOTTOM, TOP = outer(0.0), outer(20.0)


def mesh_of(path: Path, **more) -> ImportedMesh:
    return ImportedMesh(path, unit="mm", **more)


def volumes(shape: ImportedMesh) -> dict[str, float]:
    return {name: round(1e9 * value, 6) for name, value in shape.rest().region_volumes.items()}


def areas(shape: ImportedMesh) -> dict[str, float]:
    return {name: round(1e6 * value, 6) for name, value in shape.rest().areas.items()}


def refused(shape: ImportedMesh) -> str:
    with pytest.raises(UsageError) as caught:
        shape.mesh()
    assert caught.value.fix
    return str(caught.value)


def rows(numbers: np.ndarray, start: int = 1) -> str:
    return "".join(", ".join(map(str, [start + i, *row])) + "\n" for i, row in enumerate(numbers.tolist()))


def nodes(points: np.ndarray = POINTS) -> str:
    return "*NODE\n" + rows(points)


# Abaqus and CalculiX


def write(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def elements(chosen: np.ndarray, start: int, options: str) -> str:
    return f"*ELEMENT, TYPE=C3D4{options}\n" + rows(TETS[chosen] + 1, start)


def test_element_sets_sections_and_node_sets(tmp_path: Path):
    count = int((~UPPER).sum())
    base = np.unique(BOTTOM) + 1
    text = (
        "*HEADING\n** a comment\n"
        + nodes()
        + elements(~UPPER, 1, ", ELSET=FAT")
        + elements(UPPER, count + 1, ",\n elset=Skin")
        + "*NSET, NSET=BASE\n"
        + "".join(f"{n},\n" for n in base.tolist())
        + f"*NSET, NSET=ALL, GENERATE\n1, {len(POINTS)}, 1\n"
        + "*ELSET, ELSET=EVERYTHING\nFAT, SKIN\n*ELSET, ELSET=_lid_S1, INTERNAL\n1, 2\n"
        + "*SOLID SECTION, ELSET=SKIN, MATERIAL=M\n"
    )
    shape = mesh_of(write(tmp_path / "a.inp", text))
    assert volumes(shape) == {"FAT": 24000, "Skin": 8000}
    assert areas(shape)["BASE"] == 1600
    assert len(shape.surfaces) == 6
    assert "ALL" not in shape.surfaces


def test_surfaces_of_element_faces(tmp_path: Path):
    """All faces S1 … S4 of a set, or of elements by number; hexahedra and their numbering of faces."""
    hexes = "*ELEMENT, TYPE=C3D8R, ELSET=BODY\n" + rows(HEXES + 1)
    low, high = (np.flatnonzero(POINTS[HEXES].mean(axis=1)[:, 2] == z) + 1 for z in (2.5, 17.5))
    sides = np.flatnonzero(POINTS[HEXES].mean(axis=1)[:, 0] == 10) + 1
    text = (
        nodes()
        + hexes
        + "*ELSET, ELSET=_T\n"
        + "".join(f"{n}\n" for n in high.tolist())
        + "*SURFACE, NAME=LID, TYPE=ELEMENT\n_T, S2\n*SURFACE, NAME=FLOOR\n"
        + "".join(f"{n}, S1\n" for n in low.tolist())
        + "*SURFACE, NAME=LEFT\n"
        + "".join(f"{n}, S6\n" for n in sides.tolist())
    )
    shape = mesh_of(write(tmp_path / "a.inp", text))
    named = areas(shape)
    assert {name: named[name] for name in ("LID", "FLOOR", "LEFT")} == {
        "LID": 1600,
        "FLOOR": 1600,
        "LEFT": 800,
    }
    assert volumes(shape) == {"BODY": 32000}
    assert shape.notes == (f"{len(HEXES)} hexahedra were split into tetrahedra.",)


def test_a_surface_of_an_assembly_has_all_of_its_sides(tmp_path: Path):
    part = "*PART, NAME=BLOCK\n" + nodes() + "*ELEMENT, TYPE=C3D8R\n" + rows(HEXES + 1) + "*END PART\n"
    placed = "*ASSEMBLY, NAME=A\n*INSTANCE, NAME=one, PART=BLOCK\n*END INSTANCE\n"
    for side, level in (("S1", 2.5), ("S2", 17.5)):
        chosen = np.flatnonzero(POINTS[HEXES].mean(axis=1)[:, 2] == level) + 1
        placed += f"*ELSET, ELSET=_ends_{side}, INTERNAL, INSTANCE=one\n" + "".join(
            f"{n}\n" for n in chosen.tolist()
        )
    placed += "*SURFACE, NAME=ends, TYPE=ELEMENT\n_ends_S1, S1\n_ends_S2, S2\n*END ASSEMBLY\n"
    assert areas(mesh_of(write(tmp_path / "a.inp", part + placed)))["ends"] == 2 * 1600


def test_instances_stand_where_the_assembly_says(tmp_path: Path):
    """Two of one part, the second turned by 180° about an axis through the end of the first's top."""
    part = "*PART, NAME=BLOCK\n" + nodes() + elements(UPPER | ~UPPER, 1, "") + "*END PART\n"
    placed = (
        "*ASSEMBLY, NAME=A\n*INSTANCE, NAME=one, PART=BLOCK\n*END INSTANCE\n"
        "*INSTANCE, NAME=two, PART=block\n0, 10, 10\n0, 0, 20, 1, 0, 20, 180\n*END INSTANCE\n"
        "*NSET, NSET=held, INSTANCE=one\n" + "".join(f"{n}\n" for n in (np.unique(BOTTOM) + 1).tolist())
    )
    apart = mesh_of(write(tmp_path / "a.inp", part + placed + "*END ASSEMBLY\n"))
    assert volumes(apart) == {"one": 32000, "two": 32000}
    mesh = apart.rest()
    # a turn about x through z = 20: z' = 40 - (z + 10), y' = -(y + 10)
    second = mesh.points[np.unique(mesh.tetrahedra[mesh.region_of == 1])]
    assert np.allclose([second.min(axis=0), second.max(axis=0)], [[0, -0.05, 0.01], [0.04, -0.01, 0.03]])
    assert areas(apart)["held"] == 1600
    missing = part + placed.replace("PART=block", "PART=lid")
    assert "the part 'lid', which is not there" in refused(mesh_of(write(tmp_path / "b.inp", missing)))


def test_parts_whose_equal_nodes_meet_are_bonded(tmp_path: Path):
    part = "*PART, NAME=BLOCK\n" + nodes() + elements(UPPER | ~UPPER, 1, "") + "*END PART\n"
    placed = "*ASSEMBLY\n*INSTANCE, NAME=a, PART=BLOCK\n*END INSTANCE\n*INSTANCE, NAME=b, PART=BLOCK\n{}\n"
    shape = mesh_of(write(tmp_path / "a.inp", part + placed.format("0, 0, 20")))
    with pytest.warns(ModelWarning, match="9 nodes lie on others"):
        assert len(shape.surfaces) == 6
    assert volumes(shape) == {"a": 32000, "b": 32000}
    # moved by half an element the triangles no longer fit
    said = refused(mesh_of(write(tmp_path / "b.inp", part + placed.format("10, 0, 20"))))
    assert "touch around" in said
    assert "share no nodes" in said


def test_included_files_belong_to_the_body(tmp_path: Path):
    write(tmp_path / "nodes.inp", nodes())
    path = write(tmp_path / "a.inp", "*INCLUDE, INPUT=nodes.inp\n" + elements(UPPER | ~UPPER, 1, ""))
    shape = mesh_of(path)
    assert volumes(shape) == {"body": 32000}
    write(tmp_path / "nodes.inp", nodes(POINTS * [1, 1, 1.5]))
    assert mesh_of(path).digest != shape.digest
    (tmp_path / "nodes.inp").unlink()
    assert "includes" in refused(mesh_of(path))


def test_keywords_that_would_change_the_mesh_are_refused(tmp_path: Path):
    text = nodes() + elements(UPPER, 1, "")
    assert "line 47: *ELGEN is not read" in refused(
        mesh_of(write(tmp_path / "a.inp", nodes() + "*ELGEN\n1, 2\n"))
    )
    polar = text.replace("*NODE", "*NODE, SYSTEM=C")
    assert "rectangular" in refused(mesh_of(write(tmp_path / "b.inp", polar)))
    layer = text + "*ELEMENT, TYPE=COH3D8\n" + rows(HEXES[:3] + 1, 900)
    assert "3 cells of the kind 'solid COH3D8'" in refused(mesh_of(write(tmp_path / "c.inp", layer)))


# Gmsh


def gmsh_41(path: Path, names: dict, groups: dict, *, binary: bool = False) -> Path:
    """Faces 1 (bottom) and 2 (top) and the volumes 1 and 2; `groups` holds the numbers of groups of each entity."""
    order = [(2, 1, 2, BOTTOM), (2, 2, 2, TOP), (3, 1, 4, TETS[~UPPER]), (3, 2, 4, TETS[UPPER])]
    out = bytearray()

    def put(code: str, *values: float) -> None:
        out.extend(
            struct.pack(f"<{len(values)}{code}", *values) if binary else " ".join(map(repr, values)).encode()
        )
        out.extend(b"" if binary else b"\n")

    def section(name: str, fill) -> None:
        out.extend(f"${name}\n".encode())
        fill()
        out.extend(f"\n$End{name}\n".encode())

    def entities() -> None:
        put("Q", 0, 0, 2, 2)
        for dimension, entity in ((2, 1), (2, 2), (3, 1), (3, 2)):
            tags = groups.get((dimension, entity), [])
            put("i", entity)
            put("d", 0.0, 0.0, 0.0, *SIZE.tolist())
            put("Q", len(tags))
            put("i", *tags)
            put("Q", 1)
            put("i", 7)

    def all_nodes() -> None:
        put("Q", 1, len(POINTS), 1, len(POINTS))
        put("i", 3, 1, 1)  # with places on the volume behind the coordinates
        put("Q", len(POINTS))
        put("Q", *range(1, len(POINTS) + 1))
        put("d", *np.column_stack([POINTS, POINTS]).ravel().tolist())

    def all_elements() -> None:
        put("Q", len(order), 0, 1, 9)
        for dimension, entity, kind, cells in order:
            put("i", dimension, entity, kind)
            put("Q", len(cells))
            put("Q", *(n for i, row in enumerate((cells + 1).tolist()) for n in (i + 1, *row)))

    out += f"$MeshFormat\n4.1 {int(binary)} 8\n".encode() + (struct.pack("<i", 1) + b"\n" if binary else b"")
    out += b"$EndMeshFormat\n"
    if names:
        lines = "".join(f'{dimension} {tag} "{name}"\n' for (dimension, tag), name in names.items())
        out += f"$PhysicalNames\n{len(names)}\n{lines}$EndPhysicalNames\n".encode()
    section("Entities", entities)
    section("Nodes", all_nodes)
    section("Elements", all_elements)
    path.write_bytes(out)
    return path


NAMES = {(2, 1): "held", (2, 2): "touch", (2, 4): "everything outside", (3, 3): "fat"}


@pytest.mark.parametrize("binary", [False, True])
def test_an_entity_may_be_in_several_groups_or_none(tmp_path: Path, binary: bool):
    groups = {(2, 1): [4, 1], (2, 2): [2, 4], (3, 1): [3]}
    shape = mesh_of(gmsh_41(tmp_path / "a.msh", NAMES, groups, binary=binary))
    assert volumes(shape) == {"fat": 24000, "body": 8000}
    named = areas(shape)
    assert (named.pop("held"), named.pop("touch")) == (1600, 1600)
    assert sorted(named.values()) == [800] * 4
    shape = mesh_of(gmsh_41(tmp_path / "b.msh", {(2, 1): "held"}, {(2, 1): [-1], (2, 2): [9]}, binary=binary))
    assert {"held", "surface 9"} < set(shape.surfaces)


def test_without_groups_the_entities_of_the_geometry_are_named(tmp_path: Path):
    shape = mesh_of(gmsh_41(tmp_path / "a.msh", {}, {}))
    assert volumes(shape) == {"region 1": 24000, "region 2": 8000}
    assert {"surface 1", "surface 2"} < set(shape.surfaces)


def test_damaged_gmsh_files_are_refused(tmp_path: Path):
    whole = gmsh_41(tmp_path / "a.msh", NAMES, {}).read_bytes()
    for cut in (0.3, 0.7, 0.95):
        (tmp_path / "b.msh").write_bytes(whole[: int(cut * len(whole))])
        assert "corrupt or cut short" in refused(mesh_of(tmp_path / "b.msh"))
    (tmp_path / "c.msh").write_bytes(whole + b"$PartitionedEntities\n$EndPartitionedEntities\n")
    assert "partitioned" in refused(mesh_of(tmp_path / "c.msh"))


def test_format_2_repeats_elements_for_each_group(tmp_path: Path):
    """Gmsh writes an element of two groups twice; the body is there once, and the smaller group names it."""
    meshio.Mesh(
        POINTS,
        [("tetra", TETS), ("tetra", TETS[UPPER]), ("triangle", BOTTOM)],
        cell_data={
            key: [np.full(len(TETS), 1), np.full(int(UPPER.sum()), 2), np.full(len(BOTTOM), 5)]
            for key in ("gmsh:physical", "gmsh:geometrical")
        },
        field_data={"whole": np.array([1, 3]), "skin": np.array([2, 3]), "held": np.array([5, 2])},
    ).write(tmp_path / "a.msh", file_format="gmsh22", binary=False)
    shape = mesh_of(tmp_path / "a.msh")
    assert volumes(shape) == {"whole": 24000, "skin": 8000}
    assert areas(shape)["held"] == 1600


# TetGen, Nastran, and cell data of any name


@pytest.mark.parametrize("first", [0, 1])
def test_attributes_and_markers_of_tetgen(tmp_path: Path, first: int):
    def lines(table: list) -> str:
        return "".join(f"{first + i} " + " ".join(map(str, row)) + "\n" for i, row in enumerate(table))

    write(tmp_path / "a.node", f"# made by hand\n{len(POINTS)} 3 0 0\n" + lines(POINTS.tolist()))
    table = [[*row, mark] for row, mark in zip((TETS + first).tolist(), (UPPER + 1).tolist(), strict=True)]
    write(tmp_path / "a.ele", f"{len(TETS)} 4 1\n" + lines(table))
    assert volumes(mesh_of(tmp_path / "a.node")) == {"region 1": 24000, "region 2": 8000}
    marks = [[*row, 7] for row in (BOTTOM + first).tolist()] + [[*row, 0] for row in (TOP + first).tolist()]
    write(tmp_path / "a.face", f"{len(marks)} 1\n" + lines(marks))
    shape = mesh_of(tmp_path / "a.ele")
    assert areas(shape)["surface 7"] == 1600
    assert len(shape.surfaces) == 6
    for ending in ("node", "ele", "face"):
        (tmp_path / f"a.{ending}").rename(tmp_path / f"A.{ending.upper()}")
    assert areas(mesh_of(tmp_path / "A.ELE"))["surface 7"] == 1600


def test_properties_of_nastran(tmp_path: Path):
    path = tmp_path / "a.bdf"
    meshio.Mesh(POINTS, [("tetra", TETS)], cell_data={"nastran:ref": [UPPER + 11]}).write(path)
    assert volumes(mesh_of(path)) == {"region 11": 24000, "region 12": 8000}
    text = path.read_text()
    path.write_text(
        '$HMNAME PROP                  11"fat"\n$ Femap with NX Nastran Property 12 : skin\n' + text
    )
    assert volumes(mesh_of(path)) == {"fat": 24000, "skin": 8000}
    system = "GRID,900,5,1.,2.,3.\n"
    path.write_text(text.replace("BEGIN BULK\n", "BEGIN BULK\n" + system, 1))
    assert "system 5, which is not read" in refused(mesh_of(path))


def test_cells_that_are_not_read_are_refused_with_their_number(tmp_path: Path):
    path = tmp_path / "a.bdf"
    meshio.Mesh(POINTS, [("tetra", TETS)]).write(path)
    text = path.read_text()
    path.write_text(text.replace("CTETRA", "CTETRA*", 3))
    assert f"3 of {len(TETS)} cells of volume" in refused(mesh_of(path))


@pytest.mark.full
@pytest.mark.parametrize("name", ["tissue", "PhysicalIds", "Zone", "attribute"])
@pytest.mark.parametrize("kind", [np.int32, np.uint8, float])
def test_whole_numbers_of_any_name_are_labels(tmp_path: Path, name: str, kind: type):
    data = {
        "stress": [np.linspace(0, 1.7, len(TETS))],
        "GlobalCellIds": [np.arange(len(TETS)) // 50],
        "constant": [np.ones(len(TETS), dtype=int)],
        name: [(UPPER + 3).astype(kind)],
    }
    meshio.Mesh(POINTS, [("tetra", TETS)], cell_data=data).write(tmp_path / "a.vtu")
    assert volumes(mesh_of(tmp_path / "a.vtu")) == {"region 3": 24000, "region 4": 8000}


def test_of_two_labels_one_is_chosen_and_told(tmp_path: Path):
    half = (POINTS[TETS].mean(axis=1)[:, 0] > 20).astype(int)
    meshio.Mesh(POINTS, [("tetra", TETS)], cell_data={"tissue": [UPPER + 1], "half": [half + 1]}).write(
        tmp_path / "a.vtu"
    )
    shape = mesh_of(tmp_path / "a.vtu")
    with pytest.warns(ModelWarning, match="'half' could be meant too"):
        assert volumes(shape) == {"region 1": 24000, "region 2": 8000}
    other = mesh_of(tmp_path / "a.vtu", labels="half")
    assert volumes(other) == {"region 1": 16000, "region 2": 16000}
    assert other.describe()["labels"] == "half"
    assert "Its cell data are: tissue, half" in refused(mesh_of(tmp_path / "a.vtu", labels="organ"))


# other kinds of cells


def test_hexahedra_and_tetrahedra_fit_each_other(tmp_path: Path):
    """Whichever diagonals the tetrahedra have: a node that lies on a face or edge of the other side is a hole."""
    low = POINTS[HEXES].mean(axis=1)[:, 2] < 10
    for turn in (KUHN, [tuple((k + 1) % 4 + 4 * (k // 4) for k in row) for row in KUHN]):
        tets = HEXES[~low][:, np.array(turn)].reshape(-1, 4)
        path = tmp_path / "a.vtu"
        meshio.Mesh(POINTS, [("hexahedron", HEXES[low]), ("tetra", tets)]).write(path)
        shape = mesh_of(path)
        assert shape.rest().volume == pytest.approx(32e-6, rel=1e-12)
        assert sorted(areas(shape).values()) == [800] * 4 + [1600] * 2
        assert f"{low.sum()} hexahedra were split" in shape.notes[0]


def wedges(cells: np.ndarray) -> np.ndarray:
    return np.concatenate([cells[:, [0, 1, 2, 4, 5, 6]], cells[:, [0, 2, 3, 4, 6, 7]]])


@pytest.mark.parametrize("turned", [False, True])
def test_wedges_of_both_conventions(tmp_path: Path, turned: bool):
    cells = wedges(HEXES)
    meshio.Mesh(POINTS, [("wedge", cells[:, [3, 4, 5, 0, 1, 2]] if turned else cells)]).write(
        tmp_path / "a.vtu"
    )
    shape = mesh_of(tmp_path / "a.vtu")
    assert shape.rest().volume == pytest.approx(32e-6, rel=1e-12)
    assert len(shape.rest().tetrahedra) == 3 * len(cells)
    assert len(shape.surfaces) == 6


def test_pyramids_and_hexahedra_with_a_corner_twice(tmp_path: Path):
    faces = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    centres = POINTS[HEXES].mean(axis=1)
    apex = len(POINTS) + np.arange(len(HEXES))
    # seen from the apex, the base runs counter-clockwise
    pyramids = np.concatenate([np.column_stack([HEXES[:, face[::-1]], apex]) for face in faces])
    meshio.Mesh(np.concatenate([POINTS, centres]), [("pyramid", pyramids)]).write(tmp_path / "a.vtu")
    shape = mesh_of(tmp_path / "a.vtu")
    assert shape.rest().volume == pytest.approx(32e-6, rel=1e-12)
    assert len(shape.surfaces) == 6
    collapsed = wedges(HEXES)[:, [0, 1, 2, 2, 3, 4, 5, 5]]
    meshio.Mesh(POINTS, [("hexahedron", collapsed)]).write(tmp_path / "b.vtu")
    assert mesh_of(tmp_path / "b.vtu").rest().volume == pytest.approx(32e-6, rel=1e-12)


def test_regions_of_split_cells(tmp_path: Path):
    upper = POINTS[HEXES].mean(axis=1)[:, 2] > 15
    quads = HEXES[upper][:, 4:]
    meshio.Mesh(
        POINTS,
        [("hexahedron", HEXES), ("quad", quads)],
        cell_data={"medit:ref": [upper + 1, np.full(len(quads), 6)]},
    ).write(tmp_path / "a.mesh")
    shape = mesh_of(tmp_path / "a.mesh")
    assert volumes(shape) == {"region 1": 24000, "region 2": 8000}
    assert areas(shape)["surface 6"] == 1600


def test_twin_nodes_are_united(tmp_path: Path):
    lid = POINTS + np.array([0, 0, 20])
    meshio.Mesh(
        np.concatenate([POINTS, lid]),
        [("tetra", np.concatenate([TETS, TETS + len(POINTS)]))],
        cell_data={"part": [np.repeat([1, 2], len(TETS))]},
    ).write(tmp_path / "a.vtu")
    with pytest.warns(ModelWarning, match="9 nodes lie on others, at most 0 mm apart"):
        surfaces = mesh_of(tmp_path / "a.vtu").surfaces
    assert len(surfaces) == 6
    assert volumes(mesh_of(tmp_path / "a.vtu")) == {"region 1": 32000, "region 2": 32000}


# forms of VTK, and numbers in other files


def vtk_grid():
    pyvista = pytest.importorskip("pyvista")
    grid = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: TETS}, POINTS)
    grid.cell_data["tissue"] = (UPPER + 1).astype(np.int32)
    return grid


def write_lz4(path: Path) -> None:
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetCompressorTypeToLZ4()
    writer.SetInputData(vtk_grid())
    writer.Write()


def write_with_text(path: Path) -> None:
    grid = vtk_grid()
    grid.field_data["title"] = ["two layers"]
    grid.save(path)


def write_legacy(path: Path) -> None:
    vtk_grid().save(path)  # VTK 9 writes version 5.1


FORMS = {"lz4.vtu": write_lz4, "text.vtu": write_with_text, "legacy.vtk": write_legacy}


@pytest.mark.grid
@pytest.mark.parametrize("name", FORMS)
def test_forms_that_only_vtk_reads(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch):
    FORMS[name](tmp_path / name)
    assert volumes(mesh_of(tmp_path / name)) == {"region 1": 24000, "region 2": 8000}
    monkeypatch.setattr(reader, "find_spec", lambda package: None)
    (tmp_path / "other").mkdir()
    FORMS[name](tmp_path / "other" / name)
    said = refused(mesh_of(tmp_path / "other" / name, labels="tissue"))
    assert "pip install 'palpate[results]'" in said


def test_boxes_of_vtk(tmp_path: Path):
    pyvista = pytest.importorskip("pyvista")
    image = pyvista.ImageData(dimensions=(3, 3, 3), spacing=(20, 20, 10))
    grid = image.cast_to_unstructured_grid()
    grid.save(tmp_path / "a.vtu")
    assert mesh_of(tmp_path / "a.vtu").rest().volume == pytest.approx(32e-6)


def test_numbers_in_another_file_need_a_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    text = (
        '<?xml version="1.0"?><Xdmf Version="3.0"><Domain><Grid Name="mesh" GridType="Uniform">'
        '<Topology TopologyType="Tetrahedron" NumberOfElements="1"><DataItem DataType="Int" Dimensions="1 4" '
        'Format="HDF" Precision="8">far.h5:/data0</DataItem></Topology><Geometry GeometryType="XYZ"><DataItem '
        'DataType="Float" Dimensions="4 3" Format="HDF" Precision="8">far.h5:/data1</DataItem></Geometry>'
        "</Grid></Domain></Xdmf>"
    )
    path = write(tmp_path / "a.xdmf", text)
    monkeypatch.setitem(sys.modules, "h5py", None)
    alone = mesh_of(path)
    said = refused(alone)
    assert "needs the package h5py" in said
    assert "pip install h5py" in said
    write(tmp_path / "far.h5", "numbers")
    assert mesh_of(path).digest != alone.digest
