"""A slab that is pressed anywhere on its top: energy in closed form (`tests/pressed.py`), fields made by formula."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np

import pressed
from models import linear_network
from palpate.dataset.carried_surface import CarriedSurface, quadratic_triangles, quarter_triangles
from palpate.learning.learn_arm import ARM_OUTPUTS
from palpate.surrogates import (
    ContactBaseline,
    ContactLaw,
    Continuation,
    FieldSurrogate,
    LearntEnergy,
    LearntQuantities,
    Surrogate,
    TouchedSurface,
)
from palpate.surrogates.baselines import PinchBaseline, PosedBaseline, ToolBaseline, deepest_ball
from palpate.surrogates.fields import DepthAmplitude, LocalMode, Variation
from palpate.surrogates.fields.local_mode import design
from palpate.surrogates.learnt_torque import ARM
from palpate.surrogates.memories import Indentation, Relaxation
from palpate.tools import Capsule, Gripper, PosedTool
from palpate.units import Quantity, Range

HALF, HIGH = 0.03, 0.02  # m: 60 × 60 × 20 mm
DEVIATION = 0.03


def box(cells: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of the slab's surface, its top z = 0."""
    faces = []
    t = np.linspace(-1.0, 1.0, cells + 1)
    a, b = (x.ravel() for x in np.meshgrid(t, t, indexing="ij"))
    k = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    two = np.vstack([np.stack([k, k + cells + 1, k + cells + 2], 1), np.stack([k, k + cells + 2, k + 1], 1)])
    for axis in range(3):
        for sign in (1.0, -1.0):
            p = np.empty((a.size, 3))
            p[:, axis], p[:, (axis + 1) % 3], p[:, (axis + 2) % 3] = sign, a, b
            faces.append((p, two if sign > 0 else two[:, ::-1]))
    points = np.vstack([p for p, _ in faces]) * [HALF, HALF, HIGH / 2] - [0.0, 0.0, HIGH / 2]
    triangles = np.vstack([tri + i * a.size for i, (_, tri) in enumerate(faces)])
    points, which = np.unique(points.round(9), axis=0, return_inverse=True)
    return points, which.reshape(-1)[triangles]


def touched_slab(**more: object) -> Surrogate:
    """The slab with its displacement, and a stretch that is a scalar."""
    body = pressed.surrogate(root=pressed.steady(DEVIATION), **more)
    fields = {"displacement": _field(body.energy, 3), "largest stretch": _field(body.energy, 1)}
    return replace(body, fields=fields)


def carried_slab() -> Surrogate:
    """The slab on coarse triangles of six nodes, which carry a fine surface of its own."""
    body, (points, triangles) = touched_slab(), box(8)
    edges, cells = quadratic_triangles(triangles, len(points))
    nodes = np.concatenate([points, points[edges].mean(axis=1)])
    own = CarriedSurface.bind(*box(30), nodes, cells)
    shown = {"displacement": 3, "largest stretch": 1}
    fields = {
        name: _field(body.energy, k, (nodes, quarter_triangles(cells)), own) for name, k in shown.items()
    }
    return replace(body, fields=fields)


def _field(
    energy,
    components: int,
    mesh: tuple[np.ndarray, np.ndarray] | None = None,
    drawn: CarriedSurface | None = None,
) -> FieldSurrogate:
    points, triangles = box() if mesh is None else mesh
    nodes = len(points)
    mass = np.full(nodes, 1.0 / nodes)
    # the middle sinks, the sides bulge; nothing moves at the bottom
    deep = 1.0 + points[:, 2] / HIGH
    wide = np.exp(-(points[:, 0] ** 2 + points[:, 1] ** 2) / 0.03**2)
    shapes = [np.zeros((nodes, components)), np.zeros((nodes, components))]
    shapes[0][:, -1] = deep * wide
    shapes[1][:, 0] = deep * points[:, 0] / HALF if components == 3 else deep * np.cos(60.0 * points[:, 0])
    flat = np.linalg.qr(np.stack([s.ravel() for s in shapes], axis=1))[0]
    modes = (flat.T / np.sqrt(mass[0])).reshape(2, nodes, components)
    size = 4e-4 if components == 3 else 0.02
    tail = size * np.array([[-1.0, 0.2, 0.0, 0.3], [0.5, 0.3, 0.1, 0.0]])
    net = linear_network(list(pressed.INPUTS), [Quantity("b0"), Quantity("b1")], tail)
    return FieldSurrogate(
        "displacement" if components == 3 else "largest stretch",
        "m" if components == 3 else "",
        net,
        modes,
        np.zeros((nodes, 3)) if components == 3 else np.ones((nodes, 1)),
        points,
        triangles,
        mass,
        amplitude=DepthAmplitude("linear", pressed.DEEPEST),
        surface=energy.baseline.surface,
        radius=pressed.RADIUS,
        local_mode=LocalMode(_table(components), 0.03, 1e-4, _variation(components)),
        drawn=drawn,
    )


def _table(components: int) -> np.ndarray:
    """Splines of a dent exp(−ρ²/w²), as deep as the probe, a little narrower when it is deep."""
    rho, r, q = np.linspace(0.0, 0.999, 200), 14, 6
    A = design(rho * (r - 3), r)
    table = np.zeros((2 if components == 3 else 1, r, q))
    for j in range(q):
        dent = np.exp(-((rho * 0.03 / (0.010 - 0.0003 * j)) ** 2))
        scale = -0.85 * pressed.DEEPEST if components == 3 else 0.25
        table[0, :-3, j] = scale * np.linalg.lstsq(A[:, :-3], dent, rcond=None)[0]
    if components == 3:
        table[1, :-3] = -0.1 * pressed.DEEPEST * table[0, :-3] / scale  # drawn in a little
    return table


def _variation(components: int) -> Variation:
    """Towards one side it leans a little, the more so the deeper."""
    powers = np.array([(0, 0), (1, 0), (0, 1)])
    table = np.zeros((4, 3, 14, 4, components))
    table[1:, 1, :-3, 1, -1] = 0.02 * pressed.DEEPEST if components == 3 else 0.02
    return Variation(table, powers, np.eye(3)[:2], np.array([[0.0, 0.0], [HALF, HALF]]))


def dents(width: float) -> Indentation:
    """It yields from 1 mm on; pressed to 4 mm in the middle, a quarter of the amplitude stays."""
    first, whole = (np.sqrt(2 * pressed.A * depth**3) for depth in (0.001, 0.004))
    tables = np.array([0.0, 0.25 * whole]), np.array([first, whole]), np.array([1.0, 1.1])
    return Indentation(*tables, np.zeros((1, 3)), width)


def family() -> Surrogate:
    """The slab's energy, e times stiffer at one end of a further input than at the other; it relaxes to 60 %."""
    inputs = (*pressed.INPUTS, Range("firmness", 0.5, 2.0, ""))
    tail = np.array([[np.log(pressed.A), pressed.B * 0.02, 0.0, 0.0, 0.5]])
    energy = LearntEnergy(
        linear_network(list(inputs), [Quantity("ln U/U0")], tail),
        ContactBaseline(ContactLaw("pad"), pressed.face(), pressed.RADIUS),
        continuation=Continuation.of(inputs, deepest=pressed.DEEPEST),
    )
    return Surrogate(energy, memory=Relaxation(((0.4, 0.05),)), meta={"name": "family"})


TILT = 0.35  # rad, to which the tool of `slab_under_a_tool` tilts


def slab_under_a_tool() -> Surrogate:
    """The slab under a capsule that lies along x and tilts about x and y, with its displacement."""
    tool = PosedTool(Capsule(0.004, 0.02), turns="axis", tilt=TILT)
    described = json.dumps(tool.describe(), sort_keys=True)
    baseline = PosedBaseline(ContactLaw("pad"), pressed.face(), tool.shape.size, tool=described)
    return _under(baseline, tool, tool=described)


def slab_under_a_still_tool() -> Surrogate:
    """The slab under a capsule that is turned by 0.1 rad about y and stays so, with its displacement and its torque."""
    tool = PosedTool(Capsule(0.004, 0.02), (0.0, 0.1, 0.0))
    radius, way = deepest_ball(tool, np.array([0.0, 0.0, 1.0]))
    points, triangles = pressed.CORNERS
    moved = TouchedSurface.of(points - way, triangles, radius=radius, spacing=0.001)
    baseline = ToolBaseline(
        ContactLaw("pad"), moved, radius, tool=json.dumps(tool.describe(), sort_keys=True)
    )
    body = _under(baseline, tool, shift=tuple(way.tolist()))
    slopes = 1e-4 * np.array([[3.0, 1, 4, 2], [-20.0, 1, 5, 9], [2.0, 6, 5, 3]])
    arm = linear_network(list(body.energy.inputs), list(ARM_OUTPUTS), slopes)
    return replace(body, quantities={ARM: LearntQuantities(arm)})


def _under(baseline: ToolBaseline, posed: PosedTool, **more: object) -> Surrogate:
    places = [replace(r, name=f"tip{r.name[1:]}") for r in pressed.INPUTS[:2]]
    inputs = (*places, Range("tip_z", -pressed.DEEPEST, 0.004, "m"), *posed.angles)
    tail = np.append(np.log(pressed.A), np.zeros(len(inputs)))[None]
    energy = LearntEnergy(
        linear_network(list(inputs), [Quantity("ln U/U0")], tail),
        baseline,
        continuation=Continuation.of(inputs, deepest=pressed.DEEPEST),
    )
    plain = _field(pressed.surrogate().hand_energy, 3)
    growth = np.hstack([plain.network.tail, np.zeros((2, len(posed.angles)))])
    shown = replace(
        plain,
        network=linear_network(list(inputs), [Quantity("b0"), Quantity("b1")], growth),
        surface=baseline.touched,
        radius=baseline.probe_radius,
        local_mode=replace(plain.local_mode, variation=None),
        continuation=None,
        **more,
    )
    return Surrogate(energy, fields={"displacement": shown}, meta={"name": "slab"})


def pinched_slab(widest: float = 0.059) -> Surrogate:
    """The slab between two capsules that lie along y and close along x, with its displacement; `widest` is in m."""
    described = json.dumps(Gripper(Capsule(0.005, 0.02)).describe(), sort_keys=True)
    points, triangles = box(1)
    sides = np.abs(np.ptp(points[triangles][..., 0], axis=1)) < 1e-9
    touched = TouchedSurface.of(points, triangles[sides], radius=0.005, spacing=0.0015)
    ways = {"grip_x": (-0.002, 0.002), "grip_y": (-0.006, 0.006), "grip_z": (-0.014, -0.006)}
    inputs = tuple(
        Range(name, *ends, "m") for name, ends in {**ways, "grip_opening": (0.052, widest)}.items()
    )
    energy = LearntEnergy(
        linear_network(
            list(inputs), [Quantity("ln U/U0")], np.array([[np.log(pressed.A), 0.1, 0.0, 0.0, 0.0]])
        ),
        PinchBaseline(ContactLaw("pad"), touched, 0.005, tool=described),
        continuation=Continuation.of(inputs, deepest=0.005),
    )
    plain = _field(pressed.surrogate().hand_energy, 3)
    shown = replace(
        plain,
        network=linear_network(
            list(inputs), [Quantity("b0"), Quantity("b1")], np.hstack([plain.network.tail, np.zeros((2, 1))])
        ),
        surface=touched,
        radius=0.005,
        tool=described,
        local_mode=None,
        continuation=None,
    )
    return Surrogate(energy, fields={"displacement": shown}, meta={"name": "slab"})
