"""The touched surface seen from outside: where the force is off, and where the surrogate says it may be trusted."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.surrogates import TouchSurrogate
from palpate.validation.force import ForceSamples
from palpate.validation.report.style import INK, figure, loads_map
from palpate.validation.report.surrogates.view import View, at_depth, deepest, feet
from palpate.validation.solves import TouchSolves

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["plot_errors", "plot_trust"]

GRID = 61  # places across, for the map of trust
MARGIN = 0.12  # of the tested part's size, drawn around it
MARKED = 5


def plot_errors(surrogate: TouchSurrogate, test: TouchSolves, samples: ForceSamples) -> Figure:
    """One dot per unseen solve, where the probe touches: shallow third, middle, deep third side by side."""
    fig, axes = figure(1, 3, size=(9.4, 3.5), sharex=True, sharey=True)
    fig.set_layout_engine("compressed")
    view = View.of(surrogate, test.X)
    places, depth = 1e3 * view.flat(feet(surrogate, test.X)), surrogate.depth(test.X)
    against = np.where(samples.heavy, samples.relative, samples.error / samples.light)
    top = max(float(np.quantile(100 * against, 0.98)), 1e-6)
    rows = np.flatnonzero(samples.heavy)
    worst = rows[np.argsort(-samples.jnd[rows], kind="stable")][:MARKED]
    ends = np.linspace(0.0, depth.max(), 4)
    drawn: Any = None
    for k, (axis, name) in enumerate(zip(axes[0], ("shallow third", "middle", "deep third"), strict=True)):
        some = (depth > ends[k]) & (depth <= ends[k + 1] * (1 + 1e-12))
        drawn = axis.scatter(
            *places[some].T, c=100 * against[some], s=22, cmap=loads_map(), vmin=0.0, vmax=top, linewidths=0
        )
        for place, numbers in _marks(places, worst, some).items():
            axis.annotate(numbers, place, (5, 4), textcoords="offset points", fontsize=8.5, weight="bold")
        axis.set_title(f"{name}\nto {1e3 * ends[k + 1]:.1f} mm")  # panels may be narrow
        _framed(axis, view)
    axes[0, 1].set_ylabel("")
    axes[0, 2].set_ylabel("")
    over = "max" if 100 * float(against.max()) > top else "neither"  # the colours end below the worst
    fig.colorbar(drawn, ax=axes, label="force error / %", extend=over, shrink=0.85, aspect=30, pad=0.02)
    return fig


def _marks(places: np.ndarray, worst: np.ndarray, some: np.ndarray) -> dict[tuple[float, ...], str]:
    """Numbers of the worst solves among `some` by their place (2,) in mm; those above one foot stand together."""
    found: dict[tuple[float, ...], str] = {}
    for number, row in enumerate(worst, 1):
        if some[row]:
            place = tuple(np.round(places[row], 1).tolist())
            found[place] = f"{found[place]}, {number}" if place in found else str(number)
    return found


def plot_trust(surrogate: TouchSurrogate, test: TouchSolves) -> Figure:
    """Deviation of the force at half and at the full depth of the test; hatched where training ended.

    Of a family it is that of the body with the deepest touch.
    """
    fig, axes = figure(1, 2, size=(9.4, 3.7), sharex=True, sharey=True)
    fig.set_layout_engine("compressed")
    view, depth = View.of(surrogate, test.X), surrogate.depth(test.X)
    touched = view.flat(feet(surrogate, test.X[depth > 0]))
    low, high = touched.min(axis=0), touched.max(axis=0)
    more = MARGIN * (high - low).max()
    sides = [np.linspace(a - more, b + more, GRID) for a, b in zip(low, high, strict=True)]
    places = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 2)
    like, full = deepest(surrogate, test.X), 0.98 * float(depth.max())
    found = [_trusted(surrogate, at_depth(surrogate, view, places, like, s)) for s in (full / 2, full)]
    trained = np.concatenate([d[i == 1] for d, i in found])
    top = 2 * float(trained.max()) if trained.size else 1.0  # far outside it grows without bound
    for axis, s, (deviation, inside) in zip(axes[0], (full / 2, full), found, strict=True):
        _draw_trust(axis, sides, deviation, inside, top)
        axis.plot(*(1e3 * touched.T), ".", color=INK, markersize=2, alpha=0.35)
        axis.set_title(f"{1e3 * s:.1f} mm deep")
        _framed(axis, view)
    axes[0, 1].set_ylabel("")
    if axes[0, 0].collections:
        shades = next(c for c in axes[0, 0].collections if c.get_array() is not None)
        fig.colorbar(shades, ax=axes, label="deviation of the force / %", shrink=0.85, aspect=30, pad=0.02)
    return fig


def _trusted(surrogate: TouchSurrogate, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Deviation in per cent and whether trained, as grids; not-a-number where no probe can be so deep."""
    there = np.isfinite(X).all(axis=1)
    deviation, inside = np.full(len(X), np.nan), np.full(len(X), np.nan)
    if there.any():
        inside[there] = surrogate.inside(X[there])
        deviation[there] = 100 * surrogate.deviation(X[there]) if surrogate.root is not None else 0.0
    return deviation.reshape(GRID, GRID), inside.reshape(GRID, GRID)


def _draw_trust(
    axis: Any, sides: list[np.ndarray], deviation: np.ndarray, inside: np.ndarray, top: float
) -> None:
    axis.pcolormesh(
        1e3 * sides[0],
        1e3 * sides[1],
        deviation.T,
        cmap=loads_map(),
        vmin=0.0,
        vmax=max(top, 1e-9),
        shading="nearest",
        rasterized=True,
    )
    outside = np.where(np.isnan(inside), 0.0, 1.0 - inside)
    if outside.any():
        axis.contourf(
            1e3 * sides[0], 1e3 * sides[1], outside.T, levels=[0.5, 1.5], colors="none", hatches=["///"]
        )


def _framed(axis: Any, view: View) -> None:
    across, up = view.labels()
    axis.set_xlabel(across)
    axis.set_ylabel(up)
    axis.set_aspect("equal", adjustable="box")
    axis.grid(visible=False)
