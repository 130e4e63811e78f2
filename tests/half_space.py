"""A ball pressed into an elastic half-space whose surface has grooves: an independent solver, by boundary elements.

Displacement and pressure are those of Boussinesq on a square grid, each square's by Love (1929); the contact without
friction is found by conjugate gradients under p ≥ 0 (Polonsky & Keer 1999). Slopes of the surface are taken as small.
"""

from __future__ import annotations

import numpy as np

from palpate.surrogates import Solves
from palpate.units import Range

R = 5e-3  # m
MODULUS = 1e4  # E*, Pa
SIDE, STEP = 48, 2.2e-4  # squares along the grid, and their size in m
BOX = [Range("c_x", -4e-3, 4e-3, "m"), Range("c_y", -4e-3, 4e-3, "m"), Range("c_z", R - 2e-3, R, "m")]


def height(x, y, depth=8e-4):
    """Grooves along winding lines 5 mm apart, 1.2 mm wide (m)."""
    beside = (x + 1e-3 * np.sin(y / 2e-3) + 1e-3) % 5e-3 - 2.5e-3
    return -depth * np.exp(-((beside / 6e-4) ** 2))


def mesh(depth=8e-4, half=12e-3, step=3e-4):
    """Points (P, 3) and triangles of the surface."""
    x = np.arange(-half, half + step / 2, step)
    points = np.stack([*np.meshgrid(x, x, indexing="ij"), np.zeros((len(x), len(x)))], -1).reshape(-1, 3)
    points[:, 2] = height(points[:, 0], points[:, 1], depth)
    first = (len(x) * np.arange(len(x) - 1)[:, None] + np.arange(len(x) - 1)).ravel()
    below = first + len(x)
    return points, np.vstack(
        [np.column_stack([first, below, below + 1]), np.column_stack([first, below + 1, first + 1])]
    )


def _compliance():
    """Transformed displacement (m) of unit pressure on a square, on twice the grid."""
    k = np.fft.fftfreq(2 * SIDE, 1 / (2 * SIDE)) * STEP
    X, Y = np.meshgrid(k, k, indexing="ij")
    a, b, c, d = X + STEP / 2, X - STEP / 2, Y + STEP / 2, Y - STEP / 2

    def part(s, t, u):
        return s * np.log((t + np.hypot(s, t)) / (u + np.hypot(s, u)))

    return np.fft.rfft2((part(a, c, d) + part(c, a, b) + part(b, d, c) + part(d, b, a)) / (np.pi * MODULUS))


COMPLIANCE = _compliance()


def _displaced(p):
    return np.fft.irfft2(np.fft.rfft2(p, (2 * SIDE, 2 * SIDE)) * COMPLIANCE)[:SIDE, :SIDE]


def press(c, depth=8e-4):
    """Return the energy (J) and the force (3,) in N on the ball at a centre c (m)."""
    k = (np.arange(SIDE) - (SIDE - 1) / 2) * STEP
    x, y = np.meshgrid(k, k, indexing="ij")
    under = np.sqrt(np.maximum(R * R - x * x - y * y, 1e-12))
    overlap = height(c[0] + x, c[1] + y, depth) - (c[2] - under)
    overlap[np.hypot(x, y) > 0.98 * R] = -R
    p, way, before = np.where(overlap > 0, MODULUS * overlap / R, 0.0), np.zeros_like(overlap), 1.0
    for _ in range(300):
        gap = _displaced(p) - overlap
        free = p > 0
        square = float((gap[free] ** 2).sum())
        way = np.where(free, gap + square / before * way, 0.0)
        moved = _displaced(way)
        step = float((gap * way)[free].sum() / max((moved * way)[free].sum(), 1e-300))
        new = np.maximum(p - step * way, 0.0)
        lacking = (new == 0) & (gap < 0)
        new[lacking] -= step * gap[lacking]
        before = square if not lacking.any() else np.inf
        done = np.abs(new - p).max() <= 1e-7 * new.max()
        p = new
        if done:
            break
    else:
        raise AssertionError(f"no contact found at {c}")
    area, toward = STEP * STEP, np.stack([x / under, y / under, -np.ones_like(x)])
    return 0.5 * area * float((p * overlap).sum()), -area * (p * toward).sum(axis=(1, 2))


def solves(count, seed, depth=8e-4, shallowest=2e-4):
    """Return solves at random places and depths of `BOX`, those deeper than `shallowest` over the plane."""
    low, high = np.array([[r.low, r.high] for r in BOX]).T
    X = np.random.default_rng(seed).uniform(low, high - [0, 0, shallowest], (count, 3))
    pairs = [press(x, depth) for x in X]
    return Solves(X, np.array([u for u, _ in pairs]), np.array([f for _, f in pairs]), None, tuple(BOX))
