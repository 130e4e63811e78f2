"""How far the held node can go, so that the page's first view has room for all of it."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from palpate.surrogates import TouchModel
    from palpate.surrogates.plastic import HeldBody

__all__ = ["travel", "travel_of_memory"]

LEAD = 9  # places on the way to an end


def travel(model: TouchModel) -> np.ndarray:
    """Lower and upper corner (2, 3) of the box of the held node's offsets, m; rest is in it.

    The box is taken over both ends and the middle of every load's range: bodies bend farthest at the ends, and
    reach farthest along their axis near the middle of a range of both signs. A body that mirrors goes as far
    against its load.
    """
    levels = [(r.low, (r.low + r.high) / 2, r.high) for r in model.inputs]
    lattice = np.array(list(itertools.product(*levels)))
    columns = slice(2 * model.touch_node, 2 * model.touch_node + 2)
    offsets = np.zeros((len(lattice) + 1, 3))  # the last one is rest
    offsets[:-1, :2] = model.networks["field"].predict(lattice)[:, columns]
    if model.mirrors:
        along = offsets @ model.directions[0]
        offsets = np.vstack([offsets, offsets - 2.0 * np.outer(along, model.directions[0])])
    return np.array([offsets.min(axis=0), offsets.max(axis=0)])


def travel_of_memory(body: HeldBody) -> np.ndarray:
    """The same of a body that remembers: led from rest to both ends of what it was trained on, and let go there."""
    hand, ends = body.evaluator(), body.inputs[0]
    offsets = [np.zeros(3)]
    for end in (ends.low, ends.high):
        for w in np.linspace(hand.loads[0], end, LEAD):
            hand.step(w * body.directions[0], 0.0)
            offsets.append(hand.contact.copy())
        hand.release(0.0)
        offsets.append(hand.contact.copy())
    return np.array([np.min(offsets, axis=0), np.max(offsets, axis=0)])
