"""Rigid tools that press a surface without friction: their places, their way there, their contact energy.

The three coordinates of a tool's place are its first inputs; angles may follow, where its orientation is one. What is a
tool's place, and how high above its contact point that is, the tool says itself: of a `SphereProbe` it is the centre.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import UsageError
from palpate.physics.interactions.interaction import Attached, Energy, Field, PlainInteraction
from palpate.physics.interactions.sphere_design import (
    contact_points,
    depth_series,
    depths_per_series,
    group_into_chains,
    require_fit,
)
from palpate.physics.interactions.spread_places import depth_sequence, spread_places
from palpate.physics.interactions.surface_patch import Patch, surface_of
from palpate.physics.shapes.meshing import FineMesh
from palpate.physics.shapes.naming import joint_name, require_known
from palpate.units import Range

if TYPE_CHECKING:
    from palpate.physics.interactions.tool_contact import Contact
    from palpate.physics.shapes.shape import Geometry
    from palpate.tools import Tool

__all__ = ["Corner", "PressingTool", "checked_box"]

# share of the tool's size: a box of contact points that ends so near to the surface's rim ends there
END = 1e-3
# distance of the contact points from the surface's rim over its width, at most, unless it is given
MOST_INSET = 0.4
SIDEWAYS = 3.0  # how much dearer a move across is than one along the normal
FIRST = 0.25  # first step along the approach over the tool's size
FIRST_PRESSED = 0.5  # the same, at most, over the pad's stop: staying is then an admissible guess
# the same, at most, over the largest depth: a large sphere's radius says nothing of the way
FIRST_DEPTH = 0.25
OPEN = 0.3  # length of a surface's mean normal from which on it is looked at along one axis
CLEAR = 1e-9  # share of the tool's size that rounding may take of its distance from the surface
MOST_STEPS = 50  # steps along the normal after which the search for a place outside is given up

Corner = tuple[float, ...]


class PressingTool(PlainInteraction):
    """Base of interactions that press a surface with a rigid tool, frozen dataclasses.

    The inputs are the tool's place, then its angles, if any. A subclass says what shape it has, and where its place is.
    """

    shape: Tool  # in its own frame
    touches: str
    pad: Any  # stiffness in N/m³
    depth: tuple[float, float]  # of the foremost point below the surface at rest, m
    over: tuple[Corner, Corner] | None  # box of the contact points, m
    rim: str | None
    symbol = "c"  # the inputs are c_x, c_y, c_z

    @property
    def stop(self) -> float | None:
        """Penetration in m at which the pad is fully pressed; None for a pad without a stop."""
        return None

    @property
    def front(self) -> float:
        """Distance in m from the tool's place to its shape's centre, against its own axis."""
        return 0.0

    @property
    def angles(self) -> tuple[Range, ...]:
        """Names and ranges in rad of the k inputs after the place."""
        return ()

    def spread_angles(self, unit: np.ndarray) -> np.ndarray:
        """Return angles (N, k) in rad, even over all orientations, from k coordinates (N, k) between 0 and 1."""
        return unit

    def pose(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return place (..., 3) in m and rotation (..., 3, 3) of the tool at inputs (..., 3 + k)."""
        x = np.asarray(x, dtype=float)
        return x[..., :3], np.broadcast_to(np.eye(3), (*x.shape[:-1], 3, 3))

    def offset(self, normals: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """Return how high (N,) in m the place is above a plane that the tool just touches.

        The planes have unit normals (N, 3), the tool angles (N, k) in rad.
        """
        raise NotImplementedError

    def contact_radius(self, depth: float) -> float:
        """Return about half the width in m of the contact at a depth in m, by which a rigid tool's pad is chosen."""
        raise NotImplementedError

    @property
    def _inset(self) -> float:
        """Distance in m of the contact points from the surface's rim, unless it is given."""
        raise NotImplementedError

    @property
    def _margin(self) -> Any:
        """Distance in m, one number or (3,), beyond its contact points up to which it may touch."""
        raise NotImplementedError

    def _element(self, geometry: Geometry, patch: Patch) -> float:
        """Return the element size in m under the tool."""
        raise NotImplementedError

    @property
    def meets(self) -> str:
        """The joint name of the surfaces that it may meet: the touched one and its rim."""
        return joint_name(self.touches, self.rim)

    def ranges(self, geometry: Geometry) -> tuple[Range, ...]:
        """Return the ranges of the place's coordinates in m: the box around all its positions."""
        if self.rim is None:
            patch = self._patch(geometry)
            require_fit(patch, geometry.rest().points, self.over, max(self.depth), END * self.shape.size)
            contacts, normals, _ = self._contact_points(patch, _GRID)
        else:  # the corners of all triangles that are pressed
            painted = self._paint(geometry)
            corners = np.unique(painted.triangles)
            contacts, normals = painted.points[corners], painted.node_normals[corners]
        ends = []
        for angles in self.spread_angles(_rim_of(len(self.angles))):
            offset = self.offset(normals, np.broadcast_to(angles, (len(normals), angles.size)))
            ends += [contacts + normals * (offset - d)[:, None] for d in self.depth]
        low, high = np.concatenate(ends).min(axis=0), np.concatenate(ends).max(axis=0)
        pairs = zip("xyz", low.tolist(), high.tolist(), strict=True)
        return (*(Range(f"{self.symbol}_{axis}", a, b, "m") for axis, a, b in pairs), *self.angles)

    def refinements(self, geometry: Geometry) -> tuple[FineMesh, ...]:
        """Return small elements wherever it may touch."""
        patch = Patch.from_mesh(geometry.rest(), self._surface(geometry))
        low, high = self._box(patch)
        low, high = low - self._margin, high + self._margin
        element = self._element(geometry, patch)
        return (FineMesh(self.meets, element, tuple(low.tolist()), tuple(high.tolist())),)

    def design(self, geometry: Geometry, samples: int, seed: int, depths: int | None = None) -> np.ndarray:
        """Return inputs (samples, 3 + k) in depth series, each from shallow to deep in one orientation.

        The contact points are a scrambled Sobol sequence (Sobol 1967; Owen 1998) over the touched part of the
        surface, denser towards sides where the surface ends; the depths of a series are evenly spaced, all shifted by a
        random share of their distance. `depths` is their number in a series, by default about ¾ √samples, and of a tool
        that turns the (3 + k)-th root of the samples: as many as of places and angles along each.

        With a rim the contact points are far from each other all over the touched surface, so that any first few are
        spread (see `spread_places`); of one depth each, the depths are a golden sequence.
        """
        count = depths_per_series(samples, 3 + len(self.angles)) if depths is None else depths
        if self.rim is not None:
            return self._spread_design(geometry, samples, seed, count)
        from scipy.stats import qmc

        number = -(-samples // count)
        engine = qmc.Sobol(3 + len(self.angles), scramble=True, rng=np.random.default_rng(seed))
        unit, contacts = np.empty((0, 3 + len(self.angles))), np.empty((0, 3))
        while len(contacts) < number:  # a surface need not fill its box
            unit = np.concatenate([unit, engine.random(1 << max(3, int(np.ceil(np.log2(number)))))])
            contacts, normals, hit = self._contact_points(self._patch(geometry), unit[:, :2])
        series = np.array([depth_series(self.depth, count, shift) for shift in unit[hit][:number, 2]])
        rows = self._over(
            contacts[:number], normals[:number], series, self.spread_angles(unit[hit][:number, 3:])
        )
        return rows[:samples]

    def _spread_design(self, geometry: Geometry, samples: int, seed: int, count: int) -> np.ndarray:
        """Return inputs (samples, 3 + k) over places that are far from each other."""
        number = -(-samples // count)
        contacts, normals = spread_places(self._paint(geometry), number, seed)
        width = (self.depth[1] - self.depth[0]) / count
        first = depth_sequence((self.depth[0], self.depth[0] + width), number, seed)
        depths = first[:, None] + width * np.arange(count)
        unit = np.random.default_rng(seed).random((number, len(self.angles)))
        return self._over(contacts, normals, depths, self.spread_angles(unit))[:samples]

    def _over(
        self, contacts: np.ndarray, normals: np.ndarray, depths: np.ndarray, angles: np.ndarray
    ) -> np.ndarray:
        """Return inputs (N · d, 3 + k) over contact points (N, 3) of unit normals (N, 3) at depths (N, d) in m."""
        heights = self.offset(normals, angles)[:, None] - depths
        places = contacts[:, None] + heights[:, :, None] * normals[:, None]
        repeated = np.broadcast_to(angles[:, None], (*heights.shape, angles.shape[1]))
        return np.concatenate([places, repeated], axis=2).reshape(-1, 3 + angles.shape[1])

    def random_presses(self, geometry: Geometry, samples: int, seed: int) -> np.ndarray:
        """Return inputs (samples, 3 + k), independent of each other, even over the touched area, depths and angles.

        They judge a surrogate by what was to be touched, margin and rim of its design aside.
        """
        rng = np.random.default_rng(seed)
        touched = surface_of(geometry, self.touches, self.refinements(geometry))
        contacts, normals = touched.spread_with_normals(rng.random((samples, 2)))
        depths = rng.uniform(*self.depth, (samples, 1))
        return self._over(
            contacts, normals, depths, self.spread_angles(rng.random((samples, len(self.angles))))
        )

    def chains(self, geometry: Geometry, points: np.ndarray) -> list[np.ndarray]:
        """Return rows of inputs (N, 3 + k) in chains: depth series of one orientation, from shallow to deep.

        Without angles places that stand alone are chained with their neighbours.
        """
        rows = np.asarray(points, dtype=float)
        contacts, distance = contact_points(self._patch(geometry), rows[:, :3])
        _, first, which = np.unique(rows[:, 3:], axis=0, return_index=True, return_inverse=True)
        chains = []
        for one in np.argsort(first):  # the order of the points
            own = np.flatnonzero(which.ravel() == one)
            chains += [
                own[chain]
                for chain in group_into_chains(rows[own, :3], contacts[own], distance[own], self.shape.size)
            ]
        return chains

    def attach(self, field: Field) -> Attached:
        """Return its contact energy on an opened body.

        Raises
        ------
        UsageError
            For a rigid tool that no problem has given a pad.
        """
        if isinstance(self.pad, str):
            raise UsageError(
                "A rigid tool can't be attached by itself.",
                why="The stiffness of its pad follows from the body.",
                fix="Put a body under it: body.problem(tool).",
            )
        return self.attach_pad(field, self.pad)

    def attach_pad(self, field: Field, pad: Any) -> Attached:
        """Return its contact energy on an opened body with a stiffness, a number in N/m³ or a parameter of NGSolve."""
        import ngsolve

        from palpate.physics.interactions.tool_contact import Contact, pad_energy

        contact = Contact(field, field.rest, self)
        inputs = tuple(ngsolve.Parameter(0.0) for _ in range(3 + len(self.angles)))
        penetration = contact.penetration(field.trial, inputs)
        energy = Energy(pad_energy(penetration, pad, self.stop), contact.measure())
        approach = _Approach(self, field, contact)
        return Attached(
            inputs,
            (energy,),
            inspect=contact.inspect,
            approach=approach,
            distance=approach.distance,
            first_step=self._first_step(),
        )

    def _first_step(self) -> float:
        """Return the longest first step along the approach in m."""
        pressed = np.inf if self.stop is None else FIRST_PRESSED * self.stop
        return float(min(FIRST * self.shape.size, pressed, FIRST_DEPTH * max(map(abs, self.depth))))

    def _surface(self, geometry: Geometry) -> str:
        for name in (self.touches, *([] if self.rim is None else [self.rim])):
            require_known("surface", name, geometry.surfaces)
        return self.touches

    def _patch(self, geometry: Geometry) -> Patch:
        """Return the surface that it may meet."""
        return surface_of(geometry, self.meets, self.refinements(geometry))

    def _paint(self, geometry: Geometry) -> Patch:
        """Return the surface that is pressed, with a rim: the touched one, or its part in a given box."""
        painted = surface_of(geometry, self.touches, self.refinements(geometry))
        return painted if self.over is None else _within(painted, *self._box(painted))

    def _box(self, patch: Patch) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and upper corner (3,) in m of the box of contact points."""
        low, high = (corner.copy() for corner in patch.box)
        if self.over is not None:
            for axis, (a, b) in enumerate(zip(*self.over, strict=True)):
                low[axis], high[axis] = a, b
        if self.over is not None or self.rim is not None:
            return low, high
        # along the surface only: a closed one faces nowhere in the mean and has no rim
        along = (np.abs(patch.facing) < 0.5 * np.linalg.norm(patch.facing)) & _is_open(patch)
        inset = np.minimum(self._inset, MOST_INSET * (high - low)) * along
        return low + inset, high - inset

    def _contact_points(self, patch: Patch, unit: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return contact points (M, 3) in m, outward normals (M, 3), and a mask of the places (N, 2) that have one."""
        low, high = self._box(patch)
        axis = int(np.argmax(np.abs(patch.facing)))
        if _is_open(patch):
            across = [i for i in range(3) if i != axis]
            ends = [
                np.abs(a - b)[across] < END * self.shape.size
                for a, b in zip((low, high), patch.box, strict=True)
            ]
            unit = _denser(unit, *ends)
            places = low[across] + unit * (high - low)[across]
            contacts = patch.cast(axis, float(np.sign(patch.facing[axis])), places)
        else:
            contacts = _within(patch, low, high).spread(unit)
        hit = np.isfinite(contacts).all(axis=1)
        contacts = contacts[hit]
        if not len(contacts):
            raise UsageError(
                f"The probe's contact points miss the surface {self.touches!r}.",
                why=f"They are to be in {low} … {high} m, the surface {patch.box[0]} … {patch.box[1]} m.",
                fix="Give `over` within the surface, in m.",
            )
        return contacts, np.array([patch.nearest(contact)[1] for contact in contacts]), hit


class _Approach:
    """The straight line along which a tool comes to a position from outside."""

    def __init__(self, probe: PressingTool, field: Field, contact: Contact) -> None:
        self._probe, self._field, self._contact = probe, field, contact
        self._known: Patch | None = None

    @property
    def _patch(self) -> Patch:
        """The touched surface under the constant loads alone."""
        if self._known is None:
            displacement = self._field.at_nodes(self._field.base)
            self._known = Patch.from_mesh(self._field.rest, self._probe.meets, displacement)
        return self._known

    def __call__(self, x: np.ndarray) -> np.ndarray | None:
        """Return the first inputs (3 + k,) along the outward normal from x at which the tool is clear of the surface.

        The angles stay. None where there are none, or a fixed surface is in the way from there.
        """
        clear, patch = CLEAR * self._probe.shape.size, self._patch
        _, normal, distance = patch.nearest(x[:3])
        offset = float(self._probe.offset(normal[None], x[None, 3:])[0])
        away = np.array(x, dtype=float)
        for _ in range(MOST_STEPS):
            # the triangles are straight, the surface that the contact's energy sees may bulge out of them
            overlap = max(offset - clear - distance, self._contact.overlap(away))
            if overlap <= 0:
                return None if self._contact.meets_fixed_part(away, x) else away
            away[:3] += (overlap + clear) * normal
            distance = patch.nearest(away[:3])[2]
        return None

    def distance(self, here: np.ndarray, there: np.ndarray) -> float:
        """Return the length in m of a way between two inputs, its part along the surface counted several times.

        So are turns, by the way of a point at the distance of the tool's size.
        """
        normal = self._patch.nearest(there[:3])[1]
        step, turn = (
            there[:3] - here[:3],
            self._probe.shape.size * float(np.linalg.norm(there[3:] - here[3:])),
        )
        along = float(step @ normal)
        return float(np.hypot(along, SIDEWAYS * np.hypot(np.linalg.norm(step - along * normal), turn)))


_GRID = np.stack(np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 9)), axis=-1).reshape(-1, 2)


def _rim_of(count: int) -> np.ndarray:
    """Return coordinates (m, count) between 0 and 1 of angles in the middle and at the ends of their ranges."""
    if not count:
        return np.zeros((1, 0))
    rim = np.array([[0.0, 0.0], *([1.0, i / 16] for i in range(16))])
    if count == 2:
        return rim
    return np.array([[*tilt, twist] for tilt in rim for twist in np.linspace(0.0, 1.0, 5)])


def _denser(unit: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return places (N, 2) of the unit square, closer together at those sides (2,) that are ends of the body.

    There the body gives way within a few mm, and nothing is known beyond: the density is that of Chebyshev's points.
    """
    both, first, last = (1 - np.cos(np.pi * unit)) / 2, 1 - np.cos(np.pi / 2 * unit), np.sin(np.pi / 2 * unit)
    return np.where(low & high, both, np.where(low, first, np.where(high, last, unit)))


def _is_open(patch: Patch) -> bool:
    """Return whether a surface faces one way in the mean: a dome does, and a hemisphere's mean normal is ½ long."""
    return bool(np.linalg.norm(patch.facing) > OPEN)


def _within(patch: Patch, low: np.ndarray, high: np.ndarray) -> Patch:
    """Return the triangles whose middle is in a box."""
    middle = patch.corners.mean(axis=1)
    inside = ((middle >= low) & (middle <= high)).all(axis=1)
    return Patch(patch.points, patch.triangles[inside] if inside.any() else patch.triangles)


def checked_box(value: Any) -> tuple[Corner, Corner]:
    """Return a box of contact points as two corners of two or three coordinates in m; others are refused."""
    try:
        corners = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        corners = np.empty(0)
    if (
        corners.ndim != 2
        or corners.shape[0] != 2
        or corners.shape[1] not in {2, 3}
        or (corners[0] > corners[1]).any()
    ):
        raise UsageError(
            f"The box of the probe's contact points is {value}.",
            why="It needs a lower and an upper corner, each of two or three coordinates in m.",
            fix="For example over=((0.03, 0.03), (0.07, 0.07)).",
        )
    lower, upper = corners.tolist()
    return tuple(lower), tuple(upper)
