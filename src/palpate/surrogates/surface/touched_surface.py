"""The depth of a rigid probe in a touched surface at rest, as a smooth field."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.kernels import for_rows
from palpate.network.packing import pack, unpack, whole_multiples
from palpate.surrogates.surface.distance_kernels import distances_into

__all__ = ["TouchedSurface"]

AFTER = 1.0  # distance over the radius, by which the distance turns back farther inside than `inner`
FLAT_FRAME = 15  # numbers that say where a flat surface lies
QUANTA = 16  # at least 2^16 quanta to a cell, fewer than 2^17


@dataclass(frozen=True, eq=False)
class TouchedSurface:
    """Signed distance d(c) of a point to a surface, with two continuous derivatives.

    Exact over the interior of a plane, and within `error` elsewhere; rounded within some `spacing` of edges of the
    surface and of places inside that are equally far from two parts of it. Beyond the surface's border d is the
    distance to the border. Farther outside than `reach` it levels off above it: nothing is felt there. Farther
    inside than `inner` it soon turns back, and levels off two radii later: nothing is felt behind the body.

    The coefficients that `of` makes for a curved surface are whole multiples of a quantum q, the power of two between
    2⁻¹⁷ and 2⁻¹⁶ of the spacing h (7.5 nm at 0.9 mm), so that files and exports need a third of the room. That is a
    spline like any other: it has two continuous derivatives, and energy, force and stiffness belong to each other.
    Within the box it differs from the spline before rounding by at most q/2 in d, 3q/4h < 1.2e-5 in a component of
    the gradient and 2q/h² < 3.1e-5/h in an entry of the Hessian: the magnitudes of a cubic B-spline's weights add up
    to 1, those of their first derivatives to 3/2 at most, those of their second ones to 4. A flat surface is exact.

    Attributes
    ----------
    frame : (4,) or (15,) array
        Position of the first node and spacing of the grid, in m; of a flat surface also how it lies, see
        `palpate.surrogates.surface.distance_kernels`.
    coefficients : (i, j, k) array
        Of the cubic spline, in m; of a flat surface those of the distance from its outline, (i, j, 1).
    profile : (m, n) array
        Of a flat surface: coefficients of the distance over its outline, in m; empty for a curved one.
    radius : float
        Of the smallest probe that it is meant for, in m: nearer than that *below the border*, d is bridged (see
        `measured_distance`) and not a distance.
    reach : float
        How far outside d is a distance, in m.
    inner : float
        The same inside, in m.
    error : float
        Largest deviation from the measured distance at check points within the reach, away from edges, kinks and
        shoulders, in m.
    """

    frame: np.ndarray
    coefficients: np.ndarray
    profile: np.ndarray
    radius: float
    reach: float
    inner: float
    error: float

    def __post_init__(self) -> None:
        fault = ""
        arrays = (*self.compiled(), self.lengths)
        if not _fit(*self.compiled()):
            fault = "its tables have the wrong shapes"
        elif not all(np.isfinite(a).all() for a in arrays):
            fault = "a number of it is not finite"
        elif not (self.frame[3] > 0 and min(self.radius, self.reach, self.inner) > 0 and self.error >= 0):
            fault = "its spacing or a length of it is not positive"
        elif self.profile.size and np.abs(_gram(self.frame) - np.eye(3)).max() > 1e-9:
            fault = "its axes are no rotation"
        if fault:
            raise UsageError(
                f"A touched surface can't be made: {fault}.",
                fix="Let `TouchedSurface.of` make it of triangles.",
            )

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
        """Return the field of a surface given by triangles, open or closed.

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
            Of the grid, in m. By default a tenth of the radius (an eighth where a curved surface ends in a
            shoulder, a sixth where it has no end), refined
            where curvature asks, that makes it more exact, and the grid stays under 2 million nodes.
        shoulder : float, optional
            Radius in m with which the surface rolls off beyond its border; 0 for an edge. With a shoulder the distance
            is as smooth right up to the border as in the middle, which learning asks for; a probe that leaves the
            surface sideways feels it for some `shoulder` longer.

        Raises
        ------
        UsageError
            If the triangles make no oriented surface, a length is not positive, or the grid would be too large.
        """
        from palpate.surrogates.surface.distance_table import tabulate
        from palpate.surrogates.surface.measured_distance import MeasuredDistance
        from palpate.surrogates.surface.oriented_mesh import OrientedMesh

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
        mesh = OrientedMesh.of(points, triangles)
        measured = MeasuredDistance.of(mesh, radius, shoulder, inner + AFTER * radius)
        table = tabulate(measured, reach, inner, spacing)
        return cls(
            table.frame, table.coefficients, table.profile, radius, reach, inner, table.error
        ).round_to_quanta()

    def round_to_quanta(self) -> TouchedSurface:
        """Return the surface with its coefficients rounded to whole quanta, half a quantum less exact.

        One that is flat, or rounded already, is returned as it is.
        """
        if self.profile.size or self._in_quanta:
            return self
        quantum = self._quantum
        # adding zero takes the sign from those that became minus zero
        coefficients = quantum * np.rint(self.coefficients / quantum) + 0.0
        return replace(self, coefficients=coefficients, error=self.error + quantum / 2)

    @property
    def _quantum(self) -> float:
        return 2.0 ** (math.frexp(self.spacing)[1] - 1 - QUANTA)

    @property
    def _in_quanta(self) -> bool:
        multiples = whole_multiples(self.coefficients)
        return multiples is not None and 2.0 ** multiples[1] >= self._quantum

    @property
    def spacing(self) -> float:
        """Spacing of the grid, in m."""
        return float(self.frame[3])

    @property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner (3,) in m of where the field was measured."""
        nodes = np.array(self.coefficients.shape)
        if not self.profile.size:
            return self.frame[:3] + self.spacing, self.frame[:3] + (nodes - 2) * self.spacing
        heights = self.frame[14] + self.spacing * np.array([1, self.profile.shape[1] - 2])
        sides = [self.spacing * np.array([1, n - 2]) for n in nodes[:2]]
        corners = np.stack(np.meshgrid(*sides, heights), axis=-1).reshape(-1, 3) @ self.frame[4:13].reshape(
            3, 3
        )
        return self.frame[:3] + corners.min(axis=0), self.frame[:3] + corners.max(axis=0)

    def at(self, C: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return d (N,) in m, its gradient (N, 3) and its Hessian (N, 3, 3) in 1/m at places C (N, 3) in m."""
        C = _places(C)
        d, g, H = np.empty(len(C)), np.empty((len(C), 3)), np.empty((len(C), 3, 3))
        for_rows(distances_into, len(C))(C, d, g, H, *self.compiled())
        return d, g, H

    def depth(self, C: np.ndarray, radius: float | np.ndarray) -> np.ndarray:
        """Depth R − d (N,) in m of probes of radius R (m; one or N) at places (N, 3); not positive without contact."""
        return np.asarray(radius - self.at(C)[0])

    def raised(self, height: float) -> TouchedSurface:
        """Return the surface of distance d − height (m): higher everywhere along its normal, as exact as this one.

        One whose coefficients are whole quanta is raised by whole quanta, and so by up to half a quantum more or less
        than `height`, which is added to its error.
        """
        # cubic B-splines sum to one, so this moves d by exactly as much
        reach, inner = self.reach - height, self.inner + height
        if self.profile.size:
            return replace(self, profile=self.profile - height, reach=reach, inner=inner)
        rise = self._quantum * round(height / self._quantum) if self._in_quanta else height
        error = self.error + abs(rise - height)
        return replace(self, coefficients=self.coefficients - rise, reach=reach, inner=inner, error=error)

    def compiled(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Arrays that the kernel `distance_into` takes after its own arguments."""
        return self.frame, self.coefficients, self.profile

    def arrays(self) -> dict[str, np.ndarray]:
        """Everything as arrays, for a file; the table of a curved surface is packed."""
        if self.profile.size:
            tables = {"coefficients": self.coefficients, "profile": self.profile}
        else:
            shape = np.array(self.coefficients.shape, dtype=np.float64)
            tables = {"packed": pack(self.coefficients), "shape": shape}
        return {"frame": self.frame, "lengths": self.lengths} | tables

    def equals(self, other: TouchedSurface) -> bool:
        """Return whether another surface is the same, number by number."""
        mine, theirs = ((*surface.compiled(), surface.lengths) for surface in (self, other))
        return self is other or all(np.array_equal(a, b) for a, b in zip(mine, theirs, strict=True))

    @property
    def lengths(self) -> np.ndarray:
        """Radius, reach, inner reach and error in m, (4,)."""
        return np.array([self.radius, self.reach, self.inner, self.error])

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> TouchedSurface:
        """Return the field whose `arrays` these are.

        Raises
        ------
        FileFormatError
            If they are not those of one, or describe none that could be evaluated.
        """
        try:
            frame, lengths = arrays["frame"], arrays["lengths"]
            C = _unpacked(arrays) if "packed" in arrays else arrays["coefficients"]
        except KeyError as error:
            raise FileFormatError(f"A touched surface lacks its array {error}.") from error
        except ValueError as error:
            raise FileFormatError("The table of a touched surface can't be read.", why=str(error)) from error
        profile = arrays.get("profile", np.zeros((0, 0)))
        every = (frame, C, lengths, profile)
        if {np.asarray(a).dtype for a in every} != {np.dtype(np.float64)} or np.shape(lengths) != (4,):
            raise FileFormatError("The arrays of a touched surface have the wrong shapes or kinds.")
        try:
            frame, C, profile = (np.ascontiguousarray(a) for a in (frame, C, profile))
            return cls(frame, C, profile, *lengths.tolist())
        except UsageError as error:
            raise FileFormatError("These arrays are no touched surface.", why=str(error)) from error

    def __repr__(self) -> str:
        nodes = " × ".join(str(n) for n in self.coefficients.shape if n > 1)
        return (
            f"TouchedSurface: {'flat, ' if self.profile.size else ''}{nodes} nodes, "
            f"{1e3 * self.spacing:.3g} mm apart, true to {1e3 * self.error:.2g} mm for {1e3 * self.reach:.3g} mm "
            f"outside and {1e3 * self.inner:.3g} mm inside"
        )


def _unpacked(arrays: Mapping[str, np.ndarray]) -> np.ndarray:
    packed, shape = arrays["packed"], arrays["shape"]
    if packed.dtype != np.uint8 or shape.shape != (3,) or not ((shape >= 4) & (shape < 1e4)).all():
        raise ValueError(f"it is described as {shape} numbers of kind {packed.dtype}")
    return unpack(packed, tuple(shape.astype(np.int64).tolist()))


def _fit(frame: np.ndarray, C: np.ndarray, profile: np.ndarray) -> bool:
    """Return whether arrays have the shapes of a curved surface's, or of a flat one's."""
    if C.ndim != 3 or profile.ndim != 2:
        return False
    if profile.size == 0:
        return frame.shape == (4,) and min(C.shape) >= 4
    return min(*profile.shape, *C.shape[:2]) >= 4 and frame.shape == (FLAT_FRAME,) and C.shape[2] == 1


def _gram(frame: np.ndarray) -> np.ndarray:
    axes = frame[4:13].reshape(3, 3)
    return np.asarray(axes @ axes.T)


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
