"""Every variant of Mitsuba that this machine runs."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from mitsuba_diffraction.tables.energy.settings import use_energy_settings
from tests.support.coarse import coarse_energy
from tests.support.variants import use


@pytest.fixture
def coarsely() -> Iterator[None]:
    """Energy conserved coarsely, for a test of a module that asks for `fine`."""
    before = coarse_energy()
    yield
    use_energy_settings(before)


@pytest.fixture
def mono() -> None:
    """A variant of one wavelength, for short kernels."""
    use("llvm_ad_mono")
