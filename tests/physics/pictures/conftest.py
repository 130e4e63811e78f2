"""One mesh for all pictures."""

from __future__ import annotations

import pytest
from drawn import Made, block_mesh, dented

from palpate.physics.shapes.mesh import BodyMesh


@pytest.fixture(scope="session")
def mesh() -> BodyMesh:
    return block_mesh()


@pytest.fixture(scope="session")
def made(mesh: BodyMesh) -> Made:
    return dented(mesh)
