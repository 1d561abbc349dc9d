"""Building tables: they meet their tolerance against the reference, in little memory."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionTable, HeightField, reference
from mitsuba_diffraction.heights import gratings
from tests.support.directions import rough_patch
from tests.support.patches import DEEP, DEFAULTS, PATCH, relative_error

pytestmark = pytest.mark.thorough


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


def test_a_flat_patch_is_a_mirror_at_every_kappa():
    flat = HeightField(np.full((32, 32), 3.0), 0.08)
    for coherence in reference.COHERENCES:
        table = DiffractionTable.build(flat, coherence_width=2.5, coherence=coherence)
        # nothing is expanded: one Gaussian in single precision
        assert table.window_sum(0.0, 0.0, [0.0, 10.0, 30.0]) == pytest.approx(1.0, abs=1e-6)
        assert table.error["far"] == 0.0 or table.error["far"] < 1e-3
        one_sigma = table.window_sum(1 / table.sigma, 0.0, 10.0)
        assert one_sigma == pytest.approx(np.exp(-1.0), abs=1e-6)


FINE = rough_patch((96, 96), (0.05, 0.05), 0.3)
SEVERAL = {
    "others": [PATCH, *(rough_patch((64, 63), (0.08, 0.075), 0.25, seed=n) for n in (2, 3))],
    "other pixels": [HeightField(FINE.heights[::2, ::2], 0.1), FINE],
}


@pytest.mark.parametrize("patches", SEVERAL.values(), ids=SEVERAL)
def test_more_heights_than_one_patch_are_averaged(patches):
    table = DiffractionTable.build(patches, tolerance=1e-4, **DEFAULTS)
    assert max(relative_error(table, *patches)) <= 1e-4
    assert [p["digest"] for p in table.source["patches"]] == [p.digest() for p in patches]
    assert 0.0 < table.source["variation"] < 2.0  # std over mean of speckle is near 1


@pytest.mark.parametrize("coherence", reference.COHERENCES)
@pytest.mark.parametrize("depth", [1e-3, 1e-12, 1e-38])
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
@pytest.mark.parametrize("depth", [0.05, 1.2])
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


def test_a_window_far_narrower_than_the_patch_gets_all_its_taps():
    """The first guess of 47 taps falls short; one more at a time, the attempts would not last."""
    field = gratings.blazed(2.5, 0.25, periods=8, pixels_per_period=32)
    table = DiffractionTable.build(field, coherence_width=1.6)
    assert table.grid.taps[0] > 50
    assert max(relative_error(table, field)) <= table.tolerance
