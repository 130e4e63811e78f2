"""Where a study's files are."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

__all__ = ["Paths"]


@dataclass(frozen=True)
class Paths:
    """Where a study's files are: all named after the study, in one folder."""

    folder: Path
    name: str

    @property
    def data(self) -> Path:
        """The sweep's dataset."""
        return self.folder / f"{self.name}.zarr"

    @property
    def random(self) -> Path:
        """The dataset of random loads, for testing only."""
        return self.folder / f"{self.name}-random.zarr"

    @property
    def histories(self) -> Path:
        """Histories that a body that remembers was learnt from."""
        return self.folder / f"{self.name}-histories.palpate"

    @property
    def unseen_histories(self) -> Path:
        """Its histories for testing only."""
        return self.folder / f"{self.name}-unseen.palpate"

    @property
    def model(self) -> Path:
        """The touch model."""
        return self.folder / f"{self.name}.palpate"

    @property
    def history(self) -> Path:
        """What happened while it was learnt."""
        return self.folder / f"{self.name}.history.npz"

    @property
    def report(self) -> Path:
        """The report."""
        return self.folder / f"{self.name}.html"
