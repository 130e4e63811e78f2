"""The dataset: inputs and answers of many solves of one body, as one frozen value."""

from __future__ import annotations

import functools
import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.dataset import store
from palpate.dataset.schema import BOOKKEEPING, TIMINGS
from palpate.errors import UsageError
from palpate.format import count as count_of
from palpate.format import share
from palpate.units import Range

if TYPE_CHECKING:
    import xarray

__all__ = ["Dataset"]

_LEFT_OUT = {"inputs", "displacement", "largest_strain"} | {field.name for field in BOOKKEEPING}


@dataclass(frozen=True, eq=False)
class Dataset:
    """Inputs and answers of many solves of one body.

    Attributes
    ----------
    data : xarray.Dataset
        ``inputs`` (sample, input) and a variable for each answer, samples first: of every body ``converged``,
        ``iterations``, ``residual``, ``message`` and ``solve_seconds``; of most ``displacement``
        (sample, node, component) and energies; the rest depends on the body. Units stand in each variable's
        attributes. Rows without an admissible answer hold NaN and a message.

    Notes
    -----
    Every array is also an item, ``dataset["strain_energy"]``, read-only. A property or an item that the body
    does not answer raises `UsageError`.
    """

    data: xarray.Dataset

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> Dataset:
        """Read a dataset that `save` wrote.

        Raises
        ------
        FileFormatError
            If there is none at `path`, or it is corrupt, foreign or from a later version of palpate.
        """
        return cls(store.read(Path(path)))

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
        """Write a Zarr store (a folder, by custom ``NAME.zarr``) and return its path.

        The store appears whole or not at all. Saving the same dataset again changes nothing.

        Raises
        ------
        UsageError
            If something else is at `path` and `overwrite` is false.
        """
        return store.write(self.data, Path(path), overwrite=overwrite)

    @classmethod
    def concat(cls, parts: Sequence[Dataset]) -> Dataset:
        """Join the rows of several sweeps of one body; the first sweep's provenance stands.

        Raises
        ------
        UsageError
            If there are none, or they are of different bodies, meshes or inputs.
        """
        import xarray

        if not parts:
            raise UsageError("There are no datasets to put together.", fix="Give at least one.")
        for other in parts[1:]:
            _check_same_body(parts[0], other)
        rows: xarray.Dataset = xarray.concat(
            [part.data for part in parts],
            "sample",
            data_vars="minimal",
            coords="minimal",
            compat="override",
            join="override",
            combine_attrs="override",
        )
        # row numbers of different sweeps mean nothing together
        if "sample" in rows.coords:
            rows = rows.assign_coords(sample=np.arange(rows.sizes["sample"]))
        return cls(rows)

    # ---- origin and identity ----

    @functools.cached_property
    def provenance(self) -> dict[str, Any]:
        """Origin of the answers: body, design, seed, versions, machine, time, hash of the configuration."""
        loaded: dict[str, Any] = json.loads(self.data.attrs["provenance"])
        return loaded

    @functools.cached_property
    def hash(self) -> str:
        """SHA-256 of inputs and answers without the timings, as hexadecimal digits."""
        return self.fingerprint(exclude=TIMINGS)

    def fingerprint(self, exclude: Iterable[str] = ()) -> str:
        """Return the SHA-256 of all variables and coordinates but `exclude`, as hexadecimal digits."""
        return store.fingerprint(self.data, exclude)

    @property
    def folder(self) -> Path | None:
        """Folder of the store that the dataset was read from, or None."""
        source = self.data.encoding.get("source")
        return None if source is None else Path(source)

    # ---- rows ----

    def __len__(self) -> int:
        return int(self.data.sizes["sample"])

    @property
    def is_history(self) -> bool:
        """True where the rows are samples of histories."""
        own = ("history", "time", "place", "dissipated")
        return all(name in self and self.data[name].dims == ("sample",) for name in own)

    @property
    def size_in_words(self) -> str:
        """The number of solves, or of histories with their samples."""
        if not self.is_history:
            return count_of(len(self), "solve")
        owners = self["history"]
        histories = count_of(len(np.unique(owners[owners >= 0])), "history", "histories")
        return f"{histories} with {count_of(int((owners >= 0).sum()), 'sample')}"

    @property
    def ok(self) -> Dataset:
        """The rows that converged."""
        return self.take(np.flatnonzero(self.converged))

    def take(self, indices: Any) -> Dataset:
        """Return the rows at `indices`, in that order.

        Raises
        ------
        UsageError
            If an index is out of range.
        """
        rows = np.asarray(indices, dtype=np.int64).ravel()
        if rows.size and not (-len(self) <= rows.min() and rows.max() < len(self)):
            raise UsageError(
                f"Row {int(rows[np.argmax(np.abs(rows))])} is not in this dataset.",
                why=f"It has {len(self)} rows, counted from 0.",
                fix="Take rows within it.",
            )
        return Dataset(self.data.isel(sample=rows))

    def every(self, k: int, start: int = 0) -> Dataset:
        """Return each k-th row, beginning with row `start`.

        Raises
        ------
        UsageError
            If `k` is below 1 or `start` below 0.
        """
        if k < 1 or start < 0:
            raise UsageError(
                f"Rows cannot be taken every {k} from {start}.",
                why="The stride is at least 1 and the start at least 0.",
                fix="For every other row: every(2).",
            )
        return self.take(np.arange(start, len(self), k))

    def split(self, test: float = 0.25, seed: int = 1) -> tuple[Dataset, Dataset]:
        """Split the rows that converged at random into a training and a test set.

        Parameters
        ----------
        test : float
            Share of the rows for the test set, in (0, 1); either set gets one row at least.
        seed : int
            Seed of the random order; equal seeds give equal sets.

        Returns
        -------
        train, test : Dataset
            Each keeps the order of the rows.

        Raises
        ------
        UsageError
            If `test` is no share, or fewer than two rows converged.
        """
        rows = np.flatnonzero(self.converged)
        # the samples of a history stay together, and a body without its memory is there to learn from
        owners = self["history"][rows] if self.is_history else rows
        parts = np.unique(owners[owners >= 0])
        if not 0 < test < 1 or parts.size < 2:
            raise UsageError(
                f"{parts.size} converged rows can't be split with {test} of them for the test.",
                why="The share is between 0 and 1, and each part needs at least one row.",
                fix="Choose a share such as 0.25, or sweep more samples.",
            )
        count = int(np.clip(round(test * parts.size), 1, parts.size - 1))
        shuffled = np.random.default_rng(seed).permutation(parts)
        learnt, held_out = np.isin(owners, shuffled[:count], invert=True), np.isin(owners, shuffled[:count])
        return self.take(rows[learnt]), self.take(rows[held_out])

    # ---- arrays by name ----

    def __contains__(self, name: object) -> bool:
        return name in self.data.variables

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self.data.variables:
            raise UsageError(
                f"This dataset has no {name!r}.",
                why=f"It holds {', '.join(sorted(map(str, self.data.data_vars)))}.",
                fix="Ask for one of these; what a body answers depends on its kind.",
            )
        values: np.ndarray = self.data[name].values.view()
        values.flags.writeable = False
        return values

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
        return self["inputs"]

    @property
    def displacement(self) -> np.ndarray:
        """Displacement of each node, shape (sample, node, 3): (u_x, u_y, u_z) in m; of a beam (u_x, u_y), rotation."""
        return self["displacement"]

    @property
    def root_reaction(self) -> np.ndarray:
        """Force (x, y) in N and moment in N·m of a beam's clamp on it, shape (sample, 3)."""
        return self["root_reaction"]

    @property
    def strain_energy(self) -> np.ndarray:
        """Energy stored in the body in J, shape (sample,)."""
        return self["strain_energy"]

    @property
    def potential_energy(self) -> np.ndarray:
        """Energy U in J whose slope is the response: body, pad and loads together, shape (sample,)."""
        return self["potential_energy"]

    @property
    def response(self) -> np.ndarray:
        """−∂U/∂input, shape (sample, n): forces in N for positions, displacements in m for forces."""
        return self["response"]

    @property
    def response_gradient(self) -> np.ndarray:
        """∂response_i/∂input_j, shape (sample, n, n); symmetric."""
        return self["response_gradient"]

    @property
    def force(self) -> np.ndarray:
        """Force of the body on the probe or pad, −∂U/∂position, in N, shape (sample, n)."""
        self._require_positions()
        return self.response

    @property
    def force_gradient(self) -> np.ndarray:
        """∂force_i/∂position_j in N/m, shape (sample, n, n): minus the stiffness felt."""
        self._require_positions()
        return self.response_gradient

    @property
    def penetration(self) -> np.ndarray:
        """Largest penetration of the pad in m, shape (sample,)."""
        return self["penetration"]

    @property
    def least_volume_ratio(self) -> np.ndarray:
        """Least determinant of the deformation gradient, shape (sample,)."""
        return self["least_volume_ratio"]

    @property
    def largest_strain(self) -> np.ndarray:
        """Largest strain, of a beam's fibres or of a solid, shape (sample,); NaN where it isn't known."""
        return self["largest_strain"] if "largest_strain" in self.data else np.full(len(self), np.nan)

    @property
    def converged(self) -> np.ndarray:
        """True for rows that are equilibria, bool of shape (sample,)."""
        return self["converged"]

    @property
    def message(self) -> np.ndarray:
        """Reason why each solve stopped, text of shape (sample,)."""
        return self["message"]

    @property
    def rest(self) -> np.ndarray:
        """Positions of the nodes at rest in m, shape (node, 2) or (node, 3)."""
        return self["rest"]

    @property
    def triangles(self) -> np.ndarray:
        """Nodes of the surface's triangles, counter-clockwise seen from outside, shape (t, 3)."""
        return self["triangles"]

    @property
    def nodes_of_interest(self) -> np.ndarray:
        """Indices of the nodes of interest."""
        return np.flatnonzero(self["of_interest"])

    @property
    def load_nodes(self) -> np.ndarray:
        """Index of the node that each input acts on, shape (n,)."""
        self._require_loads()
        return self["input_node"]

    @property
    def load_directions(self) -> np.ndarray:
        """Direction of each input, shape (n, 2) or (n, 3)."""
        self._require_loads()
        return self["input_direction"]

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

    # ---- text ----

    def __str__(self) -> str:
        failed = len(self) - int(self.converged.sum())
        outcome = f"{failed} did not converge" if failed else "all converged"
        kind = self.provenance.get("problem", {}).get("body", {}).get("type", "a body")
        strain = self.largest_strain[np.isfinite(self.largest_strain)]
        lines = [f"Dataset of {self.size_in_words} of {self.provenance.get('words') or kind}, {outcome}"]
        lines += [f"  input   {r}" for r in self.ranges]
        lines += [f"  answers {', '.join(self._answer_names())}"]
        if strain.size:
            kind = "strain" if "triangles" in self else "fibre strain"
            lines += [f"  largest {kind} {share(float(strain.max()))}"]
        return "\n".join([*lines, f"  hash    {self.hash[:12]}"])

    __repr__ = __str__

    def _answer_names(self) -> list[str]:
        nodes = f"{len(self.rest)} nodes ({self.nodes_of_interest.size} of interest)"
        others = (str(name) for name in self.data.data_vars if name not in _LEFT_OUT)
        return [
            f"displacement of {nodes}" if "displacement" in self else nodes,
            *(name.replace("_", " ") for name in others),
        ]


def _check_same_body(first: Dataset, other: Dataset) -> None:
    if other.provenance["problem"] != first.provenance["problem"] or other.ranges != first.ranges:
        raise UsageError(
            "These datasets are not of the same body and inputs.",
            why="Rows of different problems would be learnt as if they were of one.",
            fix="Keep them apart, or sweep again with one study.",
        )
    # one body meshed by two versions of the mesher has two sets of nodes
    if not np.array_equal(other.rest, first.rest):
        raise UsageError(
            "These datasets are of different meshes.",
            why="Their nodes at rest differ, so that rows of one field would mean different places.",
            fix="Sweep again with one version of the mesher.",
        )
