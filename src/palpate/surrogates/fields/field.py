"""The contract of a field: what the eye sees of a surrogate, over a touched surface, nodes, a mesh or an axis.

A kind of field is a frozen dataclass of this base, entered by `register_kind`, so that a file may hold it. Whoever
needs more than the contract asks by `surface_fields`, `line_of` and `modal_fields` what there is.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from palpate.network import Network, TrainedRegion
from palpate.units import Range

if TYPE_CHECKING:
    from palpate.surrogates.energy import LearntEnergy
    from palpate.surrogates.fields.field_surrogate import FieldSurrogate
    from palpate.surrogates.fields.modal_field import ModalField
    from palpate.surrogates.fields.node_field import NodeField
    from palpate.surrogates.surface import TouchedSurface

__all__ = ["Field", "line_of", "modal_fields", "surface_fields"]


class Field:
    """A field as a value, kept in the file of its surrogate.

    Attributes
    ----------
    name, unit : str
        What it is called, and the SI unit of its values.
    network : Network
        n inputs → whatever the values are made of; its inputs' ranges are the trained ones.
    carrier : {"surface", "line", "places"}
        Where its values are: on a touched surface, at the nodes of a body that loads bend, or at places of any kind.
    asked_as_body : bool
        Whether its inputs are those of its surrogate; a field by load is asked by loads, its surrogate by place.
    is_curve : bool
        True where its values are points of a curve.
    """

    name: str
    unit: str
    network: Network
    carrier: ClassVar[Literal["surface", "line", "places"]]
    asked_as_body: ClassVar[bool] = True
    is_curve: bool = False

    def __repr__(self) -> str:
        return str(self)

    @property
    def inputs(self) -> tuple[Range, ...]:
        """Names, units and trained ranges of the n inputs."""
        return self.network.inputs

    @property
    def region(self) -> TrainedRegion | None:
        """The trained region of its own, in scaled inputs; None where that of its energy holds."""
        return None

    def values(self, X: np.ndarray) -> np.ndarray:
        """Return the field (N, places, components) at inputs X (N, n).

        Raises
        ------
        UsageError
            If X has another number of columns.
        """
        raise NotImplementedError

    def trusted(self, X: np.ndarray) -> np.ndarray:
        """Return which of X (N, n) are like what was learnt from, (N,) bool; all, where its energy says it."""
        return np.ones(len(X), dtype=bool)

    def fault_beside(self, energy: LearntEnergy) -> str:
        """Return what does not fit the energy of the same body; "" if all does."""
        names = [(r.name, r.unit) for r in self.inputs]
        return "" if names == [(r.name, r.unit) for r in energy.inputs] else "it has other inputs"

    def with_surface(self, surface: TouchedSurface) -> Field:
        """Return the field over another touched surface; the same one where it lies on none."""
        return self


def surface_fields(fields: Mapping[str, Field]) -> dict[str, FieldSurrogate]:
    """Return the fields on a touched surface, by name."""
    return _on(fields, "surface")


def modal_fields(fields: Mapping[str, Field]) -> dict[str, ModalField]:
    """Return the fields and curves of any physics, by name."""
    return _on(fields, "places")


def line_of(fields: Mapping[str, Field]) -> NodeField | None:
    """Return the displacement of a body that is drawn as a line of nodes; None of any other."""
    return _on(fields, "line").get("displacement")


def _on(fields: Mapping[str, Field], carrier: str) -> dict[str, Any]:
    return {name: shown for name, shown in fields.items() if shown.carrier == carrier}
