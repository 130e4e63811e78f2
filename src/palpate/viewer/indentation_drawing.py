"""Indentations as they are drawn: how deep a ball would rest on the body without a force, at each point of its surface.

At a point x of the touched surface with the normal n the places' amplitudes meet as p = Σ w_j(x) p_j, as they do under
a probe (`palpate.surrogates.memories.indentation`), and the depth s of the indentation is where the elastic amplitude
√(2U) of a ball at x + (R − s) n is p: there the force vanishes. Around a ball at a depth d beyond that, the indentation
and the share 1 − s/d of the elastic shape are drawn, which together touch it.
"""

from __future__ import annotations

import numpy as np

from palpate.runtime.touchable import Touchable

__all__ = ["IndentationDrawing", "yielding_in_words"]

LEVELS = 33  # depths at which amplitudes are tabulated
BEYOND = 1.5  # last tabulated depth over the deepest trained one
AT_ONCE = 256  # points whose shares are worked out together


class _Depths:
    """Depths at which an elastic body has given amplitudes; its further inputs stand in the middle of their ranges."""

    def __init__(self, body: Touchable) -> None:
        self._energy, self._radius = body.energy, body.radius
        self._further = np.array([(r.low + r.high) / 2.0 for r in body.energy.parameters])
        # denser towards the surface, where the amplitude rises as a power of the depth
        self._levels = BEYOND * body.deepest * np.linspace(0.0, 1.0, LEVELS) ** 2

    def table(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Return √(2U) (m, LEVELS) above points (m, 3) with their normals (m, 3), rising with the depth."""
        out = self._radius - self._levels
        centres = (points[:, None] + out[:, None] * normals[:, None]).reshape(-1, 3)
        X = np.hstack([centres, np.tile(self._further, (len(centres), 1))])
        amplitude = np.sqrt(2.0 * np.maximum(self._energy.energy(X), 0.0)).reshape(-1, LEVELS)
        return np.asarray(np.maximum.accumulate(amplitude, axis=1))

    def at(self, amplitude: np.ndarray, table: np.ndarray) -> np.ndarray:
        """Return the depths (m,) at which rows of the table reach `amplitude` (m,); the last level where they don't."""
        row = np.arange(len(table))
        k = np.clip((table < amplitude[:, None]).sum(axis=1) - 1, 0, LEVELS - 2)
        low, high = table[row, k], table[row, k + 1]
        share = np.clip((amplitude - low) / np.maximum(high - low, 1e-300), 0.0, 1.0)
        depth = self._levels[k] + share * (self._levels[k + 1] - self._levels[k])
        return np.asarray(np.where(amplitude > 0.0, depth, 0.0))


class IndentationDrawing:
    """Indentations on the surface of a body whose memory keeps them at places.

    `points` (m, 3) are those of the touched surface at rest, m; `normals` (m, 3) the outward unit normals there.
    """

    def __init__(self, body: Touchable, points: np.ndarray) -> None:
        assert body.indentation is not None
        assert body.surface is not None
        self._memory, self._depths = body.indentation, _Depths(body)
        slope = body.surface.at(points)[1]
        self.normals = slope / np.linalg.norm(slope, axis=1, keepdims=True)
        parts = np.array_split(points, max(1, -(-len(points) // AT_ONCE)))
        self._shares = np.concatenate([self._memory.shares(part).astype(np.float32) for part in parts])
        self._table = self._depths.table(points, self.normals)
        self._latest, self._drawn = np.zeros(0), np.zeros(0)

    def depths(self, amplitude: np.ndarray) -> np.ndarray:
        """Return the depth (m,) at each point, m, for amplitudes (n,) at the places, √J; (0,) without any."""
        if not np.array_equal(amplitude, self._latest):
            self._latest = amplitude
            self._drawn = self._depths.at(self._shares @ amplitude.astype(np.float32), self._table)
        return self._drawn

    def under(self, contact: np.ndarray, normal: np.ndarray, amplitude: np.ndarray) -> float:
        """Return the depth at any one point (3,) with its normal (3,), m."""
        if not len(amplitude):
            return 0.0
        met = self._memory.shares(contact[None]) @ amplitude
        return float(self._depths.at(met, self._depths.table(contact[None], normal[None]))[0])

    def elastic(self, place: np.ndarray, amplitude: np.ndarray) -> float:
        """Return the share of the elastic shape that is drawn on top: none until the probe meets the bottom.

        `place` (8,) is a field's: depth in m, growth, contact point in m, normal.
        """
        kept = self.under(place[2:5], place[5:8], amplitude)
        return max(0.0, 1.0 - kept / max(float(place[0]), 1e-12))


def yielding_in_words(body: Touchable) -> str:
    """Return from which depth in its middle a body yields, in words; empty for one that doesn't."""
    if body.indentation is None:
        return ""
    depths, contact = _Depths(body), body.home - body.radius * body.normal
    first = depths.at(body.indentation.reach[:1], depths.table(contact[None], body.normal[None]))[0]
    return f"pressed deeper than {1e3 * first:.2g} mm it keeps an indentation"
