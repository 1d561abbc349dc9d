"""Workers for all tests of this folder: processes take seconds to start."""

from __future__ import annotations

import pytest

pytest.importorskip("distributed")

from mitsuba_diffraction import cluster


@pytest.fixture(scope="package")
def client():
    """Two workers of one thread each."""
    with cluster.connect(2) as found:
        yield found
