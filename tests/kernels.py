"""Compiles the kernels that tests use into Numba's cache, in two processes, before the workers begin.

Two workers would else compile the same kernels beside each other: a minute and a half of each. Bodies by formula call
what bodies of every kind call; a kernel that is missing here is compiled where a test first calls it.

    python tests/kernels.py networks        in this process
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import numpy as np

POINTS = 4  # rows of a batch


def compile_all() -> str:
    """Compile both halves side by side and say how long that took; what a half can not compile is left to the tests."""
    began = time.monotonic()
    halves = [
        subprocess.Popen(
            [sys.executable, __file__, name], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        for name in HALVES
    ]
    complaints = [half.communicate()[1] for half in halves]
    failed = [complaint for half, complaint in zip(halves, complaints, strict=True) if half.returncode]
    return "\n".join([f"kernels compiled or found in the cache: {time.monotonic() - began:.0f} s", *failed])


def networks() -> None:
    """Networks of every radial function in both precisions, then bodies that are held and moved by loads."""
    import bent
    import exported_bodies
    from models import spring_beam
    from palpate.runtime.blending import compile_blend
    from palpate.runtime.timing_test import measure_timing

    for kind in ("gaussian", "inverse-multiquadric", "matern-5/2"):
        inputs = exported_bodies.body("pad").inputs[:3]
        _ask_network(exported_bodies.random_network(inputs, 3, kind))
    for network in exported_bodies.networks():
        _ask_network(network)
    for name in ("pad", "constant", "iwan"):
        _ask_body(exported_bodies.body(name))
    for body in (spring_beam(), bent.body(), bent.body(bent.CREEPS)):
        _feel(body)
    _follow_streams()
    measure_timing(0.01)
    compile_blend()


def surfaces() -> None:
    """Surfaces, fields and memories, then bodies that a probe presses."""
    import exported_bodies
    from pressed import surrogate

    for name in ("contact", "relaxation", "indentation", "closed"):
        _ask_body(exported_bodies.body(name))
    _ask_body(surrogate())


def _ask_network(network) -> None:
    low, high = np.array([[r.low, r.high] for r in network.inputs]).T
    X = low + np.random.default_rng(0).uniform(size=(POINTS, len(low))) * (high - low)
    for precision in ("double", "single"):
        network.predict(X, precision=precision)
        network.evaluator(precision=precision, jacobian=True)(X[0])
        network.evaluator(precision=precision)(X[0])
    network.jacobian(X[0])
    if len(network.outputs) == 1:
        network.hessian(X[0])


def _ask_body(body) -> None:
    low, high = np.array([[r.low, r.high] for r in body.inputs]).T
    X = low + np.random.default_rng(0).uniform(size=(POINTS, len(low))) * (high - low)
    energy = body.energy
    for answer in (energy.energy, energy.force, energy.stiffness, energy.depth, energy.inside):
        answer(X)
    if energy.root is not None:
        energy.deviation(X)
        energy.force_covariance(X)
    if body.memory is not None:
        body.follow(X, np.arange(float(POINTS)) / 100)
    place, parameters = _feel(body)
    for field in body.fields.values():
        field.values(X)
        for precision in ("double", "single"):
            shown = field.evaluator(precision=precision)
            shown(place, parameters)
            _ = shown.field, shown.profile


def _feel(body) -> tuple[np.ndarray, np.ndarray]:
    """A hand's tick; the place and parameters that were asked for."""
    from palpate.runtime.touchable import touchable

    model = touchable(body)
    answer, parameters = model.evaluator(), np.array([(r.low + r.high) / 2 for r in model.parameters])
    place = model.home - 0.1 * model.deepest * model.normal
    answer.elapsed = 1e-3
    for holding in (True, False):
        answer.place(place, holding=holding, believed=True)
        answer(place, parameters)
    return place, parameters


def _follow_streams() -> None:
    """A network of arrays, and one that follows a stream, with its noise and its refinement."""
    import palpate as pp
    from palpate.learning.stream.learner import Learner

    rng = np.random.default_rng(0)
    X = rng.uniform(-1.0, 1.0, (60, 2))
    Y = np.column_stack([np.sin(3 * X[:, 0]), X.prod(axis=1)])
    pp.fit(X, Y, effort=0.02, workers=1)
    ranges = tuple(pp.Range(name, -1.0, 1.0) for name in "ab")
    for outputs in (1, 2):
        learner = Learner(ranges, tuple(pp.Quantity(f"y{i}") for i in range(outputs)), settle=20)
        for x, y in zip(X, Y[:, :outputs], strict=True):
            learner.observe(x, y)


HALVES = {"networks": networks, "surfaces": surfaces}

if __name__ == "__main__":
    from palpate import kernels

    kernels.FEW = kernels.MANY = 0  # compiled, however few rows are asked for
    sys.path.insert(0, str(Path(__file__).parent))
    HALVES[sys.argv[1]]()
