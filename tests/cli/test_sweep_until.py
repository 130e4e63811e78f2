"""`palpate sweep --until`: a body of few elements on the whole way, and what its options refuse."""

from __future__ import annotations

import json

import pytest

from few_solves import BLOCK, FEW_SOLVES
from palpate.dataset import Dataset


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "tiny.toml"
    path.write_text(BLOCK + FEW_SOLVES + "shape = false\n", encoding="utf-8")
    return path


@pytest.mark.full
@pytest.mark.timeout(300)
def test_solves_are_chosen_until_the_error_is_kept(palpate, study, tmp_path):
    first = palpate("sweep", study, "--until", "60%", "--json")
    assert first.code == 0, first.err
    content = json.loads(first.out)
    assert content["reached"] is True
    assert [step["solves"] for step in content["steps"]] == [12]
    data, unseen = (Dataset.open(tmp_path / f"tiny{end}.zarr") for end in ("", "-random"))
    assert (len(data), len(unseen)) == (12, 2)
    assert (tmp_path / "tiny-12.palpate").is_file()
    again = palpate("sweep", study, "--until", "60%")
    assert again.code == 0, again.err
    assert "tiny.zarr (12 to learn from)" in again.out
    assert len(again.out.splitlines()) <= 8
    assert "chosen by variance" not in again.err, "nothing is solved twice"
    usual = palpate("sweep", study)
    assert usual.code == 0, usual.err
    assert "12 solves that were chosen; they stay as they are" in usual.err
    judged = palpate("validate", study, "--no-report")
    assert "tiny on 2 unseen solves" in judged.out
    missed = palpate("sweep", study, "--until", "0.001%", "--samples", "16")
    assert missed.code == 1
    assert len(missed.out.splitlines()) + len(missed.err[missed.err.index("error: ") :].splitlines()) <= 8
    assert "The limit of 16 solves is reached. Everything is kept." in missed.err
    assert len(Dataset.open(tmp_path / "tiny.zarr")) == 16
    assert palpate("validate", study, "--no-report").code in {0, 1}, "the surrogate is of this study's solves"


@pytest.mark.full
@pytest.mark.timeout(300)
def test_touches_on_two_meshes_decide_the_size_of_the_elements(palpate, study, tmp_path):
    """Elements of 12 mm don't feel a ball of 8 mm. The file says the new size, and the solves have it."""
    swept = palpate("sweep", study, "--element", "auto")
    assert swept.code == 0, swept.err
    assert "elements of 6 mm, since the mesh's part is" in swept.err
    assert Dataset.open(tmp_path / "tiny.zarr").provenance["problem"]["element"] == pytest.approx(0.006)
    again = palpate("sweep", study, "--element", "auto")
    assert again.code == 0, again.err
    assert "their elements stay as they are" in again.err


def test_a_body_that_no_ball_touches_keeps_its_elements(palpate, tmp_path):
    study = tmp_path / "beam.toml"
    assert palpate("init", study).code == 0
    refused = palpate("sweep", study, "--element", "auto")
    assert refused.code == 2
    assert "No ball touches its body" in refused.err


@pytest.mark.parametrize(
    ("options", "answer"),
    [
        (("--until", "two"), "'two' is no number"),
        (("--until", "2"), "out of range"),
        (("--until", "200%"), "out of range"),
        (("--minutes", "3"), "Give --until"),
        (("--element", "3mm"), "[sweep] element"),
    ],
)
def test_options_that_say_nothing_are_refused(palpate, study, options, answer):
    refused = palpate("sweep", study, *options)
    assert refused.code == 2
    assert answer in refused.err


def test_loads_are_not_chosen_one_by_one(palpate, tmp_path):
    path = tmp_path / "beam.toml"
    assert palpate("init", path).code == 0
    refused = palpate("sweep", path, "--until", "2%")
    assert refused.code == 2
    assert "under a probe" in refused.err
