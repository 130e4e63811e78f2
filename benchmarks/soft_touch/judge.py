"""The judge of soft-touch: how near a simulated soft body comes to the force that a hand would feel.

    python judge.py METHOD                 judge a method on every case beside this file
    python judge.py METHOD --case block    on some of them
    python judge.py METHOD --json FILE     and write the figures

METHOD is a Python file with `load(case)`, an FMU (inputs x, y, z in m; outputs fx, fy, fz in N), or a table (CSV with
the columns press, fx, fy, fz). NumPy is enough; an FMU needs FMPy as well. Units are SI; a force is that on the
ball, and a depth counts from first touch along the path of a press.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import math
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

if __package__:
    from .case_files import CASES, Case, JudgeError, case_names, columns_of, order_of, read_case, vectors_of
else:  # run as a file
    from case_files import CASES, Case, JudgeError, case_names, columns_of, order_of, read_case, vectors_of

__all__ = [
    "FIGURES",
    "Case",
    "JudgeError",
    "case_names",
    "compare",
    "delay",
    "figure_text",
    "judge",
    "main",
    "monotone_cubic",
    "noticeable",
    "plain_figures",
    "question",
    "question_moving",
    "read_case",
    "read_method",
    "table_text",
]

FIGURES = {
    "force_median": "force, N",
    "force_p95": "95th percentile, N",
    "jnd_median": "force, JND",
    "jnd_p95": "95th percentile, JND",
    "stiffness_median": "stiffness, %",
    "direction_median": "direction, degrees",
    "loop_work": "closed paths, %",
    "lateness": "lateness, ms",
    "seconds_step": "s a step",
    "solves": "solves",
    "presses": "presses answered",
}
"""Names of the figures and their titles; one that a method can't give is None, printed as "not given"."""

STEP = 1e-3  # s, between two forces of a stroke: the rate of haptic devices
STROKE = 0.25  # s, of one press and release: 50 mm/s for 4 mm, as fast as a hand that palpates
STROKE_DEPTH = 0.95  # of the deepest press, so that the oracle is never extrapolated
PROBE_STEP = 0.05  # of the depth: central differences of d^1.5 then err by 0.01 %
WEBER, WEBER_SMALL, SMALL = 0.07, 0.10, 1.0  # just noticeable share of a force; below 1 N
LATEST = 0.1  # s, the longest delay that is looked for
NO_ANSWER = "no answer"  # in words and in JSON, which has no infinity
ROUNDING = 1e-9  # of a figure in any unit: less is printed as 0


class _Table:
    """Forces that a file gives at the presses alone."""

    def __init__(self, path: Path, case: Case) -> None:
        columns = columns_of(path)
        missing = [name for name in ("press", "fx", "fy", "fz") if name not in columns]
        if missing:
            raise JudgeError(f"{path} has no column {missing[0]}.", fix="Give the columns press, fx, fy, fz.")
        self.at_presses = vectors_of(columns, "fx fy fz")[
            order_of(np.array(case.presses), columns["press"], path)
        ]


class _Fmu:
    """An FMU with inputs x, y, z and outputs fx, fy, fz, run by FMPy."""

    def __init__(self, path: Path) -> None:
        try:
            import fmpy
        except ImportError as error:
            raise JudgeError(
                f"{path} is an FMU, and FMPy is not installed.", fix="Install it: pip install fmpy."
            ) from error
        self._fmpy, self._path = fmpy, path
        try:
            description = fmpy.read_model_description(str(path))
        except Exception as error:  # FMPy raises bare exceptions of many kinds
            raise JudgeError(f"{path} can't be read as an FMU.", why=str(error)) from error
        names = {variable.name for variable in description.modelVariables}
        missing = {"x", "y", "z", "fx", "fy", "fz"} - names
        if missing:
            raise JudgeError(
                f"{path} has no variable {min(missing)}.",
                fix="Inputs are x, y, z (m), outputs fx, fy, fz (N).",
            )

    def force(self, places: np.ndarray) -> np.ndarray:
        """Return forces (n, 3) at the ends of communication steps of 1 ms, one at each place."""
        times = STEP * np.arange(len(places) + 1)
        fed = np.concatenate([places, places[-1:]])
        signal = np.array(
            [(t, *place) for t, place in zip(times, fed, strict=True)],
            dtype=[(name, float) for name in ("time", "x", "y", "z")],
        )
        answer = self._fmpy.simulate_fmu(
            str(self._path),
            stop_time=float(times[-1]),
            step_size=STEP,
            output_interval=STEP,
            input=signal,
            output=["fx", "fy", "fz"],
            fmi_type="CoSimulation",
        )
        forces = np.stack([np.asarray(answer[name], dtype=float) for name in ("fx", "fy", "fz")], 1)
        # the first row is that of the start: an input counts from the beginning of a step, its output at the end
        return forces[1:]

    stroke = force


def read_method(path: Path, case: Case) -> Any:
    """Return the method of a file, ready to be judged on a case."""
    if not path.is_file():
        raise JudgeError(
            f"There is no file {path}.",
            fix="Give a Python file with load(case), an FMU, or a CSV table of forces.",
        )
    if path.suffix == ".csv":
        return _Table(path, case)
    if path.suffix == ".fmu":
        return _Fmu(path)
    if path.suffix != ".py":
        raise JudgeError(
            f"{path} is no method.", fix="Give a .py with load(case), an .fmu, or a .csv of forces."
        )
    specification = importlib.util.spec_from_file_location(f"soft_touch_{path.stem}", path)
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    try:
        specification.loader.exec_module(module)
        method = module.load(case)
    except JudgeError:
        raise
    except (Exception, SystemExit) as error:  # whatever a stranger's file raises is named with its file
        raise JudgeError(
            f"{path} can't be loaded for the case {case.name}.",
            why=f"{type(error).__name__}: {error}",
            fix="The file defines load(case), which returns an object with force(places (n, 3)) -> (n, 3).",
        ) from error
    if not callable(getattr(method, "force", None)) and not callable(method):
        raise JudgeError(
            f"load(case) of {path} returned {type(method).__name__}, which gives no forces.",
            fix="Return an object with force(places (n, 3)) -> (n, 3), or such a function.",
        )
    return method


def judge(method: Any, case: Case) -> dict[str, float | None]:
    """Return the figures of a method on a case, by the names of `FIGURES`."""
    return compare(question(method, case), case)


def question(
    method: Any, case: Case, *, loops: bool = True, probed: Sequence[int] | None = None
) -> dict[str, Any]:
    """Return what a method answers, as plain data that `compare` makes figures of.

    The method has `force(places (n, 3)) -> (n, 3)`, m and N, or is that function; or it has the array `at_presses`
    (n, 3) alone. It may have `start(place)` and `step(place, seconds) -> (3,)`, or `stroke(places (n, 3)) -> (n, 3)`, a
    place each millisecond from rest, and the numbers `solves` and `seconds_step`. Closed paths and strokes, which take
    many steps, are left out without `loops`. The answers are `press` (n,), `at_presses` (n, 3), `deeper` and
    `shallower` (m, 3) by `PROBE_STEP` of the depth at the presses `probed` (m,), all by default, `loop_work` in %,
    `lateness` in ms, `seconds_step`, `solves` and `settings`; None where the method can't say.
    """
    ask = _asker(method)
    own = {"solves": _own_number(method, "solves"), "settings": getattr(method, "settings", None)}
    if ask is None:
        own["seconds_step"] = _own_number(method, "seconds_step")
        return {**own, "press": case.presses, "at_presses": method.at_presses.tolist()}
    some = case if probed is None else case.only(probed)
    answers = {
        **own,
        "press": case.presses,
        "at_presses": ask(case.places).tolist(),
        "probed": some.presses,
        "deeper": ask(some.shift(PROBE_STEP)).tolist(),
        "shallower": ask(some.shift(-PROBE_STEP)).tolist(),
    }
    answers["seconds_step"] = _own_number(method, "seconds_step")
    return answers | (question_moving(method, case) if loops else {})


def question_moving(method: Any, case: Case) -> dict[str, Any]:
    """Return what a method with forces answers on closed paths and strokes: the part of `question` of many steps."""
    ask = _asker(method)
    assert ask is not None
    work = _largest([_loop_work(ask, case, loop) for loop in case.loops])
    lateness, seconds = _stroke_figures(method, ask, case)
    own = _own_number(method, "seconds_step")  # after asking: a method may count its steps
    return {"loop_work": work, "lateness": lateness, "seconds_step": own or seconds}


def compare(answers: dict[str, Any], case: Case) -> dict[str, float | None]:
    """Return the figures of answers to presses that the oracle has; one without a finite force is infinitely wrong."""
    rows, asked = _solved(answers["press"], case)
    figures: dict[str, float | None] = dict.fromkeys(FIGURES)
    figures |= _force_figures(np.array(answers["at_presses"], dtype=float)[rows], asked)
    if answers.get("deeper") is not None:
        rows, asked = _solved(answers.get("probed", answers["press"]), case)
        deeper, shallower = (np.array(answers[name], dtype=float)[rows] for name in ("deeper", "shallower"))
        figures["stiffness_median"] = _stiffness_error(deeper, shallower, asked)
    for name in ("loop_work", "lateness", "seconds_step", "solves"):
        figures[name] = answers.get(name)
    return figures


def _own_number(method: Any, name: str) -> float | None:
    """Return a number that a method says of itself, None where it says nothing."""
    value = getattr(method, name, None)
    if value is not None and (isinstance(value, str) or not np.isscalar(value) or not np.isreal(value)):
        raise JudgeError(
            f"{name} of the method is {value!r}, no number.", fix="Give a number, or leave it out."
        )
    return None if value is None else float(value)


def _solved(presses: list[int], case: Case) -> tuple[list[int], Case]:
    """Return the rows of presses that the oracle has, and the case with these alone."""
    rows = [row for row, press in enumerate(presses) if press in set(case.presses)]
    return rows, case.only([presses[row] for row in rows])


def _asker(method: Any) -> Callable[[np.ndarray], np.ndarray] | None:
    call = getattr(method, "force", None) or (method if callable(method) else None)
    return None if call is None else partial(_ask, call)


def _ask(call: Callable[..., Any], places: np.ndarray, *rest: float) -> np.ndarray:
    """Return the forces of a stranger's function at places (n, 3) or at one (3,), in the same shape."""
    try:
        answer = np.asarray(call(places.copy(), *rest))
        forces = answer if np.iscomplexobj(answer) else answer.astype(float)
    except Exception as error:  # a stranger's method may raise anything
        raise JudgeError("The method raised an error.", why=f"{type(error).__name__}: {error}") from error
    if np.iscomplexobj(forces):
        raise JudgeError("The method answered by complex numbers.", fix="Return real forces in N.")
    if forces.shape != places.shape:
        raise JudgeError(
            f"The method answered places of shape {places.shape} by an array of shape {forces.shape}.",
            fix="Return a force in N for each place, in the same shape.",
        )
    return forces


def _force_figures(forces: np.ndarray, case: Case) -> dict[str, float | None]:
    error = np.linalg.norm(forces - case.force, axis=1)
    error[~np.isfinite(error)] = np.inf
    jnd = error / noticeable(case.force)
    cross = np.linalg.norm(np.cross(forces, case.force), axis=1)
    angle = np.degrees(np.arctan2(cross, np.einsum("ij,ij->i", forces, case.force)))
    pushed = np.isfinite(angle) & (np.linalg.norm(forces, axis=1) > 0.0)
    return {
        "force_median": _quantile(error, 0.5),
        "force_p95": _quantile(error, 0.95),
        "jnd_median": _quantile(jnd, 0.5),
        "jnd_p95": _quantile(jnd, 0.95),
        "direction_median": _quantile(angle[pushed], 0.5),
        "presses": float(np.isfinite(error).sum()),
    }


def noticeable(forces: np.ndarray) -> np.ndarray:
    """Return the just noticeable difference (n,) of each force (n, 3), N."""
    size = np.linalg.norm(forces, axis=1)
    return np.asarray(np.where(size < SMALL, WEBER_SMALL * size, WEBER * size))


def _quantile(values: np.ndarray, share: float) -> float | None:
    """Return a quantile as one of the values, since infinite ones can't be interpolated; None of no values."""
    return float(np.quantile(values, share, method="higher")) if len(values) else None


def _largest(values: list[float | None]) -> float | None:
    numbers = [value for value in values if value is not None]
    return max(numbers) if numbers else None


def _stiffness_error(deeper: np.ndarray, shallower: np.ndarray, case: Case) -> float | None:
    along = np.einsum("ij,ij->i", deeper - shallower, case.normals)
    error = 100.0 * np.abs(along / (2.0 * PROBE_STEP * case.depths) / case.stiffness - 1.0)
    error[~np.isfinite(error)] = np.inf
    return _quantile(error, 0.5)


def _loop_work(ask: Callable[[np.ndarray], np.ndarray], case: Case, loop: int) -> float | None:
    """Return the work around a closed path over the work of going in, %, by Simpson's rule on every side."""
    way, around = case.way_in(loop), case.around(loop)
    forces = ask(np.concatenate([way, around]))
    if not np.isfinite(forces).all():
        return None
    inward, circling = forces[: len(way)], forces[len(way) :]
    paid = -float(np.sum(0.5 * (inward[1:] + inward[:-1]) * np.diff(way, axis=0)))
    sides = around[2::2] - around[:-2:2]
    mean = (circling[:-2:2] + 4.0 * circling[1::2] + circling[2::2]) / 6.0
    return 100.0 * abs(float(np.sum(mean * sides))) / abs(paid) if paid else None


def _stroke_figures(
    method: Any, ask: Callable[[np.ndarray], np.ndarray], case: Case
) -> tuple[float | None, float | None]:
    """Return the lateness in ms, the median over strokes on the first and the last path, and seconds a step."""
    late, times = [], list[float]()
    for path in (case.paths.min(), case.paths.max()):
        places, normal, expected = _stroke(case, int(path))
        forces, seconds = _stroke_forces(method, ask, places)
        times.append(seconds)
        felt = forces @ normal
        if np.isfinite(felt).all() and np.ptp(felt) > 0.0:
            late.append(1e3 * delay(felt, expected))
    return (float(np.median(late)) if late else None), float(np.median(times))


def _stroke_forces(
    method: Any, ask: Callable[[np.ndarray], np.ndarray], places: np.ndarray
) -> tuple[np.ndarray, float]:
    """Return the forces (n, 3) of a stroke, place by place unless the method takes all, and the seconds of one."""
    begin = time.perf_counter()
    if hasattr(method, "stroke"):
        return _ask(method.stroke, places), (time.perf_counter() - begin) / len(places)
    step = getattr(method, "step", None)
    if step is not None:
        try:
            method.start(places[0].copy())
        except Exception as error:  # a stranger's method may raise anything
            raise JudgeError(
                "start(place) raised an error.", why=f"{type(error).__name__}: {error}"
            ) from error
    forces, times = np.empty_like(places), []
    for i, place in enumerate(places):
        begin = time.perf_counter()
        forces[i] = ask(place[None])[0] if step is None else _ask(step, place, STEP)
        times.append(time.perf_counter() - begin)
    return forces, float(np.median(times))


def _stroke(case: Case, path: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return places (n, 3), normal (3,) and the oracle's force along it (n,) of a press and release."""
    rows = np.flatnonzero(case.paths == path)
    rows = rows[np.argsort(case.depths[rows])]
    deepest, normal = rows[-1], case.normals[rows[-1]]
    t = STEP * np.arange(round(STROKE / STEP) + round(LATEST / STEP))
    depth = STROKE_DEPTH * case.depths[deepest] * np.sin(np.pi * np.minimum(t / STROKE, 1.0)) ** 2
    places = case.places[deepest] + np.outer(case.depths[deepest] - depth, normal)
    knots = np.concatenate([[0.0], case.depths[rows]])
    force = np.concatenate([[0.0], case.force[rows] @ normal])
    return places, normal, monotone_cubic(knots, force, depth)


def monotone_cubic(x: np.ndarray, y: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return y at places by the monotone cubic of Fritsch and Butland (1984) through points, without overshoot."""
    h, slope = np.diff(x), np.diff(y) / np.diff(x)
    tangent = np.concatenate([slope[:1], np.zeros(len(x) - 2), slope[-1:]])
    left, right = 2.0 * h[1:] + h[:-1], h[1:] + 2.0 * h[:-1]
    rising = slope[:-1] * slope[1:] > 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = (left + right) / (left / slope[:-1] + right / slope[1:])
    tangent[1:-1] = np.where(rising, mean, 0.0)
    i = np.clip(np.searchsorted(x, places) - 1, 0, len(h) - 1)
    s = (places - x[i]) / h[i]
    low = y[i] + h[i] * tangent[i] * s + (3.0 * slope[i] - 2.0 * tangent[i] - tangent[i + 1]) * h[i] * s**2
    return np.asarray(low + (tangent[i] + tangent[i + 1] - 2.0 * slope[i]) * h[i] * s**3)


def delay(felt: np.ndarray, expected: np.ndarray) -> float:
    """Return by how many seconds a force comes later than expected: the shift that leaves least after scaling.

    Negative where it comes earlier. Between samples the least squares are those of the parabola through three shifts.
    """
    shifts = np.arange(-round(LATEST / STEP), round(LATEST / STEP) + 1)
    t = np.arange(len(felt))
    left = np.empty(len(shifts))
    for i, shift in enumerate(shifts):
        moved = np.interp(t - shift, t, expected)
        square = float(moved @ moved)
        left[i] = float(felt @ felt) - (float(felt @ moved) ** 2 / square if square else 0.0)
    best = int(np.argmin(left))
    offset = 0.0
    if 0 < best < len(shifts) - 1:
        before, here, after = left[best - 1 : best + 2]
        bend = before - 2.0 * here + after
        offset = 0.5 * (before - after) / bend if bend > 0.0 else 0.0
    return STEP * (float(shifts[best]) + offset)


def table_text(results: dict[str, dict[str, float | None]]) -> str:
    """Return the figures of each case as lines of text."""
    lines = []
    for name, figures in results.items():
        lines.append(name)
        lines += [f"  {title:22} {figure_text(figures[key])}" for key, title in FIGURES.items()]
    return "\n".join(lines)


def figure_text(value: float | None) -> str:
    """Return a figure with three digits, or in words."""
    if value is None:
        return "not given"
    if math.isinf(value):
        return NO_ANSWER
    return f"{value if abs(value) > ROUNDING else 0.0:.3g}"


def plain_figures(figures: dict[str, Any]) -> dict[str, Any]:
    """Return figures as JSON has them, infinite ones in words."""
    return {
        key: NO_ANSWER if isinstance(value, float) and math.isinf(value) else value
        for key, value in figures.items()
    }


def _all_cases(folder: Path) -> list[str]:
    names = case_names(folder)
    if not names:
        raise JudgeError(f"{folder} holds no case.", fix="Give a folder with NAME/oracle.csv.")
    return names


def main(arguments: list[str] | None = None) -> int:
    """Judge a method from the command line."""
    parser = argparse.ArgumentParser(prog="judge.py", description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("method", type=Path, help="Python file with load(case), FMU, or CSV table of forces")
    parser.add_argument("--case", action="append", help="one of the cases; several times for several")
    parser.add_argument("--cases", type=Path, default=CASES, help="folder of the cases")
    parser.add_argument("--json", type=Path, help="file for the figures")
    options = parser.parse_args(arguments)
    try:
        results = {}
        for name in options.case or _all_cases(options.cases):
            case = read_case(name, options.cases)
            results[name] = judge(read_method(options.method, case), case)
    except JudgeError as error:
        print(error, file=sys.stderr)
        return 2
    print(table_text(results))
    if options.json:
        plain = {name: plain_figures(figures) for name, figures in results.items()}
        try:
            options.json.write_text(json.dumps(plain, indent=2, allow_nan=False) + "\n", "utf-8")
        except OSError as error:
            print(f"{options.json} can't be written: {error}", file=sys.stderr)
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
