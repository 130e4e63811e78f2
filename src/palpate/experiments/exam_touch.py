"""The touch of an examination: presses, how deep each place of the surface was pressed, and the order of search.

All of it follows from the recorded ticks. A ball of radius R at the depth s reaches s − a²/2R deep at the distance a
beside the contact point; the largest of these over the examination is how deep a place was pressed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.devices.trace_file import Trace, read_trace
from palpate.errors import PalpateError
from palpate.units import bounds

if TYPE_CHECKING:
    from palpate.runtime.touchable import Touchable

__all__ = [
    "LEVELS",
    "ExamSurface",
    "ExamTouch",
    "Press",
    "SearchOrder",
    "order_of_search",
    "pressed_depths",
    "read_touch",
    "search_path",
    "typical_force",
]

LEVELS = {"lightly": 0.2, "to the middle": 0.45, "deeply": 0.75}
"""Shares of the deepest trained press from which a place counts as pressed that deep."""
_FINE, _MOST_CUTS = (
    0.25,
    5,
)  # of the probe's radius, the longest edge of a surface; how often its triangles are cut
_CONTACT = 1e-5  # m of depth from which the probe touches
_SHORTEST = 0.05  # s; contacts that are shorter, or gaps between them, are no press and no end of one
_EVERY = 0.02  # s between two places that are looked at for the surface
_STEP = 0.5  # of the probe's radius: two places of the search that are nearer are one
_AGAIN = 5.0  # s after which the return to a place is a return
_LEAST_STEPS = 8  # between places of a search: fewer have no order
_CLEAR = 0.6  # share from which an order has a name


@dataclass(frozen=True, eq=False)
class ExamSurface:
    """The surface of an examined body at rest."""

    points: np.ndarray  # (N, 3) m
    triangles: np.ndarray  # (k, 3) int
    reachable: np.ndarray  # (N,) bool: a hand may press there, and it was trained; all else is nobody's fault
    radius: float  # of the probe, m
    deepest: float  # trained press, m

    @classmethod
    def of(cls, body: Touchable) -> ExamSurface:
        """Return the surface as the page draws it, with finer triangles where a hand may press.

        A point can be pressed where the body was trained for a ball that is half as deep as it may go.
        """
        from palpate.viewer.surface_drawing import SurfaceDrawing

        surface, depth = SurfaceDrawing(body).surface, body.deepest / 2.0
        points = np.asarray(surface.rest, float).reshape(-1, 3)
        triangles = np.asarray(surface.triangles, np.int64).reshape(-1, 3)
        touchable = np.asarray(surface.touchable) > 0
        points, fine = _cut_finely(points, triangles[touchable], _FINE * body.radius)
        reachable = np.zeros(len(points), bool)
        touched = np.unique(fine)
        if body.surface is not None and len(touched):
            distance, slope, _ = body.surface.at(points[touched])
            normals = slope / np.linalg.norm(slope, axis=1, keepdims=True)
            low, high = bounds(body.inputs)
            X = np.tile((low + high) / 2.0, (len(touched), 1))
            X[:, :3] = points[touched] + (body.radius - depth - distance)[:, None] * normals
            reachable[touched] = body.energy.inside(X)
        return cls(points, np.vstack([triangles[~touchable], fine]), reachable, body.radius, body.deepest)

    @cached_property
    def areas(self) -> np.ndarray:
        """A third of the area (N,) of the triangles around each reachable point, m²; 0 of the others."""
        a, b, c = (self.points[self.triangles[:, k]] for k in range(3))
        thirds = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
        areas = np.zeros(len(self.points))
        for k in range(3):
            np.add.at(areas, self.triangles[:, k], thirds)
        return np.where(self.reachable, areas, 0.0)

    @cached_property
    def axes(self) -> np.ndarray:
        """Axes (2, 3) of the map: right, as near to x as the reachable surface lies, and up."""
        a, b, c = (self.points[self.triangles[:, k]] for k in range(3))
        part = self.reachable[self.triangles].all(axis=1)
        normal = np.cross(b - a, c - a)[part].sum(axis=0)
        normal = normal / np.linalg.norm(normal) if normal.any() else np.array([0.0, 0.0, 1.0])
        right = np.eye(3)[0 if abs(normal[0]) < 0.9 else 1]
        right = right - (right @ normal) * normal
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(normal, right)])

    def inner(self, margin: float) -> np.ndarray:
        """Return the indices of the reachable points that lie farther than a margin, m, from any that is not."""
        from scipy.spatial import cKDTree

        reachable = np.flatnonzero(self.reachable)
        others = self.points[~self.reachable]
        if not len(others):
            return reachable
        away, _ = cKDTree(others).query(self.points[reachable])
        return reachable[away > margin]

    def shares(self, depths: np.ndarray) -> dict[str, float]:
        """Return the share of the reachable area that was pressed to each of `LEVELS`, of depths (N,), m."""
        whole = self.areas.sum()
        pressed = {name: self.areas[depths >= level * self.deepest].sum() for name, level in LEVELS.items()}
        return {name: float(area / whole) if whole > 0 else 0.0 for name, area in pressed.items()}


def _cut_finely(points: np.ndarray, triangles: np.ndarray, longest: float) -> tuple[np.ndarray, np.ndarray]:
    """Return points, the old ones first, and triangles cut into four until no edge is longer than `longest`, m."""
    for _ in range(_MOST_CUTS):
        edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
        if not len(edges) or lengths.max() <= longest:
            break
        unique, which = np.unique(edges, axis=0, return_inverse=True)
        middle = len(points) + which.reshape(-1, 3)
        points = np.vstack([points, points[unique].mean(axis=1)])
        (a, b, c), (ab, bc, ca) = triangles.T, middle.T
        triangles = np.concatenate(
            [np.stack(corners, axis=1) for corners in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        )
    return points, triangles


@dataclass(frozen=True)
class Press:
    """One contact of the probe: its begin (s since the examination's), its length (s), where, and what was largest."""

    start: float
    seconds: float
    place: tuple[float, float, float]  # on the surface at rest where it was deepest, m
    depth: float  # m
    force: float  # N


@dataclass(frozen=True, eq=False)
class ExamTouch:
    """The ticks of an examination, its interruptions left out: time (N,) s, place (N, 3) m, depth (N,) m, force (N,) N.

    `notes` tell in words what is missing of the recordings.
    """

    time: np.ndarray
    place: np.ndarray
    depth: np.ndarray
    force: np.ndarray
    notes: tuple[str, ...] = ()

    @property
    def contact(self) -> np.ndarray:
        """True (N,) where the probe touches."""
        return np.asarray(self.depth > _CONTACT)

    @cached_property
    def presses(self) -> tuple[Press, ...]:
        """The contacts, in the order of time."""
        return tuple(self._press(slice(a, b)) for a, b in _stretches(self.time, self.contact))

    def _press(self, ticks: slice) -> Press:
        deepest = ticks.start + int(np.argmax(self.depth[ticks]))
        x, y, z = self.place[deepest].tolist()
        start, end = self.time[ticks][[0, -1]].tolist()
        return Press(
            start, end - start, (x, y, z), float(self.depth[deepest]), float(self.force[ticks].max())
        )

    @property
    def seconds_in_contact(self) -> float:
        """Time in which the probe touched, s."""
        return sum(press.seconds for press in self.presses)

    def path_ticks(self) -> np.ndarray:
        """Return the indices of ticks in contact, one in 20 ms."""
        touching = np.flatnonzero(self.contact)
        if not len(touching):
            return touching
        slots = np.floor(self.time[touching] / _EVERY)
        return np.asarray(touching[np.flatnonzero(np.diff(slots, prepend=-1.0))])


def read_touch(traces: Sequence[Path], body: Touchable) -> ExamTouch:
    """Return the ticks of an examination's recordings, one after the other; one that can't be read becomes a note.

    The places are on the skin of the `body`: a recording tells where the probe's centre was.
    """
    parts, notes, began = [], [], 0.0
    for path in traces:
        try:
            trace = read_trace(path)
        except PalpateError as error:
            notes.append(f"{path.name} can't be read: {error.what}")
            continue
        if len(trace):
            parts.append(_columns(trace, began))
            began = float(parts[-1][0][-1]) + 1e-3
        if trace.lost:
            notes.append(f"{path.name} is without {trace.lost} ticks.")
    if not parts:
        return ExamTouch(np.zeros(0), np.zeros((0, 3)), np.zeros(0), np.zeros(0), tuple(notes))
    time, place, depth, force = (np.concatenate(column) for column in zip(*parts, strict=True))
    touching = depth > _CONTACT
    if body.surface is not None and touching.any():
        distance, slope, _ = body.surface.at(place[touching])
        normal = slope / np.linalg.norm(slope, axis=1, keepdims=True)
        place[touching] -= distance[:, None] * normal
    return ExamTouch(time, place, depth, force, tuple(notes))


def _columns(trace: Trace, began: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    force = np.linalg.norm(trace.ticks["force"], axis=1)
    felt = trace.flag("grabbed") & (
        force > 0.0
    )  # a stop or a fault withholds the force: nothing is felt then
    depth = np.where(felt, trace.ticks["depth"], 0.0).astype(float)
    return began + trace.time, np.array(trace.ticks["contact"]), depth, force


def _stretches(time: np.ndarray, contact: np.ndarray) -> list[tuple[int, int]]:
    """Return the begin and end (exclusive) of each contact, without what is shorter than a moment."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], contact, [False]]).astype(int)))
    joined: list[list[int]] = []
    for a, b in edges.reshape(-1, 2).tolist():
        if joined and time[a] - time[joined[-1][1] - 1] < _SHORTEST:
            joined[-1][1] = b
        else:
            joined.append([a, b])
    return [(a, b) for a, b in joined if time[b - 1] - time[a] >= _SHORTEST]


def pressed_depths(surface: ExamSurface, touch: ExamTouch) -> np.ndarray:
    """Return how deep each point (N,) of a surface was pressed at most, m."""
    from scipy.spatial import cKDTree

    depths = np.zeros(len(surface.points))
    ticks = touch.path_ticks()
    if not len(ticks):
        return depths
    reach = np.sqrt(2.0 * surface.radius * touch.depth[ticks])
    near = cKDTree(surface.points).query_ball_point(touch.place[ticks], reach)
    for tick, points in zip(ticks, near, strict=True):
        away = ((surface.points[points] - touch.place[tick]) ** 2).sum(axis=1)
        depths[points] = np.maximum(depths[points], touch.depth[tick] - away / (2.0 * surface.radius))
    return depths


@dataclass(frozen=True)
class SearchOrder:
    """The order in which a surface was searched, of steps between places half a probe's radius apart or more."""

    parallel: (
        float  # |Σ l e^{2iφ}| / Σ l of steps of length l and direction φ on the map: 1 for parallel strips
    )
    around: float  # share of the way that went around the middle of the places: 1 for circles, 0 for spokes
    again: float  # share of the places within a probe's radius of one visited more than 5 s before
    steps: int

    @property
    def words(self) -> str:
        """The order by its usual name."""
        if self.steps < _LEAST_STEPS:
            return "too few places for an order"
        name = "no recognised order"
        if self.parallel >= _CLEAR:
            name = "strips"
        elif self.around >= _CLEAR:
            name = "circles"
        elif self.around <= 1.0 - _CLEAR:
            name = "spokes"
        return f"{name}; {100 * self.again:.0f} % of the places were returned to"


def search_path(touch: ExamTouch, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the places (k, 3) of a search, m, half a radius apart or more, and the time (k,) of each, s."""
    kept: list[int] = []
    for tick in touch.path_ticks():
        if not kept or np.linalg.norm(touch.place[tick] - touch.place[kept[-1]]) >= _STEP * radius:
            kept.append(int(tick))
    return touch.place[kept].reshape(-1, 3), touch.time[kept]


def order_of_search(surface: ExamSurface, touch: ExamTouch) -> SearchOrder:
    """Return the order in which a surface was searched."""
    places, times = search_path(touch, surface.radius)
    on_map = places @ surface.axes.T
    steps = np.diff(on_map, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    if len(steps) < 1 or not lengths.sum() > 0:
        return SearchOrder(0.0, 0.5, 0.0, max(len(places) - 1, 0))
    angles = np.arctan2(steps[:, 1], steps[:, 0])
    parallel = abs((lengths * np.exp(2j * angles)).sum()) / lengths.sum()
    middle = (on_map.min(axis=0) + on_map.max(axis=0)) / 2.0
    outward = (on_map[1:] + on_map[:-1]) / 2.0 - middle
    turned = angles - np.arctan2(outward[:, 1], outward[:, 0])
    around = (lengths * np.sin(turned) ** 2).sum() / lengths.sum()
    before = times[:, None] - times[None, :] > _AGAIN
    near = np.linalg.norm(places[:, None] - places[None], axis=2) < surface.radius
    return SearchOrder(float(parallel), float(around), float((before & near).any(axis=1).mean()), len(steps))


def typical_force(touch: ExamTouch) -> tuple[float, float, float]:
    """Return the tenth, half and nine tenths of the presses' largest forces, N; not-a-number without a press."""
    forces = [press.force for press in touch.presses]
    if not forces:
        return math.nan, math.nan, math.nan
    low, middle, high = np.quantile(forces, [0.1, 0.5, 0.9]).tolist()
    return low, middle, high
