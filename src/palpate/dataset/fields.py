"""What a body's solver answers: the schema of a dataset."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import UsageError
from palpate.units import Range

__all__ = ["BOOKKEEPING", "Field", "beam_fields", "complete", "solid_fields"]

RESERVED = frozenset({"inputs", "sample", "rest", "triangles"})  # variables that every dataset has of itself

_CONJUGATES = {"m": "N", "N": "m", "rad": "N m", "N m": "rad", "Pa": "m³", "N/m²": "m³"}


@dataclass(frozen=True)
class Field:
    """One quantity that each solve answers.

    Attributes
    ----------
    name : str
        Of the dataset's variable and of the answer's attribute.
    dims : tuple of str
        Names of its dimensions, ``"sample"`` apart; ``("node", "component")`` is a field over the body.
    shape : tuple of int
        Sizes of these dimensions.
    unit : str
        SI unit, or several joined by commas for the components.
    meaning : str
        A few words.
    optional : bool
        Whether an answer may lack it; it is then NaN.
    fill : object
        What stands in a row that has no answer. It decides the type of the numbers.

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
        """`count` rows without an answer, shape (count, *shape)."""
        kind = object if isinstance(self.fill, str) else None
        return np.full((count, *self.shape), self.fill, dtype=kind)


BOOKKEEPING = (
    Field("converged", meaning="whether this row is an equilibrium", fill=False),
    Field("iterations", meaning="Newton iterations", fill=0),
    Field("residual", meaning="relative error left, in the energy norm"),
    Field("message", meaning="why the solver stopped", fill="not solved"),
    Field("solve_seconds", unit="s", meaning="wall-clock time of the solve"),
)
"""What every dataset tells of each solve."""


def complete(schema: Iterable[Field]) -> tuple[Field, ...]:
    """The schema with the `BOOKKEEPING` that every dataset has.

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
    """Answers of a plane beam with so many nodes."""
    turned = "offset from the rest position and rotation"
    return (
        Field("displacement", ("node", "component"), (nodes, 3), "m, m, rad", turned),
        Field("root_reaction", ("reaction",), (3,), "N, N, N m", "force and moment of the clamp on the body"),
        Field("strain_energy", unit="J", meaning="energy stored in the body"),
        Field("potential_energy", unit="J", meaning="strain energy less the potential of the loads"),
        Field("largest_strain", meaning="largest strain of a fibre along the body", optional=True),
    )


def solid_fields(nodes: int, ranges: Sequence[Range], *, stress: bool = False) -> tuple[Field, ...]:
    """Answers of a solid with so many nodes under an interaction with n inputs.

    With U(q) the least energy of body and interaction at the inputs q, less that without contact, the response
    is −∂U/∂q: a force in N where inputs are positions in m, a displacement in m where they are forces.

    Parameters
    ----------
    nodes : int
    ranges : n ranges
    stress : bool
        Whether von Mises stress at the nodes is among them.
    """
    n, units = len(ranges), [conjugate_unit(r.unit) for r in ranges]
    slopes = {f"{of}/{by.unit}" for of in units for by in ranges}
    slope = slopes.pop() if len(slopes) == 1 else "unit of the response per unit of the input"
    seen = (Field("von_mises", ("node",), (nodes,), "Pa", "von Mises stress"),) if stress else ()
    return (
        Field("displacement", ("node", "component"), (nodes, 3), "m", "offset from the rest position"),
        *seen,
        Field("potential_energy", unit="J", meaning="energy U of body and interaction, without contact 0"),
        Field("strain_energy", unit="J", meaning="energy in the body: elastic, and the plastic work"),
        Field("response", ("input",), (n,), ", ".join(units), "−∂U/∂input: on a probe the force"),
        Field("response_gradient", ("input", "along"), (n, n), slope, "∂response/∂input"),
        Field("penetration", unit="m", meaning="largest penetration of the pad"),
        Field("least_volume_ratio", meaning="least det F of the body"),
        Field("largest_strain", meaning="largest |λ − 1| of a principal stretch λ", optional=True),
        Field(
            "chords", meaning="cheap steps with a tangent used before, beside the iterations", optional=True
        ),
    )


def conjugate_unit(unit: str) -> str:
    """Unit of what gives an energy with a quantity in `unit`: N for m."""
    return _CONJUGATES.get(unit, f"J/({unit})" if unit else "J")
