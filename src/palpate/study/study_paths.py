"""Files of a study, by what they hold."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

__all__ = ["Paths"]


@dataclass(frozen=True)
class Paths:
    """Files of a study: all named after the study, in one folder."""

    folder: Path
    name: str

    @property
    def lock(self) -> Path:
        """File that the command which works on the study has locked."""
        return self.folder / f".{self.name}.palpate-lock"

    @property
    def data(self) -> Path:
        """Dataset of the sweep."""
        return self.folder / f"{self.name}.zarr"

    @property
    def is_begun(self) -> bool:
        """True where solves are there, or a sweep or a batch of them has begun."""
        names = (self.data.name + ending for ending in ("", ".parts", ".batch"))
        return any(self.data.with_name(name).exists() for name in names)

    @property
    def random(self) -> Path:
        """Dataset of further solves, for testing only."""
        return self.folder / f"{self.name}-random.zarr"

    @property
    def finer(self) -> Path:
        """Dataset of a few of these further solves on finer elements, for the mesh's own error."""
        return self.folder / f"{self.name}-finer.zarr"

    @property
    def histories(self) -> Path:
        """Histories from which a body with memory is learnt, as an earlier version wrote them."""
        return self.folder / f"{self.name}-histories.palpate"

    @property
    def unseen_histories(self) -> Path:
        """Histories for testing only, as an earlier version wrote them."""
        return self.folder / f"{self.name}-unseen.palpate"

    @property
    def model(self) -> Path:
        """File of the surrogate."""
        return self.folder / f"{self.name}.palpate"

    @property
    def history(self) -> Path:
        """Record of the sequential filter, where one ran."""
        return self.folder / f"{self.name}.history.npz"

    @property
    def report(self) -> Path:
        """Page of the report."""
        return self.folder / f"{self.name}.html"
