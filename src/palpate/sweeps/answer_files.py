"""The answers of one case in a file of plain arrays, kept while its sweep goes on."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.dataset import Field, Layout
from palpate.files import write_file
from palpate.input_files import DAMAGE, open_input

__all__ = ["SavedCase"]

_ARRAYS = ("rest", "of_interest", "triangles", "surface_of")  # of a layout
_WORDS = ("load_nodes", "load_directions", "axes", "components", "surfaces", "labels")


@dataclass(frozen=True, eq=False)
class SavedCase:
    """Nodes and surface of a case, its fields, and the value of each by its name."""

    layout: Layout
    fields: tuple[Field, ...]
    values: Mapping[str, np.ndarray]

    def save(self, path: Path) -> None:
        """Write the case, whole or not at all."""
        fields = [
            {
                "name": f.name,
                "dims": list(f.dims),
                "shape": list(f.shape),
                "unit": f.unit,
                "meaning": f.meaning,
            }
            for f in self.fields
        ]
        words = {name: _plain(getattr(self.layout, name)) for name in _WORDS}
        arrays = {name: value for name in _ARRAYS if (value := getattr(self.layout, name)) is not None}
        content = io.BytesIO()
        parts: dict[str, Any] = {"head": np.array(json.dumps({"fields": fields, "layout": words}))}
        parts |= {f"layout {name}": np.asarray(value) for name, value in arrays.items()}
        parts |= {f"answer {name}": np.asarray(value) for name, value in self.values.items()}
        np.savez(content, **parts)
        write_file(path, content.getvalue())

    @classmethod
    def load(cls, path: Path) -> SavedCase | None:
        """Read a case; None where there is none, or its file is damaged: it is solved again then."""
        if not path.is_file():
            return None
        try:
            with open_input(path) as file, np.load(file, allow_pickle=False) as archive:
                arrays = {name: archive[name] for name in archive.files}
            head = json.loads(str(arrays["head"]))
            layout = {name: arrays[f"layout {name}"] for name in _ARRAYS if f"layout {name}" in arrays}
            fields = tuple(
                Field(f["name"], tuple(f["dims"]), tuple(f["shape"]), f["unit"], f["meaning"])
                for f in head["fields"]
            )
            values = {f.name: arrays[f"answer {f.name}"] for f in fields}
            return cls(Layout(**layout, **head["layout"]), fields, values)
        except (*DAMAGE, KeyError):
            return None


def _plain(value: Any) -> Any:
    """Return words and numbers of a layout as JSON takes them."""
    if isinstance(value, Mapping):
        return {key: list(entry) for key, entry in value.items()}
    return np.asarray(value).tolist() if isinstance(value, np.ndarray) else list(value)
