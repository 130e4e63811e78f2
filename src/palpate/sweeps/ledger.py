"""The ledger of a sweep: its finished parts, on disk, through interruptions.

While a sweep to ``NAME.zarr`` runs, finished rows are written every few seconds as a small dataset of
its own in ``NAME.zarr.parts``, whole or not at all. A sweep of the same configuration takes the parts up; the
last step joins them into ``NAME.zarr``.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from palpate.dataset import Dataset
from palpate.errors import FileFormatError, ResourceError, UsageError
from palpate.files import restore_folder, system_errors, write_file

__all__ = ["Ledger", "Progress", "read_progress"]


@dataclass(frozen=True)
class Ledger:
    """The parts of one sweep."""

    path: Path  # of the dataset when it is complete
    config: str  # hash of the sweep's configuration

    @property
    def parts(self) -> Path:
        """Folder of the parts."""
        return self.path.with_name(self.path.name + ".parts")

    @property
    def is_begun(self) -> bool:
        """True where an interrupted run of this very sweep has left its parts."""
        return _plan_in(self.parts / "plan.json").get("config_hash") == self.config

    def complete(self) -> Dataset | None:
        """Read the finished dataset, if there is one."""
        restore_folder(self.path)
        if not self.path.exists():
            return None
        try:
            dataset = Dataset.open(self.path)
        except FileFormatError as error:
            raise FileFormatError(
                error.what,
                why=error.why,
                fix=f"Delete {self.path} and sweep again, or write to another path.",
            ) from error
        self._check(self.path, dataset.provenance.get("config_hash"))
        return dataset

    def begin(self, samples: int) -> None:
        """Open the ledger of a sweep of so many samples; one that belongs to another sweep is refused."""
        plan = self.parts / "plan.json"
        if (config := _plan_in(plan).get("config_hash")) is not None:
            self._check(self.parts, config)
            return
        with system_errors(f"The folder {self.parts} could not be made."):
            self.parts.mkdir(parents=True, exist_ok=True)
        write_file(plan, json.dumps({"config_hash": self.config, "samples": samples}))

    def read(self) -> Iterator[Dataset]:
        """Yield the parts that earlier runs finished."""
        for part in sorted(self.parts.glob("part-*.zarr")):
            try:
                yield Dataset.open(part)
            except FileFormatError:
                shutil.rmtree(part, ignore_errors=True)  # to be solved again

    def add(self, part: Dataset) -> None:
        """Keep a finished part."""
        if not self.parts.exists():
            return  # another run of the same sweep has finished and tidied up
        part.save(self.parts / f"part-{part.hash[:16]}.zarr", overwrite=True)

    def finish(self, dataset: Dataset) -> Dataset:
        """Write the whole dataset, drop the parts, and return the dataset that is at the path now.

        Where another run of the same sweep was faster, it is that run's.
        """
        other = self.complete()
        if other is None:
            try:
                dataset.save(self.path)
            except (UsageError, ResourceError):  # the other run may have come in between
                other = self.complete()
                if other is None:
                    raise
        shutil.rmtree(self.parts, ignore_errors=True)  # the other run may be at it too
        return dataset if other is None else other

    def _check(self, place: Path, config: object) -> None:
        if config != self.config:
            raise UsageError(
                f"{place} belongs to another sweep.",
                why="Its body, loads or samples are not those asked for now.",
                fix="Write to another path, or delete it first.",
            )


def _plan_in(plan: Path) -> dict[str, object]:
    """Return what a plan says: nothing where there is none, or an earlier version was killed as it wrote it."""
    try:
        content = json.loads(plan.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


@dataclass(frozen=True)
class Progress:
    """The progress of a sweep, by its files."""

    solved: int  # rows that are on disk, with those that failed
    failed: int
    samples: int | None  # rows of the whole sweep; None where an earlier version did not write it down
    written: float | None  # time of the newest of them in s since 1970; None where there is none yet

    @property
    def is_complete(self) -> bool:
        """True where the dataset is whole."""
        return self.solved == self.samples


def read_progress(path: Path) -> Progress | None:
    """Return how far the sweep to a dataset's path is; None where it has not begun. Nothing is changed."""
    if path.exists():
        data = Dataset.open(path)
        return Progress(len(data), len(data) - len(data.ok), len(data), path.stat().st_mtime)
    folder = path.with_name(path.name + ".parts")
    if not folder.exists():
        return None
    converged: dict[int, bool] = {}
    written = None
    for part in folder.glob("part-*.zarr"):
        try:
            data = Dataset.open(part)
            written = max(written or 0.0, part.stat().st_mtime)
        except (FileFormatError, FileNotFoundError):  # it was being written, or tidied up
            continue
        converged.update(zip(data["sample"].tolist(), data.converged.tolist(), strict=True))
    samples = _plan_in(folder / "plan.json").get("samples")
    failed = sum(not value for value in converged.values())
    return Progress(len(converged), failed, samples if isinstance(samples, int) else None, written)
