"""A dataset of a body pressed by a probe: the probe, the touched surface, the body's symmetry, energies and fields."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from palpate.dataset import Dataset, Layout
from palpate.dataset.carried_surface import (
    CarriedSurface,
    has_middles,
    quarter_triangles,
    surface_nodes,
    surface_values,
)
from palpate.errors import UsageError
from palpate.format import count
from palpate.learning.dataset_symmetry import declared_symmetry, widen_ranges
from palpate.learning.fields import LearntField, Snapshots, learn_snapshots, lumped_mass
from palpate.learning.kept_surface import touched_overlap, touched_surface
from palpate.learning.learn_arm import learn_arm
from palpate.learning.painted_region import DEVIATION, PaintedRegion, painted_region
from palpate.learning.recognised import Recognised, Request, recogniser
from palpate.options import FieldOptions
from palpate.surrogates import Baseline, ContactBaseline, ContactLaw, LearntEnergy, Solves, TouchedSurface
from palpate.surrogates.baselines import (
    OverlapBaseline,
    PinchBaseline,
    PosedBaseline,
    ToolBaseline,
    deepest_ball,
    depth_series,
)
from palpate.surrogates.learnt_torque import ARM
from palpate.tools import Gripper, PosedTool, Sphere
from palpate.units import Range

__all__ = ["FEWEST", "PressedSolves", "is_pressed", "recognise_pressed"]

FEWEST = 6  # solves in contact: what the law and an affine network have to be found from, and judged by
UPRIGHT = ("x_min", "x_max", "y_min", "y_max")  # what "side" of a box means
AND = " + "  # between surfaces that are touched together
PROBES = ("SphereProbe",)
TOOL, PINCH = "SurfaceTool", "Pinch"
RADIUS = "probe.radius"  # what a family calls it
PLANE = 1e-9  # by how much the mean normal of a plane surface may fall short of one
DISSIPATING = ("Plastic",)
# of the radius: how the touched surface rolls off where it ends, as smooth in the middle as at its border
SHOULDER = 1 / 3
# of the overlap: from Hertz's rule on smooth curved surfaces to all of it
WEIGHTS = (0.5, 0.75, 1.0)
# shapes to learn a field from. A dome has 16 images of each solve: of 80, 400 shapes leave the largest error of unseen
# ones at 0.35 mm, 800 at 0.20 and all at 0.17, learnt in 1, 1½ and 3 minutes
MOST = 800


def is_pressed(data: Dataset) -> bool:
    """Return whether a dataset is of a body pressed by a probe, by what its provenance says."""
    return _probe(data) is not None


def _probe(data: Dataset) -> Mapping[str, Any] | None:
    acting = data.provenance.get("problem", {}).get("interactions", [])
    probes = [a for a in acting if isinstance(a, Mapping) and a.get("type") in (*PROBES, TOOL, PINCH)]
    return probes[0] if len(probes) == len(acting) == 1 else None


@recogniser
def recognise_pressed(data: Dataset, request: Request) -> Recognised | None:
    """Return the body of solves under one probe; None of any other dataset."""
    if not is_pressed(data):
        return None
    pressed = PressedSolves.of(data, request.layout)

    def learn_field(field: FieldOptions) -> LearntField:
        return learn_snapshots(
            pressed.snapshots(field.name, seed=request.search.seed),
            inputs=pressed.inputs,
            points=pressed.points,
            triangles=pressed.triangles,
            mass=lumped_mass(pressed.points, pressed.triangles),
            surface=pressed.surface,
            radius=pressed.radius,
            radius_input=pressed.radius_input,
            # a part that travels with one contact does not tell of two
            options=replace(field, moving=field.moving and not pressed.pinched),
            drawn=pressed.drawn,
            shift=pressed.shift,
            tool=pressed.tool if pressed.posed else None,
        )

    own, options = request.split("law", "length", "deviation")
    baseline, law, length = pressed.baseline, own.get("law", "auto"), own.get("length")
    if isinstance(law, ContactLaw):
        baseline, options["choose"] = replace(baseline, law=law), False
    elif length is not None:
        baseline = replace(baseline, law=ContactLaw("series", length))
    region = partial(pressed.painted_region, deviation=own.get("deviation"))
    deepest = {"deepest": pressed.deepest or None}
    # a law that was asked for is taken as it is
    rivals = None if options.get("choose") is False else pressed.overlap_baselines
    learn = partial(learn_arm, pressed.data, pressed.inputs, matrices=pressed.matrices, about=pressed.about)
    # turns tell the torque; that of two jaws is not in proportion to the force on both together
    tells = pressed.tool is None or pressed.angles > 0 or pressed.pinched
    numbers = {} if tells else {ARM: learn}
    return Recognised(
        baseline,
        pressed.solves,
        deepest | options,
        learn_field,
        rivals=rivals,
        region=region,
        numbers=numbers,
    )


@dataclass(frozen=True, eq=False)
class PressedSolves:
    """Solves of a body under a probe, and what is known of them."""

    data: Dataset  # converged rows
    radius: float  # of the probe, m; where it is an input, the middle of its range
    radius_input: int | None  # the input that it is
    inputs: tuple[Range, ...]  # those of the data, widened to all mirror images
    surface: TouchedSurface  # that the probe touches
    # (P, 3), m, of the body's whole surface, of a mesh that is fine wherever it is touched
    points: np.ndarray
    triangles: np.ndarray  # (t, 3)
    matrices: np.ndarray  # (k, 3, 3), the body's symmetry, the identity among it
    about: np.ndarray  # (3,), the point that stays, m
    # depth at which a contact is as wide as an element, m; None for elements of the usual size
    resolved: float | None
    deepest: float  # depth that the solves were made to, m; 0 where the provenance does not tell
    skin: tuple[np.ndarray, np.ndarray]  # points (P, 3) in m and triangles (t, 3) of which `surface` is made
    # corners (t, 3, 3) of the triangles of the surface that was to be pressed all over, and of all others, m; None
    # where the presses keep a margin
    painted: tuple[np.ndarray, np.ndarray] | None = None
    drawn: CarriedSurface | None = (
        None  # the body's own surface, of a file; its triangles are then in four parts
    )
    tool: str | None = None  # description of a tool as JSON; None of a sphere
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)  # way from the place to the ball's centre, m
    posed: bool = False  # whether which of the tool's points is the deepest depends on the inputs
    angles: int = 0  # inputs after the place that are components of a rotation vector
    pinched: bool = False  # whether the tool is two jaws, whose opening is the input after the place

    @classmethod
    def of(cls, data: Dataset, layout: Layout | None = None) -> PressedSolves:
        """Return the solves of a sweep.

        A `layout` is of a mesh that is fine wherever the body shall be touched, where the sweep's is fine in a part
        only.
        """
        probe = _checked_probe(data)
        data = data.ok
        if len(data) < FEWEST:
            raise UsageError(
                f"{count(len(data), 'converged solve')}: too few to learn a touched body from.",
                fix=f"Sweep at least {FEWEST}, better 40 or more.",
            )
        rim = probe.get("rim")
        rest, triangles, touched, met = _surface(data, layout, str(probe["touches"]), rim)
        points, own = surface_nodes(rest, triangles, has_middles(data))
        drawn = None
        if has_middles(data):
            shown = data["drawn_points"], data["drawn_triangles"]
            drawn = CarriedSurface.bind(*shown, points, own)
        which, tool = _radius_input(data), _tool(probe, data.ranges)
        radius, shift, posed = _ball(probe, tool, rest[triangles[touched]])
        largest = radius if which is None else data.ranges[which].high
        radius = radius if which is None else (data.ranges[which].low + largest) / 2
        matrices, about = declared_symmetry(data)
        angles = len(tool.angles) if isinstance(tool, PosedTool) else 0
        element = data.provenance["problem"].get("element")
        return cls(
            data,
            radius,
            which,
            _widened(data.ranges, matrices, about, angles),
            touched_surface(
                data,
                rest - shift,
                triangles[met],
                radius=largest,
                inner=_inner(_deepest(probe), largest),
                shoulder=SHOULDER * radius,
            ),
            points,
            own if drawn is None else quarter_triangles(own),
            matrices,
            about,
            None if element is None else float(element) ** 2 / (2 * radius),
            _deepest(probe),
            (rest, triangles[met]),
            None if rim is None else (rest[triangles[touched]], rest[triangles[~touched]]),
            drawn,
            None if tool is None else json.dumps(tool.describe(), sort_keys=True),
            (float(shift[0]), float(shift[1]), float(shift[2])),
            posed,
            angles,
            isinstance(tool, Gripper),
        )

    @property
    def baseline(self) -> ContactBaseline:
        """The contact baseline to begin with: pad on body, crossing at a tenth of the radius."""
        law = ContactLaw("series", self.radius / 10.0)
        parts = law, self.surface, self.radius, self.radius_input, self.resolved
        if self.tool is None:
            return ContactBaseline(*parts)
        kind = PinchBaseline if self.pinched else PosedBaseline if self.posed else ToolBaseline
        return kind(*parts, self.tool)

    def overlap_baselines(self) -> list[Baseline]:
        """Return the baselines by the ball's overlap; none over a flat surface, or where the radius is an input."""
        if self.radius_input is not None or self.tool is not None:
            return []
        # elements of a surface's file are straight, and keep their middles beside it; a ball feels their flat faces
        straight = has_middles(self.data)
        overlap, own = touched_overlap(self.data, self.surface, *self.skin, straight=straight), self.baseline
        if overlap is None:
            return []
        parts = own.law, own.touched, own.probe_radius, None, own.resolved
        return [OverlapBaseline(*parts, overlap.change(weight), weight) for weight in WEIGHTS]

    @property
    def solves(self) -> Solves:
        """Inputs, energies, forces and stiffnesses as learning takes them."""
        data = self.data
        felt = 3 + self.angles + self.pinched
        K = data.response_gradient[:, :felt, :felt] if "response_gradient" in data else None
        symmetry = self.matrices if len(self.matrices) > 1 else np.zeros((0, 3, 3))
        return Solves(
            data.X,
            data.potential_energy,
            data.response,
            K,
            self.inputs,
            symmetry,
            self.about,
            angles=self.angles,
        )

    @property
    def depth_series(self) -> np.ndarray:
        """Number (N,) of each solve's depth series, whatever its further inputs are."""
        if self.pinched:
            return self.baseline.groups(self.data.X)
        return depth_series(self.data.X[:, :3], self.surface, self.radius)

    def painted_region(self, energy: LearntEnergy, deviation: float | None) -> PaintedRegion | None:
        """Return the trained region of an energy of these solves by what was painted, None where nothing says that.

        `deviation` is the largest relative deviation of the force that counts as trained, by default 7 %. A region of
        mirror images, or of further inputs than the place, is that around the solves.
        """
        if self.painted is None or len(self.matrices) > 1 or len(self.inputs) > 3 or energy.root is None:
            return None
        return painted_region(
            energy,
            *self.painted,
            radius=self.radius,
            deepest=self.deepest,
            deviation=deviation or DEVIATION,
        )

    def snapshots(self, name: str, *, seed: int = 0, most: int = MOST) -> list[Snapshots]:
        """Return a field of all solves as they are and at their mirror images, each on its own nodes.

        u(M c)(M X) = M u(c)(X): vectors turn with the body, numbers stay the same. Of more than `most` shapes whole
        depth series are drawn at random, which the seed decides.
        """
        data, series = self.data, self.depth_series
        points, own = surface_nodes(data.rest, data.triangles, self.drawn is not None)
        triangles = own if self.drawn is None else quarter_triangles(own)
        mass = lumped_mass(points, triangles)
        solved = surface_values(data, name, self.drawn is not None)
        images = []
        for matrix, some in zip(self.matrices, _drawn(series, len(self.matrices), most, seed), strict=True):
            rows = np.flatnonzero(np.isin(series, some))
            if not rows.size:
                continue
            X, values = data.X[rows].copy(), solved[rows]
            X[:, :3] = self.about + (X[:, :3] - self.about) @ matrix.T
            turned = slice(3, 3 + self.angles)
            X[:, turned] = X[:, turned] @ (np.linalg.det(matrix) * matrix[: self.angles, : self.angles]).T
            values = values @ matrix.T if values.shape[2] == 3 else values
            places = self.about + (points - self.about) @ matrix.T
            # seen in a mirror, a triangle runs round the other way
            around = triangles if np.linalg.det(matrix) > 0 else triangles[:, ::-1]
            images.append(Snapshots(X, values, series[rows], places, mass, around))
        return images


def _ball(
    probe: Mapping[str, Any], tool: PosedTool | Gripper | None, corners: np.ndarray
) -> tuple[float, np.ndarray, bool]:
    """Return the radius in m of the ball whose depth counts, and the way (3,) in m from the place to its centre.

    Of a tool of which no one point is the deepest at all inputs: the largest of two lengths that its size tells, no
    way, and True. `corners` (t, 3, 3) are those of the touched triangles in m.
    """
    if tool is None:
        return float(probe["radius"]), np.zeros(3), False
    if isinstance(tool, Gripper):
        return max(tool.jaw.size, tool.far_jaw.size), np.zeros(3), True
    a, b, c = np.moveaxis(corners, 1, 0)
    areas = np.cross(b - a, c - a)
    normal = areas.sum(axis=0) / np.linalg.norm(areas, axis=1).sum()
    if isinstance(tool.shape, Sphere):  # whichever way it is pressed
        normal = np.array([0.0, 0.0, 1.0])
    if tool.turns == "fixed" and np.linalg.norm(normal) > 1 - PLANE:
        return *deepest_ball(tool, normal), False
    return tool.shape.size, np.zeros(3), True


def _tool(probe: Mapping[str, Any], ranges: tuple[Range, ...]) -> PosedTool | Gripper | None:
    """Return the tool or the gripper of a record, the latter with its trained openings; None of a ball."""
    if probe["type"] == PINCH:
        return replace(Gripper.of(probe), trained=(ranges[3].low, ranges[3].high))
    return PosedTool.of(probe) if probe["type"] == TOOL else None


def _widened(
    ranges: tuple[Range, ...], matrices: np.ndarray, about: np.ndarray, angles: int
) -> tuple[Range, ...]:
    """Return the ranges of all mirror images, of the place and of so many angles after it."""
    turns = np.linalg.det(matrices)[:, None, None] * matrices[:, :angles, :angles]
    end = 3 + angles
    turned = widen_ranges(ranges[3:end], turns, np.zeros(angles)) if angles else ()
    return (*widen_ranges(ranges[:3], matrices, about), *turned, *ranges[end:])


def _deepest(probe: Mapping[str, Any]) -> float:
    return float(max(probe.get("depth") or (0.0,)))


def _inner(deepest: float, radius: float) -> float:
    """Return the depth in m at which the distance ends: the probe's centre is twice as deep there as trained."""
    return max(1.5 * radius, 2.0 * deepest - radius)


def _radius_input(data: Dataset) -> int | None:
    """Which input is the probe's radius, by what the provenance says of a family's."""
    varied = [one["path"] for one in data.provenance["problem"].get("varied", ())]
    return 3 + varied.index(RADIUS) if RADIUS in varied else None


def _checked_probe(data: Dataset) -> Mapping[str, Any]:
    probe = _probe(data)
    if probe is None:
        raise UsageError(
            "This dataset is not of a body under one probe.",
            why="Its provenance names no single SphereProbe or SurfaceTool.",
            fix="Pass what `palpate.sweep(body, probe, …)` returns; for other arrays use `palpate.fit`.",
        )
    for name in ("potential_energy", "response", "displacement"):
        if name not in data:
            raise UsageError(
                f"The dataset has no {name.replace('_', ' ')}.",
                why="A touched body is learnt from energies, forces and displacements.",
                fix="Sweep the body again with this version.",
            )
    body = data.provenance["problem"].get("body", {})
    if body.get("held") or any(body.get("gravity", ())):
        raise UsageError(
            "A touched body under constant loads can't be learnt yet.",
            why="Depth is measured to the surface at rest, which gravity and pre-stress have moved.",
            fix="Leave gravity and held interactions out.",
        )
    for region, material in body.get("material", {}).items():
        if material.get("type") in DISSIPATING:
            raise UsageError(
                f"The material of {region!r} yields, so its force has no energy.",
                fix="Take an elastic or viscoelastic one.",
            )
    return probe


def _surface(
    data: Dataset, layout: Layout | None, touches: str, rim: str | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the nodes, all triangles (t, 3), and which of these are touched and which the probe meets at all."""
    if layout is None:
        rest, triangles = data.rest, data.triangles
        surfaces, of = data["surface"].tolist(), data["surface_of"]
    else:
        assert layout.triangles is not None
        assert layout.surface_of is not None
        rest, triangles, of = layout.rest, layout.triangles, layout.surface_of
        surfaces = list(layout.surfaces)

    def on(name: str) -> np.ndarray:
        parts = [name] if name in surfaces else name.split(AND)
        names = [
            own for part in parts for own in (UPRIGHT if part == "side" and part not in surfaces else (part,))
        ]
        mine = np.isin(of, [i for i, one in enumerate(surfaces) if one in names])
        if not mine.any():
            raise UsageError(
                f"The mesh has no surface called {name!r}.", why=f"It has {', '.join(map(str, surfaces))}."
            )
        return np.asarray(mine)

    touched = on(touches)
    return rest, triangles, touched, touched if rim is None else touched | on(rim)


def _drawn(series: np.ndarray, images: int, most: int, seed: int) -> list[np.ndarray]:
    """Return for each isometry the depth series that are imaged: all, or so many that some `most` solves come out."""
    all_series = np.unique(series)
    share = min(1.0, most / (images * len(series)))
    if share == 1.0:
        return [all_series] * images
    random = np.random.default_rng(seed)
    pairs = random.permutation([(image, column) for image in range(images) for column in all_series])
    some = pairs[: max(round(share * len(pairs)), 1)]
    missing = np.setdiff1d(all_series, some[:, 1])  # each series at least once
    if missing.size:
        some = np.concatenate([some, [(int(random.integers(images)), column) for column in missing]])
    return [np.unique(some[some[:, 0] == image, 1]) for image in range(images)]
