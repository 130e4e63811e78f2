r"""The doubt of the answers of one part: how sure they are, as one network that every export can run.

The part's networks give numbers y_k with variances v_k = c_k (1 + φ̃ᵀ M φ̃), φ̃ = [1, ξ, φ]; with M = G S Gᵀ, S being
signs, the form is a sum of squares of outputs g = Gᵀ φ̃ of a network with the same units. So are the members'
differences d from their mean, and the shares a of single samples (`palpate.network.influence`):

    v_k ← max(v_k, mean of d_k² over members)        var of an output = Σ_k R_k² v_k + τ²

Answers are trusted where the squares of d_k and of Σ a² missed_k² stay within nine times c_k (1 + φ̃ᵀ M φ̃).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.network import Network, Scaling
from palpate.network.uncertainty import Uncertainty
from palpate.surrogates import LearntQuantities
from palpate.units import Quantity

__all__ = ["ASTRAY", "Doubt", "doubt_of"]

ASTRAY = 9.0
"""Variances that members, and answers without a sample, may be apart where they are trusted."""
_CLOSE = 0.05  # of the border of trust
_NOTHING = 1e-15  # of the largest eigenvalue: rounding


@dataclass(frozen=True, eq=False)
class Doubt:
    """The network of one part, and what its outputs mean.

    Its latent outputs are the forms g of positive and of negative sign, shares of samples, and members' differences.
    """

    network: Network
    plus: int  # outputs g whose squares are added
    minus: int  # outputs g whose squares are taken off, after these
    samples: int  # shares of samples
    members: int  # members, each with m differences in SI units
    variance: np.ndarray  # (m,), c
    missed: np.ndarray  # (m, samples), squares in SI units
    squares: np.ndarray  # (rows, m), R² of the outputs that are of this part
    floor: np.ndarray  # (rows,), τ² of these

    def parts(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return variances v (N, m) before members count, and the squares (N, 2, m) that decide trust, at X (N, n)."""
        g = self.network.predict(X) ** 2
        forms, shares, apart = np.split(g, np.cumsum([self.plus + self.minus, self.samples]), axis=1)
        form = forms[:, : self.plus].sum(axis=1) - forms[:, self.plus :].sum(axis=1)
        own = np.maximum(1.0 + form, 0.0)[:, None] * self.variance
        m = len(self.variance)
        apart = apart[:, : self.members * m]  # a network has one row at least
        differences = apart.reshape(len(X), self.members, m).sum(axis=1) / max(self.members, 1)
        return own, np.stack([differences, shares @ self.missed.T], axis=1)

    def agrees(self, X: np.ndarray) -> np.ndarray:
        """Return where (N,) members, and answers without single samples, agree."""
        own, apart = self.parts(X)
        return np.asarray((apart <= ASTRAY * own[:, None]).all(axis=(1, 2)))

    def is_close(self, X: np.ndarray) -> np.ndarray:
        """Return where (N,) rounding may decide whether they agree: forms are small beside their terms."""
        own, apart = self.parts(X)
        border = ASTRAY * own[:, None]
        return np.asarray((np.abs(apart - border) <= _CLOSE * border).any(axis=(1, 2)))

    def deviation(self, X: np.ndarray) -> np.ndarray:
        """Return the standard deviations (N, rows) of the outputs."""
        own, apart = self.parts(X)
        return np.asarray(np.sqrt(np.maximum(own, apart[:, 0]) @ self.squares.T + self.floor))


def doubt_of(
    part: LearntQuantities, matrices: Sequence[np.ndarray], floors: Sequence[np.ndarray], widening: float
) -> Doubt | None:
    """Return the doubt of a part whose outputs are `matrices` (rows, m) of its numbers; None where it has none.

    `floors` (rows,) are variances that come on top, and `widening` multiplies all deviations. Units that are uncertain
    themselves, and members of another radial function, can't be told so.
    """
    sure, net = part.uncertainty, part.network
    if sure is None or sure.root.size or np.isnan(widening) or not _same_units(sure.network, net):
        return None
    if any(member.radial != net.radial for member in part.members):
        return None
    forms, plus = _forms(sure, len(net.inputs), net.units)
    m, influence = len(net.outputs), part.influence
    shares = np.zeros((0, forms.shape[1])) if influence is None else influence.coefficients.T
    missed = np.zeros((m, 0))
    if influence is not None:
        missed = (influence.missed.T * net.scaling.output_scale[:, None]) ** 2
    scale = np.broadcast_to(sure.factor, (m,)) * net.scaling.output_scale
    return Doubt(
        _network(part, np.vstack([forms, shares])),
        plus,
        len(forms) - plus,
        len(shares),
        len(part.members),
        sure.noise * scale**2,
        missed,
        (widening * np.vstack(matrices)) ** 2,
        widening**2 * np.concatenate(floors),
    )


def _forms(sure: Uncertainty, n: int, h: int) -> tuple[np.ndarray, int]:
    """Return the rows (q, 1 + n + h) of Gᵀ, those of positive sign first, and how many of these there are."""
    values, vectors = np.linalg.eigh(sure.coefficients)
    order = np.argsort(-values)
    values, vectors = values[order], vectors[:, order]
    kept = np.abs(values) > _NOTHING * np.abs(values).max(initial=0.0)
    G = (vectors * np.sqrt(np.abs(values)))[:, kept].T
    forms, width = np.zeros((len(G), 1 + n + h)), G.shape[1] - h if G.size else 0
    if G.size:
        forms[:, :width], forms[:, 1 + n :] = G[:, :width], G[:, width:]
    return forms, int((values[kept] > 0.0).sum())


def _network(part: LearntQuantities, rows: np.ndarray) -> Network:
    """Return the network of rows (q, 1 + n + h), and of the members' differences from their mean after these."""
    net, n, m, first = part.network, len(part.network.inputs), len(part.network.outputs), len(rows)
    rows = np.vstack([rows, *(-_rows_of(net) for _ in part.members)])
    for i, member in enumerate(part.members):
        some, own = slice(first + i * m, first + (i + 1) * m), _rows_of(member)
        rows[some, : 1 + n] += own[:, : 1 + n]
        more = np.zeros((len(rows), member.units))
        more[some] = own[:, 1 + n :]
        rows = np.hstack([rows, more])
    factors, shifts = _stack_units([net, *part.members])
    rows = rows if len(rows) else np.zeros((1, 1 + n + len(factors)))
    zero, one, outer = np.zeros(len(rows)), np.ones(len(rows)), net.scaling
    return Network(
        net.inputs,
        tuple(Quantity(f"g{i}") for i in range(len(rows))),
        factors,
        shifts,
        rows[:, 1 + n :],
        rows[:, : 1 + n],
        Scaling(outer.input_centre, outer.input_half, zero, one, outer.input_bend),
        radial=net.radial,
    )


def _rows_of(network: Network) -> np.ndarray:
    """Return constants, slopes and weights (m, 1 + n + h) of a network's outputs, in SI units."""
    rows = np.hstack([network.tail, network.weights])
    rows = rows if network.basis is None else network.basis @ rows
    rows = rows * network.scaling.output_scale[:, None]
    rows[:, 0] += network.scaling.output_centre
    return np.asarray(rows)


def _same_units(one: Network, other: Network) -> bool:
    return (
        one.radial == other.radial
        and np.array_equal(one.factors, other.factors)
        and np.array_equal(one.shifts, other.shifts)
    )


def _stack_units(networks: Sequence[Network]) -> tuple[np.ndarray, np.ndarray]:
    """Return factors (h, r, n) and shifts (h, r) of several networks, one after the other."""
    r = max(net.factors.shape[1] for net in networks)
    gaps = [(net, (0, r - net.factors.shape[1])) for net in networks]
    return (
        np.concatenate([np.pad(net.factors, [(0, 0), gap, (0, 0)]) for net, gap in gaps]),
        np.concatenate([np.pad(net.shifts, [(0, 0), gap]) for net, gap in gaps]),
    )
