"""The BSDF of a thin sheet in all variants, its samples and derivatives, and Fresnel's sheet."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction import OrderTable
from mitsuba_diffraction.optics.colour import linear_srgb, response
from mitsuba_diffraction.orders import Band, CellResponse, cells
from mitsuba_diffraction.reference.through import flat_transmittances
from tests.support.chi_square import DISPERSED, Case, chi_square
from tests.support.orders import (
    PERIOD,
    lit_pairs,
    load,
    on_all_sides,
    reference_on_all_sides,
    thin_grating,
)
from tests.support.transmitting import OneSide
from tests.support.variants import evaluate, interaction

pytestmark = pytest.mark.thorough

SHEET = thin_grating(thin=True)


def test_every_variant_has_the_same_light(every_variant):
    n = 4 if "scalar" in every_variant else 12
    wi, wo, samples, wavelength = lit_pairs(n)
    wi, wo = on_all_sides(wi, wo)
    if not mi.is_spectral:
        wavelength = np.full((n, 4), 600.0)
    values, pdf, _, _, _, drawn_pdf, weight = evaluate(
        load(SHEET, wavelength=600.0), wi, wo, samples, wavelength
    )
    lam = np.tile(np.arange(380.5, 780.0), (n, 1)) if mi.is_rgb else wavelength[:, : len(values[0])]
    count = lam.shape[1]
    lanes = np.repeat(wi, count, axis=0), np.repeat(wo, count, axis=0), lam.ravel()
    expected = reference_on_all_sides(SHEET, *lanes).reshape(lam.shape)
    if mi.is_rgb:
        expected = expected @ linear_srgb(response(lam[0]))
    # as for reflection: interpolation in cells, and in RGB efficiencies at the middle of each lobe
    tolerance = 1e-2 if mi.is_rgb else 3e-3
    assert np.abs(values - expected).sum() <= tolerance * np.abs(expected).sum()
    assert pdf.min() >= 0.0
    assert np.all(drawn_pdf > 0.0)
    assert np.isfinite(weight).all()


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_density_is_that_of_the_samples_on_either_side(some_variant, side):
    # a window of three periods: lobes that overlap, and wide enough for the histogram
    bsdf = OneSide(load(SHEET, coherence_width=3.0 * PERIOD), side)
    test = chi_square(bsdf, Case(None, 30.0, DISPERSED), samples=1 << 19)
    # 1 % for both sides together; the numbers drawn are always the same
    assert test.run(0.01, 2, quiet=True), test.messages


def flat_sheet(index: float) -> OrderTable:
    """Fresnel's sheet, at many nodes."""
    wavelengths = (380.0, 780.0)

    def kind(k: int, kind: int) -> np.ndarray:
        channels = np.arange(k + 1 - kind)
        grid = np.meshgrid(*(cells.nodes(n) for n in (10, 8, 4)), indexing="ij")
        tau, rho, w = (part[..., None] for part in grid)
        lam = cells.wavelength_of(k + cells.sine_squared(rho), w, wavelengths, 0.4)
        light = cells.from_cell(k, kind, channels, tau, rho, lam, 0.4)
        cosine = np.sqrt(np.maximum(1.0 - light.x**2 - light.y**2, 0.0))
        through = flat_transmittances(cosine, index, True).mean(axis=0)
        blocks = [[1.0 - through, through], [through, 1.0 - through]]
        each = [[part[..., None] * np.eye(len(channels)) for part in row] for row in blocks]
        values = np.block(each)
        return np.stack([values, 0.0 * values], axis=-1).astype(np.float32)

    last = cells.largest_band(wavelengths, 0.4)
    bands = tuple(
        Band(k, kind(k, cells.A), kind(k, cells.B) if k else None) for k in range(last + 1)
    )
    return OrderTable((0.4, np.inf), wavelengths, CellResponse(bands), thin=True)


def test_a_flat_sheet_passes_on_all_light_as_the_plugin_thindielectric(some_variant):
    solved = load(flat_sheet(1.5))
    plain = mi.load_dict({"type": "thindielectric", "int_ior": 1.5, "ext_ior": 1.0})
    n = 1 << 13
    for theta in (20.0, 110.0, 60.0):
        angle = np.radians(theta)
        wi = np.tile([np.sin(angle) * 0.6, np.sin(angle) * 0.8, np.cos(angle)], (n, 1))
        si = interaction(wi, np.full((n, 4), 550.0))
        random = mi.PCG32(size=n)
        numbers = [random.next_float32() for _ in range(3)]
        passed = []
        for bsdf in (solved, plain):
            sample, weight = bsdf.sample(mi.BSDFContext(), si, numbers[0], mi.Point2f(*numbers[1:]))
            weight, below = np.array(weight[0]), np.array(sample.wo.z) * wi[:, 2] < 0.0
            # no light is lost, but for parts of lobes beyond the horizon, and half floats
            assert weight.mean() == pytest.approx(1.0, abs=3e-3)
            passed.append((weight * below).mean())
        # the same numbers; five standard errors of two sums of 2^13 samples
        assert passed[0] == pytest.approx(passed[1], abs=5.0 * np.sqrt(2.0) * 0.5 / np.sqrt(n))
