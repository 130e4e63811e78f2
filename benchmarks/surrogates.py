"""Surrogates of touched bodies: error against the number of solves, beside every rival; what a hand feels; time.

python -m benchmarks --only surrogates [--study block layered query] [--quick] [--json] [--record]
python -m benchmarks.surrogate_plots figures.json docs/images      the curves, from what --json wrote

Data come from ``benchmarks/data``, made by `benchmarks.touch_data`; a study without a file is left out.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from benchmarks.runner import main
from benchmarks.surrogate_cases import Case
from benchmarks.surrogate_fields import field_table
from benchmarks.surrogate_measure import OURS, SIZES, Measured, measured, sprung
from benchmarks.surrogate_queries import query_table
from benchmarks.surrogate_relaxation import relaxation_table
from benchmarks.table import Claim, Column, Table, quick_mark
from benchmarks.touch_studies import STUDIES
from palpate.format import criterion_figure
from palpate.validation import validate
from palpate.validation.limits import Check

__all__ = ["tables"]

LOOPS = 20
QUICK_EFFORT, QUICK_SIZE = 0.1, 10
STIFFNESS = 0.04  # asked for on the block
# what is of no study, by the name on the command line
BESIDE: dict[str, Callable[[bool], list[Table]]] = {
    "query": lambda quick: [query_table(quick)],
    "relaxation": relaxation_table,
}


def tables(*, quick: bool = False, studies: Sequence[str] = ()) -> list[Table]:
    """The tables; `quick` learns the block once, from few solves, with little effort, without springs."""
    found: list[Table] = []
    for name in studies or (*(("block",) if quick else STUDIES), *BESIDE):
        if name in BESIDE:
            found += BESIDE[name](quick)
            continue
        case = Case.load(name)
        if case is None:
            print(f"no data for {name}", file=sys.stderr)
            continue
        found += _study(case, quick)
    return found


def _study(case: Case, quick: bool) -> list[Table]:
    most, wanted = case.available, case.study.wanted
    # the last size may fall short of the figure asked, where a solve failed
    sizes = tuple(sorted({min(n, most) for n in (*SIZES, wanted) if n <= most or n == wanted}))
    detailed = min(wanted, most)
    if quick:
        sizes, detailed = (QUICK_SIZE,), QUICK_SIZE
    result = measured(
        case,
        sizes,
        effort=QUICK_EFFORT if quick else 1.0,
        detailed=detailed,
        loops=10 if quick else LOOPS,
        report=lambda line: print(f"  {line}", file=sys.stderr, flush=True),
    )
    beside = [] if quick else [sprung(case, detailed, lambda line: print(f"  {line}", file=sys.stderr))]
    mark = quick_mark(quick)
    return [
        _curve_table(result, sizes, mark),
        _rival_table(result, beside, detailed, mark),
        _good_table(result, detailed, mark),
        *field_table(case, detailed, QUICK_EFFORT if quick else 1.0, mark),
    ]


def _curve_table(result: Measured, sizes: tuple[int, ...], mark: str) -> Table:
    """Median and 95th percentile of the force error, a column for each number of solves."""
    methods = dict.fromkeys(row["method"] for row in result.rows)
    rows = []
    for method in methods:
        line: dict[str, Any] = {"method": method}
        for size in sizes:
            row = result.of(method, size)
            if row is not None:
                line[str(size)] = f"{100 * row['median']:.2f} / {100 * row['p95']:.2f}"
                line[f"{size}_median"], line[f"{size}_p95"] = row["median"], row["p95"]
        rows.append(line)
    winners = {
        size: min(methods, key=lambda m, size=size: (result.of(m, size) or {"p95": math.inf})["p95"])
        for size in sizes
    }
    lost = [f"{size} solves: {name}" for size, name in winners.items() if name != OURS]
    return Table(
        f"surrogates-{result.case.name}-curve",
        f"{result.case.name}: force error in %, median / 95th percentile, against the number of solves{mark}",
        (Column("method", "solves"), *(Column(str(size), str(size)) for size in sizes)),
        rows,
        notes=(
            f"{len(result.case.rows('test'))} unseen solves; relative errors where the force is above f₀, the smaller "
            "of 0.5 N and 5 % of the largest; " + _symmetry(result.case),
            f"smallest 95th percentile by others: {'; '.join(lost)}"
            if lost
            else "of these, palpate's 95th percentile is the smallest at every number of solves",
            *(
                ()
                if mark
                else ("palpate learns by its default effort, a counted number of networks and iterations",)
            ),
        ),
    )


def _rival_table(result: Measured, beside: list[dict[str, Any]], size: int, mark: str) -> Table:
    rows = [row for row in result.rows if row["solves"] == size] + beside
    return Table(
        f"surrogates-{result.case.name}-rivals",
        f"{result.case.name}: {size} solves, ours and others{mark}",
        (
            Column("method", "method"),
            Column("median", "force, median", ".2%"),
            Column("p95", "p95", ".2%"),
            Column("light", "light touch, p95 of f₀", ".2%"),
            Column("direction", "direction p95, °", ".2f"),
            Column("stiffness", "stiffness p95", ".1%"),
            Column("loop", "closed-loop work, largest", ".1e"),
            Column("learning", "learning, CPU s", ".1f"),
            Column("query", "query, µs", ".1f"),
        ),
        rows,
        notes=(
            "stiffness of others by central differences of 1 µm; ours and springs have their own; a query of ours is "
            "force and stiffness, of others the force",
            "ours learns from energies, their slopes and stiffnesses, the others from forces, which is all they take",
            "closed-loop work: |∮F·dx| over ½∮|F·dx| of random triangles to pentagons, by one quadrature that goes on "
            "until it has converged; –: a query of springs is an equilibrium, too slow for it",
            *(
                f"springs: Young's modulus of each region identified on {row['identified_on']} solves, errors on "
                f"{row['asked']} of the test"
                for row in beside
            ),
            "force linear in depth: per place from the shallowest third of the depths",
            "no row for POD + RBF: of the force it is the RBF, and the file holds no displacement fields"
            if "displacement_mm" not in result.case.arrays
            else "POD + RBF of the displacement stands in a table of its own; of the force it is the RBF",
        ),
    )


def _good_table(result: Measured, size: int, mark: str) -> Table:
    """Every figure that a hand or an eye would notice, beside what is good; the mesh's error apart."""
    case, surrogate = result.case, result.surrogates[size]
    test = case.solves("test")
    assert test is not None
    found = validate(surrogate, test, refined=case.solves("refined"))
    rows = [_check_row(check) for check in found.checks]
    row = result.of(OURS, size)
    assert row is not None
    median, p95 = case.study.target
    wanted = [("median force error", "median", median), ("95th percentile of it", "p95", p95)]
    if case.name.startswith("block"):
        wanted.append(("95th percentile of the stiffness error", "stiffness", STIFFNESS))
    claims = [
        Claim(f"{what} from {size} solves", (row[key],), bound, ".2%")
        for what, key, bound in wanted
        if not math.isnan(bound)
    ]
    for key in ("loop_work", "border_loop_work"):
        claims += [
            Claim(f"{c.criterion.label}, of the energy", (c.measured,), 1e-9)
            for c in found.checks
            if c.criterion.key == key
        ]
    return Table(
        f"surrogates-{case.name}",
        f"{case.name}: what a hand feels, from {size} solves{mark}",
        (
            Column("what", "what"),
            Column("measured", "measured"),
            Column("good", "good"),
            Column("limit", "noticed from"),
            Column("grade", "grade"),
        ),
        rows,
        claims,
        notes=(*found.details(), *found.notes, str(surrogate), _domain(case)),
    )


def _check_row(check: Check) -> dict[str, Any]:
    kind, good = check.criterion.kind, check.criterion.good
    return {
        "what": check.criterion.label,
        "measured": criterion_figure(check.measured, kind),
        "good": None if good is None else criterion_figure(good, kind),
        "limit": criterion_figure(check.limit, kind),
        "grade": check.grade,
        "value": check.measured,
    }


def _symmetry(case: Case) -> str:
    count = len(case.symmetry)
    return f"all learn from each solve and its {count} images" if count else "no symmetry"


def _denser(case: Case) -> str:
    return ", denser towards its edges (by the sine)" if case.study.to_edges else ""


def _domain(case: Case) -> str:
    """Where the probe was in training and test."""
    train, test = (case.arrays["inputs"][case.rows(role)] for role in ("train", "test"))
    depths = [1e3 * case.surface.depth(X[:, :3], case.radius) for X in (train, test)]
    spans = [f"{np.min(d):.2g} to {np.max(d):.3g} mm deep" for d in depths]
    columns = [len(np.unique(case.arrays["column"][case.rows(role)])) for role in ("train", "test")]
    return (
        f"training places: {columns[0]} of a scrambled Sobol sequence over the surface{_denser(case)}, depths "
        f"evenly spaced and shifted, {spans[0]}; test: {columns[1]} other places, depths uniform at random, "
        f"{spans[1]}"
    )


if __name__ == "__main__":
    sys.exit(main(only="surrogates"))
