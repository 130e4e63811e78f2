"""An elastic answer with known formulas that the tests of relaxation share."""

from __future__ import annotations

import numpy as np

from palpate.surrogates.memories import Patches, Relaxation

TERMS = ((0.3, 0.1), (0.2, 2.0))
RADIUS = 0.01
TOUCH = np.array([0.0, 0.0, RADIUS])
STIFFNESS = 4e3  # of the Hertzian law U = k s^{5/2}


def elastic(position):
    """U in J and ∇U in N of a flat body below z = 0 whose stiffness changes along x."""
    depth = max(RADIUS - position[2], 0.0)
    rise = 1 + 5.0 * position[0]
    energy = STIFFNESS * rise * depth**2.5
    slope = np.array([5.0 * STIFFNESS * depth**2.5, 0.0, -2.5 * STIFFNESS * rise * depth**1.5])
    return energy, slope


def along(drive):
    """U (N,) and ∇U (N, 3) along a drive."""
    pairs = [elastic(position) for position in drive.positions]
    return np.array([u for u, _ in pairs]), np.array([g for _, g in pairs])


def bed(spacing=0.003):
    """Patches on a square of 60 mm, as wide as a contact of 4 mm asks for."""
    corners = 0.03 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    energy = elastic(touching(0, 0, -0.004))[0]
    return Patches.over(corners, triangles, spacing, width=Patches.width_at(RADIUS, 0.004), energy=energy)


KINDS = ("scalar", "patches", "scalar behind a pad", "patches behind a pad")


def remembering(kind):
    """A memory with or without patches, behind a pad or not."""
    pad, patches = 2e-4 if "pad" in kind else 0.0, bed() if "patches" in kind else None
    return Relaxation(TERMS, pad, patches).start()


def touching(x, y, z):
    """A place at an offset in m from that of first touch."""
    return TOUCH + np.array([x, y, z])
