"""`palpate dataset import`: what it prints, what it writes, what it refuses."""

from __future__ import annotations

import json

import numpy as np
import pytest

from palpate.dataset import Dataset


@pytest.fixture
def export(tmp_path):
    """A table of COMSOL with a load in N and a deflection in mm."""
    rows = "\n".join(f"{load},{2 * load}" for load in range(11))
    path = tmp_path / "table.csv"
    path.write_text(f"% Table,Table 1\n% F (N),v (mm)\n{rows}\n")
    return path


def test_a_dry_run_lists_the_columns_and_writes_nothing(palpate, export):
    answer = palpate("dataset", "import", export, "--dry-run")
    assert answer.code == 0
    assert "F [N] 0 … 10" in answer.out
    assert "v [mm] 0 … 20" in answer.out
    assert "--input NAME=COLUMN" in answer.out
    assert list(export.parent.iterdir()) == [export]


def test_a_dry_run_with_a_mapping_tells_what_would_be_written(palpate, export):
    words = ("--input", "load=F", "--output", "sag=v", "--dry-run")
    answer = palpate("dataset", "import", export, *words, "--json")
    told = json.loads(answer.out)
    assert told["rows"] == 11
    assert told["results"]["columns"]["v"]["unit"] == "mm"
    assert "load 0 … 10 N" in palpate("dataset", "import", export, *words).out
    assert list(export.parent.iterdir()) == [export]


@pytest.mark.full
def test_a_dataset_and_its_test_set_are_written(palpate, export):
    words = ("dataset", "import", export, "--input", "load=F", "--output", "sag=v", "--test", "0.2")
    answer = palpate(*words)
    assert answer.code == 0, answer.err
    train, test = (Dataset.open(export.with_name(name)) for name in ("table.zarr", "table-test.zarr"))
    assert (len(train), len(test)) == (9, 2)
    np.testing.assert_allclose(train["sag"], 2e-3 * train.X[:, 0])
    # the ends stay in training
    assert {0.0, 10.0} <= set(train.X[:, 0])
    assert palpate(*words).code == 0  # the same again changes nothing
    other = palpate("dataset", "import", export, "--input", "load=v", "--output", "sag=v")
    assert other.code == 2
    assert "exists already" in other.err


def test_a_mapping_file_is_taken_with_words_beside_it(palpate, export):
    mapping = export.with_name("map.toml")
    mapping.write_text('[[inputs]]\nname = "F"\n')
    answer = palpate("dataset", "import", export, "--mapping", mapping, "--output", "v", "--dry-run")
    assert answer.code == 2
    assert "NAME=VALUE" in answer.err
    answer = palpate(
        "dataset",
        "import",
        export,
        "--mapping",
        mapping,
        "--output",
        "v=v",
        "--out",
        export.with_name("o.zarr"),
    )
    assert answer.code == 0
    assert Dataset.open(export.with_name("o.zarr")).ranges[0].name == "F"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--input", "load=F", "--output", "sag=w"), "no column 'w'"),
        (("--input", "load=F"), "names no outputs"),
        (("--input", "load=F", "--output", "sag=v", "--test", "0.89"), "can't be set aside"),
        (("--mapping", "nowhere.toml"), "nowhere.toml can't be read"),
    ],
)
def test_what_does_not_fit_ends_with_2(palpate, export, words, message):
    answer = palpate("dataset", "import", export, *words)
    assert answer.code == 2
    assert message in answer.err
    assert not export.with_suffix(".zarr").exists()


def test_a_damaged_file_names_its_line(palpate, export):
    export.write_text(export.read_text().replace("5,10", "5"))
    answer = palpate("dataset", "import", export, "--dry-run")
    assert answer.code == 2
    assert "line 8" in answer.err


def test_effort_is_for_datasets_only(palpate, tmp_path):
    (tmp_path / "study.toml").write_text("")
    assert palpate("learn", tmp_path / "study.toml", "--effort", "0.1").code == 2
