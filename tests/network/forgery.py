"""Network files made by hand, with a checksum that is right."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from palpate.network import Network
from palpate.network.archive import network_to_json
from palpate.network.container import Container, write_container


def parts_of(network: Network) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Content and arrays of a file with this network alone."""
    description, arrays = network_to_json(network)
    content = {"networks": {"network": description}, "meta": {}}
    return content, {f"net/network/{k}": np.array(v) for k, v in arrays.items()}


def forge(path: Path, content: object, tensors: dict[str, np.ndarray], version: str = "2") -> Path:
    """Write a file whose checksum fits whatever it holds; content may be JSON text of its own."""
    text = content if isinstance(content, str) else json.dumps(content)
    return write_container(path, Container("networks", text, tensors, version))
