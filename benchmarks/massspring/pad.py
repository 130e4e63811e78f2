"""The sphere's pad, felt by the points of the touched surface.

A spring network has no surface between its points, so each point stands for a third of the area A of the triangles
around it. Energy Σ A φ(p) with φ(p) = ½ k p²/(1 − p/p_m) on the penetration p = R − |x − c|, the law of the finite
elements' sphere; p stays below 0.98 p_m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.physics.interactions.tool_contact import REACH, pressed_energy

__all__ = ["PointPad", "point_areas"]


def point_areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Area in m² that each point stands for, shape (node,), 0 away from the triangles (t, 3)."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    third = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6
    return np.bincount(triangles.ravel(), np.repeat(third, 3), minlength=len(points))


@dataclass(frozen=True, eq=False)
class PointPad:
    """A rigid sphere with a soft skin that presses points.

    Attributes
    ----------
    nodes : (m,) int array
        The points that can be touched.
    areas : (m,) array
        m².
    radius : float
        Of the sphere, m.
    stiffness : float
        k, N/m³.
    stop : float
        p_m, m; infinite for a pad without a stop.
    """

    nodes: np.ndarray
    areas: np.ndarray
    radius: float
    stiffness: float
    stop: float

    def penetration(self, x: np.ndarray, centre: np.ndarray) -> np.ndarray:
        """Depth p of each touchable point in the sphere in m, shape (m,); negative outside."""
        return np.asarray(self.radius - np.linalg.norm(x[self.nodes] - centre, axis=1))

    def energy(self, x: np.ndarray, centre: np.ndarray) -> float:
        """Energy in J; infinite past the stop."""
        p = np.maximum(self.penetration(x, centre), 0.0)
        if np.any(p > REACH * self.stop):
            return np.inf
        return float(np.sum(self.areas * pressed_energy(p, self.stiffness, self.stop)))

    def gradient(self, x: np.ndarray, centre: np.ndarray) -> np.ndarray:
        """Derivative of the energy by the touchable points in N, shape (m, 3); its sum is the force on the probe."""
        away, distance, p = self._apart(x, centre)
        first, _ = self._slopes(p)
        return np.asarray(-(self.areas * first / distance)[:, None] * away)

    def blocks(self, x: np.ndarray, centre: np.ndarray) -> np.ndarray:
        """Second derivative by each point, shape (m, 3, 3), N/m.

        With n from the centre to the point and r its distance: A [φ'' n nᵀ − φ'/r (I − n nᵀ)].
        """
        away, distance, p = self._apart(x, centre)
        first, second = self._slopes(p)
        n = away / distance[:, None]
        along = n[:, :, None] * n[:, None, :]
        turn = (first / distance)[:, None, None] * (np.eye(3) - along)
        return np.asarray(self.areas[:, None, None] * (second[:, None, None] * along - turn))

    def _apart(self, x: np.ndarray, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        away = x[self.nodes] - centre
        distance = np.linalg.norm(away, axis=1)
        return away, distance, self.radius - distance

    def _slopes(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """φ' and φ'' of the penetration, 0 outside."""
        touched = np.clip(p, 0.0, REACH * self.stop)
        room = 1 - touched / self.stop
        first = self.stiffness * touched * (1 - 0.5 * touched / self.stop) / room**2
        return first, np.where(p > 0, self.stiffness / room**3, 0.0)
