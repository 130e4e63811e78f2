"""Network files made by hand, with a checksum that is right."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from safetensors.numpy import save_file

from palpate.network import Network
from palpate.network.description import describe
from palpate.network.file import _digest


def parts_of(network: Network) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Content and arrays of a file with this network alone."""
    description, arrays = describe(network)
    content = {"networks": {"network": description}, "meta": {}}
    return content, {f"net/network/{k}": np.array(v) for k, v in arrays.items()}


def forge(path: Path, content: object, tensors: dict[str, np.ndarray], **header: str) -> Path:
    """Write a file whose checksum fits whatever it holds; content may be JSON text of its own."""
    text = content if isinstance(content, str) else json.dumps(content)
    full = {"palpate": "networks", "version": "2", "content": text} | header
    save_file(tensors, path, full | {"sha256": _digest(tensors, full)})
    return path
