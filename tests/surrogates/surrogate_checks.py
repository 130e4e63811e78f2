"""The checklist of learnt bodies: what every baseline and every memory must keep, whatever was learnt.

`CHECKS` are of a body without a memory, `MEMORY_CHECKS` of one with a memory; each takes an `Example` and an empty
folder. A baseline or memory of palpate's is entered in `test_contract.py`; another one runs them as `test_new_kind.py`.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher
from touch_made import differences

import palpate as pp
from allocated import kept_by
from palpate.kernels import python_source
from palpate.runtime.touchable import touchable
from palpate.surrogates.energy_kernels import ANSWER, entry_of, trusts_into
from palpate.surrogates.memories import MemoryState
from palpate.units import bounds

STEP = 2e-5  # m, of differences
WIDER = 0.6  # of each felt range: how far around it places are taken


@dataclass(frozen=True, eq=False)
class Example:
    """A learnt body to check.

    Attributes
    ----------
    body : Surrogate
        Of any network.
    rest : (N, n)
        Inputs at which it has neither energy nor force.
    smooth : (N, n), optional
        Inputs about which derivatives of the energy are smooth within four `STEP`; by default all in `around` that are
        that far from the ends of the felt ranges and from first contact.
    """

    body: pp.Surrogate
    rest: np.ndarray
    smooth: np.ndarray | None = None

    @property
    def felt(self) -> int:
        """Number of the felt coordinates."""
        return len(self.body.energy.baseline.directions)

    def around(self, count: int, seed: int = 0) -> np.ndarray:
        """Return inputs in and about the trained ranges, (count, n)."""
        low, high = bounds(self.body.inputs)
        more = np.where(np.arange(len(low)) < self.felt, WIDER * (high - low), 0.0)
        return np.random.default_rng(seed).uniform(low - more, high + more, (count, len(low)))

    def undisturbed(self) -> np.ndarray:
        """Return the smooth inputs, (N, n)."""
        if self.smooth is not None:
            return self.smooth
        X, reach, energy = self.around(600), 4 * STEP, self.body.energy
        u, ends = X[:, : self.felt], bounds(self.body.inputs)
        good = (np.abs(u - ends[0][: self.felt]) > reach).all(1) & (
            np.abs(u - ends[1][: self.felt]) > reach
        ).all(1)
        good &= energy.depth(X) > 20 * reach
        return X[good & (np.abs(energy.depth(X) - energy.going.deepest) > reach)]


def exactly_nothing_at_rest(example: Example, folder: Path) -> None:
    energy = example.body.energy
    assert not energy.energy(example.rest).any()
    assert not energy.force(example.rest).any()
    if energy.root is not None:
        assert not energy.deviation(example.rest).any()
    assert np.isfinite(energy.stiffness(example.rest)).all()
    answer, place = touchable(example.body).evaluator(), np.full(3, 1e-3)
    answer.place(place, holding=False, believed=True)
    answer(place, np.array([(r.low + r.high) / 2 for r in example.body.parameters]))
    assert not answer.force.any()


def force_and_stiffness_are_derivatives_of_the_energy(example: Example, folder: Path) -> None:
    energy, X, k = example.body.energy, example.undisturbed(), example.felt
    assert len(X) > 30
    D, steps = energy.baseline.directions, np.full(k, STEP)
    F, K = energy.force(X), energy.stiffness(X)
    np.testing.assert_allclose(
        F @ D.T @ D, F, atol=1e-14 * np.abs(F).max()
    )  # none across the felt directions
    # sixth order; rounding leaves 1e-16 U/h beside F, and as much of F beside K
    size = np.abs(energy.energy(X) + energy.baseline.offset).max()
    np.testing.assert_allclose(F @ D.T, -differences(energy.energy, X, steps), atol=1e-10 * size / STEP / 20)
    by_hand = differences(lambda X: energy.force(X) @ D.T, X, steps)
    np.testing.assert_allclose(D @ K @ D.T, by_hand, atol=1e-10 * np.abs(F).max() / STEP)
    np.testing.assert_array_equal(K, K.transpose(0, 2, 1))


def no_closed_path_yields_work(example: Example, folder: Path) -> None:
    """In and out of contact and of the trained ranges, by Gauss's rule of six points on short pieces."""
    energy, (place, tangent) = example.body.energy, closed_path(example, 6000)
    power = (energy.force(place) @ energy.baseline.directions.T * tangent).sum(axis=1)
    exchanged = np.abs(power).sum() / 2
    assert exchanged > 1e-3 * np.ptp(energy.energy(place)) > 0
    assert abs(power.sum()) < 1e-9 * exchanged
    assert not energy.inside(place).all()


def closed_path(example: Example, pieces: int) -> tuple[np.ndarray, np.ndarray]:
    """Return inputs (N, n) along a closed path of the hand, and its tangents (N, k) times Gauss's weights."""
    t, w = np.polynomial.legendre.leggauss(6)
    place, tangent = path(example, (2 * np.pi / pieces * (np.arange(pieces)[:, None] + (1 + t) / 2)).ravel())
    return place, tangent * np.tile(np.pi / pieces * w, pieces)[:, None]


def path(example: Example, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return inputs (N, n) and tangents (N, k) at times t (N,) of a path of period 2π that leaves the ranges."""
    low, high = bounds(example.body.inputs)
    k, middle, half = example.felt, (low + high) / 2, (high - low) / 2
    many, turned = np.array([1, 2, 1])[:k], np.array([0.0, 0.7, 1.9])[:k]
    X = np.tile(middle, (len(t), 1))
    X[:, :k] += 1.4 * half[:k] * np.sin(many * t[:, None] + turned)
    return X, 1.4 * half[:k] * many * np.cos(many * t[:, None] + turned)


def a_file_gives_the_same_bits(example: Example, folder: Path) -> None:
    body = example.body
    again = pp.load(body.save(folder / "body.palpate"))
    X = example.around(300)
    for name in (
        "energy",
        "force",
        "stiffness",
        "depth",
        "inside",
        *(["deviation"] if body.energy.root is not None else []),
    ):
        np.testing.assert_array_equal(
            getattr(again.energy, name)(X), getattr(body.energy, name)(X), err_msg=name
        )
    assert str(again) == str(body)
    assert again.meta == dict(body.meta)


def one_place_at_a_time_is_the_same_and_allocates_nothing(example: Example, folder: Path) -> None:
    energy, X, k = example.body.energy, example.around(100), example.felt
    evaluate, size = energy.evaluator(), np.abs(energy.force(X)).max()
    sign = energy.baseline.amplitude
    for x in X:
        evaluate(x[:k] @ energy.baseline.directions, x[k:])
        row, q = x[None], evaluate.amplitude
        np.testing.assert_allclose(0.5 * q * q, 0.0 if sign == "none" else evaluate.energy, rtol=1e-12)
        np.testing.assert_allclose(
            -q * evaluate.slope, 0.0 * q if sign == "none" else evaluate.force, atol=1e-10 * size
        )
        assert q >= 0.0 or sign == "signed"
        np.testing.assert_array_equal(evaluate.force, energy.force(row)[0])
        np.testing.assert_array_equal(evaluate.stiffness, energy.stiffness(row)[0])
        assert (evaluate.energy, evaluate.depth) == (energy.energy(row)[0], energy.depth(row)[0])
        assert evaluate.inside == energy.inside(row)[0]
    require_no_allocation(example)


def require_no_allocation(example: Example) -> None:
    """Refuse a tick of the loop that keeps memory, with a hand that moves."""
    answer, X = touchable(example.body).evaluator(), example.around(64)
    hand = np.ascontiguousarray(X[:, : example.felt] @ example.body.energy.baseline.directions)
    place, further, count = np.zeros(3), X[0, example.felt :].copy(), iter(range(10**9))

    def tick() -> None:
        place[:] = hand[next(count) % 64]
        answer.elapsed = 1e-3
        answer.place(place, holding=True, believed=True)
        answer(place, further)

    assert kept_by(tick, 300) < 500


def inside_is_told_from_outside(example: Example, folder: Path) -> None:
    energy, k = example.body.energy, example.felt
    low, high = bounds(example.body.inputs)
    trained = (low + high) / 2 + (high - low) / 2 * energy.region.points
    touching = energy.depth(trained) > 0
    assert touching.any()
    assert energy.inside(trained).all()
    far = trained[touching].copy()
    far[:, :k] += 2.0 * np.sign(far[:, :k] - (low + high)[:k] / 2) * (high - low)[:k]
    X = np.vstack([far, example.around(300)])
    assert not energy.inside(far)[energy.depth(far) > 0].any()
    for name in ("energy", "force", "stiffness"):
        assert np.isfinite(getattr(energy, name)(X)).all(), name
    evaluate = energy.evaluator()
    evaluate(np.array([np.nan, 0.0, 0.0]), trained[0, k:])
    assert np.isnan(evaluate.force).all()
    assert not evaluate.inside


def interpreted_kernels_answer_as_compiled_ones(example: Example, folder: Path) -> None:
    energy = example.body.energy
    X = np.ascontiguousarray(energy._places(np.vstack([example.around(30), example.rest[:5]])))
    rows, found = entry_of(energy.baseline.compiled()).rows, []
    for own in (rows, python_source(rows)):
        answers, inside = np.empty((len(X), ANSWER)), np.empty(len(X), dtype=bool)
        own(X, answers, inside, *energy.compiled())
        found.append((answers, inside))
    _agree(*(answers for answers, _ in found))
    assert np.array_equal(found[0][1], found[1][1])
    if energy.root is not None:
        root, net = energy._compiled_posterior()
        inputs, scratch = example.around(30), np.zeros((4, root.shape[1]))
        found = [np.empty(30), np.empty(30)]
        for own, out in zip((trusts_into, python_source(trusts_into)), found, strict=True):
            own(inputs, answers, out, root, scratch, energy._constants[3], net)
        _agree(*found)


CHECKS = (
    interpreted_kernels_answer_as_compiled_ones,
    exactly_nothing_at_rest,
    force_and_stiffness_are_derivatives_of_the_energy,
    no_closed_path_yields_work,
    a_file_gives_the_same_bits,
    one_place_at_a_time_is_the_same_and_allocates_nothing,
    inside_is_told_from_outside,
)


def led(example: Example, state: MemoryState, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Lead a memory twice around the path in three seconds, in so many steps.

    Returns forces (N, 3), and what is stored, lost, given by the hand and lost in the step (N, 4).
    """
    energy, k = example.body.energy, example.felt
    X, evaluate = path(example, np.linspace(0.0, 4.0 * np.pi, count))[0], energy.evaluator()
    force, ledger = np.empty((count, 3)), np.empty((count, 4))
    for i, (place, further) in enumerate(
        zip(X[:, :k] @ energy.baseline.directions, X[:, k:].copy(), strict=True)
    ):
        evaluate(place, further)
        assert state.step(place, evaluate.amplitude, evaluate.slope, 3.0 / count)
        force[i] = state.force
        ledger[i] = state.stored, state.lost, state.work, state.lost_in_step
    return force, ledger


def a_memory_gives_back_no_more_than_was_put_in(example: Example, folder: Path) -> None:
    _, ledger = led(example, example.body.memory.start(), 1000)
    stored, lost, work, at_once = ledger.T
    size = np.ptp(work)
    assert stored.max() > 0
    assert lost[-1] > 0.01 * stored.max()
    assert (stored >= 0).all()
    assert (at_once >= 0).all()
    np.testing.assert_allclose(np.diff(lost), at_once[1:], atol=1e-12 * size)
    np.testing.assert_allclose(work, stored + lost, atol=1e-12 * size)
    # the work is that of the forces, by their trapezoids, to first order in the step at least
    coarse, fine = (
        _work_missed(example, *led(example, example.body.memory.start(), n)) for n in (1500, 3000)
    )
    assert fine < 0.6 * coarse
    assert fine < 0.01


def _work_missed(example: Example, force: np.ndarray, ledger: np.ndarray) -> float:
    """Return how far the work of the forces (N, 3) is from the ledger's, relative to the largest change of that."""
    place = path(example, np.linspace(0.0, 4.0 * np.pi, len(force)))[0][:, : example.felt]
    along = np.diff(place @ example.body.energy.baseline.directions, axis=0)
    by_force = -np.cumsum((along * (force[1:] + force[:-1]) / 2).sum(axis=1))
    return float(np.abs(ledger[1:, 2] - ledger[0, 2] - by_force).max() / np.ptp(ledger[:, 2]))


def a_memory_without_a_past_answers_elastically(example: Example, folder: Path) -> None:
    """At a press that is light and sudden."""
    energy, X = example.body.energy, example.around(400)
    U = energy.energy(X)
    for x in X[(U > 0) & (0.03 * U.max() > U)][:20]:
        evaluate, state, k = energy.evaluator(), example.body.memory.start(), example.felt
        place = x[:k] @ energy.baseline.directions
        evaluate(place, x[k:])
        assert state.step(place, evaluate.amplitude, evaluate.slope, 0.0)
        np.testing.assert_allclose(
            state.force, evaluate.force, rtol=1e-9, atol=1e-9 * np.abs(evaluate.force).max()
        )
        assert state.stored == pytest.approx(evaluate.energy, rel=1e-9)


def a_memory_starts_anew_from_a_file_and_after_a_reset(example: Example, folder: Path) -> None:
    body = example.body
    again = pp.load(body.save(folder / "body.palpate"))
    assert str(again.memory) == str(body.memory)
    state = again.memory.start()
    first = led(example, body.memory.start(), 200)
    for _ in range(2):
        for one, other in zip(led(example, state, 200), first, strict=True):
            np.testing.assert_array_equal(one, other)
        state.reset()


def a_memory_ignores_what_is_not_finite(example: Example, folder: Path) -> None:
    energy, k, state = example.body.energy, example.felt, example.body.memory.start()
    led(example, state, 100)
    evaluate, x = energy.evaluator(), path(example, np.array([1.0]))[0][0]
    place = x[:k] @ energy.baseline.directions
    evaluate(place, x[k:])
    stored = state.stored
    assert not state.step(place, np.nan, evaluate.slope, 1e-3)
    assert not state.force.any()
    assert state.stored == stored
    assert state.step(place, evaluate.amplitude, evaluate.slope, 1e-3)


def a_tick_with_a_memory_allocates_nothing(example: Example, folder: Path) -> None:
    require_no_allocation(example)


def interpreted_memories_step_as_compiled_ones(example: Example, folder: Path) -> None:
    body, forces = example.body, []
    module = sys.modules[type(body.memory).__module__]
    kernels = {name: own for name, own in vars(module).items() if isinstance(own, Dispatcher)}
    way = body.energy._places(example.around(12))
    for change in (lambda own: own, python_source):
        with pytest.MonkeyPatch.context() as patch:
            for name, own in kernels.items():
                patch.setattr(module, name, change(own))
            evaluator, memory = body.energy.evaluator(), body.memory.start()
            for place in way:
                evaluator(place[:3], place[3:])
                memory.step(place[:3].copy(), evaluator.amplitude, evaluator.slope, 0.01)
                forces.append([*memory.force, memory.stored])
    _agree(*np.split(np.array(forces), 2))


def _agree(a: np.ndarray, b: np.ndarray) -> None:
    np.testing.assert_allclose(a, b, rtol=1e-13, atol=1e-13 * np.abs(a).max())


MEMORY_CHECKS = (
    interpreted_memories_step_as_compiled_ones,
    a_memory_gives_back_no_more_than_was_put_in,
    a_memory_without_a_past_answers_elastically,
    a_memory_starts_anew_from_a_file_and_after_a_reset,
    a_memory_ignores_what_is_not_finite,
    a_tick_with_a_memory_allocates_nothing,
)
