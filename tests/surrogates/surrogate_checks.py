"""The checklist of learnt bodies: what every baseline and every memory must keep, whatever was learnt.

`CHECKS` are of a body without a memory, `MEMORY_CHECKS` of one with a memory; each takes an `Example`. A new kind of
baseline or memory is entered in `test_contract.py`, or runs them itself as `test_new_kind.py` does.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from touch_made import differences

import palpate as pp
from allocated import kept_by
from palpate.runtime.touchable import touchable
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
    """Return inputs (N, n) along a closed path of the hand and its tangents (N, k) times Gauss's weights."""
    low, high = bounds(example.body.inputs)
    k, middle, half = example.felt, (low + high) / 2, (high - low) / 2
    t, w = np.polynomial.legendre.leggauss(6)
    t = (2 * np.pi / pieces * (np.arange(pieces)[:, None] + (1 + t) / 2)).ravel()
    many, turned = np.array([1, 2, 1])[:k], np.array([0.0, 0.7, 1.9])[:k]
    X = np.tile(middle, (len(t), 1))
    X[:, :k] += 1.4 * half[:k] * np.sin(many * t[:, None] + turned)
    tangent = 1.4 * half[:k] * many * np.cos(many * t[:, None] + turned)
    return X, tangent * np.tile(np.pi / pieces * w, pieces)[:, None]


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
    evaluate = energy.evaluator()
    for x in X:
        evaluate(x[:k] @ energy.baseline.directions, x[k:])
        row = x[None]
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


CHECKS = (
    exactly_nothing_at_rest,
    force_and_stiffness_are_derivatives_of_the_energy,
    no_closed_path_yields_work,
    a_file_gives_the_same_bits,
    one_place_at_a_time_is_the_same_and_allocates_nothing,
    inside_is_told_from_outside,
)
