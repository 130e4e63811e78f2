"""A body pressed anywhere, as the page sees it: its skin once, then a probe and some coefficients a picture.

While a hand presses, the picture is of the loop's own position: picture and force belong to one state. Released, the
force is zero at once; for the eye the probe is withdrawn along the normal, s(t) = s₀ e^(−t/τ), and each shape on the
way is the body's own at that depth.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from palpate.runtime.shared_state import State, now
from palpate.runtime.touchable import Touchable
from palpate.surrogates import FieldSurrogate
from palpate.viewer.exhibits import loop_facts, ranges, vector
from palpate.viewer.messages import PROTOCOL
from palpate.viewer.pressed_messages import Look, Modes, Press, Skin, Touched
from palpate.viewer.prints import Prints, yielding_in_words
from palpate.viewer.skins import relief, touchable_triangles
from palpate.viewer.surfaces import split

__all__ = ["PressedExhibit"]

FREE = 0.040  # s, time constant of the withdrawal that is drawn
STILL = 1e-3  # share of the deepest depth below which the body counts as at rest
DEEPEST = 48  # presses from which the range of the colours is taken


class PressedExhibit:
    """A body pressed anywhere.

    Attributes
    ----------
    skin : Skin
        Its surface at rest.
    fields : tuple of FieldSurrogate
        Those shown: all on the nodes of the first, which is the displacement where there is one.
    """

    def __init__(self, body: Touchable) -> None:
        self.body = body
        self.fields = _shown(body.fields)
        self.skin, self._nodes, self._prints = self._made()
        self._eyes = [one.evaluator() for one in self.fields]
        self._judge = body.energy.evaluator()
        self._looks = tuple(self._look(one) for one in self.fields)
        self._last, self._depth, self._released = body.home, 0.0, -math.inf
        self._normal = body.normal

    def _made(self) -> tuple[Skin, np.ndarray, Prints | None]:
        """The skin, the field's node that each of its points stands for, and the prints on it."""
        if self.fields:
            points, triangles = self.fields[0].points, self.fields[0].triangles
            mark = touchable_triangles(self.body, self.fields[0])
        else:
            points, triangles = relief(self.body)
            mark = np.ones(len(triangles), bool)
        parts = split(points, triangles, np.zeros(len(triangles), bool))
        own = np.zeros(0, dtype=int)
        if self._keeps_prints:  # on both sides of a sharp edge, or it would tear
            own = np.flatnonzero(np.isin(parts.nodes, parts.nodes[parts.triangles[mark > 0]]))
        prints = Prints(self.body, points[parts.nodes[own]]) if len(own) else None
        skin = Skin(
            points[parts.nodes].ravel(),
            parts.triangles.ravel(),
            parts.creases.ravel(),
            mark,
            own,
            np.zeros(0) if prints is None else prints.normals.ravel(),
        )
        return skin, parts.nodes, prints

    @property
    def _keeps_prints(self) -> bool:
        """Whether prints stand at places; one that travels with the probe is nowhere when that is gone."""
        return self.body.dents is not None and len(self.body.dents.points) > 1

    def modes(self, index: int) -> Modes:
        """What the page needs to sum up field `index`."""
        one, nodes = self.fields[index], self._nodes
        return Modes(
            reach=0.0 if one.dimple is None else one.dimple.reach,
            rows=0 if one.dimple is None else one.dimple.table.shape[1],
            rest=one.rest[nodes].ravel(),
            modes=one.modes[:, nodes].ravel(),
            touched=np.flatnonzero(one.touched[nodes]),
        )

    def hello(self, state: State, rate: float) -> Touched:
        """See `Exhibit`."""
        body, own = self.body, self.body.radius_parameter
        return Touched(
            protocol=PROTOCOL,
            name=body.name,
            inputs=ranges(body.inputs),
            parameters=ranges(body.parameters),
            radius=body.radius,
            radius_parameter=-1 if own is None else own,
            deepest=body.deepest,
            force_max=body.force_max,
            stiffness_max=body.stiffness_max,
            centre=vector(body.home),
            fields=self._looks,
            remembers=yielding_in_words(body) or str(body.branches or ""),
            meta=body.meta,
            **loop_facts(state, rate),
        )

    def frame(self, beat: Mapping[str, Any], state: State, held: bool, parameters: np.ndarray) -> Press:
        """See `Exhibit`."""
        pressed = held and not state.let_go
        centre = self._pressed(state) if pressed else self._withdrawn()
        place, coefficients = self._coefficients(centre, parameters)
        prints = np.zeros(0)
        if self._prints is not None:
            prints = self._prints.depths(state.prints)
            coefficients *= 0.0 if place is None else self._prints.elastic(place, state.prints)
        deviation = self._judge.trust(state.position, parameters) if pressed else 0.0
        if pressed and place is not None:
            self._normal = place[5:8].copy()
        return Press(
            **beat,
            depth=state.depth,
            stiffness=state.stiffness if held else 0.0,
            deviation=deviation,
            drawn=0.0 if place is None else float(place[0]),
            foot=vector(np.zeros(3) if place is None else place[2:5]),
            normal=vector(np.zeros(3) if place is None else place[5:8]),
            coefficients=coefficients,
            prints=prints,
        )

    def _pressed(self, state: State) -> np.ndarray:
        self._last, self._depth, self._released = state.position, state.depth, now()
        return state.position

    def _withdrawn(self) -> np.ndarray:
        """Where the probe is drawn after release; in the air at last."""
        left = self._depth * math.exp(-(now() - self._released) / FREE)
        if left < STILL * self.body.deepest:
            return self.body.away
        return self._last + (self._depth - left) * self._normal

    def _coefficients(
        self, centre: np.ndarray, parameters: np.ndarray
    ) -> tuple[np.ndarray | None, np.ndarray]:
        """Depth, growth, foot and normal where there is contact, and what the page sums each field up from."""
        place, parts = None, []
        for eye, one in zip(self._eyes, self.fields, strict=True):
            if eye(centre, parameters):
                place = eye.place
            parts.append(eye.coefficients)
            if one.dimple is not None:
                parts.append(eye.profile().ravel())
        return place, np.concatenate(parts) if parts else np.zeros(0)

    def _look(self, one: FieldSurrogate) -> Look:
        """Its range over the deepest trained presses, from zero where the values allow."""
        X = self.body.trained_inputs
        deep = X[np.argsort(self.body.energy.depth(X))[-DEEPEST:]]
        values = one.values(deep)
        components = values.shape[2]
        sizes = np.linalg.norm(values, axis=2) if components > 1 else values[..., 0]
        low, high = float(sizes.min()), float(sizes.max())
        low = low if low < -0.05 * abs(high) or low > 0.5 * high else 0.0
        return Look(one.name, one.unit, low, high if high > low else low + 1.0, components, len(one.modes))


def _shown(fields: Mapping[str, FieldSurrogate]) -> tuple[FieldSurrogate, ...]:
    """The fields on one set of nodes, the displacement first."""
    moves = [one for one in fields.values() if one.rest.shape[1] == 3 and one.unit == "m"]
    ordered = [*moves[:1], *(one for one in fields.values() if one not in moves[:1])]
    first = ordered[0].points if ordered else np.zeros((0, 3))
    return tuple(one for one in ordered if np.array_equal(one.points, first))
