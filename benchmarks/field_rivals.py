"""Fields from few solves by other libraries, each at its best settings.

Every rival is a function (X (N, n), Y (N, nodes)) → `FieldModel`, inputs scaled to [−1, 1]. It takes a proper
orthogonal decomposition of the fields; for libraries without one, the leading modes by a singular value decomposition.
Settings are chosen by a fit on four fifths of the solves and its error on every fifth; so is whether inputs come as
they are or as their logarithms, which palpate too decides by solves left out.
"""

from __future__ import annotations

import importlib.util
import itertools
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.units import Range, bounds

__all__ = ["MISSING", "RIVALS", "FieldModel", "best_of"]


@dataclass(frozen=True)
class FieldModel:
    """A fitted rival: inputs (M, n) → fields (M, nodes), and the settings that were chosen."""

    predict: Callable[[np.ndarray], np.ndarray]
    settings: str


Fit = Callable[[np.ndarray, np.ndarray], FieldModel]
_MODES = 6  # more of them change no figure here
_RANKS = (3, _MODES)  # of EZyRB, one of whose processes is of all modes together


def _ezyrb(X: np.ndarray, Y: np.ndarray) -> Iterable[Fit]:
    """Yield EZyRB's POD with its Gaussian process and its radial basis functions."""
    from ezyrb import GPR, POD, RBF, Database, ReducedOrderModel
    from sklearn.gaussian_process.kernels import RBF as SquaredExponential
    from sklearn.gaussian_process.kernels import Matern

    n = X.shape[1]
    kernels = {
        "squared exponential": SquaredExponential(np.ones(n)),
        "Matérn 5/2": Matern(np.ones(n), nu=2.5),
    }
    makers: dict[str, Callable[[], object]] = {
        f"POD, GPR, {name}": lambda kernel=kernel: GPR(kern=kernel, optimization_restart=3)
        for name, kernel in kernels.items()
    }
    makers |= {
        f"POD, RBF, {name}": lambda name=name: RBF(kernel=name)
        for name in ("cubic", "thin_plate_spline", "quintic")
    }
    makers |= {
        f"POD, RBF, multiquadric, ε {epsilon:g}": lambda epsilon=epsilon: RBF("multiquadric", epsilon=epsilon)
        for epsilon in (0.3, 1.0)
    }
    for rank, (name, make) in itertools.product(_RANKS, makers.items()):

        def fit(
            X: np.ndarray,
            Y: np.ndarray,
            rank: int = rank,
            name: str = name,
            make: Callable[[], object] = make,
        ) -> FieldModel:
            model = ReducedOrderModel(Database(X, Y), POD("svd", rank=rank), make()).fit()
            return FieldModel(model.predict, f"{name}, {rank} modes")

        yield fit


def _smt(X: np.ndarray, Y: np.ndarray) -> Iterable[Fit]:
    """Yield SMT's Kriging of the leading modes, one for each."""
    from smt.surrogate_models import KRG

    for corr, poly in itertools.product(("squar_exp", "matern52"), ("constant", "linear")):

        def fit(X: np.ndarray, Y: np.ndarray, corr: str = corr, poly: str = poly) -> FieldModel:
            def of_mode(y: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
                model = KRG(
                    corr=corr,
                    poly=poly,
                    theta0=[0.1] * X.shape[1],
                    hyper_opt="TNC",
                    n_start=5,
                    print_global=False,
                    seed=0,
                )
                model.set_training_values(X, y[:, None])
                model.train()
                return lambda Q: model.predict_values(Q)[:, 0]

            return FieldModel(_through_modes(of_mode, Y), f"KRG, {corr}, {poly}")

        yield fit


def _openturns(X: np.ndarray, Y: np.ndarray) -> Iterable[Fit]:
    """Yield OpenTURNS' Kriging and its sparse polynomial chaos of the leading modes."""
    import openturns as ot

    n = X.shape[1]
    kernels = {
        "squared exponential": ot.SquaredExponential,
        "Matérn 5/2": lambda s: ot.MaternModel(s, [1.0], 2.5),
    }
    bases = {"constant": ot.ConstantBasisFactory, "linear": ot.LinearBasisFactory}
    for (kernel, make), (trend, basis) in itertools.product(kernels.items(), bases.items()):

        def kriging(
            X: np.ndarray,
            Y: np.ndarray,
            make: Callable[..., object] = make,
            basis: Callable[..., object] = basis,
            name: str = f"Kriging, {kernel}, {trend}",
        ) -> FieldModel:
            def of_mode(y: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
                fitter = ot.GaussianProcessFitter(
                    ot.Sample(X), ot.Sample(y[:, None]), make([1.0] * n), basis(n).build()
                )
                fitter.setOptimizationBounds(ot.Interval([1e-2] * n, [1e2] * n))
                solver = ot.Cobyla()  # its default, with enough calls for four lengths
                solver.setMaximumCallsNumber(1000)
                solver.setCheckStatus(False)  # its best place so far, where the calls are over
                fitter.setOptimizationAlgorithm(solver)
                fitter.run()
                regression = ot.GaussianProcessRegression(fitter.getResult())
                regression.run()
                function = regression.getResult().getMetaModel()
                return lambda Q: np.asarray(function(ot.Sample(Q)))[:, 0]

            return FieldModel(_through_modes(of_mode, Y), name)

        yield kriging
    for degree in (2, 3, 4, 5):

        def chaos(X: np.ndarray, Y: np.ndarray, degree: int = degree) -> FieldModel:
            uniform = ot.JointDistribution([ot.Uniform(-1.0, 1.0)] * n)
            family = ot.OrthogonalProductPolynomialFactory(
                [ot.LegendreFactory()] * n, ot.HyperbolicAnisotropicEnumerateFunction(n, 0.7)
            )
            size = family.getEnumerateFunction().getBasisSizeFromTotalDegree(degree)
            sparse = ot.LeastSquaresMetaModelSelectionFactory(ot.LARS(), ot.CorrectedLeaveOneOut())

            def of_mode(y: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
                algorithm = ot.FunctionalChaosAlgorithm(
                    *(ot.Sample(X), ot.Sample(y[:, None]), uniform),
                    ot.FixedStrategy(family, size),
                    ot.LeastSquaresStrategy(sparse),
                )
                algorithm.run()
                function = algorithm.getResult().getMetaModel()
                return lambda Q: np.asarray(function(ot.Sample(Q)))[:, 0]

            return FieldModel(_through_modes(of_mode, Y), f"sparse polynomial chaos, degree {degree}")

        yield chaos


def _through_modes(
    of_mode: Callable[[np.ndarray], Callable[[np.ndarray], np.ndarray]], Y: np.ndarray
) -> Callable[[np.ndarray], np.ndarray]:
    """Return the field whose coefficients of the leading modes are fitted one by one, each scaled to one."""
    mean = Y.mean(axis=0)
    U, s, V = np.linalg.svd(Y - mean, full_matrices=False)
    k = min(_MODES, int((s > 1e-8 * s[0]).sum()))
    size = np.sqrt(len(Y))
    models = [of_mode(size * U[:, i]) for i in range(k)]
    return lambda Q: mean + np.stack([model(Q) for model in models], axis=1) @ (V[:k] * s[:k, None] / size)


def best_of(
    choices: Callable[[np.ndarray, np.ndarray], Iterable[Fit]],
    X: np.ndarray,
    Y: np.ndarray,
    inputs: Sequence[Range],
) -> FieldModel:
    """Return the choice that misses least of every fifth solve, fitted to all, of inputs X (N, n) in SI units."""
    low, high = bounds(inputs)
    positive = low > 0.0

    def scaled(X: np.ndarray, *, logs: bool) -> np.ndarray:
        taken = [np.log(a) if logs and one else a for a, one in zip(X.T, positive, strict=True)]
        ends = [
            (np.log(a), np.log(b)) if logs and one else (a, b)
            for a, b, one in zip(low, high, positive, strict=True)
        ]
        return np.stack([(2.0 * x - a - b) / (b - a) for x, (a, b) in zip(taken, ends, strict=True)], axis=1)

    held = np.arange(len(X)) % 5 == 2
    best: tuple[float, Fit, bool] | None = None
    for logs in (False, True) if positive.any() else (False,):
        Z = scaled(X, logs=logs)
        for fit in choices(Z, Y):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of optimisers at the ends of their ranges
                try:
                    missed = fit(Z[~held], Y[~held]).predict(Z[held]) - Y[held]
                except (
                    ArithmeticError,
                    RuntimeError,
                    ValueError,
                ):  # a setting that these solves do not decide
                    continue
            error = float(np.sqrt((missed**2).mean()))
            if best is None or error < best[0]:
                best = error, fit, logs
    assert best is not None
    _, fit, logs = best
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = fit(scaled(X, logs=logs), Y)
    settings = f"{model.settings}, {'logarithms of inputs' if logs else 'inputs as they are'}"
    return FieldModel(lambda Q: model.predict(scaled(Q, logs=logs)), settings)


_KNOWN = {"EZyRB": (_ezyrb, "ezyrb"), "SMT": (_smt, "smt"), "OpenTURNS": (_openturns, "openturns")}
MISSING = tuple(name for name, (_, package) in _KNOWN.items() if importlib.util.find_spec(package) is None)
"""Rivals whose packages are not installed."""
RIVALS = {name: choices for name, (choices, _) in _KNOWN.items() if name not in MISSING}
"""Choices of every rival that is installed, by the name in the tables."""
