"""Meshes of surfaces whose distance is known."""

import numpy as np


def plate(size, cells, seed=None):
    """A square in z = 0 around the origin, its inner points scattered by a seed."""
    x = np.linspace(-size / 2, size / 2, cells + 1)
    points = np.stack([*np.meshgrid(x, x, indexing="ij"), np.zeros((cells + 1, cells + 1))], -1).reshape(
        -1, 3
    )
    if seed is not None:
        inner = np.abs(points).max(axis=1) < size / 2 - 1e-9
        points[inner, :2] += np.random.default_rng(seed).uniform(-0.3, 0.3, (inner.sum(), 2)) * size / cells
    return points, quads((cells + 1) * np.arange(cells + 1)[:, None] + np.arange(cells + 1))


def quads(numbers):
    a, b, c, d = (q.ravel() for q in (numbers[:-1, :-1], numbers[1:, :-1], numbers[1:, 1:], numbers[:-1, 1:]))
    return np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def ball(radius, parts, scatter=0.0, seed=0):
    """A sphere from an octahedron, each edge in `parts`; points scattered along the sphere by shares of an edge."""
    number, points, triangles = {}, [], []

    def point(i, j, k):
        if (i, j, k) not in number:
            number[i, j, k] = len(points)
            # equal angles rather than equal lengths: triangles of similar size
            p = np.sin(np.pi / 2 * np.array([i, j, k]) / parts)
            points.append(p / np.linalg.norm(p))
        return number[i, j, k]

    for sx, sy, sz in np.stack(np.meshgrid([1, -1], [1, -1], [1, -1]), -1).reshape(-1, 3):
        turn = 1 if sx * sy * sz > 0 else -1
        for i in range(parts):
            for j in range(parts - i):
                k = parts - i - j

                def at(a, b, c, s=(sx, sy, sz)):
                    return point(a * s[0], b * s[1], c * s[2])

                triangles.append([at(i, j, k), at(i + 1, j, k - 1), at(i, j + 1, k - 1)][::turn])
                if k > 1:
                    triangles.append(
                        [at(i + 1, j, k - 1), at(i + 1, j + 1, k - 2), at(i, j + 1, k - 1)][::turn]
                    )
    points = np.array(points)
    points += np.random.default_rng(seed).normal(0, scatter * np.pi / 2 / parts, points.shape)
    return radius * points / np.linalg.norm(points, axis=1, keepdims=True), np.array(triangles)


def tube(radius, length, around, along):
    """The side of a cylinder along z, centred on the origin."""
    angle = 2 * np.pi * np.arange(around) / around
    z = np.linspace(-length / 2, length / 2, along + 1)
    circle = np.column_stack([np.cos(angle), np.sin(angle)]) * radius
    points = np.column_stack([np.repeat(circle, along + 1, axis=0), np.tile(z, around)])
    numbers = (along + 1) * np.append(np.arange(around), 0)[:, None] + np.arange(along + 1)
    return points, quads(numbers)


def box(size, cells):
    """A cube around the origin with all its six faces."""
    points, triangles = [], []
    flat, few = plate(size, cells)
    flat = flat + np.array([0, 0, size / 2])
    for axis in range(3):
        for flip in (1, -1):
            turned = np.roll(flat, axis, axis=1) * flip
            points.append(turned)
            triangles.append((few if flip == 1 else few[:, ::-1]) + len(flat) * len(triangles))
    points, triangles = np.vstack(points), np.vstack(triangles)
    _, first, back = np.unique(np.round(points / size * 1e6), axis=0, return_index=True, return_inverse=True)
    return points[first], np.ravel(back)[triangles]


def directions(count, seed):
    v = np.random.default_rng(seed).normal(size=(count, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)
