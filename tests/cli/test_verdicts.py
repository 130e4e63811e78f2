"""The verdicts that commands print: few lines, what they say, and every figure with --verbose."""

from __future__ import annotations

import shutil

import pytest

from palpate.cli.console import Console
from palpate.cli.verdict_lines import verdict_text
from palpate.validation import validate
from pressed import dataset, solves, surrogate

MOST = 8  # lines of a verdict, with those of the error after a miss


@pytest.fixture
def slab(tmp_path):
    dataset(solves()).save(tmp_path / "slab-test.zarr")
    surrogate(factor=1.1).save(tmp_path / "slab.palpate")
    return tmp_path / "slab.palpate"


@pytest.mark.full
def test_a_kept_verdict_names_error_report_and_next_command(palpate, carried_out, tmp_path):
    shutil.copytree(carried_out, tmp_path / "s")
    answer = palpate("validate", tmp_path / "s" / "study.toml")
    assert answer.code == 0, answer.err
    lines = answer.out.splitlines()
    assert len(lines) <= MOST
    assert lines[0] == "small on 24 unseen solves: every limit kept"
    assert "95 of 100 solves" in lines[1]
    assert lines[1].endswith("than a person notices")
    assert f"report  {tmp_path / 's' / 'small.html'}" in answer.out
    assert lines[-1] == f"next    palpate view {tmp_path / 's' / 'small.palpate'}"


def test_a_miss_is_a_verdict_and_an_error_in_eight_lines(palpate, slab):
    answer = palpate("validate", slab, "--no-report")
    assert answer.code == 1
    assert len(answer.out.splitlines()) + len(answer.err.splitlines()) <= MOST
    assert "slab on 200 unseen solves: 3 of 8 limits missed; " in answer.out
    assert "(3.5 % asked)" in answer.out
    assert "and 1 more" in answer.out
    assert "1 times what a person notices" in answer.out
    assert "Learn from more solves" in answer.err
    assert "third" not in answer.out + answer.err
    assert "orst case is" not in answer.out + answer.err


@pytest.mark.full
def test_verbose_prints_every_figure_and_the_worst_cases(palpate, slab):
    answer = palpate("validate", slab, "--no-report", "--verbose")
    assert answer.code == 1
    for words in ("Force error, median", "deep third", "worst 1: ", "cubic spline"):
        assert words in answer.out
    assert "The worst case is at" in answer.err


def test_few_unseen_solves_are_cautioned_of(palpate, carried_out):
    answer = palpate("validate", carried_out / "small.palpate", "--no-report")
    assert "caution: 8 unseen solves can't judge much" in answer.out.splitlines()[2]


def test_a_finished_sweep_is_told_in_a_few_lines(palpate, carried_out, tmp_path):
    shutil.copytree(carried_out, tmp_path / "s")
    study = tmp_path / "s" / "study.toml"
    answer = palpate("sweep", study)
    assert answer.code == 0, answer.err
    assert len(answer.out.splitlines()) <= MOST
    assert "solves to learn from" in answer.out
    assert answer.out.splitlines()[-1] == f"next    palpate learn {study}"
    assert "hash" in palpate("sweep", study, "--verbose").out


@pytest.mark.full
def test_of_several_surrogates_each_has_one_line():
    judged = [validate(surrogate(factor=factor), solves()) for factor in (1.0, 1.1)]
    lines = verdict_text(judged, Console(), report=None, next_step="palpate view slab.palpate").splitlines()
    assert len(lines) == 3
    assert "every limit kept; force off by" in lines[0]
    assert "limits missed" in lines[1]
