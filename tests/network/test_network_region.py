"""The trained region against brute force."""

from __future__ import annotations

import time

import numpy as np
import pytest

from palpate.errors import UsageError
from palpate.network.region import TrainedRegion


@pytest.mark.parametrize("n", [1, 3, 6])
def test_distance_is_that_to_the_nearest_point(n):
    rng = np.random.default_rng(n)
    X, unseen = rng.uniform(-1, 1, (200, n)), rng.uniform(-2, 2, (100, n))
    region = TrainedRegion.of(X)
    brute = np.linalg.norm(unseen[:, None] - X, axis=2).min(axis=1)
    np.testing.assert_allclose(region.distances(unseen), brute, rtol=1e-13)
    for x, d in zip(unseen, brute, strict=True):
        assert region.distance(x) == pytest.approx(d, rel=1e-13)
        assert region.inside(x) == (region.distance(x) <= region.radius)


@pytest.mark.parametrize(("N", "n"), [(50, 1), (300, 3), (3000, 2), (3000, 6)])
def test_training_data_are_inside_and_far_points_outside(N, n):
    X = np.random.default_rng(0).uniform(-1, 1, (N, n))
    region = TrainedRegion.of(X)
    assert len(region.points) <= 512
    assert (region.distances(X) <= region.radius * (1 + 1e-12)).all()
    assert not region.inside(np.full(n, 3.0))


@pytest.mark.parametrize("n", [1, 2, 3])
def test_new_data_of_the_same_kind_are_mostly_inside(n):
    rng = np.random.default_rng(0)
    region = TrainedRegion.of(rng.uniform(-1, 1, (400, n)))
    share = (region.distances(rng.uniform(-1, 1, (5000, n))) <= region.radius).mean()
    assert share > 0.95


def test_radius_is_the_datas_own_spacing():
    grid = np.linspace(-1, 1, 21)[:, None]
    assert TrainedRegion.of(grid).radius == pytest.approx(0.1)
    assert not TrainedRegion.of(grid).inside(np.array([1.11]))
    hole = np.concatenate([np.linspace(-1, -0.5, 200), np.linspace(0.5, 1, 200)])[:, None]
    assert not TrainedRegion.of(hole).inside(np.array([0.0]))


@pytest.mark.parametrize("most", [512, 40])
def test_what_was_left_out_together_is_no_neighbour_of_itself(most):
    places = np.random.default_rng(2).uniform(-1, 1, (30, 2))
    depths = np.array([-0.02, 0.0, 0.02])
    columns = np.column_stack([np.repeat(places, 3, axis=0), np.tile(depths, 30)])
    both = np.vstack([columns, columns * [-1, 1, 1]])  # and mirrored
    groups = np.tile(np.repeat(np.arange(30), 3), 2)
    alone, together = TrainedRegion.of(both, most=most), TrainedRegion.of(both, groups=groups, most=most)
    apart = np.linalg.norm(both[:, None] - both, axis=2)
    apart[groups[:, None] == groups] = np.inf
    new = np.column_stack([np.random.default_rng(3).uniform(-1, 1, (2000, 2)), np.zeros(2000)])
    if most > len(both):
        assert alone.radius == pytest.approx(0.02)
        assert together.radius == pytest.approx(np.quantile(apart.min(axis=1), 0.99))
        assert (alone.distances(new) <= alone.radius).mean() < 0.5
    assert together.radius >= np.quantile(apart.min(axis=1), 0.99) * (1 - 1e-12)
    assert (together.distances(new) <= together.radius).mean() > 0.9


def test_groups_are_one_number_for_each_row():
    with pytest.raises(UsageError, match="which of 4 inputs"):
        TrainedRegion.of(np.zeros((4, 2)), groups=np.zeros(3))


def test_thinning_keeps_every_sample_near_a_kept_one():
    X = np.random.default_rng(1).normal(size=(2000, 3))
    region = TrainedRegion.of(X, most=64)
    gaps = np.linalg.norm(X[:, None] - region.points, axis=2).min(axis=1)
    assert len(region.points) == 64
    assert region.radius >= gaps.max() * (1 - 1e-12)


def test_single_and_repeated_points_are_regions():
    assert TrainedRegion.of(np.zeros((1, 2))).inside(np.zeros(2))
    for N in (2, 4, 600):
        copies = TrainedRegion.of(np.ones((N, 2)))
        assert copies.inside(np.ones(2))
        assert not copies.inside(np.full(2, 1.1))
    few = TrainedRegion.of(np.repeat(np.linspace(-1, 1, 5), 3)[:, None])
    assert len(few.points) == 5
    assert few.radius <= 0.5


@pytest.mark.parametrize(
    "bad", [np.zeros(2), np.zeros(4), np.zeros(0), np.zeros((1, 3)), np.zeros(()), [0.0]]
)
def test_points_of_another_size_are_refused(bad):
    region = TrainedRegion.of(np.random.default_rng(0).uniform(-1, 1, (20, 3)))
    for ask in (region.inside, region.distance, region.distances):
        if ask == region.distances and np.shape(bad) == (1, 3):
            continue
        with pytest.raises(UsageError, match="3 inputs") as caught:
            ask(bad)
        assert caught.value.fix


def test_lists_are_points_and_what_is_not_finite_is_outside():
    region = TrainedRegion.of(np.zeros((4, 3)))
    assert region.inside([0, 0, 0])
    assert region.distance([0, 3, 4]) == 5.0
    assert region.distances([[0, 3, 4]]).tolist() == [5.0]
    for lost in (np.nan, np.inf):
        assert not region.inside(np.array([0.0, 0.0, lost]))
    strided = np.arange(6.0)[::2]
    assert region.distance(strided) == np.sqrt(20.0)


def test_what_is_no_region_is_refused():
    with pytest.raises(UsageError, match="Keep one"):
        TrainedRegion.of(np.zeros((4, 2)), most=0)
    for bad in (np.zeros((0, 2)), np.full((3, 2), np.nan), np.zeros(5), np.zeros((2, 2, 2))):
        with pytest.raises(UsageError, match="no region"):
            TrainedRegion.of(bad)
    with pytest.raises(UsageError):
        TrainedRegion(np.zeros((3, 2)), -1.0)


def test_a_query_costs_less_than_the_distances_by_numpy():
    region = TrainedRegion.of(np.random.default_rng(0).uniform(-1, 1, (2000, 6)))
    x = np.zeros(6)
    queries = {"region": lambda: region.inside(x), "NumPy": lambda: ((region.points - x) ** 2).sum(axis=1)}
    least = dict.fromkeys(queries, np.inf)
    for _ in range(200):
        for name, query in queries.items():
            began = time.perf_counter()
            query()
            least[name] = min(least[name], time.perf_counter() - began)
    assert least["region"] < least["NumPy"]  # 2 of 15 µs


@pytest.mark.full
def test_a_region_of_very_many_inputs_holds_them_all():
    X = np.random.default_rng(0).uniform(-1, 1, (30_000, 2))
    X[7] = 3.0, 3.0  # alone, and perhaps not among those of which points are chosen
    region = TrainedRegion.of(X, most=100)
    assert len(region.points) == 100
    assert (region.distances(X) <= region.radius).all()
