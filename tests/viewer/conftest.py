"""A body that bends far, and a viewer that shows it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from bodies import arc_beam

from palpate.surrogates import TouchModel
from palpate.viewer import Viewer


@pytest.fixture(scope="session")
def rod() -> TouchModel:
    return arc_beam()


@pytest.fixture(scope="module")
def viewer(rod: TouchModel) -> Iterator[Viewer]:
    with Viewer(rod, port=0) as running:
        yield running
