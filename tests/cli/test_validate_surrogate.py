"""`palpate validate` of a touch surrogate: what it says, what it writes, its exit code."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from models import spring_beam
from palpate.validation import TouchSolves
from pressed import dataset, force, places, solves, surrogate


@pytest.fixture
def folder(tmp_path):
    dataset(solves()).save(tmp_path / "slab-test.zarr")
    surrogate().save(tmp_path / "slab.palpate")
    return tmp_path


@pytest.mark.full
def test_a_good_surrogate_is_told_from_its_file_and_passes(palpate, folder):
    answer = palpate("validate", folder / "slab.palpate")
    assert answer.code == 0, answer.err
    assert "slab on 200 unseen solves: every limit kept" in answer.out
    page = (folder / "slab.html").read_text(encoding="utf-8")
    for heading in (
        "Force against depth",
        "Error on the touched surface",
        "Where to trust it",
        "Where the ball went",
        "Worst cases",
    ):
        assert heading in page
    assert page.count("<svg") == 5


@pytest.mark.full
def test_a_miss_is_exit_code_one_in_plain_words(palpate, folder):
    surrogate(factor=1.1).save(folder / "wrong.palpate")
    answer = palpate(
        "validate", folder / "wrong.palpate", "--test", folder / "slab-test.zarr", "--no-report", "--json"
    )
    assert answer.code == 1
    told = json.loads(answer.out)
    assert told["passed"] is False
    assert {c["name"] for c in told["checks"] if not c["passed"]} == {
        "force_median",
        "force_p95",
        "light_force_p95",
    }
    assert "misses 3 of 8 limits" in answer.err
    assert not (folder / "wrong.html").exists()


@pytest.mark.full
def test_what_was_corrected_to_a_specimen_is_said_to_differ_on_purpose(palpate, folder):
    stiffer = surrogate(factor=1.1)
    replace(stiffer, meta=stiffer.meta | {"correction": {"counts": {"learnt": 30}}}).save(
        folder / "specimen.palpate"
    )
    answer = palpate(
        "validate", folder / "specimen.palpate", "--test", folder / "slab-test.zarr", "--no-report"
    )
    assert answer.code == 1
    assert "specimen on 200 unseen solves" in answer.out
    assert "Corrected by 30 measured touches" in answer.err
    assert "more solves" not in answer.err


@pytest.mark.full
def test_refined_solves_tell_the_mesh_s_own_error(palpate, folder):
    X = places()[:60]
    fine = TouchSolves(X, 1.02 * force(X), np.zeros(60), np.zeros((60, 3, 3)))
    dataset(fine).save(folder / "fine.zarr")
    answer = palpate("validate", folder / "slab.palpate", "--refined", folder / "fine.zarr", "--no-report")
    assert answer.code == 0, answer.err
    # the difference 0.02 / 1.02 to elements half as large over 1 − 2⁻² is the mesh's own part
    assert f"of it the mesh {100 * 0.02 / 1.02 / (1 - 0.25):.1f} %" in answer.out


@pytest.mark.full
def test_what_can_not_be_judged_is_refused_with_a_way_out(palpate, folder):
    spring_beam().save(folder / "beam.palpate")
    answer = palpate("validate", folder / "beam.palpate")
    assert answer.code == 2
    assert "--test DATA.zarr" in answer.err
    surrogate().save(folder / "alone.palpate")
    answer = palpate("validate", folder / "alone.palpate")
    assert answer.code == 2
    assert "--test DATA.zarr" in answer.err
    assert palpate("validate", folder / "gone.palpate").code == 2
    (folder / "study.toml").write_text('name = "study"\n', encoding="utf-8")
    answer = palpate("validate", folder / "study.toml", "--test", folder / "slab-test.zarr")
    assert answer.code == 2
    assert "--test" in answer.err
