"""Parts to try things with: the surfaces of organ-like bodies, made by formulas. They are no patient's anatomy.

The kidney is a sphere that is stretched, bent, dented and flattened. The other bodies are implicit: lobes are
ellipsoids that grow together, hollows are ellipsoids that are cut out with a rounded edge. Their surfaces are where
rays from the middle leave the body.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.checks import did_you_mean
from palpate.errors import UsageError
from palpate.files import write_file
from palpate.output_files import SAMPLE_HEAD

__all__ = [
    "ORGANS",
    "SAMPLES",
    "ImplicitOrgan",
    "kidney_surface",
    "sample_name",
    "sample_surface",
    "write_sample_part",
]

HALF_AXES = (0.055, 0.030, 0.022)  # m, of the ellipsoid that is bent
BEND = 0.20  # by how much the two poles lie to the side of the middle, over the half length
POLES = 0.10  # by how much thicker one pole is than the middle, and the other thinner
HILUM = 0.007  # m, depth of the dent in the hollow side
HILUM_SIZE = (0.014, 0.012)  # m, half sizes of the dent along x and z
FLAT = 0.18  # share of its height that the underside is flattened by
SUBDIVISIONS = 4  # of an icosahedron: 5,120 triangles, whose edges are 4 mm long on the kidney
HALVINGS = 48  # of the interval in which a ray leaves a body: to the last digits

Ellipsoid = tuple[tuple[float, float, float], tuple[float, float, float]]  # centre and half axes, m


@dataclass(frozen=True)
class ImplicitOrgan:
    """A smooth body of lobes and hollows that rays from its `middle` leave once; it lies on a rounded flat underside.

    Of an ellipsoid q = |(x − centre) / half axes|² − 1. Lobes are united by −ln Σ exp(−s q) / s; hollows, and the
    half-space below, are cut out by the same function with its sign turned. The larger s is, the sharper are the edges.
    """

    words: str
    lobes: tuple[Ellipsoid, ...]
    floor: float  # height at which the underside is flattened, m
    middle: tuple[float, float, float]  # m
    half_axes: tuple[float, float, float]  # of the ellipsoid through whose points rays go, m
    hollows: tuple[Ellipsoid, ...] = ()
    sharpness: float = 4.0

    def level(self, points: np.ndarray) -> np.ndarray:
        """Return the implicit function at points (..., 3) in m: negative in the body, zero on its surface."""
        s, height = self.sharpness, self.half_axes[2]
        body = -_soft_sum([-s * _quadric(points, lobe) for lobe in self.lobes]) / s
        cuts = [-s * _quadric(points, hollow) for hollow in self.hollows]
        below = s * (self.floor - points[..., 2]) / height
        return np.asarray(_soft_sum([s * body, below, *cuts]) / s)

    def surface(self, subdivisions: int = SUBDIVISIONS) -> tuple[np.ndarray, np.ndarray]:
        """Return points (n, 3) of its surface in m, and triangles (t, 3), counter-clockwise as seen from outside."""
        from trimesh.creation import icosphere

        sphere = icosphere(subdivisions=subdivisions)
        rays = np.asarray(sphere.vertices) * self.half_axes
        middle = np.asarray(self.middle)
        inner, outer = np.zeros(len(rays)), np.full(len(rays), 3.0)
        for _ in range(HALVINGS):
            half = (inner + outer) / 2
            is_in = self.level(middle + half[:, None] * rays) < 0
            inner, outer = np.where(is_in, half, inner), np.where(is_in, outer, half)
        return middle + inner[:, None] * rays, np.asarray(sphere.faces, dtype=np.int64)


def _quadric(points: np.ndarray, ellipsoid: Ellipsoid) -> np.ndarray:
    centre, axes = ellipsoid
    return np.asarray((((points - centre) / axes) ** 2).sum(axis=-1) - 1)


def _soft_sum(terms: list[np.ndarray]) -> np.ndarray:
    """Return ln Σ exp(terms), which is the largest of them with rounded edges."""
    return np.asarray(np.logaddexp.reduce(terms, axis=0))


def kidney_surface(subdivisions: int = SUBDIVISIONS) -> tuple[np.ndarray, np.ndarray]:
    """Return the closed surface of a kidney-like organ that lies on its flattened side, about 110 × 60 × 40 mm.

    An ellipsoid with one pole thicker than the other, bent, dented in its hollow and flattened below. Each step moves
    points along one axis by a function that grows along it, so the surface never cuts itself.

    The 20 triangles of an icosahedron are divided into four `subdivisions` times. Returns points (n, 3) in m, the
    lowest at z = 0, and triangles (t, 3), counter-clockwise as seen from outside.
    """
    from trimesh.creation import icosphere

    sphere = icosphere(subdivisions=subdivisions)
    a, b, c = HALF_AXES
    x, y, z = np.asarray(sphere.vertices).T
    thick = 1 + POLES * x
    dent = HILUM * np.exp(-((a * x / HILUM_SIZE[0]) ** 2) - (c * z / HILUM_SIZE[1]) ** 2)
    across = b * thick * y + BEND * a * x * x - dent * ((1 + y) / 2) ** 2
    upright = c * thick * z * np.where(z < 0, 1 - FLAT * z * z, 1.0)
    points = np.stack([a * x, across, upright - upright.min()], axis=1)
    return points, np.asarray(sphere.faces, dtype=np.int64)


ORGANS: dict[str, ImplicitOrgan] = {
    "liver": ImplicitOrgan(
        "a liver-like organ of two lobes",
        lobes=(
            ((-0.035, 0.0, 0.0), (0.062, 0.060, 0.042)),  # right
            ((0.040, 0.012, 0.002), (0.062, 0.042, 0.026)),  # left, flatter
            ((0.005, 0.005, 0.0), (0.060, 0.045, 0.030)),  # what joins them
        ),
        hollows=(((0.020, -0.066, -0.012), (0.030, 0.032, 0.034)),),  # in front, where the gall bladder lies
        floor=-0.024,
        middle=(-0.010, 0.002, 0.0),
        half_axes=(0.088, 0.060, 0.040),
    ),
    "heart": ImplicitOrgan(
        "a heart-like organ with its apex to one side",
        lobes=(
            ((-0.012, 0.0, 0.0), (0.040, 0.034, 0.031)),  # ventricles
            ((0.026, 0.008, -0.003), (0.032, 0.020, 0.019)),  # towards the apex
            ((-0.034, 0.016, 0.008), (0.022, 0.021, 0.020)),  # atria
            ((-0.036, -0.017, 0.004), (0.021, 0.019, 0.018)),
        ),
        hollows=(((-0.010, 0.0, 0.048), (0.060, 0.013, 0.022)),),  # the furrow between the ventricles
        floor=-0.020,
        middle=(-0.008, 0.002, 0.0),
        half_axes=(0.055, 0.035, 0.030),
    ),
    "prostate": ImplicitOrgan(
        "a prostate-like gland with a furrow between its lobes",
        lobes=(
            ((0.0, -0.011, 0.0), (0.017, 0.014, 0.0135)),
            ((0.0, 0.011, 0.0), (0.017, 0.014, 0.0135)),
            ((0.007, 0.0, -0.001), (0.014, 0.012, 0.012)),  # towards the apex
        ),
        hollows=(((-0.006, 0.0, 0.020), (0.026, 0.007, 0.011)),),
        floor=-0.009,
        middle=(0.001, 0.0, -0.001),
        half_axes=(0.018, 0.024, 0.013),
    ),
}
"""Organs beside the kidney, by name."""

SAMPLES: dict[str, str] = {
    "kidney": "a kidney-like organ",
    **{name: organ.words for name, organ in ORGANS.items()},
}
"""Parts that there are, by name, with what they are in words."""


def sample_name(name: str) -> str:
    """Return the name of a sample part, in any case; refuse another name."""
    if (key := name.strip().lower()) in SAMPLES:
        return key
    raise UsageError(
        f"There is no sample part called {name}.",
        why=f"There are {', '.join(SAMPLES)}.",
        fix=did_you_mean(key, SAMPLES) or "Name one of these.",
    )


def sample_surface(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return points (n, 3) in m, the lowest at z = 0, and triangles (t, 3) of a sample part's surface."""
    name = sample_name(name)
    points, triangles = ORGANS[name].surface() if name in ORGANS else kidney_surface()
    return points - [0.0, 0.0, points[:, 2].min()], triangles


def write_sample_part(path: str | os.PathLike[str], name: str = "kidney") -> Path:
    """Write a sample part as a binary STL file in mm; the path ends in .stl."""
    from trimesh import Trimesh

    path = Path(path)
    if path.suffix.lower() != ".stl":
        raise UsageError(
            f"The sample part can't be written to {path}.",
            why="It is a surface in the format STL.",
            fix=f"Name a file such as {path.with_suffix('.stl')}.",
        )
    points, triangles = sample_surface(name)
    surface = Trimesh(np.round(1e3 * points, 4), triangles, process=False)
    content = surface.export(file_type="stl")
    assert isinstance(content, bytes)
    write_file(path, SAMPLE_HEAD.ljust(80) + content[80:])
    return path
