"""A ball that comes to rest on a soft block in MuJoCo: on MuJoCo's own flex in many settings, and on a learnt body.

The block is that of `benchmarks.rest_block`. A ball is pushed onto the middle of its top by a weight of 30 g, on a
slide with a damper; only the ball is heavy, as in the finite-element solve.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.rest_block import HEIGHT, MASS, POISSON, RADIUS, SIDE, WEIGHT, YOUNG

__all__ = ["FlexSetting", "Rest", "palpate_rest", "rest_on_flex"]

DAMPER = 2.0  # N s/m, of the slide
_REST = 0.5  # s of the scene: thirty times the time in which the damper lets the ball settle
_PATIENCE = 25.0  # s of the processor for one scene
_GAP = 2e-4  # m between the ball and the block at the beginning
_SKIN = 5e-4  # m, radius of a flex's vertices


@dataclass(frozen=True)
class FlexSetting:
    """One way to set up MuJoCo's flex."""

    mesh: str  # "grid 11x11x6", or "graded 2.5 mm"
    integrator: str = "discrete"
    step: float = 1e-3  # s
    solver: str = "CG"
    damping: float = 0.01  # s, of the elasticity
    passive: bool = False  # contact by a spring instead of a constraint

    def __str__(self) -> str:
        words = [self.mesh, self.integrator, f"{1e3 * self.step:g} ms", self.solver]
        words += ["passive contact"] * self.passive
        return ", ".join(words)


@dataclass(frozen=True)
class Rest:
    """How deep the ball rests, and what that took.

    Attributes
    ----------
    depth : float
        Depth of the ball in the surface at rest, m; not-a-number where it never rested.
    step_seconds : float
        Time of the processor for one step, the median, s.
    slower : float
        Time of the processor over time of the scene.
    """

    depth: float
    step_seconds: float
    slower: float


def _mesh(mesh: str) -> tuple[str, str, int]:
    """Return the attributes of a flex's mesh, its pins, and how many vertices it has."""
    kind, size = mesh.split(" ", 1)
    if kind == "grid":
        n, _, m = (int(v) for v in size.split("x"))
        spacing = f"{SIDE / (n - 1)} {SIDE / (n - 1)} {HEIGHT / (m - 1)}"
        pins = f'gridrange="0 0 0 {n - 1} {n - 1} 0"'
        where = f'type="grid" count="{n} {n} {m}" spacing="{spacing}" pos="0 0 {HEIGHT / 2}"'
        return where, pins, n * n * m
    points, corners = _graded(float(size.split()[0]) * 1e-3)
    low = " ".join(map(str, np.flatnonzero(points[:, 2] < 1e-9)))
    listed = (" ".join(f"{v:.7g}" for v in points.ravel()), " ".join(map(str, corners.ravel())))
    return f'type="direct" point="{listed[0]}" element="{listed[1]}"', f'id="{low}"', len(points)


def _graded(element: float) -> tuple[np.ndarray, np.ndarray]:
    """Return points (N, 3), m, and tetrahedra (M, 4) of a mesh whose elements are so small beneath the ball."""
    import ngsolve
    from netgen.meshing import MeshingParameters
    from netgen.occ import Box, OCCGeometry, Pnt

    settings = MeshingParameters(maxh=0.02, grading=0.5)
    for x in np.linspace(-0.008, 0.008, 7):
        for y in np.linspace(-0.008, 0.008, 7):
            settings.RestrictH(x=x, y=y, z=HEIGHT, h=element)
    box = OCCGeometry(Box(Pnt(-SIDE / 2, -SIDE / 2, 0), Pnt(SIDE / 2, SIDE / 2, HEIGHT)))
    mesh: Any = ngsolve.Mesh(box.GenerateMesh(settings))
    points = np.array([v.point for v in mesh.vertices])
    corners = np.array([[v.nr for v in e.vertices] for e in mesh.Elements()])
    a, b, c, d = points[corners].transpose(1, 0, 2)
    turned = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0.0
    corners[turned] = corners[turned][:, [0, 2, 1, 3]]
    return points, corners


def _scene(*, step: float, integrator: str, solver: str = "Newton", more: str = "") -> str:
    return f"""<mujoco><size memory="1G"/>
    <option timestep="{step}" solver="{solver}" integrator="{integrator}" tolerance="1e-8" gravity="0 0 0"/>
    <worldbody><body name="ball" pos="0 0 {HEIGHT + RADIUS + _SKIN + _GAP}">
    <joint type="slide" axis="0 0 1" damping="{DAMPER}"/>
    <geom name="tool" type="sphere" size="{RADIUS}" mass="{MASS}"/></body>{more}</worldbody></mujoco>"""


def _settle(model: Any, data: Any, height: Callable[[], float]) -> Rest:
    """Step a scene until its ball rests; `height` is that of its lowest point over the surface at rest, m."""
    import mujoco

    data.xfrc_applied[model.body("ball").id, 2] = -WEIGHT
    times: list[float] = []
    heights: list[float] = []
    begin = time.process_time()
    while data.time < _REST and time.process_time() - begin < _PATIENCE:
        start = time.process_time()
        mujoco.mj_step(model, data)
        times.append(time.process_time() - start)
        heights.append(height())
    tail = heights[-max(2, len(heights) // 20) :]
    depth = -heights[-1]
    rests = math.isfinite(depth) and np.ptp(tail) < 1e-3 * abs(depth) and 0.0 < depth < HEIGHT
    median = float(np.median(times))
    return Rest(depth if rests else math.nan, median, median / float(model.opt.timestep))


def rest_on_flex(setting: FlexSetting) -> tuple[Rest, int]:
    """Return how the ball rests on a flex, and how many vertices that has."""
    import mujoco

    mesh, pins, count = _mesh(setting.mesh)
    passive = 'passive="true"' if setting.passive else ""
    flex = f"""<flexcomp name="soft" dim="3" {mesh} mass="0.5" radius="{_SKIN}">
    <elasticity young="{YOUNG}" poisson="{POISSON}" damping="{setting.damping}"/>
    <contact selfcollide="none" {passive}/><pin {pins}/></flexcomp>"""
    model = mujoco.MjModel.from_xml_string(
        _scene(step=setting.step, integrator=setting.integrator, solver=setting.solver, more=flex)
    )
    data = mujoco.MjData(model)
    place = int(model.jnt_qposadr[model.body_jntadr[model.body("ball").id]])
    # the ball first touches the skin of the vertices, which is no part of the block's depth
    return _settle(model, data, lambda: float(data.qpos[place]) + _GAP), count


def palpate_rest(body: Any, step: float = 1e-3) -> Rest:
    """Return how the ball rests on a learnt block, whose frame has a corner of the bottom as its origin."""
    import mujoco

    from palpate.adapters.mujoco import attach

    model = mujoco.MjModel.from_xml_string(_scene(step=step, integrator="implicitfast"))
    data = mujoco.MjData(model)
    attach(model, data, body, geom="tool", at=(-SIDE / 2, -SIDE / 2, 0.0))
    return _settle(model, data, lambda: float(data.qpos[0]) + _GAP + _SKIN)
