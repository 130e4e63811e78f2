"""Files that palpate wrote before fields were one contract and histories a dataset open, and answer alike.

`tests/data/former` holds one of each kind, and `answers.npz` what that version answered at random inputs.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import palpate as pp

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
