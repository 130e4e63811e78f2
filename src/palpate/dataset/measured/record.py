"""Measured indentation as arrays in SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

__all__ = ["Measured"]

_AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class Measured:
    """N measurements on one specimen.

    Attributes
    ----------
    position : (N, 3)
        The probe's centre, m. Of a pressed depth: the place on the surface, see `depth`.
    force : (N, 3)
        On the probe, N. Of a pressed depth the force against it stands along −direction.
    along : (N, 3)
        Unit vector of the only component measured; zeros where all three were.
    depth : (N,)
        m from first touch, where depths were measured; not-a-number elsewhere.
    time : (N,)
        s; not-a-number where it is not known.
    """

    position: np.ndarray
    force: np.ndarray
    along: np.ndarray
    depth: np.ndarray
    time: np.ndarray

    def __len__(self) -> int:
        return len(self.force)

    @property
    def pressed(self) -> bool:
        """Whether positions are yet to be found from depths."""
        return bool(np.isfinite(self.depth).any())

    @classmethod
    def of(
        cls,
        rows: Sequence[Mapping[str, float]],
        *,
        place: Sequence[float] | None = None,
        direction: Sequence[float] = (0.0, 0.0, -1.0),
    ) -> Measured:
        """From rows of values by name (see `columns`), and where and along what depths were measured."""
        N, d = len(rows), np.array(direction, dtype=np.float64)
        d = d / np.linalg.norm(d)
        position, force, along = np.zeros((N, 3)), np.zeros((N, 3)), np.zeros((N, 3))
        depth, time = np.full(N, np.nan), np.full(N, np.nan)
        for i, row in enumerate(rows):
            time[i] = row.get("t", np.nan)
            position[i] = [row[a] for a in _AXES] if "x" in row else place
            if "depth" in row:
                depth[i], force[i], along[i] = row["depth"], -row["f"] * d, -d
                continue
            given = [a for a in range(3) if "f" + _AXES[a] in row]
            for a in given:
                force[i, a] = row["f" + _AXES[a]]
            if len(given) == 1:
                along[i, given[0]] = 1.0
        return cls(position, force, along, depth, time)
