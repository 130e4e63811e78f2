"""Lumps in a learnt body: the closed form is a gradient, and the body with lumps has its energy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import palpate as pp
from palpate.errors import UsageError
from palpate.surrogates import Surrogate
from surrogates.lumps_made import ROOM, contrast
from surrogates.touch_made import RADIUS, touch_energy

LUMP = pp.Lump((0.002, -0.004, -0.016), 0.0065, 5.0)


@pytest.fixture(scope="module")
def body() -> Surrogate:
    return Surrogate(touch_energy(), lumps=contrast())


def _presses(count: int = 200) -> np.ndarray:
    rng = np.random.default_rng(3)
    low, high = [-0.015, -0.015, RADIUS - 0.010], [0.015, 0.015, RADIUS - 0.001]
    return rng.uniform(low, high, (count, 3))


def test_what_a_lump_adds_has_its_own_slopes(body):
    X, step = _presses(20), 1e-5
    _, slopes = body.lumps.added(LUMP, X)
    for i in range(3):
        moved = step * np.eye(3)[i]
        ends = [body.lumps.added(LUMP, X + s * moved)[0] for s in (-2, -1, 1, 2)]
        difference = (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * step)
        assert slopes[:, i] == pytest.approx(difference, rel=1e-6, abs=1e-6 * np.abs(slopes).max())


def test_a_stiff_lump_adds_and_a_soft_one_takes(body):
    X = _presses()
    room = replace(ROOM, ratio=pp.Range("ratio", 0.2, 10.0))
    lumps = replace(body.lumps, room=room)
    for ratio, sign in ((0.3, -1), (1.5, 1), (10.0, 1)):
        assert (sign * lumps.added(replace(LUMP, ratio=ratio), X)[0] > 0).all()
    stiffer = [lumps.added(replace(LUMP, ratio=ratio), X)[0] for ratio in (1.5, 3.0, 6.0, 10.0)]
    assert (np.diff(stiffer, axis=0) > 0).all()


def test_the_body_with_lumps_has_the_energy_and_force_of_the_closed_form(body):
    X = _presses()
    X = X[body.energy.inside(X)]
    lumps = [LUMP, pp.Lump((-0.013, 0.012, -0.022), 0.0045, 8.0)]
    U, force = body.lumps.answer(body.energy, lumps, X)
    plain, bare, _ = body.energy.response(X)
    felt = body.with_lumps(lumps).energy
    change = np.linalg.norm(force - bare, axis=1)
    missed = np.linalg.norm(felt.force(X) - force, axis=1) / change
    # less than half of what learning may miss of the change
    assert np.quantile(missed[change > 0.01 * np.linalg.norm(bare, axis=1)], 0.95) < 0.05
    assert np.median(np.abs(felt.energy(X) - U) / (U - plain)) < 0.01


def test_a_body_without_lumps_is_the_body(body):
    assert body.with_lumps([]).energy is body.energy
    assert body.with_lumps([replace(LUMP, ratio=1.0)]).energy is body.energy


def test_bodies_are_kept_as_they_are(body, tmp_path):
    X = _presses(30)
    again = pp.load(body.save(tmp_path / "body.palpate"))
    hidden = again.with_lumps([LUMP])
    assert np.array_equal(hidden.energy.force(X), body.with_lumps([LUMP]).energy.force(X))
    loaded = pp.load(hidden.save(tmp_path / "hidden.palpate"))
    assert np.array_equal(loaded.energy.force(X), hidden.energy.force(X))
    assert loaded.meta["lumps"] == [[*LUMP.place, LUMP.radius, LUMP.ratio]]


def test_what_is_known_of_the_weights_is_kept(body):
    X = _presses(30)
    hidden = body.with_lumps([LUMP])
    assert np.isfinite(hidden.energy.deviation(X)).all()


@pytest.mark.parametrize(
    ("lump", "words"),
    [
        (replace(LUMP, place=(0.002, -0.004, -0.040)), "outside the room"),
        (replace(LUMP, radius=0.010), "radius"),
        (replace(LUMP, ratio=30.0), "ratio"),
        (replace(LUMP, place=(0.002, -0.004, -0.0101), radius=0.008), "leaves the skin"),
    ],
)
def test_a_lump_out_of_place_is_refused(body, lump, words):
    with pytest.raises(UsageError, match=words):
        body.with_lumps([lump])


def test_lumps_that_meet_are_refused_and_so_is_a_body_that_knows_none(body):
    with pytest.raises(UsageError, match="Two lumps meet"):
        body.with_lumps([LUMP, replace(LUMP, place=(0.004, -0.004, -0.016))])
    with pytest.raises(UsageError, match="knows nothing of lumps"):
        Surrogate(body.energy).with_lumps([LUMP])
    with pytest.raises(UsageError, match="radius"):
        pp.Lump((0.0, 0.0, 0.0), -1.0, 2.0)
