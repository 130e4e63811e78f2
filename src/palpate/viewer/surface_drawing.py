"""A body drawn as a surface: its mesh once, then a probe or a patch and some coefficients a picture.

While a hand touches, the picture is of the loop's own position: picture and force belong to one state. Released, the
force is zero at once; for the eye a probe is withdrawn along the normal, s(t) = s₀ e^(−t/τ), and each shape on the way
is the body's own at that depth.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from palpate.runtime.shared_state import State, now
from palpate.runtime.touchable import Touchable
from palpate.surrogates import Field, FieldSurrogate
from palpate.surrogates.baselines import PosedBaseline
from palpate.surrogates.fields import surface_fields
from palpate.viewer.indentation_drawing import IndentationDrawing
from palpate.viewer.messages import FieldInfo, Modes, Surface
from palpate.viewer.surfaces import relief, split, touchable_triangles

__all__ = ["SurfaceDrawing"]

FREE = 0.040  # s, time constant of the withdrawal that is drawn
STILL = 1e-3  # share of the deepest depth below which the body counts as at rest
DEEPEST = 48  # touches from which the range of the colours is taken


class SurfaceDrawing:
    """A body with a touched surface, or one that is held at a patch.

    `surface` is at rest; `nodes` (p,) int are the field's nodes that its points stand for. All `fields` shown are on
    the nodes of the first, which is the displacement where there is one; `infos` are their names, units and ranges.
    Where the first field carries the body's own surface, that is drawn, and `nodes` are its vertices; without `detail`
    the field's own triangles are drawn. Without fields an `outline` is drawn, points (n, 3) in m and triangles (t, 3).
    """

    def __init__(
        self,
        body: Touchable,
        *,
        detail: bool = True,
        outline: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> None:
        self.body, self._detail, self._outline = body, detail, outline
        self.fields = _shown(body.fields)
        self.surface, self.nodes, self._indentation = self._at_rest()
        self._evaluators = [field.evaluator() for field in self.fields]
        self._judge = body.energy.evaluator()
        self.infos = tuple(self._info(field) for field in self.fields)
        self._last, self._depth, self._released = body.home, 0.0, -math.inf
        self._normal = body.normal

    def _at_rest(self) -> tuple[Surface, np.ndarray, IndentationDrawing | None]:
        if self.fields:
            first = self.fields[0]
            points, triangles = first.pictured if self._detail else (first.points, first.triangles)
            mark = touchable_triangles(self.body, first, detail=self._detail)
        elif self._outline is not None:
            points, triangles = self._outline
            mark = np.zeros(len(triangles), bool)
        else:
            points, triangles = relief(self.body)
            mark = np.ones(len(triangles), bool)
        parts = split(points, triangles, np.zeros(len(triangles), bool))
        yielding = np.zeros(0, dtype=int)
        if self._keeps_indentation:  # on both sides of a sharp edge, or it would tear
            yielding = np.flatnonzero(np.isin(parts.nodes, parts.nodes[parts.triangles[mark > 0]]))
        indentation = IndentationDrawing(self.body, points[parts.nodes[yielding]]) if len(yielding) else None
        surface = replace(
            parts.surface(points),
            touchable=mark,
            yielding=yielding,
            normals=np.zeros(0) if indentation is None else indentation.normals.ravel(),
        )
        return surface, parts.nodes, indentation

    @property
    def _keeps_indentation(self) -> bool:
        """True where indentations stand at places; one that moves with the probe is nowhere when that is gone."""
        return self.body.indentation is not None and len(self.body.indentation.points) > 1

    def modes(self, index: int) -> Modes:
        """Return what the page needs to sum up field `index`."""
        field, nodes = self.fields[index], self.nodes
        carry = field.at_pictured if self._detail else np.asarray
        # where it begins, a vertex takes as much of the local mode as the nodes that carry it
        shares = carry(field.touched[:, None].astype(float))[nodes, 0]
        touched = np.flatnonzero(shares)
        return Modes(
            reach=0.0 if field.local_mode is None else field.local_mode.reach,
            rows=0 if field.local_mode is None else field.local_mode.table.shape[1],
            rest=carry(field.rest)[nodes].ravel(),
            modes=carry(field.modes)[:, nodes].ravel(),
            touched=touched,
            shares=shares[touched],
        )

    def frame(self, state: State, held: bool, parameters: np.ndarray) -> dict[str, Any]:
        """Return the touch's part of a frame: the fields of `Frame` from `contact` to `indentation`.

        `held` says whether a hand holds or presses the body; `parameters` (p,) are the inputs that it doesn't supply.
        """
        # a field knows a ball's depth alone: whether a tool in any pose touches, the loop says
        posed = self.body.energy.baseline.name == PosedBaseline.name or self.body.gripper is not None
        away = posed and state.depth <= 0.0
        touched = held and not state.let_go and not away
        deviation = self._judge.trust(state.position, parameters) if touched else 0.0
        if self.body.holds:
            return {
                "deviation": deviation,
                "drawn": state.depth if held else 0.0,
                "contact": tuple(self.body.held_place(parameters).tolist()),
                "normal": tuple(self.body.normal.tolist()),
            }
        place, coefficients = self._coefficients(
            self._pressed(state) if touched else self._withdrawn(), parameters
        )
        indentation = np.zeros(0)
        if self._indentation is not None:
            indentation = self._indentation.depths(state.indentation)
            coefficients *= 0.0 if place is None else self._indentation.elastic(place, state.indentation)
        if place is None:
            return {"deviation": deviation, "coefficients": coefficients, "indentation": indentation}
        if touched:
            self._normal = place[5:8].copy()
        return {
            "deviation": deviation,
            "drawn": float(place[0]),
            "contact": tuple(place[2:5].tolist()),
            "normal": tuple(place[5:8].tolist()),
            "coefficients": coefficients,
            "indentation": indentation,
        }

    def _pressed(self, state: State) -> np.ndarray:
        self._last, self._depth, self._released = state.position, state.depth, now()
        return state.position

    def _withdrawn(self) -> np.ndarray:
        """Where the probe is drawn after release; in the air at last, where two jaws are at once."""
        left = self._depth * math.exp(-(now() - self._released) / FREE)
        if left < STILL * self.body.deepest or self.body.gripper is not None:
            return self.body.away
        return self._last + (self._depth - left) * self._normal

    def _coefficients(
        self, centre: np.ndarray, parameters: np.ndarray
    ) -> tuple[np.ndarray | None, np.ndarray]:
        """Depth, growth, place and normal (8,) where there is contact, and what the page sums each field up from."""
        place, parts = None, []
        for evaluator, field in zip(self._evaluators, self.fields, strict=True):
            if evaluator(centre, parameters):
                place = evaluator.place
            parts.append(evaluator.coefficients)
            if field.local_mode is not None:
                parts.append(evaluator.profile().ravel())
        return place, np.concatenate(parts) if parts else np.zeros(0)

    def _info(self, field: FieldSurrogate) -> FieldInfo:
        """Its range over the deepest trained touches, from zero where the values allow."""
        X = self.body.trained_inputs
        deep = X[np.argsort(self.body.depth(X))[-DEEPEST:]]
        values = field.values(deep)
        components = values.shape[2]
        sizes = np.linalg.norm(values, axis=2) if components > 1 else values[..., 0]
        low, high = float(sizes.min()), float(sizes.max())
        low = low if low < -0.05 * abs(high) or low > 0.5 * high else 0.0
        return FieldInfo(
            field.name, field.unit, low, high if high > low else low + 1.0, components, len(field.modes)
        )


def _shown(fields: Mapping[str, Field]) -> tuple[FieldSurrogate, ...]:
    """Return the fields on one set of nodes, the displacement first."""
    on_surface = list(surface_fields(fields).values())
    moves = [field for field in on_surface if field.rest.shape[1] == 3 and field.unit == "m"]
    ordered = [*moves[:1], *(field for field in on_surface if field not in moves[:1])]
    first = ordered[0].points if ordered else np.zeros((0, 3))
    drawn = ordered[0].drawn if ordered else None
    return tuple(
        field
        for field in ordered
        if np.array_equal(field.points, first) and (drawn is None or field.drawn is not None)
    )
