"""Tables in the plugin, with a frequency limit or many bins: the NumPy look-up's values."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.plugin.device_table import _UNROLLED_TAPS, device_table
from tests.support.directions import polar, rough_patch, uniform_directions
from tests.support.lanes import evaluated, lanes, refusal
from tests.support.variants import use

#: Of coarse pixels: small tables. The plugin warns of that, and of the limit.
PATCH = rough_patch((64, 64), (0.3, 0.3), 0.2)


@pytest.fixture(scope="module")
def table():
    return md.DiffractionTable.build(PATCH, coherence_width=18.0, frequency_limit=(6.0, 5.0))


@pytest.fixture(scope="module")
def saved(table, tmp_path_factory):
    file = tmp_path_factory.mktemp("limited") / "table.exr"
    table.save(file)
    return str(file)


def lookups(count):
    """Random (qx, qy, κ), some of which no light can probe."""
    rng = np.random.default_rng(2)
    angle, radius = rng.uniform(0, 2 * np.pi, count), 36.0 * rng.uniform(0, 1, count)
    values = radius * np.cos(angle), radius * np.sin(angle), rng.uniform(0.5, 54.0, count)
    return [v.astype(np.float32).astype(float) for v in values]


@pytest.mark.parametrize("variant", ["llvm_ad_spectral", "scalar_spectral"])
def test_the_plugin_reads_what_numpy_reads(variant, table):
    use(variant)
    x, y, kappa = lookups(2000 if dr.is_jit_v(mi.Float) else 60)
    device = device_table(table)
    if dr.is_jit_v(mi.Float):
        values = np.array(device.window_sum(*map(lanes, (x, y, kappa))))
    else:
        values = [device.window_sum(*map(float, q)) for q in zip(x, y, kappa, strict=True)]
    expected = table.window_sum(x, y, kappa)
    assert np.isnan(expected).any()
    assert (expected == 0.0).any()
    # sums of float32 products: 1e-5 of the largest
    largest = np.nanmax(expected)
    assert values == pytest.approx(expected, rel=1e-4, abs=1e-6 * largest, nan_ok=True)


def test_the_surface_is_dark_beyond_the_limit_and_never_not_a_number(some_variant, saved):
    bsdf = mi.load_dict({"type": "diffraction", "filename": saved, "material": "none"})
    wi, wo = polar(50.0, 20.0), uniform_directions(400, np.random.default_rng(4))
    values = evaluated(bsdf, wi, wo, 450.0)
    q = 2e3 * np.pi / 450.0 * (wi + wo)[:, :2]
    inside = np.hypot(q[:, 0] / 6.0, q[:, 1] / 5.0) <= 1.0
    assert np.isfinite(values).all()
    assert np.all(values[~inside] == 0.0)
    assert np.all(values[inside] > 0.0)


def test_rgb_variants_refuse_it(saved):
    mi.set_variant("llvm_ad_rgb")
    line = refusal(lambda: mi.load_dict({"type": "diffraction", "filename": saved}))
    assert "RGB variants" in line


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
