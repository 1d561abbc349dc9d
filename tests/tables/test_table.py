"""Look-ups in a table, at places and in powers, and the table's description of itself."""

from __future__ import annotations

import json

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, DiffractionTable, HeightField, reference
from mitsuba_diffraction.optics.geometry import kirchhoff_factor
from mitsuba_diffraction.tables.build.checks import warnings_of
from mitsuba_diffraction.tables.powers import as_powers, order_0_power, powers_at
from tests.support.directions import lit_pairs, polar, rough_patch
from tests.support.patches import DEFAULTS, PATCH, WIDTH


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


def test_no_value_is_negative_though_series_ripple():
    table = DiffractionTable.build(PATCH, tolerance=1e-2, **DEFAULTS)
    rng = np.random.default_rng(6)
    q = rng.uniform(-1.0, 1.0, (2, 20000)) * table.q_limit / np.sqrt(2)
    values = table.window_sum(*q, rng.uniform(0.0, table.expansion.kappa_max, 20000))
    assert values.min() >= 0.0


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


def test_a_series_of_powers_is_that_of_the_amplitudes_squared():
    deep = rough_patch((16, 16), (0.15, 0.15), 0.4)
    given = {"coherence_width": 2.4, "basis": "taylor", "tolerance": 0.02}
    table = DiffractionTable.build(deep, **given)
    powers = as_powers(table)
    assert powers.expansion.kind == "power" != table.expansion.kind
    for kappa in table.expansion.kappa_max * np.linspace(0.05, 0.95, 7):
        exact, found = (powers_at(one, float(kappa)) for one in (table, powers))
        # 12 terms for 4 rad of an amplitude's phase: below the usual tolerance of a table
        assert np.abs(found - exact).sum() < 1e-3
        assert abs(order_0_power(powers, kappa) - order_0_power(table, kappa)) < 1e-4
