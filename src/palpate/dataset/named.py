"""The arrays of a dataset by name, each with its shape and unit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.errors import UsageError
from palpate.units import Range

if TYPE_CHECKING:
    import xarray

__all__ = ["Answers"]


class Answers:
    """What a dataset gives by name; arrays are read-only, and one that the body does not answer is refused."""

    data: xarray.Dataset

    def __len__(self) -> int:
        return int(self.data.sizes["sample"])

    def __contains__(self, name: object) -> bool:
        return name in self.data.variables

    @property
    def ranges(self) -> tuple[Range, ...]:
        """Name, range and unit of each of the n inputs."""
        columns = (self.data[name].values for name in ("input", "input_low", "input_high", "input_unit"))
        return tuple(
            Range(str(name), float(low), float(high), str(unit))
            for name, low, high, unit in zip(*columns, strict=True)
        )

    @property
    def X(self) -> np.ndarray:
        """Inputs, shape (sample, n), in the units of `ranges`."""
        return self._values("inputs")

    @property
    def displacement(self) -> np.ndarray:
        """Displacement of each node, shape (sample, node, 3): (u_x, u_y, u_z) in m; of a beam (u_x, u_y), rotation."""
        return self._values("displacement")

    @property
    def root_reaction(self) -> np.ndarray:
        """Force (x, y) in N and moment in N·m of a beam's clamp on it, shape (sample, 3)."""
        return self._values("root_reaction")

    @property
    def strain_energy(self) -> np.ndarray:
        """Energy stored in the body in J, shape (sample,)."""
        return self._values("strain_energy")

    @property
    def potential_energy(self) -> np.ndarray:
        """Energy U in J whose slope is the response: body, pad and loads together, shape (sample,)."""
        return self._values("potential_energy")

    @property
    def response(self) -> np.ndarray:
        """−∂U/∂input, shape (sample, n): forces in N for positions, displacements in m for forces."""
        return self._values("response")

    @property
    def response_gradient(self) -> np.ndarray:
        """∂response_i/∂input_j, shape (sample, n, n); symmetric."""
        return self._values("response_gradient")

    @property
    def force(self) -> np.ndarray:
        """Force on what touches the body, −∂U/∂position, in N, shape (sample, n)."""
        self._require_positions()
        return self.response

    @property
    def force_gradient(self) -> np.ndarray:
        """∂force_i/∂position_j in N/m, shape (sample, n, n): the stiffness felt, with a minus sign."""
        self._require_positions()
        return self.response_gradient

    @property
    def penetration(self) -> np.ndarray:
        """Largest penetration of the pad in m, shape (sample,)."""
        return self._values("penetration")

    @property
    def least_volume_ratio(self) -> np.ndarray:
        """Least determinant of the deformation gradient, shape (sample,)."""
        return self._values("least_volume_ratio")

    @property
    def largest_strain(self) -> np.ndarray:
        """Largest strain, of a beam's fibres or of a solid, shape (sample,); NaN where it isn't known."""
        if "largest_strain" in self.data:
            return self._values("largest_strain")
        return np.full(len(self), np.nan)

    @property
    def converged(self) -> np.ndarray:
        """Which rows are equilibria, bool of shape (sample,)."""
        return self._values("converged")

    @property
    def message(self) -> np.ndarray:
        """Why each solve stopped, text of shape (sample,)."""
        return self._values("message")

    @property
    def rest(self) -> np.ndarray:
        """Positions of the nodes at rest in m, shape (node, 2) or (node, 3)."""
        return self._values("rest")

    @property
    def triangles(self) -> np.ndarray:
        """Nodes of the surface's triangles, counter-clockwise seen from outside, shape (t, 3)."""
        return self._values("triangles")

    @property
    def nodes_of_interest(self) -> np.ndarray:
        """Indices of the nodes of interest."""
        return np.flatnonzero(self._values("of_interest"))

    @property
    def load_nodes(self) -> np.ndarray:
        """Index of the node that each input acts on, shape (n,)."""
        self._require_loads()
        return self._values("input_node")

    @property
    def load_directions(self) -> np.ndarray:
        """Direction of each input, shape (n, 2) or (n, 3)."""
        self._require_loads()
        return self._values("input_direction")

    def _require_positions(self) -> None:
        units = {r.unit for r in self.ranges}
        if units != {"m"}:
            raise UsageError(
                "This dataset has no force.",
                why=f"Its inputs are in {', '.join(sorted(units))}; a force is the response to positions in m.",
                fix="Ask for `response`, minus the slope of the energy over the inputs.",
            )

    def _require_loads(self) -> None:
        if "input_node" not in self:
            names = ", ".join(r.name for r in self.ranges)
            raise UsageError(
                "The inputs of this dataset are no loads at nodes.",
                why=f"{names}: they say where something touches the body, or how much acts on a surface.",
                fix="Use `response`, minus the slope of the energy over the inputs.",
            )

    def _values(self, name: str) -> np.ndarray:
        if name not in self.data.variables:
            raise UsageError(
                f"This dataset has no {name!r}.",
                why=f"It holds {', '.join(sorted(map(str, self.data.data_vars)))}.",
                fix="Ask for one of these; what a body answers depends on its kind.",
            )
        values: np.ndarray = self.data[name].values.view()
        values.flags.writeable = False
        return values
