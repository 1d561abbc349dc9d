"""Every variant of Mitsuba that this machine runs."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.support.coarse import COARSE, energy_as
from tests.support.variants import use


@pytest.fixture
def coarsely() -> Iterator[None]:
    """Energy conserved coarsely, for a test of a module that asks for `fine`."""
    with energy_as(COARSE):
        yield


@pytest.fixture
def mono() -> None:
    """A variant of one wavelength, for short kernels."""
    use("llvm_ad_mono")
