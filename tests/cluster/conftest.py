"""Workers for all tests of this folder: processes take seconds to start."""

from __future__ import annotations

import pytest

pytest.importorskip("distributed")

from mitsuba_diffraction import cluster
from tests.coarse import vectors_of


@pytest.fixture(scope="package")
def client():
    """Two workers of one thread each."""
    with cluster.connect(2) as found:
        yield found


@pytest.fixture(autouse=True)
def workers_vectors(own_vectors):
    """Vectors as long as the workers', whose pictures are this process's bit by bit."""
    before = vectors_of(own_vectors)
    yield
    vectors_of(before)
