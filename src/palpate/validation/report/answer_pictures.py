"""Pictures of fields and curves of any physics: the worst unseen case, beside what was solved."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.format import share
from palpate.learning.dataset_answers import DatasetAnswers, FieldAnswers
from palpate.surrogates import AxisPlaces, MeshPlaces, ModalField
from palpate.validation.figures.answer_errors import AnswerError
from palpate.validation.report.chapter import Chapter
from palpate.validation.report.style import BLUE, ORANGE, Picture, figure, loads_map, picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["answer_pictures", "plot_curve", "plot_field"]

_PLACES = 6000  # that are drawn at most, spread evenly: more are no clearer


def answer_pictures(chapter: Chapter, key: str) -> list[Picture]:
    """Draw the worst unseen case of each field and curve; none of other models."""
    errors, subject = chapter.validation.answers, chapter.subject
    if errors is None or subject.answering is None or subject.data is None:
        return []
    truth = DatasetAnswers.of(subject.data, to_learn=False)
    made = []
    for i, one in enumerate(errors):
        shown = subject.answering.modal_fields.get(one.name)
        if shown is not None and one.name in truth.fields:
            row = _row_of(one, truth.X)
            made.append(_picture(f"{key}-answer{i}", one, shown, truth.fields[one.name], truth.X[row], row))
    return made


def _row_of(error: AnswerError, X: np.ndarray) -> int:
    """Return the row of the worst case in the test."""
    worst = np.array([value for _, value, _ in error.worst.inputs])
    return int(((X - worst) ** 2).sum(axis=1).argmin())


def _picture(
    key: str, error: AnswerError, shown: ModalField, truth: FieldAnswers, x: np.ndarray, row: int
) -> Picture:
    solved, answered = truth.values[row], shown.values(x[None])[0]
    spread = shown.deviation(x[None])[0]
    off = f"95 of 100 values are within {share(error.p95)} of the range."

    def draw() -> Figure:
        if shown.axis is not None:
            return plot_curve(shown.axis, solved, answered, spread, shown.name, shown.unit)
        assert shown.mesh is not None  # places are one of the two
        return plot_field(shown.mesh, solved, answered, shown.name, shown.unit)

    return picture(
        key,
        f"{error.name}, worst case",
        f"{error.name} of the worst unseen case, solved and by the surrogate, {error.worst}. {off}",
        f"The unseen case that is farthest off, {error.worst}: {share(error.largest)} of the range. {off}",
        draw,
    )


def plot_curve(
    axis: AxisPlaces, solved: np.ndarray, answered: np.ndarray, deviation: np.ndarray, name: str, unit: str
) -> Figure:
    """Draw each component (P, C) of a curve: dots of the solve, a line and a band of 90 % of the surrogate."""
    count = solved.shape[1]
    fig, axes = figure(1, count, size=(4.7 * min(count, 2), 3.2))
    for j, panel in enumerate(axes[0]):
        half = 1.645 * np.nan_to_num(deviation[:, j])
        panel.fill_between(axis.values, answered[:, j] - half, answered[:, j] + half, color=BLUE, alpha=0.2)
        panel.plot(axis.values, answered[:, j], color=BLUE, label="surrogate")
        panel.plot(axis.values, solved[:, j], "o", color=ORANGE, markersize=2.5, label="solve")
        panel.set_xlabel(f"{axis.name} / {axis.unit}" if axis.unit else axis.name)
        panel.set_ylabel(f"{name} / {unit}" if unit else name)
    axes[0][0].legend()
    return fig


def plot_field(mesh: MeshPlaces, solved: np.ndarray, answered: np.ndarray, name: str, unit: str) -> Figure:
    """Draw a field (P, C), of vectors its size, three times: solve, surrogate, and the size of the difference."""
    sizes = [_size(solved), _size(answered), np.linalg.norm(answered - solved, axis=1)]
    ends = min(map(np.min, sizes[:2])), max(map(np.max, sizes[:2]))
    places = mesh.coordinates
    # along the two directions in which the body is largest
    across = np.sort(np.argsort(-np.ptp(places, axis=0))[:2])
    some = np.arange(0, len(places), max(1, -(-len(places) // _PLACES)))
    fig, axes = figure(1, 3, size=(9.4, 3.2), sharey=True)
    for panel, values, title in zip(axes[0], sizes, ("solve", "surrogate", "difference"), strict=True):
        limits = {"vmin": ends[0], "vmax": ends[1]} if title != "difference" else {}
        dots = panel.scatter(
            *(1e3 * places[np.ix_(some, across)].T),
            c=values[some],
            s=max(1.0, 6000.0 / len(some)),
            linewidths=0,
            cmap=loads_map(),
            rasterized=True,
            **limits,
        )
        fig.colorbar(dots, ax=panel, label=f"{name} / {unit}" if unit else name)
        panel.set_title(title)
        panel.set_aspect("equal")
        panel.set_xlabel(f"{'xyz'[across[0]]} / mm")
    axes[0][0].set_ylabel(f"{'xyz'[across[1]]} / mm")
    return fig


def _size(values: np.ndarray) -> np.ndarray:
    return values[:, 0] if values.shape[1] == 1 else np.linalg.norm(values, axis=1)
