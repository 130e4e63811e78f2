"""A study of a scan: labels and materials as they are typed, on the command line, in the file and on the page."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.study import read_study
from palpate.study.part_choices import chosen_study, shown_part
from palpate.study.part_records import PartSurfaceRecord
from palpate.study.part_study import part_study, part_text, study_file
from palpate.study.part_work import rough_study
from palpate.study.region_choices import RegionMaterial, read_labels
from palpate.viewer.shown_part import as_wish, choices_of
from scanned import ball_in_ball, write_series

POISSON = 0.45


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    path = ball_in_ball(tmp_path_factory.mktemp("scan") / "breast.nrrd")
    typed = {"labels": "fat=1,lump=2", "materials": "lump=5 kPa..20 kPa", "element": "4 mm"}
    return part_study(path, radius=0.008, **typed)[0]


def test_what_is_typed_becomes_regions_materials_and_an_input(study):
    body = study.body.build()
    assert tuple(body.materials) == ("fat", "lump")
    assert study.body.materials["fat"] == "fat"  # of the library, because it is called so
    assert body.materials["lump"].young == pytest.approx(10e3)  # the mean of the ends' logarithms
    (varied,) = study.varied
    assert (varied.path, varied.low, varied.high) == ("lump.young", 5e3, 20e3)
    assert [entry.name for entry in study.problem().ranges][-1] == "lump.young"


def test_the_file_of_the_study_says_it_again(study):
    path = Path(study.body.file).with_name("breast.toml")
    path.write_text(part_text(study, ()), encoding="utf-8")
    again = read_study(path)
    assert again.body.labels == {"fat": 1, "lump": 2}
    assert again.varied == study.varied
    assert again.body.build().materials == study.body.build().materials


class TestPage:
    def test_what_is_shown_and_left_stays(self, study):
        choices = shown_part(study).choices
        assert choices.regions == {"fat": "fat", "lump": "5 kPa..20 kPa"}
        again = chosen_study(study, choices_of(as_wish(choices), None, None))
        assert again.body.materials == study.body.materials
        assert again.varied == study.varied

    def test_materials_of_regions_are_changed(self, study):
        choices = shown_part(study).choices
        changed = dataclasses.replace(choices, regions={"fat": "2 kPa..8 kPa", "lump": ""})
        chosen = chosen_study(study, changed)
        assert [entry.path for entry in chosen.varied] == ["fat.young"]
        assert set(chosen.body.materials) == {"fat"}
        assert chosen.body.build().materials["lump"].young == choices.young  # that of the whole part

    def test_a_text_that_is_none_is_said_beside_its_field(self, study):
        part = shown_part(study)
        wish = dataclasses.replace(as_wish(part.choices), regions={"fat": "jelly", "lump": "9 kPa"})
        (field,) = part.misfits(wish)
        assert field == "region-0"
        assert "'jelly'" in part.misfits(wish)[field]


@pytest.mark.parametrize(
    "text", ["12", "-3 kPa", "0 kPa", "8 kPa..2 kPa", "1 kPa..2 kPa..3 kPa", "jelly", "3 mm"]
)
def test_a_material_that_is_none_is_refused(text):
    with pytest.raises(UsageError):
        RegionMaterial.of_text("fat", text, POISSON)


@pytest.mark.parametrize("text", ["fat", "fat=", "fat=1,fat=2", "fat=1.5", "=1"])
def test_labels_that_are_none_are_refused(text):
    with pytest.raises(UsageError, match="--labels"):
        read_labels(text)


def test_the_cut_of_a_scan_is_held(tmp_path):
    from scanned import write_labels

    labels = np.zeros((14, 14, 12), np.uint8)
    labels[2:12, 2:12, :8] = 1
    path = write_labels(tmp_path / "cut.nrrd", labels, (2, 2, 2))
    with pytest.warns(UserWarning, match="end of the image"):
        assert part_study(path, element="5 mm")[0].body.fixed == "cut"


def test_labels_are_for_scans(tmp_path):
    from palpate.physics.shapes.sample_part import write_sample_part

    with pytest.raises(UsageError, match="are for scans"):
        part_study(write_sample_part(tmp_path / "kidney.stl"), labels="fat=1")


def test_a_folder_of_dicom_slices_is_a_part_with_its_study_beside_it(study, tmp_path):
    folder = write_series(tmp_path / "series", study.body.file)
    typed = {"labels": "fat=1,lump=2", "element": "5 mm"}
    again = part_study(folder, radius=0.010, **typed)[0]
    path = study_file(folder)
    assert path == tmp_path / "series.toml"
    path.write_text(part_text(again, ()), encoding="utf-8")
    assert read_study(path).body.bare() == again.body.bare()
    folder.rename(tmp_path / "elsewhere")
    with pytest.raises(UsageError, match="can't be read"):
        read_study(path).body.build()


def test_the_rough_study_has_larger_elements_in_the_tissues_unless_triangles_were_picked(study):
    rough = rough_study(study)
    assert rough.body.element == rough.sweep.element == study.interaction.radius > study.body.element
    picked = PartSurfaceRecord(name="picked", triangles="0-3 of 5120")
    body = study.body.model_copy(update={"surfaces": (picked,)})
    assert rough_study(study.model_copy(update={"body": body})) is None
