"""`palpate card`, `palpate dataset export` and `palpate export gltf|vtu` on a small beam."""

from __future__ import annotations

import json
import shutil

import pandas as pd
import pytest
import trimesh


@pytest.fixture
def folder(carried_out, tmp_path):
    shutil.copytree(carried_out, tmp_path / "study")
    return tmp_path / "study"


@pytest.mark.full
def test_a_dataset_goes_out_in_every_format(palpate, folder):
    for ending in ("csv", "parquet", "nc", "pvd", "glb"):
        answer = palpate("dataset", "export", folder / "small.zarr", "-o", folder / f"out.{ending}", "--json")
        assert answer.code == 0, answer.err
        assert json.loads(answer.out)["files"] == [str(folder / f"out.{ending}")]
    assert "P [N]" in pd.read_csv(folder / "out.csv").columns
    fields = palpate("dataset", "export", folder / "small.zarr", "-o", folder / "two.csv", "--fields")
    assert fields.code == 0, fields.err
    assert (folder / "two-fields.csv").exists()


@pytest.mark.full
def test_rows_are_chosen(palpate, folder):
    answer = palpate("dataset", "export", folder / "small.zarr", "-o", folder / "a.pvd", "--rows", "0,4:8:2")
    assert answer.code == 0, answer.err
    assert len(list((folder / "a").iterdir())) == 3
    for words, said in (
        (("--rows", "a"), "no rows"),
        (("--rows", "99999"), "counted from 0"),
        (("--fields",), "is for .csv"),
    ):
        answer = palpate("dataset", "export", folder / "small.zarr", "-o", folder / "b.pvd", *words)
        assert answer.code == 2
        assert said in answer.err


def test_a_model_goes_out_as_a_picture_that_moves(palpate, folder):
    answer = palpate(
        "export", "gltf", folder / "small.palpate", "-o", folder / "small.glb", "--steps", "4", "--json"
    )
    assert answer.code == 0, answer.err
    assert json.loads(answer.out)["states"] == 4
    assert len(trimesh.load(folder / "small.glb").geometry) == 1
    assert b"model card" in (folder / "small.glb").read_bytes()
    answer = palpate("export", "vtu", folder / "small.palpate", "-o", folder / "small.pvd")
    assert answer.code == 0, answer.err
    assert len(list((folder / "small").iterdir())) == 20
    answer = palpate("export", "gltf", folder / "small.palpate", "--at", "0,0,0")
    assert answer.code == 2
    assert "follows from its loads" in answer.err


@pytest.mark.full
def test_files_of_others_stay(palpate, folder):
    model, data = folder / "small.palpate", folder / "small.zarr"
    for words, file in (
        (("export", "gltf", model), "small.glb"),
        (("export", "vtu", model, "--steps", "2"), "small/0000.vtu"),
        (("dataset", "export", data, "-o", folder / "a.csv", "--fields"), "a-fields.csv"),
        (("dataset", "export", data, "-o", folder / "b.parquet"), "b.parquet"),
        (("card", model, "-o", folder / "card.md"), "card.md"),
    ):
        assert palpate(*words).code == 0
        again = palpate(*words)  # tables can't be told from other ones
        assert again.code == (2 if words[0] == "dataset" else 0), again.err
        (folder / file).write_text("mine")
        answer = palpate(*words)
        assert answer.code == 2
        assert "exists already" in answer.err
        assert (folder / file).read_text() == "mine"
        # what palpate did not write stays, unless it is a table, which nobody can tell
        assert palpate(*words, "--force").code == (0 if words[0] == "dataset" else 2)
    assert palpate("card", model, "-o", folder / "card.pdf").code == 2


def test_a_beam_goes_out_without_its_shape_and_says_so(palpate, folder):
    answer = palpate("export", "c", folder / "small.palpate", "--no-check")
    assert answer.code == 0, answer.err
    assert "left out: the field displacement" in answer.err
    assert "left out" not in palpate("export", "c", folder / "small.palpate", "--no-check", "--no-field").err


@pytest.mark.full
def test_a_card_is_printed_signed_and_written(palpate, folder):
    model = folder / "small.palpate"
    answer = palpate("card", model)
    assert answer.code == 0, answer.err
    assert "# Model card: small" in answer.out
    assert "Licence: not stated" in answer.out
    assert palpate("card", model, "--licence", "CC0-1.0").code == 2
    answer = palpate("card", model, "--author", "A. Nobody", "--licence", "CC0-1.0", "--save", "--json")
    assert json.loads(answer.out)["licence"] == "CC0-1.0"
    assert palpate("card", model, "-o", folder / "card.json").code == 0
    assert json.loads((folder / "card.json").read_text())["author"] == "A. Nobody"
