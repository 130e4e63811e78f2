"""The full finite-element model under a recorded hand, beside the surrogate that was felt.

The recorded stroke is thinned to moments that lie evenly along the way of the hand. They are solved in passes from its
beginning to its end, each pass twice as fine as the one before: a comparison that runs out of time still covers the
whole stroke, its deepest moment first of all. Each solve starts from the nearest equilibrium that is known.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from palpate.devices.trace_file import Trace
from palpate.errors import SolverError, UsageError
from palpate.validation.touch_comparison import TouchComparison

__all__ = ["compare_full_model", "stroke_moments"]

Progress = Callable[[int, int, float], None]
_EVERY = 5.0  # s between two messages on the progress
_SECANTS, _CLOSE = 12, 1e-8  # solves for a load at most, and share of the way to which it is found


def stroke_moments(trace: Trace, most: int) -> np.ndarray:
    """Return indices of at most `most` (≥ 2) ticks that are solved, in order, evenly along the way of the hand.

    Only moments count at which the body was held, without a fault, and was felt.
    """
    felt = trace.flag("grabbed") & (trace.ticks["fault"] == 0) & trace.ticks["wanted"].any(axis=1)
    rows = np.flatnonzero(felt)
    if len(rows) <= most:
        return rows
    places = np.hstack([trace.ticks["contact"], trace.parameters])[rows]
    reach = np.ptp(places, axis=0)
    steps = np.linalg.norm(np.diff(places / np.where(reach > 0.0, reach, 1.0), axis=0), axis=1)
    # a resting hand counts too, by its time
    way = np.concatenate([[0.0], np.cumsum(steps / max(steps.sum(), 1e-300) + 1.0 / len(steps))])
    chosen = np.searchsorted(way, np.linspace(0.0, way[-1], most - 1))
    deepest = int(np.argmax(trace.ticks["depth"][rows]))
    return np.asarray(rows[np.unique(np.append(np.minimum(chosen, len(rows) - 1), deepest))])


def compare_full_model(
    trace: Trace,
    problem: Any,
    *,
    limit: float = 300.0,
    most: int = 200,
    progress: Progress = lambda *_: None,
    clock: Callable[[], float] = time.monotonic,
) -> TouchComparison:
    """Solve the full model under a recorded hand, and compare the force before limits and controller with it.

    The trace is of a body pressed by a probe, held by a pad, or, a beam, at the node of its single load. `limit` is the
    time in s for all solves; the stroke is covered as evenly as the time allows, with `most` moments at most.
    `progress` takes (done, total, seconds) every few seconds.
    """
    answer = (
        _BeamUnderHand(trace, problem) if hasattr(problem, "load_nodes") else _BodyUnderHand(trace, problem)
    )
    moments = stroke_moments(trace, most)
    if len(moments) < 2:
        raise UsageError(f"{trace.path.name} holds no touch.", fix="Record one in which the body is felt.")
    began = shown = clock()
    forces = np.full((len(moments), 3), np.nan)
    failed, done = 0, 0
    deepest = int(np.argmax(trace.ticks["depth"][moments]))
    for row in _passes(len(moments), deepest):
        if clock() - began > limit:
            break
        forces[row] = answer(moments[row])
        done += 1
        failed += not np.isfinite(forces[row]).all()
        if clock() - shown > _EVERY:
            shown = clock()
            progress(done, len(moments), shown - began)
    spent = clock() - began
    good = np.isfinite(forces).all(axis=1)
    if good.sum() < 2:
        raise SolverError(
            f"Of {done} moments of the stroke {good.sum()} have an equilibrium.",
            why="The full model was too slow, or the hand was where it has none.",
            fix="Give more time with --limit, or record a gentler stroke.",
        )
    rate = done / max(spent, 1e-9)
    note = f"the full model reached {rate:.3g} solves a second ({done} of {len(moments)} moments in {spent:.1f} s)"
    if failed:
        note += f"; {failed} had no equilibrium"
    rows = moments[good]
    return TouchComparison(
        ("finite elements", str(trace.header.get("name", "surrogate"))),
        trace.time[rows],
        trace.ticks["depth"][rows].astype(float),
        forces[good],
        trace.ticks["wanted"][rows],
        note,
    )


class _BodyUnderHand:
    """Forces of a solid that is pressed by a probe or held by a pad, at ticks of a trace."""

    def __init__(self, trace: Trace, problem: Any) -> None:
        known = [row[0] for row in trace.header["inputs"]]
        wanted = [r.name for r in problem.ranges]
        if len(known) - len(trace.header["parameters"]) != 3 or sorted(wanted) != sorted(known):
            raise _refusal(trace, problem, "Give the study from which the recorded model was learnt.")
        self._columns = [known.index(name) for name in wanted]
        self._trace, self._solver = trace, problem.open()

    def __call__(self, tick: int) -> np.ndarray:
        """Return the force (3,) on the hand, N; not-a-number without an equilibrium."""
        place = np.concatenate([self._trace.ticks["contact"][tick], self._trace.parameters[tick]])
        answer = self._solver.solve(place[self._columns])
        return np.asarray(answer.response)[:3] if answer.converged else np.full(3, np.nan)


class _BeamUnderHand:
    """Forces of an elastic beam that is held at the node of its single load, at ticks of a trace."""

    def __init__(self, trace: Trace, problem: Any) -> None:
        felt = len(trace.header["inputs"]) - len(trace.header["parameters"])
        if len(problem.ranges) != 1 or felt != 1 or problem.body.kind != "elastic":
            raise _refusal(trace, problem, "Only an elastic beam under one load can be led by a hand.")
        self._direction = np.append(np.asarray(problem.load_directions[0]), 0.0)
        self._node, self._largest = problem.load_nodes[0], float(problem.ranges[0].high)
        self._trace, self._solver = trace, problem.open()

    def __call__(self, tick: int) -> np.ndarray:
        """Return the force (3,) on the hand, N; not-a-number without an equilibrium."""
        row = self._trace.ticks[tick]
        # a spring in front of a stiff body: the hand is not where it holds the body
        place = row["position"] if np.isinf(row["coupling"]) else row["contact"]
        goal = float(place @ self._direction)
        load = -float(row["wanted"] @ self._direction)
        before, gap_before = 0.0, -goal
        for _ in range(_SECANTS):
            gap = self._along(load) - goal
            if abs(gap) <= _CLOSE * abs(goal):
                return -load * self._direction
            if not np.isfinite(gap) or load == before or gap == gap_before:
                break
            load, before, gap_before = load - gap * (load - before) / (gap - gap_before), load, gap
        return np.full(3, np.nan)

    def _along(self, load: float) -> float:
        """Return how far the node goes along the load's direction, m."""
        answer = self._solver.solve(np.array([load]))
        return (
            float(answer.displacement[self._node, :2] @ self._direction[:2]) if answer.converged else np.nan
        )


def _refusal(trace: Trace, problem: Any, fix: str) -> UsageError:
    known, wanted = [row[0] for row in trace.header["inputs"]], [r.name for r in problem.ranges]
    return UsageError(
        "This full model can't be put under the recorded hand.",
        why=f"Its inputs are {', '.join(wanted)}; those of the recorded body are {', '.join(known)}.",
        fix=fix,
    )


def _passes(count: int, first: int) -> list[int]:
    """Return 0 … count − 1, `first` ahead, in passes along the stroke, each twice as fine as the one before."""
    step = 1 << max(0, (count - 1).bit_length() - 3)
    order, seen = [first], {first}
    while step:
        for row in [*range(0, count, step), count - 1]:
            if row not in seen:
                seen.add(row)
                order.append(row)
        step //= 2
    return order
