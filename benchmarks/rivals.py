"""Interpolation and regression by others, each tuned on its training data alone.

Every rival is a function (x (N,), Y (N, m)) → predictor, inputs scaled to [−1, 1] and outputs to about 1, as for
palpate's own networks; a predictor maps x (M,) to (M, m). Where a rival has choices, they are made by holding
out every fifth training sample: by a fit on the others and the error on these.
"""

from __future__ import annotations

import importlib.util
import warnings
from collections.abc import Callable, Mapping

import numpy as np

from benchmarks.perceptron import perceptron

__all__ = ["RIVALS", "Predictor", "gaussian_process", "mlp", "rbf_interpolator"]

Predictor = Callable[[np.ndarray], np.ndarray]
Fit = Callable[[np.ndarray, np.ndarray], Predictor]


def chebyshev(x: np.ndarray, Y: np.ndarray) -> Predictor:
    """Chebyshev polynomial by least squares; the degree by hold-out."""
    from numpy.polynomial.chebyshev import chebfit, chebval

    def of_degree(degree: int) -> Fit:
        def fit(x: np.ndarray, Y: np.ndarray) -> Predictor:
            c = chebfit(x, Y, degree)
            return lambda q: chebval(q, c).T

        return fit

    # beyond 2√N evenly spaced samples no longer tame the polynomial (Rakhmanov 2007)
    top = int(2 * np.sqrt(0.8 * len(x)))
    return _best({f"degree {d}": of_degree(d) for d in range(2, top + 1)}, x, Y)


def cubic_spline(x: np.ndarray, Y: np.ndarray) -> Predictor:
    """SciPy's `CubicSpline`, not-a-knot ends (de Boor 1978)."""
    from scipy.interpolate import CubicSpline

    return CubicSpline(x, Y)


def quintic_spline(x: np.ndarray, Y: np.ndarray) -> Predictor:
    """SciPy's `make_interp_spline` of degree 5."""
    from scipy.interpolate import make_interp_spline

    return make_interp_spline(x, Y, k=5)


def rbf_interpolator(x: np.ndarray, Y: np.ndarray) -> Predictor:
    """SciPy's `RBFInterpolator`; kernel and shape parameter by hold-out."""
    from scipy.interpolate import RBFInterpolator

    def of(kernel: str, epsilon: float) -> Fit:
        def fit(x: np.ndarray, Y: np.ndarray) -> Predictor:
            model = RBFInterpolator(x[:, None], Y, kernel=kernel, epsilon=epsilon)
            return lambda q: model(q[:, None])

        return fit

    choices = {kernel: of(kernel, 1.0) for kernel in ("linear", "thin_plate_spline", "cubic", "quintic")}
    for kernel in ("gaussian", "inverse_multiquadric", "multiquadric"):
        choices |= {f"{kernel}, {e:g}": of(kernel, e) for e in (0.5, 1.0, 2.0, 4.0, 8.0)}
    return _best(choices, x, Y)


def gaussian_process(x: np.ndarray, Y: np.ndarray) -> Predictor:
    """scikit-learn's `GaussianProcessRegressor`: marginal likelihood; kernel and jitter by hold-out."""
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Kernel, Matern

    def of(kernel: Kernel, jitter: float) -> Fit:
        def fit(x: np.ndarray, Y: np.ndarray) -> Predictor:
            model = GaussianProcessRegressor(
                ConstantKernel(1.0, (1e-3, 1e6)) * kernel,
                alpha=jitter,
                n_restarts_optimizer=1,
                random_state=0,
            )
            with warnings.catch_warnings():
                # a hyperparameter at its bound is an answer here, not a fault
                warnings.simplefilter("ignore")
                model.fit(x[:, None], Y)
            return lambda q: model.predict(q[:, None])

        return fit

    bounds = (1e-2, 1e2)
    choices = {
        f"{name}, {jitter:g}": of(kernel, jitter)
        for name, kernel in {"RBF": RBF(1.0, bounds), "Matérn 5/2": Matern(1.0, bounds, nu=2.5)}.items()
        for jitter in (1e-12, 1e-10, 1e-8)
    }
    return _best(choices, x, Y)


def mlp(x: np.ndarray, Y: np.ndarray) -> Predictor:
    """scikit-learn's `MLPRegressor`: tanh, L-BFGS until it stops by itself; layers and start by hold-out."""

    def of(layers: tuple[int, ...], seed: int) -> Fit:
        def fit(x: np.ndarray, Y: np.ndarray) -> Predictor:
            model = perceptron(
                x[:, None], Y, layers=layers, decay=0.0, steps=3000, tolerance=1e-12, calls=30000, seed=seed
            )
            return lambda q: model.predict(q[:, None])

        return fit

    return _best({f"{n}, seed {s}": of(n, s) for n in ((10,), (64,), (32, 32)) for s in (0, 1)}, x, Y)


def _best(choices: Mapping[str, Fit], x: np.ndarray, Y: np.ndarray) -> Predictor:
    """The choice that predicts every fifth sample best from the others, fitted to all of them."""
    held = np.arange(len(x)) % 5 == 2

    def error(fit: Fit) -> float:
        try:
            return float(((fit(x[~held], Y[~held])(x[held]) - Y[held]) ** 2).mean())
        except np.linalg.LinAlgError:  # a flat kernel is singular in floating point: not this one
            return float("inf")

    return choices[min(choices, key=lambda name: error(choices[name]))](x, Y)


RIVALS: dict[str, Fit] = {
    "Chebyshev polynomial (NumPy)": chebyshev,
    "CubicSpline (SciPy)": cubic_spline,
    "quintic spline (SciPy)": quintic_spline,
    "RBFInterpolator (SciPy)": rbf_interpolator,
}
"""Every rival that is installed, by the name in the tables."""

if importlib.util.find_spec("sklearn"):
    RIVALS |= {
        "GaussianProcessRegressor (scikit-learn)": gaussian_process,
        "MLPRegressor (scikit-learn)": mlp,
    }
