"""What happened while the filter learnt, one row per observation."""

from __future__ import annotations

import os
import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.errors import FileFormatError, UsageError
from palpate.rbf.filter.step import Event

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["History"]


@dataclass(frozen=True, eq=False)
class History:
    """Growth and errors over T observations.

    Attributes
    ----------
    units : (T,) int
        Units after each observation.
    error : (T,)
        Error norm before each observation was used, in scaled outputs.
    window_rms : (T,)
        Windowed RMS of it.
    innovation : (T,)
        Running root mean square of the innovation per scaled output.
    grew, pruned : (T,) int
        Units added and removed by each observation.
    heldout : (T,)
        RMSE on held-out data after each observation, relative to full scale; empty where none were given.
    passes : int
    """

    units: np.ndarray
    error: np.ndarray
    window_rms: np.ndarray
    innovation: np.ndarray
    grew: np.ndarray
    pruned: np.ndarray
    heldout: np.ndarray
    passes: int

    @classmethod
    def of(
        cls, events: Sequence[Event], innovation: Sequence[float], heldout: Sequence[float], passes: int
    ) -> History:
        """Collect events (T) into arrays."""
        return cls(
            np.array([e.units for e in events], dtype=np.int64),
            np.array([e.error for e in events]),
            np.array([e.window_rms for e in events]),
            np.sqrt(np.array(innovation)),
            np.array([int(e.grew) for e in events], dtype=np.int64),
            np.array([e.pruned for e in events], dtype=np.int64),
            np.array(heldout),
            passes,
        )

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the history as a NumPy archive.

        Raises
        ------
        UsageError
            If the file can't be written.
        """
        path = Path(path)
        try:
            with path.open("wb") as file:
                np.savez_compressed(file, **vars(self))
        except OSError as error:
            raise UsageError(f"Could not write {path}.", why=str(error)) from error
        return path

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> History:
        """Read a history back.

        Raises
        ------
        FileFormatError
            If the file is missing or no history.
        """
        try:
            # opened here: on a damaged archive NumPy would leave its own handle open
            with Path(path).open("rb") as raw, np.load(raw, allow_pickle=False) as file:
                parts = {f.name: file[f.name] for f in fields(cls)}
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error) as error:
            raise FileFormatError(f"{path} is not a learning history.", why=str(error)) from error
        return cls(**(parts | {"passes": int(parts["passes"])}))

    def plot(self, ax: Axes | None = None) -> Figure:
        """Draw errors and units against the observations; ▲ marks a unit added, ▼ one removed.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw errors, with units on a second axis at the right. If left out a figure of its own is
            made, of no window and no global state: `savefig` writes it, a notebook shows it.

        Returns
        -------
        matplotlib.figure.Figure
        """
        from palpate.learning.drawing import plotted

        return plotted(self, ax)

    @property
    def relapse(self) -> float:
        """Largest ratio of the held-out error to its best so far; 1 is monotone, nan without held-out data."""
        if not self.heldout.size:
            return float("nan")
        return float((self.heldout / np.minimum.accumulate(self.heldout)).max())

    def __str__(self) -> str:
        text = (
            f"History: {self.units.size} observations in {self.passes} passes, {self.grew.sum()} units grown, "
            f"{self.pruned.sum()} pruned, {self.units[-1] if self.units.size else 0} left"
        )
        if self.heldout.size:
            text += f"; held-out error {self.heldout[-1]:.1e} of full scale, never above {self.relapse:.2f} × its best"
        return text
