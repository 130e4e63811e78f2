"""Forces of a touched body learnt by others, from the same solves and the same images under its symmetry.

Every rival is a function of a case and its training → `TouchFunction`, with forces that are zero where the probe does
not touch, as the surface's geometry alone says. Inputs are scaled to [−1, 1], forces to about 1. Choices are made by
holding out every fifth solve with its images.
"""

from __future__ import annotations

import importlib.util
import warnings
from collections.abc import Callable, Mapping

import numpy as np

from benchmarks.perceptron import perceptron
from benchmarks.surrogate_cases import Case, Training
from palpate.units import bounds
from palpate.validation import TouchFunction

__all__ = ["RIVALS", "learnt"]

Predictor = Callable[[np.ndarray], np.ndarray]
Fit = Callable[[np.ndarray, np.ndarray], Predictor]
Rival = Callable[[Case, Training], TouchFunction]
STEP = 1e-6  # m: of the differences that give a stiffness where a rival has no derivative
ROWS = 1000  # queries at a time: matrices against thousands of samples
LIKELY = 400  # samples by which a kernel's lengths are found
SAME_PLACE = 3e-4  # m: places nearer to each other are one
STEPS = 2000  # of a perceptron's L-BFGS


def cubic_rbf(x: np.ndarray, Y: np.ndarray) -> Predictor:
    """SciPy's `RBFInterpolator`: cubic with a linear tail (Wendland 2005, section 8.5)."""
    from scipy.interpolate import RBFInterpolator

    tail = 1 if len(x) > 2 * x.shape[1] + 2 else 0
    return RBFInterpolator(x, Y, kernel="cubic" if tail else "linear", degree=tail)


def gaussian_process(x: np.ndarray, Y: np.ndarray) -> Predictor:
    """scikit-learn's `GaussianProcessRegressor`: lengths by likelihood, kernel and jitter by hold-out."""
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Kernel, Matern

    some = np.random.default_rng(0).permutation(len(x))[:LIKELY]
    lengths, limits = np.ones(x.shape[1]), (1e-2, 1e2)

    def of(kernel: Kernel, jitter: float) -> Fit:
        with warnings.catch_warnings():
            # a length at its bound is an answer here
            warnings.simplefilter("ignore")
            found = GaussianProcessRegressor(ConstantKernel(10.0, (1e-3, 1e6)) * kernel, alpha=jitter)
            found.fit(x[some], Y[some])

        def fit(x: np.ndarray, Y: np.ndarray) -> Predictor:
            return GaussianProcessRegressor(found.kernel_, alpha=jitter, optimizer=None).fit(x, Y).predict

        return fit

    kernels = {"RBF": RBF(lengths, limits), "Matérn 5/2": Matern(lengths, limits, nu=2.5)}
    return _best({f"{k}, {a:g}": of(v, a) for k, v in kernels.items() for a in (1e-9, 1e-6)}, x, Y)


def mlp(x: np.ndarray, Y: np.ndarray) -> Predictor:
    """scikit-learn's `MLPRegressor`: two layers of 64 tanh, L-BFGS; weight decay by hold-out."""

    def of(decay: float, steps: int) -> Fit:
        def fit(x: np.ndarray, Y: np.ndarray) -> Predictor:
            return perceptron(x, Y, layers=(64, 64), decay=decay, steps=steps).predict

        return fit

    choices = {f"{decay:g}": of(decay, STEPS // 5) for decay in (1e-5, 1e-3, 1e-1)}
    return of(float(_chosen(choices, x, Y)), STEPS)(x, Y)


def learnt(fit: Fit, name: str) -> Rival:
    """A rival that learns the three components of the force."""

    def rival(case: Case, training: Training) -> TouchFunction:
        X, F = case.images(training.X, training.force)
        low, high = bounds(case.inputs)
        size = float(np.sqrt((F**2).mean()))

        def scaled(X: np.ndarray) -> np.ndarray:
            return np.asarray(2 * (X - low) / (high - low) - 1)

        predict = fit(*_rows(scaled(X), F / size))

        def force(X: np.ndarray) -> np.ndarray:
            return size * _chunked(predict, scaled(X))

        return function(case, name, force)

    return rival


def function(case: Case, name: str, force: Predictor) -> TouchFunction:
    """A force, made zero where nothing is touched, with a stiffness by central differences."""

    def touching(X: np.ndarray) -> np.ndarray:
        depth = case.surface.depth(X[:, :3], case.radius)
        return np.where((depth > 0)[:, None], force(X), 0.0)

    def stiffness(X: np.ndarray) -> np.ndarray:
        K = np.empty((len(X), 3, 3))
        for j in range(3):
            step = np.zeros(X.shape[1])
            step[j] = STEP
            K[:, :, j] = (touching(X + step) - touching(X - step)) / (2 * STEP)
        return K

    return TouchFunction(
        name,
        case.inputs,
        touching,
        stiffness=stiffness,
        depth=lambda X: case.surface.depth(X[:, :3], case.radius),
    )


def linear_in_depth(case: Case, training: Training) -> TouchFunction:
    """The force of a linear-elastic body: k(x, y) times the depth, k (3,) from the shallowest third of the depths.

    Each place's k is a least-squares fit through zero; between places it is interpolated as by `cubic_rbf`.
    """
    from scipy.linalg import lstsq

    X, F = case.images(training.X, training.force)
    X, F = X.reshape(-1, X.shape[2]), F.reshape(-1, 3)
    feet, depth = _feet(case, X)
    shallow = depth < max(case.study.depth / 3, np.sort(depth)[max(0, len(depth) // 3 - 1)])
    feet, depth, F = feet[shallow], depth[shallow], F[shallow]
    place = _places(feet)
    k = np.array([lstsq(depth[place == i, None], F[place == i])[0][0] for i in np.unique(place)])
    at, size = np.array([feet[place == i].mean(axis=0) for i in np.unique(place)]), float(np.abs(k).max())
    low, high = at.min(axis=0), at.max(axis=0)
    width = np.where(high > low, high - low, 1.0)
    predict = cubic_rbf((at - low) / width, k / size)

    def force(X: np.ndarray) -> np.ndarray:
        feet, depth = _feet(case, X)
        return size * depth[:, None] * _chunked(predict, (feet - low) / width)

    return function(case, "force linear in depth", force)


def _places(feet: np.ndarray) -> np.ndarray:
    """Number (N,) of the place of each touch: on a curved body those of one column differ a little."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    pairs = cKDTree(feet).query_pairs(SAME_PLACE, output_type="ndarray")
    near = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(len(feet), len(feet)))
    return np.asarray(connected_components(near, directed=False)[1])


def _feet(case: Case, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places in the plane with the further inputs (N, n − 1), and depths (N,) in m."""
    d, gradient, _ = case.surface.at(X[:, :3])
    foot = X[:, :3] - d[:, None] * gradient
    return np.hstack([foot[:, :2], X[:, 3:]]), case.radius - d


def _rows(x: np.ndarray, Y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Samples (N, images, n) as rows, every fifth solve last, without images that coincide.

    On a plane of symmetry two images are one place, and an interpolation can't take two values there.
    """
    order = np.argsort(np.arange(len(x)) % 5, kind="stable")
    x, Y = x[order].reshape(-1, x.shape[2]), Y[order].reshape(-1, 3)
    first = np.sort(np.unique(np.round(x / 1e-7).astype(np.int64), axis=0, return_index=True)[1])
    return x[first], Y[first]


def _chunked(predict: Predictor, x: np.ndarray) -> np.ndarray:
    return np.concatenate([np.reshape(predict(x[i : i + ROWS]), (-1, 3)) for i in range(0, len(x), ROWS)])


def _chosen(choices: Mapping[str, Fit], x: np.ndarray, Y: np.ndarray) -> str:
    """The choice that predicts a fifth of the solves best from the others."""
    # so they are whole solves: see `_rows`
    held = np.arange(len(x)) >= len(x) - len(x) // 5

    def error(fit: Fit) -> float:
        try:
            return float(((fit(x[~held], Y[~held])(x[held]) - Y[held]) ** 2).mean())
        except np.linalg.LinAlgError:  # a flat kernel is singular in floating point: not this one
            return float("inf")

    return min(choices, key=lambda name: error(choices[name]))


def _best(choices: Mapping[str, Fit], x: np.ndarray, Y: np.ndarray) -> Predictor:
    return choices[_chosen(choices, x, Y)](x, Y)


RIVALS: dict[str, Rival] = {
    "cubic RBF (SciPy)": learnt(cubic_rbf, "cubic RBF"),
    "linear in depth": linear_in_depth,
}
"""Every rival that is installed and answers at once, by the name in the tables."""

if importlib.util.find_spec("sklearn"):
    RIVALS |= {
        "GPR (scikit-learn)": learnt(gaussian_process, "Gaussian process"),
        "MLP (scikit-learn)": learnt(mlp, "perceptron"),
    }
