"""The schema of a dataset: the quantities that each solve answers, and the nodes that they belong to."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.units import Range

__all__ = [
    "BOOKKEEPING",
    "FORMAT",
    "FORMAT_VERSION",
    "TIMINGS",
    "Field",
    "Layout",
    "beam_fields",
    "check_schema",
    "conjugate_unit",
    "solid_fields",
    "with_bookkeeping",
]

FORMAT = "palpate dataset"
FORMAT_VERSION = 3  # 1: plane beams only; up to 2: chunks and arrays without a checksum of their own
TIMINGS = frozenset({"solve_seconds"})  # differ from run to run: no part of a dataset's identity

# variables that every dataset has of itself
RESERVED = frozenset({"inputs", "sample", "rest", "triangles", "drawn_points", "drawn_triangles"})

_CONJUGATES = {"m": "N", "N": "m", "rad": "N m", "N m": "rad", "Pa": "m³", "N/m²": "m³"}


@dataclass(frozen=True)
class Field:
    """One quantity that each solve answers.

    Attributes
    ----------
    name : str
        Name of the dataset's variable and of the answer's attribute.
    dims : tuple of str
        Names of its dimensions, ``"sample"`` apart; ``("node", "component")`` is a field over the body.
    shape : tuple of int
        Sizes of these dimensions.
    unit : str
        SI unit, or several joined by commas for the components.
    meaning : str
        A few words that explain it, kept beside the numbers.
    optional : bool
        True where an answer may lack it; it is then NaN.
    fill : object
        Value in rows without an answer; it decides the type of the numbers.

    Raises
    ------
    UsageError
        If there is not one size for each dimension.
    """

    name: str
    dims: tuple[str, ...] = ()
    shape: tuple[int, ...] = ()
    unit: str = ""
    meaning: str = ""
    optional: bool = False
    fill: Any = np.nan

    def __post_init__(self) -> None:
        if len(self.dims) != len(self.shape):
            raise UsageError(
                f"The field {self.name!r} has dimensions {self.dims} and shape {self.shape}.",
                why="Each dimension needs one size.",
                fix='For example Field("displacement", ("node", "component"), (120, 3), "m").',
            )

    def empty(self, count: int) -> np.ndarray:
        """Return `count` rows without an answer, shape (count, *shape)."""
        return np.full((count, *self.shape), self.fill, dtype=object if isinstance(self.fill, str) else None)


BOOKKEEPING = (
    Field("converged", meaning="whether this row is an equilibrium", fill=False),
    Field("iterations", meaning="Newton iterations", fill=0),
    Field("residual", meaning="relative error left, in the energy norm"),
    Field("message", meaning="why the solver stopped", fill="not solved"),
    Field("solve_seconds", unit="s", meaning="wall-clock time of the solve"),
)
"""Fields that every dataset has for each solve."""


def with_bookkeeping(schema: Iterable[Field]) -> tuple[Field, ...]:
    """Append the `BOOKKEEPING` that every dataset has to a schema.

    Raises
    ------
    UsageError
        If two fields share a name, or one takes a name that a dataset uses itself.
    """
    fields = (*schema, *BOOKKEEPING)
    names = [field.name for field in fields]
    taken = {name for name in names if names.count(name) > 1} | (RESERVED & set(names))
    if taken:
        raise UsageError(
            f"The name {sorted(taken)[0]!r} is given to more than one variable of the dataset.",
            why=f"A dataset has {', '.join(sorted(RESERVED | {f.name for f in BOOKKEEPING}))} of itself.",
            fix="Give each field of the schema a name of its own.",
        )
    return fields


def beam_fields(nodes: int) -> tuple[Field, ...]:
    """Return the fields that a plane beam with so many nodes answers."""
    return (
        Field(
            "displacement",
            ("node", "component"),
            (nodes, 3),
            "m, m, rad",
            "offset from the rest position and rotation",
        ),
        Field("root_reaction", ("reaction",), (3,), "N, N, N m", "force and moment of the clamp on the body"),
        Field("strain_energy", unit="J", meaning="energy stored in the body"),
        Field("potential_energy", unit="J", meaning="strain energy less the potential of the loads"),
        Field("largest_strain", meaning="largest strain of a fibre along the body", optional=True),
    )


_TORQUE = Field("torque", ("component",), (3,), "N m", "torque on a tool about its place", optional=True)


def solid_fields(
    nodes: int, ranges: Sequence[Range], *, stress: bool = False, edges: int = 0, torque: bool = False
) -> tuple[Field, ...]:
    """Return the fields that a solid with so many nodes answers under an interaction with n inputs.

    With U(q) the least energy of body and interaction at the inputs q, less that without contact, the response
    is −∂U/∂q: a force in N where inputs are positions in m, a displacement in m where they are forces.

    Parameters
    ----------
    nodes : int
        Number of nodes of the mesh.
    ranges : sequence of n ranges
        Inputs of the interaction; their units decide those of the response.
    stress : bool
        True adds the von Mises stress at the nodes, ``"von_mises"``.
    edges : int
        Number of the surface's edges, in whose middles the displacement is answered too, ``"mid_displacement"``; by
        default it is not.
    torque : bool
        True adds the torque on a tool about its place, ``"torque"``.
    """
    n, units = len(ranges), [conjugate_unit(r.unit) for r in ranges]
    slopes = {f"{unit}/{r.unit}" for unit in units for r in ranges}
    slope = slopes.pop() if len(slopes) == 1 else "unit of the response per unit of the input"
    von_mises = Field("von_mises", ("node",), (nodes,), "Pa", "von Mises stress")
    meaning = "offset of the middles of the surface's edges, sorted by their nodes"
    middles = Field("mid_displacement", ("edge", "component"), (edges, 3), "m", meaning)
    return (
        Field("displacement", ("node", "component"), (nodes, 3), "m", "offset from the rest position"),
        *((middles,) if edges else ()),
        *((von_mises,) if stress else ()),
        Field("potential_energy", unit="J", meaning="energy U of body and interaction, without contact 0"),
        Field("strain_energy", unit="J", meaning="energy in the body: elastic, and the plastic work"),
        Field("response", ("input",), (n,), ", ".join(units), "−∂U/∂input: on a probe the force"),
        Field("response_gradient", ("input", "along"), (n, n), slope, "∂response/∂input"),
        *((_TORQUE,) if torque else ()),
        Field("penetration", unit="m", meaning="largest penetration of the pad"),
        Field("least_volume_ratio", meaning="least det F of the body"),
        Field("largest_strain", meaning="largest |λ − 1| of a principal stretch λ", optional=True),
        Field(
            "chords", meaning="cheap steps with a tangent used before, beside the iterations", optional=True
        ),
    )


def conjugate_unit(unit: str) -> str:
    """Return the unit that makes an energy with a quantity in `unit`: N for m."""
    return _CONJUGATES.get(unit, f"J/({unit})" if unit else "J")


@dataclass(frozen=True, eq=False)
class Layout:
    """Nodes, axes and surface that all answers of one body have in common.

    Attributes
    ----------
    rest : (node, 2) or (node, 3) array
        Positions at rest in m.
    of_interest : (node,) array of bool, optional
        True for nodes that are judged and shown; by default those of the triangles, or all where there are none.
    load_nodes : sequence of int
        For each input the index of the node that it acts on; empty where inputs don't act on nodes.
    load_directions : (n, 2) or (n, 3) array
        For each input the direction in which it acts.
    axes, components : tuple of str
        Names of the axes of space and of a node's displacement. By default those of a plane beam, whose nodes
        have a rotation too, or those of a solid.
    triangles : (t, 3) array of int, optional
        Nodes of the surface's triangles, counter-clockwise seen from outside.
    surfaces : tuple of str
        Names of the parts of the surface.
    surface_of : (t,) array of int, optional
        For each triangle the index of its part in `surfaces`.
    drawn : pair of (p, 3) array and (q, 3) array of int, optional
        Points in m and triangles of the body's own surface at full detail, which pictures show; by default they show
        `triangles`.
    cells : pair of (c, 2 or 3) array and (t,) array of int, optional
        Middle of each cell in m, and for each triangle its cell, for answers with the dimension ``cell``; the second is
        empty where triangles don't tell it.
    scales : mapping of a dimension to values and a unit, optional
        Axes along which answers are curves, such as ``{"time": (times, "s")}``.
    labels : mapping of a dimension to names, optional
        For further dimensions of the answers; by default ``{"reaction": ("F_x", "F_y", "M")}`` in the plane.

    Raises
    ------
    UsageError
        If the arrays don't fit together.
    """

    rest: np.ndarray
    of_interest: np.ndarray | None = None
    load_nodes: Sequence[int] = ()
    load_directions: Sequence[Sequence[float]] = ()
    axes: tuple[str, ...] = ()
    components: tuple[str, ...] = ()
    triangles: np.ndarray | None = None
    surfaces: tuple[str, ...] = ()
    surface_of: np.ndarray | None = None
    labels: Mapping[str, Sequence[str]] | None = None
    drawn: tuple[np.ndarray, np.ndarray] | None = None
    cells: tuple[np.ndarray, np.ndarray] | None = None
    scales: Mapping[str, tuple[Sequence[float], str]] | None = None

    def __post_init__(self) -> None:
        def fill(name: str, value: object) -> None:
            object.__setattr__(self, name, value)  # a frozen value fills in its own defaults

        rest = np.asarray(self.rest, dtype=float)
        _require(rest.ndim == 2 and rest.shape[1] in {2, 3}, f"rest has the shape {rest.shape}")
        plane = rest.shape[1] == 2
        fill("rest", rest)
        fill("axes", tuple(self.axes or "xyz"[: rest.shape[1]]))
        fill("components", tuple(self.components or ("u_x", "u_y", "rotation" if plane else "u_z")))
        if self.labels is None:
            fill("labels", {"reaction": ("F_x", "F_y", "M")} if plane else {})
        if self.triangles is not None:
            fill("triangles", np.asarray(self.triangles, dtype=np.int64))
            _check_triangles(self.triangles, len(rest))
        fill("of_interest", self._nodes_of_interest())
        self._check()

    def _nodes_of_interest(self) -> np.ndarray:
        if self.of_interest is not None:
            return np.asarray(self.of_interest, dtype=bool)
        marked = np.full(len(self.rest), self.triangles is None)
        if self.triangles is not None:
            marked[self.triangles] = True
        return marked

    def _check(self) -> None:
        nodes, interest = len(self.rest), np.shape(np.asarray(self.of_interest))
        _require(interest == (nodes,), f"of_interest has the shape {interest} for {nodes} nodes")
        loads = (len(self.load_nodes), len(self.load_directions))
        _require(loads[0] == loads[1], f"there are {loads[0]} load_nodes and {loads[1]} load_directions")
        _require(
            len(self.axes) == self.rest.shape[1], f"axes are {self.axes} in {self.rest.shape[1]} dimensions"
        )
        for dim, (values, _) in (self.scales or {}).items():
            ascending = np.ndim(values) == 1 and bool((np.diff(values) > 0).all())
            _require(ascending, f"the values of the scale {dim!r} do not ascend")
        if self.cells is not None:
            centres, own = (np.shape(array) for array in self.cells)
            of_triangles = own in {(0,), (0 if self.triangles is None else len(self.triangles),)}
            fits = len(centres) == 2 and centres[1] == self.rest.shape[1] and of_triangles
            _require(fits, f"cells have the shapes {centres} and {own}")
        if self.surface_of is not None:
            indices, count = np.asarray(self.surface_of), 0 if self.triangles is None else len(self.triangles)
            _require(
                indices.shape == (count,), f"surface_of has the shape {indices.shape} for {count} triangles"
            )
            in_range = not indices.size or (indices.min() >= 0 and indices.max() < len(self.surfaces))
            _require(in_range, f"surface_of counts beyond the {len(self.surfaces)} surfaces")


def _check_triangles(triangles: np.ndarray, nodes: int) -> None:
    shape = triangles.shape
    _require(len(shape) == 2 and shape[1] == 3, f"triangles has the shape {shape}")
    inside = triangles.size == 0 or (triangles.min() >= 0 and triangles.max() < nodes)
    _require(inside, f"triangles names nodes outside 0 … {nodes - 1}")


def _require(fits: bool, why: str) -> None:
    if not fits:
        raise UsageError(
            "The arrays of this layout don't fit together.",
            why=f"{why[0].upper()}{why[1:]}.",
            fix="Give rest (node, 2 or 3), of_interest (node,) and triangles (t, 3) of the same nodes.",
        )


def check_schema(schema: Iterable[Field], layout: Layout, inputs: int) -> None:
    """Make sure that every field's dimensions have the sizes that the layout and the inputs give them.

    Raises
    ------
    UsageError
        If one has not.
    """
    sizes = {
        "node": len(layout.rest),
        "axis": len(layout.axes),
        "component": len(layout.components),
        "input": inputs,
        "along": inputs,
        **{dim: len(names) for dim, names in (layout.labels or {}).items()},
        **{dim: len(values) for dim, (values, _) in (layout.scales or {}).items()},
        **({} if layout.cells is None else {"cell": len(layout.cells[0])}),
    }
    for field in with_bookkeeping(schema):
        for dim, size in zip(field.dims, field.shape, strict=True):
            if sizes.setdefault(dim, size) != size:
                raise UsageError(
                    f"The field {field.name!r} has {size} values along {dim!r}.",
                    why=f"The layout, or a field before it, has {sizes[dim]}.",
                    fix="Give equal sizes, or call the dimension otherwise.",
                )
