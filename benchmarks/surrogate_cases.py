"""Solves of one study as the surrogates' benchmark reads them: training sets of any size, test, symmetry, surface."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from benchmarks.touch_studies import RADIUS, STUDIES, TouchStudy
from palpate.physics.interactions.surface_patch import surface_of
from palpate.surrogates import TouchedSurface
from palpate.units import Range
from palpate.validation import TouchSolves

__all__ = ["DATA", "Case", "Training", "symmetry_of"]

DATA = Path(__file__).parent / "data"
ROUND = 16  # images of a body of revolution
GOLDEN = (5**0.5 - 1) / 2


@dataclass(frozen=True, eq=False)
class Training:
    """Solves to learn from; images under the symmetry are not among them.

    Attributes
    ----------
    X : (N, n) array
    energy : (N,) array
    force : (N, 3) array
    stiffness : (N, 3, 3) array
    beside : (N, n − 3) array
        −∂U by the further inputs.
    """

    X: np.ndarray
    energy: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray
    beside: np.ndarray

    @property
    def responses(self) -> np.ndarray:
        """−∂U (N, n) by all inputs."""
        return np.hstack([self.force, self.beside])

    def __len__(self) -> int:
        return len(self.X)


@dataclass(frozen=True, eq=False)
class Case:
    """A study with its data.

    Attributes
    ----------
    name : str
    study : TouchStudy
    arrays : mapping
        Of the file.
    surface : TouchedSurface
    """

    name: str
    study: TouchStudy
    arrays: dict[str, np.ndarray]
    surface: TouchedSurface

    @classmethod
    def load(cls, name: str) -> Case | None:
        """The study's data; None where there is no file."""
        path = DATA / f"touch_{name}.npz"
        if not path.exists():
            return None
        with np.load(path) as data:
            arrays = {key: data[key] for key in data.files}
        return cls(name, STUDIES[name], arrays, _surface(STUDIES[name]))

    def rows(self, role: str) -> np.ndarray:
        """Indices of a role's rows."""
        return np.flatnonzero(self.arrays["role"] == role)

    @property
    def radius(self) -> float:
        """Of the probe, m."""
        return RADIUS

    @property
    def available(self) -> int:
        """Training solves."""
        return len(self.rows("train"))

    def training(self, count: int) -> Training:
        """So many training solves."""
        rows = self.training_rows(count)
        known = {"beside": np.empty((len(self.arrays["energy"]), 0)), **self.arrays}
        return Training(*(known[k][rows] for k in ("inputs", "energy", "force", "stiffness", "beside")))

    def training_rows(self, count: int) -> np.ndarray:
        """Rows of so many training solves: the first columns, of each about ∛N − 1 depths spread over it."""
        rows = self.rows("train")
        columns = [rows[self.arrays["column"][rows] == j] for j in np.unique(self.arrays["column"][rows])]
        depths = max(1, round(count ** (1 / 3)) - 1)
        while sum(min(depths, len(c)) for c in columns) < count and depths < max(map(len, columns)):
            depths += 1
        chosen: list[int] = []
        for j, column in enumerate(columns):
            if len(chosen) >= count:
                break
            m = min(depths, len(column))
            at = ((np.arange(m) + (j * GOLDEN) % 1.0) * len(column) / m).astype(int)
            chosen += column[at].tolist()
        return np.array(chosen[:count])

    def solves(self, role: str) -> TouchSolves | None:
        """Solves of a role; None where the file has none."""
        rows = self.rows(role)
        if not len(rows):
            return None
        X, energy, force, stiffness = (
            self.arrays[k][rows] for k in ("inputs", "energy", "force", "stiffness")
        )
        return TouchSolves(X, force, energy, stiffness)

    @cached_property
    def symmetry(self) -> tuple[np.ndarray, ...]:
        """Isometries (3, 3), the identity among them; none where there is no symmetry."""
        return symmetry_of(self.study.symmetry)

    @property
    def about(self) -> np.ndarray:
        """Point (3,) in m that the symmetry leaves where it is."""
        return np.array([*self.study.about, 0.0])

    @cached_property
    def inputs(self) -> tuple[Range, ...]:
        """The position's box, images included, and the further inputs' ranges."""
        centres = self.images(self.arrays["inputs"])[0].reshape(-1, self.arrays["inputs"].shape[1])[:, :3]
        low, high = centres.min(axis=0), centres.max(axis=0)
        box = [Range(f"c_{a}", float(p), float(q), "m") for a, p, q in zip("xyz", low, high, strict=True)]
        return (*box, *(one.range for one in self.study.inputs))

    def images(self, X: np.ndarray, F: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Images of inputs (N, n) and forces (N, 3): arrays (N, images, n) and (N, images, 3)."""
        F = np.zeros((len(X), 3)) if F is None else F
        M = np.array(self.symmetry) if self.symmetry else np.eye(3)[None]
        many = np.repeat(X[:, None], len(M), axis=1)
        many[:, :, :3] = np.einsum("mij,nj->nmi", M, X[:, :3] - self.about) + self.about
        return many, np.einsum("mij,nj->nmi", M, F)


def symmetry_of(kind: str) -> tuple[np.ndarray, ...]:
    """Isometries about a vertical axis: of a square, or `ROUND` of a body of revolution."""
    if kind == "none":
        return ()
    turns = 4 if kind == "square" else ROUND // 2
    found = []
    for i in range(turns):
        a = 2 * np.pi * i / turns
        turn = np.array([[np.cos(a), -np.sin(a), 0.0], [np.sin(a), np.cos(a), 0.0], [0.0, 0.0, 1.0]])
        found += [turn, turn @ np.diag([1.0, -1.0, 1.0])]
    return tuple(found)


def _surface(study: TouchStudy) -> TouchedSurface:
    """Distance to the touched surface: of a rectangle, or of the curved elements."""
    geometry = study.body().geometry
    if getattr(geometry, "curved", False):
        patch = surface_of(geometry, study.touches, study.probe.refinements(geometry))
        points, triangles = patch.points, patch.triangles
    else:
        a, b, z = geometry.size
        points = np.array([[0.0, 0.0, z], [a, 0.0, z], [a, b, z], [0.0, b, z]])
        triangles = np.array([[0, 1, 2], [0, 2, 3]])
    return TouchedSurface.of(points, triangles, radius=RADIUS, inner=2.0 * study.depth, shoulder=RADIUS / 3)
