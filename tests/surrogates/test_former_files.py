"""Files that palpate wrote before fields were one contract and histories a dataset open, and answer alike.

`tests/data/former` holds one of each kind, and `answers.npz` what that version answered at random inputs.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import palpate as pp
from palpate.dataset import histories_of
from palpate.learning.loading import load_surrogate
from palpate.study import Study
from palpate.study.run import Paths, load_data
from palpate.viewer.answer_page import AnswerPage

FORMER = Path(__file__).parents[1] / "data" / "former"


@pytest.fixture(scope="module")
def answers() -> dict[str, np.ndarray]:
    with np.load(FORMER / "answers.npz") as file:
        return dict(file)


def of(answers: dict[str, np.ndarray], start: str) -> dict[str, np.ndarray]:
    return {name.removeprefix(start): values for name, values in answers.items() if name.startswith(start)}


def near(answer: np.ndarray, wanted: np.ndarray) -> None:
    """Processors differ in the last bits."""
    np.testing.assert_allclose(answer, wanted, rtol=1e-9, atol=1e-11 * np.abs(wanted).max())


@pytest.mark.parametrize("name", ["loads", "memory", "probe", "pad"])
def test_a_touched_body_of_before_feels_alike(name, answers):
    body = pp.load(FORMER / f"{name}.palpate")
    near(body.energy.force(answers[f"{name}/energy/X"]), answers[f"{name}/energy/force"])


@pytest.mark.parametrize("name", ["loads", "memory", "probe", "answers"])
def test_its_fields_are_drawn_alike(name, answers):
    body = pp.load(FORMER / f"{name}.palpate")
    assert body.fields
    for key, shown in body.fields.items():
        near(shown.values(answers[f"{name}/fields/{key}/X"]), answers[f"{name}/fields/{key}/values"])


def test_numbers_of_before_are_answered_alike(answers):
    rod, fitted = pp.load(FORMER / "answers.palpate"), pp.load(FORMER / "fit.palpate")
    near(rod.predict(answers["answers/numbers/X"]), answers["answers/numbers/values"])
    near(fitted.predict(answers["fit/X"]), answers["fit/values"])


def test_a_network_of_before_becomes_a_page_and_answers_as_a_surrogate(answers):
    surrogate = load_surrogate(FORMER / "fit.palpate")
    near(surrogate.predict(answers["fit/X"]), answers["fit/values"].reshape(-1, 1))
    assert not np.isnan(surrogate.deviation(answers["fit/X"])).any()
    assert 'id="palpate-answers-main"' in AnswerPage.of(surrogate).document()


def test_histories_of_before_judge_a_body_of_before(answers):
    data = pp.load(FORMER / "histories.palpate")
    (path,) = histories_of(data)
    for name, values in of(answers, "histories/").items():
        np.testing.assert_array_equal(getattr(path, name), values)
    judged = pp.validate(pp.load(FORMER / "memory.palpate"), data)
    assert judged.passed
    # they were made to be 0.02 N more than the body answers at its largest 4 N
    assert judged.histories.max == pytest.approx(0.02 / 4.02)


def test_a_study_of_before_finds_its_histories(tmp_path):
    study = Study(name="rod", body={"material": "annealed copper"}, interaction={}, memory={})
    paths = Paths(tmp_path, study.name)
    for file in (paths.histories, paths.unseen_histories):
        shutil.copyfile(FORMER / "histories.palpate", file)
    train, test = load_data(study, paths)
    assert train.size_in_words == test.size_in_words == "1 history with 50 samples"
