"""scikit-learn's perceptron, as the rivals of every benchmark use it."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

__all__ = ["perceptron"]


def perceptron(
    X: np.ndarray,
    Y: np.ndarray,
    *,
    layers: tuple[int, ...],
    decay: float,
    steps: int,
    tolerance: float = 1e-10,
    calls: int | None = None,
    seed: int = 0,
) -> Any:
    """A fitted `MLPRegressor`: tanh, L-BFGS with at most so many steps and, by default twice as many, calls."""
    from sklearn.neural_network import MLPRegressor

    model = MLPRegressor(
        hidden_layer_sizes=layers,
        activation="tanh",
        solver="lbfgs",
        alpha=decay,
        tol=tolerance,
        max_iter=steps,
        max_fun=2 * steps if calls is None else calls,
        random_state=seed,
    )
    with warnings.catch_warnings():
        # the number of steps is the training budget
        warnings.simplefilter("ignore")
        return model.fit(X, Y)
