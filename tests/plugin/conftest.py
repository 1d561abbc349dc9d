"""Every variant of Mitsuba that this machine runs."""

from __future__ import annotations

from collections.abc import Iterator

import drjit as dr
import mitsuba as mi
import pytest

from mitsuba_diffraction.tables.energy.settings import use_energy_settings
from tests.support.coarse import coarse_energy


@pytest.fixture
def coarsely() -> Iterator[None]:
    """Energy conserved coarsely, for a test of a module that asks for `fine`."""
    before = coarse_energy()
    yield
    use_energy_settings(before)


@pytest.fixture
def mono() -> None:
    """A variant of one wavelength, for short kernels."""
    if not dr.has_backend(dr.JitBackend.LLVM):
        pytest.skip("Dr.Jit finds no LLVM")
    mi.set_variant("llvm_ad_mono")
