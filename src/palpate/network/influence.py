"""Where the answers hang on single samples: the jackknife of a kernel layer, by which kinks betray themselves.

With coefficients G Y the answer at x is Σ_p a_p(x) y_p, a = φ̃ᵀ G. Without sample p, whose value was missed by e_p, it
would change by about a_p e_p, and

    J_j(x)² = Σ_p (a_p(x) e_pj)²

is its variance by the jackknife (MacKinnon & White 1985, whose HC3 has these e). A Gaussian process has one smoothness
everywhere: its own variance sees the distance to the samples, and nothing of a kink that runs between them. J does,
since the samples beside a kink are missed by far more than the others.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from palpate.network.network import Network, Scaling
from palpate.units import Quantity

__all__ = ["Influence"]

_INFLUENCE, _MISSED = "left_out_influence", "left_out_missed"


@dataclass(frozen=True, eq=False)
class Influence:
    """The share of each sample in the answers of a network, and what was missed of it."""

    coefficients: np.ndarray  # (1 + n + h, P), G of the network's tail and units
    missed: np.ndarray  # (P, m), of each sample by networks that had not seen it, in scaled outputs

    def deviation(self, network: Network, X: np.ndarray) -> np.ndarray:
        """Return the jackknife's standard deviation (N, m) of a network's answers at X (N, n), in SI units."""
        tail = 1 + len(network.inputs)
        count, s = len(self.missed), network.scaling
        names = tuple(Quantity(f"sample {p}") for p in range(count))
        plain = Scaling(s.input_centre, s.input_half, np.zeros(count), np.ones(count), s.input_bend)
        G = self.coefficients.T
        shares = replace(
            *(network,),
            outputs=names,
            weights=G[:, tail:],
            tail=G[:, :tail],
            scaling=plain,
            basis=None,
            extras={},
        )
        return np.asarray(np.sqrt(shares.predict(X) ** 2 @ self.missed**2) * s.output_scale)

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the arrays of a network file that hold it."""
        return {_INFLUENCE: self.coefficients, _MISSED: self.missed}

    @classmethod
    def restored(cls, extras: Mapping[str, np.ndarray], network: Network) -> Influence | None:
        """Return what a network file holds of it, or None; a ValueError where that does not fit the network."""
        if _INFLUENCE not in extras:
            return None
        G, missed = extras[_INFLUENCE], extras[_MISSED]
        if G.shape != (1 + len(network.inputs) + network.units, len(missed)) or missed.shape[1:] != (
            len(network.outputs),
        ):
            raise ValueError("influence of samples on another network")
        return cls(G, missed)
