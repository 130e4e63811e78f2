"""Interpolation and regression by others in several inputs, each tuned on its training data alone.

A rival is a function (X (N, n), Y (N, m)) → `Model`; inputs lie in [−1, 1], outputs are about 1. Choices are made by
holding out every fifth sample. Input scales come from the likelihood of a Matérn-5/2 process on 500 samples, and a
hold-out decides whether to use them.
"""

from __future__ import annotations

import importlib.util
import itertools
import pickle
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.perceptron import perceptron

__all__ = ["MISSING", "RIVALS", "Model"]

Predictor = Callable[[np.ndarray], np.ndarray]
Fit = Callable[[np.ndarray, np.ndarray], "Model"]


@dataclass(frozen=True, eq=False)
class Model:
    """A fitted rival: X (M, n) → Y (M, m), what it keeps in memory, and what was chosen."""

    predict: Predictor
    kept: Any
    chosen: str = ""

    @property
    def size(self) -> int:
        """Bytes of what it keeps, serialised."""
        return len(self.kept) if isinstance(self.kept, bytes) else len(pickle.dumps(self.kept))


def rbf_interpolator(X: np.ndarray, Y: np.ndarray) -> Model:
    """SciPy's `RBFInterpolator`, all outputs at once; kernel and input scales by hold-out."""
    from scipy.interpolate import RBFInterpolator

    def of(kernel: str, scales: np.ndarray, label: str) -> Fit:
        def fit(X: np.ndarray, Y: np.ndarray) -> Model:
            model = RBFInterpolator(X * scales, Y, kernel=kernel, degree=1)
            return Model(lambda q: model(q * scales), model, label)

        return fit

    found = _likely_scales(X, Y)
    tuned, plain = found / np.exp(np.log(found).mean()), np.ones(len(found))
    kernels = ("cubic", "thin_plate_spline", "linear")
    return _best(
        [
            *(of(kernel, plain, kernel) for kernel in kernels),
            *(of(kernel, tuned, f"{kernel}, scaled") for kernel in kernels),
        ],
        X,
        Y,
    )


def pod_rbf(X: np.ndarray, Y: np.ndarray) -> Model:
    """Proper orthogonal decomposition of the outputs, then `RBFInterpolator` for the modes."""
    return _through_modes(rbf_interpolator)(X, Y)


def gaussian_process(X: np.ndarray, Y: np.ndarray) -> Model:
    """scikit-learn's `GaussianProcessRegressor`, Matérn 5/2, a length for each input, one kernel for all modes."""
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import Matern

    def of(lengths: np.ndarray, jitter: float, label: str) -> Fit:
        def fit(X: np.ndarray, Y: np.ndarray) -> Model:
            model = GaussianProcessRegressor(Matern(lengths, nu=2.5), alpha=jitter, optimizer=None).fit(X, Y)
            return Model(model.predict, model, label)

        return fit

    lengths = 1.0 / _likely_scales(X, Y)
    choices = [
        of(factor * lengths, jitter, f"lengths × {factor:g}, jitter {jitter:g}")
        for factor, jitter in itertools.product((0.8, 1.25, 2.0), (1e-8, 1e-5))
    ]
    return _best(choices, X, Y)


def kernel_ridge(X: np.ndarray, Y: np.ndarray) -> Model:
    """scikit-learn's `KernelRidge`: Gaussian or polynomial, width, degree and ridge by hold-out."""
    from sklearn.kernel_ridge import KernelRidge

    found = _likely_scales(X, Y)

    def of(scales: np.ndarray, **options: Any) -> Fit:
        def fit(X: np.ndarray, Y: np.ndarray) -> Model:
            model = KernelRidge(**options).fit(X * scales, Y)
            return Model(lambda q: model.predict(q * scales), model, str(options))

        return fit

    choices = [
        of(found, kernel="rbf", gamma=g, alpha=a)
        for g, a in itertools.product((0.2, 0.5, 1.0, 2.0), (1e-8, 1e-5, 1e-3))
    ]
    choices += [of(found, kernel="poly", degree=d, coef0=1.0, alpha=1e-3) for d in (3, 4, 5)]
    return _best(choices, X, Y)


def smt_rbf(X: np.ndarray, Y: np.ndarray) -> Model:
    """SMT's `RBF`: Gaussian; width and polynomial degree by hold-out."""
    from smt.surrogate_models import RBF

    found = _likely_scales(X, Y)

    def of(width: float, degree: int) -> Fit:
        def fit(X: np.ndarray, Y: np.ndarray) -> Model:
            model = RBF(d0=width, poly_degree=degree, print_global=False)
            model.set_training_values(X * found, Y)
            model.train()
            return Model(
                lambda q: model.predict_values(q * found),
                # not its log nor its copy of the options
                (X, model.sol if hasattr(model, "sol") else Y),
                f"d0 {width:g}, degree {degree}",
            )

        return fit

    return _best([of(d, p) for d, p in itertools.product((0.5, 0.8, 1.2, 2.0), (0, 1))], X, Y)


def mlp(X: np.ndarray, Y: np.ndarray) -> Model:
    """scikit-learn's `MLPRegressor`: two layers of 100 tanh, L-BFGS; decay by hold-out at a fifth of the steps.

    2,000 steps, or 10,000 up to 1,000 samples.
    """
    model, label = _perceptron(X, Y)
    return Model(model.predict, model, label)


def onnx_mlp(X: np.ndarray, Y: np.ndarray) -> Model:
    """The same perceptron exported and run by ONNX Runtime, single precision, one thread."""
    import onnxruntime
    from skl2onnx import to_onnx

    model, label = _perceptron(X, Y)
    written = to_onnx(model, X[:1].astype(np.float32)).SerializeToString()
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(written, options, providers=["CPUExecutionProvider"])
    name = session.get_inputs()[0].name

    def predict(q: np.ndarray) -> np.ndarray:
        # the exporter flattens several outputs into one column
        return np.asarray(session.run(None, {name: q.astype(np.float32)})[0]).reshape(len(q), -1)

    return Model(predict, written, label)


_TRAINED: list[tuple[np.ndarray, np.ndarray, Any, str]] = []  # the last perceptron, as two rivals share it


def _perceptron(X: np.ndarray, Y: np.ndarray) -> tuple[Any, str]:
    if _TRAINED and np.array_equal(_TRAINED[0][0], X) and np.array_equal(_TRAINED[0][1], Y):
        return _TRAINED[0][2:]

    def of(decay: float, steps: int) -> Fit:
        def fit(X: np.ndarray, Y: np.ndarray) -> Model:
            model = perceptron(X, Y, layers=(100, 100), decay=decay, steps=steps)
            return Model(model.predict, model, f"decay {decay:g}")

        return fit

    steps = 2000 if len(X) > 1000 else 10000
    decays = (1e-4, 1e-3, 1e-2, 1e-1)
    errors = [_heldout_error(of(decay, steps // 5), X, Y) for decay in decays]
    model = of(decays[int(np.argmin(errors))], steps)(X, Y)
    _TRAINED[:] = [(X, Y, model.kept, model.chosen)]
    return model.kept, model.chosen


def _likely_scales(X: np.ndarray, Y: np.ndarray) -> np.ndarray:
    """Reciprocal lengths (n,) of a Matérn-5/2 process by its likelihood on at most 500 samples."""
    try:
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import ConstantKernel, Matern
    except ImportError:
        return np.ones(X.shape[1])
    latent = _modes(Y)[0][:500]
    kernel = ConstantKernel(1.0, (1e-3, 1e4)) * Matern(np.full(X.shape[1], 2.0), (1e-2, 1e2), nu=2.5)
    model = GaussianProcessRegressor(kernel, alpha=1e-8)
    with warnings.catch_warnings():
        # a length at its bound is an answer here
        warnings.simplefilter("ignore")
        model.fit(X[:500], latent)
    return 1.0 / np.broadcast_to(model.kernel_.k2.length_scale, X.shape[1])


def _modes(Y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Y (N, m) ≈ latent (N, k) V (k, m), all but 1e-6 of it."""
    values, V = np.linalg.eigh(Y.T @ Y if Y.shape[1] <= len(Y) else Y @ Y.T)
    kept = values > 1e-12 * values[-1]
    V = V[:, kept][:, ::-1]
    if Y.shape[1] > len(Y):
        V = Y.T @ V / np.sqrt(values[kept][::-1])
    return Y @ V, V.T


def _through_modes(fit: Fit) -> Fit:
    """The rival learns the outputs' modes; what it keeps includes them."""

    def through(X: np.ndarray, Y: np.ndarray) -> Model:
        latent, V = _modes(Y)
        size = float(np.sqrt((latent**2).mean()))
        model = fit(X, latent / size)
        decode = size * V
        return Model(lambda q: model.predict(q) @ decode, (model.kept, decode), model.chosen)

    return through


def _heldout_error(fit: Fit, X: np.ndarray, Y: np.ndarray) -> float:
    held = np.arange(len(X)) % 5 == 2
    try:
        return float(((fit(X[~held], Y[~held]).predict(X[held]) - Y[held]) ** 2).mean())
    except np.linalg.LinAlgError:  # a flat kernel is singular in floating point: not this one
        return float("inf")


def _best(choices: Iterable[Fit], X: np.ndarray, Y: np.ndarray) -> Model:
    """The choice that predicts every fifth sample best from the others, fitted to all of them."""
    return min(choices, key=lambda fit: _heldout_error(fit, X, Y))(X, Y)


_KNOWN: dict[str, tuple[Fit, tuple[str, ...]]] = {
    "RBFInterpolator (SciPy)": (rbf_interpolator, ()),
    "POD + RBFInterpolator": (pod_rbf, ()),
    "GaussianProcessRegressor (scikit-learn)": (_through_modes(gaussian_process), ("sklearn",)),
    "KernelRidge (scikit-learn)": (_through_modes(kernel_ridge), ("sklearn",)),
    "MLPRegressor (scikit-learn)": (_through_modes(mlp), ("sklearn",)),
    "the same perceptron, ONNX Runtime": (_through_modes(onnx_mlp), ("sklearn", "onnxruntime", "skl2onnx")),
    "RBF (SMT)": (_through_modes(smt_rbf), ("smt",)),
}
MISSING = tuple(
    name for name, (_, needs) in _KNOWN.items() if not all(importlib.util.find_spec(need) for need in needs)
)
"""Rivals whose packages are not installed."""
RIVALS: dict[str, Fit] = {name: fit for name, (fit, _) in _KNOWN.items() if name not in MISSING}
"""Every rival that is installed, by the name in the tables."""
