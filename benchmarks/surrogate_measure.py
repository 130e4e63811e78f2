"""Ours and the rivals on one study: errors against solves, closed-loop work, times."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.surrogate_cases import Case
from benchmarks.surrogate_rivals import RIVALS
from benchmarks.surrogate_springs import counts, identified, some
from palpate.learning.energy import learn_energy
from palpate.surrogates import ContactBaseline, ContactLaw, Solves, Surrogate
from palpate.validation import TouchFunction, TouchSolves
from palpate.validation.figures.force import angles
from palpate.validation.figures.loop_work import function_work
from palpate.validation.unseen_solves import ForceSamples

__all__ = ["OURS", "SIZES", "SPRINGS", "Measured", "measured", "sprung"]

OURS, SPRINGS = "palpate", "mass–spring body"
SIZES = (6, 10, 20, 40, 80, 150, 300)
SEED = 0
QUERIES = 200
Row = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Measured:
    """Everything measured on a study.

    Attributes
    ----------
    case : Case
    rows : list of mappings
        One for each method and number of solves.
    surrogates : mapping of int to Surrogate
        Ours, by the number of solves.
    """

    case: Case
    rows: list[Row]
    surrogates: dict[int, Surrogate]

    def of(self, method: str, solves: int) -> Row | None:
        """A method's row at a number of solves."""
        return next((r for r in self.rows if r["method"] == method and r["solves"] == solves), None)


def measured(
    case: Case,
    sizes: tuple[int, ...],
    *,
    effort: float,
    detailed: int,
    loops: int,
    report: Callable[[str], None],
) -> Measured:
    """Learn and ask; `detailed` is the number of solves at which closed-loop work and query times are measured too.

    Parameters
    ----------
    case : Case
    sizes : tuple of int
    effort : float
        Of our search, 1 by default elsewhere.
    detailed, loops : int
    report : callable
        Takes a line for each result.
    """
    test, rows, ours = case.solves("test"), [], {}
    assert test is not None
    learnt(case, min(sizes), 0.05)  # what is compiled once is no part of learning
    for size in sizes:
        training = case.training(size)
        for name in (OURS, *RIVALS):
            wall, begun = time.perf_counter(), _processor_time()
            if name == OURS:
                ours[size] = learnt(case, size, effort)
                model = TouchFunction.of(ours[size])
            else:
                model = RIVALS[name](case, training)
            spent = _processor_time() - begun
            row = {"method": name, "solves": size, "learning": spent, "wall": time.perf_counter() - wall}
            row |= errors(model, test)
            if size == detailed:
                row |= _loops(model, test, loops) | {"query": _query(model, ours.get(size), name, test)}
            rows.append(row)
            report(
                f"{case.name}, {size} solves, {name}: {row['median']:.2%} / {row['p95']:.2%}, {spent:.0f} s"
            )
    return Measured(case, rows, ours)


def _processor_time() -> float:
    """Of this process and of those that helped it and have ended, s."""
    return sum(os.times()[:4])


def learnt(case: Case, size: int, effort: float) -> Surrogate:
    """Our surrogate of so many solves."""
    training = case.training(size)
    solves = Solves(
        training.X,
        training.energy,
        training.responses,
        training.stiffness,
        tuple(case.inputs),
        np.asarray(case.symmetry, float).reshape(-1, 3, 3),
        case.about if case.symmetry else None,
    )
    law = ContactLaw("series", case.radius / 10.0)
    baseline = ContactBaseline(law, case.surface, case.radius)
    return Surrogate(learn_energy(solves, baseline, effort=effort, seed=SEED)[0], meta={"name": OURS})


def errors(model: TouchFunction, test: TouchSolves) -> Row:
    """Errors of force, light touch, direction and stiffness on solves that were not learnt from."""
    K = None if model.stiffness is None else model.stiffness(test.X)
    return _errors(test, model.force(test.X), K)


def _errors(test: TouchSolves, F: np.ndarray, K: np.ndarray | None) -> Row:
    samples = ForceSamples(test.X[:, :3], test.force, F, np.ones(len(F), dtype=bool))
    heavy, light = samples.heavy, samples.light
    relative = samples.relative[heavy]
    turned = angles(test.force[heavy], F[heavy])
    row = {
        "median": _quantile(relative, 0.5),
        "p95": _quantile(relative, 0.95),
        "light": _quantile(samples.error[~heavy] / light, 0.95),
        "direction": _quantile(turned, 0.95),
        "stiffness": None,
    }
    if K is not None and test.stiffness is not None:
        size = np.linalg.norm(test.stiffness, axis=(1, 2))
        known = np.isfinite(size) & (size > 0)
        off = np.linalg.norm(K - test.stiffness, axis=(1, 2))[known] / size[known]
        row["stiffness"] = _quantile(off, 0.95)
    return row


def sprung(case: Case, size: int, report: Callable[[str], None]) -> Row:
    """The same of springs, on some of the test: each query is an equilibrium."""
    found = case.solves("test")
    assert found is not None
    solves, asked = counts(case)
    test, begun = some(found, asked), time.process_time()
    springs = identified(case, case.training(size), solves)
    spent, begun = time.process_time() - begun, time.process_time()
    F, K = springs.answers(test.X, stiffness=True)
    query = 1e6 * (time.process_time() - begun) / len(test)
    # what has no equilibrium counts as no force
    row = _errors(test, np.nan_to_num(F), np.nan_to_num(K))
    report(f"{case.name}, {SPRINGS}: {row['median']:.2%} / {row['p95']:.2%}, moduli × {springs.factors}")
    return {
        "method": SPRINGS,
        "solves": size,
        "identified_on": solves,
        "asked": asked,
        "learning": spent,
        "query": query,
        "factors": springs.factors,
        **row,
    }


def _loops(model: TouchFunction, test: TouchSolves, loops: int) -> Row:
    found = function_work(model, test, loops=loops, seed=SEED)
    return (
        {} if isinstance(found, str) else {"loop_median": found.median, "loop": found.max, "open": found.open}
    )


def _query(model: TouchFunction, ours: Surrogate | None, name: str, test: TouchSolves) -> float:
    """CPU time in µs of one force at one place; of ours with the stiffness."""
    X = test.X[np.arange(QUERIES) % len(test)]
    if name == OURS and ours is not None:
        evaluate = ours.energy.evaluator()
        pairs = [(x[:3].copy(), x[3:].copy()) for x in X]
        begun = time.process_time()
        for position, parameters in pairs:
            evaluate(position, parameters)
        return 1e6 * (time.process_time() - begun) / len(X)
    ones = [x[None] for x in X]
    begun = time.process_time()
    for x in ones:
        model.force(x)
    return 1e6 * (time.process_time() - begun) / len(X)


def _quantile(values: np.ndarray, q: float) -> float:
    return float(np.quantile(values, q)) if values.size else float("nan")
