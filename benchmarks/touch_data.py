"""Make the data of the surrogates' benchmark by finite elements: ``python -m benchmarks.touch_data STUDY --out FILE``.

Positions come in columns, each a place and its depths from shallow to deep. Training columns follow a scrambled
Sobol sequence (Owen 1998) with evenly spaced, shifted depths; test columns another one, their depths at random.
"refined" solves the test's positions again with elements of half the size. The file is written after each column; a
run that was interrupted goes on where it was. ``--join`` puts parts and roles into the one file that is kept.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import qmc

from benchmarks.touch_studies import CLEAR, LEAST, RADIUS, STUDIES, TouchStudy
from palpate.physics.interactions.surface_patch import surface_of

__all__ = ["Column", "columns_of", "join", "main"]

FINER = 2.0  # of the refined solves
NODES = 300  # of the displacement field that are kept in a joined file
PER_ROW = ("inputs", "energy", "force", "stiffness", "beside", "column", "role", "seconds", "displacement")


@dataclass(frozen=True)
class Column:
    """Solves above one place.

    Attributes
    ----------
    number : int
    foot, normal : (3,) array
        In m; outward unit normal.
    depths : (m,) array
        In m, from shallow to deep.
    values : tuple of float
        Further inputs.
    turn : (3, 3) array
        By which answers are turned: of a round body one meridian is solved.
    """

    number: int
    foot: np.ndarray
    normal: np.ndarray
    depths: np.ndarray
    values: tuple[float, ...]
    turn: np.ndarray

    @property
    def centres(self) -> np.ndarray:
        """Positions (m, 3) of the sphere's centre in m."""
        return np.asarray(self.foot + (RADIUS - self.depths)[:, None] * self.normal)


def columns_of(study: TouchStudy, count: int, depths: int, seed: int, role: str) -> list[Column]:
    """The first `count` columns of a seed, whichever part of them is solved here.

    Training and test take different sequences of one seed; a longer training set begins with a shorter one.
    """
    training = role == "train"
    rng = np.random.default_rng([seed, 0 if training else 1])
    engine = qmc.Sobol(3 + len(study.inputs), scramble=True, rng=rng)
    unit = engine.random(1 << int(np.ceil(np.log2(8 * count + 8))))
    found: list[Column] = []
    share = np.sin(np.pi / 2 * unit[:, :2]) if training and study.to_edges else unit[:, :2]
    for row, foot, normal in _feet(study, share):
        d = (np.arange(depths) + unit[row, 2]) / depths
        if not training:
            d = np.sort(np.random.default_rng([seed, 1, row]).random(depths))
        d = LEAST + (study.depth - LEAST) * d
        values = tuple(v.low + (v.high - v.low) * u for v, u in zip(study.inputs, unit[row, 3:], strict=True))
        found.append(Column(len(found), foot, normal, d, values, _turn(study, unit[row, 1])))
        if len(found) == count:
            return found
    raise RuntimeError(f"only {len(found)} of {count} places lie on the surface")


def _turn(study: TouchStudy, share: float) -> np.ndarray:
    """A rotation (3, 3) about the axis by this share of a turn; none of bodies that are not round."""
    angle = 2 * np.pi * share if study.symmetry == "round" else 0.0
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _feet(study: TouchStudy, unit: np.ndarray) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """Row of `unit` (N, 2), place and normal (3,) of those that lie in the study's part of the surface."""
    geometry = study.body().geometry
    patch = surface_of(geometry, study.touches, study.probe.refinements(geometry))
    low, high = (corner[:2] for corner in (study.over if study.over is not None else patch.box))
    low, high = np.asarray(low), np.asarray(high)
    rim = _rim(patch) if study.over is None else np.empty((0, 3))
    places = low + unit * (high - low)
    if study.symmetry == "round":  # evenly over the disc
        places = np.asarray(study.about) + study.within * np.sqrt(unit[:, :1]) * (1.0, 0.0)
    for row, place in enumerate(places):
        if np.hypot(*(place - study.about)) > study.within:
            continue
        foot = patch.cast(2, 1.0, place[None])[0]
        if np.isnan(foot).any() or (len(rim) and np.linalg.norm(rim - foot, axis=1).min() < CLEAR):
            continue
        yield row, foot, patch.nearest(foot)[1]


def _rim(patch: Any) -> np.ndarray:
    """Corners (N, 3) of the edges that only one triangle has."""
    pairs = np.sort(np.concatenate([patch.triangles[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
    edges, times = np.unique(pairs, axis=0, return_counts=True)
    return np.asarray(patch.points[np.unique(edges[times == 1])])


class Solved:
    """Rows of one file, column by column."""

    def __init__(self, path: Path, plan: dict[str, Any]) -> None:
        self._path, self._plan = path, plan
        self._rows: dict[str, list[Any]] = {}
        self._shape: dict[str, np.ndarray] = {}
        self._done: set[int] = set()
        if path.exists():
            self._resume()

    def _resume(self) -> None:
        with np.load(self._path) as data:
            old = json.loads(str(data["plan"]))
            if old != self._plan:
                raise SystemExit(f"{self._path} holds {old}, not {self._plan}: name another file")
            self._done = set(data["done"].tolist())
            self._rows = {k: list(data[k]) for k in PER_ROW if k in data.files}
            self._shape = {k: data[k] for k in ("points", "triangles") if k in data.files}

    def __contains__(self, number: int) -> bool:
        return number in self._done

    def __len__(self) -> int:
        return len(self._rows.get("energy", ()))

    def add(self, number: int, rows: Sequence[dict[str, Any]], shape: dict[str, np.ndarray]) -> None:
        """Keep a column, and write the file."""
        for row in rows:
            for key, value in row.items():
                self._rows.setdefault(key, []).append(value)
        self._shape |= shape
        self._done.add(number)
        arrays = {k: np.array(v) for k, v in self._rows.items()}
        # a whole file or the one before, whenever this is interrupted
        temporary = self._path.with_suffix(".part.npz")
        np.savez(
            temporary, **arrays, **self._shape, plan=json.dumps(self._plan), done=np.array(sorted(self._done))
        )
        temporary.replace(self._path)


def solve_columns(study: TouchStudy, options: argparse.Namespace, columns: Sequence[Column]) -> None:
    """Solve what is not in the file yet."""
    finer = FINER if options.role == "refined" else 1.0
    keys = ("study", "depths", "seed", "role", "fields")
    solved = Solved(options.out, {key: getattr(options, key) for key in keys})
    problem = study.problem(finer=finer)
    solver = problem.open()
    for column in columns:
        if column.number in solved:
            continue
        start = time.process_time()
        solver.reset()
        rows = _solve(solver, column, options)
        mesh = problem.mesh
        shape = {"points": mesh.points, "triangles": mesh.triangles} if options.fields else {}
        solved.add(column.number, rows, shape)
        spent = time.process_time() - start
        print(
            f"column {column.number}: {len(rows)} of {len(column.depths)}, {len(solved)} rows, {spent:.0f} s",
            flush=True,
        )


def _solve(solver: Any, column: Column, options: argparse.Namespace) -> list[dict[str, Any]]:
    """The column's rows; a solve that fails is left out, and told."""
    rows = []
    for depth, centre in zip(column.depths, column.centres, strict=True):
        start = time.process_time()
        found = solver.solve(np.r_[centre, column.values])
        if not found.converged:
            print(f"  failed at {1e3 * centre} mm, depth {1e3 * depth:.2f} mm: {found.message}", flush=True)
            solver.reset()
            continue
        row: dict[str, Any] = {
            "inputs": np.r_[column.turn @ centre, column.values],
            "energy": float(found.potential_energy),
            "force": column.turn @ found.response[:3],
            "stiffness": column.turn @ found.response_gradient[:3, :3] @ column.turn.T,
            "beside": found.response[3:],
            "column": column.number,
            "role": options.role,
            "seconds": time.process_time() - start,
        }
        if options.fields:
            row["displacement"] = np.asarray(found.displacement, dtype=np.float32)
        rows.append(row)
    return rows


def join(study: str, files: Sequence[Path], out: Path) -> None:
    """One file of all parts and roles, its displacements at no more than `NODES` nodes.

    A joined file may be a part of a new one.
    """
    parts = [dict(np.load(file)) for file in files]
    wrong = [str(file) for file, part in zip(files, parts, strict=True) if _study_of(part) != study]
    if wrong:
        raise SystemExit(f"not of {study}: {', '.join(wrong)}")
    keys = [k for k in PER_ROW if k != "displacement" and all(k in p for p in parts)]
    arrays: dict[str, Any] = {key: np.concatenate([p[key] for p in parts]) for key in keys}
    # order of columns, whichever part a column was in; training first
    rank = {"train": 0, "test": 1, "refined": 2}
    order = np.lexsort((arrays["column"], [rank[r] for r in arrays["role"].tolist()]))
    arrays = {key: value[order] for key, value in arrays.items()}
    _require_distinct(arrays)
    fields = [p for p in parts if "displacement" in p]
    if fields:
        arrays |= _thinned(fields, parts, order)
    arrays["provenance"] = _provenance(study, parts)
    np.savez_compressed(out, **arrays)
    print(f"{out}: {len(order)} rows, {out.stat().st_size / 1e6:.2f} MB", flush=True)


def _require_distinct(arrays: dict[str, Any]) -> None:
    """A solve that stands there twice counts twice in all that is learnt and judged."""
    rows = [(role, *x) for role, x in zip(arrays["role"], arrays["inputs"], strict=True)]
    if twice := len(rows) - len(set(rows)):
        raise SystemExit(f"{twice} solves are in two of these files: join each part once")


def _plans(part: dict[str, Any]) -> list[str]:
    """Plans by which a file was made: its own, or those of the files joined in it."""
    if "plan" in part:
        return [str(part["plan"])]
    return [line for line in str(part["provenance"]).splitlines() if line.startswith("{")]


def _study_of(part: dict[str, Any]) -> str:
    return str(json.loads(_plans(part)[0])["study"])


def _thinned(fields: Sequence[Any], parts: Sequence[Any], order: np.ndarray) -> dict[str, np.ndarray]:
    """Displacements (N, m, 3) of some nodes of the surface in mm, NaN where a part has none."""
    points, triangles = fields[0]["points"], fields[0]["triangles"]
    chosen = _spread(points, np.unique(triangles), NODES)
    u = np.concatenate([_of_nodes(part, chosen, points[chosen]) for part in parts])
    return {"displacement_mm": u[order].astype(np.float16), "nodes": points[chosen]}


def _of_nodes(part: Any, chosen: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Displacements (N, m, 3) in mm of a part, whole or joined before, at these nodes."""
    if "displacement" in part:
        return np.asarray(1e3 * part["displacement"][:, chosen])
    if "displacement_mm" in part:
        if not np.array_equal(part["nodes"], places):
            raise SystemExit("a file joined before holds displacements of other nodes: join its parts anew")
        return np.asarray(part["displacement_mm"])
    return np.full((len(part["energy"]), len(chosen), 3), np.nan)


def _spread(points: np.ndarray, among: np.ndarray, count: int) -> np.ndarray:
    """Nodes each of which is the farthest from those before it."""
    chosen = [int(among[np.argmax(points[among, 2])])]
    distance = np.full(len(among), np.inf)
    while len(chosen) < min(count, len(among)):
        distance = np.minimum(distance, np.linalg.norm(points[among] - points[chosen[-1]], axis=1))
        chosen.append(int(among[np.argmax(distance)]))
    return np.array(chosen)


def _provenance(study: str, parts: Sequence[Any]) -> str:
    found = STUDIES[study]
    problem = found.problem()
    plans = sorted({plan for part in parts for plan in _plans(part)})
    inputs = [str(one.range) for one in found.inputs]
    return "\n".join(
        [
            f"Finite elements of palpate, study {study}: python -m benchmarks.touch_data {study}",
            str(problem),
            *(["further inputs: " + ", ".join(inputs)] if inputs else []),
            f"nodes {len(problem.mesh.points)}; refined rows: elements {FINER:g} times smaller",
            *plans,
        ]
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Solve columns of a study, or join files."""
    options = _parser().parse_args(arguments)
    if options.join:
        join(options.study, options.join, options.out)
        return 0
    part, parts = map(int, options.part.split("/"))
    study = STUDIES[options.study]
    columns = columns_of(study, options.columns, options.depths, options.seed, options.role)
    solve_columns(study, options, columns[options.first :][part::parts])
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.touch_data", description=__doc__)
    parser.add_argument("study", choices=STUDIES)
    parser.add_argument("--out", type=Path, required=True, help="file of rows (.npz)")
    parser.add_argument("--columns", type=int, default=60)
    parser.add_argument(
        "--first", type=int, default=0, help="number of the first column; those before are left out"
    )
    parser.add_argument("--depths", type=int, default=5, help="of each column")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--role", choices=("train", "test", "refined"), default="train")
    parser.add_argument("--part", default="0/1", help="i/n: every n-th column from the i-th on, i from 0")
    parser.add_argument("--fields", action="store_true", help="keep displacements of all nodes too")
    parser.add_argument("--join", type=Path, nargs="+", metavar="FILE", help="join these into --out")
    return parser


if __name__ == "__main__":
    sys.exit(main())
