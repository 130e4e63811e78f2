"""Organs touched wherever they were painted: the error over all of the painted area, what is not trained being missed.

    python -m benchmarks.painted_parts [PART …] [--solves 60] [--unseen 30] [--workers N] [--folder DIR] [--out FILE]

PART is kidney, liver, heart, prostate, one of `scripted_parts`, or a file. Each gets the study that `palpate touch`
makes of it, with elements of half the ball's radius or larger; solves are chosen as there, until there are so many.
Then presses that nothing was learnt from are solved, drawn evenly over the painted area and all depths. A press outside
the trained region counts as missed, and its error counts no less. All solves are kept in the folder: another run learns
anew from them. `--before 12,20,32` also compares the closest point with the overlap on the first solves.
Not one of the tables that run by themselves: an organ takes five to ten minutes of a core.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import scripted_parts

SAMPLES = ("kidney", "liver", "heart", "prostate")
SEED = 99  # of the presses that judge
EFFORT = 0.5  # of the last search, as that of `palpate touch` near the wanted error
FLOOR = 0.05  # of the largest force: what errors of smaller forces are over


def judge(energy: Any, solved: Any) -> dict[str, float]:
    """Return the errors of an energy's force on solved presses all over the painted area, and how many it misses."""
    errors, angles = force_errors(energy.force(solved.X), np.asarray(solved.force))
    inside, deviation = energy.inside(solved.X), energy.deviation(solved.X)
    return {
        "presses": len(solved),
        "missed": float(1 - inside.mean()),
        "median": float(np.median(errors)),
        "p95": float(np.quantile(errors, 0.95)),
        "largest": float(errors.max()),
        "p95_trained": float(np.quantile(errors[inside], 0.95)) if inside.any() else float("nan"),
        "direction_p95": float(np.quantile(angles, 0.95)),
        # the interval of 90 % of a normal law
        "coverage": float((errors <= 1.645 * deviation).mean()),
    }


def compare_forms(data: Any, solved: Any, numbers: list[int]) -> list[dict[str, Any]]:
    """Return the errors after the first solves by the closest point, and by each weight of the overlap.

    A Gaussian process stands in the network's place: it has no starts to draw, so it compares forms with less scatter.
    """
    from palpate.improvement.force_model import ForceModel
    from palpate.learning.pressed_solves import PressedSolves

    rows = []
    for number in numbers:
        pressed = PressedSolves.of(data.take(np.arange(number)))
        for form in (pressed.baseline, *pressed.overlap_baselines()):
            model = ForceModel.fit(pressed.solves, form)
            errors, angles = force_errors(model.force(solved.X), np.asarray(solved.force))
            rows.append(
                {
                    "solves": number,
                    "weight": getattr(form, "weight", 0.0),
                    "median": float(np.median(errors)),
                    "p95": float(np.quantile(errors, 0.95)),
                    "direction_p95": float(np.quantile(angles, 0.95)),
                    "misfit": model.process.misfit,
                }
            )
            print(rows[-1], flush=True)
    return rows


def force_errors(learnt: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the relative errors (N,) of learnt forces (N, 3), and the angles (N,) in degrees to the solved ones."""
    size = np.linalg.norm(force, axis=1)
    errors = np.linalg.norm(learnt - force, axis=1) / np.maximum(size, FLOOR * size.max())
    cosine = (learnt * force).sum(axis=1) / np.maximum(np.linalg.norm(learnt, axis=1) * size, 1e-300)
    return errors, np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def part_file(name: str, folder: Path) -> Path:
    """Return the file of a part by its name, written where it is not there yet."""
    from palpate.physics.shapes.sample_part import write_sample_part

    if Path(name).exists():
        return Path(name)
    if name in SAMPLES:
        path = folder / f"{name}.stl"
        return path if path.exists() else write_sample_part(path, name)
    return Path(getattr(scripted_parts, name)(folder))


def read_part(part: Path, given: argparse.Namespace) -> Any:
    """Return the study of a part without its shape, for the force alone is judged."""
    from palpate.study.part_study import part_study, part_text, study_file
    from palpate.study.toml import read_study

    file = study_file(part)
    if not file.exists():
        file.write_text(part_text(*part_study(part)), encoding="utf-8")
    study = read_study(file)
    element = max(study.sweep.element, given.element * study.interaction.radius)
    return study.model_copy(
        update={
            "sweep": study.sweep.model_copy(update={"element": element, "workers": given.workers}),
            "test": study.test.model_copy(update={"finer": 0}),
            "learning": study.learning.model_copy(
                update={"shape": False, "workers": given.workers, "effort": EFFORT}
            ),
        }
    )


def touch(part: Path, given: argparse.Namespace) -> dict[str, Any]:
    """Return what the surrogate of so many solves of a part is worth all over its paint."""
    from palpate.options import ImprovementOptions
    from palpate.study.improve_study import improve_study
    from palpate.study.run import Paths, learn_study
    from palpate.sweeps import sweep

    study, began = read_part(part, given), time.perf_counter()
    options = ImprovementOptions(until=1e-3, most=given.solves, batch=given.batch)
    last = None
    for step in improve_study(study, Paths(part.parent, study.name), options=options, progress=False):
        last = step
        print(
            f"{part.stem}: {step.phase}, {step.solves} solves, {step.error:.3f}, {step.seconds:.0f} s",
            flush=True,
        )
    assert last is not None
    # far from the wanted error the search is quick; this is the one that a surrogate near it gets
    surrogate, _ = learn_study(study, last.train)
    problem, seconds = study.problem(), time.perf_counter() - began
    points = problem.interactions[0].random_presses(problem.body.geometry, given.unseen, SEED)
    path = part.with_name(f"{part.stem}-painted.zarr")
    solved = sweep(problem, points=points, progress=False, path=path, workers=given.workers).ok
    energy = surrogate.energy
    row: dict[str, Any] = {"part": part.stem, "solves": last.solves, "seconds": seconds}
    row |= {"element": study.sweep.element, "baseline": str(energy.baseline)}
    row |= surrogate.meta.get("painted", {})
    row |= {"unsolved": given.unseen - len(solved), **judge(energy, solved)}
    # both kinds of unseen solves tell of the stated interval
    row["coverage_pooled"] = float(
        np.average(
            [row["coverage"], judge(energy, last.test)["coverage"]], weights=[len(solved), len(last.test)]
        )
    )
    if given.before:
        row["before"] = compare_forms(last.train, solved, given.before)
    return row


def main() -> None:
    """Judge the parts that are named, or the kidney and the liver, and write their figures after each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parts", nargs="*", default=["kidney", "liver"])
    parser.add_argument("--solves", type=int, default=60)
    parser.add_argument("--unseen", type=int, default=30)
    parser.add_argument("--workers", type=int)
    parser.add_argument("--element", type=float, default=0.5, help="size over the ball's radius, at least")
    # fewer searches than with the four solves at a time of `palpate touch`
    parser.add_argument("--batch", type=int, default=24, help="solves that are chosen at a time")
    parser.add_argument("--before", type=lambda text: [int(n) for n in text.split(",")], default=[])
    parser.add_argument("--folder", type=Path, default=Path("parts"))
    parser.add_argument("--out", type=Path, default=Path("painted_parts.json"))
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for name in given.parts:
        rows.append(touch(part_file(name, given.folder), given))
        given.out.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        print(rows[-1], flush=True)


if __name__ == "__main__":
    main()
