"""One cluster of real worker processes for all tests of sweeps."""

import pytest

from palpate.sweeps import local_cluster


@pytest.fixture(scope="package")
def cluster():
    with local_cluster(2) as running:
        yield running
