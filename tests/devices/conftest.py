"""Fixtures of the devices' tests: those of the loop, and doubles of the vendors' libraries."""

from __future__ import annotations

import pytest

from loop_fixtures import plain, shared, spring, spring_file
from palpate.devices.doubles.library_doubles import compile_double

__all__ = ["double", "plain", "shared", "spring", "spring_file"]


@pytest.fixture(scope="session")
def double(c_compiler, tmp_path_factory):
    """Compiles the double of a device's library, once for each device and set of definitions; returns its file."""
    compiled = {}

    def compile_once(device, **definitions):
        key = (device, *sorted(definitions.items()))
        if key not in compiled:
            compiled[key] = compile_double(device, tmp_path_factory.mktemp(device), definitions)
        return compiled[key]

    return compile_once
