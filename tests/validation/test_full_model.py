"""Finite elements under a recorded hand: the same forces as solves of their own, and a place in the report."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import palpate as pp
from palpate.devices.tick_record import TICK
from palpate.devices.trace_file import Trace
from palpate.physics import Cantilever, Circle, LinearElastic, PointLoad
from palpate.validation.full_model import compare_full_model
from palpate.validation.report import write
from palpate.validation.report.trace_pictures import comparison_pictures
from palpate.validation.unseen_solves import force_jnd


@pytest.fixture(scope="module")
def problem():
    body = pp.Body(pp.shapes.Block((0.06, 0.06, 0.03)), pp.materials.NeoHookean(9e3, 0.45))
    ball = pp.SphereProbe(0.010, touches="top", depth=(0.0, 0.006), over=((0.02, 0.02), (0.04, 0.04)))
    return body.problem(ball, element=0.02)


@pytest.fixture(scope="module")
def trace(problem):
    """A press in the middle that wanders to a side, answered by a spring."""
    ticks = np.zeros(400, TICK)
    share = np.linspace(0.0, 1.0, 400)
    ticks["tick"], ticks["time"] = np.arange(400), 1e-3 * np.arange(400)
    ticks["contact"][:, 0], ticks["contact"][:, 1] = 0.03 + 0.005 * share, 0.03
    ticks["depth"] = 0.004 * np.sin(np.pi * share)
    ticks["contact"][:, 2] = 0.04 - ticks["depth"]
    ticks["wanted"][:, 2] = 80.0 * ticks["depth"]
    ticks["flags"] = 1 << 5
    inputs = [[r.name, r.low, r.high, r.unit] for r in problem.ranges]
    return Trace(Path("press.trace"), {"name": "spring", "inputs": inputs, "parameters": []}, ticks)


@pytest.mark.full
def test_a_stroke_is_solved_from_each_equilibrium_to_the_next(problem, trace):
    comparison = compare_full_model(trace, problem, most=4)
    assert 3 <= len(comparison.time) <= 4
    middle = int(np.argmax(comparison.depth))
    row = np.searchsorted(trace.time, comparison.time[middle])
    alone = problem.open().solve(trace.ticks["contact"][row])
    np.testing.assert_allclose(comparison.reference[middle], alone.response[:3], rtol=1e-5, atol=1e-8)
    assert "solves a second" in comparison.note
    assert comparison_pictures in write.PICTURES
    (drawn,) = comparison_pictures(SimpleNamespace(comparisons=[comparison]), "c1")
    assert drawn.title == "A recorded touch: spring beside finite elements"
    assert "difference / JND" in drawn.svg


def test_a_beam_is_led_to_where_the_hand_holds_it():
    """The load is found for each place; a surrogate that is 5 % off is 5 % off, up and down."""
    beam = Cantilever(1.0, Circle(0.005), LinearElastic(2e9, 0.43, 1150.0))
    problem = beam.problem([PointLoad("P", 1.0, 0.0, 5.0)])
    loads = np.linspace(0.5, 5.0, 6)
    tips = np.array([problem.solve([p]).displacement[-1, :2] for p in loads])
    ticks = np.zeros(12, TICK)
    ticks["time"], ticks["coupling"], ticks["flags"] = 1e-3 * np.arange(12), np.inf, 1 << 5
    ticks["position"][:6, 1], ticks["position"][6:, 1] = tips[:, 1], -tips[:, 1]
    ticks["wanted"][:6, 1], ticks["wanted"][6:, 1] = 1.05 * loads, -1.05 * loads
    header = {"name": "beam", "inputs": [["h", -1.0, 1.0, "m"]], "parameters": []}
    trace = Trace(Path("beam.trace"), header, ticks)
    comparison = compare_full_model(trace, problem)
    np.testing.assert_allclose(comparison.reference[:, 1], np.concatenate([loads, -loads]), rtol=1e-7)
    size = np.abs(comparison.reference[:, 1])
    np.testing.assert_allclose(comparison.jnd, 0.05 / force_jnd(size), rtol=1e-5)
