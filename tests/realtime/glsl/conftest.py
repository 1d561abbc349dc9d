"""Tables small enough to be built in a second."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionTable, HeightField


@pytest.fixture(scope="session")
def patch() -> HeightField:
    """8 µm of a rough, asymmetric surface, 0.16 µm deep."""
    rng = np.random.default_rng(3)
    noise = np.fft.fft2(rng.normal(size=(96, 96)))
    q = 2 * np.pi * np.fft.fftfreq(96, 8 / 96)
    smooth = np.exp(-0.05 * (4 * q**2 + q[:, None] ** 2))
    heights = np.fft.ifft2(noise * smooth).real
    heights += 0.5 * heights**2 / heights.std()
    return HeightField((heights - heights.min()) * (0.16 / np.ptp(heights)), 8 / 96, name="rough")


@pytest.fixture(scope="session")
def table(patch: HeightField) -> DiffractionTable:
    """Its table of powers, for a window a little narrower than the patch."""
    return DiffractionTable.build(patch, coherence_width=6.5)


@pytest.fixture(scope="session")
def table_file(table: DiffractionTable, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The rough patch's table."""
    file = tmp_path_factory.mktemp("table") / "rough.exr"
    table.save(file)
    return file
