"""How a held body's force is learnt from few solves: a learnt energy beside interpolation of the forces.

python -m benchmarks.grasping [--effort 0.3]        errors on unseen solves against the number of solves, as a table

The solves, of the block of docs/method/grasp.md, lie in grasp_block.npz with words of how they were made.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from palpate.learning.energy import learn_energy
from palpate.learning.pad_fit import fit_pad
from palpate.surrogates import Solves
from palpate.units import Range

__all__ = ["INPUTS", "SQUARE", "errors", "interpolated", "solves"]

DATA = Path(__file__).with_name("grasp_block.npz")
INPUTS = (
    *(Range(f"d_{axis}", -0.01, 0.01, "m") for axis in "xyz"),
    *(Range(f"p_{axis}", 0.03, 0.07, "m") for axis in "xy"),
)
SQUARE = tuple(
    np.array(m, dtype=float)
    for s in (1, -1)
    for t in (1, -1)
    for m in ([[s, 0, 0], [0, t, 0], [0, 0, 1]], [[0, s, 0], [t, 0, 0], [0, 0, 1]])
)
COUNTS = (10, 20, 40, 80)


def solves(role: str) -> dict[str, np.ndarray]:
    """X (N, 5), energy (N,), force (N, 5) and stiffness (N, 5, 5) of the "train", "unseen" or "rest" solves."""
    with np.load(DATA) as file:
        rows = (file["role"] == role) & file["converged"]
        return {name: file[name][rows] for name in ("X", "energy", "force", "stiffness")}


def errors(force: np.ndarray, stiffness: np.ndarray | None, truth: dict[str, np.ndarray]) -> list[float]:
    """Force error median and p95 (%), angle p95 (°), stiffness error p95 (%)."""
    F, K = truth["force"][:, :3], truth["stiffness"][:, :3, :3]
    size, own = np.linalg.norm(F, axis=1), np.linalg.norm(force, axis=1)
    relative = np.linalg.norm(force - F, axis=1) / size
    angle = np.degrees(np.arccos(np.clip((force * F).sum(axis=1) / (size * own), -1, 1)))
    found = [100 * np.median(relative), 100 * np.quantile(relative, 0.95), np.quantile(angle, 0.95)]
    if stiffness is None:
        return [*found, np.nan]
    stiff = np.linalg.norm(stiffness - K, axis=(1, 2)) / np.linalg.norm(K, axis=(1, 2))
    return [*found, 100 * np.quantile(stiff, 0.95)]


def interpolated(train: dict[str, np.ndarray], X: np.ndarray, *, images: bool) -> np.ndarray:
    """Forces (N, 3) by cubic radial interpolation of the solves' forces, or of those and their images."""
    from scipy.interpolate import RBFInterpolator

    at, F = train["X"], train["force"][:, :3]
    if images:
        middle = np.array([0.05, 0.05])
        at = np.vstack(
            [np.hstack([at[:, :3] @ M.T, (at[:, 3:] - middle) @ M[:2, :2].T + middle]) for M in SQUARE]
        )
        F = np.vstack([F @ M.T for M in SQUARE])
    low, high = np.array([[r.low, r.high] for r in INPUTS]).T
    scaled = [(2 * Y - low - high) / (high - low) for Y in (at, X)]
    degree = 1 if len(at) > 6 else 0
    return np.asarray(RBFInterpolator(scaled[0], F, kernel="cubic", degree=degree)(scaled[1]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--effort", type=float, default=0.3, help="of each search of units")
    effort = parser.parse_args().effort
    train, test = solves("train"), solves("unseen")
    print(f"{len(test['X'])} unseen solves; error of the force median / p95, its angle p95, stiffness p95")
    for count in sorted({min(n, len(train["X"])) for n in COUNTS}):
        some = {name: values[:count] for name, values in train.items()}
        begun = time.perf_counter()
        known = Solves(
            some["X"], some["energy"], some["force"], some["stiffness"], INPUTS, np.array(SQUARE), axes=(0, 1)
        )
        S = learn_energy(known, fit_pad(known)[0], units_max=192, networks=4, effort=effort)[0]
        took = time.perf_counter() - begun
        rows = {
            f"learnt energy, {S.network.units // 8} units, {took:.0f} s": (
                S.force(test["X"]),
                S.stiffness(test["X"]),
            ),
            "cubic RBF of forces": (interpolated(some, test["X"], images=False), None),
            "cubic RBF of forces and their images": (interpolated(some, test["X"], images=True), None),
        }
        for name, (F, K) in rows.items():
            median, p95, angle, stiff = errors(F, K, test)
            print(
                f"{count:4d}  {name:40s} {median:6.2f} % {p95:6.2f} % {angle:6.2f}° {stiff:6.2f} %",
                flush=True,
            )


if __name__ == "__main__":
    main()
