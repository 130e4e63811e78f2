"""Where a dataset comes from: configuration, versions, machine."""

from __future__ import annotations

import datetime
import hashlib
import importlib.metadata
import json
import os
import platform
from typing import Any

import numpy as np

from palpate.sweeps.problem import Problem

__all__ = ["config_hash", "provenance"]

_PACKAGES = ("palpate", "ngsolve", "numpy", "scipy", "distributed", "xarray", "zarr")


def config_hash(problem: Problem, points: np.ndarray) -> str:
    """SHA-256 of everything that decides a sweep's answers, as hexadecimal digits."""
    digest = hashlib.sha256(json.dumps(problem.describe(), sort_keys=True).encode())
    digest.update(repr(points.shape).encode())
    digest.update(np.ascontiguousarray(points).tobytes())
    return digest.hexdigest()


def provenance(problem: Problem, points: np.ndarray, design: str, seed: int) -> dict[str, Any]:
    """Plain data that says where the answers come from."""
    return {
        "problem": problem.describe(),
        "words": getattr(problem, "words", ""),
        "symmetry": getattr(problem, "symmetry", None),
        "design": design,
        "seed": seed,
        "samples": len(points),
        "config_hash": config_hash(problem, points),
        "created": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "versions": {"python": platform.python_version(), **{name: _version(name) for name in _PACKAGES}},
        "machine": {"system": platform.system(), "processor": platform.machine(), "cpus": os.cpu_count()},
    }


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"
