"""The dataset: inputs and answers of many solves, as one frozen value."""

from __future__ import annotations

import functools
import hashlib
import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.dataset.named import Answers
from palpate.errors import UsageError

if TYPE_CHECKING:
    import xarray

__all__ = ["FORMAT", "FORMAT_VERSION", "Dataset"]

FORMAT = "palpate dataset"
FORMAT_VERSION = 2  # 1: plane beams only, otherwise the same
TIMINGS = frozenset({"solve_seconds"})  # differ from run to run: no part of a dataset's identity


@dataclass(frozen=True, eq=False)
class Dataset(Answers):
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
        from palpate.dataset.store import read

        return cls(read(Path(path)))

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
        """Write a Zarr store (a folder, by custom ``NAME.zarr``) and return its path.

        The store appears whole or not at all. Saving the same dataset again changes nothing.

        Raises
        ------
        UsageError
            If something else is at `path` and `overwrite` is false.
        """
        from palpate.dataset.store import write

        return write(self, Path(path), overwrite=overwrite)

    def __getitem__(self, name: str) -> np.ndarray:
        return self._values(name)

    @functools.cached_property
    def provenance(self) -> dict[str, Any]:
        """Where the answers come from: body, design, seed, versions, machine, time, configuration's hash."""
        loaded: dict[str, Any] = json.loads(self.data.attrs["provenance"])
        return loaded

    @functools.cached_property
    def hash(self) -> str:
        """SHA-256 of inputs and answers, timings apart, as hexadecimal digits."""
        return self.fingerprint(exclude=TIMINGS)

    def fingerprint(self, exclude: Iterable[str] = ()) -> str:
        """SHA-256 of all variables and coordinates but `exclude`, as hexadecimal digits."""
        digest = hashlib.sha256()
        for name in sorted(set(map(str, self.data.variables)) - set(exclude)):
            values = self.data[name].values
            digest.update(f"{name} {self.data[name].dims} {values.shape}".encode())
            if values.dtype.kind in "TOU":
                digest.update("\0".join(map(str, values.ravel())).encode())
            else:
                digest.update(np.ascontiguousarray(values).tobytes())
        return digest.hexdigest()

    @property
    def ok(self) -> Dataset:
        """The rows that converged."""
        return self.take(np.flatnonzero(self.converged))

    def take(self, indices: Any) -> Dataset:
        """The rows at `indices`, in that order.

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

    @classmethod
    def concat(cls, parts: Sequence[Dataset]) -> Dataset:
        """The rows of several sweeps of the same body, one after another; the first one's provenance stands.

        Raises
        ------
        UsageError
            If there are none, or they are of different bodies, meshes or inputs.
        """
        from palpate.dataset.join import joined

        return cls(joined(parts))

    def every(self, k: int, start: int = 0) -> Dataset:
        """Each k-th row, from `start` on."""
        if k < 1 or start < 0:
            raise UsageError(
                f"Rows cannot be taken every {k} from {start}.",
                why="The stride is at least 1 and the start at least 0.",
                fix="For every other row: every(2).",
            )
        return self.take(np.arange(start, len(self), k))

    def split(self, test: float = 0.25, seed: int = 1) -> tuple[Dataset, Dataset]:
        """Part the rows that converged at random into a training and a test set.

        Parameters
        ----------
        test : float
            Share of the rows for the test set, in (0, 1); either set gets one row at least.
        seed : int
            The same seed gives the same parts.

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
        if not 0 < test < 1 or rows.size < 2:
            raise UsageError(
                f"{rows.size} converged rows can't be split with {test} of them for the test.",
                why="The share is between 0 and 1, and each part needs at least one row.",
                fix="Choose a share such as 0.25, or sweep more samples.",
            )
        count = int(np.clip(round(test * rows.size), 1, rows.size - 1))
        shuffled = np.random.default_rng(seed).permutation(rows)
        return self.take(np.sort(shuffled[count:])), self.take(np.sort(shuffled[:count]))

    def __str__(self) -> str:
        from palpate.dataset.words import in_words

        return in_words(self)

    __repr__ = __str__
