"""Draw docs/images/friction.png: the force of a ball that slides to and fro, beside the laws that it follows."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt

from palpate.surrogates.memories import Friction

DEPTH, RATIO, STIFF = 2e-3, 0.7, 1e3  # m; ρ; N/m^m
STATIC, KINETIC = 0.45, 0.3


def lead(friction: Friction, x: np.ndarray, s: np.ndarray, dt: float = 1e-3) -> np.ndarray:
    """Return the force (N,) along x over the normal force at the full depth, along slips and depths in m."""
    m, state, out = friction.exponent, friction.start(), []
    for place, depth in zip(x, s, strict=True):
        q = np.sqrt(2 * STIFF * depth ** (m + 1) / (m + 1))
        slope = np.array([0.0, 0.0, -STIFF * depth**m / q])
        state.step(np.array([place, 0.0, -depth]), float(q), slope, dt)
        out.append(state.force[0] / (STIFF * DEPTH**m))
    return np.array(out)


def main() -> None:
    """Write the picture."""
    end, n = KINETIC * DEPTH / RATIO, 400
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.4), constrained_layout=True)
    law = Friction.over(DEPTH, KINETIC, ratio=RATIO)
    for share in (0.4, 0.8, 1.5):
        A = share * end
        x = np.concatenate([np.linspace(0, A, n), np.linspace(A, -A, 2 * n), np.linspace(-A, A, 2 * n)])
        axes[0].plot(1e3 * x, -lead(law, x, np.full(len(x), DEPTH)), linewidth=1.2)
    x = np.linspace(0, end, 60)
    exact = KINETIC * (1 - (1 - x / end) ** 1.5)
    axes[0].plot(1e3 * x, exact, "k--", linewidth=1, label="Cattaneo–Mindlin")
    axes[0].set(title="to and fro at one depth", xlabel="slip, mm", ylabel="force over the normal force")
    axes[0].legend(frameon=False)
    both = Friction.over(DEPTH, KINETIC, STATIC, ratio=RATIO)
    x = np.concatenate(
        [np.linspace(0, 6 * end, 3 * n), np.full(1000, 6 * end), np.linspace(6 * end, 9 * end, 2 * n)]
    )
    axes[1].plot(1e3 * x, -lead(both, x, np.full(len(x), DEPTH), 2e-4), linewidth=1.2)
    axes[1].set(title="static 0.45, kinetic 0.3, with a rest of 0.2 s", xlabel="slip, mm")
    t = np.linspace(0, 2, 4 * n)
    s = DEPTH * (0.6 + 0.4 * np.cos(2 * np.pi * 3 * t))
    x = 2 * end * np.sin(2 * np.pi * t)
    axes[2].plot(t, -lead(law, x, s, t[1]), linewidth=1.2, label="force along x")
    axes[2].plot(t, KINETIC * (s / DEPTH) ** 1.5, "k:", linewidth=1, label="μ × normal force")
    axes[2].plot(t, -KINETIC * (s / DEPTH) ** 1.5, "k:", linewidth=1)
    axes[2].set(title="while the depth changes", xlabel="time, s", ylim=(-0.48, 0.34))
    axes[2].legend(frameon=False, loc="lower left")
    figure.savefig(Path(__file__).parent / "images" / "friction.png", dpi=110)


if __name__ == "__main__":
    main()
