"""Presses of the full model, solved beforehand: so it takes part in an experiment at 1 kHz, beside its surrogates.

The presses follow one line into the body, densely, with a few beside it for a hand that strays. What is learnt from
them is the reference of an experiment; presses between them, of which nothing is learnt, tell how far it and each
surrogate are from the finite elements along that line.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from palpate.dataset import Dataset
from palpate.errors import AccuracyError, UsageError
from palpate.learning.learn_dataset import learn
from palpate.runtime.touchable import Touchable, touchable
from palpate.surrogates import Surrogate
from palpate.sweeps import sweep

__all__ = ["body_of_presses", "line_errors", "solve_presses"]

# depths on the line, at each of four places beside it, and between for judging
_ON, _BESIDE, _BETWEEN = 24, 4, 8
_STRAY = 1 / 6  # of the probe's radius: how far beside the line
_LEAST_FORCE = 0.1  # of the largest force on the line: below, an error isn't told as a share
LARGEST_ERROR = 0.02  # of the force: a third of the JND of stiffness, 7 %


def solve_presses(problem: Any, body: Touchable, path: Path) -> tuple[Dataset, Dataset]:
    """Solve the presses of a body's problem under its `home`, in a store; return those to learn from and to judge by.

    Further inputs have the middle of their ranges. A store that is there goes on, or is read.
    """
    if body.holds or body.tool is not None or body.gripper is not None:
        raise UsageError(
            f"{body.name} can't be pressed along a line.",
            why="Presses of the full model are those of a ball that is free.",
            fix='Take a study whose interaction has kind = "probe".',
        )
    across = np.linalg.svd(body.normal[None])[2][1:] * _STRAY * body.radius
    places = [body.home, *(body.home + s * a for a in across for s in (-1.0, 1.0))]
    shallow = 0.5 * body.deepest / _ON
    on, beside = (np.linspace(shallow, body.deepest, n) for n in (_ON, _BESIDE))
    between = (on[1:-1:2] + on[2::2])[: _ON // 2] / 2.0
    between = between[np.linspace(0, len(between) - 1, _BETWEEN).round().astype(int)]
    lines = [(places[0], on), *((place, beside) for place in places[1:]), (places[0], between)]
    centres = np.vstack([place - np.outer(depths, body.normal) for place, depths in lines])
    rest = [(r.low + r.high) / 2.0 for r in body.parameters]
    rows = np.hstack([centres, np.tile(rest, (len(centres), 1))])
    names = [r.name for r in body.inputs]
    data = sweep(problem, points=rows[:, [names.index(r.name) for r in problem.ranges]], path=path)
    cut = len(data) - _BETWEEN
    return data.take(np.arange(cut)).ok, data.take(np.arange(cut, len(data))).ok


def line_errors(bodies: Mapping[str, Surrogate], presses: Dataset) -> dict[str, tuple[float, float]]:
    """Return the mean and the largest force error of bodies along the line, as shares of the force of the presses."""
    size = np.linalg.norm(presses.force, axis=1)
    counted = size >= _LEAST_FORCE * size.max()
    errors = {}
    for name, body in bodies.items():
        energy = touchable(body).energy
        columns = [[r.name for r in presses.ranges].index(r.name) for r in energy.inputs]
        missed = energy.force(presses.X[:, columns]) - presses.force
        off = np.linalg.norm(missed, axis=1)[counted] / size[counted]
        errors[name] = (float(off.mean()), float(off.max()))
    return errors


def body_of_presses(presses: Dataset, unseen: Dataset, name: str, log: Callable[[str], None]) -> Surrogate:
    """Return a body that was learnt from presses; one that misses those between by more than 2 % is refused."""
    body, _ = learn(presses, name=name, shape=False, effort=0.15, log=log)
    (_, largest), *_ = line_errors({name: body}, unseen).values()
    if not largest <= LARGEST_ERROR:
        raise AccuracyError(
            f"The presses of the full model are missed by {largest:.1%} of their force between them.",
            why=f"A reference shall be within {LARGEST_ERROR:.0%}: people tell 7 %.",
            fix="Take finer elements under the probe, or a smaller depth.",
        )
    return body
