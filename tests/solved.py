"""Small datasets of finite elements that are shipped solved, for tests that learn; `data/make_solves.py` makes them."""

from __future__ import annotations

import functools
import tempfile
import zipfile
from pathlib import Path

from palpate.dataset import Dataset

DATA = Path(__file__).parent / "data"


@functools.cache
def solved(name: str) -> Dataset:
    """Dataset of a name, ``"block"`` or ``"family"``, in memory."""
    with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(DATA / f"{name}.zip") as packed:
        packed.extractall(folder)
        return Dataset(Dataset.open(folder).data.load())
