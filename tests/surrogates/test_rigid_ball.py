"""The pad's part in a press: limits in closed form, solves with a soft and a stiff pad, and where it is said."""

from __future__ import annotations

import math

import numpy as np
import pytest

from palpate import Body, SphereProbe, materials
from palpate.format import bind_units
from palpate.physics.shapes import Block
from palpate.surrogates.model_card import card_of
from palpate.surrogates.rigid_ball import pad_part, pad_part_of
from palpate.validation import Chapter, validate
from palpate.validation.report.summary import story
from pressed import DEEPEST, RADIUS, dataset, solves, surrogate

PROBE = {"type": "SphereProbe", "radius": RADIUS, "pad": 2e6, "stop": 4e-3, "touches": "top"}
SOLVED_BY = {"dataset": {"provenance": {"problem": {"interactions": [PROBE]}}}}


def test_a_stiff_pad_takes_nothing_and_leaves_the_force_of_hertz():
    force = 4 / 3 * 10e3 * math.sqrt(RADIUS) * 0.004**1.5
    part = pad_part(force, 0.004, RADIUS, 1e12)
    assert part.rigid_force == pytest.approx(force, rel=1e-4)
    assert part.depth_share == pytest.approx(0.0, abs=1e-4)


def test_beneath_a_pad_a_hard_body_takes_nothing():
    """The pad alone feels πkRs²; with Hertz's pressure, by W = 4πkx(s/3 − x/15R)², x = 5Rs/3, it is 80/81 of that."""
    part = pad_part(80 / 81 * math.pi * 2e6 * RADIUS * 0.004**2 * 0.999, 0.004, RADIUS, 2e6)
    assert part.depth_share > 0.95


def test_a_softer_pad_takes_more():
    shares = [pad_part(0.05, 0.003, RADIUS, pad).force_share for pad in (1e8, 1e7, 2e6, 5e5)]
    assert (np.diff(shares) > 0).all()
    assert shares[0] > 0


@pytest.mark.full
def test_solves_with_a_soft_and_with_a_stiff_pad_differ_as_it_says():
    """On a block of 9 kPa, at the depth of half a radius at which the share is stated."""
    body = Body(Block((0.06, 0.06, 0.03)), materials.NeoHookean(9e3, 0.45))
    middle = ((0.0295, 0.0295), (0.0305, 0.0305))

    def force(pad: float) -> float:
        ball = SphereProbe(0.010, touches="top", pad=pad, depth=(0.0, 0.005), over=middle)
        return float(body.problem(ball, element=0.006).solve((0.03, 0.03, 0.036)).response[2])

    soft, stiff = force(2e6), force(1e8)
    assert pad_part(soft, 0.004, 0.010, 2e6).force_share == pytest.approx(1 - soft / stiff, abs=0.04)


def test_card_report_and_page_say_the_same():
    from palpate.runtime.touchable import touchable
    from palpate.viewer.page_model import PageModel

    model = surrogate(meta=SOLVED_BY)
    part = pad_part_of(model.energy, model.meta)
    assert part is not None
    assert part.depth == pytest.approx(DEEPEST / 2, rel=0.02)
    assert 0 < part.depth_share < 1
    assert str(part) in card_of(model).limits
    assert PageModel(touchable(model)).pad_words == bind_units(str(part))
    test = solves()
    chapter = Chapter("slab", model, test, validate(model, test), train=dataset(test))
    assert any(fact.meaning == str(part) for fact in story(chapter).facts)


@pytest.mark.parametrize(
    "meta", [{}, {"dataset": {"provenance": {"problem": {"interactions": [{"type": "x"}]}}}}]
)
def test_nothing_is_said_of_a_pad_that_no_file_states(meta):
    model = surrogate(meta=meta)
    assert pad_part_of(model.energy, model.meta) is None
    assert not any("pad takes" in limit for limit in card_of(model).limits)
