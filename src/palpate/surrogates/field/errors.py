"""How far a field is off at solves it has not seen: what its modes can't show, and what was not learnt of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["FieldErrors", "sizes_of"]

_SHOWN = {"m": (1e3, "mm"), "Pa": (1e-3, "kPa")}  # factor and unit in which people read


def sizes_of(errors: np.ndarray) -> np.ndarray:
    """Size (N, nodes) of errors (N, nodes, components) at each node."""
    return np.asarray(np.sqrt((errors**2).sum(axis=2)))


@dataclass(frozen=True, eq=False)
class FieldErrors:
    """Errors of N solves at each node, as sizes in the field's unit.

    Attributes
    ----------
    truncation : (N, nodes)
        Of the nearest field that the modes and the travelling part can show.
    learning : (N, nodes)
        Between that and the field that is answered.
    total : (N, nodes)
        Of the field that is answered.
    mass : (nodes,)
        Shares of the surface.
    unit : str
    """

    truncation: np.ndarray
    learning: np.ndarray
    total: np.ndarray
    mass: np.ndarray
    unit: str

    def rms(self, what: str = "total") -> np.ndarray:
        """Root mean square over the surface (N,); total² = truncation² + learning²."""
        return np.asarray(np.sqrt(getattr(self, what) ** 2 @ self.mass))

    def mean(self, what: str = "total") -> float:
        """Mean over nodes and solves."""
        return float(getattr(self, what).mean())

    def max(self, what: str = "total") -> float:
        """Largest over nodes and solves."""
        return float(getattr(self, what).max())

    def as_dict(self) -> dict[str, dict[str, float]]:
        """Mean and max of each, for a record."""
        names = ("truncation", "learning", "total")
        return {name: {"mean": self.mean(name), "max": self.max(name)} for name in names}

    def __str__(self) -> str:
        factor, unit = _SHOWN.get(self.unit, (1.0, self.unit))
        parts = [
            f"{name} {factor * figures['mean']:.3g} / {factor * figures['max']:.3g}"
            for name, figures in self.as_dict().items()
        ]
        return f"mean / max error over {len(self.total)} solves: {', '.join(parts)} {unit}".rstrip()

    __repr__ = __str__
