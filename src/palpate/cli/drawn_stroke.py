"""The stroke under which a learnt body is drawn: from first contact, or from rest, to the deepest place."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.format import share
from palpate.number_text import number_list
from palpate.runtime.touchable import Touchable, touchable
from palpate.surrogates import Surrogate, TouchedSurface
from palpate.surrogates.baselines import require_one_tool
from palpate.units import bounds, parse_quantity

__all__ = ["reservations_about", "stroke_of"]

_ROUNDING = 1e-9  # share of a depth that is round-off
_TRIED = 8  # deepest places that are tried, at most


def stroke_of(body: Surrogate, steps: int, at: str | None = None, depth: float | None = None) -> np.ndarray:
    """Return the inputs (steps, n) of a stroke from just after rest to the deepest place.

    `at` is x,y,z in m: the place of contact on the surface of a pressed body, where the probe goes in against the
    normal; the displacement in the end of a held one. By default it is the middle of what was trained, or elsewhere
    where the middle was not trained. `depth` is the largest depth in m; by default the deepest down to which all states
    are of the trained region.
    """
    shares = np.arange(1, steps + 1) / steps
    given = None if at is None else _numbers(at)
    shown = body.fields.get("displacement")
    asked: Any = getattr(shown, "asked_by", None)
    if asked not in {None, "load"}:
        raise UsageError(
            f"The shape of {body.name!r} depends on what came before.",
            why="It remembers, so that a place alone does not tell its shape.",
            fix="Record a touch and export that: palpate run --record, palpate trace export.",
        )
    if asked == "load":
        if given is not None or depth is not None:
            raise UsageError(
                f"The shape of {body.name!r} follows from its loads, and no place is pressed.",
                why="Its stroke goes from no load to the full one.",
                fix="Leave out --at and --depth.",
            )
        low, high = bounds(shown.inputs)  # type: ignore[union-attr]  # it has a field of nodes; from no load to all
        return np.asarray(shares[:, None] * np.where(np.abs(high) >= np.abs(low), high, low))
    hand = touchable(body)
    require_one_tool(hand.energy.baseline, "be drawn along a stroke")

    def stroke(place: np.ndarray | None, far: float) -> np.ndarray:
        if hand.surface is None:
            return _pull(hand, place, far * shares)
        return _with_middles(hand, _press(hand, hand.surface, place, far * shares))

    if depth is not None or (given is not None and hand.surface is None):
        return stroke(given, hand.deepest if depth is None else depth)
    places = [given] if given is not None or hand.surface is None else [None, *_trained_places(hand)]
    strokes = [_trained_part(hand, partial(stroke, place)) for place in places]
    deepest = [float(hand.depth(X[-1:])[0]) if hand.energy.inside(X).all() else 0.0 for X in strokes]
    # the middle, unless another place was trained twice as deep
    return strokes[0] if deepest[0] >= 0.5 * max(deepest) else strokes[int(np.argmax(deepest))]


def _with_middles(hand: Touchable, places: np.ndarray) -> np.ndarray:
    """Return places (k, felt) with the further inputs in the middle of their ranges, (k, n)."""
    low, high = bounds(hand.inputs)
    rest = np.tile((low + high)[None, places.shape[1] :] / 2, (len(places), 1))
    return np.hstack([places, rest])


def _pull(hand: Touchable, given: np.ndarray | None, ways: np.ndarray) -> np.ndarray:
    """Return the inputs (k, n) of what is held, on its way to a place; by default ways (k,), m, along its last axis."""
    felt = len(hand.inputs) - len(hand.parameters)
    if given is not None:
        return _with_middles(hand, ways[:, None] / ways[-1] * given[:felt])
    last = hand.inputs[felt - 1]
    end = last.high if last.high >= -last.low else last.low
    along = ways * min(1.0, abs(end) / ways[-1]) * np.sign(end)
    return _with_middles(hand, along[:, None] * np.eye(felt)[-1])


def _trained_part(hand: Touchable, stroke: Callable[[float], np.ndarray]) -> np.ndarray:
    """Return the stroke down to the deepest place above which all is trained; the whole one where nothing is."""
    far = hand.deepest
    whole = X = stroke(far)
    while not (inside := hand.energy.inside(X)).all():
        known = int(np.argmin(inside))  # states before the first that isn't
        if known == 0:
            return whole
        far *= known / len(X)
        X = stroke(far)
    return X


def _trained_places(hand: Touchable) -> list[np.ndarray]:
    """Return places of contact (3,) under the deepest trained presses, for where nothing is trained in the middle."""
    assert hand.surface is not None
    X = hand.trained_inputs
    X = X[hand.depth(X) <= hand.deepest * (1.0 + _ROUNDING)]
    X = X[np.argsort(-hand.depth(X))[:_TRIED]]
    distance, slope, _ = hand.surface.at(X[:, :3])
    return list(X[:, :3] + hand.shift - distance[:, None] * slope / np.linalg.norm(slope, axis=1)[:, None])


def _press(
    hand: Touchable, surface: TouchedSurface, given: np.ndarray | None, depths: np.ndarray
) -> np.ndarray:
    """Return the centres (k, 3) of a probe at depths (k,) below a place of the surface, in m."""
    centre, normal = np.asarray(hand.home), np.asarray(hand.normal)
    if given is not None:
        own = given - hand.shift  # on the surface that takes places
        distance, slope, _ = surface.at(own[None])
        if not abs(distance[0]) <= max(depths[-1], surface.spacing):
            raise UsageError(
                f"No contact at {_place(given)}: it does not lie on the touched surface.",
                why="--at is the place of contact on the surface, and not where the ball's centre or the tool is, as "
                "in `palpate ask --at`.",
                fix=_nearest(hand, surface, given),
            )
        normal = slope[0] / np.linalg.norm(slope[0])
        lift = hand.radius - distance if hand.tool is None else hand.tool.offset(normal[None])
        centre = given + lift[0] * normal
    places = centre - depths[:, None] * normal
    reached = hand.depth(_with_middles(hand, places))
    if (
        not (reached > 0.0).all()
        or not (np.diff(reached) > 0.0).all()
        or depths[-1] > surface.inner + hand.radius
    ):
        raise UsageError(
            f"A stroke of {1e3 * depths[-1]:.3g} mm at {_place(centre)} leaves the surface.",
            why="The body lets go of a probe that is too deep, or comes nearer to another side.",
            fix=f"Give a smaller --depth; the deepest trained one is {1e3 * hand.deepest:.3g} mm.",
        )
    return np.asarray(places)


def _nearest(hand: Touchable, surface: TouchedSurface, given: np.ndarray) -> str:
    """Return in words the nearest place of the surface: below a place near it, else among the nodes of the shape."""
    own = given - hand.shift
    distance, slope, _ = surface.at(own[None])
    below = own - distance[0] * slope[0] / max(float(np.linalg.norm(slope[0])), _ROUNDING)
    if abs(surface.at(below[None])[0][0]) <= surface.spacing:
        return f"The nearest place of the surface is --at {_place(below + hand.shift)}."
    points = np.asarray(getattr(hand.fields.get("displacement"), "points", np.zeros((0, 3))))
    touched = points[np.abs(surface.at(points - hand.shift)[0]) <= surface.spacing] if len(points) else points
    if not len(touched):
        low, high = surface.box
        return f"Give a place of the surface, which lies between {_place(low)} and {_place(high)}."
    place = touched[np.argmin(np.linalg.norm(touched - given, axis=1))]
    return f"The nearest place of the surface is --at {_place(place)}."


def _place(values: np.ndarray) -> str:
    return ",".join(f"{v:.4g}" for v in np.round(values, 6) + 0.0)


def reservations_about(body: Surrogate, X: np.ndarray) -> list[str]:
    """Return warnings about the shapes at inputs X (k, n): deeper than trained, or elsewhere."""
    if getattr(body.fields.get("displacement"), "asked_by", None) is not None:
        return []
    hand = touchable(body)
    deepest = float(hand.depth(X).max())
    if deepest > hand.deepest * (1.0 + _ROUNDING):
        return [
            f"{1e3 * deepest:.3g} mm is deeper than the {1e3 * hand.deepest:.3g} mm that were trained: the shapes "
            "beyond are continued, and not learnt"
        ]
    outside = float(1.0 - body.hand_energy.inside(X).mean())
    if outside:
        return [f"{share(outside)} of the states lie outside of what was trained: their shapes are continued"]
    return []


def _numbers(text: str) -> np.ndarray:
    words = number_list(text)
    if len(words) != 3:
        raise UsageError(
            f"{text!r} is no place of three numbers.", fix="Write x,y,z in m, such as 0.05,0.05,0.05."
        )
    return np.array([parse_quantity(word, "m", "--at", bare=True) for word in words])
