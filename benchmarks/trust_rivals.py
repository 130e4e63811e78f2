"""Surrogates of other packages, each with the settings that its users take for a small table."""

from __future__ import annotations

import importlib.util
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = ["RIVALS", "Rival"]


@dataclass(frozen=True, eq=False)
class Rival:
    """A fitted surrogate: its prediction, and its standard deviation where it has one."""

    predict: Callable[[np.ndarray], np.ndarray]
    with_deviation: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def _none(X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    raise NotImplementedError


def gaussian_process(X: np.ndarray, y: np.ndarray) -> Rival:
    """Fit scikit-learn's Gaussian process: a length for each input, noise, two restarts of up to 300 rows."""
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
    from sklearn.preprocessing import StandardScaler

    scaler = StandardScaler().fit(X)
    kernel = ConstantKernel(1.0, (1e-3, 1e5)) * RBF(np.ones(X.shape[1]), (1e-2, 1e3))
    model = GaussianProcessRegressor(
        kernel + WhiteKernel(1e-3, (1e-9, 1e1)),
        normalize_y=True,
        n_restarts_optimizer=2 if len(y) <= 300 else 0,
        random_state=0,
    ).fit(scaler.transform(X), y)
    return Rival(
        lambda q: np.asarray(model.predict(scaler.transform(q))),
        lambda q: model.predict(scaler.transform(q), return_std=True),
    )


def kriging(X: np.ndarray, y: np.ndarray) -> Rival:
    """Fit SMT's Kriging with its noise estimated."""
    from smt.surrogate_models import KRG

    model = KRG(print_global=False, eval_noise=True, theta0=[1e-2] * X.shape[1])
    model.set_training_values(X, y)
    model.train()
    return Rival(lambda q: model.predict_values(q)[:, 0], _none)


def perceptron(X: np.ndarray, y: np.ndarray) -> Rival:
    """Fit scikit-learn's perceptron of two layers of 100, by L-BFGS."""
    from sklearn.compose import TransformedTargetRegressor
    from sklearn.neural_network import MLPRegressor
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    network = MLPRegressor(
        hidden_layer_sizes=(100, 100), solver="lbfgs", alpha=1e-2, max_iter=1000, random_state=0
    )
    model = TransformedTargetRegressor(make_pipeline(StandardScaler(), network), transformer=StandardScaler())
    return Rival(model.fit(X, y).predict, _none)


def lightgbm(X: np.ndarray, y: np.ndarray) -> Rival:
    """Fit LightGBM as it comes."""
    from lightgbm import LGBMRegressor

    return Rival(LGBMRegressor(verbose=-1, n_jobs=1, random_state=0).fit(X, y).predict, _none)


def catboost(X: np.ndarray, y: np.ndarray) -> Rival:
    """Fit CatBoost as it comes."""
    from catboost import CatBoostRegressor

    model = CatBoostRegressor(verbose=0, thread_count=1, random_seed=0, allow_writing_files=False)
    return Rival(model.fit(X, y).predict, _none)


def _quiet(fit: Callable[[np.ndarray, np.ndarray], Rival]) -> Callable[[np.ndarray, np.ndarray], Rival]:
    """Return a fit that keeps its warnings on convergence and feature names to itself."""

    def quiet(X: np.ndarray, y: np.ndarray) -> Any:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return fit(X, y)

    return quiet


_KNOWN = {
    "Gaussian process": (gaussian_process, "sklearn"),
    "SMT KRG": (kriging, "smt"),
    "MLP": (perceptron, "sklearn"),
    "LightGBM": (lightgbm, "lightgbm"),
    "CatBoost": (catboost, "catboost"),
}
RIVALS = {name: _quiet(fit) for name, (fit, needs) in _KNOWN.items() if importlib.util.find_spec(needs)}
"""Every rival that is installed, by the name in the tables."""
