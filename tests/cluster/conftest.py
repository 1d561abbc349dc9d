"""Workers for all tests of this folder: processes take seconds to start."""

from __future__ import annotations

import pytest

pytest.importorskip("distributed")

from mitsuba_diffraction import cluster
from mitsuba_diffraction.cluster import tasks
from tests.support.kernels import vectors_of


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


@pytest.fixture(autouse=True)
def own_scenes():
    """A scene that a worker keeps between tasks is let go of in this process.

    Dr.Jit's replay of a frozen function that was recorded beside it would end the process.
    """
    yield
    tasks._scene.cache_clear()
