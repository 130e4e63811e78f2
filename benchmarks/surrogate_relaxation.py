"""Branches of relaxation on an elastic energy, against transient finite elements.

The file ``benchmarks/data/visco.npz`` (made by `benchmarks.visco_data`) holds drives by name: ``<drive>_t`` (N,) in s,
``_c`` (N, 3) centres in m, ``_F`` transient forces in N, ``_U`` elastic energies in J and ``_Fe`` elastic forces in N
of the same positions, and ``height`` of the touched plane in m. Drives called ``hold…`` are pressed at once and held:
the parameters come from them alone. The patches' width was chosen on all but the drive called ``unseen``.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.surrogate_cases import DATA
from benchmarks.table import Claim, Column, Table, quick_mark
from palpate.learning.relaxation import Record, identify_behind_pad
from palpate.surrogates.memories import Patches, RelaxationState, course
from palpate.surrogates.memories.patches import LEAST

__all__ = ["relaxation_table"]

RADIUS, SPACING, DEPTH = 0.01, 0.0025, 0.004  # m
FLOOR = 0.05  # of the drive's largest force: below, errors are relative to that
AIM, TIMES = 0.05, 3.0
Drive = dict[str, np.ndarray]


def relaxation_table(quick: bool) -> list[Table]:
    """Errors on each drive; nothing where there is no file."""
    path = DATA / "visco.npz"
    if not path.exists():
        return []
    drives, height = _drives(path)
    holds = [d for name, d in drives.items() if name.startswith("hold")]
    found = identify_behind_pad(
        [Record(d["t"], d["F"][:, 2], energy=float(d["U"][0])) for d in holds], most=2
    )
    patches = _patches(drives, height)
    rows = [
        _row(name, drive, replace(found.relaxation, patches=patches).start())
        for name, drive in drives.items()
    ]
    drive = next((row for row in rows if row["drive"] == "unseen"), rows[-1])
    return [
        Table(
            "surrogates-relaxation",
            f"Relaxation against transient finite elements{quick_mark(quick)}",
            (
                Column("drive", "drive"),
                Column("seconds", "s", ".0f"),
                Column("samples", "samples"),
                Column("median", "error, median", ".1%"),
                Column("p95", "p95", ".1%"),
                Column("elastic", "elastic only, p95", ".0%"),
                Column("times", "times worse", ".1f"),
                Column("stored", "least stored, J", ".1e"),
                Column("lost", "least loss of a step, J", ".1e"),
            ),
            rows,
            (
                Claim(f"error p95 on the {drive['drive']} drive", (drive["p95"],), AIM, ".1%"),
                Claim("3 over how much worse elastic only is", (TIMES / drive["times"],), 1.0, ".2f"),
                Claim("energy stored below zero, J, most", (max(-r["stored"] for r in rows),), 0.0),
                Claim("energy given by a step's dissipation, J, most", (max(-r["lost"] for r in rows),), 0.0),
            ),
            (
                f"identified on held presses alone: {found.relaxation}",
                f"errors relative to the transient force, at least {FLOOR:.0%} of the drive's largest; elastic "
                "energies and forces by finite elements, so nothing learnt is in between",
            ),
        )
    ]


def _drives(path: Any) -> tuple[dict[str, Drive], float]:
    """Drives by name, and the height of the touched plane."""
    with np.load(path) as data:
        names = [key[:-2] for key in data.files if key.endswith("_t")]
        drives = {name: {k: data[f"{name}_{k}"] for k in ("t", "c", "F", "U", "Fe")} for name in names}
        return drives, float(data["height"])


def _patches(drives: dict[str, Drive], height: float) -> Patches:
    """A grid under all that is touched, as wide as the contact of a middling depth asks for."""
    c, energy = (np.concatenate([d[key] for d in drives.values()]) for key in ("c", "U"))
    depth = height + RADIUS - c[:, 2]
    deep = np.argsort(depth)
    low, high = c[:, :2].min(axis=0) - RADIUS, c[:, :2].max(axis=0) + RADIUS
    axes = [np.arange(a, b + SPACING, SPACING) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    points = np.c_[grid, np.full(len(grid), height)]
    middle = float(np.interp(DEPTH, depth[deep], energy[deep]))
    return Patches(points, Patches.width_at(RADIUS, DEPTH), middle, LEAST * SPACING)


def _row(name: str, drive: Drive, memory: RelaxationState) -> dict[str, Any]:
    felt = course(memory, drive["t"], drive["c"], np.maximum(drive["U"], 0.0), -drive["Fe"])
    size = np.linalg.norm(drive["F"], axis=1)
    scale = np.maximum(size, FLOOR * size.max())
    contact = (size > 0) | felt.force.any(axis=1)
    error = (np.linalg.norm(felt.force - drive["F"], axis=1) / scale)[contact]
    elastic = (np.linalg.norm(drive["Fe"] - drive["F"], axis=1) / scale)[contact]
    p95, plain = float(np.quantile(error, 0.95)), float(np.quantile(elastic, 0.95))
    return {
        "drive": name,
        "seconds": float(drive["t"][-1]),
        "samples": len(size),
        "median": float(np.median(error)),
        "p95": p95,
        "elastic": plain,
        "times": plain / p95,
        "stored": float(felt.stored.min()),
        "lost": float(np.diff(felt.lost, prepend=0.0).min()),
    }
