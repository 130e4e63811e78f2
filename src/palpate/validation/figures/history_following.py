"""Errors of a body with memory along histories that it has never seen.

Its force is judged over the largest one of the test and not over itself: along unloading it passes through zero. The
thresholds are the stricter ones, beyond which a person gains nothing, half of half a just noticeable difference (Jones
1989) at the median.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.dataset import Dataset, LoadHistory, histories_of
from palpate.errors import UsageError
from palpate.format import length, plain, share
from palpate.surrogates import NodeField, Surrogate
from palpate.validation.figures.figure import Figure, Measured
from palpate.validation.subject import Subject

__all__ = ["Followed", "HistoryErrors", "follow_unseen", "history_following"]

UNLOADED = 1e-9  # share of the largest force, below which a force is round-off


@dataclass(frozen=True, eq=False)
class Followed:
    """One unseen history, followed by the body and by the same body without its memory."""

    path: LoadHistory  # what was solved
    force: np.ndarray  # (N,), of the body, N
    stored: np.ndarray  # (N,), of the body, J
    lost: np.ndarray  # (N,), of the body, J
    elastic: np.ndarray  # (N,), force of the body without its memory, N
    shape: np.ndarray  # (N, node), distance of the shown nodes from the solved ones, m
    residual: float | None  # where it stays when let go at the end, m; None if it ends under load


@dataclass(frozen=True, eq=False)
class HistoryErrors(Figure):
    """Errors of a body with memory along histories that it has never seen."""

    off: np.ndarray  # (N,), |ΔP| over the largest force, at each sample
    count: int  # histories
    largest_force: float  # of the test, N
    median: float  # |ΔP| over the largest force, as the next two
    p95: float
    max: float
    elastic_median: float  # the same of the body without its memory, as the next
    elastic_p95: float
    residual_median: float | None  # error of where it stays after unloading, m, as the next
    residual_max: float | None
    residual_largest: float | None  # the farthest it stays, m
    shape_mean: float  # distance of the shown nodes from the solved ones, m
    shape_max: float  # m
    lost: float  # energy that the histories lost, J, all together
    lost_error: float  # largest error of the lost energy at the end of a history, J
    gives: float  # share of the steps that break the second law
    where: str  # the sample with the largest error, in words

    def measured(self) -> Measured:
        """Return the values that are compared with limits."""
        return {
            "history_force_median": (self.median, None),
            "history_force_p95": (self.p95, self.where),
            "history_energy": (self.gives, None),
        }

    def notes(self) -> list[str]:
        """Return what is not judged."""
        return ["Shape, residual displacement and lost energy are printed and not judged."]

    def lines(self) -> list[str]:
        """Return the elastic model beside it, and what is not judged."""
        median, p95 = self.elastic_median / self.median, self.elastic_p95 / self.p95
        lines = [
            f"largest force {plain(self.largest_force, 3)} N in {self.count} histories; largest error of the force "
            f"{share(self.max)}",
            f"without its memory: {share(self.elastic_median)} median, {share(self.elastic_p95)} p95; "
            f"{plain(median, 3)} and {plain(p95, 3)} times as much",
        ]
        if self.residual_median is not None and self.residual_max is not None:
            lines.append(
                f"where it stays after unloading: off by {length(self.residual_median)} at the median, "
                f"{length(self.residual_max)} at most; the farthest is {length(self.residual_largest or 0.0)}"
            )
        return [
            *lines,
            f"shape: nodes off by {length(self.shape_mean)} on average, {length(self.shape_max)} at most",
            f"energy lost: {plain(self.lost, 3)} J in all, one off by {plain(1e3 * self.lost_error)} mJ at most",
        ]


def history_following(subject: Subject) -> HistoryErrors | None:
    """Return the errors along unseen histories of the same mesh, where the model has a memory."""
    if subject.body is None or subject.histories is None:
        return None
    followed = follow_unseen(subject.body, subject.histories)
    largest = max(float(np.abs(one.path.force).max()) for one in followed)
    if largest == 0:
        raise UsageError("No unseen history needs a force.", fix="Lead the body somewhere.")
    off = np.concatenate([np.abs(one.force - one.path.force) for one in followed]) / largest
    elastic = np.concatenate([np.abs(one.elastic - one.path.force) for one in followed]) / largest
    shape = np.concatenate([one.shape for one in followed])
    stays = [(one.residual, one.path.place[-1]) for one in followed if one.residual is not None]
    away = np.array([abs(a - b) for a, b in stays])
    median, p95 = (float(v) for v in np.percentile(off, (50, 95)))
    return HistoryErrors(
        off=off,
        count=len(followed),
        largest_force=largest,
        median=median,
        p95=p95,
        max=float(off.max()),
        elastic_median=float(np.median(elastic)),
        elastic_p95=float(np.percentile(elastic, 95)),
        residual_median=float(np.median(away)) if stays else None,
        residual_max=float(away.max()) if stays else None,
        residual_largest=float(max(abs(b) for _, b in stays)) if stays else None,
        shape_mean=float(shape.mean()),
        shape_max=float(shape.max()),
        lost=float(sum(one.path.lost[-1] for one in followed)),
        lost_error=float(max(abs(one.lost[-1] - one.path.lost[-1]) for one in followed)),
        gives=float(np.mean(np.concatenate([_gives(one) for one in followed]))),
        where=_worst(followed),
    )


def follow_unseen(body: Surrogate, test: Dataset) -> list[Followed]:
    """Return a body led along each history; they must be of its mesh."""
    paths, field = histories_of(test), body.line
    if not paths:
        raise UsageError("There is no history to test with.", fix="Lead the body through some.")
    assert field is not None  # the subject's own check
    if test.rest.shape != field.points[:, :2].shape or not np.allclose(test.rest, field.points[:, :2]):
        raise UsageError(
            f"The histories' {len(test.rest)} nodes are not the {len(field.points)} nodes of {body.name}.",
            fix="Test with histories of the body that it was learnt from.",
        )
    return [_followed(body, field, path) for path in paths]


def _followed(body: Surrogate, field: NodeField, path: LoadHistory) -> Followed:
    direction, places = body.hand_energy.baseline.directions[0], path.place[:, None]
    answer = body.follow(places, path.times)
    force = -answer.force @ direction
    shown = field.values(np.stack([path.place, force], axis=1))[:, :, :2]
    ends = abs(path.force[-1]) <= UNLOADED * np.abs(path.force).max()
    return Followed(
        path,
        force,
        answer.stored,
        answer.lost,
        elastic=-body.hand_energy.force(places) @ direction,
        shape=np.linalg.norm(shown - path.displacement, axis=2),
        residual=float(answer.rest @ direction) if ends else None,
    )


def _gives(one: Followed) -> np.ndarray:
    """Return which steps break the second law (N,)."""
    return np.asarray((np.diff(one.lost, prepend=0.0) < 0) | (one.stored < 0))


def _worst(found: list[Followed]) -> str:
    peaks = [float(np.abs(one.force - one.path.force).max()) for one in found]
    k = int(np.argmax(peaks))
    i = int(np.argmax(np.abs(found[k].force - found[k].path.force)))
    path = found[k].path
    return f"in history {k + 1} at w = {1e3 * path.place[i]:.4g} mm under P = {path.force[i]:.4g} N"
