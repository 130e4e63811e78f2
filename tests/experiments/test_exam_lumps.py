"""Lumps: where they lie, what they add in closed form, which are refused, and how they are drawn."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from examined import plane, slab

import pressed
import tooled
from palpate.errors import UsageError
from palpate.experiments.exam_kinds import hide_lumps, kind_of_body
from palpate.experiments.exam_lumps import body_with_lumps, place_of, require_inside, schematic_lumps
from palpate.experiments.exam_touch import ExamSurface
from palpate.runtime.touchable import touchable
from palpate.surrogates import Lump

LUMP = Lump((0.005, -0.004, -0.009), 0.005, 8.0)


def surface() -> ExamSurface:
    """A slab's top that can be pressed up to its border, and its bottom 30 mm below."""
    top = plane(0.08, 40)
    reachable = np.abs(top.points[:, :2]).max(axis=1) < 0.039
    points = np.concatenate([top.points, top.points - [0.0, 0.0, 0.03]])
    return replace(top, points=points, reachable=np.concatenate([reachable, 0 * reachable > 0]))


def test_a_lump_lies_where_it_was_put():
    at = place_of(slab(), LUMP)
    assert at.above == pytest.approx([0.005, -0.004, 0.0], abs=1e-9)
    assert at.normal == pytest.approx([0.0, 0.0, 1.0])
    assert at.cover == pytest.approx(0.009 - 0.005)


def test_what_a_schematic_lump_adds_is_the_formula_above_it_and_nothing_far_away():
    body, depth = slab(), 2.0 / 3.0 * pressed.DEEPEST
    with_lump = schematic_lumps(pressed.surrogate(), body, [LUMP]).hand_energy
    X = np.array([[0.005, -0.004, pressed.RADIUS - depth], [-0.018, 0.018, pressed.RADIUS - depth]])
    ratio = with_lump.energy(X) / body.energy.energy(X)
    # D/U0 of Boussinesq's field in Hertz's contact, and Eshelby's sphere, written out anew
    volume, h, x = 4 / 3 * math.pi * 0.005**3, 0.009, 7.0
    expected = 5 * math.sqrt(0.010 * depth) * volume / (math.pi**2 * h**4) * x / (1 + 0.4 * x)
    assert ratio[0] - 1.0 == pytest.approx(expected, rel=1e-9)
    assert abs(ratio[1] - 1.0) < 1e-3 * expected


def test_the_deviation_of_the_force_does_not_tell_whether_there_are_lumps():
    energy = pressed.surrogate().hand_energy
    body = pressed.surrogate().with_energy(replace(energy, root=np.eye(4 + energy.network.units)))
    for lumps in ([], [LUMP]):
        assert body_with_lumps(body, slab(), lumps).hand_energy.root is None


def test_a_body_under_a_tool_takes_no_lumps():
    body = tooled.surrogate()
    with pytest.raises(UsageError, match="can't have lumps yet"):
        body_with_lumps(body, touchable(body), [LUMP])


def test_the_signal_is_half_as_strong_beside_a_lump_where_boussinesq_has_it():
    body, depth = slab(), 2.0 / 3.0 * pressed.DEEPEST
    with_lump = schematic_lumps(pressed.surrogate(), body, [LUMP]).hand_energy
    beside = 0.009 * math.sqrt(2 ** (1 / 3) - 1)
    X = np.array([[0.005 + a, -0.004, pressed.RADIUS - depth] for a in (0.0, beside)])
    log_added = np.log(with_lump.energy(X) / body.energy.energy(X))
    assert log_added[1] / log_added[0] == pytest.approx(0.5, rel=1e-6)


def test_the_force_over_lumps_is_a_gradient():
    energy = schematic_lumps(pressed.surrogate(), slab(), [LUMP]).hand_energy
    X, step = np.array([[0.008, -0.001, pressed.RADIUS - 0.003]]), 1e-7
    slope = [
        (energy.energy(X + e) - energy.energy(X - e))[0] / (2 * step) for e in step * np.eye(3)[:, None, :]
    ]
    assert energy.force(X)[0] == pytest.approx(-np.array(slope), rel=1e-6)


def test_a_body_without_lumps_is_the_body():
    surrogate = pressed.surrogate()
    assert schematic_lumps(surrogate, slab(), []) is surrogate


@pytest.mark.parametrize(
    ("lump", "words"),
    [
        (Lump((0.0, 0.0, -0.004), 0.005, 3.0), "leaves the skin"),
        (Lump((0.0, 0.0, 0.002), 0.005, 3.0), "leaves the skin"),
        (Lump((0.0, 0.0, -0.0275), 0.005, 3.0), "leaves the body"),
    ],
)
def test_a_lump_that_looks_out_is_refused(lump, words):
    with pytest.raises(UsageError, match=words):
        require_inside(slab(), lump, surface().points)


def test_lumps_follow_from_the_seed_lie_inside_and_apart():
    body, where = slab(), surface()
    kind = kind_of_body("slab", body)
    drawn = [hide_lumps(kind, body, where, seed) for seed in range(60)]
    assert drawn == [hide_lumps(kind, body, where, seed) for seed in range(60)]
    counts = [len(lumps) for lumps in drawn]
    # one in five has none: 60 draws have 3 to 24 such with a probability of 0.9998
    assert 3 <= counts.count(0) <= 24
    assert max(counts) > 1
    for lumps in drawn:
        for k, lump in enumerate(lumps):
            require_inside(body, lump, where.points)
            for other in lumps[:k]:
                assert math.dist(lump.place, other.place) >= 2 * (lump.radius + other.radius)
