"""Problems with known answers and known ways to fail, for tests of the sweep. Workers import this module."""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from palpate.dataset import Layout, beam_fields
from palpate.physics.beam.beam_problem import Solution
from palpate.physics.stop import Stop
from palpate.units import Range


@dataclass(frozen=True)
class Spring:
    """One node on a spring of 2 N/m; it misbehaves where told to.

    raises, dies, aborts, hangs, fails, lies: inputs at which the solver raises, ends its process with code 3, by a
    signal, never ends, does not converge, or claims so without a number.
    quits: for each kind of exception that is no `Exception`, the input at which it raises it.
    log: a folder that gets one file per solve.
    """

    raises: tuple[float, ...] = ()
    dies: tuple[float, ...] = ()
    aborts: tuple[float, ...] = ()
    hangs: tuple[float, ...] = ()
    fails: tuple[float, ...] = ()
    lies: tuple[float, ...] = ()
    quits: dict[str, float] = field(default_factory=dict)
    log: str = ""
    seconds: float = 0.0
    ranges: tuple[Range, ...] = (Range("P", 0.0, 10.0, "N"),)

    @property
    def layout(self):
        return Layout(np.array([[1.0, 0.0]]), None, (0,), ((0.0, -1.0),))

    @property
    def schema(self):
        return beam_fields(1)

    def describe(self):
        return {"body": {"type": "Spring", "raises": self.raises, "fails": self.fails}}

    def open(self):
        return SpringSolver(self)


class SpringSolver:
    def __init__(self, problem):
        self.problem = problem

    def solve(self, x):
        force = float(x[0])
        time.sleep(self.problem.seconds)
        if self.problem.log:
            (Path(self.problem.log) / f"{force:.6f}-{time.time_ns()}").touch()
        if force in self.problem.raises:
            raise ZeroDivisionError(f"no answer at {force:g}")
        if force in self.problem.dies:
            os._exit(3)
        if force in self.problem.aborts:
            os.abort()
        if force == self.problem.quits.get("exit"):
            sys.exit(3)
        for kind in (KeyboardInterrupt, GeneratorExit, Unwritable):
            if force == self.problem.quits.get(kind.__name__):
                raise kind
        if force in self.problem.hangs:
            never_end()
        stop = Stop.UNSTABLE if force in self.problem.fails else Stop.CONVERGED
        u = force / 2
        return Solution(
            stop=stop,
            iterations=1,
            residual=0.0,
            displacement=np.array([[0.0, -u, 0.0]]),
            root_reaction=np.array([0.0, force, force]),
            strain_energy=u * u,
            potential_energy=np.nan if force in self.problem.lies else -u * u,
        )


class Unwritable(BaseException):
    """An exception that is no `Exception` and can't be told as text."""

    def __str__(self):
        raise ZeroDivisionError

    def __reduce__(self):
        raise ZeroDivisionError


def never_end():
    while True:
        time.sleep(0.01)


class LoneSpring(Spring):
    """A spring whose every solve is a chain of its own, as each depth series of a probe is."""

    def chains(self, points):
        return [np.array([row]) for row in range(len(points))]
