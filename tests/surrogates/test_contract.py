"""The checklist of `surrogate_checks.py` on every baseline and every memory that palpate registers, and their pairs."""

from __future__ import annotations

import dataclasses
import functools
import json

import numpy as np
import pytest
from surrogate_checks import CHECKS, MEMORY_CHECKS, Example
from test_pad_energy import made as pad_energy
from touch_made import (
    BOX,
    DEEPEST,
    RADIUS,
    around_points,
    overlap_baseline,
    plane,
    slab,
    touch_energy,
    undisturbed,
)

import palpate as pp
from models import linear_network
from palpate.errors import UsageError
from palpate.network import Network, Scaling, TrainedRegion
from palpate.network.kinds import registered_kinds
from palpate.surrogates import (
    Compiled,
    ConstantBaseline,
    ContactLaw,
    Continuation,
    LearntEnergy,
    PadBaseline,
    RestStiffness,
    Stiffening,
)
from palpate.surrogates.baselines import (
    PinchBaseline,
    PosedBaseline,
    ToolBaseline,
    deepest_ball,
    registered_baselines,
)
from palpate.surrogates.energy_kernels import entry_of
from palpate.surrogates.memories import Friction, Indentation, IwanElements, Memory, Patches, Relaxation
from palpate.tools import Capsule, Gripper, PosedTool, Sphere

INF = np.inf


@functools.cache
def contact() -> Example:
    """A sphere on a plane; derivatives of its distance jump at the nodes of a table."""
    energy = touch_energy()
    rest = around_points(100)
    rest[:, 2] += 0.03
    return Example(pp.Surrogate(energy), rest, undisturbed(energy, around_points(1500), 1e-4))


@functools.cache
def overlap() -> Example:
    """A sphere over a groove, by its overlap."""
    energy = touch_energy(baseline=overlap_baseline())
    rest = around_points(100)
    rest[:, 2] += 0.03
    return Example(pp.Surrogate(energy), rest, undisturbed(energy, around_points(1500), 1e-4))


@functools.cache
def tool() -> Example:
    """A tilted capsule on a plane, by its place."""
    posed = PosedTool(Capsule(0.006, 0.03), (0.1, 0.05, 0.0))
    radius, way = deepest_ball(posed, np.array([0.0, 0.0, 1.0]))
    # the box is that of a ball of 10 mm
    way = way + np.array([0.0, 0.0, RADIUS - radius])
    moved = [pp.Range(f"tip{r.name[1:]}", r.low - w, r.high - w, "m") for r, w in zip(BOX, way, strict=True)]
    frame = plane().frame - np.concatenate([way, np.zeros(len(plane().frame) - 3)])
    surface = dataclasses.replace(plane(), frame=frame)
    baseline = ToolBaseline(ContactLaw("series", 1e-3), surface, RADIUS, tool=json.dumps(posed.describe()))
    energy = touch_energy(box=moved, baseline=baseline)
    rest = around_points(100) - way
    rest[:, 2] += 0.03
    return Example(pp.Surrogate(energy), rest, undisturbed(energy, around_points(1500) - way, 1e-4))


@functools.cache
def posed() -> Example:
    """A capsule on a plane whose axis is an input."""
    tool = PosedTool(Capsule(0.006, 0.03), (0.0, 0.0, 0.4), turns="axis", tilt=0.3)
    way = np.array([0.0, 0.0, RADIUS - 0.008])  # not so deep that the plane's distance turns back
    moved = [pp.Range(f"tip{r.name[1:]}", r.low - w, r.high - w, "m") for r, w in zip(BOX, way, strict=True)]
    baseline = PosedBaseline(ContactLaw("series", 1e-3), plane(), 0.006, tool=json.dumps(tool.describe()))
    going = Continuation.of(
        [*moved, *tool.angles], deepest=DEEPEST - 0.003
    )  # its end is deeper than its place
    energy = touch_energy(box=moved, extra=tool.angles, baseline=baseline, continuation=going)
    below = np.append(way, np.zeros(2))
    rest = around_points(100, extra=tool.angles) - below
    rest[:, 2] += 0.03
    smooth = undisturbed(energy, around_points(1500, extra=tool.angles) - below, 1e-4)
    places, turns = tool.pose(smooth)
    # nor where one of its balls begins to touch
    heights = places[:, None, 2] + np.einsum("ni,bi->nb", turns[:, 2], baseline.balls[:, :3])
    clear = (np.abs(heights - baseline.balls[:, 3]) > 1e-4).all(axis=1)
    smooth = smooth[clear & (np.abs(places[:, :2]) < 0.025).all(axis=1)]
    return Example(pp.Surrogate(energy), rest, smooth)


@functools.cache
def pinch() -> Example:
    """Two balls that pinch a slab."""
    gripper = Gripper(Sphere(0.005))
    baseline = PinchBaseline(ContactLaw("series", 1e-3), slab(), 0.005, tool=json.dumps(gripper.describe()))
    box = [pp.Range(f"grip_{axis}", -r, r, "m") for axis, r in zip("xyz", (0.002, 0.01, 0.01), strict=True)]
    opening = pp.Range("grip_opening", 0.014, 0.020, "m")
    energy = touch_energy(
        box=box,
        extra=(opening,),
        baseline=baseline,
        continuation=Continuation.of([*box, opening], deepest=0.006),
    )
    X = np.random.default_rng(5).uniform([-0.002, -0.01, -0.01, 0.014], [0.002, 0.01, 0.01, 0.019], (1500, 4))
    ends = np.array([[r.low, r.high] for r in box])
    clear = (np.abs(X[:, :3, None] - ends) > 1e-4).all(axis=(1, 2))
    clear &= (np.abs([s for s, _, _ in baseline.jaw_depths(X)]) > 4e-4).all(axis=0)
    rest = X[:100] + np.array([0.0, 0.0, 0.0, 0.02])
    return Example(pp.Surrogate(energy), rest, X[clear & (baseline.coordinate(X) > 1e-3)])


@functools.cache
def pad() -> Example:
    """A glued pad on a face, displaced in all directions."""
    rest = np.zeros((20, 5))
    rest[:, 3:] = np.random.default_rng(0).uniform(-0.02, 0.02, (20, 2))
    return Example(pp.Surrogate(pad_energy()), rest)


@functools.cache
def node() -> Example:
    """A node that one load moves along a slanted line, stiffer on one side."""
    network = linear_network(
        [pp.Range("w", -0.05, 0.05, "m")], [pp.Quantity("ln U/U0")], np.array([[0.0, 0.4]])
    )
    baseline = PadBaseline(
        RestStiffness.even(np.array([[100.0]]), 0), Stiffening.none(1), np.array([[0.6, -0.8, 0.0]])
    )
    return Example(pp.Surrogate(LearntEnergy(network, baseline, region=_region(1))), np.zeros((1, 1)))


@functools.cache
def constant() -> Example:
    """A node that two loads move, of one unit: ℓ = 1 − exp(−‖ξ‖²), which is at rest in the middle."""
    network = Network(
        (pp.Range("h_x", -0.02, 0.02, "m"), pp.Range("h_y", -0.02, 0.02, "m")),
        (pp.Quantity("ln U/U0"),),
        factors=np.eye(2)[None],
        shifts=np.zeros((1, 2)),
        weights=np.array([[-1.0]]),
        tail=np.array([[1.0, 0.0, 0.0]]),
        scaling=Scaling(np.zeros(2), np.full(2, 0.02), np.zeros(1), np.ones(1)),
    )
    baseline = ConstantBaseline(0.05, np.eye(3)[:2])
    return Example(pp.Surrogate(LearntEnergy(network, baseline, region=_region(2))), np.zeros((1, 2)))


def _region(n: int) -> TrainedRegion:
    return TrainedRegion.of(np.random.default_rng(1).uniform(-1.0, 1.0, (200, n)))


BODIES = (contact, overlap, tool, posed, pinch, pad, node, constant)


def relaxation(q: float) -> Memory:
    """Two branches, on patches of the surface."""
    return Relaxation(
        ((0.3, 0.05), (0.2, 0.4)), patches=Patches(np.diag([0.01, 0.01, 0.0]), 0.004, 0.5 * q * q)
    )


def indentation(q: float) -> Memory:
    """Prints from 0.3 q on, which stiffen."""
    dent, reach = q * np.array([0.0, 0.2, 0.6]), q * np.array([0.3, 0.6, 1.2])
    return Indentation(dent, reach, np.array([1.0, 1.05, 1.1]), np.diag([0.01, 0.01, 0.0]), 0.004)


def iwan_elements(q: float) -> Memory:
    """A spring, a slider from 0.3 q on that hardens, and a dashpot."""
    return IwanElements(
        np.array([0.4, 0.3, 0.3]),
        np.array([INF, 0.3 * q, INF]),
        np.array([0, 0.1, 0]),
        np.array([INF, INF, 0.1]),
    )


def friction(q: float) -> Memory:
    """A dry tool on a body that relaxes."""
    return Friction.over(0.005, 0.3, 0.4, under=relaxation(q))


MEMORIES = (relaxation, indentation, iwan_elements, friction)


def named(function) -> str:
    return function.__name__


def with_memory(body, memory) -> Example:
    """Give the example of a body the example of a memory, to the size of its energy."""
    example = body()
    q = np.sqrt(2.0 * example.body.energy.energy(example.around(400)).max())
    return dataclasses.replace(example, body=example.body.with_memory(memory(float(q))))


def test_each_registered_kind_has_an_example():
    ours = {cls for cls in registered_baselines() if cls.__module__.startswith("palpate.")}
    assert ours == {type(body().body.energy.baseline) for body in BODIES}
    ours = {cls for cls in registered_kinds(Memory).values() if cls.__module__.startswith("palpate.")}
    assert ours == {type(memory(1.0)) for memory in MEMORIES}


@pytest.mark.parametrize("body", BODIES, ids=named)
@pytest.mark.parametrize("check", CHECKS, ids=named)
def test_every_baseline_passes_the_checklist(body, check, tmp_path):
    check(body(), tmp_path)


@pytest.mark.grid
@pytest.mark.parametrize("body", BODIES, ids=named)
@pytest.mark.parametrize("memory", MEMORIES, ids=named)
def test_every_memory_passes_the_checklist_on_every_baseline_or_is_refused(body, memory, tmp_path):
    if body().body.energy.baseline.amplitude not in type(memory(1.0)).walks:
        with pytest.raises(UsageError, match="walks an amplitude"):
            with_memory(body, memory)
        return
    for check in MEMORY_CHECKS:
        check(with_memory(body, memory), tmp_path)


KERNEL = """
from numba import njit

@njit(cache=True)
def kernel(position, parameters, gradient, hessian, args):
    return {} * position[2], position[2]
"""


def test_a_changed_kernel_has_another_place_in_the_cache(tmp_path):
    """Numba looks for what it has compiled by name: with the same one the old kernel would go on answering."""
    names = []
    for factor in (1.0, 2.0, 2.0):
        file = tmp_path / f"{factor}.py"
        file.write_text(KERNEL.format(factor))
        space = {"__name__": "kinds"}
        exec(compile(file.read_text(), str(file), "exec"), space)
        names.append(entry_of(Compiled(space["kernel"], ())).one.__name__)
    assert names[0] != names[1] == names[2]
