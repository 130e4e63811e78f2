"""Small datasets of finite elements that are shipped solved, for tests that learn; `data/make_solves.py` makes them."""

from __future__ import annotations

import functools
import tempfile
import zipfile
from pathlib import Path

from palpate.dataset import Dataset

DATA = Path(__file__).parent / "data"


def unpack(name: str, folder: Path) -> Path:
    """Put the files of a name, ``"block"``, ``"family"`` or ``"small"``, into a folder."""
    with zipfile.ZipFile(DATA / f"{name}.zip") as packed:
        packed.extractall(folder)
    return folder


@functools.cache
def solved(name: str) -> Dataset:
    """Dataset of a name, ``"block"`` or ``"family"``, in memory."""
    with tempfile.TemporaryDirectory() as folder:
        return Dataset(Dataset.open(unpack(name, Path(folder))).data.load())
