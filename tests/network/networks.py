"""Random networks of every form, radial function and output map, and the formula they stand for."""

from __future__ import annotations

import numpy as np

from palpate.network import Network, Scaling
from palpate.units import Quantity, Range

FORMS = ("isotropic", "axis-aligned", "rotated", "full", "rank 1", "rank 2")


def random_factors(form: str, h: int, n: int, rng: np.random.Generator) -> np.ndarray:
    if form.startswith("rank"):
        return rng.normal(size=(h, min(int(form[-1]), n), n)) / 2
    if form == "isotropic":
        return np.eye(n) * rng.uniform(0.5, 2, (h, 1, 1))
    if form == "axis-aligned":
        return np.eye(n) * rng.uniform(0.5, 2, (h, 1, n))
    full = np.eye(n) + 0.3 * rng.normal(size=(h, n, n))
    return np.tril(full) if form == "rotated" else full


def any_network(n, m, h, *, form="axis-aligned", radial="gaussian", modes=None, seed=0, **more) -> Network:
    rng = np.random.default_rng(seed)
    low = rng.normal(size=n)
    k = modes or m
    factors = random_factors(form, h, n, rng)
    return Network(
        inputs=tuple(Range(f"x{i}", float(a), float(a) + 3.0, "N") for i, a in enumerate(low)),
        outputs=tuple(Quantity(f"y{i}", "m") for i in range(m)),
        factors=factors,
        shifts=np.einsum("krn,kn->kr", factors, rng.uniform(-1, 1, (h, n))),
        weights=rng.normal(size=(k, h)),
        tail=rng.normal(size=(k, 1 + n)),
        scaling=Scaling(low + 1.5, np.full(n, 1.5), rng.normal(size=m), rng.uniform(0.5, 2, m)),
        radial=radial,
        basis=rng.normal(size=(m, k)) if modes else None,
        **more,
    )


def points(network: Network, count: int, seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    low, high = (np.array([getattr(r, end) for r in network.inputs]) for end in ("low", "high"))
    return rng.uniform(low, high, (count, len(low)))


def _g(name, q):
    if name == "gaussian":
        return np.exp(-q)
    if name == "inverse-multiquadric":
        return 1 / np.sqrt(1 + q)
    s = np.sqrt(5 * q)
    return (1 + s + s * s / 3) * np.exp(-s)


def formula(network: Network, X: np.ndarray) -> np.ndarray:
    """The formula of the docstring, in NumPy; takes complex inputs."""
    s = network.scaling
    xi = (X - s.input_centre) / (s.input_half + s.input_bend * (X - s.input_centre))
    v = np.einsum("krn,Nn->Nkr", network.factors, xi) - network.shifts
    phi = _g(network.radial, (v * v).sum(axis=2))
    latent = np.hstack([np.ones((len(X), 1)), xi]) @ network.tail.T + phi @ network.weights.T
    eta = latent if network.basis is None else latent @ network.basis.T
    return s.output_centre + s.output_scale * eta
