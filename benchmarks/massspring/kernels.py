"""Energy, gradient and Hessian times a vector of springs and volumes.

Loops over springs and tetrahedra, compiled; results are added to `out` (node, 3), which the caller clears. One
thread, fixed order: the same bits on every run.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

__all__ = ["diagonal_blocks", "springs_apply", "springs_gradient", "volumes_apply", "volumes_gradient"]

_jit = njit(cache=True, nogil=True, error_model="numpy")


@_jit
def springs_gradient(
    x: np.ndarray, edges: np.ndarray, lengths: np.ndarray, k: np.ndarray, out: np.ndarray
) -> float:
    """Energy Σ ½ k (L − L₀)² in J; adds its gradient in N to `out`."""
    energy = 0.0
    for s in range(len(edges)):
        a, b = edges[s, 0], edges[s, 1]
        dx, dy, dz = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        stretch = length - lengths[s]
        energy += 0.5 * k[s] * stretch * stretch
        pull = k[s] * stretch / length if length > 0.0 else 0.0
        out[b, 0] += pull * dx
        out[b, 1] += pull * dy
        out[b, 2] += pull * dz
        out[a, 0] -= pull * dx
        out[a, 1] -= pull * dy
        out[a, 2] -= pull * dz
    return energy


@_jit
def springs_apply(
    x: np.ndarray, d: np.ndarray, edges: np.ndarray, lengths: np.ndarray, k: np.ndarray, out: np.ndarray
) -> None:
    """Add the springs' Hessian times `d` to `out`: k [n nᵀ + (1 − L₀/L)(I − n nᵀ)] on each difference."""
    for s in range(len(edges)):
        a, b = edges[s, 0], edges[s, 1]
        rx, ry, rz = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        vx, vy, vz = d[b, 0] - d[a, 0], d[b, 1] - d[a, 1], d[b, 2] - d[a, 2]
        square = rx * rx + ry * ry + rz * rz
        if square == 0.0:
            continue
        across = k[s] * (1.0 - lengths[s] / math.sqrt(square))
        along = (k[s] - across) * (rx * vx + ry * vy + rz * vz) / square
        fx, fy, fz = along * rx + across * vx, along * ry + across * vy, along * rz + across * vz
        out[b, 0] += fx
        out[b, 1] += fy
        out[b, 2] += fz
        out[a, 0] -= fx
        out[a, 1] -= fy
        out[a, 2] -= fz


@_jit
def _cross(a: np.ndarray, b: np.ndarray, out: np.ndarray) -> None:
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@_jit
def _edges_of(x: np.ndarray, tetrahedron: np.ndarray, e: np.ndarray) -> None:
    for i in range(3):
        for j in range(3):
            e[i, j] = x[tetrahedron[i + 1], j] - x[tetrahedron[0], j]


@_jit
def volumes_gradient(
    x: np.ndarray, tets: np.ndarray, rest: np.ndarray, bulk: np.ndarray, out: np.ndarray
) -> float:
    """Energy Σ ½ κ V₀ (V/V₀ − 1)² in J; adds its gradient in N to `out`."""
    energy = 0.0
    e, g = np.empty((3, 3)), np.empty((3, 3))
    for t in range(len(tets)):
        if bulk[t] == 0.0:
            continue
        _edges_of(x, tets[t], e)
        for i in range(3):
            _cross(e[(i + 1) % 3], e[(i + 2) % 3], g[i])  # 6 ∂V/∂x of corner i + 1
        six = e[0, 0] * g[0, 0] + e[0, 1] * g[0, 1] + e[0, 2] * g[0, 2]
        strain = six / (6.0 * rest[t]) - 1.0
        energy += 0.5 * bulk[t] * rest[t] * strain * strain
        scale = bulk[t] * strain / 6.0
        for i in range(3):
            for j in range(3):
                out[tets[t, i + 1], j] += scale * g[i, j]
                out[tets[t, 0], j] -= scale * g[i, j]
    return energy


@_jit
def volumes_apply(
    x: np.ndarray, d: np.ndarray, tets: np.ndarray, rest: np.ndarray, bulk: np.ndarray, out: np.ndarray
) -> None:
    """Add the volumes' Hessian times `d` to `out`: κ/V₀ ∇V (∇V·d) + κ (V/V₀ − 1) (∇²V) d."""
    e, g, v = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    first, second = np.empty(3), np.empty(3)
    for t in range(len(tets)):
        if bulk[t] == 0.0:
            continue
        _edges_of(x, tets[t], e)
        _edges_of(d, tets[t], v)
        rate = 0.0
        for i in range(3):
            _cross(e[(i + 1) % 3], e[(i + 2) % 3], g[i])
            rate += v[i, 0] * g[i, 0] + v[i, 1] * g[i, 1] + v[i, 2] * g[i, 2]
        six = e[0, 0] * g[0, 0] + e[0, 1] * g[0, 1] + e[0, 2] * g[0, 2]
        turning = bulk[t] * (six / (6.0 * rest[t]) - 1.0) / 6.0
        growing = bulk[t] * rate / (36.0 * rest[t])
        for i in range(3):
            _cross(v[(i + 1) % 3], e[(i + 2) % 3], first)
            _cross(e[(i + 1) % 3], v[(i + 2) % 3], second)
            for j in range(3):
                f = growing * g[i, j] + turning * (first[j] + second[j])
                out[tets[t, i + 1], j] += f
                out[tets[t, 0], j] -= f


@_jit
def diagonal_blocks(
    x: np.ndarray,
    edges: np.ndarray,
    k: np.ndarray,
    tets: np.ndarray,
    rest: np.ndarray,
    bulk: np.ndarray,
    out: np.ndarray,
) -> None:
    """Add to `out` (node, 3, 3) k n nᵀ of each spring and κ g gᵀ/V₀ of each volume with its gradient g."""
    for s in range(len(edges)):
        a, b = edges[s, 0], edges[s, 1]
        r = x[b] - x[a]
        square = (r * r).sum()
        if square == 0.0:
            continue
        for i in range(3):
            for j in range(3):
                share = k[s] * r[i] * r[j] / square
                out[a, i, j] += share
                out[b, i, j] += share
    e, g = np.empty((3, 3)), np.empty((4, 3))
    for t in range(len(tets)):
        if bulk[t] == 0.0:
            continue
        _edges_of(x, tets[t], e)
        for i in range(3):
            _cross(e[(i + 1) % 3], e[(i + 2) % 3], g[i + 1])
        for j in range(3):
            g[0, j] = -(g[1, j] + g[2, j] + g[3, j])
        scale = bulk[t] / (36.0 * rest[t])
        for corner in range(4):
            for i in range(3):
                for j in range(3):
                    out[tets[t, corner], i, j] += scale * g[corner, i] * g[corner, j]
