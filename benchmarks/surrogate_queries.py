"""What one answer of a surrogate costs, beside the same in plain NumPy."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from benchmarks.plain_field import NODES, PlainField, made
from benchmarks.plain_query import PlainQuery, example
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.units import bounds

__all__ = ["query_table"]

UNITS = {40: 1, 320: 4}  # one network of a body without symmetry; the most that a mean has, and of how many
WEIGHTS = 44  # of a posterior: those of 40 units and a tail; with a symmetry those of an orbit are one
RATIO, ROUNDS = 0.7, 7
FRAME = 1e6 / 60  # µs of a picture at 60 Hz
Case = tuple[str, Callable[[], object], Callable[[], object], float]


def query_table(quick: bool) -> Table:
    """Microseconds of an answer both ways."""
    repeats = 50 if quick else 1000
    cases: list[Case] = []
    surrogates = {units: example(units, rank=WEIGHTS, networks=many) for units, many in UNITS.items()}
    for units, surrogate in surrogates.items():
        low, high = bounds(surrogate.inputs)
        c = (low + high) / 2
        c[2] = 0.004
        evaluate, plain = surrogate.evaluator(), PlainQuery(surrogate)
        cases.append((f"force and stiffness, {units} units", partial(evaluate, c), partial(plain, c), 10.0))
        both_of = partial(evaluate.trust, c), partial(plain.trust, c)
        cases.append((f"the same and the trust figure, {units} units", *both_of, 20.0))
    energy, field = made()
    force, eye, plain_force, plain_eye = (
        energy.evaluator(),
        field.evaluator(),
        PlainQuery(energy),
        PlainField(field),
    )
    place = np.array([0.003, 0.001, 0.004])

    def both() -> None:
        force(place)
        eye(place)
        eye.field()

    def by_hand() -> None:
        plain_force(place)
        plain_eye(place)

    cases.append((f"force, stiffness and field of {NODES} nodes", both, by_hand, 100.0))
    rows: list[dict[str, Any]] = []
    for what, ours, other, about in cases:
        a, b = _least(ours, repeats), _least(other, max(1, repeats // 10))
        rows.append({"what": what, "ours": a, "plain": b, "ratio": a / b, "about": about})
    for units, surrogate in surrogates.items():
        low, high = bounds(surrogate.inputs)
        took = _least(partial(surrogate.force_covariance, ((low + high) / 2)[None]), repeats)
        rows.append(
            {"what": f"covariance of the force at a place, {units} units", "ours": took, "about": FRAME}
        )
        places = np.random.default_rng(0).uniform(low, high, (NODES, len(low)))
        took = _least(partial(surrogate.deviation, places), 1)
        rows.append({"what": f"deviation at {NODES} places, {units} units", "ours": took, "about": FRAME})
    return Table(
        "surrogates-query",
        f"One answer of a surrogate{quick_mark(quick)}",
        (
            Column("what", "answer"),
            Column("ours", "µs", ".1f"),
            Column("about", "aim, about, µs", ".0f"),
            Column("plain", "plain NumPy, µs", ".0f"),
            Column("ratio", "ratio", ".2f"),
        ),
        rows,
        (
            *(Claim(f"{r['what']}, over NumPy", (r["ratio"],), RATIO, ".2f") for r in rows if "ratio" in r),
            *(
                Claim(f"{r['what']}, µs of a picture at 60 Hz", (r["ours"],), FRAME, ".0f")
                for r in rows
                if "ratio" not in r
            ),
        ),
        (
            f"rotated units, three inputs, 512 training inputs, a posterior of {WEIGHTS} weights; 320 units are a mean "
            "of four networks, of which the first has the posterior; the field: 20 modes, a moving dimple; plain NumPy "
            "as one would write it from the formulas (benchmarks/plain_query.py, plain_field.py); CPU time, the least "
            "of seven runs",
        ),
    )


def _least(of: Callable[[], object], repeats: int) -> float:
    """CPU time of a call in µs, the least of seven rounds: what other processes take does not count."""
    of()
    found = []
    for _ in range(ROUNDS):
        begun = time.process_time()
        for _ in range(repeats):
            of()
        found.append((time.process_time() - begun) / repeats)
    return 1e6 * min(found)
