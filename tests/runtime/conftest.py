"""A body made by formula, in memory and in a file, and shared memory that cleans up after itself."""

from __future__ import annotations

import pytest
from standins import STIFFNESS, PlainModel

from models import spring_beam
from palpate.runtime.device_doubles import compile_double
from palpate.runtime.shared_state import Shared


@pytest.fixture(scope="session")
def spring():
    return spring_beam(STIFFNESS)


@pytest.fixture(scope="session")
def spring_file(spring, tmp_path_factory):
    return spring.save(tmp_path_factory.mktemp("models") / "spring.palpate")


@pytest.fixture
def shared():
    with Shared.create() as blocks:
        yield blocks


@pytest.fixture
def plain():
    return PlainModel()


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
