"""Springs that slip or relax: closed forms, energy, memory."""

from __future__ import annotations

import math

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.surrogates.memories import IwanElements
from palpate.surrogates.memories.iwan_elements import advance, free_step

SLIDERS = IwanElements.sliders(
    np.array([2.0, 3.0, 1.0]), np.array([math.inf, 0.1, 0.3]), np.array([0.0, 0.2, 0.0])
)
DASHPOTS = IwanElements.dashpots(np.array([5.0, 3.0, 2.0]), np.array([math.inf, 0.1, 2.0]))


def force(elements: IwanElements, h: list[float], times: list[float] | None = None) -> np.ndarray:
    return elements.elongations(np.array(h), None if times is None else np.array(times)) @ elements.stiffness


def test_a_slider_that_hardens_follows_the_return_mapping() -> None:
    one = IwanElements.sliders(np.array([4.0]), np.array([0.1]), np.array([0.5]))
    # past yield the slope is k c/(1 + c); backwards it is k until −(y + c α), α = (0.4 − 0.1)/1.5
    alpha = 0.3 / 1.5
    loaded, back = 4.0 * (0.1 + 0.5 * alpha), 0.4 - 2 * (0.1 + 0.5 * alpha)
    assert force(one, [0.4, back]) == pytest.approx([loaded, -loaded], rel=1e-12)


def test_steps_of_any_length_end_in_the_same_state_on_a_straight_way() -> None:
    whole, parts = SLIDERS.elongations(np.array([0.9])), SLIDERS.elongations(np.linspace(0, 0.9, 1001))
    np.testing.assert_allclose(parts[-1], whole[-1], atol=1e-12)
    times = np.linspace(0, 0.5, 1001)
    even = DASHPOTS.elongations(0.8 * times, times)
    np.testing.assert_allclose(
        DASHPOTS.elongations(np.array([0.4]), np.array([0.5]))[-1], even[-1], atol=1e-12
    )


def test_a_held_stretch_relaxes_by_the_prony_series() -> None:
    t = np.array([0.0, 0.05, 0.3, 4.0])
    expected = 0.7 * (5.0 + 3.0 * np.exp(-t / 0.1) + 2.0 * np.exp(-t / 2.0))
    np.testing.assert_allclose(force(DASHPOTS, [0.7] * 4, t.tolist()), expected, rtol=1e-12)


def test_reloading_meets_the_virgin_curve_where_it_left_it() -> None:
    """Without hardening the memory of a smaller cycle is wiped out by a larger one (Masing's rule)."""
    soft = IwanElements.sliders(np.array([2.0, 3.0, 1.0]), np.array([math.inf, 0.1, 0.3]), np.zeros(3))
    assert force(soft, [0.5, 0.35, 0.5, 0.8])[-2:] == pytest.approx(force(soft, [0.5, 0.8]), rel=1e-12)


@pytest.mark.parametrize("elements", [SLIDERS, DASHPOTS], ids=["slip", "relax"])
def test_what_was_put_in_is_stored_or_lost_and_nothing_more(elements: IwanElements) -> None:
    """Σ ∫ f dh of a fine walk is the change of the stored energy and what was lost, which never falls."""
    rng = np.random.default_rng(3)
    e, alpha, ledger = np.zeros(3), np.zeros(3), np.zeros(4)
    f, work, lost = 0.0, 0.0, 0.0
    for dh in np.repeat(rng.uniform(-0.3, 0.3, 40), 400) / 400:
        g = advance(dh, 1e-4, e, alpha, ledger, *elements.compiled())
        work += 0.5 * (f + g) * dh
        assert ledger[3] >= 0
        assert ledger[1] >= lost
        f, lost = g, float(ledger[1])
    # the trapezoid's error: second order in the steps, 16,000 of them
    assert ledger[0] + ledger[1] == pytest.approx(work, abs=2e-5 * max(lost, ledger[0]))
    assert ledger[2] == pytest.approx(ledger[0] + ledger[1], rel=1e-12)


def test_long_steps_lose_as_much_as_short_ones() -> None:
    def lost(parts: int) -> float:
        e, alpha, ledger = np.zeros(3), np.zeros(3), np.zeros(4)
        for _ in range(parts):
            advance(0.6 / parts, 0.5 / parts, e, alpha, ledger, *DASHPOTS.compiled())
        return float(ledger[1])

    assert lost(1) == pytest.approx(lost(1000), rel=1e-10)


def test_a_free_step_ends_where_nothing_pulls() -> None:
    e, alpha, ledger = np.zeros(3), np.zeros(3), np.zeros(4)
    advance(0.9, 0.0, e, alpha, ledger, *SLIDERS.compiled())
    back = free_step(0.0, e, alpha, *SLIDERS.compiled())
    assert abs(advance(back, 0.0, e, alpha, ledger, *SLIDERS.compiled())) < 1e-12
    assert 0 < 0.9 + back < 0.9


@pytest.mark.parametrize(
    "numbers",
    [
        ([-1.0], [1.0], [0.0], [math.inf]),
        ([1.0], [0.0], [0.0], [math.inf]),
        ([1.0], [1.0], [-0.1], [math.inf]),
        ([1.0], [1.0], [0.0], [1.0]),
        ([1.0, 2.0], [1.0], [0.0], [math.inf]),
    ],
)
def test_elements_without_meaning_are_refused(numbers: tuple[list[float], ...]) -> None:
    with pytest.raises(UsageError):
        IwanElements(*map(np.array, numbers))
