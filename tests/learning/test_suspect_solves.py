"""Solves that contradict their neighbours are named, and left out on request; good ones are not named."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import palpate as pp
from held import INPUTS as HELD_INPUTS
from held import held
from palpate.cli.app import app
from palpate.errors import UsageError
from palpate.learning.energy.energy_images import images_of
from palpate.learning.energy.energy_samples import EnergySamples
from palpate.learning.energy.suspect_solves import suspect_solves
from palpate.learning.pad_fit import fit_pad
from palpate.learning.pressed_solves import PressedSolves
from palpate.surrogates import Solves
from palpate.surrogates.model_card import card_of
from palpate.validation import validate
from solved import solved

SPOILT = ((1.3, 1.3), (0.5, 0.5), (1.3, 1.0), (0.5, 1.0), (1.0, 1.3), (1.0, 0.5))
"""Factors of energy and force."""


def suspects(solves, baseline):
    samples = EnergySamples.of(solves, baseline)
    return suspect_solves(samples, baseline, images_of(solves, baseline))


def spoil(solves, row, energy, force):
    E, F = solves.energy.copy(), solves.force.copy()
    E[row] *= energy
    F[row] *= force
    return replace(solves, energy=E, force=F)


def pressed_body(name):
    found = PressedSolves.of(solved(name))
    return found.solves, found.baseline


def padded_body(count=40):
    """Random displacements and places of a pad on springs, in closed form."""
    low, high = (np.array([getattr(r, end) for r in HELD_INPUTS]) for end in ("low", "high"))
    X = np.random.default_rng(0).uniform(low, high, (count, len(low)))
    U, F, K = held(X)
    solves = Solves(X, U, F, K, HELD_INPUTS, axes=(0, 1))
    return solves, fit_pad(solves)[0]


BODIES = {
    "block": lambda: pressed_body("block"),
    "family": lambda: pressed_body("family"),
    "pad": padded_body,
}


@pytest.mark.parametrize(
    "kind",
    ["block", pytest.param("family", marks=pytest.mark.full), pytest.param("pad", marks=pytest.mark.full)],
)
def test_a_clean_dataset_has_no_suspect(kind):
    assert suspects(*BODIES[kind]()) == ()


@pytest.mark.full
@pytest.mark.parametrize("factors", SPOILT)
def test_a_spoilt_solve_is_named_in_each_place(factors):
    solves, baseline = pressed_body("block")
    rows = np.flatnonzero(baseline.coordinate(solves.X) > 0)
    named = {row: [one.solve for one in suspects(spoil(solves, row, *factors), baseline)] for row in rows}
    # in a press so light that the mesh shows through a factor may pass for the mesh's error
    light = [row for row in rows if baseline.row_weights(solves.X[row : row + 1])[0] < 0.1]
    heavy = [row for row in rows if row not in light]
    assert all(set(named[row]) <= {row} for row in rows), "no other solve is ever named"
    if factors[0] != 1.0:
        assert all(named[row] == [row] for row in heavy)
    else:  # a force that does not belong to its energy is a weaker sign: most are named
        assert sum(named[row] == [row] for row in heavy) > len(heavy) / 2


def test_the_spoilt_solve_is_named_and_described():
    solves, baseline = pressed_body("block")
    (one,) = suspects(spoil(solves, 5, 1.3, 1.3), baseline)
    assert one.solve == 5
    assert one.energy == pytest.approx(1.3, rel=0.05)
    assert one.force == pytest.approx(0.3 / 1.3, abs=0.05)


def spoilt_dataset(row=5, factor=1.3):
    data = solved("block").data.copy(deep=True)
    data["potential_energy"][row] *= factor
    data["response"][row] *= factor
    return pp.Dataset(data)


@pytest.mark.full
def test_learning_names_it_everywhere_and_leaves_it_out_on_request(tmp_path):
    data = spoilt_dataset()
    path = data.save(tmp_path / "spoilt.zarr")
    surrogate, history = pp.learn(data, effort=0.02, shape=False)
    assert [one.solve for one in history.suspects] == [5]
    assert "--leave-out 5" in str(history)
    assert any("Solve 5 contradicts" in line for line in card_of(surrogate).warnings)
    assert any("Solve 5 contradicts" in note for note in validate(surrogate, solved_test()).notes)
    told = CliRunner().invoke(app, ["learn", str(path), "--effort", "0.02", "--leave-out", "5", "--json"])
    assert told.exit_code == 0, told.output
    content = json.loads(told.output)
    assert content["suspects"] == []
    assert content["left_out"] == [5]


def solved_test():
    """Solves of the same block, moved from where they were learnt."""
    data = solved("block").data.copy(deep=True)
    data["inputs"] = data["inputs"] + 1e-4
    return pp.Dataset(data)


def test_a_row_that_is_not_there_is_refused():
    with pytest.raises(UsageError, match="left out"):
        pp.learn(solved("block"), leave_out=(16,))
