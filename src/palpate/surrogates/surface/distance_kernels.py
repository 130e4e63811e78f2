"""Compiled evaluation of a touched surface's distance: value, gradient and Hessian, nothing allocated.

**A curved surface** keeps a cubic spline on a regular grid,

    d(c) = Σ C_ijk B(u − i) B(v − j) B(w − k),   (u, v, w) = (c − origin) / h

B is the cubic B-spline, so d has two continuous derivatives. The box reaches from node 1 to the last but one of each
axis; beyond it the spline goes on straight, axis by axis. Where coefficients are straight across the outermost three
nodes that too has two continuous derivatives.

**A flat surface** keeps two splines of two variables instead: the distance a from its outline at places of its plane,
negative within, and the profile d(a, z) at a height z over the plane. The grid's steps are the same in all three.

After their own arguments all kernels take what `TouchedSurface.compiled` makes:

    frame         (4,): origin (m) and spacing h (m); of a flat surface (15,), with the rows of the rotation into its
                  plane's axes and the first nodes of a and z (m) after them
    coefficients  (i, j, k): in m, four or more along each axis; of a flat surface those of a, (i, j, 1)
    profile       (m, n): those of d(a, z) in m, of a flat surface; empty for a curved one
"""

from __future__ import annotations

import math

import numpy as np

from palpate.kernels import kernel, part

__all__ = ["distance_into", "distances_into"]

FAR = 1e6  # cells beyond the box, after which nothing changes: sums stay exact to 1e-10

# fastmath stays off: the same bits on every machine
_Four = tuple[float, float, float, float]
_Six = tuple[float, float, float, float, float, float]


@part
def _weights(u: float, nodes: int) -> tuple[int, _Four, _Four, _Four]:
    """Return the first node of four, their weights, and the weights' first and second derivatives by u."""
    t = min(max(u, 1.0), nodes - 2.0)
    i = min(int(t), nodes - 3)
    t -= i
    s = 1.0 - t
    b = (s * s * s / 6, 2 / 3 - t * t * (1 - t / 2), 2 / 3 - s * s * (1 - s / 2), t * t * t / 6)
    p = (-s * s / 2, -t * (2 - 1.5 * t), s * (2 - 1.5 * s), t * t / 2)
    beyond = u - i - t
    if beyond == 0.0:
        return i - 1, b, p, (s, 1 - 3 * s, 1 - 3 * t, t)
    beyond = min(max(beyond, -FAR), FAR)
    b = (b[0] + beyond * p[0], b[1] + beyond * p[1], b[2] + beyond * p[2], b[3] + beyond * p[3])
    return i - 1, b, p, (0.0, 0.0, 0.0, 0.0)


@part
def _of_two(u: float, v: float, table: np.ndarray) -> _Six:
    """Return the spline of two variables, its first derivatives and its second ones (uu, vv, uv), in cells."""
    i, bu, pu, qu = _weights(u, table.shape[0])
    j, bv, pv, qv = _weights(v, table.shape[1])
    f = fu = fv = fuu = fvv = fuv = 0.0
    for a in range(4):
        c0, c1, c2, c3 = table[i + a, j], table[i + a, j + 1], table[i + a, j + 2], table[i + a, j + 3]
        g = bv[0] * c0 + bv[1] * c1 + bv[2] * c2 + bv[3] * c3
        gv = pv[0] * c0 + pv[1] * c1 + pv[2] * c2 + pv[3] * c3
        f += bu[a] * g
        fu += pu[a] * g
        fuu += qu[a] * g
        fv += bu[a] * gv
        fuv += pu[a] * gv
        fvv += bu[a] * (qv[0] * c0 + qv[1] * c1 + qv[2] * c2 + qv[3] * c3)
    return f, fu, fv, fuu, fvv, fuv


@part
def _flat_distance_into(
    c: np.ndarray,
    gradient: np.ndarray,
    hessian: np.ndarray,
    frame: np.ndarray,
    outline: np.ndarray,
    profile: np.ndarray,
) -> float:
    """Return the distance to a flat surface in m; its derivatives are the chain rule's, as in `distance_into`."""
    h = frame[3]
    u, v, w = (c[0] - frame[0]) / h, (c[1] - frame[1]) / h, (c[2] - frame[2]) / h
    if not math.isfinite(u + v + w):
        return np.inf
    x = frame[4] * u + frame[5] * v + frame[6] * w
    y = frame[7] * u + frame[8] * v + frame[9] * w
    z = frame[10] * u + frame[11] * v + frame[12] * w
    a, ax, ay, axx, ayy, axy = _of_two(x, y, outline[:, :, 0])
    d, da, dz, daa, dzz, daz = _of_two((a - frame[13]) / h, z - frame[14] / h, profile)
    ax, ay, axx, ayy, axy = ax / h, ay / h, axx / h, ayy / h, axy / h
    gx, gy = da * ax, da * ay
    xx, yy, xy = daa * ax * ax + da * axx, daa * ay * ay + da * ayy, daa * ax * ay + da * axy
    xz, yz = daz * ax, daz * ay
    for i in range(3):
        ex, ey, ez = frame[4 + i], frame[7 + i], frame[10 + i]
        gradient[i] = (gx * ex + gy * ey + dz * ez) / h
        px, py, pz = xx * ex + xy * ey + xz * ez, xy * ex + yy * ey + yz * ez, xz * ex + yz * ey + dzz * ez
        for j in range(i, 3):
            hessian[i, j] = (px * frame[4 + j] + py * frame[7 + j] + pz * frame[10 + j]) / (h * h)
            hessian[j, i] = hessian[i, j]
    return d  # type: ignore[no-any-return]


@part
def distance_into(
    c: np.ndarray,
    gradient: np.ndarray,
    hessian: np.ndarray,
    frame: np.ndarray,
    coefficients: np.ndarray,
    profile: np.ndarray,
) -> float:
    """Signed distance in m; a position that is not finite is infinitely far from the surface.

    Parameters
    ----------
    c : (3,)
        The position, m.
    gradient, hessian : (3,), (3, 3)
        Filled with ∇d and with ∇²d in 1/m.
    frame, coefficients, profile : arrays
        The surface, from `TouchedSurface.compiled`.
    """
    gradient[:] = 0.0
    hessian[:] = 0.0
    if profile.size:
        return _flat_distance_into(c, gradient, hessian, frame, coefficients, profile)  # type: ignore[no-any-return]
    h = frame[3]
    u, v, w = (c[0] - frame[0]) / h, (c[1] - frame[1]) / h, (c[2] - frame[2]) / h
    if not math.isfinite(u + v + w):
        return np.inf
    i, bx, px, qx = _weights(u, coefficients.shape[0])
    j, by, py, qy = _weights(v, coefficients.shape[1])
    k, bz, pz, qz = _weights(w, coefficients.shape[2])
    d = dx = dy = dz = dxx = dyy = dzz = dxy = dxz = dyz = 0.0
    for a in range(4):
        f = fy = fz = fyy = fzz = fyz = 0.0
        for b in range(4):
            c0 = coefficients[i + a, j + b, k]
            c1 = coefficients[i + a, j + b, k + 1]
            c2 = coefficients[i + a, j + b, k + 2]
            c3 = coefficients[i + a, j + b, k + 3]
            g = bz[0] * c0 + bz[1] * c1 + bz[2] * c2 + bz[3] * c3
            gz = pz[0] * c0 + pz[1] * c1 + pz[2] * c2 + pz[3] * c3
            gzz = qz[0] * c0 + qz[1] * c1 + qz[2] * c2 + qz[3] * c3
            f += by[b] * g
            fy += py[b] * g
            fyy += qy[b] * g
            fz += by[b] * gz
            fyz += py[b] * gz
            fzz += by[b] * gzz
        d += bx[a] * f
        dx += px[a] * f
        dxx += qx[a] * f
        dy += bx[a] * fy
        dxy += px[a] * fy
        dz += bx[a] * fz
        dxz += px[a] * fz
        dyy += bx[a] * fyy
        dyz += bx[a] * fyz
        dzz += bx[a] * fzz
    gradient[0], gradient[1], gradient[2] = dx / h, dy / h, dz / h
    square = h * h
    hessian[0, 0], hessian[1, 1], hessian[2, 2] = dxx / square, dyy / square, dzz / square
    hessian[0, 1] = hessian[1, 0] = dxy / square
    hessian[0, 2] = hessian[2, 0] = dxz / square
    hessian[1, 2] = hessian[2, 1] = dyz / square
    return d


@kernel
def distances_into(
    places: np.ndarray,
    distances: np.ndarray,
    gradients: np.ndarray,
    hessians: np.ndarray,
    frame: np.ndarray,
    coefficients: np.ndarray,
    profile: np.ndarray,
) -> None:
    """Fill signed distances and their derivatives at many positions."""
    for n in range(places.shape[0]):
        distances[n] = distance_into(places[n], gradients[n], hessians[n], frame, coefficients, profile)
