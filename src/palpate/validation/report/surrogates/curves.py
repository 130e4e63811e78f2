"""Force against depth: the surrogate's curve along the normal, and the finite-element solves that lie on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from palpate.surrogates import TouchSurrogate
from palpate.validation.report.style import figure, series
from palpate.validation.report.surrogates.view import further
from palpate.validation.solves import TouchSolves

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Curve", "curves", "plot_curves"]

LINES = 6
NEAR = 0.02  # of the radius: solves so near to a line lie on it


@dataclass(frozen=True, eq=False)
class Curve:
    """One line into the body.

    Attributes
    ----------
    depth, force : (M,)
        Of the surrogate, m and N.
    rows : (k,)
        Solves on the line, the deepest first.
    """

    depth: np.ndarray
    force: np.ndarray
    rows: np.ndarray


def curves(surrogate: TouchSurrogate, test: TouchSolves, most: int = LINES) -> list[Curve]:
    """Lines through deep solves far from each other, those first that have most solves on them."""
    depth, X = surrogate.depth(test.X), test.X
    radius = surrogate.radius if surrogate.radius_input is None else X[:, surrogate.radius_input].mean()
    normals = surrogate.surface.at(X[:, :3])[1]
    lines = {
        i: _on_line(X, i, normals[i], NEAR * radius) for i in np.argsort(-depth) if depth[i] > depth.max() / 2
    }
    chosen: list[int] = []
    for i in sorted(lines, key=lambda i: -len(lines[i])):
        if all(np.linalg.norm(X[i, :3] - X[k, :3]) > radius for k in chosen):
            chosen.append(int(i))
        if len(chosen) == most:
            break
    return [_curve(surrogate, X, i, normals[i], depth, lines[i]) for i in chosen]


def _on_line(X: np.ndarray, i: int, normal: np.ndarray, near: float) -> np.ndarray:
    away = X[:, :3] - X[i, :3]
    aside = np.linalg.norm(away - (away @ normal)[:, None] * normal, axis=1)
    return np.flatnonzero((aside <= near) & (X[:, 3:] == X[i, 3:]).all(axis=1))


def _curve(
    surrogate: TouchSurrogate, X: np.ndarray, i: int, normal: np.ndarray, depth: np.ndarray, rows: np.ndarray
) -> Curve:
    line = np.repeat(X[i][None], 121, axis=0)
    line[:, :3] += np.linspace(0.0, 1.0, 121)[:, None] * depth[i] * normal
    force = np.linalg.norm(surrogate.force(line), axis=1)
    return Curve(surrogate.depth(line), force, rows[np.argsort(-depth[rows])])


def plot_curves(surrogate: TouchSurrogate, test: TouchSolves) -> Figure:
    """Size of the force against depth, lines of the surrogate and dots of finite elements."""
    fig, axes = figure(1, 1, size=(9.4, 3.6))
    axis, drawn = axes[0, 0], curves(surrogate, test)
    depth, size = surrogate.depth(test.X), np.linalg.norm(test.force, axis=1)
    names = [r.name for r in surrogate.inputs[:3]]
    for curve, style in zip(drawn, series(len(drawn)), strict=True):
        x = test.X[curve.rows[0]]
        place = ", ".join(f"{n} = {1e3 * v:.1f}" for n, v in zip(names, x[:3], strict=True)) + " mm"
        label = "; ".join(filter(None, (place.replace("-", "−"), further(surrogate, x))))
        axis.plot(1e3 * curve.depth, curve.force, label=label, **style)
        axis.plot(1e3 * depth[curve.rows], size[curve.rows], "o", color=style["color"], markersize=4.5)
    axis.set_xlabel("depth of the probe into the surface at rest / mm")
    axis.set_ylabel("‖F‖ / N")
    axis.set_xlim(left=0)
    axis.set_ylim(bottom=0)
    axis.legend(
        loc="best",
        title="line: surrogate, dots: finite elements; the deepest probe's centre at",
        title_fontsize=8.5,
    )
    return fig
