"""The learnt bodies that come with palpate: they are there, small, and take the lumps that examinations hide."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.experiments.exam_kinds import KINDS, hide_lumps
from palpate.experiments.exam_page import ExamPage
from palpate.experiments.exam_touch import ExamSurface
from palpate.runtime.touchable import touchable
from palpate.surrogates import Lump
from palpate.surrogates.shipped_bodies import FOLDER, SHIPPED, shipped_body


def test_each_body_has_an_examination_and_a_small_file():
    assert set(SHIPPED) == set(KINDS) == {path.stem for path in FOLDER.glob("*.palpate")}
    for name in SHIPPED:
        assert (FOLDER / f"{name}.palpate").stat().st_size <= 1_000_000
    with pytest.raises(UsageError, match="liver"):
        shipped_body("liver")


@pytest.mark.full
@pytest.mark.parametrize("name", SHIPPED)
def test_hidden_lumps_are_those_that_the_body_was_learnt_with(name):
    surrogate = shipped_body(name)
    body = touchable(surrogate)
    surface, learnt = ExamSurface.of(body), surrogate.lumps
    drawn = [hide_lumps(KINDS[name], body, surface, seed, learnt) for seed in range(8)]
    assert any(drawn)
    lumps = next(filter(None, drawn))
    felt = surrogate.with_lumps(lumps).hand_energy
    X = felt.trained_rows()[:200]
    X = X[felt.inside(X)]
    _, force = learnt.answer(surrogate.hand_energy, lumps, X)  # by the closed form; in the hand by its units
    missed = np.linalg.norm(felt.force(X) - force, axis=1) / np.linalg.norm(force, axis=1).max()
    assert missed.max() < 0.02


@pytest.mark.full
def test_a_lump_outside_of_what_was_learnt_is_refused_before_a_page_opens(tmp_path):
    body = shipped_body("prostate")
    x, y, z = ((body.lumps.room.lower + body.lumps.room.upper) / 2.0).tolist()
    with pytest.raises(UsageError, match="radius of the lump"):
        ExamPage(KINDS["prostate"], body, directory=tmp_path, lumps=[Lump((x, y, z), 0.0029, 10.0)])
