"""Kinds of examination: what is hidden in which body, and what the examiner is told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import UsageError
from palpate.experiments.exam_lumps import require_inside
from palpate.experiments.exam_touch import ExamSurface
from palpate.runtime.touchable import Touchable
from palpate.surrogates import Lump, LumpContrast

__all__ = ["HARD", "KINDS", "ExamKind", "hide_lumps", "kind_of_body"]

SOFT_RATIO, HARD_RATIO = 3.0, 10.0  # of moduli: rubbery, and like stone beside tissue
HARD = 5.0  # ratio from which a lump counts as hard
_NONE = 0.2  # share of examinations without a lump
_TRIES = 300  # places that are tried for a lump before it is left out
_APART = 1.0  # distance of two lumps' middles, over the sum of their diameters, at least


@dataclass(frozen=True)
class ExamKind:
    """An examination of a kind of body: the sizes of what is hidden, in m, and the words for the examiner."""

    name: str
    title: str
    diameters: tuple[float, ...]  # of lumps
    shallow: tuple[float, float]  # tissue over a shallow lump
    deep: tuple[float, float]  # tissue over a deep one
    most: int  # lumps at most
    words: str  # a paragraph for a student

    @property
    def depth_limit(self) -> float:
        """Tissue over a lump from which it counts as deep, m."""
        return (self.shallow[1] + self.deep[0]) / 2.0


_HOW = (
    "Press it and feel for places that are harder than what surrounds them. Cover all of it, strip by strip, and "
    "press each place lightly, then deeply: only a deep press reaches a deep lump. There may be several lumps, or "
    "none. Where you find one, mark the place, and say whether it is hard or soft, deep or shallow. First practise: "
    "there each mark is answered at once. In the examination nothing is answered until you end it. Then you see what "
    "you found and missed, false alarms, how much you covered and how deep, your force, your time and your order."
)

KINDS = {
    kind.name: kind
    for kind in (
        ExamKind(
            "breast", "Examination of a breast", (0.010, 0.014, 0.018), (0.004, 0.007), (0.009, 0.014), 4,
            "This is a model of a breast that lies on the chest. " + _HOW,
        ),
        ExamKind(
            "prostate", "Examination of a prostate", (0.006, 0.009, 0.012), (0.002, 0.004), (0.006, 0.009), 3,
            "This is a model of a prostate under the rectal wall. " + _HOW,
        ),
        ExamKind(
            "skin", "Examination of skin", (0.006, 0.009, 0.012), (0.003, 0.006), (0.008, 0.013), 4,
            "This is a model of skin, fat and muscle. " + _HOW,
        ),
    )
}  # fmt: skip


def kind_of_body(name: str, body: Touchable) -> ExamKind:
    """Return an examination of one's own body, with lumps of the size of its probe."""
    size, deepest = 2.0 * body.radius, body.deepest
    return ExamKind(
        name,
        f"Examination of {body.name}",
        (0.5 * size, 0.75 * size, size),
        (0.25 * deepest, 0.5 * deepest),
        (deepest, 1.5 * deepest),
        4,
        f"This is {body.name}. " + _HOW,
    )


def hide_lumps(
    kind: ExamKind, body: Touchable, surface: ExamSurface, seed: int, learnt: LumpContrast | None = None
) -> tuple[Lump, ...]:
    """Return the lumps of an examination, the same for the same seed; one in five examinations has none.

    Sizes, depths and moduli are drawn without putting one back; a sort that fits nowhere gives way to the next. The
    lumps lie under the `surface` of the `body` without lumps; where it has `learnt` lumps, only such are hidden.
    """
    rng = np.random.default_rng(seed)
    touched = surface.inner(max(kind.diameters) / 2.0)  # so that a hand can press all around a lump
    areas = surface.areas[touched]
    if rng.random() < _NONE or body.surface is None or not areas.any():
        return ()
    shares = areas / areas.sum()
    _, slope, _ = body.surface.at(surface.points[touched])
    normals = slope / np.linalg.norm(slope, axis=1, keepdims=True)
    sorts = _sorts(kind, learnt)
    wanted = int(rng.integers(1, kind.most + 1))
    lumps: list[Lump] = []
    for diameter, cover, ratio in (sorts[k] for k in rng.permutation(len(sorts))):
        if len(lumps) == wanted:
            break
        for _ in range(_TRIES):
            k = int(rng.choice(len(touched), p=shares))
            below = rng.uniform(*cover) + diameter / 2.0
            x, y, z = (surface.points[touched[k]] - below * normals[k]).tolist()
            lump = Lump((x, y, z), diameter / 2.0, ratio)
            if _stands_alone(lump, lumps) and _fits(body, lump, surface, learnt):
                lumps.append(lump)
                break
    return tuple(lumps)


def _sorts(kind: ExamKind, learnt: LumpContrast | None) -> list[tuple[float, tuple[float, float], float]]:
    """Return diameter (m), range of cover (m) and ratio of all sorts of lumps, within what was learnt."""
    diameters, ratios = kind.diameters, (SOFT_RATIO, HARD_RATIO)
    if learnt is not None:
        radius, ratio = learnt.room.radius, learnt.room.ratio
        diameters = tuple(float(np.clip(d, 2.0 * radius.low, 2.0 * radius.high)) for d in diameters)
        ratios = (max(SOFT_RATIO, ratio.low), min(HARD_RATIO, ratio.high))
    return [(d, c, r) for d in dict.fromkeys(diameters) for c in (kind.shallow, kind.deep) for r in ratios]


def _stands_alone(lump: Lump, others: Sequence[Lump]) -> bool:
    return all(
        np.linalg.norm(np.subtract(lump.place, other.place)) >= _APART * 2.0 * (lump.radius + other.radius)
        for other in others
    )


def _fits(body: Touchable, lump: Lump, surface: ExamSurface, learnt: LumpContrast | None) -> bool:
    try:
        require_inside(body, lump, surface.points)
        if learnt is not None:
            learnt.require([lump])
    except UsageError:
        return False
    return True
