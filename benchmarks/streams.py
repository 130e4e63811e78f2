"""Streams that drift, jump, have outliers or uneven noise: a learner as it comes beside recursive rivals.

python -m benchmarks.streams [--quick] [--json]
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from benchmarks.runner import main
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.learning import Learner
from palpate.units import Range

__all__ = ["scenario", "tables"]

SCENARIOS = ("drift", "jump", "outliers", "uneven noise")
SEEDS = 5
N, START, RATIO, MILLISECOND = 1200, 100, 1.15, 1.0
NOISE, UNITS = 0.05, 50
WIDTHS = (
    0.5,
    0.8,
    1.2,
)  # of the random units of recursive least squares: the best of them counts, in hindsight
REFIT = 100  # readings between two fits of a Gaussian process's hyperparameters

Predict = Callable[[np.ndarray], float]
Learn = Callable[[np.ndarray, float], None]


def scenario(name: str, seed: int, count: int = N) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Inputs (N, 2), readings (N,) and the truth (N,) without noise."""
    rng = np.random.default_rng(1000 + seed)
    X = rng.uniform(-1.0, 1.0, (count, 2))
    a, b = X.T
    first = np.sin(2.5 * a) * np.exp(0.5 * b) + 0.6 * b**2 - 0.3 * a
    second = 0.8 * np.cos(2.0 * a + b) + 0.5 * a * b - 0.5 * b
    share, deviation = np.zeros(count), np.full(count, NOISE)
    if name == "drift":
        share = np.arange(count) / count
    elif name == "jump":
        share = (np.arange(count) >= count // 2).astype(float)
    elif name == "uneven noise":
        deviation = 0.02 * np.exp(1.44 * (a + 1.0))  # 0.02 to 0.36
    truth = (1.0 - share) * first + share * second
    y = truth + deviation * rng.normal(size=count)
    if name == "outliers":
        out = rng.uniform(size=count) < 0.05
        y = np.where(out, truth + 20.0 * NOISE * rng.choice([-1.0, 1.0], count), y)
    return X, y, truth


def palpate_learner(seed: int) -> tuple[Predict, Learn]:
    """`Learner` as it comes."""
    inputs = [Range("a", -1.0, 1.0), Range("b", -1.0, 1.0)]
    learner = Learner(inputs, [Range("y", -2.0, 2.0)], seed=seed)

    def learn(x: np.ndarray, y: float) -> None:
        learner.observe(x, np.array([y]))

    return lambda x: float(learner.network.predict(x[None])[0, 0]), learn


def least_squares(seed: int, forgetting: float, width: float) -> tuple[Predict, Learn]:
    """Recursive least squares on the inputs, and 50 random Gaussian units if they have a width."""
    centres = np.random.default_rng(seed).uniform(-1.0, 1.0, (UNITS if width else 0, 2))
    state = {"P": 100.0 * np.eye(3 + len(centres)), "c": np.zeros(3 + len(centres))}

    def row(x: np.ndarray) -> np.ndarray:
        phi = np.exp(-((centres - x) ** 2).sum(axis=1) / (width or 1.0) ** 2)
        return np.concatenate([[1.0], x, phi])

    def learn(x: np.ndarray, y: float) -> None:
        a, P = row(x), state["P"]
        g = P @ a
        k = g / (forgetting + a @ g)
        state["c"] = state["c"] + k * (y - a @ state["c"])
        P = (P - np.outer(k, g)) / forgetting
        state["P"] = (P + P.T) / 2.0

    return lambda x: float(row(x) @ state["c"]), learn


def window_process(window: int) -> tuple[Predict, Learn]:
    """A Gaussian process of the last readings, its hyperparameters by likelihood every hundred."""
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    X: list[np.ndarray] = []
    Y: list[float] = []
    fitted: dict[str, Any] = {}

    def predict(x: np.ndarray) -> float:
        if len(Y) < 10:
            return float(np.mean(Y)) if Y else 0.0
        A, b = np.array(X[-window:]), np.array(Y[-window:])
        centre = b.mean()
        if "kernel" not in fitted or len(Y) in {25, 50} or len(Y) % REFIT == 0:
            kernel = ConstantKernel(1.0) * RBF([1.0, 1.0], (0.05, 20.0)) + WhiteKernel(0.01, (1e-6, 10.0))
            fitted["kernel"] = GaussianProcessRegressor(kernel).fit(A, b - centre).kernel_
        kernel = fitted["kernel"]
        weights = cho_solve(cho_factor(kernel(A)), b - centre)
        return float(centre + (kernel.k1(x[None], A) @ weights)[0])

    def learn(x: np.ndarray, y: float) -> None:
        X.append(x)
        Y.append(y)

    return predict, learn


def river_models(seed: int) -> Iterator[tuple[str, tuple[Predict, Learn]]]:
    """River's regressors, where it is installed."""
    try:
        from river import forest, linear_model, neighbors, preprocessing, tree
    except ImportError:
        return
    scale = preprocessing.StandardScaler
    models = {
        "adaptive random forest": forest.ARFRegressor(seed=seed),
        "nearest neighbours": scale() | neighbors.KNNRegressor(n_neighbors=5),
        "adaptive Hoeffding tree": tree.HoeffdingAdaptiveTreeRegressor(seed=seed, grace_period=50),
        "Bayesian linear regression": scale() | linear_model.BayesianLinearRegression(smoothing=0.99),
    }
    for name, model in models.items():

        def predict(x: np.ndarray, model: Any = model) -> float:
            return float(model.predict_one(dict(enumerate(x))) or 0.0)

        def learn(x: np.ndarray, y: float, model: Any = model) -> None:
            model.learn_one(dict(enumerate(x)), y)

        yield f"{name} (river)", (predict, learn)


def contenders(seed: int) -> Iterator[tuple[str, tuple[Predict, Learn]]]:
    """All of them, by name."""
    yield "palpate, Learner()", palpate_learner(seed)
    for forgetting in (0.99, 0.999):
        yield f"least squares, inputs, λ = {forgetting}", least_squares(seed, forgetting, 0.0)
        for width in WIDTHS:
            yield (
                f"least squares, 50 units of width {width}, λ = {forgetting}",
                least_squares(seed, forgetting, width),
            )
    for window in (100, 250):
        yield f"Gaussian process of {window} readings", window_process(window)
    yield from river_models(seed)


def tables(*, quick: bool = False) -> list[Table]:
    """One table; `quick` takes one seed and few readings."""
    count, seeds = (150, range(1)) if quick else (N, range(SEEDS))
    errors: dict[str, dict[str, list[float]]] = {}
    spent: dict[str, list[float]] = {}
    for name in SCENARIOS:
        for seed in seeds:
            X, y, truth = scenario(name, seed, count)
            for who, (predict, learn) in contenders(seed):
                missed = np.zeros(count)
                for i in range(count):
                    missed[i] = predict(X[i]) - truth[i]
                    began = time.thread_time()
                    learn(X[i], float(y[i]))
                    spent.setdefault(who, []).append(1e3 * (time.thread_time() - began))
                errors.setdefault(who, {}).setdefault(name, []).append(
                    float(np.sqrt((missed[START:] ** 2).mean()))
                )
    means = {who: {s: statistics.fmean(e) for s, e in by.items()} for who, by in errors.items()}
    rows = [{"who": who, **by, "p99": float(np.percentile(spent[who], 99))} for who, by in means.items()]
    own = next(iter(means))
    claims = []
    for s in SCENARIOS:
        best = min(by[s] for who, by in means.items() if who != own)
        claims.append(Claim(f"{s}, error over the best rival's", (means[own][s] / best,), RATIO, ".2f"))
    claims.append(
        Claim(
            "CPU ms of a reading, 99th percentile",
            (float(np.percentile(spent[own], 99)),),
            MILLISECOND,
            ".2f",
        )
    )
    return [_table(rows, [] if quick else claims, quick_mark(quick))]


def _table(rows: list[dict[str, Any]], claims: list[Claim], shape: str) -> Table:
    return Table(
        "streams",
        "Streams of 1,200 readings that drift, jump, have outliers or uneven noise" + shape,
        (
            Column("who", "learner"),
            *(Column(s, s, ".3f") for s in SCENARIOS),
            Column("p99", "CPU ms a reading, p99", ".2f"),
        ),
        rows,
        claims,
        (
            "RMS error against the truth of what is foreseen before each reading, from the 101st on; mean of the seeds",
            "two inputs; noise 0.05, uneven 0.02 to 0.36; 5 % outliers at 20 deviations; the jump after 600 readings",
            "least squares: random Gaussian units over the range and an affine tail, best of three widths in hindsight",
            "time of learning alone: a Gaussian process pays when it predicts",
        ),
    )


if __name__ == "__main__":
    sys.exit(main(only="streams"))
