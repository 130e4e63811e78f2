"""Fixtures of the loop and of what it drives: a body made by formula, and shared memory that cleans up after itself."""

from __future__ import annotations

import pytest

from models import spring_beam
from palpate.runtime.shared_state import Shared
from standins import STIFFNESS, PlainModel

__all__ = ["plain", "shared", "spring", "spring_file"]


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
