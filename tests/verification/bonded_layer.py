"""A rigid ball pressed without friction into an elastic layer on a rigid ground: the force, over Hertz's.

χ = √(Rδ)/h for a radius R, a depth δ and a thickness h. All hold for contacts much smaller than the ball.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.optimize import brentq

FARTHEST = 40.0  # wave number over 1/h at which the ground is no longer felt: exp(-2 · 40)


def hertz(young: float, poisson: float, radius: float, depth: float) -> float:
    """4/3 E/(1 - ν²) √R δ^(3/2) in N, the force on a half-space (Hertz 1881)."""
    return 4 / 3 * young / (1 - poisson**2) * math.sqrt(radius) * depth**1.5


def dimitriadis(poisson: float, chi: float) -> float:
    """A bonded layer in a series (Dimitriadis, Horkay, Maresca, Kachar & Chadwick 2002, Biophys. J. 82, 2798-2810)."""
    a = -(1.2876 - 1.4678 * poisson + 1.3442 * poisson**2) / (1 - poisson)
    b = (0.6387 - 1.0277 * poisson + 1.5164 * poisson**2) / (1 - poisson)
    pi = math.pi
    return (
        1
        - 2 * a / pi * chi
        + 4 * a**2 / pi**2 * chi**2
        - 8 / pi**3 * (a**3 + 4 * pi**2 / 15 * b) * chi**3
        + 16 * a / pi**4 * (a**3 + 3 * pi**2 / 5 * b) * chi**4
    )


def garcia(chi: float) -> float:
    """The series for an incompressible bonded layer (Garcia & Garcia 2018, Biophys. J. 114, 2923-2932)."""
    return 1 + 1.133 * chi + 1.497 * chi**2 + 1.469 * chi**3 + 0.755 * chi**4


def exact(poisson: float, chi: float, places: int = 24) -> float:
    """Linear elasticity without a series, by the integral equation of layers (Lebedev & Ufliand 1958; Hayes, Keer,
    Herrmann & Mockros 1972, J. Biomech. 5, 541-551).

    A pressure with the Hankel transform P(ξ) = ∫ φ(t) cos ξt dt over 0 … a is zero outside the contact's radius a and
    lifts the surface by (1 - m(ξh)) 2(1 - ν²)/(Eξ) P(ξ), where m is the ground's part. That the surface inside is a
    paraboloid asks for

        φ(t) - 2/π ∫ φ(s) ∫ m(ξh) cos ξs cos ξt dξ ds = E/(π(1 - ν²)) (δ - t²/R),

    φ(a) = 0 tells a, and the force is 2π ∫ φ dt. Here h = R = 1, and the force is taken over Hertz's.
    """
    depth = chi**2
    x, weights = leggauss(400)
    waves, weights = FARTHEST / 2 * (x + 1), FARTHEST / 2 * weights * ground(FARTHEST / 2 * (x + 1), poisson)
    y, shares = leggauss(places)

    def solved(a: float) -> tuple[float, float]:
        """φ(a), and the integral of φ."""
        inner, lengths = a / 2 * (y + 1), a / 2 * shares
        at = np.append(inner, a)
        waved = np.cos(np.outer(at, waves))
        kernel = 2 / math.pi * (waved * weights) @ waved[:-1].T * lengths
        wanted = depth - at**2
        phi = np.linalg.solve(np.eye(places) - kernel[:-1], wanted[:-1])
        return float(wanted[-1] + kernel[-1] @ phi), float(lengths @ phi)

    a = brentq(lambda a: solved(a)[0], 0.5 * chi, 2 * chi, xtol=1e-12)
    return solved(a)[1] / (2 / 3 * chi**3)


def ground(wave: np.ndarray, poisson: float) -> np.ndarray:
    """m = 1 - (2κ sinh 2x - 4x)/(2κ cosh 2x + 1 + κ² + 4x²) of a bonded layer at x = ξh, with κ = 3 - 4ν."""
    kappa, fading = 3 - 4 * poisson, np.exp(-2 * wave)
    above = kappa * (1 - fading**2) - 4 * wave * fading
    below = kappa * (1 + fading**2) + (1 + kappa**2 + 4 * wave**2) * fading
    return 1 - above / below
