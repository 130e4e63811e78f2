"""Limits fail exactly where they should, and say so in words that help."""

from __future__ import annotations

import dataclasses
import json
import re
import subprocess
import sys

import numpy as np
import pytest

from answering import answering, rod_solves
from linear_bodies import (
    dataset,
    history,
    nonsense,
    plane_data,
    plane_model,
    tip_data,
    tip_model,
    with_network,
)
from palpate.dataset import Dataset
from palpate.errors import AccuracyError, UsageError
from palpate.surrogates import Surrogate
from palpate.units import Range
from palpate.validation import Limits, TouchFunction, TouchSolves, Validation, validate
from palpate.validation.limits import CRITERIA
from pressed import INPUTS, force, places

NOTHING = {c.key: None for c in CRITERIA}


TOUCHED = {
    "direction_p95",
    "loop_work",
    "border_loop_work",
    "smoothness",
    "mesh_force",
    "refined_force_median",
    "refined_force_p95",
}
# the bands, the contrast of lumps and the histories have tests of their own
BANDS = {"interval_coverage", "answer_coverage", "contrast_p95"}
ONE_SIDED = [c for c in CRITERIA if c.key not in BANDS and not c.key.startswith("history")]


def rippled() -> TouchFunction:
    """A touched body with some error in every figure."""
    return TouchFunction(
        "slab",
        INPUTS,
        lambda X: (
            force(X) * (1.01 + 1e-3 * np.sin(2 * np.pi * X[:, :1] / 7e-4))
            + 0.01 * np.roll(force(X), 1, axis=1)
        ),
    )


def judged(**limits: float | None) -> Validation:
    """A body with some error in every figure, judged by these limits alone."""
    asked = Limits(**(NOTHING | limits))
    if "answer_p95" in limits:
        return validate(answering(), rod_solves(40), limits=asked)
    if set(limits) & TOUCHED:
        X = places()
        fine = TouchSolves(X[:40], 1.02 * force(X[:40]))
        turned = 1.0 + 0.5 * X[:, 1:2]
        return validate(rippled(), TouchSolves(X, force(X) * turned), refined=fine, limits=asked)
    data = tip_data()
    model = tip_model(shift=1e-3, slope=1e-3, force=0.97)
    off = tip_model(scale=1.01).fields["displacement"].network
    return validate(with_network(model, "displacement", off), data, history=history(), limits=asked)


def test_every_limit_has_one_criterion_and_the_other_way_round() -> None:
    assert [f.name for f in dataclasses.fields(Limits)] == [c.key for c in CRITERIA]


@pytest.mark.grid
@pytest.mark.parametrize("key", [c.key for c in ONE_SIDED])
def test_a_limit_fails_just_below_what_was_measured(key: str) -> None:
    measured = judged(**{key: 1e6}).checks[0].measured
    assert measured > 0
    kept, missed = judged(**{key: measured}), judged(**{key: measured * (1 - 1e-9)})
    assert kept.passed
    assert [c.criterion.key for c in missed.failures] == [key]
    kept.raise_if_failed()
    with pytest.raises(AccuracyError):
        missed.raise_if_failed()


@pytest.mark.grid
@pytest.mark.parametrize("key", [c.key for c in ONE_SIDED if c.good is not None])
def test_grades(key: str) -> None:
    """Good is never asked beyond a default limit."""
    criterion = next(c for c in CRITERIA if c.key == key)
    default = getattr(Limits(), key)
    assert default is None or criterion.good < default
    check = judged(**{key: 1e6}).checks[0]
    assert check.grade == ("good" if check.measured <= criterion.good else "pass")
    assert dataclasses.replace(check, measured=criterion.good).grade == "good"
    assert dataclasses.replace(check, measured=2e6).grade == "fail"


def test_not_a_number_never_passes() -> None:
    model = tip_model()
    broken = nonsense(model.fields["nodes"].network)
    v = validate(with_network(model, "nodes", broken), tip_data())
    assert [c.criterion.key for c in v.failures] == ["rmse"]
    assert json.loads(json.dumps(v.as_dict(), allow_nan=False))["networks"]["refined"]["rmse"] is None


def test_nothing_asked_is_nothing_missed() -> None:
    v = validate(tip_model(shift=1.0), tip_data(), limits=Limits(**NOTHING))
    assert v.passed
    assert v.checks == ()


def test_a_miss_is_told_in_plain_words() -> None:
    with pytest.raises(AccuracyError) as caught:
        judged(rmse=1e-4, force_p95=0.01).raise_if_failed()
    error = caught.value
    assert error.exit_code == 1
    assert error.what == "rubber misses 2 of 2 limits on 41 solves that it has never seen."
    # 1e-3 (1 + ξ) over 41 even samples: the mean of ξ² is 0.35; full scale is 0.25 m
    assert "RMSE over full scale: 4.6 × 10⁻³ measured, 1.0 × 10⁻⁴ asked." in error.why
    assert re.search(r"The worst case is u_y at [\d.]+ m under P = 5 N\.", error.why)
    assert "Force error, 95th percentile: 3 % measured, 1 % asked." in error.why
    assert "units_max" in error.fix
    assert error.fix.count("Sweep more loads") == 1


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_a_limit_is_a_positive_number(value: float) -> None:
    with pytest.raises(UsageError, match="force_p95"):
        Limits(force_p95=value)


def test_regression_comes_from_the_history() -> None:
    v = validate(tip_model(), tip_data(), history=history(), limits=Limits(filter_regression=1.9))
    assert v.networks.regression == pytest.approx(2.0)
    assert [c.criterion.key for c in v.failures] == ["filter_regression"]
    assert validate(tip_model(), tip_data(), history=history(heldout=())).networks.regression is None


def test_the_table_names_every_check_and_shouts_a_miss() -> None:
    v = judged(rmse=1e-4, force_median=0.5, force_p95=0.5)
    text = str(v)
    assert "1 of 3 limits missed" in text
    assert text.count("FAIL") == 1
    assert all(c.criterion.label in text for c in v.checks)
    assert "filter: 2 units" in text


def test_as_dict_is_plain_json() -> None:
    v = validate(plane_model(), plane_data())
    loaded = json.loads(json.dumps(v.as_dict(), allow_nan=False))
    assert loaded["passed"] is True
    assert loaded["samples"] == 60
    assert {c["name"] for c in loaded["checks"]} == {c.criterion.key for c in v.checks}
    assert loaded["networks"]["refined"]["per_output"][0]["name"] == "u_x at 0.2 m"


def failed_rows(data: Dataset) -> Dataset:
    changed = data.data.copy(deep=True)
    changed["converged"].values[::2] = False
    changed["displacement"].values[::2] = np.nan
    return Dataset(changed)


def test_rows_that_did_not_converge_are_left_out() -> None:
    v = validate(tip_model(), failed_rows(tip_data()))
    assert v.samples == 20
    assert v.passed


def other_nodes() -> Dataset:
    data = tip_data().data.copy(deep=True)
    data["rest"].values[3, 0] += 0.01
    return Dataset(data)


def tip_pushed_aside() -> Dataset:
    return dataset(np.array([[1.0]]), [Range("P", 0.0, 5.0, "N")], [(1.0, 0.0)], [5])


@pytest.mark.parametrize(
    ("model", "data", "words"),
    [
        (tip_model(), tip_data(name="Q"), "inputs are Q; rubber takes P"),
        (tip_model(), plane_data(), "inputs are P_x, P_y"),
        (tip_model(), other_nodes(), "nodes are not the 6 nodes"),
        (tip_model(), tip_pushed_aside(), "moves u_x at 0.2 m"),
        (tip_model(), tip_data().take([]), "no converged solve"),
        (tip_model(), tip_data(np.array([[0.0]])), "moves nothing"),
    ],
)
def test_a_dataset_of_another_body_is_refused(model: Surrogate, data: Dataset, words: str) -> None:
    with pytest.raises(UsageError, match=words) as caught:
        validate(model, data)
    assert caught.value.fix


@pytest.mark.full
def test_validating_loads_neither_matplotlib_nor_jinja() -> None:
    code = (
        "import sys, palpate.validation as v; v.Limits(); early = 'numpy' in sys.modules; v.validate; "
        "print(early, sorted({'matplotlib', 'jinja2'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "[]"]
