"""A field over a body's surface under a touch: displacement, von Mises stress, stretch.

    y(X; c, p) = y₀(X) + f(s) [Σ_k b_k(c, p) φ_k(X) + local mode(X; c, s)]

s = R − d(c) is the depth of the rigid probe, f how the field grows with depth (`depth_amplitude`), φ_k modes that are
orthonormal in the mean over the surface (proper orthogonal decomposition, Sirovich 1987), b a network, and the local
mode what moves with the probe. Without contact the field is y₀, exactly.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np

from palpate.checks import own_arrays
from palpate.dataset.carried_surface import CarriedSurface
from palpate.errors import UsageError
from palpate.format import count
from palpate.network import Network
from palpate.network.kinds import register_kind
from palpate.network.network_kernels import Precision
from palpate.surrogates.arguments import rows_of
from palpate.surrogates.continuation import Continuation
from palpate.surrogates.fields.depth_amplitude import DepthAmplitude
from palpate.surrogates.fields.field import Field
from palpate.surrogates.fields.field_evaluator import FieldEvaluator
from palpate.surrogates.fields.field_kernels import moving_values, profile_arguments
from palpate.surrogates.fields.local_mode import LocalMode
from palpate.surrogates.fields.posed_contact import PosedContact
from palpate.surrogates.fields.surface_interpolation import SurfaceInterpolation, node_normals
from palpate.surrogates.surface import TouchedSurface
from palpate.units import bounds

if TYPE_CHECKING:
    from palpate.surrogates.energy import LearntEnergy

__all__ = ["FieldErrors", "FieldSurrogate", "sizes_of"]

_SHOWN = {"m": (1e3, "mm"), "Pa": (1e-3, "kPa")}  # factor and unit in which people read


def sizes_of(errors: np.ndarray) -> np.ndarray:
    """Size (N, nodes) of errors (N, nodes, components) at each node."""
    return np.asarray(np.sqrt((errors**2).sum(axis=2)))


@dataclass(frozen=True, eq=False)
class FieldErrors:
    """Errors of N solves at each node, as sizes in the field's unit."""

    truncation: np.ndarray  # (N, nodes), of the nearest field that the modes and the moving part can show
    learning: np.ndarray  # (N, nodes), between that and the field that is answered
    total: np.ndarray  # (N, nodes), of the field that is answered
    mass: np.ndarray  # (nodes,), shares of the surface
    unit: str  # SI unit of the field

    def rms(self, what: str = "total") -> np.ndarray:
        """Root mean square over the surface (N,); total² = truncation² + learning²."""
        return np.asarray(np.sqrt(getattr(self, what) ** 2 @ self.mass))

    def mean(self, what: str = "total") -> float:
        """Mean over nodes and solves."""
        return float(getattr(self, what).mean())

    def max(self, what: str = "total") -> float:
        """Largest over nodes and solves."""
        return float(getattr(self, what).max())

    def as_dict(self) -> dict[str, dict[str, float]]:
        """Mean and max of each, for a record."""
        names = ("truncation", "learning", "total")
        return {name: {"mean": self.mean(name), "max": self.max(name)} for name in names}

    def __str__(self) -> str:
        factor, unit = _SHOWN.get(self.unit, (1.0, self.unit))
        parts = [
            f"{name} {factor * figures['mean']:.3g} / {factor * figures['max']:.3g}"
            for name, figures in self.as_dict().items()
        ]
        return f"mean / max error over {len(self.total)} solves: {', '.join(parts)} {unit}".rstrip()

    __repr__ = __str__


_ARRAYS = ("modes", "rest", "points", "mass")


@dataclass(frozen=True, eq=False, repr=False)
class FieldSurrogate(Field):
    """A field as a value, kept in the file of its body.

    Attributes
    ----------
    name, unit : str
        Name and SI unit of the field.
    network : Network
        b of (c_x, c_y, c_z, …), k outputs in the field's unit; its inputs' ranges are the trained ones.
    modes : (k, nodes, components)
        φ, with Σ_j mass_j φ_kj·φ_lj = δ_kl.
    rest : (nodes, components)
        y₀, the field without contact.
    points : (nodes, 3)
        The nodes at rest, m.
    triangles : (t, 3)
        Of the surface, in these nodes.
    mass : (nodes,)
        Share of the surface that each node stands for; they add up to one.
    amplitude : DepthAmplitude
        f(s), the growth of the field with depth.
    surface : TouchedSurface
        The surface that the probe touches, with its signed distance.
    radius : float
        R of the probe, m; not used where `radius_input` says which input it is.
    local_mode : LocalMode, optional
        The part that moves with the probe; by default there is none.
    radius_input : int, optional
        The input, 3 or later, that is the probe's radius; by default it is no input.
    continuation : Continuation, optional
        How far b is followed beyond its training; of the network's ranges and the amplitude's depth unless given.
    meta : mapping
        JSON-able.
    drawn : CarriedSurface, optional
        The body's own surface at full detail, which pictures show; by default they show the field's own triangles.
    shift : tuple of three floats
        Way in m from c to the centre of the ball whose depth counts: zero for a ball, the way from a tool's place.
        `surface` is the body's less that way.
    tool : str, optional
        Description as JSON of a tool that turns, or presses a curved surface: then its balls tell the depth. None for
        a ball, and for a tool that one ball stands for.

    Raises
    ------
    UsageError
        If the parts do not fit together.
    """

    carrier: ClassVar[Literal["surface"]] = "surface"

    name: str
    unit: str
    network: Network
    modes: np.ndarray
    rest: np.ndarray
    points: np.ndarray
    triangles: Annotated[np.ndarray, np.int64]
    mass: np.ndarray
    amplitude: DepthAmplitude
    surface: TouchedSurface
    radius: float = math.nan
    local_mode: LocalMode | None = None
    radius_input: int | None = None
    continuation: Continuation | None = None
    meta: Mapping[str, Any] = field(default_factory=dict)
    drawn: CarriedSurface | None = None
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tool: str | None = None

    def __post_init__(self) -> None:
        own_arrays(self, *_ARRAYS)
        own_arrays(self, "triangles", dtype=np.int64)
        if self.continuation is None and len(self.network.inputs) >= 3:
            going = Continuation.of(self.network.inputs, deepest=self.amplitude.deepest)
            object.__setattr__(self, "continuation", going)
        if fault := self._fault():
            raise UsageError(
                f"A field surrogate can't be made: {fault}.",
                why="Its network, modes, nodes and probe must speak of the same body.",
                fix="Let `palpate.learning.fields.learn_field` make it of one set of solves.",
            )

    def _fault(self) -> str:
        """Return the fault by which parts do not fit; "" if there is none."""
        n, k = len(self.network.inputs), len(self.modes)
        nodes = len(self.points)
        if n < 3 or len(self.network.outputs) != k:
            return f"its network has {n} inputs and {len(self.network.outputs)} outputs for {k} modes"
        if self.modes.ndim != 3 or self.rest.shape != self.modes.shape[1:] or self.rest.shape[0] != nodes:
            return f"its modes {self.modes.shape} and rest {self.rest.shape} are not of {nodes} nodes"
        if self.points.shape != (nodes, 3) or self.mass.shape != (nodes,):
            return f"its points {self.points.shape} and masses {self.mass.shape} are not of {nodes} nodes"
        finite = all(np.isfinite(getattr(self, name)).all() for name in _ARRAYS)
        if not (finite and (self.mass >= 0).all() and abs(self.mass.sum() - 1.0) < 1e-9):
            return "its masses are no shares of one, or a number of it is not finite"
        return self._fault_of_probe()

    def _fault_of_probe(self) -> str:
        n, own, corners = len(self.network.inputs), self.radius_input, self.triangles
        if corners.shape != (len(corners), 3) or ((corners < 0) | (corners >= len(self.points))).any():
            return "its triangles are not of its nodes"
        if own is not None and not 3 <= own < n:
            return f"input {own} can't be the radius of {n} inputs, the first three being the position"
        if own is None and not (math.isfinite(self.radius) and self.radius > 0):
            return f"its probe has a radius of {self.radius} m"
        if self.continuation is not None and self.continuation.widths.shape != (n,):
            return f"its continuation has {self.continuation.widths.size} widths for {n} inputs"
        return self._fault_of_local_mode() or (self.drawn.fault_beside(corners) if self.drawn else "")

    def _fault_of_local_mode(self) -> str:
        wanted, local_mode = {1: 1, 3: 2}.get(self.rest.shape[1]), self.local_mode
        if local_mode is None:
            return ""
        if len(local_mode.table) != wanted:
            return "its moving part is of other components"
        own, further = local_mode.variation, len(self.inputs) - 3
        ends = [local_mode.table[:, -3:], *([] if own is None else [own.table[:, :, -3:]])]
        if any(end.any() for end in ends):
            return "its moving part does not end at its reach"
        strange = own is not None and own.powers.shape[1] != len(own.axes) + further
        return "its moving part varies with other inputs" if strange else ""

    def __str__(self) -> str:
        nodes, components = self.rest.shape
        each = f", {components} numbers each" * (components > 1)
        return (
            f"field {self.name}{f' ({self.unit})' * bool(self.unit)} on {nodes} nodes{each}: "
            f"{count(len(self.modes), 'mode')}{self._local_mode_in_words} that grow with depth "
            f"({self.amplitude.name} law), {count(self.network.units, 'unit')}"
        )

    @property
    def _local_mode_in_words(self) -> str:
        if self.local_mode is None:
            return ""
        return " and a local mode" if self.local_mode.variation is None else " and a local mode that varies"

    def fault_beside(self, energy: LearntEnergy) -> str:
        """Return what does not fit the energy of the same body; "" if all does."""
        surface, own = energy.baseline.surface, self.surface.arrays()
        if surface is not None and self.surface is not surface:
            theirs = surface.arrays()
            if not all(np.array_equal(theirs[k], own[k], equal_nan=True) for k in own):
                return "it has another touched surface"
        return super().fault_beside(energy)

    def with_surface(self, surface: TouchedSurface) -> FieldSurrogate:
        """Return the field over another touched surface."""
        return replace(self, surface=surface)

    @property
    def pictured(self) -> tuple[np.ndarray, np.ndarray]:
        """Points (p, 3) in m and triangles (t, 3) that pictures show: the body's own surface, where it is known."""
        own: FieldSurrogate | CarriedSurface = self.drawn or self
        return own.points, own.triangles

    def at_pictured(self, values: np.ndarray) -> np.ndarray:
        """Return values (..., p, c) at the points that pictures show, from those (..., nodes, c) at the nodes."""
        return values if self.drawn is None else self.drawn.carry(values, self.triangles)

    @cached_property
    def touched(self) -> np.ndarray:
        """Nodes (nodes,) that the moving part moves, bool."""
        if self.local_mode is None:
            return np.zeros(len(self.points), dtype=np.bool_)
        return self._touches(self.points)

    @cached_property
    def contact(self) -> PosedContact | None:
        """Where a tool touches whose balls tell the depth; None where one ball does."""
        return PosedContact(self.tool, self.surface) if self.tool else None

    def _touches(self, points: np.ndarray) -> np.ndarray:
        """Return which points (P, 3) in m the moving part moves, (P,) bool."""
        assert self.local_mode is not None
        return self.local_mode.touches(self.surface, points - np.array(self.shift))

    @cached_property
    def _fixed(self) -> tuple[np.ndarray, np.ndarray]:
        going = self.continuation
        assert going is not None
        low, high = bounds(self.inputs)
        own = -1 if self.radius_input is None else self.radius_input
        radius = self.radius if own < 0 else self.inputs[own].low
        numbers = [radius, own, going.deepest, going.depth_width, *self.amplitude.numbers()]
        return np.array(numbers, dtype=np.float64), np.array([low, high, going.widths])

    def compiled(self) -> tuple[Any, ...]:
        """(numbers, limits, surface, net): what `coefficients_into` takes last, with scratch for one thread."""
        return (*self._fixed, self.surface.compiled(), self.network.compiled())

    def profile_arguments(self) -> tuple[Any, ...]:
        """Arguments that `profile_into` takes last."""
        return profile_arguments(self.local_mode, self.amplitude.deepest)

    def moving_arguments(self) -> tuple[Any, ...]:
        """(reach, nodes, points): what `field_into` takes last."""
        if self.local_mode is None:
            return 1.0, np.zeros(0, np.int64), np.zeros((0, 3))
        nodes = np.flatnonzero(self.touched)
        return float(self.local_mode.reach), nodes, np.ascontiguousarray(self.points[nodes])

    def _checked(self, X: np.ndarray) -> np.ndarray:
        return rows_of(X, self.inputs, "field")

    def depth(self, X: np.ndarray) -> np.ndarray:
        """s (N,) of the rigid probe into the surface at rest, m; negative without contact."""
        X = self._checked(X)
        if self.contact is not None:
            return self.contact.at(X)[0]
        radius = self.radius if self.radius_input is None else X[:, self.radius_input]
        return self.surface.depth(X[:, :3], radius)

    def coefficients(self, X: np.ndarray) -> np.ndarray:
        """f b (N, k) at inputs X (N, n), in the field's unit; zero without contact.

        Raises
        ------
        UsageError
            If X has another number of columns; so do all that take X.
        """
        ev = self.evaluator(precision="double")
        out = np.empty((len(self._checked(X)), len(self.modes)))
        for i, x in enumerate(self._checked(X)):
            ev(x[:3], x[3:])
            out[i] = ev.coefficients
        return out

    def values(self, X: np.ndarray) -> np.ndarray:
        """The field (N, nodes, components) at inputs X (N, n)."""
        ev = self.evaluator(precision="double")
        out = np.empty((len(self._checked(X)), *self.rest.shape))
        for i, x in enumerate(self._checked(X)):
            ev(x[:3], x[3:])
            out[i] = ev.field()
        return out

    def values_at(self, X: np.ndarray, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
        """The field (N, P, components) at the nodes of another mesh of the same surface.

        The moving part is known everywhere; the others are carried from node to node.

        Parameters
        ----------
        X : (N, n)
            Inputs: centre of the probe (m), then further inputs.
        points : (P, 3)
            At rest, m.
        triangles : (t, 3) int
            Nodes of each triangle of that mesh.
        """
        if points.shape == self.points.shape and np.allclose(points, self.points, rtol=0, atol=1e-9):
            return self.values(X)
        interpolation = SurfaceInterpolation.of(
            self.points, self.triangles, points, node_normals(points, triangles)
        )
        values = self.values(X)
        out = interpolation(values)
        if self.local_mode is None:
            return out
        here, touched = self._moving_values(X, self.points), self._touches(points)
        out[:, touched] = (self._moving_values(X, points) + interpolation(values - here))[:, touched]
        return out

    def _moving_values(self, X: np.ndarray, points: np.ndarray) -> np.ndarray:
        assert self.local_mode is not None
        ev, touches = self.evaluator(precision="double"), []
        for x in self._checked(X):
            ev(x[:3], x[3:])
            touches.append(ev.place.copy())
        return moving_values(self.local_mode, self.amplitude.deepest, np.array(touches), points)

    def errors(self, X: np.ndarray, values: np.ndarray) -> FieldErrors:
        """Errors at solves X (N, n) with the fields (N, nodes, components), split into truncation and learning.

        Raises
        ------
        UsageError
            If shapes disagree.
        """
        values = np.asarray(values, float)
        if values.shape != (len(self._checked(X)), *self.rest.shape):
            raise UsageError(
                f"Fields of shape {values.shape} can't be compared.",
                why="A field is at the nodes of the body's surface, `rest`; a solve's is at all of the mesh's.",
                fix=f"Pass an array of shape {(len(X), *self.rest.shape)}: of a dataset those at np.unique(triangles).",
            )
        missed = values - self.values(X)
        learning = np.tensordot(self._along(missed), self.modes, 1)
        return FieldErrors(
            sizes_of(missed - learning), sizes_of(learning), sizes_of(missed), self.mass, self.unit
        )

    def _along(self, values: np.ndarray) -> np.ndarray:
        """Coefficients (N, k) of fields in the modes."""
        weighted = (self.modes * self.mass[:, None]).reshape(len(self.modes), -1)
        return np.asarray(values.reshape(len(values), -1) @ weighted.T)

    def evaluator(self, *, precision: Precision = "single") -> FieldEvaluator:
        """The allocation-free evaluator of a picture's path."""
        return FieldEvaluator(self, precision)


register_kind(Field, FieldSurrogate, "FieldSurrogate")
