"""Patches, and methods that share what they tabulate of them."""

from __future__ import annotations

import pytest

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.heights import gratings
from mitsuba_diffraction.thesis import methods
from tests.support.directions import rough_patch

#: Coherence width, µm: narrower than the rough patch.
WIDTH = 12.0


@pytest.fixture(scope="session")
def rough() -> HeightField:
    """A rough patch, 12.8 × 8.6 µm."""
    return rough_patch((96, 128), (0.09, 0.1), 0.3)


@pytest.fixture(scope="session")
def grating() -> HeightField:
    """Period 2 µm along x."""
    return gratings.sinusoidal(2.0, 0.12, periods=8)


@pytest.fixture(scope="session")
def of_rough(rough):
    """Methods of `rough`, which share what they tabulate."""
    return methods.make_all(
        ("spectral", "flss", "pq", "pq-sinc"), rough, coherence_width=WIDTH, repeats=(3, 2)
    )
