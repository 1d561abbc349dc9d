"""Building tables: they meet their tolerance against the reference, or refuse and say why."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import jv

from mitsuba_diffraction import DiffractionError, DiffractionTable, HeightField, gratings, reference
from mitsuba_diffraction.geometry import kirchhoff_factor
from mitsuba_diffraction.tables.choose import taylor_rounding
from tests.optics import lit_pairs, polar, rough_patch

#: 5.04 × 4.8 µm; WIDTH is nearly that wide.
PATCH = rough_patch((64, 63), (0.08, 0.075), 0.25)
WIDTH = 4.5
#: Several wavelengths deep.
DEEP = rough_patch((64, 64), (0.08, 0.08), 1.2)
DEFAULTS = {"coherence_width": WIDTH}


def relative_error(table, field, n=400, seed=1):
    """Σ|table − reference| / Σ reference of ⟨|P|²⟩, near order 0 and elsewhere."""
    wi, wo, lam, near = lit_pairs(field, table.sigma, n, seed)
    factor = kirchhoff_factor(wi, wo, lam, table.sigma)
    width = table.coherence_width
    exact = reference.brdf(field, wi, wo, lam, coherence_width=width, coherence=table.coherence)
    difference = np.abs(table.brdf(wi, wo, lam) - exact) / factor
    return [difference[m].sum() / (exact / factor)[m].sum() for m in (near, ~near)]


def refused(**arguments):
    """The one line with which a table of PATCH, or of heights=…, is refused."""
    heights = arguments.pop("heights", PATCH)
    with pytest.raises(DiffractionError) as caught:
        DiffractionTable.build(heights, **(DEFAULTS | arguments))
    assert "\n" not in str(caught.value)
    return str(caught.value)


# ------------------------------------------------------------------------ accuracy


@pytest.mark.parametrize(
    ("basis", "tolerance"),
    # 1e-5 is beyond what Taylor's terms keep of single precision, and refused
    [("svd", 10.0**-n) for n in (2, 3, 4, 5)]
    + [("chebyshev", 10.0**-n) for n in (2, 3, 5)]
    + [("taylor", 10.0**-n) for n in (2, 3, 4)],
)
@pytest.mark.parametrize("coherence", ["ensemble", "patch"])
def test_tables_meet_their_tolerance(coherence, basis, tolerance):
    table = DiffractionTable.build(
        PATCH, coherence=coherence, basis=basis, tolerance=tolerance, **DEFAULTS
    )
    assert table.largest_error <= tolerance
    # random directions in place of every bin, all κ in place of the worst: no allowance needed
    assert max(relative_error(table, PATCH)) <= tolerance


@pytest.mark.parametrize("coherence", ["ensemble", "patch"])
def test_deep_surfaces_take_more_intervals_not_longer_look_ups(coherence):
    table = DiffractionTable.build(DEEP, coherence=coherence, **DEFAULTS)
    assert table.expansion.terms == 8
    assert table.expansion.intervals > 2
    assert max(relative_error(table, DEEP)) <= 1e-3


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("coherence", ["ensemble", "patch"])
def test_orders_of_gratings_are_the_closed_forms(coherence, axis):
    period, depth, n = 2.0, 0.2, 64
    patches = {
        kind: getattr(gratings, kind)(
            period, depth, periods=8, pixels_per_period=n, rows=32, axis=axis
        )
        for kind in ("sinusoidal", "lamellar", "blazed")
    }
    for kind, field in patches.items():
        table = DiffractionTable.build(
            field, coherence_width=16.0, tolerance=1e-4, coherence=coherence
        )
        for kappa in (3.0, 17.0, 33.0):
            phase = kappa * depth
            m = np.arange(-5, 6)
            q = 2 * np.pi * m / period
            qx, qy = (q, 0 * q) if axis == "x" else (0 * q, q)
            with np.errstate(divide="ignore", invalid="ignore"):
                expected = {
                    "sinusoidal": jv(m, phase / 2) ** 2,
                    "lamellar": np.where(
                        m == 0,
                        np.cos(phase / 2) ** 2,
                        m % 2 * 4 * np.sin(phase / 2) ** 2 / (n * np.sin(np.pi * m / n)) ** 2,
                    ),
                    "blazed": np.sinc(m - phase / (2 * np.pi)) ** 2,
                }[kind]
            power = table.window_sum(qx, qy, kappa)
            # 1e-4 of all light; sampling a blaze with 64 pixels adds 1/(3·64²) = 8e-5 at one order
            bound = 1e-4 + (8.2e-5 if kind == "blazed" else 0.0)
            assert np.abs(power - expected).max() < bound, (kind, kappa)


def test_a_flat_patch_is_a_mirror_at_every_kappa():
    flat = HeightField(np.full((32, 32), 3.0), 0.08)
    for coherence in reference.COHERENCES:
        table = DiffractionTable.build(flat, coherence_width=2.5, coherence=coherence)
        # nothing is expanded: one Gaussian in single precision
        assert table.window_sum(0.0, 0.0, [0.0, 10.0, 30.0]) == pytest.approx(1.0, abs=1e-6)
        assert table.error["far"] == 0.0 or table.error["far"] < 1e-3
        one_sigma = table.window_sum(1 / table.sigma, 0.0, 10.0)
        assert one_sigma == pytest.approx(np.exp(-1.0), abs=1e-6)


def test_more_heights_than_one_patch_are_averaged():
    others = [rough_patch((64, 63), (0.08, 0.075), 0.25, seed=n) for n in (2, 3)]
    patches = [PATCH, *others]
    table = DiffractionTable.build(patches, tolerance=1e-4, **DEFAULTS)
    wi, wo, lam, _ = lit_pairs(PATCH, table.sigma, 200, seed=2)
    exact = np.mean(
        [reference.brdf(p, wi, wo, lam, coherence_width=WIDTH) for p in patches], axis=0
    )
    factor = kirchhoff_factor(wi, wo, lam, table.sigma)
    error = np.sum(np.abs(table.brdf(wi, wo, lam) - exact) / factor) / np.sum(exact / factor)
    assert error <= 1e-4
    assert [p["digest"] for p in table.source["patches"]] == [p.digest() for p in patches]
    assert 0.0 < table.source["variation"] < 2.0  # std over mean of speckle is near 1


def test_patches_of_other_pixels_but_one_size_are_averaged():
    fine = rough_patch((96, 96), (0.05, 0.05), 0.3)
    coarse = HeightField(fine.heights[::2, ::2], 0.1)
    table = DiffractionTable.build([fine, coarse], coherence_width=4.8, tolerance=1e-4)
    wi, wo, lam, _ = lit_pairs(coarse, table.sigma, 100, seed=2)
    exact = np.mean(
        [reference.brdf(p, wi, wo, lam, coherence_width=4.8) for p in (fine, coarse)], axis=0
    )
    factor = kirchhoff_factor(wi, wo, lam, table.sigma)
    error = np.sum(np.abs(table.brdf(wi, wo, lam) - exact) / factor) / np.sum(exact / factor)
    assert error <= 1e-4


def test_height_scale_is_a_factor_on_the_heights():
    table = DiffractionTable.build(PATCH, tolerance=1e-4, height_scale_max=2.0, **DEFAULTS)
    for scale in (0.3, 1.0, 2.0):
        scaled = HeightField(scale * PATCH.heights, PATCH.pixel_size)
        wi, wo, lam, _ = lit_pairs(scaled, table.sigma, 200, seed=3)
        exact = reference.brdf(scaled, wi, wo, lam, coherence_width=WIDTH)
        factor = kirchhoff_factor(wi, wo, lam, table.sigma)
        value = table.brdf(wi, wo, lam, height_scale=scale)
        assert np.sum(np.abs(value - exact) / factor) <= 1e-4 * np.sum(exact / factor)


@pytest.mark.parametrize("coherence", reference.COHERENCES)
@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-12, 1e-18, 1e-38])
def test_shallow_patches_take_the_shortest_series(depth, coherence):
    field = HeightField(PATCH.heights * (depth / PATCH.range), PATCH.pixel_size)
    table = DiffractionTable.build(field, coherence=coherence, **DEFAULTS)
    assert (table.expansion.intervals, table.expansion.terms) == (1, 4)
    if depth > 1e-15:  # below it the reference itself is rounding
        kappa, q = 30.0, np.array([4.0, 7.0]) * table.spacing[0]
        value, exact = (t.window_sum(q, 0.0, kappa) for t in (table, _fine(field, coherence)))
        assert value == pytest.approx(exact, rel=1e-2)  # 1e-3 of all orders, of single ones more


def _fine(field, coherence):
    return DiffractionTable.build(field, coherence=coherence, tolerance=1e-5, **DEFAULTS)


@pytest.mark.parametrize("coherence", reference.COHERENCES)
@pytest.mark.parametrize("depth", [0.05, 0.25, 1.2])
def test_the_svd_takes_no_more_memory_than_polynomials(depth, coherence):
    field = HeightField(PATCH.heights * (depth / PATCH.range), PATCH.pixel_size)
    ours, polynomials = (
        DiffractionTable.build(field, basis=basis, coherence=coherence, **DEFAULTS)
        for basis in ("svd", "chebyshev")
    )
    assert ours.nbytes <= polynomials.nbytes


@pytest.mark.parametrize("coherence", reference.COHERENCES)
def test_the_finest_tolerance_costs_a_few_more_intervals(coherence):
    coarse, fine = (
        DiffractionTable.build(PATCH, coherence=coherence, tolerance=t, **DEFAULTS)
        for t in (1e-3, 1e-6)
    )
    # Chebyshev series converge exponentially
    assert fine.expansion.intervals <= 4 * coarse.expansion.intervals
    assert fine.expansion.terms == 8


# ------------------------------------------------------------------------ what is read and kept


def test_a_table_does_not_guess_outside_its_range():
    table = DiffractionTable.build(PATCH, wavelength_range=(450.0, 700.0), **DEFAULTS)
    assert np.isnan(table.brdf(polar(0), polar(10), 440.0, height_scale=1.5))
    assert np.isnan(table.brdf(polar(0), polar(10), 450.0, height_scale=1.52))
    assert np.isfinite(table.brdf(polar(0), polar(0), 450.0, height_scale=1.5))
    # towards grazing the spatial frequency is what runs out: 2k of the shortest wavelength
    assert np.isnan(table.brdf(polar(89.9), polar(89.9), 440.0))
    assert np.isfinite(table.brdf(polar(89.9), polar(89.9), 450.0))
    assert table.brdf(polar(0), polar(120), 100.0) == 0.0  # below the surface there is nothing


def test_tables_are_symmetric_and_one_sided():
    table = DiffractionTable.build(PATCH, **DEFAULTS)
    wi, wo, lam, _ = lit_pairs(PATCH, table.sigma, 100, seed=4)
    # wi + wo is all that enters: rounding in the factor only
    assert table.brdf(wi, wo, lam) == pytest.approx(table.brdf(wo, wi, lam), rel=1e-14)
    below = wo * [1, 1, -1]
    assert np.array_equal(table.brdf(wi, below, lam), np.zeros(100))
    assert np.array_equal(table.brdf(below, wi, lam), np.zeros(100))


def test_no_value_is_negative_though_series_ripple():
    table = DiffractionTable.build(PATCH, tolerance=1e-2, **DEFAULTS)
    rng = np.random.default_rng(6)
    q = rng.uniform(-1.0, 1.0, (2, 20000)) * table.reach / np.sqrt(2)
    values = table.window_sum(*q, rng.uniform(0.0, table.expansion.kappa_max, 20000))
    assert values.min() >= 0.0


def test_light_fades_as_kappa_squared_towards_a_flat_surface():
    table = DiffractionTable.build(PATCH, **DEFAULTS)
    q = 6 * table.spacing[0]  # where the mirror's own lobe is down to exp(−70)
    shallow = table.window_sum(q, 0.0, [1e-4, 1e-3, 1e-2])
    # the first interval's factor κ̂² is exact, what is left changes by κh = 1e-3
    assert shallow[1:] / shallow[:-1] == pytest.approx(100.0, rel=1e-2)


def test_low_tolerances_are_stored_in_half_the_memory():
    rough, fine = (
        DiffractionTable.build(PATCH, tolerance=t, **DEFAULTS).coefficients.dtype
        for t in (1e-3, 1e-4)
    )
    assert (rough, fine) == (np.float16, np.float32)


@pytest.mark.parametrize(("basis", "terms"), [("svd", 6), ("chebyshev", 12), ("taylor", 40)])
def test_terms_and_taps_can_be_set(basis, terms):
    table = DiffractionTable.build(PATCH, basis=basis, terms=terms, taps=7, **DEFAULTS)
    assert table.expansion.terms == terms
    assert table.coefficients.shape[-1] == terms
    assert table.grid.taps == (7, 7)
    assert max(relative_error(table, PATCH)) <= 1e-3


def test_automatic_is_the_svd_of_powers():
    table = DiffractionTable.build(PATCH, **DEFAULTS)
    assert (table.expansion.basis, table.expansion.kind) == ("svd", "power")
    coherent = DiffractionTable.build(PATCH, coherence="patch", **DEFAULTS)
    assert (coherent.expansion.basis, coherent.expansion.kind) == ("svd", "amplitude")


@pytest.mark.parametrize("basis", ["svd", "chebyshev", "taylor"])
def test_progress_runs_to_its_end(basis):
    steps = []
    DiffractionTable.build(PATCH, basis=basis, progress=lambda *s: steps.append(s), **DEFAULTS)
    done, totals, texts = zip(*steps, strict=True)
    assert list(done) == sorted(done)
    assert len(set(totals)) == 1
    assert done[-1] == totals[-1]
    assert set(texts) == {"transforming", "measuring the error"}


def test_a_table_remembers_its_source_and_its_warnings():
    coarse = HeightField(PATCH.heights, 0.2, name="coarse.png")
    table = DiffractionTable.build(coarse, coherence_width=65.0, tolerance=1e-2)
    assert table.source["digest"] == coarse.digest()
    assert table.source["shape"] == [64, 63]
    warnings = table.source["warnings"]
    assert any("smaller than the coherence width of 65 µm" in line for line in warnings)
    assert any("pixel" in line for line in warnings)
    assert all("coarse.png" in line and "\n" not in line for line in warnings)
    gentle = rough_patch((64, 64), (0.08, 0.08), 0.05)
    assert DiffractionTable.build(gentle, **DEFAULTS).source["warnings"] == []


def test_the_summary_is_plain_data():
    table = DiffractionTable.build(PATCH, **DEFAULTS)
    summary = json.loads(json.dumps(table.summary()))
    assert summary["basis"] == "svd"
    assert summary["measured_error"]["colours (all other orders)"] == table.error["far"]
    assert summary["source"]["name"] == "rough patch"
    assert "svd power, ensemble" in repr(table)


# ------------------------------------------------------------------------ what is refused


def test_taylor_is_refused_where_single_precision_does_not_survive_it():
    text = refused(heights=DEEP, basis="taylor")
    assert text.startswith(
        "cannot build the table: basis='taylor' cannot reach tolerance=0.001 for heights of 1.2 µm"
    )
    assert "predicted error of" in text
    assert text.endswith("use basis='svd'")


@pytest.mark.parametrize("depth", [0.25, 0.4, 0.6])
def test_taylor_s_predicted_rounding_is_what_is_measured(depth):
    field = rough_patch((64, 64), (0.08, 0.08), depth)
    # so many taps and terms, at such a tolerance, that rounding is all the error there is
    table = DiffractionTable.build(
        field, basis="taylor", terms=60, taps=12, tolerance=0.9, **DEFAULTS
    )
    predicted = taylor_rounding(field, table.expansion.kappa_max, 60)
    measured = table.largest_error
    # a root mean square of errors with random signs, of which the measure sees one part or more
    assert 0.5 < predicted / measured < 8.0


def test_too_few_taylor_terms_are_refused_with_the_error_they_leave():
    text = refused(basis="taylor", terms=5)
    assert "terms=5 of basis='taylor' leave a predicted error of up to" in text
    assert "leave terms out, raise it, or use basis='svd'" in text
    text = refused(basis="taylor", terms=20)  # near enough to be tried
    assert "terms=20 of basis='taylor' leave an error of" in text
    assert "more than tolerance=0.001" in text


def test_too_few_taps_are_refused_with_the_error_they_leave():
    text = refused(taps=2)
    assert text.startswith("cannot build the table: taps=2 leave an error of ")
    assert text.endswith("leave taps out, or raise the tolerance")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"basis": "fourier"},
            "basis='fourier' is unknown; choose one of svd, chebyshev, taylor, auto",
        ),
        ({"coherence": "full"}, "coherence='full' is unknown; choose one of ensemble, patch"),
        ({"coherence_width": 0.0}, "coherence_width=0.0 must be a positive number of µm"),
        ({"coherence_width": np.nan}, "coherence_width=nan must be a positive number"),
        ({"tolerance": 1e-7}, "tolerance=1e-07 must lie between 1e-6 (single precision) and 1"),
        ({"tolerance": 1.0}, "tolerance=1.0 must lie between"),
        ({"tolerance": np.nan}, "tolerance=nan must lie between"),
        ({"terms": 0}, "terms=0 must be a whole number from 1 to 400"),
        ({"terms": 401}, "terms=401 must be a whole number from 1 to 400"),
        ({"taps": 65}, "taps=65 must be a whole number from 1 to 64"),
        ({"wavelength_range": (700.0, 400.0)}, "wavelength_range=(700, 400) must be two rising"),
        ({"wavelength_range": (0.36, 0.83)}, "in nm, between 10 and 100000"),
        ({"height_scale_max": 0.0}, "height_scale_max=0 must be a positive factor, at most 1000"),
        ({"height_scale_max": np.nan}, "height_scale_max=nan must be a positive factor"),
        ({"heights": []}, "there is no height field; give at least one"),
        ({"heights": [PATCH, PATCH], "coherence": "patch"}, "which coherence='patch' cannot"),
        ({"heights": [PATCH, PATCH], "basis": "taylor"}, "which basis='taylor' cannot"),
        ({"heights": [PATCH, DEEP]}, "crop them to one size"),
        ({"coherence_width": 0.05}, "look-up would read"),
    ],
)
def test_bad_parameters_are_refused_in_one_line(arguments, message):
    assert message in refused(**arguments)


def test_a_series_too_short_for_any_number_of_intervals_is_refused():
    text = refused(terms=1, tolerance=1e-5)
    assert "intervals of κ with 1 terms each still leave an error of" in text
    assert text.endswith("give more terms or a larger tolerance")


def test_a_table_too_large_for_any_renderer_is_refused_before_it_is_computed():
    # 5 µm of relief at a very short wavelength: some 1e5 terms for each of 1e6 orders
    large = HeightField(np.tile(rough_patch((64, 64), (0.02, 0.02), 12.0).heights, (8, 8)), 0.02)
    text = refused(heights=large, coherence_width=10.0, wavelength_range=(40.0, 830.0))
    assert "it would take" in text
    assert "GB" in text
    assert "use a smaller or shallower patch" in text


parameters = st.fixed_dictionaries(
    {
        "coherence_width": st.floats(0.05, 5.0),
        "coherence": st.sampled_from(reference.COHERENCES),
        "basis": st.sampled_from(["auto", "svd", "chebyshev", "taylor"]),
        "tolerance": st.sampled_from([1e-5, 1e-4, 1e-3, 0.01, 0.3]),
        "terms": st.none() | st.integers(1, 40),
        "taps": st.none() | st.integers(1, 12),
        "height_scale_max": st.floats(0.1, 3.0),
        "wavelength_range": st.sampled_from([(360.0, 830.0), (500.0, 501.0), (250.0, 1000.0)]),
    }
)


@settings(max_examples=40, deadline=None)
@given(st.floats(0.0, 0.5), st.integers(2, 17), st.integers(2, 17), parameters)
def test_any_table_meets_its_tolerance_or_is_refused(depth, ny, nx, arguments):
    heights = np.random.default_rng(ny * nx).random((ny, nx)) * depth
    field = HeightField(heights, (0.1, 0.08))
    try:
        table = DiffractionTable.build(field, **arguments)
    except DiffractionError as error:
        assert "\n" not in str(error)
        return
    assert table.largest_error <= arguments["tolerance"]
    assert np.all(np.isfinite(table.coefficients))
    rng = np.random.default_rng(1)
    q = rng.uniform(-1.0, 1.0, (2, 500)) * table.reach / np.sqrt(2)
    values = table.window_sum(*q, rng.uniform(0.0, table.expansion.kappa_max, 500))
    # Σ|a|² = 1 bounds any sum of powers; |Σ a·g|² of amplitudes by as much as windows overlap
    most = max(1.0, np.prod([1 + 4 / step for step in table.grid.steps]))
    assert values.min() >= 0.0
    assert values.max() <= most * (1 + arguments["tolerance"])


def test_a_window_far_narrower_than_the_patch_gets_all_its_taps():
    """The first guess of 47 taps falls short; one more at a time, the attempts would not last."""
    field = gratings.blazed(2.5, 0.25, periods=8, pixels_per_period=32)
    table = DiffractionTable.build(field, coherence_width=1.6)
    assert table.grid.taps[0] > 50
    assert max(relative_error(table, field)) <= table.tolerance
