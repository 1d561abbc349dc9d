"""Tables of patches of all shapes can be looked up, in all variants."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.plugin.device_table import _UNROLLED_TAPS, device_table
from tests.support.directions import rough_patch
from tests.support.lanes import lanes

pytestmark = pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning")
VARIANTS = ("scalar_spectral", "llvm_ad_mono", "llvm_ad_spectral")


def drawn(seed):
    """A table of an elongated patch, and look-ups that it covers."""
    rng = np.random.default_rng(seed)
    width, length = np.sort(rng.uniform(2.0, 14.0, 2))
    pixel = 0.13
    field = rough_patch((round(width / pixel), round(length / pixel)), (pixel, pixel), 0.1, seed)
    table = md.DiffractionTable.build(
        field,
        coherence_width=float(rng.uniform(0.8, 1.0) * width),
        coherence=str(rng.choice(["ensemble", "patch"])),
        basis=str(rng.choice(["auto", "chebyshev", "taylor"])),
        tolerance=10.0 ** rng.uniform(-4.0, -2.0),
        wavelength_range=(500, 600),
    )
    angle, share = rng.uniform(0, 2 * np.pi, 40), np.sqrt(rng.uniform(0, 0.95, 40))
    radii = table.frequency_limit
    asked = radii[0] * share * np.cos(angle), radii[1] * share * np.sin(angle)
    return table, (*asked, rng.uniform(0.5, 0.99, 40) * table.expansion.kappa_max)


@pytest.mark.parametrize("seed", range(6))
def test_every_table_is_looked_up_as_numpy_does(seed):
    table, asked = drawn(seed)
    expected = table.window_sum(*asked)
    for name in VARIANTS:
        mi.set_variant(name)
        device = device_table(table)
        if name.startswith("scalar"):
            found = [device.window_sum(*map(float, q)) for q in zip(*asked, strict=True)]
        else:
            found = np.array(device.window_sum(*map(lanes, asked)))
        # frequencies in single precision, over lobes that are 1/σ wide; squares of lengths below
        # 1e-20 have no direction there, and no table holds light that is so faint
        faint = max(2e-5 * expected.max(), 1e-20)
        assert found == pytest.approx(expected, rel=2e-3, abs=faint), name


def test_many_bins_in_few_rows_are_read_in_a_loop(some_variant):
    """Where no corners are left out either: rows then are variables, and so are their weights."""
    field = rough_patch((32, 72), (0.13, 0.13), 0.1)
    table = md.DiffractionTable.build(
        field, coherence_width=3.3, tolerance=1e-4, wavelength_range=(500, 600)
    )
    assert table.grid.taps_read > _UNROLLED_TAPS
    assert table.grid.taps[1] <= 6
    assert not table.grid.trims
    q = (0.3, 0.2, 15.0)
    found = device_table(table).window_sum(*map(mi.Float, q))
    assert np.array(found) == pytest.approx(table.window_sum(*map(np.atleast_1d, q)), rel=1e-3)
