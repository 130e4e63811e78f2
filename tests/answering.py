"""A heated rod as a surrogate that no hand feels, and its solves: temperatures in closed form, no solver and no search.

A rod of length L = 0.1 m, held at 0 at both ends, heated evenly by q with the conductivity k, settles to

    T(x) = q x (L − x) / (2 k)        largest q L² / (8 k)        at time t the share 1 − exp(−t / τ) of it

`answering` is a surrogate whose field is exact in ln q and k (affine coefficients of made-up modes), for whoever needs
one at once; `rod_solves` is a dataset to learn from.
"""

from __future__ import annotations

import numpy as np

from models import linear_network
from palpate.dataset import Dataset, Layout
from palpate.dataset.assemble import assemble
from palpate.dataset.schema import Field
from palpate.network import TrainedRegion
from palpate.surrogates import AxisPlaces, LearntQuantities, MeshPlaces, ModalField, Surrogate
from palpate.units import Quantity, Range

LENGTH, TAU = 0.1, 0.5  # m, s
RANGES = (Range("heat", 1e5, 5e5, "W/m³"), Range("conductivity", 10.0, 40.0, "W/(m K)"))
TIMES = np.linspace(0.0, 2.0, 9)


def plate_mesh(across: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (nodes, 2) in m and triangles of a square plate of the rod's length."""
    side = np.linspace(0.0, LENGTH, across)
    x, y = np.meshgrid(side, side)
    first = (np.arange(across - 1)[:, None] * across + np.arange(across - 1)).ravel()
    lower = np.stack([first, first + 1, first + across + 1], axis=1)
    upper = np.stack([first, first + across + 1, first + across], axis=1)
    return np.stack([x.ravel(), y.ravel()], axis=1), np.concatenate([lower, upper])


def answers(X: np.ndarray) -> dict[str, np.ndarray]:
    """The closed form at inputs X (N, 2): temperature at nodes, heat flux, temperature in cells, largest, its rise."""
    points, triangles = plate_mesh()
    middles = points[triangles].mean(axis=1)
    size = (X[:, 0] / (2.0 * X[:, 1]))[:, None]

    def temperature(x: np.ndarray) -> np.ndarray:
        return size * x * (LENGTH - x)

    flux = X[:, :1] * (points[:, 0] - LENGTH / 2.0)
    largest = size[:, 0] * LENGTH**2 / 4.0
    return {
        "temperature": temperature(points[:, 0]),
        "flux": np.stack([flux, np.zeros_like(flux)], axis=2),
        "in_cells": temperature(middles[:, 0]),
        "largest": largest,
        "rise": largest[:, None] * (1.0 - np.exp(-TIMES / TAU)),
    }


def rod_solves(count: int = 24, seed: int = 0, names: tuple[str, ...] = ()) -> Dataset:
    """Solves at random inputs, the corners of the ranges first; `names` chooses among the answers, by default all."""
    points, triangles = plate_mesh()
    low, high = np.array([[r.low, r.high] for r in RANGES]).T
    X = np.random.default_rng(seed).uniform(low, high, (count, 2))
    X[:4] = [(low[0], low[1]), (low[0], high[1]), (high[0], low[1]), (high[0], high[1])]
    n, cells = len(points), len(triangles)
    schema = {
        "temperature": Field("temperature", ("node",), (n,), "K"),
        "flux": Field("flux", ("node", "flux_component"), (n, 2), "W/m²"),
        "in_cells": Field("in_cells", ("cell",), (cells,), "K"),
        "largest": Field("largest", unit="K"),
        "rise": Field("rise", ("time",), (len(TIMES),), "K"),
    }
    chosen = names or tuple(schema)
    solved = {
        "converged": np.ones(count, dtype=bool),
        "iterations": np.ones(count, dtype=int),
        "residual": np.zeros(count),
        "message": np.full(count, "closed form", dtype=object),
        "solve_seconds": np.zeros(count),
    }
    layout = Layout(
        points,
        triangles=triangles,
        cells=(points[triangles].mean(axis=1), np.arange(cells)),
        scales={"time": (TIMES, "s")},
    )
    return assemble(
        RANGES,
        layout,
        X,
        {**solved, **{name: values for name, values in answers(X).items() if name in chosen}},
        {"words": "heated rod", "problem": {"body": {"type": "rod"}, "interactions": []}},
        schema=[schema[name] for name in chosen],
    )


def quantities(names: tuple[str, ...] = ("largest",), unit: str = "K") -> LearntQuantities:
    """Numbers that are affine in the scaled inputs: 1 + 2 ξ₁ + 3 ξ₂, the next by one more, and so on."""
    tail = np.array([[1.0 + i, 2.0, 3.0] for i in range(len(names))])
    network = linear_network(list(RANGES), [Quantity(name, unit) for name in names], tail)
    region = TrainedRegion.of(np.random.default_rng(1).uniform(-1.0, 1.0, (200, 2)))
    return LearntQuantities(network, region=region)


def answering(*, fields: bool = True) -> Surrogate:
    """A surrogate with a number, and with a field at nodes and a curve of two modes each."""
    if not fields:
        return Surrogate(meta={"name": "rod"}, quantities={"largest": quantities()})
    points, triangles = plate_mesh()
    mesh = MeshPlaces(np.hstack([points, np.zeros((len(points), 1))]), triangles)
    made = {}
    for name, places in (("temperature", mesh), ("rise", AxisPlaces("time", "s", TIMES))):
        s = np.linspace(0.0, 1.0, len(places))[:, None]
        modes = np.stack([np.sqrt(2.0) * np.sin(np.pi * s), np.sqrt(2.0) * np.sin(2.0 * np.pi * s)])
        coefficients = quantities(("a", "b"))
        made[name] = ModalField(name, "K", places, coefficients, 20.0 + s, modes, np.full_like(s, 0.01))
    return Surrogate(fields=made, meta={"name": "rod"}, quantities={"largest": quantities()})
