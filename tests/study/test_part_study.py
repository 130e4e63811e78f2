"""Studies of parts from files: what a file says, names for surfaces, all laws, and the whole way once."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
import trimesh

from few_solves import FEW_SOLVES
from palpate import materials as laws
from palpate.errors import StudyError, UsageError
from palpate.physics.shapes import Block
from palpate.physics.shapes.sample_part import kidney_surface, write_sample_part
from palpate.study import Study, read_study, to_toml
from palpate.study.improve_study import conclude, improve_study
from palpate.study.material_records import SolidMaterialRecord
from palpate.study.part_records import PartRecord
from palpate.study.part_study import part_study
from palpate.study.run import Paths, load_model, report_study
from palpate.surrogates import Surrogate

SIZE = (0.04, 0.03, 0.02)
HEAD = """
name = "pad"
[body]
kind = "part"
file = "pad.stl"
unit = "mm"
fixed = "table"
material = { young = "9 kPa" }
surfaces = [
    { name = "table", below = "1 mm" },
    { name = "touched", facing = "up" },
    { name = "rim" },
]
[interaction]
touches = "touched"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A folder with a block as an STL file in mm, as a mesh of two regions, and as a STEP file."""
    from netgen.occ import Box, Pnt

    path = tmp_path_factory.mktemp("parts")
    mesh = Block(size=SIZE, element=0.02).rest()
    meshio.Mesh(1e3 * mesh.points, [("triangle", mesh.triangles)]).write(path / "pad.stl", binary=True)
    upper = (mesh.points[mesh.tetrahedra].mean(axis=1)[:, 2] > 0.01).astype(int) + 1
    meshio.Mesh(1e3 * mesh.points, [("tetra", mesh.tetrahedra)], cell_data={"medit:ref": [upper]}).write(
        path / "pad.mesh"
    )
    Box(Pnt(0, 0, 0), Pnt(40, 30, 20)).WriteStep(str(path / "pad.step"))
    return path


def study_of(folder: Path, text: str) -> Study:
    path = folder / "s.toml"
    path.write_text(text, encoding="utf-8")
    return read_study(path)


def areas(body: PartRecord) -> dict[str, float]:
    return {face.name: 1e6 * face.area for face in body.shape().faces}


def test_surfaces_are_named_by_plane_direction_and_what_is_left(folder):
    found = areas(study_of(folder, HEAD).body)
    assert found == pytest.approx({"table": 1200, "touched": 1200, "rim": 2 * 20 * (40 + 30)})


@pytest.mark.grid
@pytest.mark.parametrize(
    ("bounds", "area"),
    [
        ('facing = "up", above = "1 mm"', 1200),
        ('axis = "x", above = "39.9 mm"', 600),
        ('lower = ["-1 mm", "-1 mm", "-1 mm"], upper = ["41 mm", "0.1 mm", "21 mm"]', 800),
        ('facing = "-y"', 800),
        ("facing = [1, 0, 1], within = 46", 600 + 1200),
        ('facing = "up", within = 180, above = "19.9 mm"', 1200),
    ],
)
@pytest.mark.parametrize("file", ["pad.stl", "pad.step"])
def test_bounds_of_a_surface(folder, bounds, area, file):
    surface = tomllib.loads(f"mine = {{ {bounds} }}")["mine"] | {"name": "mine"}
    unit = None if file == "pad.step" else "mm"
    body = PartRecord(
        file=str(folder / file), unit=unit, material="ecoflex 00-30", fixed="", surfaces=[surface]
    )
    assert areas(body)["mine"] == pytest.approx(area)


def test_a_file_is_found_beside_its_study_and_the_text_reads_back(folder, tmp_path):
    study = study_of(folder, HEAD)
    assert study.body.file == str(folder / "pad.stl")
    path = tmp_path / "elsewhere.toml"
    path.write_text(to_toml(study), encoding="utf-8")
    assert read_study(path) == study
    assert 'young = "9 kPa"' in path.read_text(encoding="utf-8")


def test_regions_have_materials_of_their_own(folder):
    text = HEAD.replace("pad.stl", "pad.mesh").replace(
        'material = { young = "9 kPa" }',
        'material = { young = "9 kPa" }\nmaterials = { "region 2" = "ecoflex 00-30" }',
    )
    body = study_of(folder, text).body.build()
    assert body.materials["region 1"].young == pytest.approx(9e3)
    assert body.materials["region 2"] == laws.named_material("ecoflex 00-30")
    assert read_study_again(folder, text) == study_of(folder, text)


def read_study_again(folder: Path, text: str) -> Study:
    path = folder / "again.toml"
    path.write_text(to_toml(study_of(folder, text)), encoding="utf-8")
    return read_study(path)


NEO = laws.NeoHookean(9e3, 0.4, name="own material")


@pytest.mark.parametrize(
    ("table", "material"),
    [
        ({"young": 9e3, "poisson": 0.4}, NEO),
        (
            {"law": "mooney-rivlin", "c10": 1e3, "c01": 200.0, "bulk": "1 MPa"},
            laws.MooneyRivlin(1e3, 200.0, 1e6, name="own material"),
        ),
        (
            {"law": "yeoh", "c10": 1e3, "c20": 20.0, "c30": 1.0, "poisson": 0.4},
            laws.Yeoh.with_poisson(0.4, c10=1e3, c20=20.0, c30=1.0, name="own material"),
        ),
        (
            {"law": "ogden", "mu": ["3 kPa", 100.0], "alpha": [1.3, 5.0], "bulk": 1e6},
            laws.Ogden((3e3, 100.0), (1.3, 5.0), 1e6, name="own material"),
        ),
        (
            {"law": "st-venant-kirchhoff", "young": 9e3, "poisson": 0.4},
            laws.StVenantKirchhoff(9e3, 0.4, name="own material"),
        ),
        (
            {
                "law": "linear-elastic",
                "young": 110e9,
                "poisson": 0.35,
                "hardening": {"yield_stress": "125 MPa", "saturation": "67 MPa", "rate": 52.0},
            },
            laws.Plastic(
                laws.LinearElastic(110e9, 0.35, name="own material"), laws.VoceHardening(125e6, 67e6, 52.0)
            ),
        ),
        (
            {"young": 9e3, "poisson": 0.4, "prony": [[0.3, 0.1]]},
            laws.Viscoelastic(NEO, ((0.3, 0.1),)),
        ),
        (
            {"young": 9e3, "poisson": 0.4, "fibres": [{"direction": [1, 0, 0], "k1": "2 kPa", "k2": 5.0}]},
            laws.FibreReinforced(NEO, laws.FibreFamily((1, 0, 0), 2e3, 5.0), name="own material"),
        ),
        ({"young": 9e3, "poisson": 0.4, "stretch": [1.1, 1.0]}, laws.PreStretched(NEO, 1.1, 1.0)),
    ],
)
def test_every_law_can_be_written_with_its_constants(table, material):
    assert SolidMaterialRecord.model_validate(table).build() == material


def test_a_study_with_a_bulk_modulus_reads_back_and_takes_other_numbers_of_solves(folder):
    text = HEAD.replace(
        '{ young = "9 kPa" }', '{ law = "mooney-rivlin", c10 = "1 kPa", c01 = 200, bulk = "1 MPa" }'
    )
    study = study_of(folder, text)
    assert read_study_again(folder, text) == study
    larger = study.with_samples(50)
    assert larger.sweep.samples == 50
    assert larger.body == study.body
    assert study.renamed("other").body == study.body


OWN = """
from palpate.physics.materials.tensors import determinant, inner, log

def tissue(F, mu=3e3, lame=2e4):
    volume = log(determinant(F))
    return mu / 2 * (inner(F, F) - 3) - mu * volume + lame / 2 * volume**2
"""


def test_a_law_of_the_users_own_comes_from_a_module_beside_the_study(folder):
    (folder / "part_study_laws.py").write_text(OWN, encoding="utf-8")
    own = 'material = { law = "user", module = "part_study_laws.py", function = "tissue" }'
    own = own.replace(" }", ', constants = { mu = "2 kPa" } }')
    material = (
        study_of(folder, HEAD.replace('material = { young = "9 kPa" }', own)).body.build().materials["body"]
    )
    assert material.shear_modulus == pytest.approx(2e3, rel=1e-6)
    assert material.bulk_modulus == pytest.approx(2e4 + 2 / 3 * 2e3, rel=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('unit = "mm"', "", "The unit of"),
        ('unit = "mm"', 'unit = "mile"', "body.unit"),
        ('fixed = "table"', 'fixed = "tabel"', "a part has no surface 'tabel'"),
        ('touches = "touched"', "", "a part has no surface 'top'; it has rim, table, touched"),
        ('material = { young = "9 kPa" }', "", "the region 'body' has no material"),
        ("young =", 'law = "yeoh", young =', "the law yeoh needs c10 and c20 and c30"),
        ("young =", 'c10 = 3, young =', "the law neo-hookean has no constant c10; it belongs to mooney-rivlin"),
        ('below = "1 mm"', 'below = "-1 mm"', "The patch 'table' contains no part of the surface"),
        ('facing = "up"', 'facing = "upp"', "'upp' is no direction"),
        ('facing = "up"', 'facing = "up", faces = "face 9"', "There is no surface 'face 9'"),
        ('{ name = "rim" }', '{ name = "a" }, { name = "b" }', "two surfaces have no bounds"),
        ("pad.stl", "pat.stl", "can't be read"),
        ("young =", 'law = "user", module = "no.py", function = "f" } #', "no.py does not exist"),
        ("young =", 'law = "user", module = "no.py", function = "f", poisson = 0.4 } #', "leave out poisson"),
    ],
)  # fmt: skip
def test_mistakes_say_what_is_there(folder, old, new, words):
    assert old in HEAD
    with pytest.raises(UsageError) as caught:
        study_of(folder, HEAD.replace(old, new, 1))
    assert words in str(caught.value)


@pytest.mark.full
def test_a_study_for_a_part_says_what_its_file_holds(folder):
    study, notes = part_study(folder / "pad.stl")
    said = "\n".join(notes)
    assert "pad.stl, numbers taken as mm: 40 × 30 × 20 mm, from (0, 0, 0) mm to (40, 30, 20) mm" in said
    assert "face 1: 1200 mm² around (20, 15, " in said
    assert "facing down" in said
    # it stands on its lower face, and is pressed on its upper one
    below = next(face for face in study.body.shape().faces if face.normal[2] < -0.9)
    assert study.body.fixed == below.name
    assert areas(study.body)["touched"] == pytest.approx(1200)
    assert 0.002 < study.interaction.radius < 0.005
    assert "kPa" in to_toml(study, notes)
    assert part_study(folder / "pad.mesh")[0].body.unit == "mm"
    assert part_study(folder / "pad.step")[0].body.unit is None
    with pytest.raises(UsageError):
        part_study(folder / "no.stl")


@pytest.mark.parametrize(("height", "depth"), [(20, None), (4, 1e-3), (2.4, 6e-4)])
def test_a_ball_goes_as_deep_as_three_quarters_of_its_radius_and_the_thickness_beneath_allow(
    height, depth, tmp_path
):
    """A plate of 60 × 60 mm is as thick everywhere; a quarter of it is less than that where the plate is thin."""
    path = tmp_path / "plate.stl"
    trimesh.creation.box((60, 60, height)).export(path)
    choices = {"unit": "mm", "radius": 0.004}
    study, notes = part_study(path, **choices)
    assert study.interaction.depth[1] == pytest.approx(0.003 if depth is None else depth)
    assert study.interaction.depth[0] <= study.interaction.depth[1] / 25
    assert "three quarters of its radius deep, at most a quarter of what lies beneath" in to_toml(
        study, notes
    )
    assert part_study(path, depth=2e-3, **choices)[0].interaction.depth[1] == 2e-3, "as it is asked"


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        (
            {"poisson": 0.7},
            "body.material.poisson: 0.7 is out of range; allowed is at least 0 and less than 0.5",
        ),
        ({"touched": "front"}, "has no surface 'front'"),
        ({"radius": -1e-3}, "option radius"),
        ({"depth": 0.0}, "option depth"),
    ],
)
def test_choices_that_do_not_suit_a_part_are_refused(folder, choice, words):
    with pytest.raises(UsageError) as caught:
        part_study(folder / "pad.mesh", **choice)
    assert words in str(caught.value)


def test_the_sample_part_is_closed_and_lies_on_its_side(tmp_path):
    """Its surface bounds a body: each edge has two triangles, and the volume is that of the bent ellipsoid, nearly."""
    points, triangles = kidney_surface()
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    a, b, c = points[triangles].transpose(1, 0, 2)
    volume = np.einsum("ti,ti->", a, np.cross(b, c)) / 6
    # 4/3 π a b c of the ellipsoid; bending keeps it, the flattened half loses a tenth, the dent a few cm³
    assert 0.8 < volume / (4 / 3 * np.pi * 0.055 * 0.030 * 0.022) < 1.0
    study, _ = part_study(write_sample_part(tmp_path / "kidney.stl"))
    found = areas(study.body)
    assert study.body.fixed == "held"
    assert 500 < found["held"] < 4000
    assert 4000 < found["touched"] < 9000
    with pytest.raises(UsageError, match=r"\.stl"):
        write_sample_part(tmp_path / "kidney.step")


TARGET = """
[target]
force_median = 0.2
force_p95 = 0.3
"""


@pytest.mark.full
@pytest.mark.timeout(300)
def test_a_part_goes_the_whole_way(folder, tmp_path):
    """Solves, learning, validation and report work on a part as on any body, and are not repeated."""
    coarse = HEAD.replace("[interaction]", 'element = "20 mm"\n[interaction]')
    study = study_of(folder, coarse + FEW_SOLVES + TARGET)
    paths = Paths(tmp_path, study.name)
    wanted = {"until": 0.5, "progress": False}
    *_, last = improve_study(study, paths, **wanted)
    assert last.reached
    assert last.model_path == paths.model
    assert (last.solves, last.unseen) == (12, 2), "every solve converged"
    outcome = conclude(study, paths, last)
    assert last.error == outcome.validation.force.p95
    # both unseen touches were solved on finer elements too, and are not solved again
    assert last.mesh == pytest.approx(outcome.validation.mesh_part)
    assert outcome.model.meta["validation"]["force error, the mesh's part"] == last.mesh
    assert paths.finer.exists()
    body = Surrogate.load(paths.model)
    felt = np.linalg.norm(outcome.train.force, axis=1)
    off = np.linalg.norm(body.energy.force(outcome.train.X) - outcome.train.force, axis=1) / felt
    assert np.median(off) < 0.05
    assert [point["solves"] for point in body.meta["learning_curve"]] == [12]
    page = report_study(tmp_path / "report.html", [outcome]).read_text(encoding="utf-8")
    assert "Solid of pad.stl" in page
    assert "fixed at table" in page
    others = last.train.take(np.arange(10))  # as if these were all solves, and the surrogate one of fewer
    conclude(study, paths, replace(last, train=others, phase="solved"))
    with pytest.raises(UsageError, match="other solves"):
        load_model(paths, others)
    conclude(study, paths, replace(last, train=others))
    known, _ = load_model(paths, others)  # all were learnt from, which gave nothing better
    assert known.meta["dataset"]["hash"] == last.train.hash, "what it was learnt from stays as it is"
    again = list(improve_study(study, paths, **wanted))
    assert [step.phase for step in again] == ["learnt", "judged", "ended"], (
        "nothing is solved or learnt again"
    )
    assert again[-1].error == last.error
    assert (tmp_path / "pad-12.palpate").is_file()
    with pytest.raises(StudyError, match="no such key"):
        study_of(folder, HEAD + FEW_SOLVES.replace("samples = 6", "sample = 6"))


@pytest.mark.full
def test_a_ring_is_touched_on_itself_and_a_mesh_keeps_its_elements(tmp_path):
    """The hole of a ring is no place to press; elements of a mesh that are no larger than the ball are not halved."""
    from netgen.occ import Cylinder, Pnt, Z

    ring = Cylinder(Pnt(0, 0, 0), Z, r=30, h=12) - Cylinder(Pnt(0, 0, -1), Z, r=21, h=14)
    ring.WriteStep(str(tmp_path / "ring.step"))
    study = part_study(tmp_path / "ring.step", radius=0.006)[0]
    (low, _), (high, _) = study.interaction.over
    assert (low, high) == pytest.approx((-0.024, 0.024), abs=2e-4)
    mesh = Block(size=(0.06, 0.06, 0.02), element=0.006).rest()
    meshio.Mesh(1e3 * mesh.points, [("tetra", mesh.tetrahedra)]).write(tmp_path / "plate.vtu")
    plate = part_study(tmp_path / "plate.vtu")[0]
    assert plate.interaction.over is None
    assert plate.sweep.element >= 0.005
