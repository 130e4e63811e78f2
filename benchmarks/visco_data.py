"""Make the data of relaxation by transient finite elements: ``python -m benchmarks.visco_data --out FILE``.

A block of 60 × 60 × 30 mm, neo-Hookean with a Prony series of 0.3 / 0.2 in 0.1 / 2 s, elements of 10 mm, under the
sphere of 10 mm with its pad. Every drive is solved in time, and its positions once more by the elastic body alone.
A drive that the file holds already is left as it is.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from palpate.learning.relaxation import Drive, ramp, random_drive, sinusoid, step_hold
from palpate.physics.interactions import SphereProbe
from palpate.physics.materials import NeoHookean, Viscoelastic
from palpate.physics.shapes import Block
from palpate.physics.solid import Body

__all__ = ["BRANCHES", "drives", "main"]

HEIGHT, RADIUS, ELEMENT = 0.03, 0.01, 0.01  # m
BRANCHES = ((0.3, 0.1), (0.2, 2.0))  # shares, s
TOUCH = (0.0302, 0.0297, HEIGHT + RADIUS)
HELD = (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 0.75, 1, 1.5, 2, 3, 4, 6, 9, 14)  # s


def drives() -> dict[str, Drive]:
    """Motions by name."""
    return {
        "hold2": step_hold(TOUCH, 0.002, HELD),
        "hold5": step_hold(TOUCH, 0.005, HELD),
        "ramp": ramp(TOUCH, 0.005, 0.5, 0.05, hold=1.0, fall=0.3),
        "sine": sinusoid(TOUCH, 0.003, 0.002, 0.5, 0.1, cycles=1.5),
        "slide": _slide(),
        "random": random_drive(TOUCH, 0.005, 0.008, seconds=20, dt=0.07, seed=3, band=0.7),
        # the patches' width was chosen on those above
        "unseen": random_drive(TOUCH, 0.005, 0.008, seconds=20, dt=0.07, seed=4, band=0.7),
    }


def _slide() -> Drive:
    """Pressed in by 4 mm, held for a second, then slid by 17 mm."""
    times = np.concatenate([[1e-6, 0.1, 0.3, 0.6, 1.0], 1.0 + 0.07 * np.arange(1, 18)])
    x = np.concatenate([np.zeros(5), 0.001 * np.arange(1, 18)]) - 0.008
    return Drive("slide", times, np.array(TOUCH) + np.c_[x, 0 * x, np.full(len(x), -0.004)])


def _solve(drive: Drive) -> dict[str, np.ndarray]:
    elastic = NeoHookean(9e3, 0.45)
    probe = SphereProbe(RADIUS, depth=(0.0, 0.006))

    def opened(material: Any) -> Any:
        return (
            Body(Block((0.06, 0.06, HEIGHT)), material, fixed="bottom").problem(probe, element=ELEMENT).open()
        )

    transient = opened(Viscoelastic(elastic, BRANCHES)).march(drive.times, drive.positions)
    solver = opened(elastic)
    still = [solver.solve(c) for c in drive.positions]
    if not all(found.converged for found in (*transient, *still)):
        raise RuntimeError(f"a solve of {drive.name} did not converge")
    return {
        "t": drive.times,
        "c": drive.positions,
        "F": np.array([found.response for found in transient]),
        "U": np.array([found.potential_energy for found in still]),
        "Fe": np.array([found.response for found in still]),
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Solve what the file lacks."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.visco_data")
    parser.add_argument("--out", type=Path, required=True, help="file of drives (.npz)")
    parser.add_argument("--only", nargs="+", choices=drives(), help="some of the drives")
    options = parser.parse_args(arguments)
    known: dict[str, Any] = dict(np.load(options.out)) if options.out.exists() else {}
    for name, drive in drives().items():
        if f"{name}_t" in known or (options.only and name not in options.only):
            continue
        begun = time.process_time()
        known |= {f"{name}_{key}": value for key, value in _solve(drive).items()}
        known |= {"height": HEIGHT, "provenance": __doc__}
        np.savez_compressed(options.out, **known)
        print(f"{name}: {len(drive)} samples, {time.process_time() - begun:.0f} s", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
