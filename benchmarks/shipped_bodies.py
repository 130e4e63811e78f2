"""The learnt bodies that come with palpate, made: ``python -m benchmarks.shipped_bodies breast prostate skin``.

Each is a sweep of a `LumpProblem` of moduli from `palpate.physics.materials.tissues`, some unseen presses that are all
solved with a lump too, and what is learnt of them, judged by the unseen ones. Elements under the finger have half its
radius, those where lumps may be 1.5 to 2 least radii. A body takes a quarter of an hour on an idle core.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import palpate as pp
from palpate.physics.materials.tissues import TISSUES
from palpate.surrogates import Surrogate, TouchedSurface
from palpate.surrogates.shipped_bodies import FOLDER, SHIPPED

PRESSES, UNSEEN = 40, 16
MODES, TABLE = 8, 400_000  # of the drawn shape; numbers in a table of distances that is large
FLOOR = 1e-6  # m: what is above it is no base
DEPTHS = 2  # of each place: what a lump adds changes faster along the surface than with depth


def breast() -> pp.LumpProblem:
    """Return a dome of gland under a fingertip."""
    body = pp.Body(pp.shapes.Dome(radius=0.05, height=0.04, element=0.016), TISSUES["breast"].material)
    finger = pp.SphereProbe(
        radius=0.009, touches="top", depth=(0.001, 0.010), over=((-0.025, -0.025), (0.025, 0.025))
    )
    room = ((-0.022, -0.022, 0.008), (0.022, 0.022, 0.030))
    return pp.LumpProblem(
        body.problem(finger, element=0.0045), room, radius=(0.004, 0.009), element=0.006, compliances=12
    )


def prostate() -> pp.LumpProblem:
    """Return a block of the size of a prostate under a fingertip."""
    body = pp.Body(pp.shapes.Block(size=(0.05, 0.04, 0.03), element=0.010), TISSUES["prostate"].material)
    finger = pp.SphereProbe(
        radius=0.007, touches="top", depth=(0.0005, 0.006), over=((0.010, 0.010), (0.040, 0.030))
    )
    room = ((0.009, 0.009, 0.009), (0.041, 0.031, 0.024))
    return pp.LumpProblem(
        body.problem(finger, element=0.0038), room, radius=(0.003, 0.007), element=0.005, compliances=12
    )


def skin() -> pp.LumpProblem:
    """Return skin over fat and muscle under a fingertip."""
    layers = (("skin", 0.003), ("fat", 0.012), ("muscle", 0.015))
    laws = {name: TISSUES[name].material for name, _ in layers}
    body = pp.Body(pp.shapes.LayeredBlock(extent=(0.06, 0.06), layers=layers, element=0.010), laws)
    finger = pp.SphereProbe(
        radius=0.008, touches="top", depth=(0.0005, 0.006), over=((0.015, 0.015), (0.045, 0.045))
    )
    room = ((0.014, 0.014, 0.010), (0.046, 0.046, 0.022))
    return pp.LumpProblem(
        body.problem(finger, element=0.0043), room, radius=(0.003, 0.006), element=0.006, compliances=12
    )


BODIES: dict[str, Callable[[], pp.LumpProblem]] = {"breast": breast, "prostate": prostate, "skin": skin}


def make(name: str, folder: Path, presses: int = PRESSES, unseen: int = UNSEEN) -> Path:
    """Solve, learn and judge a body; return its file, and keep its presses in a folder."""
    problem = BODIES[name]()
    print(f"{name}: {len(problem.mesh.points)} nodes", flush=True)
    points = problem.design(presses, 1, depths=DEPTHS)
    train = pp.sweep(problem, points=points, workers=1, path=folder / f"{name}.zarr")
    body, history = pp.learn(train, name=name, effort=0.15, log=print)
    print(history, body.lumps, sep="\n", flush=True)
    if unseen:
        judged = replace(problem, solved=1.0)
        points = judged.design(unseen, 2, depths=DEPTHS)
        test = pp.sweep(judged, points=points, workers=1, path=folder / f"{name}-unseen.zarr")
        verdict = pp.validate(body, test)
        print(verdict, flush=True)
        body = replace(body, meta={**body.meta, "validation": verdict.summary()})
    body = small(replace(body, meta={**body.meta, "words": SHIPPED[name]}), train)
    FOLDER.mkdir(exist_ok=True)
    path = body.signed("The palpate developers", "MIT").save(FOLDER / f"{name}.palpate")
    print(f"{path}: {os.path.getsize(path) / 1e3:.0f} kB", flush=True)
    return path


def small(body: Surrogate, data: pp.Dataset) -> Surrogate:
    """Return the body with a coarser table of distances and fewer modes of its shape, so that its file stays small."""
    shown = body.surface_fields["displacement"]
    few = replace(shown, network=shown.network.select(range(MODES)), modes=shown.modes[:MODES])
    body = replace(body, fields={"displacement": few})
    energy = body.hand_energy
    touched, radius = energy.baseline.surface, energy.baseline.radius
    if touched is None or touched.coefficients.size < TABLE:
        return body
    above = data.rest[data.triangles][:, :, 2].mean(axis=1) > FLOOR
    numbers = {name: getattr(touched, name) for name in ("radius", "reach", "inner")}
    coarse = TouchedSurface.of(
        data.rest, data.triangles[above], **numbers, spacing=radius / 4, shoulder=radius / 3
    )
    return body.with_energy(replace(energy, baseline=energy.baseline.with_surface(coarse)))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=list(BODIES), help="which bodies; all by default")
    parser.add_argument(
        "--folder", type=Path, default=Path("shipped-presses"), help="where the presses are kept"
    )
    parser.add_argument("--presses", type=int, default=PRESSES)
    parser.add_argument("--unseen", type=int, default=UNSEEN)
    given = parser.parse_args()
    for each in given.names:
        make(each, given.folder, given.presses, given.unseen)
