"""Look-ups in a table, order 0 under the light's window, densities to draw from."""

from __future__ import annotations

import json

import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError, DiffractionTable, HeightField, reference
from mitsuba_diffraction.heights.coherence import LOOKUP
from mitsuba_diffraction.optics.geometry import kirchhoff_factor
from mitsuba_diffraction.tables.build.checks import warnings_of
from mitsuba_diffraction.tables.sampling import BANDED, BANDS, proposals
from tests.support.directions import lit_pairs, polar, rough_patch
from tests.support.patches import DEFAULTS, PATCH, SMALL_SCAN, WIDTH, relative_error


def test_a_table_does_not_guess_outside_its_range():
    table = DiffractionTable.build(PATCH, wavelength_range=(450.0, 700.0), **DEFAULTS)
    assert np.isnan(table.brdf(polar(0), polar(10), 440.0, height_scale=1.5))
    assert np.isnan(table.brdf(polar(0), polar(10), 450.0, height_scale=1.52))
    assert np.isfinite(table.brdf(polar(0), polar(0), 450.0, height_scale=1.5))
    # towards grazing the spatial frequency is what runs out: 2k of the shortest wavelength
    assert np.isnan(table.brdf(polar(89.9), polar(89.9), 440.0))
    assert np.isfinite(table.brdf(polar(89.9), polar(89.9), 450.0))
    for pair in ((polar(0), polar(120)), (polar(120), polar(0))):
        assert table.brdf(*pair, 100.0) == 0.0  # below the surface there is nothing


def test_light_fades_as_kappa_squared_towards_a_flat_surface():
    table = DiffractionTable.build(PATCH, **DEFAULTS)
    q = 6 * table.spacing[0]  # where the mirror's own lobe is down to exp(−70)
    shallow = table.window_sum(q, 0.0, [1e-4, 1e-3, 1e-2])
    # the first interval's factor κ̂² is exact, what is left changes by κh = 1e-3
    assert shallow[1:] / shallow[:-1] == pytest.approx(100.0, rel=1e-2)


def test_a_table_remembers_its_source_and_has_no_warnings_in_it():
    coarse = HeightField(PATCH.heights, 0.2, name="coarse.png")
    table = DiffractionTable.build(coarse, coherence_width=65.0, tolerance=1e-2)
    assert table.source["digest"] == coarse.digest()
    assert table.source["shape"] == [64, 63]
    assert "warnings" not in table.source  # which depend on nothing but heights and settings
    warnings = warnings_of([coarse], table.settings)
    assert any("coherence_width=12," in line for line in warnings)
    assert table.source["repeats"]
    assert "repetition" in table.width_text
    assert any("pixel" in line for line in warnings)
    assert all("coarse.png" in line and "\n" not in line for line in warnings)
    gentle = rough_patch((64, 64), (0.08, 0.08), 0.05)
    fitting = DiffractionTable.build(gentle, **DEFAULTS)
    assert warnings_of([gentle], fitting.settings) == []
    assert fitting.width_text == f"{fitting.coherence_width:g} µm"


def test_the_summary_is_plain_data():
    table = DiffractionTable.build(PATCH, **DEFAULTS)
    summary = json.loads(json.dumps(table.summary()))
    assert summary["basis"] == "svd"
    # a patch as wide as the window: σ·dq is 2π/4
    assert table.grid.taps == (4, 4)
    assert summary["measured_error"]["colours (all other orders)"] == table.error["far"]
    assert summary["source"]["name"] == "rough patch"
    assert "svd power, ensemble" in repr(table)


@pytest.mark.parametrize("basis", ["svd", "taylor"])
def test_a_window_anywhere_is_the_reference_s(basis):
    table = DiffractionTable.build(PATCH, coherence="patch", basis=basis, **DEFAULTS)
    wi, wo, lam, near = lit_pairs(PATCH, table.sigma, 300, seed=4)
    places = np.random.default_rng(0).uniform(-20.0, 20.0, (300, 2))
    light = {"coherence_width": WIDTH, "coherence": "surface", "place": places}
    exact = reference.brdf(PATCH, wi, wo, lam, **light)
    factor = kirchhoff_factor(wi, wo, lam, table.sigma)
    difference = np.abs(table.brdf(wi, wo, lam, place=places) - exact) / factor
    for part in (near, ~near):
        assert difference[part].sum() < table.tolerance * (exact / factor)[part].sum()


def test_the_patch_s_own_window_is_on_its_centre():
    table = DiffractionTable.build(PATCH, coherence="patch", **DEFAULTS)
    wi, wo, lam, _ = lit_pairs(PATCH, table.sigma, 50, seed=5)
    centre = 0.5 * np.array(PATCH.extent)
    # rounding of phases; the patch tiles the plane
    for place in (centre, centre + 3 * np.array(PATCH.extent)):
        assert table.brdf(wi, wo, lam, place=place) == pytest.approx(table.brdf(wi, wo, lam), 1e-9)


def test_a_table_of_powers_has_no_places():
    table = DiffractionTable.build(PATCH, **DEFAULTS)
    with pytest.raises(DiffractionError, match="coherence='patch'"):
        table.window_sum(0.0, 0.0, 1.0, (0.0, 0.0))


LAMP = polar(30.0, 180.0)
#: Settings of tables that are quick to build.
FAST = {"height_scale_max": 1.0, "wavelength_range": (440.0, 810.0)}


def beside_the_mirror(table, degrees, wavelengths):
    """Reflectance over that of white for a detector of 2° beside the mirror direction."""
    n = np.arange(600)
    radius, turn = np.radians(1.0) * np.sqrt((n + 0.5) / n.size), 2.399963 * n  # even over the disc
    sin, cos = np.sin(np.radians(30.0 + degrees)), np.cos(np.radians(30.0 + degrees))
    axes = np.array([[cos, 0.0, -sin], [0.0, 1.0, 0.0]])
    wo = np.array([sin, 0.0, cos]) * np.cos(radius)[:, None]
    wo += (np.stack([np.cos(turn), np.sin(turn)], axis=1) * np.sin(radius)[:, None]) @ axes
    each = [(table.brdf(LAMP, wo, lam) * wo[:, 2]).mean() for lam in wavelengths]
    return np.pi * np.array(each) / cos


@pytest.mark.parametrize("width", [1.0, 2.0, 5.0, 10.0, 30.0, 65.0])
def test_beside_the_mirror_of_a_flat_scan_is_no_light(width):
    noise = 1e-6 * np.random.default_rng(1).standard_normal((16, 16))  # µm: it limits the window
    scan = md.HeightField(noise, width / 16, cut_out=True)
    table = md.DiffractionTable.build(scan, **FAST)
    assert table.window_width == min(width, max(32.0, width / 2))
    for degrees in (3.0, 5.0, 10.0, 30.0):
        # the lobe of sunlight, 0.6° wide in red light, ends there
        assert beside_the_mirror(table, degrees, (450.0, 600.0, 800.0)).max() < 1e-3


def test_the_window_of_the_light_changes_order_0_alone():
    table = md.DiffractionTable.build(SMALL_SCAN)
    assert (table.coherence_width, table.window_width) == (65.0, min(SMALL_SCAN.extent))
    one = md.DiffractionTable.build(SMALL_SCAN, coherence_width=table.window_width)
    # the look-up's σ_l is LOOKUP times that of the light, whose lobe the taper makes up for
    assert one.order_0_ratio == pytest.approx(LOOKUP**-2, rel=1e-12)
    np.testing.assert_array_equal(table.coefficients, one.coefficients)
    q, kappa = np.array([0.0, 0.03, 0.1, 0.5, 2.0]), 20.0
    order_0 = one.order_0_at(kappa)[0]
    expected = one.window_sum(q, 0.0, kappa)
    expected -= order_0 * one.order_0_ratio * np.exp(-((one.sigma_0 * q) ** 2))
    ratio = (table.sigma_0 / table.sigma) ** 2
    expected += order_0 * ratio * np.exp(-((table.sigma_0 * q) ** 2))
    # differences of larger numbers
    np.testing.assert_allclose(table.window_sum(q, 0.0, kappa), expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("basis", ["svd", "chebyshev"])
def test_tables_of_a_small_scan_meet_their_tolerance(basis):
    table = md.DiffractionTable.build(SMALL_SCAN, basis=basis)
    near, far = relative_error(table, SMALL_SCAN)
    assert max(near, far) < table.tolerance
    # the lobe of the light, in which no pair above need lie
    wi, wo, lam, close = lit_pairs(SMALL_SCAN, table.sigma_0, 80, 3)
    exact = md.reference.brdf(SMALL_SCAN, wi, wo, lam)
    difference = np.abs(table.brdf(wi, wo, lam) - exact) / kirchhoff_factor(wi, wo, lam, 1.0)
    scale = exact / kirchhoff_factor(wi, wo, lam, 1.0)
    assert difference[close].sum() < table.tolerance * scale[close].sum()


def test_where_order_0_is_dark_all_light_is_a_number():
    """A sinusoid of amplitude a has no order 0 at κa = 2.4048, where a series may be below 0."""
    wave = 0.2 * np.sin(2.0 * np.pi * np.arange(40) / 40) * np.ones((4, 1))
    field = md.HeightField(wave, 0.05, periodic=True)
    table = md.DiffractionTable.build(field, coherence_width=3.0, tolerance=0.1, basis="chebyshev")
    kappa = np.linspace(2.3, 2.5, 400) / 0.2
    assert table.order_0_at(kappa).min() < 0.0  # there is such light
    wi, up = polar(20.0, 0.0), np.array([0.0, 0.0, 1.0])
    wavelength = 2e3 * np.pi * (wi + up)[2] / kappa
    assert np.all(table.brdf(wi, up, wavelength) >= 0.0)


DRAWN = rough_patch((50, 41), (0.08, 0.09), 0.2)


def test_their_cells_hold_the_power_of_the_orders():
    table = DiffractionTable.build(DRAWN, coherence_width=3.7)
    found = proposals(table)
    band = 3
    cells = np.diff(found.rows[band])[:, None] * np.diff(found.columns[band], axis=1)
    assert cells.sum() == pytest.approx(1.0, abs=1e-5)  # sums of 1000 single floats
    kappa = BANDED * (band + 0.5) / BANDS * table.expansion.kappa_max
    centres = [
        o + cell * (np.arange(n) + 0.5)
        for o, cell, n in zip(found.origin, found.cell, cells.T.shape, strict=True)
    ]
    x, y = np.meshgrid(*centres)
    inside = np.hypot(x, y) < table.q_limit
    power = np.zeros_like(cells)
    power[inside] = table.window_sum(x[inside], y[inside], kappa)
    beside = np.hypot(x, y) > 4 / table.sigma  # order 0 has no part in the cells
    # cells are the mean over a band of κ, here one κ at the centre of cells a lobe wide
    correlation = np.corrcoef(cells[inside & beside], power[inside & beside])[0, 1]
    assert correlation > 0.9
