"""The depth of a rigid probe in a touched surface at rest, as a smooth field."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.surrogates.surface.spline import distances_into

if TYPE_CHECKING:
    from palpate.surrogates.surface.exact import Exact
    from palpate.surrogates.surface.grid import Grid

__all__ = ["TouchedSurface"]

CELLS = 10  # to the radius of the smallest probe, where there are edges to go round
FEW = 6  # where there are none
TRUE = 1e-3  # of that radius: the error to which the spacing is refined, where there is room
MOST = 2_000_000  # nodes: 16 MB
CHECKS = 20_000  # places at which the error is measured
AFTER = 1.0  # of that radius: how much farther inside than `inner` the distance turns back, some cells
COARSEST = 3  # cells to the radius, below which nothing is known of edges
TRIALS = 3


@dataclass(frozen=True, eq=False)
class TouchedSurface:
    """Signed distance d(c) of a point to a surface, with two continuous derivatives.

    Exact over the interior of a plane, and within `error` elsewhere; rounded within some `spacing` of edges of the
    surface and of places inside that are equally far from two parts of it. Beyond the surface's border d is the
    distance to the border. Farther outside than `reach` it levels off above it: nothing is felt there. Farther
    inside than `inner` it soon turns back, and levels off two radii later: nothing is felt behind the body.

    Attributes
    ----------
    frame : (4,) array
        Position of the first node and spacing of the grid, in m.
    coefficients : (i, j, k) array
        Of the cubic spline, in m.
    radius : float
        Of the smallest probe that it is meant for, in m: nearer than that *below the border*, d is bridged (see
        `exact`) and not a distance.
    reach : float
        How far outside d is a distance, in m.
    inner : float
        The same inside, in m.
    error : float
        Largest deviation from the measured distance at check points within the reach, away from edges and
        kinks, in m.
    """

    frame: np.ndarray
    coefficients: np.ndarray
    radius: float
    reach: float
    inner: float
    error: float

    @classmethod
    def of(
        cls,
        points: np.ndarray,
        triangles: np.ndarray,
        *,
        radius: float,
        reach: float | None = None,
        inner: float | None = None,
        spacing: float | None = None,
        shoulder: float = 0.0,
    ) -> TouchedSurface:
        """The field of a surface given by triangles, open or closed.

        Parameters
        ----------
        points : (P, 3) array
            In m; not all need be used.
        triangles : (t, 3) int array
            Counter-clockwise as seen from outside.
        radius : float
            Of the smallest probe, in m.
        reach : float, optional
            At least the radius of the largest probe, in m. By default a tenth more than `radius`.
        inner : float, optional
            How deep the probe's centre may go, in m. By default 1.5 times `radius`.
        spacing : float, optional
            Of the grid, in m. By default a tenth of the radius (a sixth for a surface without edges), refined
            where curvature asks and the grid stays under 2 million nodes.
        shoulder : float, optional
            Radius in m with which the surface rolls off beyond its border; 0 for an edge. With a shoulder the distance
            is as smooth right up to the border as in the middle, which learning asks for; a probe that leaves the
            surface sideways feels it for some `shoulder` longer.

        Raises
        ------
        UsageError
            If the triangles make no oriented surface, a length is not positive, or the grid would be too large.
        """
        from palpate.surrogates.surface.exact import Exact
        from palpate.surrogates.surface.skin import Skin

        reach = 1.1 * radius if reach is None else reach
        inner = 1.5 * radius if inner is None else inner
        _refuse_lengths(radius=radius, reach=reach, inner=inner, spacing=1.0 if spacing is None else spacing)
        if reach < radius:
            raise UsageError(
                f"A reach of {reach:g} m is less than the probe's radius of {radius:g} m.",
                fix="A probe is in touch from its radius on: reach at least as far.",
            )
        if not (np.isfinite(shoulder) and shoulder >= 0):
            raise UsageError(
                f"A shoulder of {shoulder} m is no length.", fix="Pass 0 or a positive length in m."
            )
        exact = Exact.of(Skin.of(points, triangles), radius, shoulder, inner + AFTER * radius)
        return _built(exact, reach, inner, spacing)

    @property
    def spacing(self) -> float:
        """Of the grid, in m."""
        return float(self.frame[3])

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner (3,) in m of where the field was measured."""
        nodes = np.array(self.coefficients.shape)
        return self.frame[:3] + self.spacing, self.frame[:3] + (nodes - 2) * self.spacing

    def at(self, C: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distance (N,) in m, its gradient (N, 3) and its Hessian (N, 3, 3) in 1/m at places (N, 3) in m."""
        C = _places(C)
        d, g, H = np.empty(len(C)), np.empty((len(C), 3)), np.empty((len(C), 3, 3))
        distances_into(C, d, g, H, *self.compiled())
        return d, g, H

    def depth(self, C: np.ndarray, radius: float | np.ndarray) -> np.ndarray:
        """Depth R − d (N,) in m of probes of radius R (m; one or N) at places (N, 3); not positive without contact."""
        return np.asarray(radius - self.at(C)[0])

    def compiled(self) -> tuple[np.ndarray, np.ndarray]:
        """What the kernel `distance_into` takes after its own arguments."""
        return self.frame, self.coefficients

    def arrays(self) -> dict[str, np.ndarray]:
        """Everything as arrays, for a file."""
        lengths = np.array([self.radius, self.reach, self.inner, self.error])
        return {"frame": self.frame, "coefficients": self.coefficients, "lengths": lengths}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> TouchedSurface:
        """The field whose `arrays` these are.

        Raises
        ------
        FileFormatError
            If they are not those of one, or describe none that could be evaluated.
        """
        try:
            frame, C, lengths = (arrays[k] for k in ("frame", "coefficients", "lengths"))
        except KeyError as error:
            raise FileFormatError(f"A touched surface lacks its array {error}.") from error
        kinds = {np.asarray(a).dtype for a in (frame, C, lengths)}
        shapes = np.shape(frame) == (4,) and np.shape(lengths) == (4,) and np.ndim(C) == 3
        if not (shapes and kinds == {np.dtype(np.float64)} and min(C.shape) >= 4):
            raise FileFormatError("The arrays of a touched surface have the wrong shapes or kinds.")
        finite = all(np.isfinite(a).all() for a in (frame, C, lengths))
        if not (finite and frame[3] > 0 and (lengths[:3] > 0).all() and lengths[3] >= 0):
            raise FileFormatError(
                "The numbers of a touched surface are not finite, or its lengths not positive."
            )
        radius, reach, inner, error_ = lengths.tolist()
        C = np.ascontiguousarray(C)
        return cls(np.ascontiguousarray(frame), C, radius, reach, inner, error_)

    def __repr__(self) -> str:
        nodes = " × ".join(str(n) for n in self.coefficients.shape)
        return (
            f"TouchedSurface: {nodes} nodes, {1e3 * self.spacing:.3g} mm apart, "
            f"true to {1e3 * self.error:.2g} mm for {1e3 * self.reach:.3g} mm outside and "
            f"{1e3 * self.inner:.3g} mm inside"
        )


def _built(exact: Exact, reach: float, inner: float, spacing: float | None) -> TouchedSurface:
    """The field on a grid of given spacing (m), or the coarsest that is true enough."""
    from palpate.surrogates.surface.grid import sampled

    cells = CELLS if exact.pieces.kinds.any() else FEW
    h = max(exact.radius / cells, _finest(exact, reach, inner)) if spacing is None else spacing
    _refuse_nodes(exact, reach, inner, h)
    for _ in range(TRIALS):
        grid = sampled(exact, reach, inner, h)
        error = _error(exact, grid, reach, inner)
        finer = max(0.7 * h, _finest(exact, reach, inner))
        if spacing is not None or error <= TRUE * exact.radius or finer > 0.9 * h:
            break
        h = finer
    return TouchedSurface(grid.frame, grid.coefficients, exact.radius, reach, inner, error)


def _error(exact: Exact, grid: Grid, reach: float, inner: float) -> float:
    """Largest deviation in m from the measured distance where the grid is faithful; its spacing if it is nowhere."""
    h, C = grid.frame[3], grid.coefficients
    near = grid.faithful & (-inner < C) & (reach > C)
    cells = np.argwhere(near[1:-2, 1:-2, 1:-2]) + 1
    if not len(cells):
        return float(h)
    random = np.random.default_rng(0)
    chosen = cells[np.sort(random.choice(len(cells), min(CHECKS, len(cells)), replace=False))]
    places = grid.frame[:3] + h * (chosen + random.random(chosen.shape))
    d, g, H = np.empty(len(places)), np.empty((len(places), 3)), np.empty((len(places), 3, 3))
    distances_into(places, d, g, H, grid.frame, C)
    return float(np.abs(d - exact.at(places)[0]).max())


def _finest(exact: Exact, reach: float, inner: float) -> float:
    """Smallest spacing in m for which the grid is small enough."""
    h = exact.radius / 100
    while _nodes(exact, reach, inner, h) > MOST:
        h *= 1.02
    return h


def _nodes(exact: Exact, reach: float, inner: float, spacing: float) -> int:
    from palpate.surrogates.surface.grid import margin_of, shape_of

    margin = margin_of(reach, inner, spacing, exact.shoulder)
    return int(np.prod(shape_of(exact, margin, spacing)[1].astype(object)))


def _refuse_nodes(exact: Exact, reach: float, inner: float, spacing: float) -> None:
    if spacing > exact.radius / COARSEST:
        raise UsageError(
            f"A grid of {1e3 * spacing:.3g} mm can't tell how a probe of {1e3 * exact.radius:.3g} mm touches.",
            why=f"It needs {COARSEST} cells to its radius; left open, the spacing is as fine as there is room for.",
            fix="Choose a finer spacing, a smaller part of the surface or a larger probe.",
        )
    nodes = _nodes(exact, reach, inner, spacing)
    if nodes > MOST:
        raise UsageError(
            f"A grid of {1e3 * spacing:.3g} mm would have {nodes:,} nodes; at most {MOST:,} are made.",
            fix=f"Choose a spacing of {1e3 * _finest(exact, reach, inner):.2g} mm or more, or none.",
        )


def _refuse_lengths(**lengths: float) -> None:
    for name, value in lengths.items():
        if not (np.isfinite(value) and value > 0):
            raise UsageError(
                f"The {name} of a touched surface is {value}.", fix="Pass a positive length in m."
            )


def _places(C: np.ndarray) -> np.ndarray:
    C = np.ascontiguousarray(C, dtype=np.float64)
    if C.ndim != 2 or C.shape[1] != 3:
        raise UsageError(f"Places of shape {C.shape} can't be looked up.", fix="Pass an array (N, 3) in m.")
    return C
