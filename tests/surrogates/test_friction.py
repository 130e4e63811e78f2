"""Friction: laws of Cattaneo, Mindlin and Deresiewicz, passivity under any normal force, and what is refused."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from touch_made import touch_energy

import palpate as pp
from held import yielding_rod
from palpate.errors import UsageError
from palpate.runtime.touchable import FRICTION, touchable
from palpate.surrogates.memories import Friction, IwanElements

DEPTH, RATIO, STIFF = 2e-3, 0.7, 1e4  # m; ρ; N/m^m


def contact(friction: Friction, s: float) -> tuple[float, float, np.ndarray]:
    """Normal force F_n = STIFF s^m, and q and ∇q of its energy, for a surface that faces up."""
    m = friction.exponent
    force, energy = STIFF * s**m, STIFF * s ** (m + 1) / (m + 1)
    q = np.sqrt(2 * energy)
    return force, q, np.array([0.0, 0.0, -force / q if q else 0.0])


def lead(state, path: np.ndarray, dt: float = 0.0) -> np.ndarray:
    """Tangential forces (N, 3) along slips and depths (N, 3), x, y and s in m; the z of a place is −s."""
    forces = np.empty((len(path), 3))
    for row, (x, y, s) in zip(forces, path, strict=True):
        _, q, slope = contact(state.friction, s)
        assert state.step(np.array([x, y, -s]), q, slope, dt)
        row[:] = state.force
    return forces


def slide(x: np.ndarray, s: float) -> np.ndarray:
    return np.column_stack([x, np.zeros_like(x), np.full_like(x, s)])


@pytest.mark.parametrize("m", [1.0, 1.5, 2.0])
@pytest.mark.parametrize("share", [1.0, 0.3])
def test_first_loading_is_that_of_cattaneo_and_mindlin(m, share):
    """And of Jäger and Ciavarella for other tools: T = μ F_n [1 − (1 − x/x_s)^m], within 1 % of μ F_n."""
    mu, s = 0.5, share * DEPTH
    friction = Friction.over(DEPTH, mu, exponent=m, ratio=RATIO)
    x = np.linspace(0.0, 1.5 * mu * s / RATIO, 300)
    T = -lead(friction.start(), slide(x, s))[:, 0]
    full = mu * contact(friction, s)[0]
    exact = full * (1 - np.maximum(0, 1 - x * RATIO / (mu * s)) ** m)
    assert np.abs(T - exact).max() < 0.01 * full


def test_cycles_lose_what_masings_rule_says():
    """Of Cattaneo–Mindlin's law: ΔE = 4 ∫₀ᴬ [2T(x) − T(A) x/A] dx, also far below full slip."""
    mu, s = 0.4, 0.8 * DEPTH
    friction = Friction.over(DEPTH, mu, ratio=RATIO)
    full, end = mu * contact(friction, s)[0], mu * s / RATIO

    def law(x):
        return full * (1 - np.maximum(0, 1 - x / end) ** 1.5)

    for share in (0.3, 0.6, 0.95):
        A = share * end
        x = np.linspace(0, A, 20_000)
        exact = 8 * np.trapezoid(law(x), x) - 4 * A * law(A)
        state, turns = friction.start(), [A, -A, A]
        lead(state, slide(np.linspace(0, A, 500), s))
        before = state.lost
        for a, b in itertools.pairwise(turns):
            lead(state, slide(np.linspace(a, b, 1000), s))
        assert state.lost - before == pytest.approx(exact, rel=0.05 if share < 0.5 else 0.02)


def test_an_oblique_press_below_the_limit_does_not_slip():
    """Mindlin & Deresiewicz: while dT/dF_n stays below μ nothing slips, and T = ρ F_n dx/ds, nothing being lost."""
    friction = Friction.over(DEPTH, 0.5, ratio=RATIO)
    s = np.linspace(0.05 * DEPTH, DEPTH, 4000)
    state = friction.start()
    path = np.column_stack([0.5 * (s - s[0]), np.zeros_like(s), s])
    T = -lead(state, path)[:, 0]
    normal = np.array([contact(friction, each)[0] for each in s])
    wanted = RATIO * 0.5 * (normal - normal[0])
    assert np.abs(T - wanted)[-1] < 0.02 * 0.5 * normal[-1]
    assert state.lost < 0.01 * state.stored


def test_nothing_is_given_back_by_a_thousand_slips_under_a_changing_normal_force():
    """By the forces themselves at the ends of 1,000 random straight steps, at every moment, in and out of contact."""
    rng = np.random.default_rng(0)
    friction = Friction.over(DEPTH, 0.3, 0.5, ratio=RATIO)
    state, work, place = friction.start(), 0.0, np.zeros(2)
    for _ in range(1000):
        s = max(0.0, rng.uniform(-0.3, 1.3)) * DEPTH
        way = rng.normal(0.0, 0.3 * DEPTH, 2)
        place = place + way
        _, q, slope = contact(friction, s)
        assert state.step(np.array([*place, -s]), q, slope, rng.uniform(0.0, 0.1))
        work -= state.force[:2] @ way
        springs = state.stored - 0.5 * q * q
        assert state.lost_in_step >= 0.0
        assert springs >= -1e-15
        assert work >= springs - 1e-12
    assert work > 0.0


def test_friction_never_exceeds_its_limit_and_points_against_the_slip():
    friction, s = Friction.over(DEPTH, 0.3, ratio=RATIO), 0.7 * DEPTH
    turn = np.linspace(0.0, 2 * np.pi, 400)
    path = np.column_stack([0.01 * np.cos(turn), 0.01 * np.sin(turn), np.full(400, s)])
    force = lead(friction.start(), path)
    limit = 0.3 * contact(friction, s)[0]
    size = np.linalg.norm(force[:, :2], axis=1)
    assert size.max() <= limit * (1 + 1e-12)
    slip = np.diff(path[:, :2], axis=0)
    cosine = (force[1:, :2] * slip).sum(1) / np.linalg.norm(slip, axis=1)
    np.testing.assert_allclose(cosine[60:], -limit, rtol=0.01)


def test_a_tool_at_rest_sticks_more_than_one_that_slides():
    """The force rises to near μ_s F_n, falls to μ_k F_n with slip, and rises again after a rest."""
    friction, s = Friction.over(DEPTH, 0.2, 0.4, ratio=RATIO), DEPTH
    normal, state = contact(friction, s)[0], friction.start()
    end, dt = 0.4 * s / RATIO, 1e-5  # fast beside the time in which it heals
    first = -lead(state, slide(np.linspace(0.0, 8 * end, 800), s), dt)[:, 0] / normal
    assert 0.3 < first.max() <= 0.4
    assert first[-1] == pytest.approx(0.2, rel=0.05)
    lead(state, slide(np.full(10, 8 * end), s), 0.1)
    again = -lead(state, slide(np.linspace(8 * end, 9 * end, 100), s), dt)[:, 0] / normal
    assert again.max() > 0.3


@pytest.mark.parametrize(
    ("kinetic", "static", "words"),
    [(-0.1, None, "friction is -0.1"), (0.4, 0.3, "above the static one"), (np.nan, None, "friction is nan")],
)
def test_coefficients_of_no_surface_are_refused(kinetic, static, words):
    with pytest.raises(UsageError, match=words):
        pp.Surrogate(touch_energy()).with_friction(kinetic, static)


def test_friction_on_a_body_that_is_held_is_refused():
    memory = IwanElements(np.ones(1), np.ones(1), np.zeros(1), np.full(1, np.inf))
    with pytest.raises(UsageError, match="has no friction"):
        Friction.over(DEPTH, 0.3, under=memory)
    with pytest.raises(UsageError, match="has no friction"):
        yielding_rod().with_friction(0.3)
    rod = yielding_rod()
    assert rod.with_friction(0.0).memory is rod.memory


def test_the_exponent_is_that_of_the_energy():
    """U₀ goes with s³ of a pad at light touches and with s^(5/2) of a body at deep ones: m is between 3/2 and 2."""
    energy = touch_energy(units=0)
    plain = dataclasses.replace(energy.network, tail=np.zeros_like(energy.network.tail))
    body = pp.Surrogate(dataclasses.replace(energy, network=plain)).with_friction(0.3)
    law = body.memory
    assert isinstance(law, Friction)
    assert 1.5 < law.exponent < 2.0
    assert body.with_friction(0.0).memory is None
    assert "friction of 0.3" in str(body)


def test_a_hand_feels_the_friction_that_the_page_asks_for():
    """The coefficient is the last of the inputs that the hand does not supply, its middle the body's own."""
    body = touchable(pp.Surrogate(touch_energy()).with_friction(0.3))
    asked = body.parameters[-1]
    assert (asked.name, (asked.low + asked.high) / 2) == (FRICTION, pytest.approx(0.3))
    start = body.home - 0.002 * body.normal
    felt = {}
    for mu in (0.0, 0.1, 0.3):
        answer = body.evaluator()
        answer.elapsed = 1e-3
        for step in range(100):
            place = start + np.array([5e-5 * step, 0.0, 0.0])
            answer(place, np.array([mu]))
        elastic = body.energy.force(place[None])[0]
        felt[mu] = np.linalg.norm(answer.force - elastic) / np.linalg.norm(elastic)
    np.testing.assert_allclose([felt[0.0], felt[0.1], felt[0.3]], [0.0, 0.1, 0.3], rtol=0.02, atol=1e-12)
