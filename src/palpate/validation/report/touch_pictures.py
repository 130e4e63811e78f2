"""Pictures of a body that is touched on a surface: force against depth, and maps of the surface seen from outside."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.format import share
from palpate.surrogates import LearntEnergy, TouchedSurface
from palpate.validation.figures.smoothness import Smoothness
from palpate.validation.report.chapter import Chapter
from palpate.validation.report.style import INK, Picture, figure, loads_map, picture, series
from palpate.validation.unseen_solves import ForceSamples, TouchSolves, felt_force

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "Curve",
    "View",
    "at_depth",
    "contact_points",
    "curves",
    "deepest",
    "further",
    "plot_curves",
    "plot_errors",
    "plot_trust",
    "touch_pictures",
]

AXES = ("x", "y", "z")
ALONG = 0.9  # cosine from which a direction of the view is called by an axis
# a view so little off an axis is still drawn with x across: a few contacts on a dome lie on one side
TILT = 0.3
LINES = 6  # curves that are drawn, at most
NEAR = 0.02  # distance over the radius, within which a solve lies on a line
GRID = 61  # places across, for the map of trust
MARGIN = 0.12  # width of the margin around the tested part, over its size
MARKED = 5  # worst solves that get a mark


def touch_pictures(chapter: Chapter, key: str) -> list[Picture]:
    """Draw the pictures of a body that is touched on a surface; none of other models."""
    model, test, v = chapter.surrogate, chapter.subject.solves, chapter.validation
    samples = chapter.subject.samples
    if test is None or samples is None or model is None or model.hand_energy.baseline.surface is None:
        return []
    energy = model.hand_energy
    off = "No touch was strong enough to judge in relative terms."
    if v.force.p95 is not None and v.force.max is not None:
        off = f"95 of 100 forces are within {share(v.force.p95)}, all within {share(v.force.max)}."
    smooth = "" if v.smoothness is None else _smooth(v.smoothness)
    part = _part(model.meta)
    trust = "Colour: standard deviation of the force that the surrogate states."
    if energy.root is None:
        trust = "The surrogate states no deviation."
    if body := further(energy, deepest(energy, test.X)):
        trust += f" Shown for {body}."
    return [
        picture(
            f"{key}-curves",
            "Force against depth",
            f"Size of the force on the probe of {chapter.name} against its depth, surrogate and finite elements. {off}",
            f"Lines into the body along its normal, through the deepest unseen solves. {off}{smooth}",
            lambda: plot_curves(energy, test),
        ),
        picture(
            f"{key}-map",
            "Error on the touched surface",
            f"Force error of {chapter.name} at each unseen solve, on the surface seen from outside. {off}",
            "One dot per unseen solve, where the probe touches; forces up to f₀ are judged against f₀. Numbers mark "
            f"the worst cases of the table. {off}{part}",
            lambda: plot_errors(energy, test, samples),
        ),
        picture(
            f"{key}-trust",
            "Where to trust it",
            f"Stated deviation of the force of {chapter.name} on the surface seen from outside, at two depths. {trust}",
            f"{trust} Hatched: outside what was trained. Dots: unseen solves.{part}",
            lambda: plot_trust(energy, test),
        ),
    ]


def _smooth(smooth: Smoothness) -> str:
    return (
        f" Along strokes at 0.1 m/s the force changes its rate from one millisecond to the next at most "
        f"{smooth.p95:.2f} times as much as its reference ({smooth.reference}), in 95 of 100 strokes."
    )


def _surface(energy: LearntEnergy) -> TouchedSurface:
    """Return the touched surface of a body that has one."""
    surface = energy.baseline.surface
    assert surface is not None
    return surface


def _part(meta: Mapping[str, Any]) -> str:
    """Return that symmetry was used, where it was: the picture shows less than the body."""
    solves, samples = meta.get("solves", 0), meta.get("samples", 0)
    if not samples > solves:
        return ""
    return (
        " Solved, tested and drawn is a part of the body of which the rest is mirror images or turned copies; the "
        "surrogate answers there alike."
    )


@dataclass(frozen=True, eq=False)
class View:
    """Directions (3,) across and up the page, and towards who looks."""

    across: np.ndarray
    up: np.ndarray
    out: np.ndarray

    @classmethod
    def of(cls, energy: LearntEnergy, X: np.ndarray) -> View:
        """Return the view from where the touches X (N, n) come."""
        out = _surface(energy).at(X[:, :3])[1].mean(axis=0)
        length = float(np.linalg.norm(out))
        out = out / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])
        # the axis that is most across becomes the page's, so that a flat block is seen as it is drawn
        axis = np.eye(3)[int(np.argmin(np.abs(out) + TILT * np.arange(3)))]
        across = axis - (axis @ out) * out
        across /= np.linalg.norm(across)
        return cls(across, np.cross(out, across), out)

    def flat(self, points: np.ndarray) -> np.ndarray:
        """Return points (N, 3) as seen (N, 2), m."""
        return np.asarray(points @ np.stack([self.across, self.up]).T)

    def labels(self) -> tuple[str, str]:
        """Return the labels of the axes: those of the body where the view looks along one."""
        return _label(self.across, "across"), _label(self.up, "up")


def _label(direction: np.ndarray, otherwise: str) -> str:
    i = int(np.argmax(np.abs(direction)))
    if abs(direction[i]) < ALONG:
        return f"{otherwise} the view / mm"
    return f"{'−' if direction[i] < 0 else ''}{AXES[i]} / mm"


def deepest(energy: LearntEnergy, X: np.ndarray) -> np.ndarray:
    """Return the inputs (n,) of the deepest of the touches X (N, n)."""
    return np.asarray(X[int(np.argmax(energy.depth(X)))])


def further(energy: LearntEnergy, x: np.ndarray) -> str:
    """Return the inputs beyond the place at x (n,), in words: which body of a family it is; empty for one body."""
    named = zip(energy.parameters, x[3:], strict=True)
    return ", ".join(f"{r.name} = {value:.4g} {r.unit}".rstrip() for r, value in named)


def contact_points(energy: LearntEnergy, X: np.ndarray) -> np.ndarray:
    """Return points (N, 3) of the surface at rest nearest to the centres in X (N, n), m."""
    d, slope, _ = _surface(energy).at(X[:, :3])
    return np.asarray(X[:, :3] - d[:, None] * slope)


def at_depth(
    energy: LearntEnergy, view: View, places: np.ndarray, like: np.ndarray, depth: float
) -> np.ndarray:
    """Return inputs (N, n) with the probe `depth` m deep where places (N, 2), m, are seen; not-a-number where none.

    `like` (n,) is an input near the surface; the further inputs are its.
    """
    X = np.repeat(like[None], len(places), axis=0)
    X[:, :3] = (
        places @ np.stack([view.across, view.up])
        + (like[:3] @ view.out) * np.ones((len(places), 1)) * view.out
    )
    for _ in range(60):
        miss = energy.depth(X) - depth
        slope = _surface(energy).at(X[:, :3])[1] @ view.out
        X[:, :3] += np.clip(miss / np.maximum(slope, 0.2), -0.005, 0.005)[:, None] * view.out
    X[np.abs(energy.depth(X) - depth) > 1e-6] = np.nan
    return X


@dataclass(frozen=True, eq=False)
class Curve:
    """One line into the body, of the surrogate."""

    depth: np.ndarray  # (M,), m
    force: np.ndarray  # (M,), N
    rows: np.ndarray  # (k,), solves on the line, the deepest first


def curves(energy: LearntEnergy, test: TouchSolves, most: int = LINES) -> list[Curve]:
    """Return lines through deep solves far from each other, those first that have most solves on them."""
    depth, X = energy.depth(test.X), test.X
    radius = (
        energy.baseline.radius
        if energy.baseline.radius_input is None
        else X[:, energy.baseline.radius_input].mean()
    )
    normals = _surface(energy).at(X[:, :3])[1]
    lines = {
        i: _on_line(X, i, normals[i], NEAR * radius) for i in np.argsort(-depth) if depth[i] > depth.max() / 2
    }
    chosen: list[int] = []
    for i in sorted(lines, key=lambda i: -len(lines[i])):
        if all(np.linalg.norm(X[i, :3] - X[k, :3]) > radius for k in chosen):
            chosen.append(int(i))
        if len(chosen) == most:
            break
    return [_curve(energy, X, i, normals[i], depth, lines[i]) for i in chosen]


def _on_line(X: np.ndarray, i: int, normal: np.ndarray, near: float) -> np.ndarray:
    away = X[:, :3] - X[i, :3]
    aside = np.linalg.norm(away - (away @ normal)[:, None] * normal, axis=1)
    return np.flatnonzero((aside <= near) & (X[:, 3:] == X[i, 3:]).all(axis=1))


def _curve(
    energy: LearntEnergy, X: np.ndarray, i: int, normal: np.ndarray, depth: np.ndarray, rows: np.ndarray
) -> Curve:
    line = np.repeat(X[i][None], 121, axis=0)
    line[:, :3] += np.linspace(0.0, 1.0, 121)[:, None] * depth[i] * normal
    force = np.linalg.norm(felt_force(energy, line), axis=1)
    return Curve(energy.depth(line), force, rows[np.argsort(-depth[rows])])


def plot_curves(energy: LearntEnergy, test: TouchSolves) -> Figure:
    """Draw the size of the force against depth, lines of the surrogate and dots of finite elements."""
    fig, axes = figure(1, 1, size=(9.4, 3.6))
    axis, drawn = axes[0, 0], curves(energy, test)
    depth, size = energy.depth(test.X), np.linalg.norm(test.force, axis=1)
    names = [r.name for r in energy.inputs[:3]]
    for curve, style in zip(drawn, series(len(drawn)), strict=True):
        x = test.X[curve.rows[0]]
        place = ", ".join(f"{n} = {1e3 * v:.1f}" for n, v in zip(names, x[:3], strict=True)) + " mm"
        label = "; ".join(filter(None, (place.replace("-", "−"), further(energy, x))))
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


def plot_errors(energy: LearntEnergy, test: TouchSolves, samples: ForceSamples) -> Figure:
    """Draw one dot per unseen solve, where the probe touches: shallow third, middle, deep third side by side."""
    fig, axes = figure(1, 3, size=(9.4, 3.5), sharex=True, sharey=True)
    fig.set_layout_engine("compressed")
    view = View.of(energy, test.X)
    places, depth = 1e3 * view.flat(contact_points(energy, test.X)), energy.depth(test.X)
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
    """Return numbers of the worst solves among `some` by their place (2,) in mm; one place may have several."""
    found: dict[tuple[float, ...], str] = {}
    for number, row in enumerate(worst, 1):
        if some[row]:
            place = tuple(np.round(places[row], 1).tolist())
            found[place] = f"{found[place]}, {number}" if place in found else str(number)
    return found


def plot_trust(energy: LearntEnergy, test: TouchSolves) -> Figure:
    """Draw the deviation of the force at half and at the full depth of the test; hatched where training ended.

    Of a family it is that of the body with the deepest touch.
    """
    fig, axes = figure(1, 2, size=(9.4, 3.7), sharex=True, sharey=True)
    fig.set_layout_engine("compressed")
    view, depth = View.of(energy, test.X), energy.depth(test.X)
    touched = view.flat(contact_points(energy, test.X[depth > 0]))
    low, high = touched.min(axis=0), touched.max(axis=0)
    more = MARGIN * (high - low).max()
    sides = [np.linspace(a - more, b + more, GRID) for a, b in zip(low, high, strict=True)]
    places = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 2)
    like, full = deepest(energy, test.X), 0.98 * float(depth.max())
    found = [_trusted(energy, at_depth(energy, view, places, like, s)) for s in (full / 2, full)]
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


def _trusted(energy: LearntEnergy, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the deviation in per cent and whether trained, as grids; not-a-number where no probe can be so deep."""
    there = np.isfinite(X).all(axis=1)
    deviation, inside = np.full(len(X), np.nan), np.full(len(X), np.nan)
    if there.any():
        inside[there] = energy.inside(X[there])
        deviation[there] = 100 * energy.deviation(X[there]) if energy.root is not None else 0.0
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
