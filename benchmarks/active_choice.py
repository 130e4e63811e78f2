"""Solves needed to reach a force error, by how they were chosen: active choice beside Sobol and other designs.

python -m benchmarks --only active_choice [--quick] [--json] [--record]

A pool is the training solves of a benchmark's file, about 300; its test solves judge. All rules begin with the same
twelve points of a scrambled Sobol sequence, a new one for each seed, and go on in batches of eight. First a Gaussian
process learns, which is the same whatever was chosen and repeats to the last bit: there the choice decides. Then the
product's own search learns from some of these designs, several times, since its starts are drawn.
About an hour on one core.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
from scipy.stats import qmc

from benchmarks.surrogate_cases import Case
from benchmarks.surrogate_measure import errors
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.improvement.choice_rules import (
    choose_by_disagreement,
    choose_by_variance,
    choose_farthest,
)
from palpate.improvement.force_model import ForceModel
from palpate.learning.energy import learn_energy
from palpate.surrogates import ContactBaseline, ContactLaw, Solves, Surrogate
from palpate.validation import TouchFunction

__all__ = ["LEVELS", "RULES", "Pool", "choice_table", "curve", "learnt_table", "solves_to", "tables"]

BODIES = ("liver", "block", "block-10k", "family", "layered", "breast-dome")
RULES = ("sobol", "latin hypercube", "farthest", "disagreement", "largest variance", "variance")
LEVELS = (0.05, 0.03, 0.02, 0.015, 0.01)
SEEDS = 10
OTHERS_ON, OTHER_SEEDS = ("liver", "block"), 2  # of the other rules: where a choice matters
FIRST, BATCH, MOST = 12, 8, 180
LEARNT = {"block": (20, 28, 44)}
"""Numbers of solves from which the product's surrogate learns too."""
LEARNT_SEEDS, EFFORT = 2, 0.3
MANY = 20  # solves from which on active choice is to save some
WANTED = 0.7  # of Sobol's solves
CROSSED = 1.1  # times the level, that the next error may be at most: one lucky error does not count

Curve = Sequence[tuple[int, float]]
"""Numbers of solves with the force error at the 95th percentile of the test."""


@dataclass(frozen=True, eq=False)
class Pool:
    """Solves of one body from which a design is chosen, and those that judge it.

    Attributes
    ----------
    case : Case
        The body with its file.
    """

    case: Case

    @cached_property
    def rows(self) -> np.ndarray:
        """Rows of the pool in the file."""
        return self.case.rows("train")

    @cached_property
    def X(self) -> np.ndarray:
        """Inputs (P, n) of the pool."""
        return np.asarray(self.case.arrays["inputs"][self.rows])

    @cached_property
    def baseline(self) -> ContactBaseline:
        """The contact of the probe, to choose a law from."""
        radius = self.case.radius
        return ContactBaseline(ContactLaw("series", radius / 10.0), self.case.surface, radius)

    def solves(self, some: np.ndarray) -> Solves:
        """Return some solves of the pool, by their numbers."""
        arrays, rows = self.case.arrays, self.rows[some]
        force = arrays["force"][rows]
        if "beside" in arrays:
            force = np.hstack([force, arrays["beside"][rows]])
        return Solves(
            arrays["inputs"][rows],
            arrays["energy"][rows],
            force,
            arrays["stiffness"][rows],
            tuple(self.case.inputs),
            np.asarray(self.case.symmetry, float).reshape(-1, 3, 3),
            self.case.about if self.case.symmetry else None,
        )

    @cached_property
    def coordinates(self) -> np.ndarray:
        """Ranks (P, n), in [0, 1], of place along the surface, depth and further inputs: the pool's own density."""
        C = np.ascontiguousarray(self.X[:, :3])
        distance, normal, _ = self.case.surface.at(C)
        places = C - distance[:, None] * normal
        places = places - places.mean(axis=0)
        along = places @ np.linalg.svd(places, full_matrices=False)[2][:2].T
        values = np.column_stack([along, -distance, self.X[:, 3:]])
        return np.column_stack([np.searchsorted(np.sort(v), v, side="right") / len(v) for v in values.T])

    def nearest_free(self, points: np.ndarray) -> np.ndarray:
        """Return for each point (m, n) in turn the number of the nearest row that is free."""
        free, chosen = np.ones(len(self.X), dtype=bool), []
        for point in points:
            distance = np.where(free, np.square(self.coordinates - point).sum(axis=1), np.inf)
            chosen.append(int(np.argmin(distance)))
            free[chosen[-1]] = False
        return np.array(chosen)

    def sobol(self, count: int, seed: int) -> np.ndarray:
        """Return the rows of a scrambled Sobol sequence, a longer one beginning with a shorter."""
        engine = qmc.Sobol(self.X.shape[1], rng=np.random.default_rng(1000 + seed))
        return self.nearest_free(engine.random(256)[:count])

    def latin_hypercube(self, count: int, seed: int) -> np.ndarray:
        """Return the rows of a Latin hypercube of that many points."""
        engine = qmc.LatinHypercube(self.X.shape[1], rng=np.random.default_rng([1000 + seed, count]))
        return self.nearest_free(engine.random(count))


@cache
def pool_of(body: str) -> Pool:
    """Return the pool of a body of `benchmarks.touch_studies`."""
    case = Case.load(body)
    assert case is not None, body
    return Pool(case)


def curve(
    pool: Pool,
    rule: str,
    seed: int,
    *,
    most: int = MOST,
    designs: dict[int, np.ndarray] | None = None,
    least: float = min(LEVELS),
) -> list[tuple[int, float]]:
    """Return how the process's error falls with the solves that a rule chooses.

    Parameters
    ----------
    pool : Pool
        What is chosen from.
    rule : str
        One of `RULES`.
    seed : int
        Decides the first points, and all of Sobol's and the Latin hypercube's.
    most : int
        Solves at which the curve ends.
    designs : dict, optional
        Gets the rows of each number of solves.
    least : float
        Error at which it ends, once kept twice.
    """
    test = pool.case.solves("test")
    assert test is not None
    some, model, found = pool.sobol(FIRST, seed), None, []
    while True:
        model = ForceModel.fit(pool.solves(some), pool.baseline, model, seed=seed)
        function = TouchFunction("process", tuple(pool.case.inputs), model.force)
        found.append((len(some), float(errors(function, test)["p95"])))
        if designs is not None:
            designs[len(some)] = some
        kept = len(found) > 1 and max(e for _, e in found[-2:]) <= least
        if len(some) >= min(most, len(pool.X)) or kept:
            return found
        some = _next(pool, rule, seed, some, model)


def _next(pool: Pool, rule: str, seed: int, some: np.ndarray, model: ForceModel) -> np.ndarray:
    """Return the rows of the next larger design."""
    count = min(len(some) + BATCH, len(pool.X))
    if rule == "sobol":
        return pool.sobol(count, seed)
    if rule == "latin hypercube":
        return pool.latin_hypercube(count, seed)
    free = np.setdiff1d(np.arange(len(pool.X)), some)
    X, number = pool.X[free], count - len(some)
    if rule == "farthest":
        picks = choose_farthest(model.scaled(X), model.scaled(pool.X[some]), model.half, model.images, number)
    elif rule == "disagreement":
        picks = choose_by_disagreement(model, X, number)
    else:
        groups = [np.array([i]) for i in range(len(X))]
        largest = rule == "largest variance"
        picks = choose_by_variance(
            model, X, groups, np.ones(len(X)), number, taken=pool.X[some], largest=largest
        )
    return np.concatenate([some, free[picks]])


def solves_to(found: Curve, level: float) -> float:
    """Return the solves from which an error is kept, interpolated in its logarithm; not-a-number where it never is."""
    for i, (solves, error) in enumerate(found):
        if error > level or (i + 1 < len(found) and found[i + 1][1] > CROSSED * level):
            continue
        if i == 0:
            return float(solves)
        before, larger = found[i - 1]
        if larger <= level:
            return float(solves)
        return float(before + (solves - before) * np.log(larger / level) / np.log(larger / error))
    return float("nan")


def tables(*, quick: bool = False) -> list[Table]:
    """Return the tables; `quick` takes one seed of one body and few solves."""
    bodies, seeds = (("layered",), 1) if quick else (BODIES, SEEDS)
    most = 28 if quick else MOST
    curves = {}
    for body in bodies:
        for rule in RULES:
            own = seeds if rule in {"sobol", "variance"} or quick else OTHER_SEEDS * (body in OTHERS_ON)
            for seed in range(own):
                curves[body, rule, seed] = curve(pool_of(body), rule, seed, most=most)
            print(f"  {body}, {rule}", file=sys.stderr, flush=True)
    learnt = {"layered": (12,)} if quick else LEARNT
    results = learnt_results(learnt, 1 if quick else LEARNT_SEEDS, 0.05 if quick else EFFORT)
    return [choice_table(curves, quick=quick), learnt_table(results, quick=quick)]


def choice_table(curves: Mapping[tuple[str, str, int], Curve], *, quick: bool = False) -> Table:
    """Return the table of solves to each error, as medians over seeds, and what is claimed of it.

    Parameters
    ----------
    curves : mapping
        By body, rule and seed.
    quick : bool
        Whether to say so in the title.
    """
    rows, ratios, elsewhere = [], [], []
    for body in dict.fromkeys(body for body, _, _ in curves):
        reached: dict[str, dict[float, np.ndarray]] = {}
        for rule in dict.fromkeys(rule for own, rule, _ in curves if own == body):
            own = [found for (b, r, _), found in sorted(curves.items()) if (b, r) == (body, rule)]
            reached[rule] = {level: np.array([solves_to(found, level) for found in own]) for level in LEVELS}
            row: dict[str, Any] = {"body": body, "rule": rule, "seeds": len(own)}
            for level in LEVELS:
                row[f"{level:g}"] = _median(reached[rule][level], own)
            rows.append(row)
        for level in LEVELS:
            if "sobol" not in reached or "variance" not in reached:
                continue
            ratio = _ratio(reached["variance"][level], reached["sobol"][level])
            if ratio is None:
                continue
            theirs = np.nan_to_num(reached["sobol"][level], nan=np.inf)
            many = np.median(theirs) > MANY
            (ratios if many else elsewhere).append((body, level, ratio))
    claims = [
        Claim(f"{body}, {level:.1%}: solves by variance over Sobol's", (ratio,), bound, ".2f")
        for found, bound in ((ratios, WANTED), (elsewhere, 1.0))
        for body, level, ratio in found
    ]
    if ratios:
        mean = _geometric(np.array([ratio for _, _, ratio in ratios]))
        what = f"geometric mean of these {len(ratios)}, where Sobol's points need more than {MANY}"
        claims.insert(len(ratios), Claim(what, (mean,), WANTED, ".2f"))
    return Table(
        "active-choice",
        f"Solves until the force error at the 95th percentile is kept, medians over seeds; a Gaussian process "
        f"learns{quick_mark(quick)}",
        [
            Column("body", "body"),
            Column("rule", "rule"),
            Column("seeds", "seeds", "d"),
            *(Column(f"{level:g}", f"{level:.1%}") for level in LEVELS),
        ],
        rows,
        claims,
        [
            f"All begin with the same {FIRST} Sobol points; > where half of the seeds or more never kept that error.",
            "Ratios are geometric means over the seeds in which Sobol's points kept it; a seed in which the choice by "
            "variance never did counts with all the solves it had.",
        ],
    )


def _median(reached: np.ndarray, curves: Sequence[Curve]) -> str:
    """Return a median as text, never reached counting as more than all."""
    value = float(np.median(np.where(np.isnan(reached), np.inf, reached)))
    return f"{value:.0f}" if np.isfinite(value) else f"> {max(found[-1][0] for found in curves)}"


def _ratio(ours: np.ndarray, theirs: np.ndarray) -> float | None:
    """Return the geometric mean of ratios, seed by seed; None where half of the rival's seeds never came there."""
    both = min(len(ours), len(theirs))
    known = ~np.isnan(theirs[:both])
    if known.sum() <= both / 2:
        return None
    filled = np.where(np.isnan(ours[:both]), MOST, ours[:both])
    return float(np.exp(np.mean(np.log(filled[known] / theirs[:both][known]))))


def learnt_results(
    sizes: Mapping[str, Sequence[int]], seeds: int, effort: float
) -> dict[tuple[str, str, int, int, int], float]:
    """Return the error of the product's surrogate by body, rule, solves, seed of the design and seed of the search."""
    results = {}
    for body, counts in sizes.items():
        for rule in ("sobol", "variance"):
            for seed in range(seeds):
                designs: dict[int, np.ndarray] = {}
                curve(pool_of(body), rule, seed, most=max(counts), designs=designs, least=0.0)
                for number in counts:
                    rows = designs[number]
                    for search in range(2):
                        error = learnt_error(pool_of(body), rows, search, effort)
                        results[body, rule, len(rows), seed, search] = error
            print(f"  {body}, {rule}, learnt", file=sys.stderr, flush=True)
    return results


def learnt_error(pool: Pool, some: np.ndarray, seed: int, effort: float) -> float:
    """Return the force error of the product's surrogate of a design at the 95th percentile of the test."""
    test = pool.case.solves("test")
    assert test is not None
    energy, _ = learn_energy(pool.solves(some), pool.baseline, effort=effort, seed=seed, workers=1)
    return float(errors(TouchFunction.of(Surrogate(energy, meta={"name": "learnt"})), test)["p95"])


def learnt_table(results: Mapping[tuple[str, str, int, int, int], float], *, quick: bool = False) -> Table:
    """Return the table of the product's surrogate, with the scatter of its search beside that of the designs."""
    rows = []
    for body, solves in dict.fromkeys((b, n) for b, _, n, _, _ in results):
        row: dict[str, Any] = {"body": body, "solves": solves}
        for rule in ("sobol", "variance"):
            found = {k[3:]: e for k, e in results.items() if k[:3] == (body, rule, solves)}
            values = np.array(list(found.values()))
            row[rule] = 100 * _geometric(values)
            row[f"{rule}-span"] = f"{100 * values.min():.2g}–{100 * values.max():.2g}"
            pairs = [abs(np.log(found[seed, 0] / found[seed, 1])) for seed in {s for s, _ in found}]
            row[f"{rule}-search"] = float(np.exp(np.mean(pairs)))
        rows.append(row)
    return Table(
        "active-choice-learnt",
        f"Force error at the 95th percentile, %, of the product's surrogate, effort {EFFORT:g}{quick_mark(quick)}",
        [
            Column("body", "body"),
            Column("solves", "solves", "d"),
            Column("sobol", "Sobol", ".2f"),
            Column("sobol-span", "least–most"),
            Column("sobol-search", "two searches, ratio", ".2f"),
            Column("variance", "variance", ".2f"),
            Column("variance-span", "least–most"),
            Column("variance-search", "two searches, ratio", ".2f"),
        ],
        rows,
        [],
        ["Geometric means over seeds of the design and two seeds of the search."],
    )


def _geometric(values: np.ndarray) -> float:
    return float(np.exp(np.log(values).mean()))
